"""Tests that were skipped although they could have run here.

A test may skip only with a reason that begins with "not possible here:", which names what the kernel,
the machine or the user's rights lack. Anything else (a missing program, a missing build option) is
something ./run should have provided.
"""
import re
import xml.etree.ElementTree

ALLOWED = "not possible here:"
# A part of a test in Python, as unittest tells of it: "test_a (module.Class.test_a) ... skipped 'why'".
PART = re.compile(r"^(.*) \.\.\. skipped ['\"](.*)['\"]$", re.MULTILINE)


def check(results) -> int:
    """Prints the skips that a JUnit file tells of; returns how many have no accepted reason."""
    wrong = 0
    for case in xml.etree.ElementTree.parse(results).getroot().iter("testcase"):
        output = case.findtext("system-out") or ""
        for part, reason in PART.findall(output):
            is_allowed = reason.startswith(ALLOWED)
            print(f"skipped: {case.get('name')}: {part}: {reason if is_allowed else 'NO ACCEPTED REASON'}")
            wrong += not is_allowed
        if case.find("skipped") is None and case.get("status") not in ("notrun", "disabled"):
            continue
        reason = next((line.strip() for line in output.splitlines() if ALLOWED in line), None)
        print(f"skipped: {case.get('name')}: {reason or 'NO ACCEPTED REASON'}")
        wrong += reason is None
    return wrong
