#!/usr/bin/env python3
"""Runs the tests of a build tree and says at the end what failed, and why.

    suite.py TREE RESULTS [OPTION of ctest]...

Writes RESULTS.xml (JUnit), RESULTS-again.xml of what ran again, and RESULTS.txt: the failures in short.

Tests of kind live and browser talk to daemons, other processes and a browser on a machine that others
use: there, a second's starvation can look like a defect. So it can where an installed program is run. One
that failed, or lacked such a one's fixture, runs once more when all others have ended, alone; it fails the
suite if it fails again, and is named loudly if it does not. What crashed, and what a sanitizer reported,
was no lack of time: it never runs again, and nothing does when many failed.
Tests of every other kind depend on nothing but the code, so they must pass at once.

A test may skip only for a reason that ./run cannot help (see skipped.py).
"""
import bisect
import re
import subprocess
import sys
import xml.etree.ElementTree
from dataclasses import dataclass
from pathlib import Path

import skipped

RUN_AGAIN = ("live.", "browser.", "package.outside_project", "package.first_program")
MOST_AGAIN = 10  # more are no accident
LINES_SHOWN = 60
# Of ctest's last words: "  565 - live.live_sources (Failed)", since CMake 3.31 with the test's labels.
FAILED = re.compile(r"^\s+\d+ - (.*) \(([A-Za-z ]+)\)(?: +[a-z][a-z -]*)?$", re.MULTILINE)
SANITIZER = re.compile(r"(Thread|Address|Leak|UndefinedBehavior)Sanitizer|runtime error:")
# Where GoogleTest, Python's unittest and assert() say what was wrong.
REASON = re.compile(r": Failure$|^\w*(Error|Exception|Expired)\b.*:|^(FAIL|ERROR): |Assertion .* failed|terminate called|"
                    + SANITIZER.pattern)
GTEST_LINES = 6  # after "file:line: Failure"


@dataclass
class Failure:
    name: str
    how: str  # Failed, Timeout, SEGFAULT, ...
    output: str = ""

    def may_run_again(self):
        lacks_fixture = self.how == "Not Run" and skipped.UNFIXED in self.output
        return (self.name.startswith(RUN_AGAIN) and (self.how in ("Failed", "Timeout") or lacks_fixture)
                and not SANITIZER.search(self.output))


def ctest(tree, results, options):
    """Runs ctest; returns whether it was content, and the failures."""
    log = results.with_suffix(".log")
    log.unlink(missing_ok=True)
    status = subprocess.run(
        ["ctest", "--test-dir", tree, "--no-tests=error", "--output-on-failure", "--test-output-size-passed", "1000000",
         "--test-output-size-failed", "1000000", "--output-junit", results.absolute(), "--output-log", log.absolute(), *options],
        check=False).returncode
    words = log.read_text("utf-8", errors="replace").rpartition("The following tests FAILED:")
    failures = [Failure(*found) for found in FAILED.findall(words[2])] if words[1] else []
    if results.exists():
        outputs = {case.get("name"): case.findtext("system-out") or "" for case in cases(results)}
        for failure in failures:
            failure.output = outputs.get(failure.name, "")
    return status == 0, failures


def cases(results):
    return xml.etree.ElementTree.parse(results).getroot().iter("testcase")


def reasons(failure):
    """The lines that say what was wrong, after the name of the test where a program has several; or the last lines."""
    lines = failure.output.rstrip().splitlines()
    begun = [at for at, line in enumerate(lines) if line.startswith("[ RUN ")]
    chosen = {}
    for at, line in enumerate(lines):
        if REASON.search(line):
            if len(begun) > 1 and begun[0] < at:
                chosen[begun[bisect.bisect(begun, at) - 1]] = None
            chosen.update(dict.fromkeys(range(at, at + (GTEST_LINES if line.endswith(": Failure") else 1))))
    picked = [lines[at] for at in sorted(chosen) if at < len(lines) and lines[at].strip()]
    return (picked or lines[-5:])[:20]


def exactly(names):
    """The names as a regular expression of ctest. Its numbers would not do: they depend on what was left out."""
    return "^(" + "|".join(re.sub(r"[][.*+?^$()|\\]", r"\\\g<0>", name) for name in names) + ")$"


def show(failures, title):
    for failure in failures:
        print(f"\n== {title}: {failure.name} ({failure.how}): the end of its output")
        print("\n".join(line[:500] for line in failure.output.rstrip().splitlines()[-LINES_SHOWN:]))


def briefly(failures, title):
    return "".join("\n".join([f"{title}: {failure.name} ({failure.how})",
                              *(f"    {line[:240]}" for line in reasons(failure)), ""]) for failure in failures)


def run(tree, results, options):
    first, second, brief = (Path(f"{results}{end}") for end in (".xml", "-again.xml", ".txt"))
    for file in (first, second, brief):
        file.unlink(missing_ok=True)
    is_content, failures = ctest(tree, first, options)
    again = [failure for failure in failures if failure.may_run_again()]
    if len(again) > MOST_AGAIN:
        again = []
    failed_twice = []
    if again:
        print(f"\n== run again, alone: {len(again)} of {len(failures)} failed tests", flush=True)
        is_content, failed_twice = ctest(tree, second, ["-j", "1", "-R", exactly(failure.name for failure in again)])
    twice = {failure.name for failure in failed_twice}
    passed_late = [failure for failure in again if failure.name not in twice]
    failed = [failure for failure in failures if failure not in again] + failed_twice
    wrong_skips = sum(skipped.check(file) for file in (first, second) if file.exists())
    show(passed_late, "failed at first")
    show(failed, "FAILED")
    text = briefly(passed_late, "passed only when run again") + briefly(failed, "FAILED")
    if wrong_skips:
        text += f"FAILED: {wrong_skips} skipped tests could have run here\n"
    if not is_content and not failed:
        text += "FAILED: ctest did not come to its end\n"
    brief.write_text(text, "utf-8")
    print("\n" + brief.read_text("utf-8"), end="", flush=True)
    return 1 if failed or wrong_skips or not is_content else 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[1], sys.argv[2], sys.argv[3:]))
