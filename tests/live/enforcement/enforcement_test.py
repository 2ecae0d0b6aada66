#!/usr/bin/env python3
"""24 callbacks under all six policies, for real: who runs as what, since when, and who says so.

Times are never asserted.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie, rules_of  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
PAIRS = 12
ENDED_WELL, REFUSED = 0, 3
IDS = ([f"/enforced/app@Timer({20_000_000 + 1000 * i})" for i in range(PAIRS)]
       + [f"/enforced/app@Subscription(/enforced/topic{i})" for i in range(PAIRS)])
CPU = min(os.sched_getaffinity(0))
FIELDS = {"SCHED_OTHER": ("nice",), "SCHED_BATCH": ("nice",), "SCHED_FIFO": ("priority",),
          "SCHED_RR": ("priority",), "SCHED_DEADLINE": ("runtime", "deadline", "period"),
          "SCHED_IDLE": ()}
NUMBERS = {"SCHED_OTHER": 0, "SCHED_FIFO": 1, "SCHED_RR": 2, "SCHED_BATCH": 3, "SCHED_IDLE": 5,
           "SCHED_DEADLINE": 6}


def all_policies():
    """Four callbacks of each policy, no two entries alike but the idle ones."""
    entries = {}
    for i, logical_id in enumerate(IDS):
        entries[logical_id] = [
            {"policy": "SCHED_OTHER", "nice": i - 10, "slice": 100_000 * (i + 1)},
            {"policy": "SCHED_BATCH", "nice": i - 12, "affinity": [CPU]},
            {"policy": "SCHED_IDLE"},
            {"policy": "SCHED_FIFO", "priority": 10 + i, "affinity": [CPU]},
            {"policy": "SCHED_RR", "priority": 10 + i},
            {"policy": "SCHED_DEADLINE", "runtime": 100_000 + i, "deadline": 10_000_000 + i,
             "period": 20_000_000 + i}][i % 6]
    return entries


def unprivileged():
    return {logical_id: [{"policy": "SCHED_OTHER", "nice": i % 19, "slice": 200_000 + i},
                         {"policy": "SCHED_BATCH", "nice": i % 19, "affinity": [CPU]},
                         {"policy": "SCHED_IDLE"}][i % 3] for i, logical_id in enumerate(IDS)}


def write_spec(file, entries):
    lines = ["callback_groups:"]
    for logical_id, fields in entries.items():
        lines.append(f"  - id: {logical_id}")
        lines += [f"    {key}: {value}" for key, value in fields.items()]
    # Written beside and renamed: a reload never reads half a file.
    fresh = file.with_suffix(".new")
    fresh.write_text("\n".join(lines) + "\n")
    fresh.rename(file)
    return file


class Recorded:
    """The application under `cie record`, once all its callbacks ran."""

    def __init__(self, name, entries, *, prefix=(), audit_ms=None):
        self.directory = scratch / name
        self.spec = write_spec(scratch / f"{name}.yaml", entries)
        self.log = scratch / f"{name}.log"
        report = scratch / f"{name}.pid"
        command = [*prefix, options.app, self.spec, report, *([str(audit_ms)] if audit_ms else [])]
        with self.log.open("w") as log:
            self.recorder = subprocess.Popen(
                [options.programs / "cie", "record", "-o", self.directory, "--", *command],
                stdout=log, stderr=log)
        wait_for(lambda: self.recorder.poll() is not None
                 or (report.exists() and report.read_text().endswith("\n")), self.text())
        self.pid = int(report.read_text()) if self.recorder.poll() is None else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def text(self):
        return self.log.read_text()

    def end(self):
        if self.recorder.poll() is None and self.pid:
            os.kill(self.pid, signal.SIGTERM)
        self.recorder.wait(timeout=200)

    def threads(self):
        """Thread ids by name."""
        tasks = Path(f"/proc/{self.pid}/task").iterdir()
        return {(task / "comm").read_text().strip(): int(task.name) for task in tasks}

    def reload(self, entries, awaited):
        if isinstance(entries, str):
            self.spec.write_text(entries)
        else:
            write_spec(self.spec, entries)
        before = self.text().count(awaited)
        os.kill(self.pid, signal.SIGHUP)
        wait_for(lambda: self.text().count(awaited) > before, awaited)


def second_opinion(directory, spec):
    """By a second implementation of the rules: the subjects' verdicts, by rule."""
    sys.path.insert(0, str(options.oracle))
    from oracle import check  # pylint: disable=import-outside-toplevel
    judged = check.recompute([str(directory)], str(spec))["verify"]["rules"]
    return {rule["id"]: (rule["verdict"], {s["subject"]: s["verdict"] for s in rule["subjects"]}) for rule in judged}


def told_of(directory, subjects):
    """The events of those subjects' threads, for whoever looks for who is right: the recording is gone by then."""
    events = options.cie.text("events", directory)
    tids = [subject.split()[1] for subject in subjects if subject.startswith("thread ")]
    return "\n".join(line for line in events.splitlines() if any(re.search(rf"\b{tid}\b", line) for tid in tids))


def verify(directory, spec):
    rules = rules_of(options.cie.json("verify", directory, "--spec", spec))
    others = second_opinion(directory, spec)
    for name in ("S1", "S2", "S3", "S4"):
        verdict, of_subjects = others[name]
        if rules[name]["verdict"] == verdict:
            continue
        ours = {s["subject"]: s["verdict"] for s in rules[name]["subjects"]}
        differ = {subject: (other, ours.get(subject)) for subject, other in of_subjects.items()
                  if ours.get(subject) != other}
        raise AssertionError(f"{name}: the second opinion and cie: {differ}\n{told_of(directory, differ)}")
    return rules


def verdicts(rules, *names):
    return [rules[name]["verdict"] for name in names]


def subjects(rules, name):
    return {s["subject"].removeprefix("callback "): s for s in rules[name]["subjects"]}


def failing(rules, name):
    return [s for s in rules[name]["subjects"] if s["verdict"] == "FAIL"]


def may_be_real_time():
    return subprocess.run(["chrt", "-f", "1", "true"], capture_output=True,
                          check=False).returncode == 0


def without_sys_nice():
    """Neither the capability nor the limits that would do instead."""
    of_root = ["--bounding-set=-sys_nice"] if os.geteuid() == 0 else []
    return ["prlimit", "--rtprio=0", "--nice=0", "setpriv", *of_root, "--inh-caps=-sys_nice"]


class Enforcement(unittest.TestCase):

    def read_events(self, directory):
        """Read-backs and first starts by another reader than ours: (event, tid, fields) in order."""
        done = subprocess.run(["babeltrace2", "--fields=all", directory], capture_output=True,
                              text=True, timeout=200, check=True)
        events = []
        for line in done.stdout.splitlines():
            found = re.search(r"cie:(thread_sched|callback_start|callback_init): (.*)", line)
            if found:
                fields = dict(re.findall(r"(\w+) = (?:\( )?\"?([^,\" }]*)", found[2]))
                fields["cpus"] = re.findall(r"\[\d+\] = (\d+)", found[2])
                events.append((found[1], fields))
        return events

    def test_every_thread_runs_as_specified_before_its_first_instance(self):
        if not may_be_real_time():
            self.skipTest("not possible here: needs CAP_SYS_NICE and a real-time budget")
        entries = all_policies()
        with Recorded("specified", entries) as app:
            pass
        self.assertEqual(len(entries), 24)
        rules = verify(app.directory, app.spec)
        for name in ("S1", "S2"):
            self.assertEqual(rules[name]["verdict"], "PASS", failing(rules, name))
            judged = subjects(rules, name)
            self.assertEqual(set(IDS) - set(judged), set(), name)
            self.assertTrue(all(judged[i]["checked"] >= 1 for i in IDS), name)

        # The same, without any rule of ours.
        ids, applied, first = {}, {}, {}
        for event, fields in self.read_events(app.directory):
            if event == "callback_init":
                ids[fields["callback_id"]] = fields["logical_id"]
            elif event == "thread_sched" and "applied" in fields["moment"]:
                applied[fields["tid"]] = fields
            elif event == "callback_start" and fields["callback_id"] not in first:
                first[fields["callback_id"]] = applied.get(fields["vtid"])
        self.assertEqual(sorted(ids[c] for c in first), sorted(IDS))
        for callback, read_back in first.items():
            entry = entries[ids[callback]]
            self.assertIsNotNone(read_back, ids[callback])
            self.assertEqual(int(read_back["policy"]), NUMBERS[entry["policy"]], ids[callback])
            for key in FIELDS[entry["policy"]]:
                field = key if key in ("nice", "priority") else f"{key}_ns"
                self.assertEqual(int(read_back[field]), entry[key], (ids[callback], key))
            if "slice" in entry:
                self.assertEqual(int(read_back["slice_ns"]), entry["slice"], ids[callback])
            if "affinity" in entry:
                self.assertEqual(read_back["cpus"], [str(CPU)], ids[callback])

    def test_without_the_capability_each_refusal_is_named_and_nothing_runs(self):
        entries = all_policies()
        spec = write_spec(scratch / "refused.yaml", entries)
        done = subprocess.run([*without_sys_nice(), options.app, spec, scratch / "refused.pid"],
                              capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(done.returncode, REFUSED, done.stderr)
        self.assertEqual(re.findall(r"ran (\d+) (\d+)", done.stdout), [("0", "0")] * PAIRS)
        lines = spec.read_text().splitlines()
        for logical_id, entry in entries.items():
            needs = (entry["policy"] in ("SCHED_FIFO", "SCHED_RR", "SCHED_DEADLINE")
                     or entry.get("nice", 0) < 0)
            line = lines.index(f"  - id: {logical_id}") + 1
            said = [text for text in done.stderr.splitlines() if f"\"{logical_id}\"" in text]
            self.assertEqual(len(said), 1 if needs else 0, (logical_id, said))
            if needs:
                self.assertIn(f"refused.yaml:{line}: ", said[0])
                self.assertIn(f"cannot set {entry['policy']}", said[0])
                self.assertIn("CAP_SYS_NICE is needed", said[0])

    def test_policies_without_privilege_need_none(self):
        with Recorded("unprivileged", unprivileged(), prefix=without_sys_nice()) as app:
            pass
        rules = verify(app.directory, app.spec)
        self.assertEqual(verdicts(rules, "S1", "S2"), ["PASS", "PASS"], app.text())
        self.assertEqual(set(IDS) - set(subjects(rules, "S1")), set())

    def test_a_reload_changes_threads_that_run(self):
        former = unprivileged()
        fresh = dict(former)
        fresh[IDS[0]] = {"policy": "SCHED_BATCH", "nice": 18}
        fresh[IDS[1]] = {"policy": "SCHED_OTHER", "nice": 17, "affinity": [CPU], "slice": 777_000}
        with Recorded("reloaded", former, audit_ms=100) as app:
            before = app.threads()
            app.reload(fresh, "reloaded")
            time.sleep(0.5)  # for some instances under the new spec
            self.assertEqual(app.threads(), before, "no thread is replaced")
        former_spec = write_spec(scratch / "former.yaml", former)
        rules = verify(app.directory, app.spec)
        self.assertEqual(verdicts(rules, "S1", "S2", "S3", "S4"), ["PASS"] * 4,
                         [failing(rules, name) for name in ("S1", "S2", "S3", "S4")])
        judged = subjects(rules, "S2")
        self.assertEqual(set(IDS) - set(judged), set(IDS[:2]), "they ran by the former spec first")
        rules = verify(app.directory, former_spec)
        self.assertEqual([s["subject"] for s in failing(rules, "S1")],
                         [f"callback {i}" for i in IDS[:2]])
        self.assertEqual(rules["S2"]["verdict"], "PASS")

    def test_a_bad_file_leaves_the_former_spec_in_force(self):
        former = unprivileged()
        with Recorded("kept", former, audit_ms=100) as app:
            app.reload("callback_groups: [{id: x, polcy: y}]\n", "the former spec stays in force")
            self.assertIn("unknown key \"polcy\"", app.text())
            # Not SCHED_IDLE, out of which nobody gets without privilege.
            impossible = {**former, IDS[0]: {"policy": "SCHED_BATCH"},
                          IDS[5]: {"policy": "SCHED_BATCH", "affinity": [1023]}}
            app.reload(impossible, "the former spec stays in force")
            self.assertIn("cannot set CPUs 1023", app.text())
            time.sleep(0.3)
        spec = write_spec(scratch / "kept_former.yaml", former)
        rules = verify(app.directory, spec)
        self.assertEqual(verdicts(rules, "S2", "S3", "S4"), ["PASS"] * 3,
                         [failing(rules, name) for name in ("S2", "S3", "S4")])
        # An instance may start before what the refused file changed is taken back.
        self.assertLessEqual({s["subject"] for s in failing(rules, "S1")}, {f"callback {IDS[0]}"})

    def test_both_processes_of_the_demo_reload(self):
        spec = scratch / "demo.yaml"
        spec.write_text("callback_groups: []\n")
        with (scratch / "demo.log").open("w+") as log, subprocess.Popen(
                [options.programs / "cie-demo", "--duration", "60", "--load", "0.1", "--spec", spec,
                 "--tag", f"reload{os.getpid()}"], stdout=log, stderr=log) as demo:
            tasks = Path(f"/proc/{demo.pid}/task")
            wait_for(lambda: any((task / "comm").read_text() == "cie-hangup\n"
                                 for task in tasks.iterdir()), "the demo listens")
            demo.send_signal(signal.SIGHUP)
            said = Path(log.name)
            wait_for(lambda: said.read_text().count("as it is now") == 2, "both reload")
            spec.write_text("callback_groups: {}\n")
            demo.send_signal(signal.SIGHUP)
            wait_for(lambda: said.read_text().count("the former spec stays in force") == 2,
                     "both keep what they have")
            demo.terminate()
            self.assertEqual(demo.wait(timeout=200), ENDED_WELL)

    def test_who_changes_a_thread_from_outside_is_found(self):
        with Recorded("outside", unprivileged(), audit_ms=50) as app:
            tid = next(tid for name, tid in app.threads().items() if name.startswith("app:20ms"))
            subprocess.run(["chrt", "--idle", "--pid", "0", str(tid)], check=True)
            wait_for(lambda: "changed from outside: policy is SCHED_IDLE" in app.text(),
                     "the audit finds it")
        rules = verify(app.directory, app.spec)
        self.assertEqual([s["subject"] for s in failing(rules, "S3")], [f"thread {tid}"])
        self.assertIn("SCHED_IDLE", json.dumps(failing(rules, "S3")))
        self.assertEqual(verdicts(rules, "S2"), ["PASS"], "configured before its first instance")
        # As it should, too: but an instance that starts once the audit has found it runs as SCHED_IDLE.
        self.assertEqual([s for s in failing(rules, "S1") if "SCHED_IDLE" not in json.dumps(s)], [])


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory
    os.environ["CIE_LOOPBACK"] = "1"
    os.environ["CIE_DISCOVERY_TAG"] = f"enforcement{os.getpid()}"


def main():
    global options  # pylint: disable=global-statement
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("programs", "app", "oracle"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    options, rest = parser.parse_known_args()
    options.cie = Cie(options.programs / "cie")
    isolated_main.main("enforcement", rest, begin)


if __name__ == "__main__":
    main()
