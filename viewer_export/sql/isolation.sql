-- How many callbacks had a thread of their own, how many had not, and how many never ran. unknown: they
-- ran on threads that the trace does not name.
SELECT host, coalesce(isolation, 'unknown') AS state, count(*) AS number, sum(instances) AS runs
FROM callbacks
GROUP BY host, state
ORDER BY host, state
