"""What the tests of `cie live` share. Every test program takes the arguments CIE TRACED_APP BURST_APP LATE_CONSUMER."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position,unused-import
from isolated_main import PATIENCE, wait_for  # noqa: E402  pylint: disable=wrong-import-position

CIE, TRACED_APP, BURST_APP, LATE_CONSUMER = (os.path.abspath(path) for path in sys.argv[1:5])
TIMER = "/test/node@Timer(1000000)"
SUBSCRIPTION = "/test/node@Subscription(/test/topic)"
SHORT_TIMER = "node timer 1 ms"
SHORT_SUBSCRIPTION = "node \u2190 /test/topic"
scratch = Path(os.sep)  # set by main()


def main(name):
    def begin(folder):
        global scratch  # pylint: disable=global-statement
        scratch = folder
        os.environ["TMPDIR"] = str(folder)  # other tests have left-overs of their own
    isolated_main.main(name, sys.argv[5:], begin)


def app(*arguments):
    return [TRACED_APP, *map(str, arguments)]


class Running:
    """A program whose lines are read while it runs; killed at the end of the test."""

    def __init__(self, test, command, **kwargs):
        self.process = subprocess.Popen([str(c) for c in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, start_new_session=True, **kwargs)
        test.addCleanup(self.end)

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.process.stderr.close()

    def snapshot(self):
        """The next line as an object; fails if there is none."""
        line = self.process.stdout.readline()
        if not line:
            raise AssertionError(f"no more snapshots: {self.process.stderr.read()}")
        return json.loads(line)

    def until(self, condition, seconds=PATIENCE):
        """The first snapshot for which the condition holds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            snapshot = self.snapshot()
            if condition(snapshot):
                return snapshot
        raise AssertionError(f"no such snapshot within {seconds} s; the last: {snapshot}")


def live(*arguments, timeout=PATIENCE, **kwargs):
    return subprocess.run([CIE, "live", *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=timeout, check=False, **kwargs)


def callback(snapshot, logical_id):
    return next((c for c in snapshot["callbacks"] if c["logical_id"] == logical_id), None)


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def is_listening(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


class Relay:
    """A session daemon and a relay daemon of LTTng, as somebody else would run them, on ports of their own."""

    def __init__(self, test):
        self.control, self.data, self.port = free_ports(3)
        self.url = f"net://127.0.0.1:{self.port}"
        self.folder = scratch / f"relay-{self.port}"
        self.sessiond = isolated_main.session_daemon(test)
        self.relayd = None
        self.start_relay()
        test.addCleanup(lambda: isolated_main.end(self.relayd))

    def start_relay(self):
        self.relayd = subprocess.Popen(
            ["lttng-relayd", f"--control-port=tcp://127.0.0.1:{self.control}", f"--data-port=tcp://127.0.0.1:{self.data}",
             f"--live-port=tcp://127.0.0.1:{self.port}", f"--output={self.folder}"], stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        for port in (self.control, self.data, self.port):
            wait_for(lambda p=port: is_listening(p), "relay daemon")

    def create(self, name, events=("cie:*",)):
        """A live session that has not been started; its URL."""
        def lttng(*arguments):
            subprocess.run(["lttng", "--no-sessiond", *arguments], check=True, stdout=subprocess.DEVNULL)
        lttng("create", name, "--live=100000", f"--ctrl-url=tcp://127.0.0.1:{self.control}",
              f"--data-url=tcp://127.0.0.1:{self.data}")
        lttng("enable-channel", "-u", "all")
        lttng("add-context", "-u", "-c", "all", "-t", "vpid", "-t", "vtid")
        for event in events:
            lttng("enable-event", "-u", "-c", "all", event)
        return f"{self.url}/host/{socket.gethostname()}/{name}"

    @staticmethod
    def command(*arguments):
        subprocess.run(["lttng", "--no-sessiond", *arguments], check=True, stdout=subprocess.DEVNULL)


def traces(folder):
    """Folders of CTF traces below one."""
    return sorted(str(file.parent) for file in Path(folder).rglob("metadata"))


def descendants(ancestor, name):
    """Processes of that name that a process, or one that it started, has started."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid=,comm="], capture_output=True, text=True, check=True).stdout
    rows = [line.split(None, 2) for line in listed.splitlines()]
    found = {ancestor}
    while more := {int(pid) for pid, parent, _ in rows if int(parent) in found} - found:
        found |= more
    return [int(pid) for pid, _, program in rows if int(pid) in found and program.startswith(name)]


def no_leftovers():
    """Folders of ours in the place for temporary files."""
    return sorted(Path(os.environ.get("TMPDIR", "/tmp")).glob("cie-relay-??????"))


HAS_LTTNG = shutil.which("lttng-relayd") is not None
