-- Does enforcement hold? The rules about the mapping of callbacks to threads (M1 to M9), by software
-- version: in how many recordings they were judged, violated without being suppressed, or left
-- undecided; how many subjects violated them, and one recording where one did.
SELECT software, rule, name, count(*) AS recordings, sum(is_violated) AS violated, sum(is_undecided) AS undecided,
  sum(violated_subjects) AS violations, max(CASE WHEN is_violated = 1 THEN recording ELSE '' END) AS example
FROM (
  SELECT software, rule, name, recording,
    sum(CASE WHEN verdict = 'FAIL' AND NOT suppressed THEN 1 ELSE 0 END) AS violated_subjects,
    max(CASE WHEN verdict = 'FAIL' AND NOT suppressed THEN 1 ELSE 0 END) AS is_violated,
    max(CASE WHEN verdict = 'INCONCLUSIVE' THEN 1 ELSE 0 END) AS is_undecided
  FROM verdicts
  WHERE rule LIKE 'M%' AND verdict <> 'NOT_APPLICABLE' AND (SELECT missing FROM check_verdicts) = 0
  GROUP BY software, rule, name, recording) AS judged
GROUP BY software, rule, name
ORDER BY software, rule
