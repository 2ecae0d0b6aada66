#!/usr/bin/env python3
"""The demo done wrong in five ways: the rule that was broken fails, and its text says what is wrong to a
reader who knows nothing else. Times are never asserted."""

import argparse
import difflib
import json
import os
import re
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
TIMING = {"R1", "R2", "R3", "Q1"}  # rules that a busy machine violates
MAP = "/sensing/map@Timer(200000000)"  # SCHED_OTHER nice 5 in the spec
LOCALES = ("C", "C.UTF-8", "de_DE.UTF-8")


def run(*command, **keywords):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=200, check=False,
                          **keywords)


def demo(executor, *arguments):
    return [options.programs / "cie-demo", "--executor", executor, "--load", "0.2", "--tag",
            f"verdicts_{os.getpid()}", *arguments]


def record_command(name, command):
    return [str(c) for c in (options.programs / "cie", "record", "-o", scratch / name, "--", *command)]


def record(name, command):
    done = run(*record_command(name, command))
    assert done.returncode == 0, done.stderr
    return scratch / name


def verify(directory, *arguments):
    """The rules that fail, the verdicts, and the text."""
    report = json.loads(run(options.programs / "cie", "verify", directory, "-f", "json", *arguments).stdout)
    text = run(options.programs / "cie", "verify", directory, "--all", *arguments).stdout
    return {r["id"] for r in report["rules"] if r["verdict"] == "FAIL"}, report, text


def has_run(directory, logical_id):
    """Whether what is recorded so far tells of two instances."""
    done = run(options.programs / "cie", "report", directory, "-f", "json")
    return done.returncode == 0 and any(c["instances"] > 1 for c in json.loads(done.stdout)["callbacks"]
                                        if c["logical_id"] == logical_id)


def thread_with_nice(nice, under):
    """The thread of a descendant of `under` that runs at a nice value; None if there is none yet."""
    parents = {}
    for entry in Path("/proc").iterdir():
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            parents[int(entry.name)] = int(fields[1])
        except (OSError, ValueError):
            continue
    for pid in parents:
        ancestor = pid
        while ancestor not in (0, 1, under):
            ancestor = parents.get(ancestor, 0)
        if ancestor != under:
            continue
        for task in (Path("/proc") / str(pid) / "task").iterdir():
            try:
                if int((task / "stat").read_text().rpartition(")")[2].split()[16]) == nice:
                    return int(task.name)
            except OSError:
                continue
    return None


class Verdicts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.spec = options.examples / "demo_unprivileged.yaml"
        # One thread is re-niced from outside while it runs.
        with subprocess.Popen(record_command("reniced", demo("isolated", "--part", "sensing", "--duration", "60",
                                                              "--spec", cls.spec)),
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as recording:
            tid = isolated_main.wait_for(lambda: thread_with_nice(5, recording.pid), "the thread of the map's timer at nice 5")
            isolated_main.wait_for(lambda: has_run(scratch / "reniced", MAP), "instances before")
            os.setpriority(os.PRIO_PROCESS, tid, 9)
            time.sleep(1)
            recording.send_signal(signal.SIGTERM)
            errors = recording.communicate(timeout=200)[1]
            assert recording.returncode == 0, errors
        cls.reniced, cls.tid = scratch / "reniced", tid

    def mended_spec(self, name, old, new):
        text = self.spec.read_text()
        # The half of the application that runs, without its chains.
        entries = text.split("chains:")[0].split("  - id: ")
        text = entries[0] + "".join("  - id: " + e for e in entries[1:] if e.startswith("/sensing"))
        self.assertIn(old, text)
        file = scratch / name
        file.write_text(text.replace(old, new))
        return file

    def assert_says(self, text, *patterns):
        for line in ("The rule: ", "Why it matters: ", "Remedy: "):
            self.assertIn("\n    " + line, text)
        for pattern in patterns:
            self.assertRegex(" ".join(text.split()), pattern)

    def test_a_thread_that_was_reniced(self):
        failing, report, text = verify(self.reniced, "--spec", self.mended_spec("same.yaml", "nice: 5", "nice: 5"))
        self.assertEqual(failing - TIMING, {"S3"}, text)
        subjects = [s["subject"] for r in report["rules"] if r["id"] == "S3" for s in r["subjects"]
                    if s["verdict"] == "FAIL"]
        self.assertEqual(subjects, [f"thread {self.tid}"])
        self.assert_says(text, rf"FAIL S3 parameters-unchanged: thread {self.tid}\b",
                         r"applied: SCHED_OTHER nice 5.* \(thread of " + re.escape(MAP) + r"\)",
                         r"later read back: SCHED_OTHER nice 9|the kernel schedules it with nice 9",
                         "renice, chrt, taskset")

    def test_a_priority_that_was_set_wrongly(self):
        spec = self.mended_spec("other.yaml", "nice: 5", "nice: 3")
        line = spec.read_text().split(MAP)[0].count("\n") + 1
        failing, report, text = verify(self.reniced, "--spec", spec)
        self.assertEqual(failing - TIMING, {"S1", "S3"}, text)
        subjects = [s["subject"] for r in report["rules"] if r["id"] == "S1" for s in r["subjects"]
                    if s["verdict"] == "FAIL"]
        self.assertEqual(subjects, [f"callback {MAP}"])
        self.assert_says(text, r"FAIL S1 parameters-as-specified: callback " + re.escape(MAP),
                         rf"other\.yaml:{line} asks for SCHED_OTHER nice 3\b[^;]*; applied to the thread was SCHED_OTHER nice 5",
                         r"and read back later was SCHED_OTHER nice 9")

    def test_a_callback_that_does_not_exist(self):
        spec = self.mended_spec("missing.yaml", MAP, "/sensing/mop@Timer(200000000)")
        failing, _, text = verify(self.reniced, "--spec", spec)
        self.assertEqual(failing - TIMING, {"M1", "S3"}, text)
        self.assert_says(text, r"FAIL M1 specified-callback-seen: callback /sensing/mop@Timer\(200000000\)",
                         r"was never registered \(.*missing\.yaml:\d+\)",
                         "A misspelt id configures")

    def test_a_multi_threaded_executor(self):
        failing, _, text = isolated_main.with_time_enough(
            lambda seconds: verify(record(f"multi-{seconds}", demo("multi", "--threads", "3", "--part", "sensing",
                                                                   "--duration", str(seconds)))),
            lambda verified: {"M2", "M3"} <= verified[0], (1, 5, 25))
        self.assertEqual(failing - TIMING, {"M2", "M3"}, text)
        self.assert_says(text, r"FAIL M2 one-callback-per-thread: thread \d+",
                         r"FAIL M3 one-thread-per-callback: callback /sensing/",
                         r"/sensing/\S+ started here \(seq 0\)", "wait for each other|isolated executor")

    def test_a_second_callback_in_a_group(self):
        failing, report, text = verify(record("grouped", [options.grouped_app]))
        self.assertEqual(failing - TIMING, {"M2", "M8"}, text)
        threads = [s["verdict"] for r in report["rules"] if r["id"] == "M2" for s in r["subjects"]]
        self.assertEqual(sorted(threads), ["FAIL", "PASS"], "the third timer has a thread of its own")
        self.assert_says(text, r"FAIL M8 single-callback-group: group \d+", "a group of 2 callbacks",
                         re.escape("/grouped/app@Timer(20000000)") + " belongs to it",
                         re.escape("/grouped/app@Timer(30000000)") + " belongs to it",
                         "callback group of its own")

    def test_callbacks_that_come_and_go_are_no_violation(self):
        failing, report, text = verify(record("passing", [options.passing_app]))
        self.assertEqual(failing - TIMING, set(), text)
        undecided = {r["id"] for r in report["rules"] if r["verdict"] == "INCONCLUSIVE"}
        self.assertEqual(undecided - TIMING, set(), text)
        subjects = [s for r in report["rules"] if r["id"] == "E1" for s in r["subjects"] if s["verdict"] == "PASS"]
        self.assertGreater(len(subjects), 100, "five callbacks a round")
        report = json.loads(run(options.programs / "cie", "report", scratch / "passing", "-f", "json").stdout)
        waited = {c["logical_id"]: c["longest_queue"] for c in report["callbacks"] if c["source"].endswith("/map")}
        self.assertEqual(list(waited.values()), [3], waited)

    def test_an_executor_that_spins_again_is_no_violation(self):
        for executor, of_sharing in (("isolated", set()), ("single", {"M2", "M3"})):
            with self.subTest(executor):
                directory = record(f"respinning-{executor}", [options.respinning_app, executor])
                failing, report, text = verify(directory)
                self.assertEqual(failing - TIMING, of_sharing, text)
                undecided = {r["id"] for r in report["rules"] if r["verdict"] == "INCONCLUSIVE"}
                self.assertEqual(undecided - TIMING, set(), text)
                report = json.loads(run(options.programs / "cie", "report", directory, "-f", "json").stdout)
                spinning = [t for t in report["threads"] if t["role"] == "dispatcher"]
                self.assertEqual(len(spinning), 2, "the first spun twice")
                missed = {c["logical_id"]: c["missed_releases"] for c in report["callbacks"]}
                # Of 10 ms, in two pauses of 30 ms: the last period of each is served.
                self.assertGreaterEqual(missed["/respinning/stays@Timer(10000000)"], 4)

    def test_two_executors_are_both_told(self):
        for first, arguments, status in (("isolated", [], "0"), ("single", ["throw"], "1"), ("isolated", ["throw"], "1")):
            with self.subTest(first=first, arguments=arguments):
                directory = record("-".join(["two", first, *arguments]), [options.two_executors_app, first, *arguments])
                events = run("babeltrace2", directory).stdout
                self.assertEqual(re.findall(r"cie:run_end: .* status = (\d+)", events), [status],
                                 "of the executor that failed, whichever ended last")
                report = json.loads(run(options.programs / "cie", "report", directory, "-f", "json").stdout)
                self.assertEqual([p["executor"] for p in report["processes"]], ["isolated+single_threaded"])
                failing, report, text = verify(directory)
                self.assertEqual(failing - TIMING, {"M2"}, text)
                threads = [s["verdict"] for r in report["rules"] if r["id"] == "M2" for s in r["subjects"]]
                self.assertEqual(threads.count("FAIL"), 1, "the one that spins")

    def test_the_same_bytes_give_the_same_bytes(self):
        """Whatever the order in which a folder lists its files, and whatever the locale."""
        twin = scratch / "twin" / self.reniced.name
        files = sorted((f for f in self.reniced.rglob("*") if f.is_file()), reverse=True)
        for file in files:  # created in another order
            target = twin / file.relative_to(self.reniced)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(file.read_bytes())
        for command in (["verify"], ["verify", "--all"], *(["verify", "-f", f] for f in ("json", "junit", "sarif", "tap")),
                        ["report"], *(["report", "-f", f] for f in ("json", "csv")), ["instances"],
                        ["analyze", "schedulability"], ["export", "--to", "dot"]):
            outputs = set()
            for parent in (scratch, scratch / "twin"):
                for locale in LOCALES:
                    done = subprocess.run([options.programs.resolve() / "cie", *command, self.reniced.name], cwd=parent,
                                          capture_output=True, timeout=200, check=False,
                                          env={**os.environ, "LC_ALL": locale, "LANG": locale})
                    outputs.add(done.stdout + done.stderr)  # which tells what a table has no place for
            texts = [output.decode().splitlines() for output in sorted(outputs)]
            self.assertEqual(len(texts), 1, "\n".join(difflib.unified_diff(texts[0], texts[-1], lineterm="")))


def main():
    global options  # pylint: disable=global-statement
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--grouped-app", type=Path, required=True)
    parser.add_argument("--passing-app", type=Path, required=True)
    parser.add_argument("--respinning-app", type=Path, required=True)
    parser.add_argument("--two-executors-app", type=Path, required=True)
    parser.add_argument("--examples", type=Path, required=True)
    options, rest = parser.parse_known_args()

    def begin(folder):
        global scratch  # pylint: disable=global-statement
        scratch = folder

    isolated_main.main("verdicts", rest, begin)


if __name__ == "__main__":
    main()
