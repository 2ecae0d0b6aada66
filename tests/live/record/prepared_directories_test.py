#!/usr/bin/env python3
"""Directories that another user prepared for a program of root's: links that lead to files of root's, and a process id
that is somebody else's. Arguments: PROGRAMS RECORDING."""

import fcntl
import os
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, RECORDING = (Path(argument).resolve() for argument in sys.argv[1:3])
NOBODY = 65534
UNUSABLE, FAILED = 2, 4
cie = Cie(PROGRAMS / "cie")
scratch: Path


class Prepared(unittest.TestCase):
    def setUp(self):
        self.place = scratch / self.id().rpartition(".")[2]
        self.place.mkdir()
        self.place.chmod(0o755)
        self.victim = self.place / "victim"
        self.victim.mkdir()
        self.file = self.victim / "file"
        self.file.write_text("ours")

    def tearDown(self):
        self.assertEqual([path.name for path in self.victim.iterdir()], ["file"])
        self.assertEqual(self.file.read_text(), "ours")

    def directory(self, name, mode=0o755, owner=NOBODY):
        made = self.place / name
        made.mkdir()
        made.chmod(mode)
        os.chown(made, owner, owner)
        return made

    @staticmethod
    def link(at, to):
        at.symlink_to(to)
        os.lchown(at, NOBODY, NOBODY)
        return at

    def refused(self, *arguments, code=UNUSABLE, why="belongs to another user (uid 65534)"):
        done = cie.run(*arguments)
        self.assertEqual((done.returncode, why in done.stderr), (code, True), done.stderr)

    def sleeper(self):
        """A process that SIGUSR1 ends."""
        process = subprocess.Popen(["sleep", "600"])
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process


@unittest.skipUnless(os.geteuid() == 0, "not possible here: only root can make files of another user")
class OfAnotherUser(Prepared):
    def test_a_recording_is_not_written_into_it(self):
        theirs = self.directory("theirs")
        plant = f"ln -s {self.file} {theirs}/manifest.json.part; chown -h {NOBODY} {theirs}/manifest.json.part"
        self.refused("record", "-o", theirs, "--", "sh", "-c", plant)
        self.refused("record", "-o", theirs, "--to", "127.0.0.1:1", "--", "true")
        self.refused("record", "-o", theirs, "--snapshot", "5", "--", "true")
        self.assertEqual(list(theirs.iterdir()), [])

    def test_a_recording_is_not_written_where_everybody_may(self):
        everybodys = self.directory("everybodys", 0o1777, 0)
        self.refused("record", "-o", everybodys, "--", "true", why="may be written to by everybody")
        self.refused("collect", "-o", everybodys, "--listen", "127.0.0.1:0", why="may be written to by everybody")

    def test_a_link_of_theirs_leads_no_recording_elsewhere(self):
        theirs = self.directory("theirs")
        link = self.link(theirs / "link", self.victim)
        for arguments in (("record", "-o", link / "run", "--", "true"), ("collect", "-o", link / "run"),
                          ("record", "--save", link)):
            self.refused(*arguments, why="a link of another user (uid 65534), which is not followed")

    def test_nobody_is_signalled_by_what_stands_in_it(self):
        theirs = self.directory("theirs")
        sleeper = self.sleeper()
        (theirs / "recorder.pid").write_text(f"{sleeper.pid}\n")
        with open(theirs / "recorder.pid", encoding="ascii") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.refused("record", "--save", theirs, "--reason", "why")
            self.refused("live", "--save-snapshot", theirs)
        self.assertIsNone(sleeper.poll())
        self.assertEqual([path.name for path in theirs.iterdir()], ["recorder.pid"])

    def test_nothing_is_collected_in_it(self):
        self.refused("collect", "-o", self.directory("theirs"), "--listen", "127.0.0.1:0")

    def test_a_result_does_not_take_the_place_of_what_a_link_of_theirs_leads_to(self):
        everybodys = self.directory("everybodys", 0o1777, 0)
        for number, command in enumerate((("report",), ("report", "-f", "html"), ("instances", "-f", "csv"),
                                          ("export", "--to", "perfetto"), ("export", "--to", "sqlite"))):
            for target in (self.file, self.victim / "new", "/dev/null"):
                link = self.link(everybodys / f"{number}{Path(target).name}", target)
                self.refused(command[0], RECORDING, *command[1:], "-o", link, code=FAILED,
                             why="a link of another user (uid 65534), which is not followed")
        link = self.link(everybodys / "link", self.victim)
        self.refused("report", RECORDING, "-o", link / "new", code=FAILED,
                     why="a link of another user (uid 65534), which is not followed")

    def test_a_result_is_not_told_to_a_fifo_of_theirs(self):
        fifo = self.directory("everybodys", 0o1777, 0) / "fifo"
        os.mkfifo(fifo, 0o666)
        os.chown(fifo, NOBODY, NOBODY)
        reader = os.open(fifo, os.O_RDWR)
        self.addCleanup(os.close, reader)
        self.refused("report", RECORDING, "-o", fifo, code=FAILED, why="it is a FIFO of another user (uid 65534)")

    def test_a_result_of_ones_own_stands_where_everybody_may_write(self):
        everybodys = self.directory("everybodys", 0o1777, 0)
        planted = everybodys / "planted.html"
        planted.write_text("theirs")
        planted.chmod(0o4777)
        os.chown(planted, NOBODY, NOBODY)
        planted.chmod(0o4777)
        for name in ("new.html", "planted.html"):
            done = cie.run("report", RECORDING, "-f", "html", "-o", everybodys / name)
            self.assertEqual(done.returncode, 0, done.stderr)
            status = (everybodys / name).stat()
            self.assertEqual((status.st_uid, status.st_mode & 0o7002), (0, 0), oct(status.st_mode))
        self.assertEqual(sorted(path.name for path in everybodys.iterdir()), ["new.html", "planted.html"])

    def test_no_set_of_files_is_exported_into_it(self):
        theirs = self.directory("theirs")
        self.link(theirs / "instances", self.victim)
        self.refused("export", RECORDING, "--to", "parquet", "--partition", "-o", theirs)
        ours = self.directory("ours", owner=0)
        self.link(ours / "instances", self.victim)
        self.refused("export", RECORDING, "--to", "parquet", "--partition", "-o", ours, code=FAILED,
                     why="a link of another user (uid 65534), which is not followed")


class OfOnesOwn(Prepared):
    def test_only_the_recorder_is_signalled_whoever_stands_in_its_file(self):
        ours = self.directory("ours", owner=os.geteuid())
        sleeper = self.sleeper()
        (ours / "recorder.pid").write_text(f"{sleeper.pid}\n")
        with open(ours / "recorder.pid", encoding="ascii") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.refused("record", "--save", ours, code=FAILED, why="nobody keeps snapshots in")
        self.assertIsNone(sleeper.poll())
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
        self.addCleanup(signal.pthread_sigmask, signal.SIG_UNBLOCK, {signal.SIGUSR1})
        with open(ours / "recorder.pid", "r+", encoding="ascii") as lock:
            fcntl.lockf(lock, fcntl.LOCK_EX)
            saving = subprocess.Popen([str(cie.program), "record", "--save", str(ours)], stderr=subprocess.DEVNULL)
            self.addCleanup(saving.wait)
            self.addCleanup(saving.kill)
            told = signal.sigtimedwait({signal.SIGUSR1}, isolated_main.PATIENCE)
            self.assertEqual(told.si_pid, saving.pid, "it signals who has the lock")
        self.assertIsNone(sleeper.poll())

    def test_links_of_ones_own_are_followed(self):
        (self.place / "link").symlink_to("elsewhere")
        (self.place / "elsewhere").mkdir()
        done = cie.run("report", RECORDING, "-o", self.place / "link" / "report")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.place / "elsewhere" / "report").is_file())


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory
    directory.chmod(0o755)


if __name__ == "__main__":
    isolated_main.main("prepared", sys.argv[3:], begin, records=False)
