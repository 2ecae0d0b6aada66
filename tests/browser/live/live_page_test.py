#!/usr/bin/env python3
"""What the page of `cie live` shows of the snapshots (cie.live/1) that it is sent, in a real Chromium.
Arguments: FOLDER_OF_THE_PAGE SCRIPT, as the program has it."""
import http.server
import json
import queue
import sys
import threading
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from chromium import Chromium  # noqa: E402  pylint: disable=wrong-import-position

PAGE, SCRIPT = (Path(argument).resolve() for argument in sys.argv[1:3])

SECOND = 10**9
BEGIN = 1_700_000_000 * SECOND  # of CLOCK_REALTIME, the first of a page's samples


def summary(*values):
    return {"count": len(values), "min": min(values), "max": max(values), "sum": sum(values),
            "mean": sum(values) / len(values), "p50": sorted(values)[len(values) // 2], "p90": max(values),
            "p99": max(values), "p99_9": max(values)}


def instance(seq, response_ns, **changes):
    return {"seq": seq, "tid": 101, "cpu": 1, "start_ns": 0, "end_ns": response_ns, "response_ns": response_ns,
            "exact": True, "late": False, "missed": 0, "execution_ns": None, **changes}


def callback(index, name, window=(1000,), **changes):
    total = {"instances": len(window), "late": 0, "missed_releases": 0, "missed_too_many": False,
             "response_time_ns": summary(*window), "response_time_counts": None, "response_time_sum_ns": sum(window)}
    total.update(changes.pop("total", {}))
    return {"index": index, "host": "here", "pid": 100, "logical_id": f"/node@{name}", "name": name, "kind": "timer",
            "tids": [101], "isolated": True, "isolation": "isolated", "ended": False, "deadline_ns": 5000,
            "deadline_of_spec": True, "period_ns": None, "exact": True,
            "window": {"instances": len(window), "late": 0, "missed_releases": 0, "response_time_ns": summary(*window)},
            "total": total, "open": {"longest_ns": None, "late": 0, "long": False, "certain": False}, "last_response_ns": window[-1], "last_end_ns": 0, "recent": [], **changes}


def thread(name, **changes):
    return {"index": 0, "host": "here", "pid": 100, "tid": 101, "name": name, "role": "callback", "callbacks": [],
            "cpu_percent": None, **changes}


def verdict(rule, name, **changes):
    return {"rule": rule, "name": name, "subject": "s", "kind": "callback", "index": 0, "verdict": "FAIL",
            "since_ns": 0, "note": "", "says": f"evidence of {rule}", **changes}


def change(number):
    return {"time_ns": 0, "rule": "R3", "name": "deadline", "subject": "s", "kind": "callback", "index": 0,
            "from": "PASS", "to": "FAIL", "note": "", "says": f"change {number}"}


def snapshot(callbacks, at=BEGIN, **changes):
    return {"schema": "cie.live/1", "sequence": 1, "hosts": [], "time_ns": 0, "realtime_ns": at, "window_ns": 10 * SECOND,
            "source": {"url": "net://localhost/host/here/session", "watched": "", "state": "streaming", "message": ""},
            "events": 1, "events_per_second": 0.0, "delay_ns": None, "lost_events": 0, "lost_packets": 0, "defects": [],
            "callbacks": callbacks, "threads": [], "verdict": "PASS", "violations": [], "verdicts": [],
            "verdicts_left_out": 0, "changes": [], **changes}


class Server(http.server.ThreadingHTTPServer):
    """Serves the page, and on /events what it is given."""
    daemon_threads = True

    def __init__(self, files):
        self.files = files
        self.lines = queue.Queue()
        super().__init__(("127.0.0.1", 0), Handler)


class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):  # pylint: disable=invalid-name
        if self.path == "/events":
            self.stream()
            return
        kind, body = self.server.files.get(self.path, ("text/plain", None))
        self.send_response(404 if body is None else 200)
        self.send_header("Content-Type", kind)
        self.end_headers()
        self.wfile.write(body or b"")

    def stream(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.end_headers()
        while (line := self.server.lines.get()) is not None:
            self.wfile.write(f"data: {line}\n\n".encode())
            self.wfile.flush()

    def log_message(self, format, *args):  # pylint: disable=redefined-builtin
        pass


class LivePage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.files = {"/": ("text/html", (PAGE / "live.html").read_bytes()),
                     "/live.css": ("text/css", (PAGE / "live.css").read_bytes()),
                     "/live.js": ("text/javascript", SCRIPT.read_bytes())}
        cls.browser = Chromium()
        cls.addClassCleanup(cls.browser.__exit__)

    def setUp(self):
        self.server = Server(self.files)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.server.lines.put, None)
        self.sent = 0
        self.browser.events.clear()

    def open(self, first):
        self.server.lines.put(json.dumps(first))
        self.browser.open(f"http://127.0.0.1:{self.server.server_port}/")

    def send(self, following):
        """Shown as soon as its number of events is."""
        self.sent += 1
        self.server.lines.put(json.dumps({**following, "events": 1000 + self.sent}))
        self.wait("#facts", f"{1000 + self.sent} events")

    def wait(self, selector, text):
        for _ in range(2000):
            if text in "\n".join(self.see(selector)):
                return
            time.sleep(0.01)
        self.fail(f"{selector} does not say {text}: {self.see(selector)}")

    def see(self, selector):
        return self.browser.evaluate(f"[...document.querySelectorAll({json.dumps(selector)})].map(n => n.textContent)")

    def do(self, script):
        self.browser.evaluate(f"void ({script})")

    def click(self, selector, text):
        self.do(f"[...document.querySelectorAll({json.dumps(selector)})].find(n => n.textContent === {json.dumps(text)}).click()")

    def names(self):
        return self.see("#callbacks tbody td:first-child")

    def row(self, name):
        """The cells of a callback by their headers."""
        cells = self.browser.evaluate(f"""[...[...document.querySelectorAll("#callbacks tbody tr")].find(row =>
            row.cells[0].textContent === {json.dumps(name)}).cells].map(c => [c.textContent, c.className])""")
        return dict(zip(self.see("#callbacks th"), cells))

    def test_the_slowest_is_first_and_any_column_sorts(self):
        self.open(snapshot([callback(0, "b", (10_000,)), callback(1, "a", (30_000,)), callback(2, "c", (20_000,))]))
        self.assertEqual(self.names(), ["a", "c", "b"])
        self.assertEqual(self.browser.evaluate(
            "[...document.querySelectorAll('#callbacks th[aria-sort]')].map(h => [h.textContent, h.ariaSort])"),
            [["p99", "descending"]])
        self.click("#callbacks th button", "callback")
        self.assertEqual(self.names(), ["a", "b", "c"])
        self.click("#callbacks th button", "callback")
        self.assertEqual(self.names(), ["c", "b", "a"])
        self.send(snapshot([callback(0, "b"), callback(3, "d")]))
        self.assertEqual(self.names(), ["d", "b"], "as it was sorted")

    def test_an_instance_that_does_not_end_is_told(self):
        hanging = {"longest_ns": 4_900_000_000, "late": 1, "long": True, "certain": True}
        self.open(snapshot([callback(0, "hanging", open=hanging),
                            callback(1, "unseen", open={**hanging, "late": 0, "certain": False}),
                            callback(2, "busy", open={**hanging, "late": 0, "long": False})]))
        self.assertEqual(self.row("hanging")["last"], ["\u2717 >4.900\u202fs", "bad"])
        self.assertEqual(self.row("unseen")["last"], [">4.900\u202fs", ""])
        self.assertEqual(self.row("busy")["last"], ["1.000\u202fus", ""])
        self.assertEqual(self.see("#message"), ["hanging has not ended for 4.900\u202fs; "
                                                "unseen began 4.900\u202fs ago, and its end was not seen"])

    def test_what_the_spec_forbids_is_marked(self):
        self.open(snapshot([
            callback(0, "late", total={"late": 3}),
            callback(1, "missed", total={"missed_releases": 2}),
            callback(2, "too_many", total={"missed_releases": 4, "missed_too_many": True}),
            callback(3, "free", deadline_ns=None, total={"missed_releases": None}),
        ]))
        self.assertEqual(self.row("late")["late"], ["\u2717 3", "bad"])
        self.assertEqual(self.row("missed")["missed"], ["2", ""])
        self.assertEqual(self.row("too_many")["missed"], ["\u2717 4", "bad"])
        self.assertEqual([self.row("free")[column] for column in ("deadline", "late", "missed")], [["-", ""]] * 3)

    def test_bounds_are_told_from_times(self):
        self.open(snapshot([callback(0, "known", (2000,)), callback(1, "bound", (2000,), exact=False)]))
        known, bound = self.row("known"), self.row("bound")
        for column in ("p50", "p99", "max", "last"):
            self.assertEqual(bound[column][0], ">" + known[column][0], column)
        self.assertEqual(bound["deadline"], known["deadline"])

    def test_a_callback_is_found_by_name_host_and_pid(self):
        hosts = [{"host": h, "session": "s", "state": "streaming", "silent_ns": 0, "message": ""} for h in ("east", "west")]
        self.open(snapshot([callback(0, "x", host="east", pid=41), callback(1, "y", host="west", pid=52)], hosts=hosts,
                           threads=[thread("cb0", host="west", callbacks=["/node@y"], pid=52)]))
        for text, found in (("WEST", ["y"]), ("41", ["x"]), ("node@", ["x", "y"]), ("z", [])):
            self.do(f"(f => {{ f.value = {json.dumps(text)}; f.dispatchEvent(new Event('input')); }})(document.getElementById('filter'))")
            self.assertEqual(sorted(self.names()), found, text)
        self.assertEqual(self.see("#threads tbody td"), ["west cb0", "52", "101", "-", "y"])

    def test_a_machine_in_trouble_is_named(self):
        hosts = [{"host": "east", "session": "s", "state": "streaming", "silent_ns": 0, "message": ""},
                 {"host": "west", "session": "s", "state": "silent", "silent_ns": 7 * SECOND, "message": ""}]
        self.open(snapshot([], hosts=hosts))
        self.assertEqual(self.see("#message"), ["west: silent for 7.000\u202fs"])

    def test_three_violated_rules_lead(self):
        rules = [("M2", "one-callback-per-thread"), ("M3", "one-thread-per-callback"), ("R3", "deadline"),
                 ("R4", "budget"), ("S1", "parameters-as-specified")]
        self.open(snapshot([], verdict="FAIL",
                           violations=[{"rule": r, "name": n, "subjects": 2 if r == "M2" else 1} for r, n in rules],
                           verdicts=[verdict(r, n) for r, n in rules if r != "R3"]))  # the list is cut
        self.assertEqual(self.see("#verdict"), ["\u2717 FAIL"])
        self.assertEqual(self.see("#reasons li"), [
            "\u2717M2 one-callback-per-thread (2 subjects): evidence of M2",
            "\u2717M3 one-thread-per-callback: evidence of M3", "\u2717R3 deadline", "and 2 more rules"])
        self.assertEqual(self.see("#violations li")[-1], "\u2717S1 parameters-as-specified, evidence of S1")
        self.send(snapshot([]))
        self.assertEqual(self.see("#violations li"), ["none"])
        self.assertTrue(self.browser.evaluate("document.getElementById('reasons').hidden"))

    def test_changed_verdicts_stay_the_latest_first(self):
        self.open(snapshot([], changes=[change(n) for n in range(150)]))
        self.send(snapshot([], changes=[change(n) for n in range(150, 260)]))
        shown = self.see("#changes tbody td:nth-child(3)")
        self.assertEqual(shown, [f"change {n}" for n in reversed(range(60, 260))])

    def test_a_row_opens_with_the_keyboard_and_keeps_the_focus(self):
        first = callback(4, "x", recent=[instance(1, 1000), instance(2, 9000, late=True, execution_ns=2000)])
        self.open(snapshot([callback(3, "other"), first]))
        self.assertTrue(self.browser.evaluate("document.getElementById('detail').hidden"))
        self.do("""(row => { row.focus(); row.dispatchEvent(new KeyboardEvent("keydown", {key: "Enter"})); })(
            document.querySelector("#callbacks tr[data-index='4']"))""")
        self.send(snapshot([callback(3, "other"), callback(4, "x", recent=[instance(3, 1500, exact=False, cpu=None)])]))
        self.assertEqual(self.see("#detail tbody td:first-child"), ["3", "2", "1"], "the latest first")
        self.assertEqual(self.see("#detail td.bad"), ["\u2717 9.000\u202fus"])
        self.assertEqual(self.see("#detail tbody tr:first-child td")[2:5], ["-", ">1.500\u202fus", "-"])
        self.assertEqual(self.browser.evaluate("document.activeElement.dataset.index"), "4")

    def test_a_pause_hides_nothing_for_good(self):
        self.open(snapshot([callback(0, "x", recent=[instance(1, 1000)])]))
        self.do("document.querySelector('#callbacks tbody tr').click()")
        self.do("document.getElementById('pause').click()")
        self.assertEqual(self.see("#pause"), ["Go on"])
        self.server.lines.put(json.dumps(snapshot([callback(0, "x", recent=[instance(2, 1000)])])))
        time.sleep(0.3)  # nothing tells that it came
        self.assertEqual(self.see("#detail tbody td:first-child"), ["1"])
        self.do("document.getElementById('pause').click()")
        self.send(snapshot([callback(0, "x", recent=[instance(3, 1000)])]))
        self.assertEqual(self.see("#detail tbody td:first-child"), ["3", "2", "1"])

    def test_a_curve_has_the_longest_of_each_two_seconds(self):
        def at(second, *responses):
            recent = [instance(n, r) for n, r in enumerate(responses)]
            return snapshot([callback(0, "x", recent=recent, deadline_ns=8000)], at=BEGIN + second * SECOND)
        self.open(at(0, 1000, 8000))
        self.send(at(1, 4000))  # of the same sample, and no more
        self.send(at(2, 4000))
        self.send(at(4, 2000))
        points = self.browser.evaluate("document.querySelector('polyline').getAttribute('points')").split()
        # 120 wide, 22 high, one pixel free above and below.
        self.assertEqual(points, ["0.0,1.0", "60.0,11.0", "120.0,16.0"])
        self.assertEqual(self.browser.evaluate("document.querySelector('line.mark').getAttribute('y1')"), "1")

    def test_names_are_text(self):
        name = "<img src=x onerror=alert(1)>"
        self.open(snapshot([callback(0, name)], threads=[thread(name)], changes=[change(name)], verdict="FAIL",
                           verdicts=[verdict("R3", "deadline", says=name)]))
        self.assertEqual(self.names(), [name])
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('img').length"), 0)
        self.assertEqual(self.browser.troubles(), [])

    def test_a_server_that_is_gone_is_told(self):
        self.open(snapshot([callback(0, "x")]))
        self.assertEqual(self.see("#message"), [""])
        self.server.shutdown()
        self.server.socket.close()
        self.server.lines.put(None)
        self.wait("#message", "The connection to cie live is lost; trying again.")
        self.assertEqual(self.names(), ["x"], "what is known stays")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
