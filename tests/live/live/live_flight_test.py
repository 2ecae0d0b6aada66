#!/usr/bin/env python3
"""`cie live --save-snapshot`: a flight recorder saves what led to a violation that the live view sees."""
import os
import signal
import subprocess
import unittest

import support
from support import CIE, TIMER, TRACED_APP, Running, live, wait_for  # first: it says where the others are
from cie import Cie
from recording import manifest_of

cie = Cie(CIE)


def reason_of(snapshot):
    return manifest_of(snapshot)["snapshot"]["reason"]


def is_violated(line, rule, subjects=None):
    return any(verdict["rule"] == rule and verdict["verdict"] == "FAIL" and (not subjects or verdict["subject"] in subjects)
               for verdict in line["verdicts"])


class Flight(unittest.TestCase):
    def fly(self, name):
        """A flight recorder that runs, and its directory."""
        directory = support.scratch / name
        recorder = Running(self, [CIE, "record", "--attach", "--snapshot", "5", "-o", directory])
        wait_for(lambda: "[active snapshot]" in subprocess.run(["lttng", "--no-sessiond", "list"], capture_output=True,
                                                               text=True, check=False).stdout, "the flight recorder", 60)
        wait_for((directory / "recorder.pid").exists, "its directory", 60)
        return recorder, directory

    def watch(self, directory, *arguments):
        watching = Running(self, [CIE, "live", "--json", "--interval", "0.2", "--save-snapshot", directory, *arguments])
        watching.snapshot()  # connected
        return watching

    def run_app(self, *arguments):
        return Running(self, [TRACED_APP, "--until-signal", *map(str, arguments)],
                       env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"})

    def stop(self, watching):
        """What it said besides its lines."""
        watching.process.send_signal(signal.SIGINT)
        _, said = watching.process.communicate(timeout=60)
        self.assertEqual(watching.process.returncode, 0, said)
        return said

    def test_a_violation_is_saved_once_and_is_in_the_snapshot(self):
        _, directory = self.fly("violation")
        watching = self.watch(directory, "--min-interval", "0", "--max-snapshots", "1000")
        self.run_app()  # runs both its callbacks on one thread
        snapshot = directory / "snapshot-001"
        watching.until(lambda _: snapshot.exists(), 60)
        self.assertEqual(cie.verdicts(snapshot)["M2"], "FAIL")
        self.assertRegex(reason_of(snapshot), r"^on command: .*M2")
        seen = watching.snapshot()["events"]
        watching.until(lambda line: line["events"] > seen + 2000, 60)  # it goes on violating the rule
        said = self.stop(watching)
        self.assertRegex(said, rf"cie live: saved {snapshot} \(.*M2")
        self.assertEqual(said.count("M2"), 1, said)

    def test_no_more_are_saved_than_was_asked_for(self):
        _, directory = self.fly("limits")
        watching = self.watch(directory, "--max-snapshots", "1", "--min-interval", "0")
        self.run_app("--period-us", 1000)
        watching.until(lambda line: is_violated(line, "M2"), 60)
        watching.until(lambda _: (directory / "snapshot-001").exists(), 60)
        self.run_app("--period-us", 1000)  # another thread that violates it
        watching.until(lambda line: len({v["subject"] for v in line["verdicts"] if v["rule"] == "M2"}) == 2, 60)
        said = self.stop(watching)
        self.assertFalse((directory / "snapshot-002").exists())
        self.assertRegex(said, r"--max-snapshots forbade it to save \d+ times more")

    def test_a_deadline_that_only_the_spec_knows_is_saved(self):
        _, directory = self.fly("deadline")
        spec = support.scratch / "deadline.yaml"
        spec.write_text(f"callback_groups:\n  - id: {TIMER}\n    response_deadline: 1000000\n", encoding="utf-8")
        watching = self.watch(directory, "--spec", spec, "--max-snapshots", "1")
        self.run_app("--work-us", 1500, "--period-us", 5000)
        snapshot = directory / "snapshot-001"
        watching.until(lambda _: snapshot.exists(), 60)
        self.stop(watching)
        self.assertIn("deadline", reason_of(snapshot))
        self.assertEqual(cie.verdicts(snapshot, "--spec", spec)["R3"], "FAIL")
        self.assertEqual(cie.verdicts(snapshot)["R3"], "NOT_APPLICABLE", "the application declares none")

    def test_a_flight_recorder_that_ended_is_told(self):
        recorder, directory = self.fly("gone")
        watching = self.watch(directory)
        recorder.end()
        self.run_app()
        watching.until(lambda line: is_violated(line, "M2"), 60)
        self.assertRegex(self.stop(watching), r"nothing was saved \(.*M2.*\): .*nobody keeps snapshots in")

    def test_what_cannot_be_is_refused(self):
        for wanted, arguments in (("nobody keeps snapshots in", ["--save-snapshot", support.scratch]),
                                  ("nobody keeps snapshots in", ["--save-snapshot", support.scratch / "absent"]),
                                  ("traced by nobody else", ["--save-snapshot", support.scratch, "--", "true"]),
                                  ("--min-interval goes with --save-snapshot", ["--min-interval", "1"]),
                                  ("--max-snapshots goes with --save-snapshot", ["--max-snapshots", "1"]),
                                  ("takes 1 to 1000000000", ["--save-snapshot", support.scratch, "--max-snapshots", "0"])):
            done = live("--json", *arguments)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(wanted, done.stderr)


if __name__ == "__main__":
    support.main("live-flight")
