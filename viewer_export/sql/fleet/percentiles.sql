-- Response time by software version and callback, over all recordings: the histograms' counts add up,
-- and the percentiles (nearest rank) are those that one analysis of everything would print, within 0.8 %.
-- quantity: response_time_ns where the release is exact, response_time_lower_ns and _upper_ns where
-- it has bounds.
SELECT software, logical_id, quantity, max(n) AS instances, min(low_ns) AS min_ns,
  greatest(min(low_ns), least(max(high_ns), min(CASE WHEN 100 * upto >= 50 * n THEN value_ns END))) AS p50_ns,
  greatest(min(low_ns), least(max(high_ns), min(CASE WHEN 100 * upto >= 90 * n THEN value_ns END))) AS p90_ns,
  greatest(min(low_ns), least(max(high_ns), min(CASE WHEN 100 * upto >= 99 * n THEN value_ns END))) AS p99_ns,
  greatest(min(low_ns), least(max(high_ns), min(CASE WHEN 1000 * upto >= 999 * n THEN value_ns END))) AS p99_9_ns,
  max(high_ns) AS max_ns
FROM (
  SELECT software, logical_id, quantity, value_ns, low_ns, high_ns,
    sum(instances) OVER (PARTITION BY software, logical_id, quantity ORDER BY value_ns) AS upto,
    sum(instances) OVER (PARTITION BY software, logical_id, quantity) AS n
  FROM (
    SELECT software, logical_id, quantity, value_ns, sum(count) AS instances,
      min(min_ns) AS low_ns, max(max_ns) AS high_ns
    FROM histograms
    WHERE quantity IN ('response_time_ns', 'response_time_lower_ns', 'response_time_upper_ns')
      AND (SELECT missing FROM check_histograms) = 0
    GROUP BY software, logical_id, quantity, value_ns) AS buckets) AS ranked
GROUP BY software, logical_id, quantity
ORDER BY software, logical_id, quantity
