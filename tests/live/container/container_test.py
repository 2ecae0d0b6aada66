#!/usr/bin/env python3
"""Runs the component container as its users do: under each executor, by orders, ended by signals, and
recorded. Counts and texts are asserted, never times."""

import json
import os
import re
import signal
import socket
import time
import unittest
from pathlib import Path

import harness
from harness import (ENDED_WELL, FAILED, UNUSABLE, app_file, component, order, run_and_end,
                     run_to_its_end, Running)
from isolated_main import wait_for, with_time_enough  # noqa: E402  pylint: disable=wrong-import-position,wrong-import-order
from cie import rules_of, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position,wrong-import-order

EXECUTORS = ("isolated", "single", "multi", "events", "isolated-waitset", "single-waitset",
             "multi-waitset")
TIMING = {"R1", "R2", "Q1"}  # rules that a busy machine violates


def every_callback_ran(trace, processes=1):
    done = harness.options.cie.run("report", trace, "--format", "json")
    callbacks = json.loads(done.stdout)["callbacks"] if done.returncode == 0 else []
    return (len({callback["pid"] for callback in callbacks}) == processes
            and all(callback["instances"] > 0 for callback in callbacks))


class Example(unittest.TestCase):
    """The example of two libraries."""

    app = property(lambda _: harness.options.programs / "components" / "app.yaml")

    def test_every_executor_runs_it(self):
        for executor in EXECUTORS:
            for signal_number in (signal.SIGTERM, signal.SIGINT):
                with self.subTest(executor=executor, signal=signal_number.name):
                    def heard(seconds):
                        with Running(self.app, "--executor", executor) as running:  # pylint: disable=cell-var-from-loop
                            time.sleep(seconds)
                            code, out = running.end(signal_number)  # pylint: disable=cell-var-from-loop
                        self.assertEqual(code, ENDED_WELL, running.text())
                        found = re.search(r"heard (\d+) greetings with 0 gaps", out)
                        self.assertTrue(found, out)
                        return int(found[1])
                    self.assertGreater(with_time_enough(heard, bool, (0.5, 5, 25)), 0)

    def test_recorded_it_passes_the_rules(self):
        if not harness.options.record:
            self.skipTest("cie and cie-record are not built, or with sanitizers")
        for executor, expected in (("isolated", 0), ("multi", 1)):
            with self.subTest(executor=executor):
                def record(seconds):
                    trace = harness.scratch / f"trace-{executor}-{seconds}"  # pylint: disable=cell-var-from-loop
                    command = ["timeout", "--preserve-status", "-s", "TERM", str(seconds), harness.options.programs / "cie-run",
                               self.app, "--executor", executor]  # pylint: disable=cell-var-from-loop
                    done = harness.options.cie.run("record", "-o", trace, "--", *command)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    return trace
                trace = with_time_enough(record, every_callback_ran, (2, 10, 50))
                judged = harness.options.cie.json("verify", trace, "--spec", self.app.parent / "spec.yaml")
                verdict = verdicts_of(judged)
                if expected == 0:
                    self.assertEqual({rule for rule in verdict if verdict[rule] == "FAIL"} - TIMING, set(), judged)
                    self.assertEqual([verdict["M2"], verdict["S1"]], ["PASS", "PASS"])
                    self.assert_has_a_judged_thread(trace, judged, "cie-parameters")
                else:  # its callbacks share threads, which is found
                    self.assertEqual(verdict["M2"], "FAIL")

    def assert_has_a_judged_thread(self, trace, verdicts, name):
        report = harness.options.cie.json("report", trace)
        [thread] = [each for each in report["threads"] if each["name"] == name]
        self.assertEqual((thread["role"], thread["callbacks"]), ("worker", []))
        judged = {each["subject"]: each["verdict"] for each in rules_of(verdicts)["S1"]["subjects"]}
        self.assertEqual(judged[f"thread {thread['tid']}"], "PASS")


class Threads(unittest.TestCase):

    def test_each_has_its_name(self):
        def threads(running):
            return {Path(task, "comm").read_text().strip()
                    for task in Path(f"/proc/{running.process.pid}/task").iterdir()}
        with Running(app_file(component("one"), component("other"))) as running:
            named = {"cie-announce", "cie-audit", "cie-control", "one:50ms", "other:50ms"}  # by itself, each
            wait_for(lambda: named <= threads(running), "each thread has its name")


class Orders(unittest.TestCase):
    """To a running container, from another process."""

    def test_lists_what_is_loaded(self):
        with Running(app_file(component("one"), component("bad", of="Absent"))):
            library = harness.options.libraries / "libodd.so"
            self.assertEqual(order("list"), (ENDED_WELL, f"/one odd::Good {library}\n", ""))

    def test_orders_that_cannot_be_followed(self):
        with Running(app_file(component("one"))):
            for words in (["dance"], ["list", "more"]):
                self.assertEqual(order(*words)[0], UNUSABLE, words)
            self.assertEqual(len(order("list")[1].splitlines()), 1)

    def policies(self, running):
        """The policy of each thread, by the kernel's word."""
        tasks = Path(f"/proc/{running.process.pid}/task").iterdir()
        return {(task / "comm").read_text().strip(): os.sched_getscheduler(int(task.name))
                for task in tasks}

    def test_reload_by_order_and_by_signal(self):
        spec = harness.scratch / "reloaded.yaml"
        entry = "dds_threads:\n  - {name: recvUC, policy: %s}\n"
        spec.write_text(entry % "SCHED_BATCH")
        with Running(app_file(component("one"), head=f"spec: {spec}\n")) as running:
            self.assertEqual(self.policies(running)["recvUC"], os.SCHED_BATCH)
            spec.write_text(entry % "SCHED_OTHER")
            code, said, _ = order("reload")
            self.assertEqual((code, self.policies(running)["recvUC"]),
                             (ENDED_WELL, os.SCHED_OTHER))
            self.assertIn(str(spec), said)
            spec.write_text(entry % "SCHED_SOON")
            code, _, error = order("reload")
            self.assertEqual(code, UNUSABLE)
            self.assertIn("SCHED_SOON", error)
            running.process.send_signal(signal.SIGHUP)
            wait_for(lambda: running.text().count("the former spec stays in force") == 2, "both refusals")
            self.assertEqual(self.policies(running)["recvUC"], os.SCHED_OTHER)
            spec.write_text(entry % "SCHED_IDLE")  # last: out of it nobody gets without privilege
            running.process.send_signal(signal.SIGHUP)
            wait_for(lambda: running.text().count("as it is now") == 2, "both reloads")
            self.assertEqual(self.policies(running)["recvUC"], os.SCHED_IDLE)
            self.assertEqual(running.end()[0], ENDED_WELL)

    def test_without_a_spec_there_is_nothing_to_reload(self):
        with Running(app_file(component("one"))) as running:
            self.assertEqual(order("reload")[0], FAILED)
            self.assertEqual(running.end(signal.SIGHUP)[0], -signal.SIGHUP)

    def test_reaches_the_container_that_is_meant(self):
        self.assertEqual(order("list")[0], UNUSABLE)
        with Running(app_file(component("first"))) as first:
            with Running(app_file(component("second"))) as second:
                code, _, err = order("list")
                self.assertEqual(code, UNUSABLE)
                self.assertIn(str(first.process.pid), err)
                self.assertIn("/second ", order("list", pid=second.process.pid)[1])
                second.process.kill()  # its socket stays behind
                second.process.wait()
            self.assertIn("/first ", order("list")[1])
            sockets = Path(os.environ["XDG_RUNTIME_DIR"], "cie-run")
            self.assertEqual(sockets.stat().st_mode & 0o777, 0o700)
            mine = sockets / f"{first.process.pid}.sock"
            self.assertEqual(mine.stat().st_mode & 0o777, 0o600)
            first.end()
            self.assertFalse(mine.exists())

    def test_a_silent_client_does_not_stop_the_end(self):
        with Running(app_file(component("first"))) as running:
            client = socket.socket(socket.AF_UNIX)
            client.connect(str(Path(os.environ["XDG_RUNTIME_DIR"], "cie-run",
                                    f"{running.process.pid}.sock")))
            self.assertEqual(running.end()[0], ENDED_WELL)
            client.close()

    def test_a_folder_of_others_is_not_used(self):
        folder = Path(os.environ["XDG_RUNTIME_DIR"], "cie-run")
        folder.mkdir(mode=0o700, exist_ok=True)
        folder.chmod(0o770)
        try:
            with Running(app_file(component("first"))) as running:
                self.assertIn("no orders are taken", running.text())
                self.assertEqual(running.end()[0], ENDED_WELL)
        finally:
            folder.chmod(0o700)


class Mapping(unittest.TestCase):
    """One callback to one thread, and back: judged on recordings."""

    app = property(lambda _: harness.options.programs / "components" / "app.yaml")

    def setUp(self):
        if not harness.options.record:
            self.skipTest("cie and cie-record are not built, or with sanitizers")

    def judge(self, trace):
        """The verdicts by rule, none of them FAIL; and the callbacks of the report."""
        spec = self.app.parent / "spec.yaml"
        verdicts, report = (harness.options.cie.json(command, trace, "--spec", spec) for command in ("verify", "report"))
        failed = [rule for rule in verdicts["rules"]
                  if rule["verdict"] == "FAIL" and rule["id"] not in TIMING]
        self.assertEqual(failed, [])
        return rules_of(verdicts), report["callbacks"]

    def assert_mapping_passes(self, rules):
        self.assertEqual({name: rules[name]["verdict"]
                          for name in ("M1", "M2", "M3", "M4", "M7", "M8", "S1", "S2", "E1", "E2")},
                         dict.fromkeys(("M1", "M2", "M3", "M4", "M7", "M8", "S1", "S2", "E1", "E2"),
                                       "PASS"))

    def test_holds_over_a_restart(self):
        def record(seconds):
            trace = harness.scratch / f"trace-restart-{seconds}"
            once = f"timeout --preserve-status -s TERM {seconds} {harness.options.programs / 'cie-run'} {self.app}"
            done = harness.options.cie.run("record", "-o", trace, "--", "sh", "-c", f"{once}; {once}")
            self.assertEqual(done.returncode, 0, done.stderr)
            return trace
        trace = with_time_enough(record, lambda trace: every_callback_ran(trace, processes=2), (1, 5, 25))
        rules, callbacks = self.judge(trace)
        self.assert_mapping_passes(rules)
        self.assertEqual(rules["M5"]["verdict"], "PASS")
        self.assertEqual(len({each["pid"] for each in callbacks}), 2)


class Parameters(unittest.TestCase):
    """As the file, the command line and orders give them."""

    def test_are_listed_described_and_set_by_orders(self):
        file = app_file(component("tuned", of="Tunable", more="parameters: {rate: 3, gain.x: 0.5}"),
                        component("plain"))
        with Running(file, "-p", "/tuned:rate:=4") as running:
            code, out, err = order("param", "list")
            self.assertEqual((code, err), (ENDED_WELL, ""))
            self.assertEqual(out.splitlines(), ["/tuned frame base", "/tuned gain.x 0.5",
                                                "/tuned rate 4"])
            self.assertEqual(order("param", "list", "/plain")[1], "")
            self.assertEqual(order("param", "set", "/tuned", "rate", "7")[:2],
                             (ENDED_WELL, "/tuned rate 7\n"))
            self.assertEqual(order("param", "get", "/tuned", "rate")[:2], (ENDED_WELL, "7\n"))
            code, out, _ = order("param", "describe", "/tuned", "rate")
            self.assertEqual(code, ENDED_WELL)
            for part in ("type: integer", "description: per second", "range: 1 to 10"):
                self.assertIn(part, out)
            for words, reason in ((("rate", "11"), "not in the range 1 to 10"),
                                  (("rate", "fast"), "write a whole number"),
                                  (("rate", "5"), "five is right out"),
                                  (("frame", "map"), "read-only"),
                                  (("absent", "1"), "is not declared")):
                code, _, err = order("param", "set", "/tuned", *words)
                self.assertEqual(code, FAILED, words)
                self.assertIn(reason, err)
            self.assertEqual(order("param", "get", "/absent", "rate")[0], FAILED)
            self.assertEqual(order("param", "get", "/tuned")[0], UNUSABLE)
            self.assertEqual(running.end()[0], ENDED_WELL, running.text())

    def test_of_a_command_line_that_means_nobody_are_refused(self):
        file = app_file(component("plain"))
        for argument, reason in (("/absent:rate:=4", 'no component "/absent"'),
                                 ("rate=4", "NODE:NAME:=VALUE")):
            code, said = run_to_its_end(file, "-p", argument)
            self.assertEqual(code, UNUSABLE, said)
            self.assertIn(reason, said)

    def test_that_do_not_fit_keep_their_component_from_loading(self):
        file = app_file(component("plain"), component("tuned", of="Tunable"))
        code, _, said = run_and_end(file, "-p", "/tuned:rate:=11")
        self.assertEqual(code, ENDED_WELL)
        self.assertIn('component "/tuned"', said)
        self.assertIn("11 is not in the range 1 to 10", said)


if __name__ == "__main__":
    harness.main(__doc__)
