"""How a live test in Python runs: with a session daemon of its own, and in a folder of its own."""

import os
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PATIENCE = 90  # seconds, for what a busy machine does late


def isolate():
    """Nothing of LTTng is shared with others. Root's session daemon has one fixed place, so root needs
    a mount namespace with a /run/lttng of its own; this program starts again in one."""
    if os.geteuid() != 0 or os.environ.get("CIE_TEST_NAMESPACE") == "1":
        return
    os.environ["CIE_TEST_NAMESPACE"] = "1"
    inside = "mkdir -p /run/lttng && mount -t tmpfs none /run/lttng && exec \"$@\""
    os.execvp("unshare", ["unshare", "--mount", "--", "sh", "-c", inside, "sh", sys.executable,
                          *sys.argv])


def wait_for(condition, what, seconds=PATIENCE):
    """The first result of `condition` that is true; AssertionError with `what` if none comes."""
    bound = time.monotonic() + seconds
    while not (result := condition()):
        if time.monotonic() > bound:
            raise AssertionError(f"never within {seconds} s: {what}")
        time.sleep(0.02)
    return result


def session_daemon(test):
    """A session daemon, as somebody else would start it, until the end of the test."""
    daemon = subprocess.Popen(["lttng-sessiond", "--no-kernel"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    test.addCleanup(end, daemon)
    wait_for(lambda: subprocess.run(["lttng", "--no-sessiond", "list"], capture_output=True, check=False).returncode == 0,
             "the session daemon listens")
    return daemon


def end(process):
    """Ends a process that this one started, one way or the other."""
    process.terminate()
    try:
        process.wait(60)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def with_time_enough(attempt, is_enough, seconds):
    """The result of `attempt(s)` for the first s of `seconds` with which it is enough, or for the last one:
    what does its work in a second may need ten on a busy machine."""
    for length in seconds:
        result = attempt(length)
        if is_enough(result):
            break
    return result


def main(name, arguments, begin, records=True):
    """Runs the tests of __main__ and exits. `begin(scratch)` is called first, with a folder that is
    removed at the end and holds the home. `records`: the tests use a session daemon."""
    if records:
        isolate()
    with tempfile.TemporaryDirectory(prefix=f"cie-{name}-") as directory:
        scratch = Path(directory)
        home = scratch / "home"
        home.mkdir()
        os.environ["LTTNG_HOME"] = os.environ["HOME"] = str(home)
        begin(scratch)
        program = unittest.main(module="__main__", argv=[sys.argv[0], *arguments], exit=False,
                                verbosity=2)
    sys.exit(not program.result.wasSuccessful())
