#!/usr/bin/env python3
"""Records the demo for real and holds everything cie says about it against what must be true.

Times are never asserted here: counts, order, mapping, exit codes, conservation.
"""

import argparse
import csv
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie, rules_of  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
CALLBACKS = 28
TIMING = {"R1", "R2", "R3", "Q1"}  # rules that a busy machine violates: they may fail here, and nothing else
PROCESSES = 2


def run(command, **kwargs):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=200,
                          check=False, **kwargs)


def record(name, *arguments, command):
    directory = scratch / name
    done = options.cie.run("record", "-o", directory, *arguments, "--", *command)
    assert done.returncode == 0, done.stderr
    return directory, done


def demo(executor, *arguments, seconds=2):
    return [options.programs / "cie-demo", "--executor", executor, "--duration", str(seconds), "--load", "0.2",
            "--tag", f"main_job_{os.getpid()}", *arguments]


def callbacks_that_ran(directory):
    done = options.cie.run("report", directory, "--format", "json")
    callbacks = json.loads(done.stdout)["callbacks"] if done.returncode == 0 else []
    return sum(callback["instances"] > 0 for callback in callbacks)


def verdicts(directory, *arguments):
    """Exit code, and what it says in JSON."""
    done = options.cie.run("verify", directory, "--format", "json", *arguments)
    return done.returncode, json.loads(done.stdout)


class Demo(unittest.TestCase):
    """Two recordings, of the same application under two executors."""

    @classmethod
    def setUpClass(cls):
        may_be_real_time = run(["chrt", "-f", "1", "true"]).returncode == 0
        cls.spec = options.examples / ("demo.yaml" if may_be_real_time else "demo_unprivileged.yaml")
        # Somebody else's traced application, which no recording below may contain.
        with subprocess.Popen([str(c) for c in demo("single", "--domain", "78", seconds=60)],
                              stdout=subprocess.DEVNULL) as stranger:
            cls.isolated, cls.said = isolated_main.with_time_enough(
                lambda seconds: record(f"isolated_{seconds}", command=demo("isolated", "--spec", cls.spec, seconds=seconds)),
                lambda recorded: callbacks_that_ran(recorded[0]) == CALLBACKS, (2, 10, 50))
            stranger.terminate()
        cls.multi, _ = record("multi", command=demo("multi", "--threads", "3"))

    def copy(self, source, name):
        target = scratch / f"{self.id().rsplit('.', 1)[-1]}_{name}"
        shutil.copytree(source, target)
        return target

    def streams(self, directory):
        return sorted(p for p in directory.rglob("*")
                      if p.is_file() and p.parent.name != "index" and p.stat().st_size > 0
                      and p.name not in ("metadata", "manifest.json"))

    def test_isolated_passes(self):
        code, report = verdicts(self.isolated, "--spec", self.spec)
        failing = {r["id"] for r in report["rules"] if r["verdict"] in ("FAIL", "INCONCLUSIVE")}
        self.assertLessEqual(failing, TIMING, self.explain(report))
        self.assertEqual(code, 1 if failing else 0)
        for name in ("T1", "T2", "T3", "T4", "T5", "M1", "M2", "M3", "M4", "M6", "M7", "M8", "M9",
                     "E1", "E2", "E3", "S1", "S2"):
            self.assertEqual(rules_of(report)[name]["verdict"], "PASS", name)
        for name in ("M2", "M3", "S1", "S2"):
            subjects = [s for s in rules_of(report)[name]["subjects"]
                        if name == "M2" or s["subject"].startswith("callback ")]
            self.assertEqual(len(subjects), CALLBACKS, name)
            self.assertTrue(all(s["checked"] >= 1 for s in subjects), name)

    def test_queues_overflowed_where_their_totals_say_so(self):
        totals = re.findall(r"cie:callback_fini:.* overwritten = (\d+), lost = (\d+)", run(["babeltrace2", self.isolated]).stdout)
        self.assertEqual(len(totals), CALLBACKS)
        _, report = verdicts(self.isolated, "--spec", self.spec)
        found = [s["verdict"] for s in rules_of(report)["Q1"]["subjects"]]
        self.assertEqual(found.count("FAIL"), sum((int(overwritten), int(lost)) != (0, 0) for overwritten, lost in totals))
        self.assertNotIn("INCONCLUSIVE", found)

    def explain(self, report):
        return [(r["id"], s) for r in report["rules"] for s in r["subjects"]
                if s["verdict"] in ("FAIL", "INCONCLUSIVE")]

    def test_multi_threaded_violates_the_mapping_with_evidence(self):
        code, report = verdicts(self.multi)
        self.assertEqual((code, report["verdict"]), (1, "FAIL"))
        for name in ("M2", "M3"):
            failing = [s for s in rules_of(report)[name]["subjects"] if s["verdict"] == "FAIL"]
            self.assertTrue(failing, name)
            for subject in failing:
                seen = [e for e in subject["evidence"] if e["tid"] is not None]
                self.assertGreaterEqual(len(seen), 2, "one event alone shows nothing")
                self.assertTrue(all(e["time_ns"] > 0 for e in seen))
        text = options.cie.run("verify", self.multi, "--all").stdout
        self.assertRegex(text, r"FAIL +M2 one-callback-per-thread: thread \d+")
        self.assertRegex(text, r"FAIL +M3 one-thread-per-callback: callback /\w+")
        self.assertRegex(text, r"at \d+ ns .*tid \d+")
        self.assertIn("cie events", text)

    def test_every_stream_file_is_missed(self):
        for number, stream in enumerate(self.streams(self.isolated)):
            copy = self.copy(self.isolated, number)
            (copy / stream.relative_to(self.isolated)).unlink()
            code, report = verdicts(copy, "--spec", self.spec)
            failing = {r["id"] for r in report["rules"] if r["verdict"] == "FAIL"}
            self.assertLessEqual(failing, TIMING, (stream, self.explain(report)))
            self.assertEqual(code, 1 if failing else 3, stream)
            self.assertIn("INCONCLUSIVE", [r["verdict"] for r in report["rules"]], stream)

    def test_garbage_is_unreadable(self):
        nothing = scratch / "nothing_here"
        nothing.mkdir()
        garbage = scratch / "garbage"
        garbage.mkdir()
        (garbage / "metadata").write_bytes(bytes(range(256)) * 40)
        for what in (nothing, garbage, scratch / "does_not_exist", options.programs / "cie"):
            for command in ("verify", "report", "instances"):
                done = options.cie.run(command, what)
                self.assertEqual(done.returncode, 4, (command, what, done.stderr))
                self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)

    def test_metadata_that_is_lost_is_known_from_the_provider(self):
        metadata = next((self.isolated / "ust").rglob("metadata")).relative_to(self.isolated)
        whole = options.cie.json("report", self.isolated)
        for size in (0, 1, 4096, 5000, None):
            with self.subTest(size=size):
                copy = self.copy(self.isolated, size)
                if size is None:
                    (copy / metadata).unlink()
                else:
                    os.truncate(copy / metadata, size)
                told = options.cie.json("report", copy)
                for part in ("processes", "callbacks", "threads", "chains"):
                    self.assertEqual(told[part], whole[part], part)
                self.assertIn("foreign-metadata", [d["kind"] for d in told["defects"]])
                code, report = verdicts(copy)
                self.assertNotEqual(code, 0)
                self.assertEqual(rules_of(report)["T1"]["verdict"], "INCONCLUSIVE")

    def test_a_misspelt_option_is_a_usage_error(self):
        done = options.cie.run("verify", self.isolated, "--sepc", self.spec)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--spec", done.stderr)
        self.assertEqual(options.cie.run("verfy", self.isolated).returncode, 2)
        self.assertEqual(options.cie.run("verify", self.isolated, "--spec", scratch / "no.yaml").returncode, 2)

    def test_numbers_equal_an_independent_recomputation(self):
        sys.path.insert(0, str(options.oracle))
        from oracle import check, difference  # pylint: disable=import-outside-toplevel
        for directory in (self.isolated, self.multi):
            again = check.recompute([str(directory)], str(self.spec))
            report = json.loads(options.cie.run("report", directory, "--spec", self.spec, "--format",
                                    "json").stdout)
            self.assertEqual(difference.compare(again["report"], report), [])
            self.assertEqual(
                difference.compare_text(again["instances"], options.cie.run("instances", directory).stdout,
                                        "instances.csv"), [])

    def test_report_and_instances_have_the_contracts_shape(self):
        report = options.cie.json("report", self.isolated)
        self.assertEqual(list(report), ["schema", "tool", "trace", "defects", "processes",
                                        "callbacks", "threads", "chains", "edges"])
        self.assertEqual(report["schema"], "cie.report/2")
        self.assertEqual(list(report["trace"]), ["paths", "begin_ns", "end_ns", "events", "streams",
                                                 "hosts", "lost_events", "complete", "clock_offset_ns"])
        self.assertEqual(len(report["callbacks"]), CALLBACKS)
        self.assertEqual([process["name"] for process in report["processes"]],
                         ["cie-demo"] * PROCESSES)
        for callback in report["callbacks"]:
            self.assertEqual(list(callback), [
                "logical_id", "pid", "node", "kind", "source", "symbol", "period_ns", "group",
                "threads", "isolated", "instances", "incomplete", "exceptions",
                "missed_releases", "longest_queue", "release_source", "response_time_ns", "response_time_lower_ns",
                "response_time_upper_ns", "start_latency_ns", "duration_ns", "inter_arrival_ns",
                "execution_time_ns", "preempted_ns", "blocked_ns", "wake_delay_ns",
                "wakeup_latency_ns", "isolation", "index", "process", "deadline_ns", "response_deadline_ns", "late", "preempted_by",
                "cut", "runs_not_seen", "lost_samples", "overwritten_samples"])
            self.assertTrue(callback["isolated"], callback["logical_id"])
            self.assertEqual(callback["release_source"], "exact", callback["logical_id"])
        self.assertTrue(report["trace"]["complete"])

        rows = list(csv.DictReader(io.StringIO(options.cie.run("instances", self.isolated).stdout)))
        self.assertEqual(list(rows[0]), [
            "logical_id", "pid", "tid", "seq", "release_ns", "wakeup_ns", "start_ns", "end_ns",
            "cpu_start", "cpu_end", "execution_ns", "preempted_ns", "blocked_ns", "release_source",
            "waking_ns", "wake_delay_ns", "missed", "status", "host"])
        self.assertEqual(len(rows), sum(c["instances"] for c in report["callbacks"]))
        keys = [(int(r["start_ns"]), int(r["tid"])) for r in rows]
        self.assertEqual(keys, sorted(keys))

    def test_the_babeltrace2_component_says_the_same(self):
        done = run(["babeltrace2", "--plugin-path", options.plugins, self.isolated, "-c",
                    "sink.cie.report", "-p", 'format="json"'])
        self.assertEqual(done.returncode, 0, done.stderr)
        ours = options.cie.json("report", self.isolated)
        theirs = json.loads(done.stdout)
        for report in (ours, theirs):
            del report["trace"]["paths"]
            del report["chains"]  # equal times of two processes may be merged either way
        self.assertIs(ours["trace"].pop("complete"), True)
        self.assertIs(theirs["trace"].pop("complete"), False, "it reads no manifest")
        self.assertEqual(ours, theirs)

    def test_a_viewer_file_is_written_whole_or_not_at_all(self):
        target = scratch / "isolated.pftrace"
        done = options.cie.run("export", self.isolated, "--to", "perfetto", "-o", target)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(target.stat().st_size, 10_000)
        missing = scratch / "missing" / "file.pftrace"
        self.assertEqual(
            options.cie.run("export", self.isolated, "--to", "perfetto", "-o", missing).returncode, 4)
        self.assertFalse(missing.parent.exists())

    def test_the_recording_is_sealed(self):
        manifest = manifest_of(self.isolated)
        named = {f["path"]: f for f in manifest["files"]}
        for path in self.streams(self.isolated):
            self.assertEqual(named[str(path.relative_to(self.isolated))]["size"],
                             path.stat().st_size)
        sums = "".join(f"{f['sha256']}  {name}\n" for name, f in named.items())
        done = run(["sha256sum", "--check", "--quiet", "-"], cwd=self.isolated, input=sums)
        self.assertEqual(done.returncode, 0, done.stderr)
        # Commands to paste judge by the spec that the application ran by.
        self.assertIn(f"next: cie report {self.isolated} --spec {self.spec}\n      cie verify {self.isolated} --spec {self.spec}\n",
                      self.said.stderr + self.said.stdout)


class Trouble(unittest.TestCase):
    def test_emitted_is_recorded_plus_discarded_and_the_verdict_inconclusive(self):
        # Two sub-buffers of 4 KiB per CPU and 80 000 events at full speed: LTTng must discard.
        directory, done = record("overflow", "--subbuf-size", "4096", "--num-subbuf", "2",
                                 command=[options.burst_app, "20000"])
        emitted = int(done.stdout)
        text = run(["babeltrace2", directory]).stdout
        starts = text.count("cie:callback_start:")
        recorded = starts + text.count("cie:callback_end:")
        discarded = sum(c["discarded_events"] for c in
                        manifest_of(directory)["channels"])
        self.assertGreater(discarded, 0)
        self.assertEqual(emitted, recorded + discarded)
        self.assertIn("LOST", done.stderr)
        report = options.cie.json("report", directory)
        self.assertFalse(report["trace"]["complete"])
        code, verdict = verdicts(directory)
        self.assertEqual((code, verdict["verdict"]), (3, "INCONCLUSIVE"))
        for name in ("T2", "M2", "M3", "E1"):
            self.assertEqual(rules_of(verdict)[name]["verdict"], "INCONCLUSIVE", name)
        # Numbers have holes only if starts (or ends) were discarded before others that were recorded, or an end
        # is there whose start is not: it is shorter and fits where the start did not.
        numbers = {}
        for event, callback, seq in re.findall(r"cie:callback_(start|end):.*callback_id = (\d+), seq = (\d+)", text):
            numbers.setdefault(callback, {"start": [], "end": []})[event].append(int(seq))
        self.assertEqual(sum(len(of) for both in numbers.values() for of in both.values()), recorded)
        has_holes = any(max(of, default=-1) + 1 != len(of) for both in numbers.values() for of in both.values()) or any(
            max(both["end"], default=-1) > max(both["start"], default=-1) for both in numbers.values())
        self.assertEqual(rules_of(verdict)["T3"]["verdict"], "INCONCLUSIVE" if has_holes else "PASS")

    def test_kill_9_in_mid_recording(self):
        pid_file = scratch / "killed.pid"
        directory = scratch / "killed"
        command = [str(c) for c in demo("isolated", seconds=60)]
        with subprocess.Popen(
                [options.programs / "cie", "record", "-o", directory, "--", "sh", "-c",
                 'echo $$ > "$0" && exec "$@"', pid_file, *command],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as recorder:
            def instances():
                done = options.cie.run("report", directory, "--format", "json")
                return sum(c["instances"] for c in json.loads(done.stdout)["callbacks"]) if done.returncode == 0 else 0
            isolated_main.wait_for(lambda: pid_file.exists() and pid_file.read_text().strip(), "the application's start")
            isolated_main.wait_for(lambda: instances() > 50, "its first instances")
            os.kill(int(pid_file.read_text()), signal.SIGKILL)
            _, err = recorder.communicate(timeout=200)
            self.assertEqual(recorder.returncode, 0, err)
        report = options.cie.json("report", directory)
        self.assertGreater(sum(c["instances"] for c in report["callbacks"]), 50)
        killed = int(pid_file.read_text())
        self.assertIn((killed, False), [(p["pid"], p["complete"]) for p in report["processes"]])
        rows = list(csv.DictReader(io.StringIO(options.cie.run("instances", directory).stdout)))
        still_open = [r for r in rows if not r["end_ns"]]
        self.assertEqual(len(still_open), sum(c["incomplete"] for c in report["callbacks"]))
        code, verdict = verdicts(directory)
        failing = {r["id"] for r in verdict["rules"] if r["verdict"] == "FAIL"}
        self.assertLessEqual(failing, TIMING)
        self.assertEqual(code, 1 if failing else 3)
        self.assertEqual(rules_of(verdict)["T4"]["verdict"], "INCONCLUSIVE")
        self.assertIn("interrupted", json.dumps(rules_of(verdict)["T4"]))

    def test_the_instance_a_process_died_in_is_listed(self):
        directory, _ = record("died", command=[options.burst_app, "50", "--kill"])
        callbacks = {c["logical_id"]: c for c in
                     options.cie.json("report", directory)["callbacks"]}
        died_in = callbacks["/burst@Timer(1)"]
        self.assertEqual((died_in["instances"], died_in["incomplete"]), (50, 1))
        rows = list(csv.DictReader(io.StringIO(options.cie.run("instances", directory).stdout)))
        open_rows = [(r["logical_id"], r["seq"]) for r in rows if not r["end_ns"]]
        self.assertIn(("/burst@Timer(1)", "50"), open_rows)
        _, verdict = verdicts(directory)
        self.assertIn("interrupted", json.dumps(rules_of(verdict)["T4"]))


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


def main():
    global options  # pylint: disable=global-statement
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("programs", "burst-app", "plugins", "examples", "oracle"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    options, rest = parser.parse_known_args()
    options.cie = Cie(options.programs / "cie")
    isolated_main.main("main-job", rest, begin)


if __name__ == "__main__":
    main()
