#!/usr/bin/env python3
"""`cie live` on a terminal: what it draws, which keys it knows, and that it gives the terminal back."""
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
import unittest
from pathlib import Path

import support
from support import CIE, PATIENCE, SHORT_SUBSCRIPTION, SUBSCRIPTION, app, wait_for

LEAVE = b"\x1b[?1049l"  # back to the normal screen


class Terminal:
    """A program on a terminal of its own."""

    def __init__(self, test, *arguments, rows=24, columns=80, term="xterm-256color"):
        self.master, slave = pty.openpty()
        self.resize(rows, columns)
        self.before = termios.tcgetattr(slave)
        self.slave = slave
        self.output = b""
        self.process = subprocess.Popen(
            [CIE, "live", "--interval", "0.2", *arguments, "--", *app("--until-signal", "--period-us", 2000)],
            stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
            env={**os.environ, "TERM": term, "LC_ALL": "C.UTF-8"})
        test.addCleanup(self.close)

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.master)
        os.close(self.slave)

    def resize(self, rows, columns):
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self, seconds=0.05):
        while select.select([self.master], [], [], seconds)[0]:
            self.output += os.read(self.master, 65536)
        return self.output

    def type(self, text):
        self.output = b""
        os.write(self.master, text.encode())

    def expect(self, text):
        """Waits until the screen shows it. What changed alone is sent otherwise."""
        def is_shown():
            self.type("\x0c")
            end = time.monotonic() + 2  # on a busy machine it draws late
            while text.encode() not in self.output and time.monotonic() < end:
                self.read()
            return text.encode() in self.output
        wait_for(is_shown, text)

    def wait(self):
        """The exit status; what it writes is read meanwhile."""
        end = time.monotonic() + PATIENCE
        while self.process.poll() is None:
            self.read()
            if time.monotonic() > end:
                raise AssertionError(f"it does not end: {self.output[-2000:]!r}")
        self.read()
        return self.process.returncode

    def children(self):
        path = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return {Path(f"/proc/{child}/comm").read_text("ascii").strip(): int(child)
                for child in path.read_text("ascii").split()}


class Screen(unittest.TestCase):
    def assert_given_back(self, terminal):
        self.assertEqual(termios.tcgetattr(terminal.slave), terminal.before)
        self.assertIn(LEAVE, terminal.output)

    def test_keys_lead_through_the_pages(self):
        terminal = Terminal(self)
        terminal.expect(SHORT_SUBSCRIPTION)
        terminal.expect("FAIL M2 one-callback-per-thread")
        terminal.type("\r")
        terminal.expect("execution")
        terminal.type("v")
        terminal.expect("one-callback-per-thread")
        terminal.type("t")
        terminal.expect("pool")
        terminal.type("h")
        terminal.expect("page up and down")
        terminal.type("c/subsc")
        terminal.expect("filter: subsc_")
        terminal.resize(12, 140)
        terminal.output = b""
        os.kill(terminal.process.pid, signal.SIGWINCH)
        terminal.expect(SUBSCRIPTION)  # there is room for all of it now
        terminal.type("\rp")
        terminal.expect("PAUSED")
        terminal.type("q")
        self.assertEqual(terminal.wait(), 0, terminal.output)
        self.assert_given_back(terminal)
        said = terminal.output[terminal.output.rindex(LEAVE):]
        self.assertRegex(said, rb"instances \d+", "what the command printed comes after the end")

    def test_signals_give_the_terminal_back(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            with self.subTest(signal=number):
                terminal = Terminal(self)
                terminal.expect("late missed")
                terminal.process.send_signal(number)
                self.assertEqual(terminal.wait(), 0)
                self.assert_given_back(terminal)

    def test_a_reader_that_crashes_does_not_take_the_terminal_with_it(self):
        terminal = Terminal(self)
        terminal.expect(SHORT_SUBSCRIPTION)
        os.kill(terminal.children()["cie-live"], signal.SIGSEGV)
        terminal.expect("was ended by signal 11")
        terminal.type("q")
        self.assertEqual(terminal.wait(), 4)
        self.assert_given_back(terminal)
        self.assertRegex(terminal.output, rb"cie: the process that reads the session was ended by signal 11")

    def test_a_terminal_without_a_screen(self):
        terminal = Terminal(self, term="nonsense")
        self.assertEqual(terminal.wait(), 4)
        self.assertIn(b"use --batch, --json or --listen", b" ".join(terminal.output.split()))
        self.assertEqual(termios.tcgetattr(terminal.slave), terminal.before)

    def test_without_colours(self):
        os.environ["NO_COLOR"] = "1"
        self.addCleanup(os.environ.pop, "NO_COLOR")
        terminal = Terminal(self)
        terminal.expect("VIOLATED M2")
        terminal.type("q")
        terminal.wait()
        self.assertIsNone(re.search(rb"\x1b\[[0-9;]*3[0-9](;[0-9;]*)?m", terminal.output))


if __name__ == "__main__":
    support.main("live-screen")
