-- percentiles.sql in the words of ClickHouse. The shards add up their own buckets.
SELECT software, logical_id, quantity, instances, low_ns AS min_ns,
  greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> 100 * upto >= 50 * instances, sums)])) AS p50_ns,
  greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> 100 * upto >= 90 * instances, sums)])) AS p90_ns,
  greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> 100 * upto >= 99 * instances, sums)])) AS p99_ns,
  greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> 1000 * upto >= 999 * instances, sums)])) AS p99_9_ns,
  high_ns AS max_ns
FROM (
  SELECT software, logical_id, quantity, sum(n) AS instances, min(low) AS low_ns, max(high) AS high_ns,
    arraySort(groupArray((value_ns, n))) AS buckets, arrayMap(b -> b.1, buckets) AS vals,
    arrayCumSum(arrayMap(b -> b.2, buckets)) AS sums
  FROM (
    SELECT software, logical_id, quantity, value_ns, sum(count) AS n, min(min_ns) AS low, max(max_ns) AS high
    FROM histograms
    WHERE quantity IN ('response_time_ns', 'response_time_lower_ns', 'response_time_upper_ns')
      AND (SELECT missing FROM check_histograms) = 0
    GROUP BY software, logical_id, quantity, value_ns)
  GROUP BY software, logical_id, quantity)
ORDER BY software, logical_id, quantity
