"""Tests that were skipped although they could have run here.

A test may skip only with a reason that begins with "not possible here:", which names what the kernel,
the machine or the user's rights lack. Anything else (a missing program, a missing build option) is
something ./run should have provided.
"""
import re
import xml.etree.ElementTree

ALLOWED = "not possible here:"
# Of ctest, where the test that makes ready what this one needs has failed.
UNFIXED = "Failed test dependencies:"
# A part of a test in Python, as unittest tells of it: "test_a (module.Class.test_a) ... skipped 'why'".
PART = re.compile(r"^(.*) \.\.\. skipped ['\"](.*)['\"]$", re.MULTILINE)
# A test of GoogleTest among others of its program: its lines from "RUN" on, without other tests.
GTEST_PART = re.compile(r"^\[ RUN {6}\] (.*)\n((?:(?!\[ RUN {6}\]).*\n)*?)\[  SKIPPED \] \1\b", re.MULTILINE)


def allowed(output):
    """The first line with an accepted reason; None where there is none."""
    return next((line.strip() for line in output.splitlines() if ALLOWED in line), None)


def check(results) -> int:
    """Prints the skips that a JUnit file tells of; returns how many have no accepted reason."""
    wrong = 0
    for case in xml.etree.ElementTree.parse(results).getroot().iter("testcase"):
        output = case.findtext("system-out") or ""
        parts = [(part, reason if reason.startswith(ALLOWED) else None) for part, reason in PART.findall(output)]
        parts += [(part, allowed(lines)) for part, lines in GTEST_PART.findall(output)]
        lacks_fixture = UNFIXED in output  # nobody skipped it: another test failed, which is told as that
        if not parts and not lacks_fixture and (
                case.find("skipped") is not None or case.get("status") in ("notrun", "disabled")):
            parts = [("all of it", allowed(output))]
        for part, reason in parts:
            print(f"skipped: {case.get('name')}: {part}: {reason or 'NO ACCEPTED REASON'}")
            wrong += reason is None
    return wrong
