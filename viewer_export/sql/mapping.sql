-- Which thread ran which callback, and whether they belong to each other alone: a callback is
-- isolated where both counts are 1.
SELECT logical_id, pid, tid, thread, instances, callbacks_of_thread, threads_of_callback
FROM (
  SELECT logical_id, pid, tid, thread, instances, callbacks_of_thread
  FROM callback_threads
  JOIN (
    SELECT pid, tid, count(*) AS callbacks_of_thread
    FROM callback_threads
    GROUP BY pid, tid) AS by_thread USING (pid, tid)) AS with_callbacks
JOIN (
  SELECT logical_id, pid, count(*) AS threads_of_callback
  FROM callback_threads
  GROUP BY logical_id, pid) AS by_callback USING (logical_id, pid)
ORDER BY logical_id, pid, tid
