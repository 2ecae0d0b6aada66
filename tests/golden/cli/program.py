"""What tests of the cie program from outside share. Arguments of each: CIE EXAMPLES."""
import fcntl
import os
import pty
import shutil
import struct
import subprocess
import sys
import tempfile
import termios
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position

CIE = os.path.abspath(sys.argv[1])
EXAMPLES = os.path.abspath(sys.argv[2])
TRACE = os.path.join(EXAMPLES, "isolated_ok", "trace")
SPEC = os.path.join(EXAMPLES, "isolated_ok", "spec.yaml")
COMMANDS = ("report", "events", "instances", "verify", "analyze", "export", "spec", "diff", "live", "doctor")


def cie(*arguments, program=CIE, **options):
    """As bytes: what is printed is held against files, and compressed."""
    return Cie(program).run(*arguments, text=False, **options)


def on_terminal(*arguments, environment=None, columns=None, cwd=None, has_errors=False):
    """Runs cie with standard output on a terminal, with `has_errors` standard error, too; returns its exit code and what
    it showed."""
    ours, theirs = pty.openpty()
    if columns:
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen([CIE, *arguments], stdin=subprocess.DEVNULL, stdout=theirs, cwd=cwd,
                               stderr=theirs if has_errors else subprocess.PIPE,
                               env={**os.environ, "TERM": "xterm", **(environment or {})})
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end was closed
            part = b""
        if not part:
            break
        shown += part
    os.close(ours)
    errors = b""
    if process.stderr:
        errors = process.stderr.read()
        process.stderr.close()
    return process.wait(timeout=200), shown, errors


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="cie-cli.")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def write(self, name, content, mode=0o644):
        with open(self.path(name), "wb") as file:
            file.write(content)
        os.chmod(self.path(name), mode)
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()
