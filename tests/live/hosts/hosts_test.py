#!/usr/bin/env python3
"""An application on two machines, recorded by both into one place: what the joint trace says.

In truth the machines share CLOCK_REALTIME (no namespace changes that): their difference is 0.
"""

import csv
import io
import signal
import unittest

import machines
from machines import HOST_APP, Network, cie, expected_code, report, verdicts, wait_for

TIMING = {"R1", "R2", "Q1"}  # rules that a busy machine violates
PING = "/desk@Subscription(/ping)"
PONG = "/robot@Subscription(/pong)"


class Hosts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        clocks = {"desk": 500_000} if machines.can_have_clocks() else {}
        network = Network(cls.addClassCleanup, "robot", "desk", monotonic=clocks)
        cls.all = machines.scratch / "all"
        collect = network.collect(cls.all)
        ready = {name: machines.scratch / f"{name}.ready" for name in ("robot", "desk")}
        recorders = [network[name].record(f"rec-{name}", HOST_APP, name, file) for name, file in ready.items()]
        for file in ready.values():
            wait_for(lambda file=file: file.exists() or any(r.process.poll() is not None for r in recorders), file.name)
        cls.statuses = [recorder.end() for recorder in recorders]
        cls.recorded = [recorder.said() for recorder in recorders]
        cls.status = collect.end(signal.SIGINT)
        cls.collected = collect.said()
        cls.report = report(cls.all)

    def test_everything_arrives(self):
        self.assertEqual(self.statuses, [0, 0], self.recorded)
        self.assertEqual(self.status, 0, self.collected)
        self.assertRegex(self.collected, r"receiving robot/cie-record-\d+")
        self.assertRegex(self.collected, r"desk/cie-record-\S+: \d+ packets\n")
        self.assertTrue(self.report["trace"]["complete"], self.report["defects"])
        self.assertEqual(self.report["trace"]["lost_events"], 0)

    def test_hosts_are_told_apart(self):
        self.assertEqual(self.report["trace"]["hosts"], ["desk", "robot"])
        self.assertEqual({p["host"] for p in self.report["processes"]}, {"desk", "robot"})
        self.assertEqual(len(self.report["processes"]), 2)
        # Their pids may well be the same.
        self.assertEqual(sorted((c["host"], c["logical_id"]) for c in self.report["callbacks"]),
                         [("desk", PING), ("robot", PONG), ("robot", "/robot@Timer(10000000)")])
        self.assertEqual({t["host"] for t in self.report["threads"]}, {"desk", "robot"})
        text = cie.run("report", self.all, "--all").stdout
        for name in ("desk", "robot"):
            self.assertRegex(text, rf"(?m)^Callbacks of pid \d+ .*on {name}, isolated")
            self.assertRegex(text, rf"(?m)^Threads of pid \d+ .*on {name}, isolated")
        self.assertRegex(text, r"@\S+ \(pid \d+ on (desk|robot)\)")
        code, rules, whole = verdicts(self.all)
        failing = {rule for rule, verdict in rules.items() if verdict in ("FAIL", "INCONCLUSIVE")}
        self.assertLessEqual(failing, TIMING, whole)
        self.assertEqual(code, expected_code(rules))
        isolated = next(rule for rule in whole["rules"] if rule["id"] == "M3")
        self.assertEqual(len(isolated["subjects"]), 3, "every callback of both machines")
        self.assertLessEqual({s["verdict"] for s in isolated["subjects"]}, {"PASS"})

    def test_clocks_differ_by_no_more_than_is_said(self):
        clocks, = self.report["clocks"]
        self.assertEqual(sorted(clocks["hosts"]), ["desk", "robot"])
        self.assertTrue(all(count >= 10 for count in clocks["messages"]), clocks)
        self.assertGreaterEqual(clocks["error_ns"], 0)
        self.assertLessEqual(abs(clocks["ahead_ns"]), clocks["error_ns"])

    def test_latencies_between_hosts_are_intervals(self):
        chain = next(c for c in self.report["chains"] if c["hops"][-2:] == [PING, PONG])
        self.assertGreaterEqual(chain["instances"], 10)
        for hop in chain["hop_table"]:
            if hop["to"] is None:
                continue
            error = hop["clock_error_ns"]
            fastest = hop["communication_ns"]["min"]
            self.assertLessEqual(error["min"], error["max"])
            # In truth a message takes some time, and what is shown of it is right here.
            self.assertGreaterEqual(fastest + error["max"], 0)
            self.assertLessEqual(error["min"], 0)
            self.assertGreaterEqual(error["max"], 0)
        text = cie.run("report", self.all, "--all").stdout
        self.assertIn("desk", text)
        self.assertRegex(text, r"clock", "the error is in the text too")

    def test_windows_and_times_are_of_a_recording_of_seconds(self):
        trace = self.report["trace"]
        self.assertLess(trace["end_ns"] - trace["begin_ns"], 200 * 10**9)
        self.assertGreater(trace["end_ns"], trace["begin_ns"])

    def test_instances_and_exports(self):
        rows = list(csv.DictReader(io.StringIO(cie.run("instances", self.all).stdout)))
        self.assertEqual({row["logical_id"] for row in rows}, {PING, PONG, "/robot@Timer(10000000)"})
        for form in ("perfetto", "chrome", "dot", "csv"):
            target = machines.scratch / f"export.{form}"
            done = cie.run("export", self.all, "--to", form, "-o", target)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(target.exists())

    def test_each_host_by_itself(self):
        for name, callbacks in (("robot", 2), ("desk", 1)):
            alone = report(self.all / name)
            self.assertEqual(alone["trace"]["hosts"], [name])
            self.assertEqual(len(alone["callbacks"]), callbacks)


if __name__ == "__main__":
    machines.main("hosts")
