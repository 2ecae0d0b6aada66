-- regressions.sql in the words of ClickHouse.
SELECT logical_id, quantity, per_mille, before.2 AS software_before, after.2 AS software_after,
  before.3 AS n_before, after.3 AS n_after, before.4 AS before_ns, after.4 AS after_ns,
  before.6 AS before_at_most_ns, after.5 AS after_at_least_ns
FROM (
  SELECT logical_id, quantity, per_mille,
    arraySort(groupArray((first_ns, software, n, estimate_ns, lower_ns, upper_ns))) AS versions
  FROM (
    SELECT software, logical_id, quantity, per_mille, n,
      greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> upto >= n * per_mille / 1000.0, sums)])) AS estimate_ns,
      floor(n * (per_mille / 1000.0) - 3.2905 * sqrt(n * (per_mille / 1000.0) * (1 - per_mille / 1000.0))) AS lower_rank,
      floor(n * (per_mille / 1000.0) + 3.2905 * sqrt(n * (per_mille / 1000.0) * (1 - per_mille / 1000.0))) + 1 AS upper_rank,
      if(lower_rank >= 1, greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> upto >= lower_rank, sums)])),
        toInt64(-9223372036854775807)) AS lower_ns,
      if(upper_rank <= n, greatest(low_ns, least(high_ns, vals[arrayFirstIndex(upto -> upto >= upper_rank, sums)])),
        toInt64(9223372036854775807)) AS upper_ns
    FROM (
      SELECT software, logical_id, quantity, sum(instances) AS n, min(low) AS low_ns, max(high) AS high_ns,
        arraySort(groupArray((value_ns, instances))) AS buckets, arrayMap(b -> b.1, buckets) AS vals,
        arrayCumSum(arrayMap(b -> b.2, buckets)) AS sums
      FROM (
        SELECT software, logical_id, quantity, value_ns, sum(count) AS instances, min(min_ns) AS low, max(max_ns) AS high
        FROM histograms
        WHERE quantity IN ('response_time_ns', 'start_latency_ns', 'duration_ns')
          AND (SELECT missing FROM check_histograms) = 0
        GROUP BY software, logical_id, quantity, value_ns)
      GROUP BY software, logical_id, quantity)
    ARRAY JOIN [500, 990] AS per_mille)
  ALL INNER JOIN (
    SELECT software, assumeNotNull(coalesce(min(begin_realtime_ns), 0)) AS first_ns FROM recordings
    WHERE (SELECT missing FROM check_recordings) = 0
    GROUP BY software) USING (software)
  GROUP BY logical_id, quantity, per_mille)
ARRAY JOIN arrayPopBack(versions) AS before, arrayPopFront(versions) AS after
WHERE before.6 < toInt64(9223372036854775807) AND after.5 > before.6 * 1.05
ORDER BY logical_id, quantity, per_mille, after.1, software_after
