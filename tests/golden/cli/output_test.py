#!/usr/bin/env python3
"""The cie program from outside: what is read and written: unreadable input, output files, terminals, pipes. Arguments: CIE EXAMPLES."""
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import stat
import subprocess
import sys
import unittest

from program import CIE, EXAMPLES, Folder, TRACE, cie, on_terminal

GOLDEN = os.path.dirname(os.path.dirname(EXAMPLES))
RECORDINGS = [os.path.join(EXAMPLES, name, "trace") for name in ("multi_threaded_fails", "isolated_ok")] + \
    [os.path.join(GOLDEN, "ros2", "recordings", name) for name in ("isolated", "multi_threaded")]


class Unreadable(Folder):
    def assert_unreadable(self, path):
        for arguments in (("report", path), ("instances", path), ("events", path), ("events", path, "-f", "csv"), ("verify", path),
                          ("export", path, "--to", "perfetto", "-o", self.path("out"))):
            result = cie(*arguments)
            self.assertEqual(result.returncode, 4, (arguments, result))
            self.assertEqual(result.stdout, b"")
            self.assertRegex(result.stderr, rb"^cie: [^\n]+\n$")
            self.assertNotIn(b"\x1b", result.stderr)
            self.assertFalse(os.path.exists(self.path("out")))

    def test_nothing_there(self):
        self.assert_unreadable(self.path("none"))

    def test_a_file(self):
        self.assert_unreadable(self.write("file", b"no trace"))

    def test_a_directory_without_a_trace(self):
        os.mkdir(self.path("empty"))
        self.assert_unreadable(self.path("empty"))

    def test_garbage(self):
        os.mkdir(self.path("garbage"))
        self.write("garbage/metadata", b"\x57\x1d\xd1\x75garbage")
        self.write("garbage/channel_0", bytes(range(256)) * 16)
        self.assert_unreadable(self.path("garbage"))

    def test_a_directory_that_cannot_be_listed_is_named(self):
        closed = self.path("run", "closed")
        os.makedirs(closed)
        os.chmod(self.folder, 0o755)
        os.chmod(closed, 0)
        nobody = {"user": 65534} if os.geteuid() == 0 else {}  # whom permissions bind
        result = cie("report", self.path("run"), **nobody)
        self.assertEqual((result.returncode, result.stderr.decode()), (4,
            f"cie: cannot read trace {self.path('run')}: cannot list {closed}: Permission denied\n"))

    def test_a_hostile_name(self):
        self.assert_unreadable(self.path("\x1b[31m\n'\"\udcff"))
        self.assert_unreadable("x" * 10_000)


class Links(Folder):
    """Traces may lie behind links: each is read once, whatever leads there."""

    def instances(self, path):
        told = cie("instances", path)
        self.assertEqual(told.returncode, 0, told)
        return told.stdout

    def test_are_followed(self):
        os.mkdir(self.path("run"))
        for name in "kernel", "ust":
            os.symlink(os.path.join(TRACE, name), self.path("run", name))
        self.assertEqual(self.instances(self.path("run")), self.instances(TRACE))

    def test_lead_to_each_trace_once(self):
        shutil.copytree(TRACE, self.path("runs", "1"))
        os.symlink("1", self.path("runs", "latest"))
        os.symlink("../../1/ust", self.path("runs", "1", "ust", "again"))
        os.symlink("1/kernel", self.path("runs", "kernel"))
        self.assertEqual(self.instances(self.path("runs")), self.instances(TRACE))

    def test_are_not_followed_in_circles_nor_upwards(self):
        shutil.copytree(TRACE, self.path("run"))
        for number, target in enumerate((".", "..", "../run", "/", "nowhere")):
            os.symlink(target, self.path("run", f"{number}"))
        os.symlink("b", self.path("run", "a"))
        os.symlink("a", self.path("run", "b"))
        shutil.copytree(TRACE, self.path("other"))
        self.assertEqual(self.instances(self.path("run")), self.instances(TRACE))


class Output(Folder):
    def test_of_a_recording_replaces_none_of_its_files(self):
        run = shutil.copytree(TRACE, self.path("run"))
        self.write("run/manifest.json", b'{\n  "schema": "cie.recording/1",\n  "tool": {}}\n')
        self.write("run/kernel/index", b"\xc1\xf1\xdc\xc1\0\0\0\1")
        os.symlink("run/kernel/metadata", self.path("link"))
        for name in ("run/kernel/metadata", "run/kernel/channel0_0", "run/manifest.json", "run/kernel/index", "link"):
            before = self.read(name)
            for arguments in (("report", run), ("instances", run), ("verify", run), ("export", run, "--to", "perfetto")):
                result = cie(*arguments, "-o", self.path(name))
                self.assertEqual((result.returncode, result.stdout), (2, b""), (arguments, name))
                self.assertIn(b"is a file of a recording", result.stderr)
            self.assertEqual(self.read(name), before)
        self.write("run/report.txt", b"old")
        self.assertEqual(cie("report", TRACE, "-o", self.path("run/report.txt")).returncode, 0)

    def test_a_file_is_what_standard_output_would_be(self):
        for arguments in (("report", TRACE), ("report", TRACE, "-f", "json"), ("report", TRACE, "-f", "csv"),
                          ("instances", TRACE), ("instances", TRACE, "-f", "jsonl"), ("events", TRACE), ("verify", TRACE),
                          ("verify", TRACE, "-f", "json"), ("export", TRACE, "--to", "perfetto")):
            expected = cie(*arguments)
            self.assertEqual(expected.returncode, 0, expected)
            self.assertEqual(expected.stderr, b"")
            self.assertEqual(cie(*arguments, "-o", "-").stdout, expected.stdout)
            result = cie(*arguments, "-o", "out", cwd=self.folder)
            self.assertEqual((result.returncode, result.stdout, result.stderr), (0, b"", b""))
            self.assertEqual(self.read("out"), expected.stdout)
            self.assertEqual(os.listdir(self.folder), ["out"])

    def test_an_old_file_survives_a_failure(self):
        self.write("out", b"old", 0o600)
        self.assertEqual(cie("report", self.path("none"), "-o", self.path("out")).returncode, 4)
        for viewer in ("perfetto", "chrome", "speedscope", "otlp", "mcap"):
            limited = cie("export", TRACE, "--to", viewer, "-o", self.path("out"),
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)))
            self.assertEqual(limited.returncode, 4)
            self.assertRegex(limited.stderr, rb"^cie: cannot write [^\n]*: File too large\n$")
            self.assertEqual(self.read("out"), b"old")
            self.assertEqual(os.listdir(self.folder), ["out"])
        self.assertEqual(cie("report", TRACE, "-o", self.path("out")).returncode, 0)
        self.assertEqual(stat.S_IMODE(os.stat(self.path("out")).st_mode), 0o600)

    def test_a_new_file_has_the_usual_mode(self):
        cie("report", TRACE, "-o", self.path("out"), preexec_fn=lambda: os.umask(0o027))
        self.assertEqual(stat.S_IMODE(os.stat(self.path("out")).st_mode), 0o640)

    def test_a_full_disk(self):
        for arguments in (("report",), ("instances",), ("events",), ("verify", "-f", "json"), ("export", "--to", "perfetto")):
            result = cie(*arguments, TRACE, "-o", "/dev/full")
            self.assertEqual(result.returncode, 4)
            self.assertEqual(result.stderr, b'cie: cannot write "/dev/full": No space left on device\n')
            with open("/dev/full", "wb") as full:
                result = cie(*arguments, TRACE, stdout=full)
            self.assertEqual((result.returncode, result.stderr),
                             (4, b"cie: cannot write standard output: No space left on device\n"))

    def test_a_closed_pipe(self):
        reader, writer = os.pipe()
        os.close(reader)
        result = cie("instances", TRACE, stdout=writer)
        os.close(writer)
        self.assertEqual((result.returncode, result.stderr), (-signal.SIGPIPE, b""))

    @unittest.skipIf("CIE_EMULATED" in os.environ, "not possible here: it is the emulator that lacks memory")
    def test_too_little_memory(self):
        """Wherever it ends, once it is loaded: an error of ours, not a signal."""
        # Large enough to be read on a thread of its own, for whose stack there may be no room either.
        large = self.path("large")
        shutil.copytree(TRACE, large)
        stream = next(file for file in sorted(pathlib.Path(large).rglob("*")) if file.is_file())
        with open(stream.parent / "damaged", "wb") as file:
            file.truncate(64 << 20)
        commands = [("report", large), ("instances", large), ("events", large), ("verify", large), ("diff", large, large),
                    ("analyze", "schedulability", large), ("spec", "template", large), ("export", large, "--to", "chrome")]

        def limited(command, kibibytes):
            limit = kibibytes << 10
            return cie(*command, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (limit, limit)))

        loaded = next(kibibytes for kibibytes in range(64, 16_384, 32) if limited(("--version",), kibibytes).returncode == 0)
        lack = set()
        for command in commands:
            for more in (*range(0, 128, 32), 200, 400, 3000, 8000, 20_000):
                done = limited(command, kibibytes := loaded + more)
                if done.returncode == 127:  # the loader
                    continue
                self.assertIn(done.returncode, (0, 1, 3, 4), (command, kibibytes, done.stderr))
                if done.returncode == 4:
                    self.assertRegex(done.stderr, b"cie: (out of memory|.*([Mm]emory|[Rr]esource).*)\n")
                    lack.add(command)
        self.assertEqual(lack, set(commands))
        # Where there is room for all but a thread's stack varies with the addresses.
        stacks = (limited(("report", large), loaded + more).stderr for more in range(2000, 24_000, 2000))
        self.assertTrue(any(b"Resource" in stderr for stderr in stacks))

    def test_head(self):
        """As a shell runs it: the last one's status counts, and nothing is said."""
        for command in ("instances", "events", "report", "verify", "export --to jsonl"):
            done = subprocess.run(["bash", "-c", f"'{CIE}' {command} '{TRACE}' | head -c 1"], capture_output=True, check=False)
            self.assertEqual((done.returncode, len(done.stdout), done.stderr), (0, 1, b""), command)

    def test_closed_standard_output(self):
        for arguments in (("report", TRACE), ("--help",), ("--version",)):
            result = cie(*arguments, preexec_fn=lambda: os.close(1))
            self.assertEqual(result.returncode, 4)
            self.assertEqual(result.stderr, b"cie: cannot write standard output: Bad file descriptor\n")
        result = cie("report", TRACE, "-o", self.path("out"), preexec_fn=lambda: os.close(1))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.read("out"), cie("report", TRACE).stdout)

    def test_targets_that_cannot_be_written(self):
        result = cie("report", TRACE, "-o", self.folder)
        self.assertEqual((result.returncode, result.stdout), (4, b""))
        self.assertIn(b"Is a directory", result.stderr)
        result = cie("report", TRACE, "-o", self.path("none", "out"))
        self.assertEqual(result.returncode, 4)
        self.assertIn(b"No such file or directory", result.stderr)

    def test_an_interrupt_ends_it(self):
        os.mkfifo(self.path("fifo"))
        process = subprocess.Popen([CIE, "report", TRACE, "-o", self.path("fifo")], stderr=subprocess.PIPE)
        try:  # it waits for somebody to read the fifo
            with self.assertRaises(subprocess.TimeoutExpired):
                process.wait(timeout=0.5)
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(timeout=10), -signal.SIGINT)
        finally:
            process.kill()
            process.stderr.close()


class Terminal(Folder):
    def test_colours_only_where_they_are_wanted(self):
        for command in ("report", "verify"):
            self.assertIn(b"\x1b[", on_terminal(command, TRACE, environment={"NO_COLOR": ""})[1])
            self.assertNotIn(b"\x1b[", on_terminal(command, TRACE, environment={"NO_COLOR": "1"})[1])
            self.assertNotIn(b"\x1b[", on_terminal(command, TRACE, environment={"TERM": "dumb"})[1])
            self.assertNotIn(b"\x1b[", cie(command, TRACE).stdout)

    def test_verify_is_one_screen_as_wide_as_the_terminal(self):
        for recording in RECORDINGS:
            violated = {(rule["id"], subject["subject"]) for rule in json.loads(cie("verify", recording, "-f", "json").stdout)["rules"]
                        for subject in rule["subjects"] if subject["verdict"] == "FAIL"}
            everything = cie("verify", recording, "--all").stdout.decode()
            for rule, subject in violated:
                self.assertRegex(everything, rf"(?m)^FAIL  {rule} [a-z-]+: {re.escape(subject)} \(\d+ checked\)$")
            shown = {columns: on_terminal("verify", os.path.basename(recording), columns=columns, cwd=os.path.dirname(recording),
                                          environment={"NO_COLOR": "1", "LC_ALL": "C.UTF-8"})[1].decode().replace("\r", "").splitlines()
                     for columns in (80, 120)}
            shown[100] = cie("verify", os.path.basename(recording), cwd=os.path.dirname(recording)).stdout.decode("ascii").splitlines()
            for columns, lines in shown.items():
                self.assertLessEqual(len(lines), 23, recording)
                for line in lines:
                    self.assertLessEqual(len(line), columns, recording)
                symbol = {0: "✓ PASS", 1: "✗ FAIL", 3: "? INCONCLUSIVE"}[cie("verify", recording).returncode]
                self.assertTrue(lines[0].startswith((symbol if columns != 100 else symbol[2:]) + "  "), lines[0])
            line, = cie("verify", recording, "-q").stdout.decode().splitlines()
            self.assertEqual(line.split(":")[0], cie("verify", recording).stdout.decode().split(":")[0])

    def test_a_locale_without_utf8_has_no_symbols(self):
        shown = on_terminal("verify", RECORDINGS[0], columns=80, environment={"NO_COLOR": "1", "LC_ALL": "C"})[1]
        self.assertTrue(shown.isascii(), shown)

    def test_a_binary_file_is_not_for_a_terminal(self):
        code, shown, errors = on_terminal("export", TRACE, "--to", "perfetto")
        self.assertEqual((code, shown), (2, b""))
        self.assertIn(b"name a file with -o FILE", errors)

if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
