-- What became slower with a software version, beyond a tolerance of 5 % and beyond chance: each
-- version of a callback beside the one before it, in the order of their first recordings.
-- The statistic is that of `cie diff`: the median and the 99th percentile have confidence intervals
-- by order statistics, of ranks n p -+ 3.2905 sqrt(n p (1 - p)) (0.1 % error, normal approximation);
-- worse where the whole interval after lies above the whole one before and its tolerance. NULL: too
-- few instances to have that bound.
SELECT logical_id, quantity, per_mille, software_before, software AS software_after, n_before, n AS n_after,
  before_ns, estimate_ns AS after_ns, upper_before_ns AS before_at_most_ns, lower_ns AS after_at_least_ns
FROM (
  SELECT *, lag(software) OVER versions AS software_before, lag(n) OVER versions AS n_before,
    lag(estimate_ns) OVER versions AS before_ns, lag(upper_ns) OVER versions AS upper_before_ns
  FROM (
    SELECT software, logical_id, quantity, per_mille, max(total) AS n,
      greatest(min(low_ns), least(max(high_ns), min(CASE WHEN upto >= total * per_mille / 1000.0 THEN value_ns END))) AS estimate_ns,
      CASE WHEN max(lower_rank) >= 1 THEN greatest(min(low_ns), least(max(high_ns),
        min(CASE WHEN upto >= lower_rank THEN value_ns END))) END AS lower_ns,
      CASE WHEN max(upper_rank) <= max(total) THEN greatest(min(low_ns), least(max(high_ns),
        min(CASE WHEN upto >= upper_rank THEN value_ns END))) END AS upper_ns
    FROM (
      SELECT *, floor(total * (per_mille / 1000.0) - 3.2905 * sqrt(total * (per_mille / 1000.0) * (1 - per_mille / 1000.0))) AS lower_rank,
        floor(total * (per_mille / 1000.0) + 3.2905 * sqrt(total * (per_mille / 1000.0) * (1 - per_mille / 1000.0))) + 1 AS upper_rank
      FROM (
        SELECT software, logical_id, quantity, value_ns, low_ns, high_ns,
          sum(instances) OVER (PARTITION BY software, logical_id, quantity ORDER BY value_ns) AS upto,
          sum(instances) OVER (PARTITION BY software, logical_id, quantity) AS total
        FROM (
          SELECT software, logical_id, quantity, value_ns, sum(count) AS instances,
            min(min_ns) AS low_ns, max(max_ns) AS high_ns
          FROM histograms
          WHERE quantity IN ('response_time_ns', 'start_latency_ns', 'duration_ns')
            AND (SELECT missing FROM check_histograms) = 0
          GROUP BY software, logical_id, quantity, value_ns) AS buckets) AS sums
      CROSS JOIN (SELECT 500 AS per_mille UNION ALL SELECT 990) AS quantiles) AS ranks
    GROUP BY software, logical_id, quantity, per_mille) AS intervals
  JOIN (
    SELECT software, coalesce(min(begin_realtime_ns), 0) AS first_ns FROM recordings
    WHERE (SELECT missing FROM check_recordings) = 0
    GROUP BY software) AS since USING (software)
  WINDOW versions AS (PARTITION BY logical_id, quantity, per_mille ORDER BY first_ns, software)) AS pairs
WHERE lower_ns > upper_before_ns * 1.05
ORDER BY logical_id, quantity, per_mille, first_ns, software
