"""Machines on one network, made of namespaces: each has interfaces, a name, process ids, a /run/lttng, a /dev/shm
and, where the kernel can, a CLOCK_MONOTONIC of its own. Every test program takes PROGRAMS HOST_APP FAULT_APP.

Nothing has a name on the real machine, and everything ends with the test program, even if that is killed."""

import contextlib
import ctypes
import json
import os
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402,F401  pylint: disable=wrong-import-position,unused-import
from cie import Cie, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, HOST_APP, FAULT_APP = (Path(path).absolute() for path in sys.argv[1:4])
CIE = PROGRAMS / "cie"
cie = Cie(CIE)
scratch = Path(os.sep)  # set by main()
PR_SET_PDEATHSIG = 1


def main(name):
    def begin(folder):
        global scratch  # pylint: disable=global-statement
        scratch = folder
    isolated_main.main(name, sys.argv[4:], begin)


def report(*arguments):
    return cie.json("report", *arguments)


def verdicts(*arguments):
    """Exit code, verdicts by rule, and all that is said of them."""
    done = cie.run("verify", *arguments, "-f", "json")
    result = json.loads(done.stdout)
    return done.returncode, verdicts_of(result), result


def expected_code(rules):
    """The exit status of cie verify with these verdicts."""
    if "FAIL" in rules.values():
        return 1
    return 3 if "INCONCLUSIVE" in rules.values() else 0


def die_with_parent():
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def only_child(process):
    """Of a program that waits for its one child; None before it has it and after its end."""
    with contextlib.suppress(OSError):
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii").split()
        if children:
            return int(children[0])
    return None


class Running:
    """A program on a machine. What it says goes into a file, so that nothing waits for a reader."""

    def __init__(self, machine, command, environment):
        self.log = scratch / f"{machine.name}-{len(machine.programs)}-{machine.init}.log"
        machine.programs.append(self)
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(
                [*machine.enter, "--", *map(str, command)], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                env={**os.environ, **environment}, preexec_fn=die_with_parent)  # pylint: disable=subprocess-popen-preexec-fn

    def said(self):
        return self.log.read_text(encoding="utf-8", errors="replace")

    def send(self, number=signal.SIGTERM):
        """To the program itself rather than to nsenter, which waits for it."""
        child = only_child(self.process)
        if child is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, number)

    def wait(self, seconds=100):
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"it hangs: {self.said()}") from None

    def end(self, number=signal.SIGTERM):
        """Its exit status, once it was asked to end."""
        wait_for(lambda: only_child(self.process) is not None or self.process.poll() is not None, "the program")
        self.send(number)
        return self.wait()


class Machine:
    """A machine; the first one of a network has the switch in it."""

    def __init__(self, name, monotonic=None):
        self.name = name
        self.programs = []
        namespaces = ["--net", "--uts", "--mount", "--ipc", "--pid"]
        clock = [] if monotonic is None else ["--time", f"--monotonic={monotonic}"]
        prepare = ("mount -t tmpfs none /dev/shm && mkdir -p /run/lttng && mount -t tmpfs none /run/lttng && "
                   f"hostname {name} && ip link set lo up && echo ready && exec sleep infinity")
        self.outside = subprocess.Popen(
            ["unshare", *namespaces, *clock, "--fork", "--kill-child", "--mount-proc", "sh", "-c", prepare],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            preexec_fn=die_with_parent)  # pylint: disable=subprocess-popen-preexec-fn
        said = self.outside.stdout.readline()
        if said != "ready\n":
            self.outside.wait()
            raise unittest.SkipTest(f"not possible here: namespaces for machines: {said.strip()}")
        self.init = only_child(self.outside)
        self.enter = ["nsenter", "--target", str(self.init), *namespaces, *(["--time"] if clock else [])]

    def run(self, *command, **environment):
        return Running(self, command, environment)

    def ip(self, *arguments):
        done = subprocess.run(["nsenter", "--target", str(self.init), "--net", "ip", *map(str, arguments)],
                              capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise unittest.SkipTest(f"not possible here: network interfaces in a namespace: {done.stderr.strip()}")

    def record(self, name, *command, options=(), **environment):
        """cie record --to the network's first machine."""
        return self.run(CIE, "record", "-o", scratch / name, "--to", Network.ADDRESS, *options, "--", *command,
                        **environment)

    def set_link(self, state):
        self.ip("link", "set", "eth0", state)

    def kill(self):
        """Everything of it at once, as a power cut does."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.init, signal.SIGKILL)
        self.outside.wait()
        self.outside.stdout.close()
        for program in self.programs:  # nsenter, whose program is gone
            program.process.kill()
            program.process.wait()


class Network:
    """Machines by name; the first one collects what the others send."""

    ADDRESS = "10.77.0.1"

    def __init__(self, add_cleanup, *names, monotonic=()):
        if os.geteuid() != 0:
            raise unittest.SkipTest("not possible here: needs root for network namespaces")
        self.machines = {}
        add_cleanup(self.end)
        self.collector = self.add("collector")
        self.collector.ip("link", "add", "switch", "type", "bridge")
        self.collector.ip("addr", "add", f"{self.ADDRESS}/24", "dev", "switch")
        self.collector.ip("link", "set", "switch", "up")
        for number, name in enumerate(names):
            machine = self.add(name, dict(monotonic).get(name))
            port = f"port{number}"
            self.collector.ip("link", "add", port, "type", "veth", "peer", "name", "eth0", "netns", machine.init)
            self.collector.ip("link", "set", port, "master", "switch", "up")
            machine.ip("addr", "add", f"10.77.0.{number + 2}/24", "dev", "eth0")
            machine.set_link("up")
            machine.ip("route", "add", "default", "via", self.ADDRESS)

    def add(self, name, monotonic=None):
        machine = Machine(name, monotonic)
        self.machines[name] = machine
        return machine

    def __getitem__(self, name):
        return self.machines[name]

    def collect(self, directory):
        """cie collect on the first machine, ready to receive."""
        running = self.collector.run(CIE, "collect", "-o", directory, "--listen", self.ADDRESS)
        wait_for(lambda: "on each machine" in running.said() or running.process.poll() is not None, "cie collect")
        assert running.process.poll() is None, running.said()
        return running

    def end(self):
        for machine in self.machines.values():
            machine.kill()


def can_have_clocks():
    return Path("/proc/self/ns/time").exists()
