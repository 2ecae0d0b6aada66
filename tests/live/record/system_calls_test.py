#!/usr/bin/env python3
"""Who emits an event makes no system call for it, however full the buffers become: the kernel's count of the
application's writes, which is how LTTng wakes its consumer daemon. Arguments: PROGRAMS APPLICATION (traced_app), and what others use."""

import os
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import PATIENCE, wait_for  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, APPLICATION = (Path(argument).resolve() for argument in sys.argv[1:3])
INSTANCES = 20_000
# Of the timer's and the subscription's instance: five events of at least 19 bytes.
LEAST_BYTES = INSTANCES * 5 * 19
SUBBUFFER = 16 << 10
scratch: Path


def writes_of(pid):
    fields = dict(line.split(": ") for line in Path(f"/proc/{pid}/io").read_text().splitlines())
    return int(fields["syscw"])


class SystemCalls(unittest.TestCase):
    def test_full_buffers_cost_the_application_none(self):
        ready = scratch / "ready"
        command = [PROGRAMS / "cie", "record", "--kernel", "no", "-o", scratch / "burst", "--subbuf-size", SUBBUFFER,
                   "--num-subbuf", "64", "--", APPLICATION, "--burst", INSTANCES, "--period-us", "100000",
                   "--until-signal", "--ready", ready, "--ready-after", "1"]
        recorder = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL,
                                    stderr=subprocess.PIPE, text=True)
        self.addCleanup(recorder.kill)
        wait_for(ready.exists, "the application has emitted its events")
        pid = int(ready.read_text())
        writes = writes_of(pid)
        os.kill(pid, signal.SIGTERM)
        _, text = recorder.communicate(timeout=PATIENCE)
        self.assertEqual(recorder.returncode, 0, text)
        switches = LEAST_BYTES // SUBBUFFER  # of sub-buffers, on which it might have called
        self.assertGreater(switches, 100)
        self.assertLess(writes, switches // 4, "it registers and reports; nothing grows with the events")


def begin(directory):
    global scratch
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("system-calls", sys.argv[4:], begin)
