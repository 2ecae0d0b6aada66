#!/usr/bin/env python3
"""`cie live --listen`: the page in a real browser, the metrics in a real Prometheus, and who is served."""
import http.client
import json
import re
import shutil
import signal
import subprocess
import sys
import unittest
import urllib.parse
from pathlib import Path

import support
from support import CIE, SHORT_SUBSCRIPTION, SHORT_TIMER, TIMER, Running, app, wait_for

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "viewer_export" / "live" / "prometheus"
sys.path.insert(0, str(ROOT / "tests" / "browser"))
from chromium import Chromium  # noqa: E402  pylint: disable=wrong-import-position
from hostile_clients import HostileClients  # noqa: E402  pylint: disable=wrong-import-position


def get(port, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=support.PATIENCE)
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer, answer.read()
    finally:
        connection.close()


class Served(HostileClients, unittest.TestCase):
    fetched = "/metrics"

    @classmethod
    def setUpClass(cls):
        cls.spec = support.scratch / "spec.yaml"
        cls.spec.write_text(f"callback_groups:\n  - id: {TIMER}\n    response_deadline: 100000\n", encoding="utf-8")
        cls.program = subprocess.Popen(
            [CIE, "live", "--listen", "0", "--interval", "0.2", "--spec", cls.spec, "--",
             *app("--until-signal", "--period-us", 5000, "--work-us", 300)], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        cls.process = cls.program.pid
        cls.port = int(re.search(r"http://127\.0\.0\.1:(\d+)/", cls.program.stderr.readline())[1])
        wait_for(lambda: f'callback="{TIMER}"' in cls.metrics(), "metrics")

    @classmethod
    def tearDownClass(cls):
        cls.program.send_signal(signal.SIGTERM)
        out, err = cls.program.communicate(timeout=support.PATIENCE)
        assert cls.program.returncode == 0, err
        assert out == "", "only what serves was asked for"

    @classmethod
    def metrics(cls):
        return get(cls.port, "/metrics")[1].decode()

    def value(self, name, text=None):
        """The sum of a metric over the samples of the timer, or its only sample."""
        lines = [line for line in (text or self.metrics()).splitlines()
                 if line.split("{")[0].split(" ")[0] == name and ("{" not in line or TIMER in line)]
        self.assertTrue(lines, name)
        return sum(float(line.rsplit(" ", 1)[1]) for line in lines)

    def test_metrics_are_well_formed_and_grow(self):
        if shutil.which("promtool") is None:
            self.skipTest("promtool (Debian package prometheus) is not installed")
        text = self.metrics()
        checked = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, check=False)
        self.assertEqual((checked.returncode, checked.stdout + checked.stderr), (0, ""))
        count = self.value("cie_callback_response_time_seconds_count", text)
        wait_for(lambda: self.value("cie_callback_response_time_seconds_count") > count, "more instances")
        text = self.metrics()
        self.assertEqual(self.value("cie_live_up", text), 1)
        self.assertEqual(self.value("cie_callback_deadline_seconds", text), 0.0001)
        self.assertEqual(self.value("cie_callback_late_total", text),
                         self.value("cie_callback_response_time_seconds_count", text), "0.3 ms of work, 0.1 ms allowed")
        self.assertGreater(self.value("cie_callback_response_time_seconds_sum", text), 0.0003)

    def test_prometheus_scrapes_it_and_its_alerts_fire(self):
        if shutil.which("prometheus") is None:
            self.skipTest("prometheus is not installed")
        port = support.free_ports(1)[0]
        folder = support.scratch / "prometheus"
        folder.mkdir()
        config = (EXAMPLES / "prometheus.yml").read_text("utf-8")
        config = config.replace("127.0.0.1:9464", f"127.0.0.1:{self.port}").replace("5s", "1s")
        config += "  \n"
        config = config.replace("global:\n", "global:\n  evaluation_interval: 1s\n")
        (folder / "prometheus.yml").write_text(config, encoding="utf-8")
        shutil.copy(EXAMPLES / "alerts.yml", folder)
        Running(self, ["prometheus", f"--config.file={folder / 'prometheus.yml'}", f"--storage.tsdb.path={folder / 'data'}",
                       f"--web.listen-address=127.0.0.1:{port}", "--log.level=error"])

        def ask(path):
            try:
                answer, body = get(port, path)
            except OSError:
                return []
            return json.loads(body)["data"] if answer.status == 200 else []

        query = "/api/v1/query?query=" + urllib.parse.quote(f'cie_callback_late_total{{callback="{TIMER}"}}')
        result = wait_for(lambda: (ask(query) or {"result": []})["result"], "a scrape")
        self.assertEqual(result[0]["metric"]["job"], "cie")
        self.assertGreater(float(result[0]["value"][1]), 0)
        names = {"CieDeadlineMissed", "CieRuleViolated"}
        wait_for(lambda: names <= {a["labels"]["alertname"] for a in (ask("/api/v1/alerts") or {"alerts": []})["alerts"]},
                 "the alerts")

    def test_the_examples_use_metrics_that_there_are(self):
        known = set(re.findall(r"^# TYPE (\S+)", self.metrics(), re.MULTILINE))
        known |= {name + suffix for name in known for suffix in ("_bucket", "_sum", "_count")}
        for file in ("alerts.yml", "dashboard.json"):
            used = set(re.findall(r"\bcie_[a-z_]+", (EXAMPLES / file).read_text("utf-8")))
            self.assertGreater(len(used), 5)
            self.assertEqual(used - known, set(), file)
        board = json.loads((EXAMPLES / "dashboard.json").read_text("utf-8"))
        self.assertEqual(len({panel["id"] for panel in board["panels"]}), len(board["panels"]))

    def test_the_documentation_names_every_metric(self):
        text = (EXAMPLES.parent / "README.md").read_text("utf-8")
        documented = set(re.findall(r"`(cie_\w+)`", text))
        wait_for(lambda: "cie_live_delay_seconds" in self.metrics(), "the first instance")
        self.assertEqual(set(re.findall(r"^# TYPE (\S+)", self.metrics(), re.MULTILINE)),
                         documented - {"cie_live_host_up"}, "that one is of several sessions")

    def test_the_alerts_do_what_they_say(self):
        if shutil.which("promtool") is None:
            self.skipTest("promtool (Debian package prometheus) is not installed")
        for command in (("check", "rules", "alerts.yml"), ("check", "config", "prometheus.yml"),
                        ("test", "rules", "alerts_test.yml")):
            done = subprocess.run(["promtool", *command], cwd=EXAMPLES, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_the_page_follows_the_system(self):
        with Chromium() as browser:
            url = f"http://127.0.0.1:{self.port}/"
            browser.open(url)
            names = "[...document.querySelectorAll('#callbacks tbody td:first-child')].map(cell => cell.textContent)"
            wait_for(lambda: set(browser.evaluate(names)) == {SHORT_TIMER, SHORT_SUBSCRIPTION}, "the callbacks")
            wait_for(lambda: browser.evaluate("document.getElementById('verdict').textContent") == "\u2717 FAIL", "the verdict")
            wait_for(lambda: "M2" in browser.evaluate("document.getElementById('violations').textContent"), "the violation")
            wait_for(lambda: browser.evaluate("document.querySelector('#reasons li').textContent").startswith("\u2717M2 "), "the reason")
            self.assertLess(browser.evaluate("document.getElementById('reasons').getBoundingClientRect().bottom"), 500, "above the fold")
            self.assertIn("--until-signal", browser.evaluate("document.getElementById('source').textContent"))
            curves = "[...document.querySelectorAll('svg.curve polyline')].map(p => p.getAttribute('points').split(' ').length)"
            wait_for(lambda: all(n > 2 for n in browser.evaluate(curves)) and len(browser.evaluate(curves)) == 2, "curves over some seconds")
            events = "parseInt(document.getElementById('facts').textContent)"
            before = browser.evaluate(events)
            wait_for(lambda: browser.evaluate(events) > before, "the next snapshot")
            browser.evaluate("document.getElementById('pause').click()")
            paused = browser.evaluate(events)
            browser.evaluate("new Promise(done => setTimeout(done, 600))")
            self.assertEqual(browser.evaluate(events), paused)
            browser.evaluate("document.getElementById('pause').click()")
            browser.evaluate("const f = document.getElementById('filter'); f.value = 'timer'; f.dispatchEvent(new Event('input'))")
            self.assertEqual(browser.evaluate(names), [SHORT_TIMER])
            browser.evaluate("document.querySelector('#callbacks tbody tr').click()")
            rows = "document.querySelectorAll('#detail tbody tr').length"
            wait_for(lambda: browser.evaluate(rows) > 10, "instances")
            late = "document.querySelectorAll('#detail td.bad').length"
            wait_for(lambda: browser.evaluate(late) > 10, "late ones")
            ours = {url + name for name in ("", "live.css", "live.js", "events")}
            self.assertLessEqual({r for r in browser.requests() if not r.startswith("data:")}, ours)
            self.assertEqual(browser.troubles(), [])

    def test_the_page_is_readable_in_the_dark_and_on_a_small_screen(self):
        with Chromium(width=400, height=800, scheme="dark") as browser:
            browser.open(f"http://127.0.0.1:{self.port}/")
            self.assertEqual(browser.evaluate("getComputedStyle(document.body).backgroundColor"), "rgb(20, 23, 26)")
            self.assertLessEqual(browser.evaluate("document.documentElement.scrollWidth"), 400)

    def test_events_come_as_lines_of_the_schema(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=support.PATIENCE)
        self.addCleanup(connection.close)
        connection.request("GET", "/events")
        answer = connection.getresponse()
        self.assertEqual(answer.headers["Content-Type"], "text/event-stream")
        numbers = []
        while len(numbers) < 3:
            line = answer.readline()
            if line.startswith(b"data: "):
                snapshot = json.loads(line[6:])
                self.assertEqual(snapshot["schema"], "cie.live/1")
                numbers.append(snapshot["sequence"])
        self.assertEqual(numbers, sorted(set(numbers)))
        self.assertIn(b'"schema":"cie.live/1"', get(self.port, "/snapshot.json")[1])

    def test_who_is_served_what(self):
        for path in ("/etc/passwd", "/../x", "/live.html", "/metrics/"):
            self.assertEqual(get(self.port, path)[0].status, 404, path)
        for host in ("example.org", f"example.org:{self.port}"):
            self.assertEqual(get(self.port, "/snapshot.json", Host=host)[0].status, 403, host)
        answer, _ = get(self.port, "/", Origin="https://example.org")
        self.assertNotIn("Access-Control-Allow-Origin", answer.headers)
        self.assertIn("default-src 'none'", answer.headers["Content-Security-Policy"])
        with open("/proc/net/tcp", encoding="ascii") as table:
            places = {line.split()[1] for line in table if line.split()[1].endswith(f":{self.port:04X}")}
        self.assertIn(f"0100007F:{self.port:04X}", places)
        self.assertNotIn(f"00000000:{self.port:04X}", places)

    def test_what_is_open_to_others_is_said(self):
        with subprocess.Popen([CIE, "live", "--listen", "0.0.0.0:0", "--", "sleep", "60"], stdin=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True) as program:
            try:
                port = int(re.search(r"http://0\.0\.0\.0:(\d+)/", program.stderr.readline())[1])
                warning = program.stderr.readline() + program.stderr.readline() + program.stderr.readline()
                self.assertIn("warning", warning)
                for word in ("everybody", "names", "response times", "verdicts", "password", "not encrypted"):
                    self.assertIn(word, warning.lower())
                self.assertEqual(get(port, "/metrics", Host="robot.example:80")[0].status, 200, "any name leads here")
            finally:
                program.send_signal(signal.SIGTERM)

    def test_a_taken_port_and_a_foreign_address(self):
        for place in (str(self.port), "192.0.2.1:0"):
            done = support.live("--listen", place, "--batch", "--", "sleep", "1")
            self.assertEqual(done.returncode, 4)
            self.assertIn("cannot listen on port", done.stderr)

    def test_readers_that_do_not_read_hold_nothing_up(self):
        idle = []
        for _ in range(20):  # more than may follow at once
            connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=support.PATIENCE)
            self.addCleanup(connection.close)
            connection.request("GET", "/events")
            idle.append(connection)
        statuses = [connection.getresponse().status for connection in idle]
        self.assertEqual(set(statuses), {200, 503})
        before = self.value("cie_live_snapshots_total")
        wait_for(lambda: self.value("cie_live_snapshots_total") > before + 2, "snapshots")


if __name__ == "__main__":
    support.main("live-server")
