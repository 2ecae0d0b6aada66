-- Where the time of every callback goes. duration = execution + preempted + blocked + wake delay,
-- where the kernel's events show the parts.
SELECT logical_id, pid, count(*) AS runs, count(execution_ns) AS runs_with_parts,
  sum(CASE WHEN release_source IN ('exact', 'timer_grid') THEN start_ns - release_ns END) AS waited_sum_ns,
  sum(CASE WHEN execution_ns IS NOT NULL THEN end_ns - start_ns END) AS duration_sum_ns,
  sum(execution_ns) AS execution_sum_ns, sum(preempted_ns) AS preempted_sum_ns,
  sum(blocked_ns) AS blocked_sum_ns, sum(wake_delay_ns) AS wake_delay_sum_ns, host
FROM instances
WHERE end_ns IS NOT NULL
GROUP BY callback_index, host, logical_id, pid
ORDER BY logical_id, pid, host
