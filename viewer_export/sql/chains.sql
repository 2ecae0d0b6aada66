-- Chains: how much of the summed path latency passes in callbacks and how much between them. What an unknown release
-- leaves undivided is in the table chains: undivided_ns_sum.
SELECT chain, coalesce(pid, 0) AS process, coalesce(host, '') AS host_name, count(*) AS hops, max(processing_ns_count) AS instances,
  sum(processing_ns_sum) AS in_callbacks_ns, sum(communication_ns_sum) AS between_ns
FROM chain_hops
GROUP BY chain, pid, host
ORDER BY chain, process, host_name
