#!/usr/bin/env python3
"""What happens to a recording when processes, daemons, disks and clocks do what they should not.

The law that each case is held against: what the application emitted = what was recorded + what LTTng says it
discarded + what is known to be unreadable. The application counts in shared memory, which survives SIGKILL.
Times are never asserted.
"""

import argparse
import contextlib
import json
import os
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
TIMING = {"R1", "R2"}  # rules that a busy machine violates
HOT = re.compile(r"cie:callback_(?:start|end): .*vpid = (\d+), vtid = (\d+) .*callback_id = (\d+), seq = (\d+)")
HOT_ON_CPU = re.compile(r"cie:callback_(?:start|end): \{ cpu_id = (\d+) \}.* seq = (\d+)")


def children(pid, name):
    """Processes of that name that pid started: of this test, so they may be killed."""
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            if Path(f"/proc/{child}/comm").read_text().strip() == name:
                found.append(int(child))
    return found


class Recording:
    """fault_app under `cie record`, or several of them by a shell command."""

    def __init__(self, name, *arguments, record=(), shell=None, directory=None, environment=None, largest_file=None):
        self.directory = directory or scratch / name
        self.counts = scratch / f"{name}.counts"
        self.counts.mkdir()
        self.ready = scratch / f"{name}.ready"
        command = ["sh", "-c", shell, "sh", options.app, self.counts] if shell else [options.app, self.counts, *arguments]
        self.recorder = subprocess.Popen(
            [options.programs / "cie", "record", "-o", self.directory, "--kernel=no", *record, "--", *command],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | (environment or {}),
            preexec_fn=largest_file and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))))

    def wait_until_ready(self):
        wait_for(lambda: self.ready.exists() or self.recorder.poll() is not None, "the application runs")
        return int(self.ready.read_text())

    def finish(self, status=0):
        self.said = "".join(self.recorder.communicate(timeout=240))
        assert self.recorder.returncode == status, self.said
        return self

    def wait_until_emitted(self, count):
        wait_for(lambda: self.counted()[1] >= count, f"{count} events")

    def manifest(self):
        return manifest_of(self.directory)

    def counted(self):
        """Hot events begun and emitted, by all processes."""
        totals = [struct.unpack("QQ", file.read_bytes()) for file in self.counts.iterdir()]
        return sum(begun for begun, _ in totals), sum(emitted for _, emitted in totals)

    def text(self):
        """All events by another reader than ours."""
        return subprocess.run(["babeltrace2", self.directory], capture_output=True, text=True, timeout=200,
                              check=False).stdout

    def recorded(self):
        """Hot events: (vpid, vtid, callback, seq)."""
        return [tuple(map(int, match)) for match in HOT.findall(self.text())]

    def discarded(self):
        return sum(channel["discarded_events"] for channel in self.manifest()["channels"] if channel["name"] == "events")

    def verdicts(self):
        done = options.cie.run("verify", self.directory, "-f", "json")
        return done.returncode, verdicts_of(json.loads(done.stdout))

    def report(self):
        return options.cie.json("report", self.directory)


class Faults(unittest.TestCase):
    def assert_law(self, recording, unreadable=0):
        begun, emitted = recording.counted()
        self.assertGreater(emitted, 0)
        accounted = len(recording.recorded()) + recording.discarded() + unreadable
        # An event may have been written, and its process killed before it was counted.
        self.assertGreaterEqual(accounted, emitted)
        self.assertLessEqual(accounted, begun)

    def assert_nothing_fails(self, verdicts):
        self.assertLessEqual({rule for rule, verdict in verdicts.items() if verdict == "FAIL"}, TIMING)

    def test_kill_9_of_the_application(self):
        recording = Recording("killed", "--ready", scratch / "killed.ready", "--period-us", "50")
        pid = recording.wait_until_ready()
        recording.wait_until_emitted(500)
        os.kill(pid, signal.SIGKILL)
        recording.finish()
        self.assert_law(recording)
        code, verdicts = recording.verdicts()
        self.assert_nothing_fails(verdicts)
        self.assertEqual(verdicts["T4"], "INCONCLUSIVE")
        self.assertNotEqual(code, 0)

    def kill_a_daemon(self, name, victim):
        recording = Recording(name, "--ready", scratch / f"{name}.ready", "--period-us", "200",
                              record=["--flush-interval", "50"])
        application = recording.wait_until_ready()
        wait_for(lambda: len(recording.recorded()) > 100, "events on the disk")
        daemon, = children(recording.recorder.pid, "lttng-sessiond")
        os.kill(daemon if victim == "lttng-sessiond" else children(daemon, victim)[0], signal.SIGKILL)
        time.sleep(0.3)
        os.kill(application, signal.SIGTERM)
        recording.finish(status=4)
        self.assertGreater(len(recording.manifest()["problems"]), 0, recording.said)
        self.assert_is_a_whole_beginning(recording)

    def assert_is_a_whole_beginning(self, recording):
        seqs = sorted(seq for *_, seq in recording.recorded())
        self.assertGreater(len(seqs), 20)
        # What is there is the beginning, whole as far as each CPU's file goes: whoever writes them may have ended between
        # two of them. How much is missing, nobody can say: no verdict passes on it.
        last_on = {cpu: int(seq) for cpu, seq in HOT_ON_CPU.findall(recording.text())}
        self.assertLessEqual({seqs.count(seq) for seq in range(min(last_on.values()))}, {2})
        self.assertLessEqual(len(seqs), recording.counted()[0])
        code, verdicts = recording.verdicts()
        self.assert_nothing_fails(verdicts)
        # A consumer daemon that has not noticed yet that nobody asks it any more writes the end, too.
        has_end = "cie:run_end:" in recording.text()
        self.assertEqual(verdicts["T4"], "PASS" if has_end else "INCONCLUSIVE")
        if not has_end:
            self.assertEqual(verdicts["T2"], "INCONCLUSIVE")
        self.assertNotEqual(code, 0)

    def test_kill_9_of_the_consumer_daemon(self):
        self.kill_a_daemon("no_consumer", "lttng-consumerd")

    def test_kill_9_of_the_session_daemon(self):
        self.kill_a_daemon("no_sessiond", "lttng-sessiond")

    def test_kill_9_of_the_recorder(self):
        recording = Recording("no_recorder", "--ready", scratch / "no_recorder.ready", "--period-us", "200",
                              record=["--flush-interval", "50"])
        application = recording.wait_until_ready()
        wait_for(lambda: len(recording.recorded()) > 100, "events on the disk")
        daemon, = children(recording.recorder.pid, "lttng-sessiond")
        recording.recorder.kill()
        wait_for(lambda: not Path(f"/proc/{daemon}").exists(), "the daemon ends with its recorder")
        with contextlib.suppress(ProcessLookupError):  # it may end with the recorder, too
            os.kill(application, signal.SIGTERM)
        recording.recorder.communicate(timeout=200)
        self.assert_is_a_whole_beginning(recording)

    def test_a_full_disk(self):
        if os.geteuid() != 0:
            self.skipTest("not possible here: needs root to mount a small file system")
        small = scratch / "small"
        small.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m,mode=777", "none", small], check=True)
        self.addCleanup(subprocess.run, ["umount", "-l", small], check=True)
        # More slowly: on a loaded machine nine tenths were discarded, and the rest did not fill the disk.
        recording = self.record_without_room("full", period_us=100, directory=small / "rec")
        copy = scratch / "full_copy"  # read where there is room
        shutil.copytree(recording.directory, copy)
        recording.directory = copy
        self.assert_is_kept_as_far_as_there_was_room(recording)

    def test_a_limit_of_the_size_of_files(self):
        # Buffers are files, too: that of the state takes 2 MiB. 16 MB on two CPUs.
        recording = self.record_without_room("limited", instances=200_000, largest_file=3 << 20)
        self.assertIn("File too large", recording.said)
        self.assert_is_kept_as_far_as_there_was_room(recording)

    def test_a_limit_below_the_size_of_a_buffer(self):
        # LTTng makes none of the channels behind the first one that it could not make, in no order.
        recording = self.record_without_room("no_buffers", largest_file=1 << 20)
        self.assertIn("LTTng could make no buffers for", recording.said)

    def record_without_room(self, name, instances=60_000, period_us=40, **where):
        # Slowly enough for the consumer daemon, which looks for full sub-buffers every 20 ms. 5 MB in all: a loaded
        # machine may run the daemon so late that half of it is discarded, and what is left has to fill the disk.
        recording = Recording(name, "--instances", str(instances), "--period-us", str(period_us),
                              record=["--subbuf-size", "64k"], **where).finish(status=4)
        self.assertIn("THE RECORDING FAILED", recording.said)
        begun, emitted = recording.counted()
        self.assertEqual(begun, emitted)
        self.assertEqual(emitted, 2 * instances)
        return recording

    def assert_is_kept_as_far_as_there_was_room(self, recording):
        emitted = recording.counted()[1]
        ours = sum(callback["instances"] for callback in recording.report()["callbacks"])
        self.assertGreater(ours, 1000, "whole packets before the end of the disk are there")
        self.assertLess(2 * ours, emitted)
        code, verdicts = recording.verdicts()
        self.assert_nothing_fails(verdicts)
        self.assertNotEqual(code, 0)

    def test_many_processes_at_once_and_short_ones_in_thousands(self):
        # All register, 32 at a time: LTTng's own time-out would leave some of them untraced, in silence.
        each = 20
        recording = Recording("short", shell=f'seq {options.processes} | xargs -P 32 -I @@ "$1" "$2" --instances {each}',
                              record=["--registration-timeout", "60"]).finish()
        self.assertEqual(len(list(recording.counts.iterdir())), options.processes, recording.said)
        self.assertEqual(recording.counted(), (2 * each * options.processes,) * 2)
        self.assert_law(recording)
        report = recording.report()
        self.assertEqual(len(report["processes"]), options.processes)
        if recording.discarded() == 0:
            self.assertEqual({callback["instances"] for callback in report["callbacks"]}, {each})
            self.assertTrue(all(process["complete"] for process in report["processes"]))
        _, verdicts = recording.verdicts()
        self.assert_nothing_fails(verdicts)

    def test_buffers_do_not_grow_with_the_number_of_processes(self):
        # Per-process buffers of 1 000 processes exhaust a machine; ours are per user.
        recording = Recording("memory", shell='"$1" "$2" --instances 5; seq 40 | xargs -P 8 -I @@ "$1" "$2" --instances 5; '
                                              f'echo $$ > {scratch}/memory.ready; read -r _ < {scratch}/memory.go')
        os.mkfifo(scratch / "memory.go")
        used = []
        consumer = None
        while not recording.ready.exists():
            with contextlib.suppress(OSError, IndexError, ValueError):
                if consumer is None:
                    consumer = children(children(recording.recorder.pid, "lttng-sessiond")[0], "lttng-consumerd")[0]
                shared = re.search(r"RssShmem:\s+(\d+) kB", Path(f"/proc/{consumer}/status").read_text())
                used.append(int(shared.group(1)))
            self.assertIsNone(recording.recorder.poll())
            time.sleep(0.01)
        (scratch / "memory.go").write_text("\n")
        recording.finish()
        self.assert_law(recording)
        manifest = recording.manifest()
        self.assertTrue(used)
        self.assertLess(max(used), 64 * 1024, manifest)

    def test_fork_without_exec(self):
        """LTTng writes the parent's pid into the child's events. Its own library mends that; without it,
        nothing is proven of either."""
        for name, preload in (("forked", ""), ("forked_well", "LD_PRELOAD=liblttng-ust-fork.so.1 ")):
            with self.subTest(name):
                recording = Recording(name, shell=preload + 'exec "$1" "$2" --fork --instances 200 --period-us 500').finish()
                self.assertEqual(recording.counted(), (800, 800))
                self.assert_law(recording)
                report = recording.report()
                code, verdicts = recording.verdicts()
                if preload:
                    self.assertEqual(len({pid for pid, *_ in recording.recorded()}), 2)
                    self.assertEqual(sorted((c["logical_id"], c["instances"]) for c in report["callbacks"]),
                                     [("/fault@Timer(1)", 200), ("/fault@Timer(2)", 200)])
                    self.assertEqual((verdicts["M2"], verdicts["M3"], verdicts["T4"]), ("PASS",) * 3)
                    self.assert_nothing_fails(verdicts)
                else:
                    self.assert_shared_pid(recording, report, code, verdicts)

    def assert_shared_pid(self, recording, report, code, verdicts):
        self.assertEqual(len({pid for pid, *_ in recording.recorded()}), 1)
        self.assertIn("shared-pid", [defect["kind"] for defect in report["defects"]])
        self.assertFalse(report["trace"]["complete"])
        self.assertEqual(code, 3)
        self.assertLessEqual({verdicts[rule] for rule in ("M2", "M3", "M4", "E1", "T3", "T4")}, {"INCONCLUSIVE"})

    def test_a_thread_id_that_is_used_again(self):
        if os.geteuid() != 0:
            self.skipTest("not possible here: needs root to choose a thread's id")
        # In a pid namespace of its own nobody else takes the number.
        recording = Recording("reused", shell='exec unshare --pid --fork --mount-proc "$1" "$2" --reuse-tid --instances 50')
        recording.finish()
        self.assertEqual(recording.counted(), (200, 200))
        self.assert_law(recording)
        threads = {(callback, tid) for _, tid, callback, _ in recording.recorded()}
        self.assertEqual(len(threads), 2)
        self.assertEqual(len({tid for _, tid in threads}), 1, "the same id")
        report = recording.report()
        self.assertEqual([c["instances"] for c in report["callbacks"]], [50, 50])
        self.assertTrue(all(c["isolated"] for c in report["callbacks"]))
        _, verdicts = recording.verdicts()
        self.assertEqual((verdicts["M2"], verdicts["M3"]), ("PASS", "PASS"))
        self.assert_nothing_fails(verdicts)

    def test_containers_with_the_same_process_ids(self):
        if os.geteuid() != 0:
            self.skipTest("not possible here: needs root for pid namespaces")
        container = 'unshare --pid --fork --mount-proc "$1" "$2" --period-us 1000 '
        ready = [scratch / "contained.1", scratch / "contained.2"]
        recording = Recording("contained", shell=" & ".join(f"{container} --ready {file}" for file in ready) + "; wait")
        for file in ready:
            wait_for(file.exists, "both run at once")
        recording.wait_until_emitted(200)
        shell, = children(recording.recorder.pid, "sh")
        for outer in children(shell, "unshare"):
            os.kill(children(outer, "fault_app")[0], signal.SIGTERM)
        recording.finish()
        self.assert_law(recording)
        self.assertEqual({pid for pid, *_ in recording.recorded()}, {1}, "both are process 1 to LTTng")
        self.assert_shared_pid(recording, recording.report(), *recording.verdicts())

        # Recorded each by itself, both are known in full.
        alone = [Recording(f"contained_{i}", shell=f"exec {container} --instances 300") for i in range(2)]
        for recording in alone:
            recording.finish()
            self.assertEqual(recording.counted(), (600, 600))
            self.assert_law(recording)
            self.assertEqual([c["instances"] for c in recording.report()["callbacks"]], [300])
            _, verdicts = recording.verdicts()
            self.assert_nothing_fails(verdicts)
            self.assertEqual((verdicts["M2"], verdicts["M3"], verdicts["T4"]), ("PASS",) * 3)

    def test_a_daemon_that_hears_applications_later_than_clients(self):
        daemon = scratch / "late-sessiond"
        daemon.write_text(f'#!/bin/sh\nLD_PRELOAD={options.late} exec lttng-sessiond "$@"\n')
        daemon.chmod(0o755)
        recording = Recording("late", "--instances", "50", environment={"LTTNG_SESSIOND_PATH": str(daemon)})
        recording.finish()
        self.assertEqual(recording.counted(), (100, 100))
        self.assert_law(recording)

    def test_a_suspended_application(self):
        recording = Recording("suspended", "--ready", scratch / "suspended.ready", "--period-us", "500")
        pid = recording.wait_until_ready()
        recording.wait_until_emitted(100)
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.5)
        before = recording.counted()[1]
        os.kill(pid, signal.SIGCONT)
        recording.wait_until_emitted(before + 100)
        os.kill(pid, signal.SIGTERM)
        recording.finish()
        self.assert_law(recording)
        _, verdicts = recording.verdicts()
        self.assert_nothing_fails(verdicts)
        self.assertEqual(verdicts["T4"], "PASS")

    def step(self, recording):
        """By how many nanoseconds the wall clock stepped, as far as is recorded."""
        text = subprocess.run(["babeltrace2", recording.directory], capture_output=True, text=True, timeout=200,
                              check=False).stdout
        said = [int(real) - int(monotonic) for monotonic, real in
                re.findall(r"cie:clock_sync: .*monotonic_ns = (\d+), realtime_ns = (\d+)", text)]
        return max(said, default=0) - min(said, default=0)

    def test_a_clock_that_is_set_back_while_recording(self):
        # For the application alone; nobody's clock is touched.
        ready = scratch / "stepped.ready"
        recording = Recording("stepped", shell=f'LD_PRELOAD={options.clock} exec "$1" "$2" --ready {ready} --period-us 500',
                              record=["--flush-interval", "100"])
        pid = recording.wait_until_ready()
        wait_for(lambda: self.step(recording) > 3000 * 10**9, "the clock is set back by an hour")
        os.kill(pid, signal.SIGTERM)
        recording.finish()
        self.assert_law(recording)
        self.assertGreater(self.step(recording), 3000 * 10**9)
        _, verdicts = recording.verdicts()
        self.assert_nothing_fails(verdicts)
        self.assertEqual((verdicts["T3"], verdicts["T4"], verdicts["T6"]), ("PASS",) * 3)


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for argument in ("programs", "app", "clock", "late"):
        parser.add_argument(f"--{argument}", type=Path, required=True)
    parser.add_argument("--processes", type=int, default=200)
    options, rest = parser.parse_known_args()
    options.cie = Cie(options.programs / "cie")
    isolated_main.main("faults", rest, begin)
