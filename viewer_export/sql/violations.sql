-- Verdicts that stand against the recording, and what the first evidence of each says.
SELECT rule, subject, verdict, checked, evidence, first_time_ns, first_note
FROM verdicts
WHERE verdict IN ('FAIL', 'INCONCLUSIVE') AND NOT suppressed
ORDER BY rule, subject
