#!/usr/bin/env python3
"""`cie view`: what it serves, to whom, and how it ends. Arguments: CIE EXAMPLES."""
import http.client
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "browser"), str(Path(__file__).resolve().parents[1])]
from chromium import Chromium  # noqa: E402  pylint: disable=wrong-import-position
from hostile_clients import HostileClients  # noqa: E402  pylint: disable=wrong-import-position

CIE = os.path.abspath(sys.argv[1])
TRACE = Path(sys.argv[2]).resolve() / "isolated_ok" / "trace"
VIEWER = "https://ui.perfetto.dev"


class View(HostileClients, unittest.TestCase):
    fetched = "/"

    def setUp(self):
        self.program = subprocess.Popen([CIE, "view", TRACE, "--port", "0"], stdin=subprocess.DEVNULL,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end)
        self.process = self.program.pid
        line = self.program.stdout.readline()
        self.address = re.search(r"http://127\.0\.0\.1:\d+/", line)[0]
        self.port = int(self.address.rstrip("/").rsplit(":", 1)[1])

    def end(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()
        self.program.stdout.close()
        self.program.stderr.close()

    def ask(self, method, path, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=200)
        self.addCleanup(connection.close)
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        return answer, answer.read()

    def test_the_report_is_a_page_that_draws_itself(self):
        with Chromium() as browser:
            browser.open(self.address)
            self.assertEqual(browser.evaluate("document.getElementById('verdict').textContent.split(' ').pop()"), "PASS")
            self.assertEqual(set(browser.requests()) - {self.address, self.address + "favicon.ico"}, set())

    def test_the_timeline_is_the_exported_file_and_for_perfettos_viewer(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "run.pftrace")
            subprocess.run([CIE, "export", TRACE, "--to", "perfetto", "-o", path], check=True, timeout=200)
            wanted = Path(path).read_bytes()
        answer, body = self.ask("GET", "/trace.pftrace", Origin=VIEWER)
        self.assertEqual((answer.status, body), (200, wanted))
        self.assertEqual(answer.headers["Access-Control-Allow-Origin"], VIEWER, "and to nobody else")
        # A browser asks first whether a public page may reach into this machine.
        answer, _ = self.ask("OPTIONS", "/trace.pftrace", **{"Origin": VIEWER, "Access-Control-Request-Method": "GET",
                                                             "Access-Control-Request-Private-Network": "true"})
        self.assertEqual(answer.status, 204)
        self.assertEqual(answer.headers["Access-Control-Allow-Private-Network"], "true")

    def test_the_report_is_for_no_other_site(self):
        answer, _ = self.ask("GET", "/", Origin="https://example.org")
        self.assertNotIn("Access-Control-Allow-Origin", answer.headers)

    def test_a_foreign_name_for_this_machine_is_refused(self):
        for host in ("example.org", f"example.org:{self.port}", "127.0.0.1"):
            answer, body = self.ask("GET", "/", Host=host)
            self.assertEqual((answer.status, body), (403, b""), host)

    def test_there_is_nothing_else(self):
        for path in ("/etc/passwd", "/../../etc/passwd", "/trace.pftrace/", "/report"):
            self.assertEqual(self.ask("GET", path)[0].status, 404, path)

    def test_only_this_machine_is_served(self):
        with open("/proc/net/tcp", encoding="ascii") as table:
            places = [line.split()[1] for line in table if line.split()[1].endswith(f":{self.port:04X}")]
        self.assertIn(f"0100007F:{self.port:04X}", places)
        self.assertNotIn(f"00000000:{self.port:04X}", places)

    def test_a_taken_port_is_said_before_the_work(self):
        done = subprocess.run([CIE, "view", TRACE, "--port", str(self.port)], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(done.returncode, 4)
        self.assertIn(f"port {self.port} of 127.0.0.1 is taken", done.stderr)

    def test_signals_end_it(self):
        self.program.send_signal(signal.SIGINT)
        self.assertEqual(self.program.wait(200), 0)

    def test_a_port_is_a_number(self):
        for port in ("x", "65536", "-1", ""):
            done = subprocess.run([CIE, "view", TRACE, f"--port={port}"], stdin=subprocess.DEVNULL, capture_output=True,
                                  text=True, timeout=200, check=False)
            self.assertEqual(done.returncode, 2, port)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
