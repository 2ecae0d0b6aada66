-- Who takes whose messages, and how long they are on their way. from_* NULL: from outside the
-- callbacks of the recording.
SELECT to_logical_id, to_pid, topic, from_logical_id, from_pid, messages,
  communication_ns_count, communication_ns_min, communication_ns_max, communication_ns_sum, to_host, from_host
FROM edges
ORDER BY to_logical_id, to_pid, to_host, topic, messages DESC, coalesce(from_logical_id, ''), coalesce(from_pid, 0),
  coalesce(from_host, '')
