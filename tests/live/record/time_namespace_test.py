#!/usr/bin/env python3
"""A process in a time namespace: its clock is not the machine's, and what is recorded of it is not taken for what
it is not. Arguments: PROGRAMS APPLICATION (traced_app)."""

import json
import subprocess
import sys
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie, rules_of, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, APPLICATION = (Path(argument).resolve() for argument in sys.argv[1:3])
cie = Cie(PROGRAMS / "cie")
APART = ["unshare", "--time", "--monotonic=1000", "--fork"]
AHEAD_NS = 1000 * 10**9
scratch: Path


class TimeNamespace(unittest.TestCase):
    def recorded(self, name, *command, kernel="no"):
        name = f"{self.id().rsplit('.', 1)[-1]}_{name}"
        if subprocess.run([*APART, "true"], capture_output=True, check=False).returncode != 0:
            self.skipTest("not possible here: a time namespace")
        directory = scratch / name
        done = cie.run("record", "-o", directory, f"--kernel={kernel}", "--", *command)
        if "--kernel=yes: " in done.stderr:
            self.skipTest(f"not possible here: {done.stderr}")
        self.assertEqual(done.returncode, 0, done.stderr)
        return directory

    def violated(self, verdicts):
        """But for rules about time, which how busy the machine is may violate."""
        return {rule for rule, verdict in verdicts.items() if verdict == "FAIL"} - {"R1", "R2", "R3"}

    def violated_without_namespace(self):
        """By what the application does (it runs callbacks on one thread), whatever its clock."""
        return self.violated(verdicts_of(cie.json("verify", self.recorded("plain", APPLICATION, "--instances", "20"))))

    def test_run_begin_has_the_offset(self):
        directory = self.recorded("offset", *APART, APPLICATION, "--instances", "20")
        events = [json.loads(line) for line in cie.text("events", directory, "-f", "json").splitlines()]
        begins = [event for event in events if event["name"] == "cie:run_begin"]
        self.assertEqual({begin["fields"]["monotonic_offset_ns"] for begin in begins}, {AHEAD_NS})
        self.assertEqual(self.violated(verdicts_of(cie.json("verify", directory))), self.violated_without_namespace())

    def test_the_kernels_events_are_no_evidence(self):
        directory = self.recorded("kernel", *APART, APPLICATION, "--instances", "200", kernel="yes")
        judged = cie.json("verify", directory)
        verdicts = verdicts_of(judged)
        self.assertEqual(self.violated(verdicts), self.violated_without_namespace(), judged)
        self.assertEqual(verdicts["T6"], "INCONCLUSIVE")
        evidence = rules_of(judged)["T6"]["subjects"][0]["evidence"]
        self.assertTrue(any("is in a time namespace" in item["note"] for item in evidence), evidence)

    def test_beside_another_process_nothing_is_decided(self):
        both = '"$@" & sh -c \'exec "$0" --instances 200\' "$APP"; wait'
        directory = self.recorded("beside", "env", f"APP={APPLICATION}", "sh", "-c", both, "sh", *APART, APPLICATION,
                                  "--instances", "200")
        verdicts = verdicts_of(cie.json("verify", directory))
        self.assertEqual(verdicts["T6"], "INCONCLUSIVE")
        self.assertEqual(verdicts["M2"], "INCONCLUSIVE")
        self.assertNotIn("FAIL", verdicts.values(), verdicts)


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("time_namespace", [], begin)
