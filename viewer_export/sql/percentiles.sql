-- Response time of every callback: exact percentiles by nearest rank, the value at place ceil(p * n).
-- 100 * (place - 1) < 99 * n holds up to that place, without rounding.
SELECT logical_id, pid, max(n) AS instances, min(response_ns) AS min_ns,
  max(CASE WHEN 100 * (place - 1) < 50 * n THEN response_ns END) AS p50_ns,
  max(CASE WHEN 100 * (place - 1) < 90 * n THEN response_ns END) AS p90_ns,
  max(CASE WHEN 100 * (place - 1) < 99 * n THEN response_ns END) AS p99_ns,
  max(response_ns) AS max_ns, host
FROM (
  SELECT host, logical_id, pid, callback_index, end_ns - release_ns AS response_ns,
    row_number() OVER (PARTITION BY callback_index ORDER BY end_ns - release_ns) AS place,
    count(*) OVER (PARTITION BY callback_index) AS n
  FROM instances
  WHERE release_source IN ('exact', 'timer_grid') AND end_ns IS NOT NULL) AS ranked
GROUP BY callback_index, host, logical_id, pid
ORDER BY logical_id, pid, host
