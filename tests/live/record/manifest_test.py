#!/usr/bin/env python3
"""What a recording says of itself holds: of recordings of every kind, of what runs for a moment only, and of
recorders that fail. Arguments: PROGRAMS APPLICATION (traced_app)."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import session_daemon, wait_for  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie, rules_of, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, APPLICATION = (Path(argument).resolve() for argument in sys.argv[1:3])
cie = Cie(PROGRAMS / "cie")
MARK = "CIE_MANIFEST_TEST"  # in the environment of what a test starts
scratch: Path


def verified(*traces):
    """Verdicts by rule, and everything that T1 and T2 say."""
    judged = cie.json("verify", *traces, "--check")
    rules = rules_of(judged)
    notes = [item["note"] for rule in ("T1", "T2") for subject in rules[rule]["subjects"] for item in subject["evidence"]]
    return verdicts_of(judged), notes


def pids_of(trace):
    report = cie.json("report", trace)
    return {process["pid"] for process in report["processes"]}


def named(manifest):
    return {process["pid"] for process in manifest["processes"]}


def marked(mark):
    """Command lines of the processes that run, and were started with this mark."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if f"{MARK}={mark}".encode() in (entry / "environ").read_bytes().split(b"\0"):
                found.append((entry / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue
    return found


class Manifest(unittest.TestCase):
    def background(self, *command, **keywords):
        process = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                                   **keywords)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def assert_holds(self, *traces):
        verdicts, notes = verified(*traces)
        self.assertEqual((verdicts["T1"], verdicts["T2"]), ("PASS", "PASS"), notes)
        self.assertEqual(notes, [])

    def test_short_processes_are_named_however_many(self):
        directory = scratch / "short"
        script = 'seq 40 | xargs -P 4 -I @@ "$1" --instances 1'
        done = cie.run("record", "-o", directory, "--kernel=no", "--", "sh", "-c", script, "sh", APPLICATION)
        self.assertEqual(done.returncode, 0, done.stderr)
        manifest = manifest_of(directory)
        self.assertEqual(len(manifest["processes"]), 40)
        self.assertTrue(manifest["names_all_processes"])
        self.assertEqual(named(manifest), pids_of(directory))
        self.assert_holds(directory)

    def test_one_that_runs_on_is_named_by_its_name(self):
        directory = scratch / "named"
        cie.run("record", "-o", directory, "--kernel=no", "--", APPLICATION, "--instances", "300")
        process, = manifest_of(directory)["processes"]
        self.assertEqual(process["name"], APPLICATION.name[:15])
        self.assert_holds(directory)

    def test_what_runs_already(self):
        session_daemon(self)
        application = self.background(APPLICATION, "--until-signal")
        directory = scratch / "attached"
        done = cie.run("record", "-o", directory, "--attach", "--duration", "2", "--kernel=no")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(named(manifest_of(directory)), {application.pid})
        self.assert_holds(directory)

    def test_kernel_events_that_are_there_are_seen(self):
        directory = scratch / "kernel"
        done = cie.run("record", "-o", directory, "--kernel=yes", "--", APPLICATION, "--instances", "300")
        if "--kernel=yes: " in done.stderr:
            self.skipTest(f"not possible here: {done.stderr}")
        verdicts, notes = verified(directory)
        self.assertEqual(verdicts["T1"], "PASS", notes)
        self.assertFalse([note for note in notes if "recorded" in note], notes)
        shutil.rmtree(directory / "kernel")
        verdicts, notes = verified(directory)
        self.assertEqual((verdicts["T1"], verdicts["T2"]), ("INCONCLUSIVE", "INCONCLUSIVE"))
        self.assertIn(f"kernel/metadata is missing ({directory})", notes)
        self.assertIn(f"events of the kernel were recorded, and nothing is here of them ({directory})", notes)

    def rotated(self, name, *options):
        directory = scratch / name
        ready = scratch / f"{name}.ready"
        recorder = self.background(cie.program, "record", "-o", directory, "--rotate", "1", "--kernel=no", *options, "--", "sh", "-c",
                                   '"$1" --instances 1; "$1" --until-signal --ready "$2" & '
                                   'trap "kill $!" TERM; wait; wait', "sh", APPLICATION, ready)
        wait_for(lambda: (directory / "chunk-000004").exists() or recorder.poll() is not None, "four chunks")
        recorder.send_signal(signal.SIGTERM)
        said = recorder.communicate(timeout=90)[1]
        self.assertEqual(recorder.returncode, 0, said)
        return directory

    def test_chunks(self):
        directory = self.rotated("chunks")
        self.assert_holds(directory)
        chunks = sorted(directory.glob("chunk-*"))
        for chunk in chunks:
            pids = pids_of(chunk)
            self.assertLessEqual(named(manifest_of(chunk)), pids)
            if pids:  # on a busy machine a second may pass before the application starts
                self.assert_holds(chunk)
        self.assertEqual(named(manifest_of(directory)), pids_of(directory))
        self.assertEqual(len(named(manifest_of(directory))), 2)
        report = cie.json("report", directory)
        self.assertTrue(report["trace"]["complete"], report["defects"])
        shutil.rmtree(chunks[0])
        verdicts, notes = verified(directory)
        self.assertEqual((verdicts["T1"], verdicts["T2"]), ("INCONCLUSIVE", "INCONCLUSIVE"))
        self.assertIn(f"chunk-000001 was recorded, and is not here ({directory})", notes)

    def test_chunks_of_which_the_oldest_are_removed(self):
        directory = self.rotated("kept", "--keep", "2")
        self.assert_holds(directory)
        chunks = sorted(directory.glob("chunk-*"))
        first = int(chunks[0].name.removeprefix("chunk-"))
        self.assertEqual(manifest_of(directory)["removed_chunks"], first - 1)
        self.assertEqual(len(named(manifest_of(directory))), 1)  # the other one's chunk is gone
        report = cie.json("report", directory)
        self.assertFalse(report["trace"]["complete"])
        self.assertEqual(report["recordings"][0]["first_chunk"], first)
        self.assertEqual(report["recordings"][0]["begin_ns"], manifest_of(chunks[0])["begin"]["monotonic_ns"])

    def test_snapshots(self):
        directory = scratch / "snapshots"
        ready = scratch / "snapshots.ready"
        recorder = self.background(cie.program, "record", "-o", directory, "--snapshot", "2", "--", "sh", "-c",
                                   '"$1" --instances 1; exec "$1" --until-signal --ready "$2"', "sh", APPLICATION, ready)
        wait_for(lambda: ready.exists() or recorder.poll() is not None, "the application runs")
        time.sleep(1)
        application = {int(ready.read_text())}
        for _ in range(20):  # a busy machine may take longer to describe itself than a snapshot waits
            snapshot = Path(cie.run("record", "--save", directory).stdout.strip())
            self.assertLessEqual(named(manifest_of(snapshot)), application)
            if named(manifest_of(snapshot)) == application:
                break
        self.assertEqual(named(manifest_of(snapshot)), application)
        verdicts, notes = verified(snapshot)
        self.assertEqual(verdicts["T1"], "PASS", notes)
        self.assertFalse([note for note in notes if "was recorded" in note], notes)
        recorder.send_signal(signal.SIGTERM)
        recorder.communicate(timeout=90)

    def test_at_a_relay_daemon(self):
        there = scratch / "there"
        log = scratch / "collect.log"
        with open(log, "wb") as file:
            collector = subprocess.Popen([cie.program, "collect", "-o", there, "--listen", "0"], stderr=file)
        self.addCleanup(isolated_main.end, collector)
        wait_for(lambda: "--to " in log.read_text(), "it listens")
        address = log.read_text().split("--to ")[1].split()[0]
        directory = scratch / "relayed"
        done = cie.run("record", "-o", directory, "--to", address, "--", APPLICATION, "--instances", "500")
        self.assertEqual(done.returncode, 0, done.stderr)
        collector.send_signal(signal.SIGINT)
        collector.wait(60)
        self.assertEqual(len(manifest_of(directory)["processes"]), 1)
        shutil.copy(directory / "manifest.json", there)
        self.assert_holds(there)

    def test_an_application_that_is_killed_while_it_registers_is_not_recorded(self):
        directory = scratch / "killed"
        done = cie.run("record", "-o", directory, "--kernel=no", "--", APPLICATION, "--leave-by", "kill")
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("nothing was recorded", done.stderr)
        self.assertNotIn("\nrecorded ", done.stderr)
        self.assertEqual(manifest_of(directory)["processes"], [])

    def test_of_several_recorders_one_gets_the_directory(self):
        for is_there in False, True:
            with self.subTest(is_there=is_there):
                directory = scratch / f"wanted{is_there}"
                if is_there:
                    directory.mkdir()
                recorders = [self.background(cie.program, "record", "-o", directory, "--kernel=no", "--", APPLICATION,
                                             "--instances", "300") for _ in range(6)]
                said = [recorder.communicate(timeout=120)[1] for recorder in recorders]
                self.assertEqual(sorted(r.returncode for r in recorders), [0, 2, 2, 2, 2, 2], said)
                self.assertEqual(len(pids_of(directory)), 1)
                self.assertEqual({path.name for path in directory.iterdir()}, {"ust", "manifest.json"})
                self.assert_holds(directory)

    def test_what_a_killed_recorder_leaves_is_swept_by_the_next(self):
        runtime = scratch / "runtime"
        runtime.mkdir()
        (runtime / "cie-record-others").mkdir()  # of nobody who could be asked
        environment = os.environ | {"XDG_RUNTIME_DIR": str(runtime)}

        def homes():
            return sorted(path.name for path in runtime.glob("cie-record-*"))

        def recorder(name):
            process = self.background(cie.program, "record", "-o", scratch / name, "--kernel=no", "--", APPLICATION,
                                      "--until-signal", "--ready", scratch / f"{name}.ready", env=environment)
            wait_for(lambda: (scratch / f"{name}.ready").exists() or process.poll() is not None, "the application runs")
            return process

        lives = recorder("lives")
        killed = recorder("dies")
        daemon = child_of(recorder_of(killed), "lttng-sessiond")
        before = homes()
        self.assertEqual(len(before), 3)
        application = int((scratch / "dies.ready").read_text())
        os.kill(daemon, signal.SIGSTOP)  # it hangs, whoever asks it to end
        os.kill(recorder_of(killed), signal.SIGKILL)
        killed.wait(60)
        os.kill(application, signal.SIGKILL)
        self.assertEqual(homes(), before)
        after = cie.run("record", "-o", scratch / "next", "--kernel=no", "--", APPLICATION, env=environment)
        self.assertEqual(after.returncode, 0, after.stderr)
        self.assertEqual(len(homes()), 2, (before, homes()))
        wait_for(lambda: not is_running(daemon), "the daemon that hung is killed")
        self.assertIn("cie-record-others", homes())
        lives.send_signal(signal.SIGTERM)
        said = lives.communicate(timeout=90)[1]
        self.assertEqual(lives.returncode, 0, said)  # its own was left alone
        self.assertEqual(homes(), ["cie-record-others"])

    # Until somebody registers, LTTng is asked who did.
    def test_signals_pass_while_lttng_does_not_answer_who_registered(self):
        for options in ((), ("--snapshot", "1"), ("--rotate", "1")):
            with self.subTest(options=options):
                ready = scratch / f"silent{''.join(options)}.ready"
                process = self.background(cie.program, "record", "-o", ready.with_suffix(""), "--kernel=no", *options,
                                          "--", "sh", "-c", 'echo $$ >"$0"; exec sleep 60', ready)
                wait_for(lambda: ready.exists() and ready.read_text(), "the command runs")
                command = int(ready.read_text())
                daemon = child_of(recorder_of(process), "lttng-sessiond")
                time.sleep(0.5)
                os.kill(daemon, signal.SIGSTOP)
                try:
                    time.sleep(0.5)  # it is asked five times a second
                    process.send_signal(signal.SIGTERM)
                    wait_for(lambda: not is_running(command), "the command has got it", 1)
                finally:
                    os.kill(daemon, signal.SIGCONT)
                process.communicate(timeout=60)

    def test_a_recorder_that_fails_leaves_no_daemon(self):
        def few_descriptors():
            resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))

        for attempt, options in enumerate(((), ("--attach", "--duration", "1"))):
            with self.subTest(options=options):
                environment = os.environ | {MARK: str(attempt)}
                command = options or ("--", APPLICATION)
                done = cie.run("record", "-o", scratch / f"few{attempt}", "--kernel=no", *command, env=environment,
                           preexec_fn=few_descriptors)
                self.assertEqual(done.returncode, 4, done.stderr)
                self.assertEqual(marked(attempt), [], done.stderr)


def child_of(parent, name):
    found = subprocess.run(["pgrep", "-P", str(parent), "-x", name], capture_output=True, text=True, check=True)
    return int(found.stdout)


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def recorder_of(process):
    """cie-record replaces cie, or is its child."""
    for entry in Path("/proc").iterdir():
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == process.pid and (entry / "comm").read_text().strip() == "cie-record":
                return int(entry.name)
        except (OSError, ValueError):
            continue
    return process.pid


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("manifest", [], begin)
