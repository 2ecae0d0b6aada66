-- Callbacks that were late, as the report counts them: releases skipped (timers; NULL for others), and
-- instances beyond the deadline, which is the spec's, else the callback's own (NULL: there is none).
SELECT logical_id, pid, missed_releases, response_deadline_ns, instances AS judged, late, host
FROM callbacks
ORDER BY logical_id, pid, host
