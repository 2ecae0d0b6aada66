#!/usr/bin/env python3
"""Whatever ends a command that writes a file: the old file or the new one is there, whole, and nothing else.

Arguments: CIE EXAMPLES. Every format of every command takes part; they are asked of the program.
"""
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

CIE = os.path.abspath(sys.argv[1])
EXAMPLES = Path(sys.argv[2]).resolve()
TRACE = EXAMPLES / "multi_threaded_fails" / "trace"
OTHER = EXAMPLES / "isolated_ok" / "trace"
OLD = b"what was there before\n"


def run(arguments, **options):
    return subprocess.run([CIE, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=options.pop("stdout", subprocess.PIPE),
                          stderr=subprocess.PIPE, timeout=200, check=False, **options)


def choices(*arguments):
    """What an option takes, as the message about a wrong one lists it."""
    told = run([*arguments, "no-such-thing"]).stderr.decode()
    return told.partition("available: ")[2].splitlines()[0].split(", ")


def commands():
    """Every way to write a file of a trace: {name: arguments}."""
    found = {f"export --to {form}": ["export", TRACE, "--to", form] for form in choices("export", TRACE, "--to")}
    found["export --to perfetto --gzip"] = ["export", TRACE, "--to", "perfetto", "--gzip"]
    for command in ("report", "instances", "verify"):
        for form in choices(command, TRACE, "-f"):
            found[f"{command} -f {form}"] = [command, TRACE, "-f", form]
    for form in choices("diff", TRACE, OTHER, "-f"):
        found[f"diff -f {form}"] = ["diff", TRACE, OTHER, "-f", form]
    for form in choices("analyze", "schedulability", TRACE, "-f"):
        found[f"analyze -f {form}"] = ["analyze", "schedulability", TRACE, "-f", form]
    found["spec template"] = ["spec", "template", TRACE]
    if shutil.which("dot") is None:
        del found["export --to svg"]
    return found


def files_in(directory):
    return {path.relative_to(directory): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


class Interrupted(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.commands = commands()
        cls.whole = {}  # what each writes when nothing interrupts it, and how long it takes
        with tempfile.TemporaryDirectory() as folder:
            for name, arguments in cls.commands.items():
                target = Path(folder, "out")
                began = time.monotonic()
                done = run([*arguments, "-o", target])
                assert done.returncode in (0, 1, 3), (name, done.stderr)
                cls.whole[name] = (target.read_bytes(), time.monotonic() - began)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.temporary = self.folder / "tmp"
        self.place = self.folder / "place"
        self.temporary.mkdir()
        self.place.mkdir()
        self.target = self.place / "out"
        self.environment = {**os.environ, "TMPDIR": str(self.temporary)}

    def nothing_else_is_left(self, name):
        self.assertEqual([path.name for path in self.place.iterdir()], ["out"], name)
        self.assertEqual(list(self.temporary.iterdir()), [], name)

    def test_all_formats_take_part(self):
        for name in ("export --to sqlite", "export --to parquet", "export --to perfetto", "report -f html", "verify -f sarif",
                     "instances -f jsonl", "diff -f json", "analyze -f json"):
            self.assertIn(name, self.commands)

    def test_a_disk_that_is_full(self):
        """A limit on the size of files stands for it, at half of what is to be written."""
        for name, arguments in self.commands.items():
            self.target.write_bytes(OLD)
            size = len(self.whole[name][0]) // 2
            done = run([*arguments, "-o", self.target], env=self.environment,
                       preexec_fn=lambda limit=size: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
            self.assertEqual(done.returncode, 4, (name, done.stderr))
            # What could not be written is named, or where.
            self.assertRegex(done.stderr, rb'cie: .* "/', name)
            self.assertEqual(self.target.read_bytes(), OLD, name)
            self.nothing_else_is_left(name)

    def test_a_file_system_that_is_full(self):
        script = 'mount -t tmpfs -o size=16k tmpfs "$1" && cd "$1" && shift && { "$@"; code=$?; ls -A; exit $code; }'
        enter = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script, "sh", str(self.place)]
        if subprocess.run([*enter, "true"], stdin=subprocess.DEVNULL, capture_output=True, check=False).returncode != 0:
            self.skipTest("not possible here: no right to mount a small file system")
        full = 0
        for name, arguments in self.commands.items():
            done = subprocess.run([*enter, CIE, *map(str, arguments), "-o", "out"], stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False, timeout=200)
            if done.returncode == 4:
                full += 1
                self.assertRegex(done.stderr, rb'cie: cannot write (.+ )?"(out|[.])"', name)
                self.assertIn(b"No space left on device" if b"database" not in done.stderr else b"full", done.stderr, name)
                self.assertEqual(done.stdout, b"", name)
            else:
                self.assertEqual(done.stdout, b"out\n", name)
        self.assertGreater(full, 5)

    def test_a_reader_that_has_gone(self):
        for name, arguments in self.commands.items():
            reader, writer = os.pipe()
            os.close(reader)
            done = run(arguments, stdout=writer, env=self.environment)
            os.close(writer)
            self.assertEqual((done.returncode, done.stderr), (-signal.SIGPIPE, b""), name)
            self.assertEqual(list(self.temporary.iterdir()), [], name)

    def test_signals_at_any_time(self):
        """Five times for each format, spread over the time that it takes."""
        ended = 0
        for name, arguments in self.commands.items():
            whole, duration = self.whole[name]
            for attempt, number in enumerate((signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGTERM)):
                self.target.write_bytes(OLD)
                with subprocess.Popen([CIE, *map(str, arguments), "-o", str(self.target)], stdin=subprocess.DEVNULL,
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=self.environment) as process:
                    time.sleep(duration * (attempt + 0.5) / 5)
                    process.send_signal(number)
                    code = process.wait(timeout=200)
                self.assertIn(code, (0, 1, 3, -number), name)
                content = self.target.read_bytes()
                if code == 0:  # it had been slower when it was timed
                    duration /= 2
                if code == -number:
                    ended += 1
                    self.assertIn(content, (OLD, whole), name)
                else:
                    self.assertEqual(content, whole, name)
                self.nothing_else_is_left(name)
        self.assertGreater(ended, len(self.commands))

    def test_a_directory_gets_all_files_or_none(self):
        arguments = ["export", TRACE, "--to", "parquet", "--partition"]
        began = time.monotonic()
        done = run([*arguments, "-o", self.folder / "whole"], env=self.environment)
        duration = time.monotonic() - began
        self.assertEqual(done.returncode, 0, done.stderr)
        whole = files_in(self.folder / "whole")
        shutil.rmtree(self.folder / "whole")
        ended = 0
        for attempt in range(12):
            number = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[attempt % 3]
            with subprocess.Popen([CIE, *map(str, arguments), "-o", str(self.target)], stdin=subprocess.DEVNULL,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=self.environment) as process:
                time.sleep(duration * (attempt + 0.5) / 12)
                process.send_signal(number)
                code = process.wait(timeout=200)
            self.assertIn(code, (0, -number))
            found = files_in(self.target) if self.target.exists() else {}
            if code == 0 or found:
                self.assertEqual(found, whole)
            ended += code != 0
            self.assertEqual(list(self.temporary.iterdir()), [])
            shutil.rmtree(self.target, ignore_errors=True)
        self.assertGreater(ended, 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
