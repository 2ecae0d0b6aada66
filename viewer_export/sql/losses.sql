-- What is wrong with the trace itself: numbers rest on what was seen.
SELECT severity, kind, count
FROM losses
ORDER BY severity, kind
