#!/usr/bin/env python3
"""The flight recorder (`cie record --snapshot`): what makes it save, what it saves, and where it stops.
Arguments: PROGRAMS APPLICATION (traced_app) LATE_APPLICATION (late_app)."""

import os
import re
import signal
import struct
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import PATIENCE, wait_for  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of, starts_of  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, APPLICATION, LATE_APPLICATION = (Path(argument).resolve() for argument in sys.argv[1:4])
cie = Cie(PROGRAMS / "cie")
scratch: Path


def run(*command):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=PATIENCE, check=False)


def window_of(snapshot, streams):
    """From when to when all channels of some streams reach, by the headers of their packets: see recording_layout.hpp. A
    snapshot takes one channel after the other: where what they hold has no time in common, from the first begin to the last end."""
    begins, ends = {}, {}
    for file in snapshot.rglob(streams):
        data = file.read_bytes()
        if file.parent.name == "index" or not data:
            continue
        at = 0
        while at < len(data):
            begin, end, _, packet_bits = struct.unpack_from("=QQQQ", data, at + 32)
            if at == 0:
                first = begin
            at += packet_bits // 8
        channel = file.name.rpartition("_")[0]
        begins[channel] = max(first, begins.get(channel, first))
        ends[channel] = min(end, ends.get(channel, end))
    common = max(begins.values()), min(ends.values())
    return common if common[0] <= common[1] else (min(begins.values()), max(ends.values()))


class Flight(unittest.TestCase):
    def record(self, name, options, arguments, application=APPLICATION):
        """A recorder that runs in the background, and its directory."""
        directory = scratch / name
        command = [cie.program, "record", "-o", directory, "--snapshot", "5", *options, "--", application, *arguments]
        recorder = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                    text=True)
        self.addCleanup(recorder.stderr.close)
        self.addCleanup(recorder.wait)
        self.addCleanup(recorder.kill)
        return recorder, directory

    def end(self, recorder, wanted_status=0):
        _, text = recorder.communicate(timeout=PATIENCE)
        self.assertEqual(recorder.returncode, wanted_status, text)
        return text

    def check_complete(self, snapshot, may_have_ended=False):
        """Nothing of a snapshot is taken for a violation, or for lost, because its past was overwritten.
        The application violates M2: it runs two callbacks on one thread. At its end, it tells of samples that were
        overwritten (Q1)."""
        verdicts = cie.verdicts(snapshot)
        timing = {"R1", "R2", "R3"}
        self.assertEqual({rule for rule, verdict in verdicts.items() if verdict == "FAIL"} - timing
                         - ({"Q1"} if may_have_ended else set()), {"M2"})
        for rule in ("T3", "T5", "M3", "E1", "E2", "E3"):
            self.assertEqual(verdicts[rule], "PASS", rule)
        report = cie.json("report", snapshot)
        self.assertEqual({callback["logical_id"] for callback in report["callbacks"]},
                         {"/test/node@Timer(1000000)", "/test/node@Subscription(/test/topic)"})
        self.assertEqual({callback["node"] for callback in report["callbacks"]}, {"/test/node"})

    def test_on_command_it_saves_the_last_events_and_what_describes_them(self):
        # 5 kB of events per 100 instances: 4 x 4 KiB of one CPU are overwritten many times.
        one_cpu = min(os.sched_getaffinity(0))
        recorder, directory = self.record(
            "command", ["--subbuf-size", "4k", "--num-subbuf", "4"],
            ["-c", str(one_cpu), APPLICATION, "--burst", "5000", "--until-signal", "--ready", str(scratch / "ready"),
             "--ready-after", "200"], application="taskset")
        wait_for((scratch / "ready").exists, "200 instances")
        saved = cie.run("record", "--save", directory)
        self.assertEqual((saved.returncode, saved.stdout), (0, f"{directory}/snapshot-001\n"), saved.stderr)
        snapshot = directory / "snapshot-001"
        self.check_complete(snapshot)
        starts = starts_of(snapshot)
        self.assertGreater(starts[0], 4000, "the past was overwritten")
        self.assertGreater(len(starts), 20)
        self.assertEqual(manifest_of(snapshot)["snapshot"]["reason"], "on command")
        held = manifest_of(snapshot)["snapshot"]["held_ns"]
        report = cie.json("report", snapshot)
        # What is held ends with the first stream of hot events. Readers' window does, too, if instances count behind the end
        # of the channel of state, which LTTng saves a moment before; else it ends with that.
        hot = window_of(snapshot, "events_*")
        self.assertEqual(held, hot[1] - hot[0])
        self.assertIn((report["trace"]["begin_ns"], report["trace"]["end_ns"]), (hot, window_of(snapshot, "*_[0-9]*")))
        # Whoever asks may say why; control characters do not reach the terminal.
        saved = cie.run("record", "--save", directory, "--reason", "the brake, \x1b[1m late\nsecond line")
        self.assertEqual(saved.returncode, 0, saved.stderr)
        self.assertEqual(manifest_of(directory / "snapshot-002")["snapshot"]["reason"],
                         "on command: the brake, ?[1m late")
        # A signal does the same, and the next one has the next number.
        recorder.send_signal(signal.SIGUSR1)
        wait_for((directory / "snapshot-003").exists, "the third snapshot")
        self.check_complete(directory / "snapshot-003")
        self.assertEqual(manifest_of(directory / "snapshot-003")["snapshot"]["reason"], "on command")
        self.assertGreater(starts_of(directory / "snapshot-003")[-1], starts[-1])
        os.kill(int((scratch / "ready").read_text()), signal.SIGTERM)
        text = self.end(recorder)
        self.assertRegex(text, r"keeping the last 5 s in memory: \d+ MiB per CPU, \d+ MiB in all")
        self.assertIn("the buffers are too small for 5", text)
        self.assertIn("saved 3 snapshots", text)
        self.assertEqual(sorted(path.name for path in directory.iterdir()), ["snapshot-001", "snapshot-002", "snapshot-003"])

    def test_a_missed_deadline_is_saved_as_often_as_the_limits_allow(self):
        late = 100
        recorder, directory = self.record(
            "deadline", ["--max-snapshots", "1", "--min-interval", "0"],
            # Long enough for a loaded machine to have saved the snapshot before the application ends.
            ["--instances", "5000", "--deadline-us", "2000000", "--late-every", str(late)])
        text = self.end(recorder)
        snapshot = directory / "snapshot-001"
        reason = manifest_of(snapshot)["snapshot"]["reason"]
        told = re.fullmatch(r"callback 0 missed its deadline: responded after (\d+\.\d+) ms instead of 2000\.000 ms",
                            reason)
        self.assertTrue(told, reason)
        self.assertGreaterEqual(float(told[1]), 6000)
        self.assertFalse((directory / "snapshot-002").exists())
        self.assertRegex(text, r"saved 1 snapshot in .*; \d+ times? more there was a reason to")
        self.check_complete(snapshot, may_have_ended=True)
        self.assertEqual(cie.verdicts(snapshot)["R3"], "FAIL", "it shows what happened")
        self.assertGreater(starts_of(snapshot)[-1], late - 1, "and what came after it")

    def test_an_executors_callback_that_is_late_is_told_as_soon_as_it_ends(self):
        recorder, directory = self.record("late", ["--max-snapshots", "1"], [], LATE_APPLICATION)
        self.end(recorder)
        reason = manifest_of(directory / "snapshot-001")["snapshot"]["reason"]
        self.assertRegex(reason, r"^callback \d+ missed its deadline: responded after \d+\.\d+ ms instead of 5\.000 ms$")
        late = cie.verdicts(directory / "snapshot-001")
        self.assertEqual(late["R3"], "FAIL")
        self.assertEqual(late["M2"], "PASS")

    def test_what_a_failing_command_did_last_is_saved(self):
        recorder, directory = self.record("crash", [], ["--instances", "200", "--leave-by", "abort"])
        text = self.end(recorder)
        self.assertIn("was killed by signal 6", text)
        snapshot = directory / "snapshot-001"
        self.assertRegex(manifest_of(snapshot)["snapshot"]["reason"], r"the command was killed by signal 6")
        self.check_complete(snapshot)
        self.assertEqual(starts_of(snapshot), list(range(200)))

    def test_a_command_that_succeeds_leaves_nothing(self):
        recorder, directory = self.record("success", [], ["--instances", "10"])
        self.assertIn("saved 0 snapshots", self.end(recorder))
        self.assertEqual(list(directory.iterdir()), [])

    def test_what_began_late_filled_no_buffer(self):
        """The application fits into the buffers; the recorder had waited for it for as long as it is to keep."""
        directory = scratch / "began_late"
        done = cie.run("record", "-o", directory, "--snapshot", "1", "--", "sh", "-c",
                       'sleep 2; "$0" --instances 50; exit 3', APPLICATION)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("saved 1 snapshot", done.stderr)
        self.assertNotIn("too small", done.stderr)
        self.assertEqual(starts_of(directory / "snapshot-001"), list(range(50)))

    def test_where_nobody_registers_nothing_is_saved(self):
        for status in (0, 3):  # as without --snapshot
            done = cie.run("record", "-o", scratch / f"nobody{status}", "--snapshot", "2", "--", "sh", "-c", f"exit {status}")
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertIn("nothing was recorded: no application with events of cie:* registered", done.stderr)
            self.assertNotIn("saved", done.stderr)
            self.assertNotIn("too small", done.stderr)
        recorder, directory = self.record("waiting", [], ["30"], application="sleep")
        wait_for((directory / "recorder.pid").exists, "the recorder waits")
        asked = time.monotonic()
        saved = cie.run("record", "--save", directory)
        self.assertEqual((saved.returncode, saved.stdout), (4, ""), saved.stderr)
        self.assertIn("saved nothing: the snapshot is empty: nothing was recorded so far", saved.stderr)
        self.assertLess(time.monotonic() - asked, 20, "it is told, and need not wait")
        recorder.send_signal(signal.SIGTERM)
        self.assertNotIn("too small", self.end(recorder, 4))
        self.assertEqual([path.name for path in directory.glob("snapshot*")], [])

    def test_kernel_events_are_saved_beside(self):
        ready = scratch / "kernel_ready"
        recorder, directory = self.record("kernel", ["--kernel", "yes"],
                                          ["--until-signal", "--work-us", "2000", "--ready", str(ready)])
        wait_for(lambda: ready.exists() or recorder.poll() is not None, "the application runs")
        if recorder.poll() is not None:
            said = self.end(recorder, 4)
            self.assertIn("--kernel=yes: ", said)
            self.skipTest(f"not possible here: {said}")
        self.addCleanup(recorder.wait)
        self.addCleanup(recorder.terminate)  # which ends the application, too
        time.sleep(1)
        for number in (1, 2):  # what one snapshot took is there for the next one, too
            saved = cie.run("record", "--save", directory)
            self.assertEqual(saved.returncode, 0, saved.stderr)
            self.check_kernel(directory / f"snapshot-00{number}")
        os.kill(int(ready.read_text()), signal.SIGTERM)
        self.assertRegex(self.end(recorder), r"kernel events besides: up to \d+ MiB per CPU")

    def check_kernel(self, snapshot):
        manifest = manifest_of(snapshot)
        self.assertTrue(manifest["kernel_events"])
        # By another reader, which takes both for one trace.
        text = run("babeltrace2", "--clock-seconds", snapshot).stdout.splitlines()
        switches = [i for i, line in enumerate(text) if " sched_switch: " in line]
        instances = [i for i, line in enumerate(text) if " cie:callback_start: " in line]
        self.assertGreater(len(switches), 100)
        self.assertEqual(sum(": { cpu_id" in line and " sched_" in line for line in text), manifest["kernel"]["events"])
        self.assertLess(instances[len(instances) // 2], switches[-1], "they are of the same time")
        self.assertGreater(instances[-1], switches[len(switches) // 2])
        timer, = (callback for callback in cie.json("report", snapshot)["callbacks"]
                  if callback["kind"] == "timer")
        # Each instance works for 2 ms of its thread's processor time, which the kernel counts from a little before each
        # switch is told. Some kernels do not tell every switch.
        self.assertGreater(timer["execution_time_ns"]["count"], 0)
        self.assertGreaterEqual(timer["execution_time_ns"]["p50"], 1_900_000)

    def test_signals_pass_while_lttng_does_not_answer_for_a_snapshot(self):
        ready = scratch / "silent_ready"
        recorder, directory = self.record("silent", [], ["--until-signal", "--ready", str(ready)])
        wait_for(ready.exists, "the application runs")
        daemon, = [int(pid) for pid in Path(f"/proc/{recorder.pid}/task/{recorder.pid}/children").read_text().split()
                   if "sessiond" in Path(f"/proc/{pid}/comm").read_text()]
        recorder.send_signal(signal.SIGUSR1)
        time.sleep(0.2)  # it is noticed after 0.1 s at most; then applications have 0.2 s to describe themselves
        os.kill(daemon, signal.SIGSTOP)
        try:
            time.sleep(1)
            recorder.send_signal(signal.SIGTERM)
            application = Path(f"/proc/{ready.read_text().strip()}/stat")
            wait_for(lambda: not application.exists() or ") Z " in application.read_text(), "the command has got it", 20)
        finally:
            os.kill(daemon, signal.SIGCONT)
        self.assertIn("saved 1 snapshot", self.end(recorder))
        self.assertEqual(manifest_of(directory / "snapshot-001")["snapshot"]["reason"], "on command")

    def test_whoever_asks_meanwhile_has_the_next_one(self):
        ready = scratch / "twice_ready"
        recorder, directory = self.record("twice", [], ["--until-signal", "--ready", str(ready)])
        wait_for(ready.exists, "the application runs")
        for _ in range(2):
            recorder.send_signal(signal.SIGUSR1)
            time.sleep(0.12)
        wait_for((directory / "snapshot-002").exists, "the second snapshot")
        recorder.send_signal(signal.SIGTERM)
        self.assertIn("saved 2 snapshots", self.end(recorder))

    def test_what_cannot_be_is_refused(self):
        for status, wanted, arguments in (
                (4, "nobody keeps snapshots", ["--save", scratch]),
                (2, "--save DIR stands alone", ["--save", scratch, "--", "true"]),
                (2, "--save DIR stands alone", ["--save", scratch, "--snapshot", "5"]),
                (2, "--reason requires --save", ["--reason", "why", "--", "true"]),
                (2, "--event-rate requires --snapshot", ["--event-rate", "5", "--", "true"]),
                (2, "do not fit into memory", ["--snapshot", "3600", "--event-rate", "100000000", "--", "true"]),
                (4, "/dev/shm has", ["--snapshot", "3600", "--subbuf-size", "256g", "-o", scratch / "much", "--",
                                     "true"])):
            done = cie.run("record", *arguments)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(wanted, done.stderr)
        self.assertFalse((scratch / "much").exists())


def begin(directory):
    global scratch
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("flight", sys.argv[4:], begin)
