-- percentiles.sql in the words of ClickHouse. Its own quantileExact takes the place floor(p * n) + 1,
-- which is one further where p * n is a whole number.
SELECT logical_id, pid, count(*) AS instances, sorted[1] AS min_ns,
  sorted[intDiv(50 * instances + 99, 100)] AS p50_ns,
  sorted[intDiv(90 * instances + 99, 100)] AS p90_ns,
  sorted[intDiv(99 * instances + 99, 100)] AS p99_ns,
  sorted[instances] AS max_ns, host,
  arraySort(groupArray(end_ns - release_ns)) AS sorted
FROM instances
WHERE release_source IN ('exact', 'timer_grid') AND end_ns IS NOT NULL
GROUP BY callback_index, host, logical_id, pid
ORDER BY logical_id, pid, host
