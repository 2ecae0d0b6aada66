-- The twenty slowest responses of all recordings, whose they are, and where their time went (NULL:
-- no kernel events). Of those that the reports count.
SELECT software, coalesce(host, '') AS host_name, process, recording, logical_id, pid, seq,
  end_ns - release_ns AS response_ns, start_ns - release_ns AS waited_ns,
  execution_ns, preempted_ns, blocked_ns, wake_delay_ns
FROM instances
WHERE release_source IN ('exact', 'timer_grid') AND counted AND (SELECT missing FROM check_instances) = 0
ORDER BY response_ns DESC, recording, logical_id, pid, seq
LIMIT 20
