-- Callbacks by software version: in how many recordings each had a thread of its own, had not, or never
-- ran, and one recording where it had not.
SELECT software, logical_id, count(*) AS recordings,
  sum(CASE WHEN isolation = 'isolated' THEN 1 ELSE 0 END) AS isolated_in,
  sum(CASE WHEN isolation = 'not_isolated' THEN 1 ELSE 0 END) AS not_isolated_in,
  sum(CASE WHEN isolation = 'never_ran' THEN 1 ELSE 0 END) AS never_ran_in,
  max(CASE WHEN isolation = 'not_isolated' THEN recording ELSE '' END) AS example
FROM callbacks
WHERE (SELECT missing FROM check_callbacks) = 0
GROUP BY software, logical_id
ORDER BY software, logical_id
