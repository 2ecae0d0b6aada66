-- Callbacks that were late: releases skipped (timers; NULL for others), and responses beyond the
-- deadline that the callback declares (NULL: it declares none). Exact releases only.
SELECT logical_id, pid, missed_releases, deadline_ns, count(response_ns) AS judged,
  sum(CASE WHEN response_ns > deadline_ns THEN 1 WHEN response_ns <= deadline_ns THEN 0 END) AS late, host
FROM callbacks
JOIN (
  SELECT callback_index, CASE WHEN release_source IN ('exact', 'timer_grid') THEN end_ns - release_ns END AS response_ns
  FROM instances
  WHERE end_ns IS NOT NULL) AS responses USING (callback_index)
GROUP BY callback_index, host, logical_id, pid, missed_releases, deadline_ns
ORDER BY logical_id, pid, host
