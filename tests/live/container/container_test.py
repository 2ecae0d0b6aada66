#!/usr/bin/env python3
"""Runs the component container as its users do: from files, with good and bad components, under each
executor, ended by signals. Counts and texts are asserted, never times."""

import argparse
import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

options: argparse.Namespace
scratch: Path
EXECUTORS = ("isolated", "single", "multi", "events", "isolated-waitset", "single-waitset",
             "multi-waitset")
ENDED_WELL, UNUSABLE, FAILED = 0, 2, 4
TIMING = {"R1", "R2"}  # rules that a busy machine violates


def isolate():
    """A session daemon of this test's own. Root needs a mount namespace for that."""
    home = scratch / "home"
    home.mkdir()
    os.environ["LTTNG_HOME"] = str(home)
    os.environ["XDG_RUNTIME_DIR"] = str(home)  # orders reach the containers of this test only
    os.environ["CIE_LOOPBACK"] = "1"
    os.environ["CIE_DISCOVERY_TAG"] = f"container{os.getpid()}"
    if not options.record or os.geteuid() != 0 or os.environ.get("CIE_TEST_NAMESPACE") == "1":
        return
    os.environ["CIE_TEST_NAMESPACE"] = "1"
    inside = "mkdir -p /run/lttng && mount -t tmpfs none /run/lttng && exec \"$@\""
    os.execvp("unshare", ["unshare", "--mount", "--", "sh", "-c", inside, "sh", sys.executable,
                          *sys.argv])


def component(name, of="Good", library="libodd.so", more=""):
    return (f"  - library: {options.libraries / library}\n    class: odd::{of}\n    name: {name}\n"
            + "".join(f"    {line}\n" for line in more.splitlines()))


def app_file(*components, head=""):
    file = scratch / f"app{len(list(scratch.iterdir()))}.yaml"
    file.write_text(f"loopback: true\n\n{head}components:\n" + "".join(components))
    return file


def wait_for(condition):
    """What a busy machine does late is waited for; what never comes fails at the assertion."""
    bound = time.monotonic() + 20
    while not condition() and time.monotonic() < bound:
        time.sleep(0.01)


class Running:
    """cie-run, once it says that it runs (or has ended)."""

    def __init__(self, file, *arguments):
        self.log = scratch / f"log{len(list(scratch.iterdir()))}"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [options.programs / "cie-run", file, *arguments], stdout=subprocess.PIPE,
                stderr=log, text=True)
        wait_for(lambda: "under the executor" in self.text() or self.process.poll() is not None)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def end(self, signal_number=signal.SIGTERM):
        self.process.send_signal(signal_number)
        out, _ = self.process.communicate(timeout=30)
        return self.process.returncode, out

    def text(self):
        return self.log.read_text()


def run_and_end(file, *arguments, seconds=0.3):
    with Running(file, *arguments) as running:
        time.sleep(seconds)
        code, out = running.end()
        return code, out, running.text()


def run_to_its_end(file, *arguments):
    done = subprocess.run([options.programs / "cie-run", file, *arguments], capture_output=True,
                          text=True, timeout=60, check=False)
    return done.returncode, done.stderr


class Example(unittest.TestCase):
    """The example of two libraries."""

    app = property(lambda _: options.programs / "components" / "app.yaml")

    def test_every_executor_runs_it(self):
        for executor in EXECUTORS:
            for signal_number in (signal.SIGTERM, signal.SIGINT):
                with self.subTest(executor=executor, signal=signal_number.name):
                    with Running(self.app, "--executor", executor) as running:
                        time.sleep(0.5)
                        code, out = running.end(signal_number)
                    self.assertEqual(code, ENDED_WELL, running.text())
                    heard = re.search(r"heard (\d+) greetings with 0 gaps", out)
                    self.assertTrue(heard, out)
                    self.assertGreater(int(heard[1]), 0)

    def test_recorded_it_passes_the_rules(self):
        if not options.record:
            self.skipTest("cie and cie-record are not built, or with sanitizers")
        for executor, expected in (("isolated", 0), ("multi", 1)):
            with self.subTest(executor=executor):
                trace = scratch / f"trace-{executor}"
                command = ["timeout", "--preserve-status", "-s", "TERM", "2",
                           options.programs / "cie-run", self.app, "--executor", executor]
                done = self.cie("record", "-o", trace, "--", *command)
                self.assertEqual(done.returncode, 0, done.stderr)
                done = self.cie("verify", trace, "--spec", self.app.parent / "spec.yaml",
                                "--format", "json")
                failed = {rule["id"] for rule in json.loads(done.stdout)["rules"]
                          if rule["verdict"] == "FAIL"} - TIMING
                verdict = {rule["id"]: rule["verdict"]
                           for rule in json.loads(done.stdout)["rules"]}
                if expected == 0:
                    self.assertEqual(failed, set(), done.stdout)
                    self.assertEqual([verdict["M2"], verdict["S1"]], ["PASS", "PASS"])
                    self.assert_has_a_judged_thread(trace, done.stdout, "cie-parameters")
                else:  # its callbacks share threads, which is found
                    self.assertEqual(verdict["M2"], "FAIL")

    def assert_has_a_judged_thread(self, trace, verdicts, name):
        report = json.loads(self.cie("report", trace, "--format", "json").stdout)
        [thread] = [each for each in report["threads"] if each["name"] == name]
        self.assertEqual((thread["role"], thread["callbacks"]), ("worker", []))
        [s1] = [rule for rule in json.loads(verdicts)["rules"] if rule["id"] == "S1"]
        judged = {each["subject"]: each["verdict"] for each in s1["subjects"]}
        self.assertEqual(judged[f"thread {thread['tid']}"], "PASS")

    def cie(self, *arguments):
        return subprocess.run([options.programs / "cie", *arguments], capture_output=True, text=True,
                              timeout=90, check=False)


class BadComponents(unittest.TestCase):
    """One does not take the others down, and each is told by name."""

    def assert_told(self, bad, *parts):
        file = app_file(component("first"), bad, component("last"))
        code, _, said = run_and_end(file)
        self.assertEqual(code, ENDED_WELL, said)
        self.assertIn('loaded "/first"', said)
        self.assertIn('loaded "/last"', said)
        self.assertIn("2 components under the executor \"isolated\", 1 could not be loaded", said)
        line = next(line for line in said.splitlines() if "is not loaded" in line)
        for part in (f'{file}:7: component "/bad"', *parts):
            self.assertIn(part, line)

    def test_missing_library(self):
        self.assert_told(component("bad", library="libabsent.so"), "libabsent.so",
                         "No such file or directory")

    def test_no_entry_point(self):
        self.assert_told(component("bad", library="libno_entry.so"), "cie_component_library()")

    def test_other_interface_version(self):
        self.assert_told(component("bad", library="libold_abi.so"), "version 2", "rebuild it")

    def test_unknown_class(self):
        self.assert_told(component("bad", of="Absent"), 'no class "odd::Absent"', "odd::Good")

    def test_throwing_constructor(self):
        self.assert_told(component("bad", of="ThrowsInConstructor"), "no lidar is connected")

    def test_unknown_parameter(self):
        self.assert_told(component("bad", more="parameters: {raet: 1}"), "no parameter raet")

    def test_other_name(self):
        self.assert_told(component("bad", of="NamesItselfOtherwise"), '"/somebody_else"')

    def test_none_is_left(self):
        code, said = run_to_its_end(app_file(component("bad", of="ThrowsInConstructor")))
        self.assertEqual(code, FAILED, said)
        self.assertIn("none of the components could be loaded", said)

    def test_throwing_callback(self):
        file = app_file(component("first"), component("bad", of="ThrowsInCallback"))
        code, _, said = run_and_end(file)
        self.assertEqual(code, FAILED, said)
        self.assertEqual(said.count("threw: odd"), 1, said)
        self.assertIn('callback "/bad@Timer(10000000)"', said)
        self.assertRegex(said, r"ended by an exception \d+ time")


def order(*words, pid=None):
    """Exit code, standard output and error of `cie-run --control WORDS`."""
    choice = ["--pid", str(pid)] if pid else []
    done = subprocess.run([options.programs / "cie-run", *choice, "--control", *words],
                          capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


class Orders(unittest.TestCase):
    """Load, unload and list from another process."""

    def mapped(self, running, library):
        """The kernel's word, not the program's."""
        maps = Path(f"/proc/{running.process.pid}/maps").read_text()
        return str(options.libraries / library) in maps

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
            wait_for(lambda: {"cie-audit", "kept:50ms", "moved:50ms"} <= set(threads(running)))
            before = threads(running)
            self.assertEqual(order("unload", "/moved")[0], ENDED_WELL)
            self.assertEqual([name for name in before if name != "moved:50ms"], threads(running))
            self.assertEqual(order("load", running.process.args[1])[0], ENDED_WELL)
            wait_for(lambda: before == threads(running))  # a thread names itself
            self.assertEqual(before, threads(running))

    def test_a_library_that_stays_says_why(self):
        stays = [("libnodelete.so", "-z nodelete")]
        if options.compiler == "GNU":
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
            code, _, err = order("load", scratch / "absent.yaml")
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
        spec = scratch / "reloaded.yaml"
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
            wait_for(lambda: running.text().count("the former spec stays in force") == 2)
            self.assertEqual(self.policies(running)["recvUC"], os.SCHED_OTHER)
            spec.write_text(entry % "SCHED_IDLE")  # last: out of it nobody gets without privilege
            running.process.send_signal(signal.SIGHUP)
            wait_for(lambda: running.text().count("as it is now") == 2)
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

    app = property(lambda _: options.programs / "components" / "app.yaml")

    def setUp(self):
        if not options.record:
            self.skipTest("cie and cie-record are not built, or with sanitizers")

    def judge(self, trace):
        """The verdicts by rule, none of them FAIL; and the callbacks of the report."""
        spec = self.app.parent / "spec.yaml"
        verdicts, report = (json.loads(self.cie(command, trace, "--spec", spec,
                                                "--format", "json").stdout)
                            for command in ("verify", "report"))
        failed = [rule for rule in verdicts["rules"]
                  if rule["verdict"] == "FAIL" and rule["id"] not in TIMING]
        self.assertEqual(failed, [])
        return {rule["id"]: rule for rule in verdicts["rules"]}, report["callbacks"]

    def cie(self, *arguments):
        return subprocess.run([options.programs / "cie", *arguments], capture_output=True, text=True,
                              timeout=90, check=False)

    def assert_mapping_passes(self, rules):
        self.assertEqual({name: rules[name]["verdict"]
                          for name in ("M1", "M2", "M3", "M4", "M7", "M8", "S1", "S2", "E1", "E2")},
                         dict.fromkeys(("M1", "M2", "M3", "M4", "M7", "M8", "S1", "S2", "E1", "E2"),
                                       "PASS"))

    def test_holds_while_components_are_unloaded_loaded_again_and_added(self):
        trace = scratch / "trace-reload"
        added = app_file(component("added"))
        pid_file = scratch / "reloaded.pid"
        command = f"echo $$ > {pid_file}; exec {options.programs / 'cie-run'} {self.app}"
        recorder = subprocess.Popen([options.programs / "cie", "record", "-o", trace, "--",
                                     "sh", "-c", command], stdout=subprocess.DEVNULL,
                                    stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: pid_file.exists() and pid_file.read_text().endswith("\n"))
            pid = int(pid_file.read_text())
            wait_for(lambda: order("list", pid=pid)[0] == ENDED_WELL)
            for _ in range(3):
                time.sleep(0.2)  # a few instances each
                for words in (("unload", "/example/talker"), ("load", self.app), ("load", added)):
                    self.assertEqual(order(*words, pid=pid)[::2], (ENDED_WELL, ""))
                time.sleep(0.2)
                self.assertEqual(order("unload", "/added", pid=pid)[::2], (ENDED_WELL, ""))
            os.kill(pid, signal.SIGTERM)
            recorder.wait(timeout=60)
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
        trace = scratch / "trace-restart"
        once = f"timeout --preserve-status -s TERM 1 {options.programs / 'cie-run'} {self.app}"
        done = self.cie("record", "-o", trace, "--", "sh", "-c", f"{once}; {once}")
        self.assertEqual(done.returncode, 0, done.stderr)
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
            wait_for(lambda: resources(running.process) == counts[1])
            self.assertEqual(resources(running.process), counts[1])


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


class BadFiles(unittest.TestCase):

    def assert_unusable(self, file, *parts, arguments=()):
        code, said = run_to_its_end(file, *arguments)
        self.assertEqual(code, UNUSABLE, said)
        for part in parts:
            self.assertIn(part, said)

    def test_unknown_key(self):
        file = app_file(component("a"), head="executer: single\n")
        self.assert_unusable(file, f'{file}:3: unknown key "executer"')

    def test_missing_file(self):
        self.assert_unusable(scratch / "absent.yaml", "absent.yaml: cannot read it")

    def test_missing_spec(self):
        self.assert_unusable(app_file(component("a"), head="spec: absent.yaml\n"),
                             f"{scratch}/absent.yaml: cannot read it")

    def test_bad_spec(self):
        spec = scratch / "bad_spec.yaml"
        spec.write_text("callback_groups:\n  - id: /a@Timer(50000000)\n    policy: SCHED_NOPE\n")
        self.assert_unusable(app_file(component("a"), head="spec: bad_spec.yaml\n"),
                             f'{spec}:3: entry "/a@Timer(50000000)": unknown policy')

    def test_spec_of_another_machine(self):
        spec = scratch / "abacus.yaml"
        spec.write_text("callback_groups: []\nhardware_info: {model_name: abacus}\n")
        said = f'{spec}:2: entry "hardware_info": "model_name" should be "abacus"'
        self.assert_unusable(app_file(component("a"), head="spec: abacus.yaml\n"), said)
        code, _, told = run_and_end(app_file(component("a"),
                                             head="spec: abacus.yaml\non_error: warn\n"))
        self.assertEqual(code, ENDED_WELL)
        self.assertIn("warning: " + said, told)

    @unittest.skipIf(os.nice(0) > 3, "not possible here: runs at a nice value that an ordinary user cannot lower")
    def test_spec_of_the_domain(self):
        spec = scratch / "domains.yaml"
        spec.write_text("callback_groups:\n"
                        "  - {id: /a@Timer(50000000), domain_id: 3, policy: SCHED_OTHER, nice: 3}\n"
                        "  - {id: /a@Timer(50000000), domain_id: 4, policy: SCHED_OTHER, nice: 4}\n"
                        "dds_threads: [{name: dq.*, policy: SCHED_OTHER, nice: 7}]\n")
        file = app_file(component("a"), head="spec: domains.yaml\ndomain: 4\n")
        with Running(file) as running:
            def nice_of(name):
                for task in Path(f"/proc/{running.process.pid}/task").iterdir():
                    if (task / "comm").read_text().strip() == name:
                        # The 19th field; the second may hold spaces, but ends with the last ")".
                        return int((task / "stat").read_text().rsplit(")", 1)[1].split()[16])
                return None
            wait_for(lambda: nice_of("a:50ms") == 4)
            self.assertEqual({name: nice_of(name) for name in ("a:50ms", "dq.user", "dq.builtins",
                                                               "gc")},
                             {"a:50ms": 4, "dq.user": 7, "dq.builtins": 7, "gc": os.nice(0)})

    def test_unknown_executor(self):
        self.assert_unusable(app_file(component("a")), "--executor",
                             arguments=["--executor", "magic"])

    def test_spec_that_cannot_be_applied(self):
        spec = scratch / "too_many_cpus.yaml"
        spec.write_text("callback_groups:\n  - id: /a@Timer(50000000)\n    affinity: [1023]\n")
        head = "spec: too_many_cpus.yaml\n"
        code, said = run_to_its_end(app_file(component("a"), head=head))
        self.assertEqual(code, FAILED, said)
        self.assertIn(f'{spec}:2: "/a@Timer(50000000)"', said)
        code, _, said = run_and_end(app_file(component("a"), head=head + "on_error: warn\n"))
        self.assertEqual(code, ENDED_WELL, said)
        self.assertIn(f'warning: {spec}:2: "/a@Timer(50000000)"', said)


def main():
    global options, scratch  # pylint: disable=global-statement
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--libraries", type=Path, required=True)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--compiler", default="GNU")
    options, rest = parser.parse_known_args()
    options.programs = options.programs.resolve()
    options.libraries = options.libraries.resolve()
    with tempfile.TemporaryDirectory(prefix="cie-container-") as directory:
        scratch = Path(directory)
        isolate()
        program = unittest.main(argv=[sys.argv[0], *rest], exit=False, verbosity=2)
    sys.exit(not program.result.wasSuccessful())


if __name__ == "__main__":
    main()
