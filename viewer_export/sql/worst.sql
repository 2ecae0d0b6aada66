-- The twenty slowest responses, and where their time went (NULL: no kernel events).
SELECT logical_id, pid, tid, seq, end_ns - release_ns AS response_ns, start_ns - release_ns AS waited_ns,
  execution_ns, preempted_ns, blocked_ns, wake_delay_ns, host
FROM instances
WHERE release_source IN ('exact', 'timer_grid') AND end_ns IS NOT NULL
ORDER BY response_ns DESC, logical_id, pid, seq, host
LIMIT 20
