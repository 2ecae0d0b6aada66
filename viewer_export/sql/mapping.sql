-- Which thread ran which callback, and whether they belong to each other alone: a callback is
-- isolated where both counts are 1. One that is not here never ran: isolation.sql.
SELECT logical_id, pid, tid, thread, instances, callbacks_of_thread, threads_of_callback, host
FROM (
  SELECT logical_id, pid, tid, thread, instances, callbacks_of_thread, host
  FROM callback_threads
  JOIN (
    SELECT host, pid, tid, count(*) AS callbacks_of_thread
    FROM callback_threads
    GROUP BY host, pid, tid) AS by_thread USING (host, pid, tid)) AS with_callbacks
JOIN (
  SELECT host, logical_id, pid, count(*) AS threads_of_callback
  FROM callback_threads
  GROUP BY host, logical_id, pid) AS by_callback USING (host, logical_id, pid)
ORDER BY logical_id, pid, tid, host
