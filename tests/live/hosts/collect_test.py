#!/usr/bin/env python3
"""cie record --to and cie collect on one machine, with no more rights than any user has."""

import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import unittest
from pathlib import Path

import machines
from machines import CIE, FAULT_APP, cie, expected_code, report, verdicts, wait_for
from recording import manifest_of


class Collector:
    def __init__(self, test, *arguments):
        self.directory = machines.scratch / test.id().rsplit(".", 1)[-1]
        self.log = Path(f"{self.directory}.log")
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen([CIE, "collect", "-o", self.directory, "--listen", "0", *arguments],
                                            stdout=log, stderr=log)
        test.addCleanup(self.end)
        self.address = wait_for_match(r"cie record --to (\S+)", self.said)
        self.live = re.search(r"cie live (\S+)", self.said()).group(1)

    def said(self):
        return self.log.read_text(encoding="utf-8", errors="surrogateescape")

    def end(self, number=signal.SIGINT):
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.wait(60)


def wait_for_match(pattern, said):
    found = []
    wait_for(lambda: found.extend(re.findall(pattern, said())) or found, pattern)
    return found[0]


def counted(folder):
    totals = [struct.unpack("QQ", file.read_bytes()) for file in folder.iterdir()]
    return sum(begun for begun, _ in totals), sum(emitted for _, emitted in totals)


class Collect(unittest.TestCase):
    def record(self, name, address, *arguments, options=()):
        counts = machines.scratch / f"{name}.counts"
        counts.mkdir(exist_ok=True)
        return cie.run("record", "-o", machines.scratch / name, "--to", address, *options, "--", FAULT_APP, counts, *arguments)

    def test_what_machines_call_themselves_is_shown_and_not_obeyed(self):
        collector = Collector(self)
        # As the relay daemon would make it: a title for the terminal, a colour, a right-to-left override, no UTF-8.
        host = b"\x1b]0;owned\x07\x1b[31m\xe2\x80\xaetobor\xff"
        os.makedirs(os.fsencode(collector.directory) + b"/" + host + b"/session-1")
        shown = "\\x1b]0;owned\\x07\\x1b[31m\\u{202e}tobor\ufffd/session-1"
        wait_for(lambda: f"receiving {shown}\n" in collector.said(), "the session")
        self.assertEqual(collector.end(), 0)
        self.assertIn(f"\n{shown}: 0 packets", collector.said())
        raw = collector.log.read_bytes()
        self.assertEqual([byte for byte in raw if byte < 0x20 and byte != 0x0a], [])
        self.assertNotIn(b"\xe2\x80\xae", raw)

    def test_everything_is_there_and_the_manifest_says_where(self):
        collector = Collector(self)
        done = self.record("rec", collector.address, "--instances", "2000", "--period-us", "100")
        self.assertEqual(done.returncode, 0, done.stderr)
        host = socket.gethostname()
        self.assertRegex(done.stderr, rf"streamed to the relay daemon at {collector.address}, as {host}/cie-record-")
        manifest = manifest_of(machines.scratch / "rec")
        self.assertEqual([file.name for file in (machines.scratch / "rec").iterdir()], ["manifest.json"])
        self.assertEqual((manifest["host"], manifest["problems"], manifest["files"]), (host, [], []))
        self.assertEqual(manifest["relay"]["address"], collector.address)
        session, = manifest["relay"]["sessions"]
        self.assertIsNone(session["lost"])
        self.assertLess(session["begin"]["monotonic_ns"], session["end"]["monotonic_ns"])
        self.assertEqual(collector.end(), 0, collector.said())
        there, = collector.directory.glob(session["path"])
        self.assertIn(f"receiving {there.relative_to(collector.directory)}", collector.said())
        self.assertNotIn("LOST", collector.said())
        begun, emitted = counted(machines.scratch / "rec.counts")
        self.assertEqual((begun, emitted), (4000, 4000))
        discarded = sum(channel["discarded_events"] for channel in manifest["channels"])
        self.assertEqual(discarded, 0, manifest["channels"])
        text = subprocess.run(["babeltrace2", collector.directory], capture_output=True, text=True, check=True).stdout
        self.assertEqual(len(re.findall("cie:callback_(?:start|end):", text)), emitted)
        code, rules, _ = verdicts(collector.directory)
        failing = {rule for rule, verdict in rules.items() if verdict in ("FAIL", "INCONCLUSIVE")}
        self.assertLessEqual(failing, {"R1", "R2"})
        self.assertEqual(code, expected_code(rules))

    def test_what_is_discarded_is_counted_here_and_there(self):
        collector = Collector(self)
        done = self.record("hot", collector.address, "--instances", "60000",
                           options=["--subbuf-size", "4k", "--num-subbuf", "2"])
        self.assertEqual(done.returncode, 0, done.stderr)
        manifest = manifest_of(machines.scratch / "hot")
        discarded = sum(channel["discarded_events"] for channel in manifest["channels"])
        self.assertGreater(discarded, 0)
        self.assertRegex(done.stderr, f'LOST: channel "events" discarded {discarded} events')
        collector.end()
        self.assertIn(f"LOST: {discarded} events discarded at their host", collector.said())
        text = subprocess.run(["babeltrace2", collector.directory], capture_output=True, text=True, check=True).stdout
        recorded = len(re.findall("cie:callback_(?:start|end):", text))
        self.assertEqual(recorded + discarded, counted(machines.scratch / "hot.counts")[1])
        self.assertEqual(report(collector.directory)["trace"]["lost_events"], discarded)

    def test_a_directory_is_continued(self):
        collector = Collector(self)
        self.record("first", collector.address, "--instances", "10")
        collector.end()
        collector = Collector(self)
        self.assertNotIn("receiving", collector.said())
        self.record("second", collector.address, "--instances", "10")
        collector.end()
        self.assertEqual(collector.said().count("receiving"), 1)
        self.assertEqual(sorted(c["instances"] for c in report(collector.directory)["callbacks"]), [10, 10])

    def test_nobody_answers(self):
        with socket.socket() as taken:  # bound, but nobody listens
            taken.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{taken.getsockname()[1]}"
            done = self.record("nobody", address)
        self.assertEqual(done.returncode, 4)
        self.assertEqual(done.stderr, f"cie: no relay daemon answers at {address}: Connection refused "
                                      "(cie collect starts one there)\n")
        self.assertFalse((machines.scratch / "nobody").exists())
        done = self.record("nowhere", "no-such-host.invalid")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (4, 1), done.stderr)

    def test_somebody_else_answers(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            done = subprocess.run(
                [CIE, "record", "-o", machines.scratch / "other", "--to", f"127.0.0.1:{other.getsockname()[1]}", "--", "true"],
                capture_output=True, text=True, timeout=120, check=False,
                env={**os.environ, "LTTNG_NETWORK_SOCKET_TIMEOUT": "1000"})
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertFalse((machines.scratch / "other").exists())

    def test_a_port_that_is_taken(self):
        collector = Collector(self)
        done = cie.run("collect", "-o", machines.scratch / "taken", "--listen", collector.address)
        self.assertEqual(done.returncode, 4)
        self.assertIn(f"cannot listen on {collector.address} (a relay daemon that runs already?)", done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)

    def test_wrong_usage_and_help(self):
        for arguments in ([], ["-o", "x", "--listen", "here:there"], ["-o", "x", "--listen", "65534"], ["-o", "x", "--hlp"]):
            done = cie.run("collect", *arguments)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertRegex(done.stderr, r"\Acie: .+\nTry: cie collect --help\n\Z")
        self.assertIn("--listen", cie.run("collect", "--help").stdout)

    def test_the_relay_daemon_ends(self):
        collector = Collector(self)
        task = Path(f"/proc/{collector.process.pid}/task/{collector.process.pid}/children")
        os.kill(int(task.read_text()), signal.SIGKILL)
        self.assertEqual(collector.process.wait(60), 4)
        self.assertRegex(collector.said(), r"(?m)^cie: the relay daemon of LTTng ended: it was killed by signal 9 \(Killed\)"
                                           r'.*; cie collect -o "\S+", started again, receives what follows$')

    def test_a_disk_that_is_full(self):
        directory = machines.scratch / "small"
        directory.mkdir()
        log = Path(f"{directory}.log")
        script = 'mount -t tmpfs -o size=256k small "$1" && shift && exec "$@"'
        with open(log, "wb") as out:
            process = subprocess.Popen(["unshare", "--mount", "sh", "-c", script, "sh", directory, CIE, "collect",
                                        "-o", directory / "fleet", "--listen", "0"], stdout=out, stderr=out)
        self.addCleanup(process.kill)
        no_space = (f'no space is left for "{directory}/fleet": what machines send may be lost; '
                    "free some, or collect in another directory (-o)\n")
        wait_for(lambda: f"\nwarning: {no_space}" in log.read_text(), "the warning")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 4)
        self.assertTrue(log.read_text().endswith(f"\nnothing was received\ncie: {no_space}"), log.read_text())

    def test_it_ends_with_its_parent(self):
        collector = Collector(self)
        relay = Path(f"/proc/{collector.process.pid}/task/{collector.process.pid}/children").read_text().strip()
        collector.process.kill()
        collector.process.wait()
        wait_for(lambda: not Path(f"/proc/{relay}").exists(), "the relay daemon's end")

    def test_a_directory_that_cannot_be_written(self):
        done = cie.run("collect", "-o", "/proc/none", "--listen", "0")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (4, 1), done.stderr)


if __name__ == "__main__":
    if shutil.which("lttng-relayd") is None:
        raise SystemExit("lttng-relayd is missing: install lttng-tools")
    machines.main("collect")
