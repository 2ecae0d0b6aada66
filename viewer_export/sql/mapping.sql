-- Which thread ran which callback, and whether they belong to each other alone: a callback is
-- isolated where both counts are 1. One that is not here never ran: isolation.sql.
SELECT logical_id, pid, tid, thread, instances, callbacks_of_thread, threads_of_callback, host
FROM (
  SELECT logical_id, pid, tid, thread, instances, callbacks_of_thread, host, callback_index
  FROM callback_threads
  JOIN (
    SELECT thread_index, count(*) AS callbacks_of_thread
    FROM callback_threads
    GROUP BY thread_index) AS by_thread USING (thread_index)) AS with_callbacks
JOIN (
  SELECT callback_index, count(*) AS threads_of_callback
  FROM callback_threads
  GROUP BY callback_index) AS by_callback USING (callback_index)
ORDER BY logical_id, pid, tid, host
