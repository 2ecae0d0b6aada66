#!/usr/bin/env python3
"""Who has no kernel events of cie's records them with perf: both are then one recording."""

import argparse
import csv
import io
import json
import shutil
import statistics
import subprocess
import sys
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from system_package import lacking  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
INSTANCES = 100


def run(command):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=200,
                          check=False)


def perf_record(data, *arguments, command):
    return run(["perf", "record", "-a", "-e", "sched:sched_switch", "-e", "sched:sched_waking",
                "-e", "sched:sched_wakeup", *arguments, "-o", data, "--", *command])


class Perf(unittest.TestCase):
    """One run of an application, recorded by both."""

    @classmethod
    def setUpClass(cls):
        if shutil.which("perf") is None:
            raise unittest.SkipTest(lacking("linux-perf"))
        probe = perf_record(scratch / "probe.data", command=["true"])
        if probe.returncode != 0:
            raise unittest.SkipTest("not possible here: perf may not record: "
                                    + " ".join(probe.stderr.split())[:200])
        cls.recording = scratch / "recording"
        done = perf_record(
            scratch / "perf.data", "-k", "CLOCK_MONOTONIC",
            command=[options.programs / "cie-record", "--kernel=no", "-o", cls.recording, "--",
                     options.application, "--instances", INSTANCES, "--work-us", 1000])
        assert done.returncode == 0, done.stderr
        cls.perf = scratch / "perf"
        done = run(["perf", "data", "convert", "-i", scratch / "perf.data", "--to-ctf", cls.perf,
                    "--tod"])
        assert done.returncode == 0, done.stderr

    def report(self, *traces):
        done = run([options.programs / "cie", "report", "--format", "json", *traces])
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def instances(self, *traces):
        done = run([options.programs / "cie", "instances", *traces])
        self.assertEqual(done.returncode, 0, done.stderr)
        return list(csv.DictReader(io.StringIO(done.stdout)))

    def test_times_of_both_are_of_one_clock(self):
        report = self.report(self.recording, self.perf)
        self.assertNotIn("clocks-unrelated", [defect["kind"] for defect in report["defects"]])

    def test_the_tracepoints_alone_measure_no_execution(self):
        measured = [i for i in self.instances(self.recording) if i["execution_ns"]]
        self.assertEqual(measured, [])

    def test_perf_tells_what_an_instance_executed(self):
        every = self.instances(self.recording, self.perf)
        self.assertEqual(len(every), 2 * INSTANCES)
        measured = [i for i in every if i["execution_ns"]]
        self.assertTrue(measured)  # not all: perf misses switches on some machines
        for i in measured:
            parts = [int(i[f"{part}_ns"])
                     for part in ("execution", "preempted", "blocked", "wake_delay")]
            self.assertEqual(sum(parts), int(i["end_ns"]) - int(i["start_ns"]), i)
        # Its thread saw itself use 1 ms; the kernel's account of that begins and ends microseconds, or
        # a host's whim, away from the switches.
        executed = [int(i["execution_ns"]) for i in measured if "Timer" in i["logical_id"]]
        self.assertGreaterEqual(statistics.median(executed), 990_000)


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--application", type=Path, required=True)
    options, rest = parser.parse_known_args()
    isolated_main.main("perf", rest, begin)
