#!/usr/bin/env python3
"""Runs the component container as its users do: under each executor, by orders, ended by signals, and
recorded. Counts and texts are asserted, never times."""

import json
import os
import re
import signal
import socket
import subprocess
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


class Orders(unittest.TestCase):
    """Load, unload and list from another process."""

    def mapped(self, running, library):
        """The kernel's word, not the program's."""
        maps = Path(f"/proc/{running.process.pid}/maps").read_text()
        return str(harness.options.libraries / library) in maps

    def test_unload_and_load_again_under_every_executor(self):
        for executor in EXECUTORS:
            file = app_file(component("kept", library="libnodelete.so"), component("moved"))
            with self.subTest(executor=executor), Running(file, "--executor", executor) as running:
                for _ in range(3):
                    self.assertTrue(self.mapped(running, "libodd.so"))
                    code, out, err = order("unload", "/moved")
                    self.assertEqual((code, err), (ENDED_WELL, ""))
                    self.assertIn("is unmapped", out)
                    self.assertFalse(self.mapped(running, "libodd.so"))
                    code, out, _ = order("list")
                    self.assertEqual((code, len(out.splitlines())), (ENDED_WELL, 1))
                    self.assertTrue(out.startswith("/kept odd::Good "), out)
                    code, out, err = order("load", file)
                    self.assertEqual((code, err), (ENDED_WELL, ""))
                    self.assertIn('loaded "/moved"', out)
                    self.assertNotIn("/kept", out)
                self.assertEqual(running.end()[0], ENDED_WELL, running.text())

    def test_threads_come_and_go_with_a_component(self):
        def threads(running):
            names = (Path(task, "comm").read_text().strip()
                     for task in Path(f"/proc/{running.process.pid}/task").iterdir())
            return sorted(names)
        with Running(app_file(component("kept"), component("moved"))) as running:
            named = {"cie-announce", "cie-audit", "cie-control", "kept:50ms", "moved:50ms"}  # by itself, each
            wait_for(lambda: named <= set(threads(running)), "each thread has its name")
            before = threads(running)
            self.assertEqual(order("unload", "/moved")[0], ENDED_WELL)
            self.assertEqual([name for name in before if name != "moved:50ms"], threads(running))
            self.assertEqual(order("load", running.process.args[1])[0], ENDED_WELL)
            # A thread names itself.
            wait_for(lambda: before == threads(running), f"the threads {before}")

    def test_a_library_that_stays_says_why(self):
        stays = [("libnodelete.so", "-z nodelete")]
        if harness.options.compiler == "GNU":
            stays.append(("libunique.so", "-fno-gnu-unique"))
        for library, reason in stays:
            with self.subTest(library=library):
                file = app_file(component("kept"), component("moved", library=library))
                with Running(file) as running:
                    code, out, _ = order("unload", "/moved")
                    self.assertEqual(code, ENDED_WELL)
                    self.assertIn("stays mapped: ", out)
                    self.assertIn(reason, out)
                    self.assertTrue(self.mapped(running, library))

    def test_a_library_of_two_components_stays_for_the_other(self):
        with Running(app_file(component("kept"), component("moved"))) as running:
            self.assertIn('stays mapped: "/kept" is from it too', order("unload", "/moved")[1])
            self.assertIn("is unmapped", order("unload", "/kept")[1])
            self.assertFalse(self.mapped(running, "libodd.so"))

    def test_orders_that_cannot_be_followed(self):
        file = app_file(component("kept"), component("bad", of="Absent"))
        with Running(file):
            self.assertEqual(order("unload", "/absent"),
                             (FAILED, "", 'no component "/absent" is loaded\n'))
            code, _, err = order("load", file)
            self.assertEqual(code, FAILED)
            self.assertIn('no class "odd::Absent"', err)
            code, _, err = order("load", file, "/absent")
            self.assertEqual(code, FAILED)
            self.assertIn('no component "/absent"', err)
            code, _, err = order("load", file, "/kept")
            self.assertEqual(code, FAILED)
            self.assertIn("is loaded already", err)
            code, _, err = order("load", harness.scratch / "absent.yaml")
            self.assertEqual(code, UNUSABLE)
            self.assertIn("absent.yaml: cannot read it", err)
            for words in (["dance"], ["list", "more"], ["unload"], ["load"]):
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
    """One callback to one thread, and back, whatever comes and goes: judged on recordings."""

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

    def test_holds_while_components_are_unloaded_loaded_again_and_added(self):
        trace = harness.scratch / "trace-reload"
        added = app_file(component("added"))
        pid_file = harness.scratch / "reloaded.pid"
        command = f"echo $$ > {pid_file}; exec {harness.options.programs / 'cie-run'} {self.app}"
        recorder = subprocess.Popen([harness.options.programs / "cie", "record", "-o", trace, "--",
                                     "sh", "-c", command], stdout=subprocess.DEVNULL,
                                    stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: pid_file.exists() and pid_file.read_text().endswith("\n"), "the container starts")
            pid = int(pid_file.read_text())
            wait_for(lambda: order("list", pid=pid)[0] == ENDED_WELL, "it takes orders")
            for _ in range(3):
                time.sleep(0.2)  # a few instances each
                for words in (("unload", "/example/talker"), ("load", self.app), ("load", added)):
                    self.assertEqual(order(*words, pid=pid)[::2], (ENDED_WELL, ""))
                time.sleep(0.2)
                self.assertEqual(order("unload", "/added", pid=pid)[::2], (ENDED_WELL, ""))
            os.kill(pid, signal.SIGTERM)
            recorder.wait(timeout=200)
        finally:
            recorder.kill()
            recorder.wait()
        rules, callbacks = self.judge(trace)
        self.assert_mapping_passes(rules)
        self.assertEqual(rules["M5"]["verdict"], "PASS")
        # Each life of the talker's timer is called as in the spec, and ran as it says.
        lives = [each for each in callbacks if each["logical_id"] == "/example/talker@Timer(20000000)"]
        self.assertEqual(len(lives), 4)
        for life in lives:
            self.assertGreater(life["instances"], 0)
            self.assertTrue(life["isolated"])
        self.assertEqual(sum(each["logical_id"] == "/added@Timer(50000000)" for each in callbacks), 3)

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


class Leaks(unittest.TestCase):

    def test_nothing_is_left_of_a_component_that_came_and_went(self):
        def resources(process):
            maps = Path(f"/proc/{process.pid}/maps").read_text().splitlines()
            return (len(list(Path(f"/proc/{process.pid}/task").iterdir())),
                    len(list(Path(f"/proc/{process.pid}/fd").iterdir())),
                    sum(" /" in line for line in maps))
        file = app_file(component("kept", library="libnodelete.so"), component("moved", of="Tunable"))
        with Running(file) as running:
            counts = []
            for _ in range(12):
                self.assertEqual(order("unload", "/moved")[0], ENDED_WELL)
                self.assertEqual(order("load", file)[0], ENDED_WELL)
                counts.append(resources(running.process))
            # What DDS and the C library make once, they have made in the first lives.
            wait_for(lambda: resources(running.process) == counts[1], f"{counts[1]} after {counts}")


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
            self.assertEqual(order("unload", "/tuned")[0], ENDED_WELL)
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
