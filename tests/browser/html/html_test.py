#!/usr/bin/env python3
"""The HTML report in a real Chromium. Arguments: CIE EXAMPLES."""
import base64
import csv
import gzip
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from chromium import Chromium  # noqa: E402  pylint: disable=wrong-import-position
from other_host import on_host  # noqa: E402  pylint: disable=wrong-import-position

CIE = os.path.abspath(sys.argv[1])
EXAMPLES = Path(sys.argv[2]).resolve()
NAMES = ("isolated_ok", "multi_threaded_fails")
SIZES = ((1280, 900), (390, 844))

TEXTS = """[...document.querySelectorAll(%s)].map(node => node.textContent)"""
# Contrast of text on the page's ground, by WCAG 2.1 (relative luminance, section 1.4.3).
CONTRAST = """(() => {
  const rgb = colour => { const g = document.createElement("canvas").getContext("2d"); g.fillStyle = colour; g.fillRect(0, 0, 1, 1); return [...g.getImageData(0, 0, 1, 1).data]; };
  const luminance = colour => { const [r, g, b] = rgb(colour).map(v => { v /= 255; return v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4; }); return .2126 * r + .7152 * g + .0722 * b; };
  const ground = node => { for (; node; node = node.parentElement) { const c = getComputedStyle(node).backgroundColor; if (rgb(c)[3] === 255) return c; } return "#fff"; };
  const found = {};
  for (const node of document.querySelectorAll("h1, h2, h3, p, li, td, th, a, button, code, summary, caption, .verdict, .sign, .key span")) {
    const a = luminance(getComputedStyle(node).color), b = luminance(ground(node));
    found[node.tagName + "." + node.className] = (Math.max(a, b) + .05) / (Math.min(a, b) + .05);
  }
  return found;
})()"""
# Of what is drawn, section 1.4.11.
SHAPES = """(() => {
  const style = getComputedStyle(document.documentElement), g = document.createElement("canvas").getContext("2d");
  const luminance = name => { g.fillStyle = style.getPropertyValue("--" + name).trim(); g.fillRect(0, 0, 1, 1);
    const [r, g2, b] = [...g.getImageData(0, 0, 1, 1).data].map(v => { v /= 255; return v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4; });
    return .2126 * r + .7152 * g2 + .0722 * b; };
  const ground = luminance("paper");
  return Object.fromEntries(["run", "wait", "preempted", "blocked", "wake", "mark", "fail", "soft"].map(name => {
    const own = luminance(name); return [name, (Math.max(own, ground) + .05) / (Math.min(own, ground) + .05)]; }));
})()"""
# What an assistive program needs: pictures and fields with names, tables with headers.
NAMELESS = """[...document.querySelectorAll("svg[role=img], canvas, input, button, [role=region], .scroll")].filter(node =>
  !(node.getAttribute("aria-label") || node.getAttribute("aria-labelledby") && document.getElementById(node.getAttribute("aria-labelledby")) || node.textContent.trim()))
  .map(node => node.outerHTML.slice(0, 80))
  .concat([...document.querySelectorAll("table")].filter(t => !t.querySelector("th[scope=col]")).map(t => t.id))"""


def cie(*arguments, code=0):
    done = subprocess.run([CIE, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, timeout=200, check=False)
    assert (done.returncode, done.stderr) == (code, b""), done.stderr
    return done.stdout.decode()


DOCUMENT = re.compile(r'(<script type="application/json" id="document">)(.*?)(</script>)', re.S)


def document_of(html):
    """What the page draws."""
    return json.loads(DOCUMENT.search(html)[2])


def named(document):
    """Callbacks with their short names."""
    return zip(document["report"]["callbacks"], document["names"]["callbacks"], strict=True)


def columns_of(html):
    """The timeline's rows, decoded without the page's own script."""
    document = document_of(html)
    lanes = document["timeline"]
    packed = iter(gzip.decompress(base64.b64decode(lanes["columns"])))

    def number():
        value = shift = 0
        while True:
            byte = next(packed)
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def signed(value):
        return -(value + 1) // 2 if value % 2 else value // 2

    def optional():
        value = number()
        return None if value == 0 else signed(value - 1)

    callbacks = document["report"]["callbacks"]
    for lane in lanes["lanes"]:
        n, at, starts = lane["count"], lanes["base_ns"], []
        for _ in range(n):
            at += signed(number())
            starts.append(at)
        wait, duration, execution, preempted, blocked, wake = ([optional() for _ in range(n)] for _ in range(6))
        seq, numbers = 0, []
        for _ in range(n):
            seq += signed(number())
            numbers.append(seq)
        places = [number() for _ in range(n)]
        for i in range(n):
            of = callbacks[lane["callback"]]
            yield {"logical_id": of["logical_id"], "pid": of["pid"], "tid": lane["tids"][places[i] >> 1],
                   "seq": numbers[i], "start_ns": starts[i],
                   "release_ns": None if wait[i] is None else starts[i] - wait[i],
                   "end_ns": None if duration[i] is None else starts[i] + duration[i], "execution_ns": execution[i],
                   "preempted_ns": preempted[i], "blocked_ns": blocked[i], "wake_delay_ns": wake[i]}
    assert next(packed, None) is None


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.browser = Chromium()
        cls.addClassCleanup(cls.browser.__exit__)

    def page(self, trace, *options):
        path = self.folder / "page.html"
        cie("report", trace, "--format", "html", "-o", path, *options)
        self.browser.events.clear()
        self.browser.open(path.as_uri() + f"?{self.id()}")
        self.assertEqual(self.browser.troubles(), [])
        self.assertEqual(self.browser.requests(), [path.as_uri() + f"?{self.id()}"], "it asked for something")
        return path.read_text(encoding="utf-8")

    def see(self, selector):
        return self.browser.evaluate(TEXTS % json.dumps(selector))

    def do(self, script):
        return self.browser.evaluate(f"void ({script})")

    def shown(self, change, of="report"):
        """The page of an example whose data `change` changed: its report, or the whole document."""
        path = self.folder / "changed.html"
        cie("report", EXAMPLES / "isolated_ok" / "trace", "--format", "html", "-o", path)
        html = path.read_text(encoding="utf-8")
        document = document_of(html)
        self.names = document["names"]["callbacks"]
        change(document[of] if of else document)
        text = json.dumps(document).replace("<", "\\u003c")
        path.write_text(DOCUMENT.sub(lambda found: found[1] + text + found[3], html), encoding="utf-8")
        self.browser.events.clear()
        self.browser.open(path.as_uri() + f"?{self.id()}")
        self.assertEqual(self.browser.troubles(), [])
        return document["report"]

    def rows(self):
        """Of the callbacks' table, by what the first cell's tip says, cells by their headers: [text, exact number]."""
        headers = self.see("#callback-table th")
        rows = self.browser.evaluate("""[...document.querySelectorAll("#callback-table tbody tr")].map(row =>
            [row.querySelector("button").title, [...row.cells].map(cell => [cell.textContent, cell.dataset.ns ?? null])])""")
        found = {name: dict(zip(headers, cells)) for name, cells in rows}
        self.assertEqual(len(found), len(rows), "names that are told apart")
        return found


class Contents(Page):
    def test_are_those_of_the_json_report(self):
        for name in NAMES:
            with self.subTest(name):
                trace = EXAMPLES / name / "trace"
                self.page(trace)
                report = json.loads(cie("report", trace, "--format", "json"))
                keys = {"response p50": "p50", "response p99": "p99", "response max": "max"}
                rows = self.rows()
                self.assertEqual(len(rows), len(report["callbacks"]))
                several = len(report["processes"]) > 1
                by_title = {c["logical_id"] + (f" (pid {c['pid']})" if several else ""): c for c in report["callbacks"]}
                for full_name, cells in rows.items():
                    callback = by_title.pop(full_name)
                    self.assertEqual(cells["runs"][0].replace("\u202f", ""), str(callback["instances"]))
                    self.assertEqual(cells["isolated"][0].endswith("yes"), callback["isolated"])
                    for header, key in keys.items():
                        told = callback["response_time_ns"]
                        self.assertEqual(cells[header][1], None if told is None else str(told[key]), header)

    def test_names_are_short_and_ids_are_their_tips(self):
        self.page(EXAMPLES / "multi_threaded_fails" / "trace")
        ids = {"/a/plan@Timer(20000000)": "plan timer 20 ms"}
        self.assertEqual({name: cells["callback"][0] for name, cells in self.rows().items() if name in ids}, ids)
        self.assertEqual(sorted(cells["callback"][0] for cells in self.rows().values()),
                         ["drive \u2190 /t1", "drive \u21d0 /srv", "fast client /srv", "fast timer 10 ms", "plan timer 20 ms",
                          "slow timer 20 ms", "track \u2190 /t0", "track \u2190 /t0 #2"])
        evidence = self.see("#rules ~ details p, #rules ~ details li")
        self.assertTrue(evidence)
        self.assertEqual([text for text in evidence if "@Timer" in text], [])

    def test_verdict_and_rules_are_the_verifiers(self):
        for name, code in zip(NAMES, (0, 1)):
            with self.subTest(name):
                self.page(EXAMPLES / name / "trace", "--expect", "isolated")
                verdicts = json.loads(cie("verify", EXAMPLES / name / "trace", "--format", "json", code=code))
                self.assertEqual(self.see("#verdict")[0].split()[-1], verdicts["verdict"])
                signs = {"PASS": "\u2713", "FAIL": "\u2717", "INCONCLUSIVE": "?", "NOT_APPLICABLE": "\u2013"}
                self.assertEqual(sorted(self.see(".chips li")),
                                 sorted(f"{signs[r['verdict']]} {r['id']} {r['name']}" for r in verdicts["rules"]))

    def test_bars_of_the_histogram_end_with_the_longest_run(self):
        def change(document):
            for i, callback in enumerate(document["report"]["callbacks"]):
                callback["response_time_ns"].update({key: 5_001_000 for key in ("min", "max", "p50", "p99")}, count=90)
                document["histograms"][i] = [[5_013_504, 90]]  # the middle of its bucket, beyond them all
        self.shown(change, of=None)
        self.assertEqual(self.see(".detail svg rect.f-run > title")[:1], ["5.001\u202fms: 90 runs"])

    def test_a_lost_end_is_no_run_that_never_ended(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")
        told = self.browser.evaluate("""(() => {
            const lane = cie.lanes.lanes.find(l => l.count > 4);
            return [1, lane.count - 1].map(i => {
                const duration = lane.duration[i];
                lane.duration[i] = Number.NaN;
                cie.findLimits(lane);
                cie.timeline.tell(lane, i);
                lane.duration[i] = duration;
                return [document.querySelector(".tip").textContent, lane.start[i + 1] - lane.start[i]];
            });
        })()""")
        self.assertIn("; its end is not recorded; it took at most", told[0][0])
        self.assertIn("; nothing shows that it ended", told[1][0])

    def test_what_is_drawn_is_every_instance(self):
        for name in NAMES:
            html = self.page(EXAMPLES / name / "trace")
            rows = csv.DictReader(io.StringIO(cie("instances", EXAMPLES / name / "trace")))
            drawn = list(columns_of(html))
            keys = drawn[0].keys()
            expected = [tuple(row[key] for key in keys) for row in rows]
            self.assertEqual(sorted(tuple("" if row[key] is None else str(row[key]) for key in keys) for row in drawn),
                             sorted(expected))

    def test_histograms_count_every_response(self):
        for name in NAMES:
            document = document_of(self.page(EXAMPLES / name / "trace"))
            for callback, buckets in zip(document["report"]["callbacks"], document["histograms"], strict=True):
                told = callback["response_time_ns"]
                self.assertEqual(sum(runs for _, runs in buckets), told["count"] if told else 0)
                if told:  # a bucket's number is within 0.8 % of what it stands for
                    self.assertLess(abs(buckets[0][0] - told["min"]), 0.008 * told["min"] + 1)
                    self.assertLess(abs(buckets[-1][0] - told["max"]), 0.008 * told["max"] + 1)

    def test_first_lines_name_the_slowest_callback_and_what_is_violated(self):
        document = document_of(self.page(EXAMPLES / "multi_threaded_fails" / "trace", "--expect", "isolated"))
        worst = max(((c["response_time_ns"]["max"], name) for c, name in named(document) if c["response_time_ns"]))[1]
        short = " ".join(self.see("#short li"))
        self.assertIn("did not have a thread of their own", short)
        self.assertIn("Enforcement does not hold: 2 rules are violated: M2 one-callback-per-thread", short)
        self.assertIn("Slowest: " + worst, short)

    def test_another_one_than_the_slowest_is_told_as_the_worst_against_its_deadline(self):
        trace = EXAMPLES / "multi_threaded_fails" / "trace"
        responses = sorted((c["response_time_ns"]["max"], name, c["logical_id"])
                           for c, name in named(document_of(self.page(trace))) if c["response_time_ns"])
        _, name, identity = responses[0]  # the fastest is the only one with a deadline, and misses it
        spec = self.folder / "deadline.yaml"
        spec.write_text(f"callback_groups:\n  - id: \"{identity}\"\n    response_deadline: 1\n", encoding="utf-8")
        self.page(trace, "--spec", spec)
        short = " ".join(self.see("#short li"))
        self.assertIn("Worst against its deadline: " + name, short)
        self.assertNotIn("Slowest", short)

    def test_nobody_is_accused_of_what_nobody_claimed(self):
        trace = EXAMPLES / "multi_threaded_fails" / "trace"
        self.page(trace)
        self.assertEqual(self.see("h1"), ["callbacks share threads: 8 of 8"])
        self.assertEqual(self.see("#verdict, .head .fail, #short .fail"), [])
        self.assertIn("2 rules are violated: M2 one-callback-per-thread", " ".join(self.see("#short li")))
        self.page(trace, "--expect", "isolated")
        self.assertEqual(self.see("h1"), ["8 of 8 callbacks share threads"])
        self.assertEqual(self.see("#verdict"), ["\u2717 FAIL"])
        spec = self.folder / "deadline.yaml"  # whoever writes a spec claims it, too
        spec.write_text("callback_groups:\n  - id: /a/plan@Timer(20000000)\n    response_deadline: 1\n", encoding="utf-8")
        self.page(trace, "--spec", spec)
        self.assertEqual(self.see("#verdict"), ["\u2717 FAIL"])
        self.assertEqual(self.see("h1"), ["8 of 8 callbacks share threads"])

    def test_whom_a_run_waited_for_ran_on_its_thread_meanwhile(self):
        trace = EXAMPLES / "multi_threaded_fails" / "trace"
        self.page(trace)
        told = self.browser.evaluate("""cie.lanes.lanes.flatMap(l => [...Array(l.count).keys()].map(i =>
            [l.callbackReport.logical_id, l.seq[i], cie.waitedFor(l, i).map(([other, ns]) => [other.callbackReport.logical_id, ns])]))""")
        runs = [{k: v if k in ("logical_id", "release_source", "status", "host") else int(v or -1) for k, v in row.items()}
                for row in csv.DictReader(io.StringIO(cie("instances", trace)))]
        waiting = 0
        for logical_id, seq, others in told:
            run = next(r for r in runs if (r["logical_id"], r["seq"]) == (logical_id, seq))
            wanted = {}
            for other in runs:
                shared = min(other["end_ns"], run["start_ns"]) - max(other["start_ns"], run["release_ns"])
                if other is not run and other["tid"] == run["tid"] and shared > 0:
                    wanted[other["logical_id"]] = wanted.get(other["logical_id"], 0) + shared
            self.assertEqual(dict(others), wanted)
            self.assertEqual([ns for _, ns in others], sorted(wanted.values(), reverse=True))
            waiting += bool(others)
        self.assertGreater(waiting, 0)

    def test_the_graph_is_that_of_the_edges(self):
        trace = EXAMPLES / "multi_threaded_fails" / "trace"
        self.page(trace)
        edges = [e for e in csv.DictReader(io.StringIO(cie("export", trace, "--to", "csv", "--table", "edges")))
                 if e["from_logical_id"]]
        self.assertTrue(edges)
        drawn = self.see("#chains ~ .scroll path > title")
        self.assertEqual(sorted(text.split(":")[0] for text in drawn),
                         sorted(f"{e['from_logical_id']} to {e['to_logical_id']} by {e['topic']}" for e in edges))

    def test_deadlines_of_the_spec_are_marked(self):
        spec = self.folder / "spec.yaml"
        trace = EXAMPLES / "isolated_ok" / "trace"
        report = document_of(self.page(trace))["report"]
        worst = max((c for c in report["callbacks"] if c["response_time_ns"]), key=lambda c: c["response_time_ns"]["max"])
        deadline = worst["response_time_ns"]["max"] - 1
        spec.write_text(f"callback_groups:\n  - id: \"{worst['logical_id']}\"\n    response_deadline: {deadline}\n",
                        encoding="utf-8")
        self.page(trace, "--spec", spec)
        self.assertIn("beyond its deadline", " ".join(self.see("#short li")))
        self.assertEqual(self.browser.evaluate("document.querySelector('.detail h3').title").split(" (pid")[0], worst["logical_id"])
        self.assertEqual(len(self.see(".detail svg .mark")), 1)


    def test_opens_on_the_worst_run_with_what_surrounds_it(self):
        trace = EXAMPLES / "isolated_ok" / "trace"
        self.page(trace)
        rows = list(csv.DictReader(io.StringIO(cie("instances", trace))))
        worst = max((r for r in rows if r["release_ns"]), key=lambda r: int(r["end_ns"]) - int(r["release_ns"]))
        begin, end = int(worst["release_ns"]), int(worst["end_ns"])
        seen = self.browser.evaluate("[cie.timeline.from + cie.lanes.base_ns, cie.timeline.to + cie.lanes.base_ns]")
        first = min(int(r["release_ns"] or r["start_ns"]) for r in rows)
        left = max(begin - (end - begin), first)
        self.assertEqual(seen, [left, left + 3 * (end - begin)])
        self.assertEqual(self.browser.evaluate("cie.fullName(cie.timeline.marked.lane.callbackReport)"), worst["logical_id"])
        self.assertIn(f"run #{worst['seq']} on thread {worst['tid']}", self.see(".tip")[0])
        self.assertEqual(self.browser.evaluate("scrollY"), 0, "the head is in sight")

    def test_opens_on_the_longest_run_where_no_release_is_known(self):
        def change(report):
            for callback in report["callbacks"]:
                lower = callback["response_time_ns"]
                callback.update(response_time_ns=None, response_time_lower_ns=lower, response_time_upper_ns=None)
        self.shown(change)
        self.do("""cie.lanes.lanes.forEach(lane => { lane.isExact = () => false; lane.response = () => NaN; })""")
        self.do("document.querySelector('#short button:last-of-type').click()")
        runs = self.browser.evaluate("""(() => { const {lane, i} = cie.timeline.marked; const least = k => lane.wait[k] + lane.duration[k];
            return [least(i), ...[...Array(lane.count).keys()].map(least)]; })()""")
        self.assertEqual(runs[0], max(runs[1:]))

    def test_rules_that_hold_are_folded_and_a_symbol_is_one_line(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")
        folded = self.browser.evaluate("[...document.querySelectorAll('#rules ~ details')].map(d => [d.open, d.querySelector('summary').textContent])")
        self.assertEqual([is_open for is_open, _ in folded], [False])
        self.assertRegex(folded[0][1], r"^\u2713 \d+ rules pass, \u2013 \d+ rules do not apply$")
        heights = self.browser.evaluate("""(() => { const [line] = document.querySelectorAll(".detail .line");
            return line ? [line.offsetHeight, parseFloat(getComputedStyle(line).fontSize)] : null; })()""")
        if heights:
            self.assertLess(heights[0], 2 * heights[1])

    def test_columns_of_the_matrix_have_the_threads_names(self):
        trace = EXAMPLES / "isolated_ok" / "trace"
        self.page(trace)
        report = json.loads(cie("report", trace, "--format", "json"))
        ran = {t["tid"] for c in report["callbacks"] for t in c["threads"]}
        self.assertEqual(sorted(self.see("#matrix ~ .scroll text.column > title")),
                         sorted(t["name"] for t in report["threads"] if t["tid"] in ran))

    def test_the_histogram_marks_quantiles_and_deadline_side_by_side(self):
        spec = self.folder / "marks.yaml"
        spec.write_text("callback_groups:\n" + "".join(f"  - id: \"{c}\"\n    response_deadline: 5000000\n" for c in
                                                       ("/a/plan@Timer(20000000)", "/b/drive@Subscription(/t1)")), encoding="utf-8")
        document = document_of(self.page(EXAMPLES / "isolated_ok" / "trace", "--spec", spec))
        drive = next(c for c in document["report"]["callbacks"] if c["logical_id"].startswith("/b/drive@Sub"))
        self.assertEqual(self.see(".detail h3"), ["drive \u2190 /t1"])
        boxes = self.browser.evaluate("""[...document.querySelectorAll(".detail svg text")].map(text => {
            const box = text.getBBox();
            return [text.textContent, box.x, box.y, box.width, box.height];
        })""")
        marks = [box for box in boxes if box[0].split()[0] in ("p50", "p99", "max", "deadline")]
        self.assertEqual({box[0].split()[0] for box in marks}, {"p50", "p99", "max", "deadline"})
        self.assertIn("deadline 5.000\u202fms", [box[0] for box in marks])
        self.assertTrue(drive["response_time_ns"])
        for i, (_, x, y, w, h) in enumerate(marks):
            for _, x2, y2, w2, h2 in marks[i + 1:]:
                self.assertFalse(x < x2 + w2 - 1 and x2 < x + w - 1 and y < y2 + h2 - 3 and y2 < y + h - 3, marks)


class TwoHosts(Page):
    """One application on two hosts, with the same names, pids, tids and ids."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hosts = [f"{name}-{host}" for name, host in zip(NAMES, ("left", "right"))]
        cls.traces = [on_host(EXAMPLES / name / "trace", host, cls.folder / host) for name, host in zip(NAMES, cls.hosts)]

    def pages(self):
        """The page of both, then what the reports of each alone say, by host."""
        path = self.folder / "both.html"
        cie("report", *self.traces, "--format", "html", "-o", path)
        self.browser.events.clear()
        self.browser.open(path.as_uri() + f"?{self.id()}")
        self.assertEqual(self.browser.troubles(), [])
        return {host: json.loads(cie("report", trace, "--format", "json")) for host, trace in zip(self.hosts, self.traces)}

    def test_every_row_and_lane_is_of_its_host(self):
        alone = self.pages()
        wanted = {f"{c['logical_id']} (pid {c['pid']} on {host})": c for host, report in alone.items() for c in report["callbacks"]}
        self.assertEqual(len(wanted), sum(len(report["callbacks"]) for report in alone.values()))
        rows = self.rows()
        self.assertEqual(sorted(rows), sorted(wanted))
        shown = [cells["callback"][0] for cells in rows.values()]
        self.assertEqual(len(set(shown)), len(shown), "short names that say the host")
        lanes = dict(self.browser.evaluate("cie.lanes.lanes.map(l => [cie.fullName(l.callbackReport), l.of])"))
        for name, cells in rows.items():
            callback = wanted[name]
            told = callback["response_time_ns"]
            self.assertEqual(cells["response max"][1], None if told is None else str(told["max"]), name)
            self.assertEqual(cells["isolated"][0].endswith("yes"), callback["isolated"], name)
            self.assertEqual(lanes.get(name, 0), callback["instances"] + callback["incomplete"], name)

    def test_lanes_of_both_are_on_one_clock(self):
        later = 5_000_000_000
        trace = EXAMPLES / "isolated_ok" / "trace"
        path = self.folder / "later.html"
        cie("report", on_host(trace, "now", self.folder / "now"), on_host(trace, "later", self.folder / "later", later),
            "--format", "html", "-o", path)
        self.browser.open(path.as_uri())
        starts = {}
        for name, start in self.browser.evaluate("cie.lanes.lanes.map(l => [cie.fullName(l.callbackReport), l.start[0]])"):
            name, host = name.rstrip(")").rsplit(" on ", 1)
            starts.setdefault(name, {})[host] = start
        self.assertGreater(len(starts), 4)
        for name, start in starts.items():
            self.assertEqual(start["later"] - start["now"], later, name)

    def test_marks_of_the_matrix_are_of_their_threads(self):
        alone = self.pages()
        for host, report in alone.items():
            marks = [text for text in self.see("#matrix ~ .scroll rect > title") if f" on {host}) on " in text]
            self.assertEqual(len(marks), sum(len(c["threads"]) for c in report["callbacks"]))
            self.assertEqual(sum(mark.endswith("not isolated") for mark in marks),
                             sum(len(c["threads"]) for c in report["callbacks"] if not c["isolated"]), host)

    def test_a_run_waits_for_none_of_the_other_host(self):
        self.pages()
        mixed = self.browser.evaluate("""cie.lanes.lanes.flatMap(l => [...Array(l.count).keys()].flatMap(i => cie.waitedFor(l, i)
            .filter(([other]) => other.callbackReport.host !== l.callbackReport.host)))""")
        self.assertEqual(mixed, [])

    def test_messages_and_threads_are_of_their_host(self):
        alone = self.pages()
        drawn = self.see("#chains ~ .scroll path > title")
        for host in alone:
            ours = [text for text in drawn if f"on {host})" in text]
            self.assertTrue(ours)
            self.assertEqual([text for text in ours if text.count(f" on {host})") != 2], [], "no message left its host")
            threads = self.browser.evaluate("""[...document.querySelectorAll("#threads ~ .scroll tbody tr")].map(row => row.cells[1].textContent)""")
            self.assertEqual(threads.count(host), len(alone[host]["threads"]))


class Isolation(Page):
    """Of two callbacks that ran and one that never did, and of releases that are not known."""

    def cells(self, header):
        return {name: cells[header][0] for name, cells in self.rows().items()}

    def test_what_never_ran_is_not_accused(self):
        def change(report):
            for callback in report["callbacks"][:2]:
                callback.update(isolated=False, isolation="never_ran", instances=0, threads=[], response_time_ns=None)
        report = self.shown(change)
        others = len(report["callbacks"]) - 2
        self.assertIn(f"\u2713All {others} callbacks that ran had a thread of their own; 2 never ran.", self.see("#short li"))
        shown = self.cells("isolated")
        for callback in report["callbacks"]:
            self.assertEqual(shown[callback["logical_id"]], "\u2713 yes" if callback["isolated"] else "\u2013 never ran")

    def test_what_shares_is_counted_among_those_that_ran(self):
        def change(report):
            report["callbacks"][0].update(isolated=False, isolation="never_ran", instances=0, threads=[])
            report["callbacks"][1].update(isolated=False, isolation="not_isolated")
        report = self.shown(change)
        self.assertIn(f"\u27171 of {len(report['callbacks']) - 1} callbacks that ran did not have a thread of their own: "
                      f"{self.names[1]}; 1 never ran.", self.see("#short li"))

    def test_what_is_undecided_is_said_of_what_was_recorded(self):
        def change(document):
            next(rule for rule in document["verdicts"]["rules"] if rule["id"] == "M2").update(verdict="INCONCLUSIVE")
        report = self.shown(change, of=None)
        self.assertIn(f"?As far as recorded, each of the {len(report['callbacks'])} callbacks had a thread of its own, "
                      "and each of their threads one callback.", self.see("#short li"))

    def test_timing_is_not_enforcement(self):
        def change(document):
            rules = document["verdicts"]["rules"]
            for rule in rules:
                rule["verdict"] = "FAIL" if rule["id"] == "R1" else "PASS"
            document["head"].update(claimed=True, accused=["R1"])
            self.others = sum(not rule["id"].startswith("R") for rule in rules)
        self.shown(change, of=None)
        short = self.see("#short li")
        self.assertTrue(short[0].startswith("\u2717Timing does not hold: 1 rule is violated: R1 "), short)
        self.assertIn(f"\u2713Enforcement holds: {self.others} rules about it passed, none is violated or undecided.", short)

    def test_bounds_stand_where_no_response_time_is_exact(self):
        bounds = {"count": 7, "min": 1_000_000, "max": 2_500_000, "sum": 9, "mean": 1.0, "p50": 1_200_000, "p90": 2, "p99": 2_400_000,
                  "p99_9": 3}

        def change(report):
            report["callbacks"][0].update(response_time_ns=None, response_time_lower_ns=bounds,
                                          response_time_upper_ns={**bounds, "p50": 1_300_000, "p99": 2_600_000, "max": 9_000_000_000})
        name = self.shown(change)["callbacks"][0]["logical_id"]
        self.assertEqual(self.cells("response p50")[name], "\u2265\u202f1.200\u202fms")
        self.assertEqual(self.cells("response max")[name], "\u2265\u202f2.500\u202fms")
        tips = self.browser.evaluate(f"""[...document.querySelectorAll("#callback-table tbody tr")]
            .filter(row => row.querySelector("button").title === {json.dumps(name)}).flatMap(row => [...row.cells].map(c => c.title)).filter(Boolean)""")
        self.assertEqual(len(tips), 3)
        for part in ("7 runs", "p50 1.200\u202fms", "max 2.500\u202fms at least", "9.000\u202fs at most"):
            self.assertIn(part, tips[0])


# Of each edge: [from box to box, on whose border it begins, and ends, boxes and other edges' labels that it goes through, its head].
ROUTES = """(() => {
  const boxes = [...document.querySelectorAll("g.callback")].map(g => [g.querySelector("title").textContent.split(": ")[0], g.querySelector("rect").getBBox()]);
  const isWithin = (p, b, margin) => p.x > b.x + margin && p.x < b.x + b.width - margin && p.y > b.y + margin && p.y < b.y + b.height - margin;
  const labels = [...document.querySelectorAll("g.label > rect")].map((rect, i) => [`label ${i}`, rect.getBBox()]);
  return [...document.querySelectorAll("path.edge")].map((path, number) => {
    const others = [...boxes, ...labels.filter((_, i) => i !== number)];
    const length = path.getTotalLength(), through = new Set();
    for (let at = 0; at <= length; at += 1)
      for (const [id, box] of others) if (isWithin(path.getPointAtLength(at), box, 1)) through.add(id);
    const on = at => boxes.filter(([, box]) => isWithin(path.getPointAtLength(at), box, -1)).map(([id]) => id);
    return [path.querySelector("title").textContent.split(" by ")[0], on(0), on(length), [...through], path.getAttribute("marker-end")];
  });
})()"""


class Graph(Page):
    """Layers of callbacks with messages to the next layer, over several of them, and back."""
    LAYERS = ((0, 1, 2, 3), (4, 5, 6), (7, 8, 9, 10, 11), (12, 13), (14, 15, 16))
    LINKS = ((0, 4), (1, 4), (1, 5), (2, 6), (3, 6), (4, 7), (5, 8), (5, 9), (6, 10), (6, 11), (7, 12), (8, 12), (10, 13), (12, 14),
             (13, 15), (13, 16), (0, 14), (3, 7), (1, 16), (2, 13), (11, 15), (15, 5), (9, 12), (9, 13))

    def drawn(self):
        def change(report):
            first = report["callbacks"][0]
            edge = report["edges"][0]
            report["callbacks"] = [{**first, "index": i, "logical_id": f"/node_{i}@Subscription(/topic_of_{i})", "response_time_ns": None,
                                    "threads": [], "isolation": "never_ran"} for layer in self.LAYERS for i in layer]
            report["edges"] = [{**edge, "from": a, "to": b, "topic": f"/topic_of_{b}"} for a, b in self.LINKS]
            report["threads"] = report["chains"] = []
            self.names[:] = [f"node_{i} \u2190 /topic_of_{i}" for i in range(len(report["callbacks"]))]
        return self.shown(change)

    def test_edges_end_at_their_boxes_and_go_through_none(self):
        report = self.drawn()
        ids = [c["logical_id"] for c in report["callbacks"]]
        routes = self.browser.evaluate(ROUTES)
        self.assertEqual(sorted(title for title, *_ in routes), sorted(f"{ids[a]} to {ids[b]}" for a, b in self.LINKS))
        for title, first, last, through, marker in routes:
            self.assertEqual((first, last), tuple([end] for end in title.split(" to ")), title)
            self.assertEqual(through, [], title)
            self.assertEqual(marker, "url(#arrow)")
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('#arrow path').length"), 1)

    def test_labels_are_topics_and_hide_no_box_and_no_other_label(self):
        self.drawn()
        self.assertEqual(sorted(self.see("g.label > title")), sorted(f"/topic_of_{b}" for _, b in self.LINKS))
        self.assertEqual(sorted(self.see("g.label > text:nth-of-type(1)")), sorted(f"/topic_of_{b}" for _, b in self.LINKS))
        boxes = self.browser.evaluate("""[...document.querySelectorAll("g.label > rect, g.callback > rect")].map(r => {
            const b = r.getBBox(); return [b.x, b.y, b.x + b.width, b.y + b.height]; })""")
        for i, (left, top, right, bottom) in enumerate(boxes):
            for left2, top2, right2, bottom2 in boxes[i + 1:]:
                self.assertFalse(left < right2 and left2 < right and top < bottom2 and top2 < bottom)

    def test_it_fits_its_frame(self):
        self.drawn()
        self.assertEqual(self.browser.evaluate("""(() => { const frame = document.querySelector("svg.graph").parentNode;
            return [frame.scrollWidth - frame.clientWidth, frame.scrollHeight - frame.clientHeight]; })()"""), [0, 0])


class ChainsByStarts(Page):
    """Of a recording of ROS 2: first releases are not known, so bounds and the time from start to start stand in their place."""

    def drawn(self, upper):
        def summary(microseconds):
            return {"count": 2, "sum": 2000 * microseconds, **dict.fromkeys(("min", "p50", "p90", "p99", "max"), 1000 * microseconds)}

        def change(report):
            chain = report["chains"][0]
            chain.update(path_latency_ns=None, from_start_ns=summary(21), instances=2, undivided_ns=summary(3))
            if upper:
                chain["path_latency_upper_ns"] = {**summary(40), "count": upper}
            chain["hop_table"][0].update(processing_ns=None, communication_ns=None, start_to_publish_ns=summary(5),
                                         publish_to_start_ns=summary(7))
            report["chains"] = [chain]
        self.shown(change)

    def test_bounds_stand_where_the_latency_does(self):
        self.drawn(upper=2)
        self.assertEqual(self.see("#chain-table tbody td")[3:6], ["\u2265 21.00\u202f\u00b5s"] * 3)
        hops = self.see("#chains ~ details tbody tr:first-child td")
        self.assertEqual(hops[1:7], ["5.000\u202f\u00b5s"] * 3 + ["7.000\u202f\u00b5s"] * 3)
        notes = self.see("#chains ~ details p.soft")
        self.assertEqual(len(notes), 1, "of what is not divided nothing is said: the rows need no release")
        self.assertIn("at least that from the first start, and at most 40.00\u202f\u00b5s", notes[0])
        self.assertNotIn("not divided", self.see("#chains ~ details td.name"))

    def test_without_an_upper_bound_of_every_run_none_is_told(self):
        for upper in (0, 1):
            self.drawn(upper)
            self.assertNotIn("at most", self.see("#chains ~ details p.soft")[0])


class Use(Page):
    def setUp(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")

    def order(self):
        return self.see("#callback-table tbody td:first-child")

    def test_sorting_by_any_column_both_ways(self):
        count = self.browser.evaluate("document.querySelectorAll('#callback-table th button').length")
        for at in range(count):
            button = f"document.querySelectorAll('#callback-table th button')[{at}]"
            self.do(f"{button}.click()")
            one = self.order()
            direction = self.browser.evaluate(f"{button}.parentNode.getAttribute('aria-sort')")
            self.do(f"{button}.click()")
            self.assertNotEqual(self.browser.evaluate(f"{button}.parentNode.getAttribute('aria-sort')"), direction)
            self.assertEqual(sorted(one), sorted(self.order()))
        self.do("document.querySelector('#callback-table th button').click()")
        self.do("document.querySelector('#callback-table th button').click()")
        self.assertIn(self.order(), (sorted(self.order()), sorted(self.order(), reverse=True)))

    def test_filtering_leaves_what_has_all_words(self):
        rows = self.rows()
        full_name, cells = list(rows.items())[-1]
        for word in (cells["callback"][0].split()[0], full_name.split("(")[0]):  # short names and ids
            self.do(f"""(input => {{ input.value = {json.dumps(word.upper())}; input.dispatchEvent(new Event("input")) }})
                (document.querySelector("#callbacks ~ .bar input"))""")
            self.assertEqual(self.order(), [cells["callback"][0] for name, cells in rows.items()
                                            if word in name or word in cells["callback"][0]])
            self.assertIn(cells["callback"][0], self.order())
            self.assertLess(len(self.order()), len(rows))

    def test_a_callback_shows_its_histogram_and_its_slowest_runs(self):
        for at, name in enumerate(self.order()):
            self.do(f"document.querySelectorAll('#callback-table td button')[{at}].click()")
            self.assertEqual(self.see(".detail h3"), [name])
            slowest = self.see(".detail tbody td:nth-child(2)")
            self.assertTrue(slowest)
        self.assertEqual(self.browser.troubles(), [])

    def test_the_timeline_moves_by_keys_and_shows_a_run(self):
        picture = "document.querySelector('canvas').toDataURL()"
        seen = {self.browser.evaluate(picture)}
        for key in ("+", "+", "ArrowRight", "ArrowLeft", "-", "0"):
            self.do(f"document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}))")
            self.browser.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
            seen.add(self.browser.evaluate(picture))
        self.assertGreaterEqual(len(seen), 4, "everything, twice nearer, and to the right")
        self.do("document.querySelector('.detail tbody button').click()")
        self.assertIn("run #", self.see(".tip")[0])
        self.assertEqual(self.browser.evaluate("document.activeElement.tagName"), "CANVAS")

    def test_prints(self):
        pdf = self.browser.pdf()
        self.assertTrue(pdf.startswith(b"%PDF"))
        self.assertGreater(len(pdf), 20_000)


class Looks(Page):
    def test_nothing_is_cut_off_at_any_width(self):
        for name in NAMES:
            for width, height in SIZES:
                self.browser.resize(width, height)
                self.page(EXAMPLES / name / "trace")
                self.assertLessEqual(self.browser.evaluate("document.scrollingElement.scrollWidth"), width)
                edges = self.browser.evaluate("""[...document.querySelectorAll("#callback-table tbody tr:first-child td[data-ns]")].slice(0, 3)
                    .map(cell => cell.getBoundingClientRect().right)""")
                self.assertEqual(len(edges), 3)
                self.assertLessEqual(max(edges), width, "response times are in sight")
        self.browser.resize(*SIZES[0])

    def test_all_columns_fit_an_ordinary_screen(self):
        spec = self.folder / "wide.yaml"
        spec.write_text("callback_groups:\n  - id: /a/plan@Timer(20000000)\n    response_deadline: 1\n", encoding="utf-8")
        self.page(EXAMPLES / "isolated_ok" / "trace", "--spec", spec)
        self.assertIn("deadline", self.see("#callback-table th"))
        wide = self.browser.evaluate("""[...document.querySelectorAll(".scroll")].filter(part => part.scrollWidth > part.clientWidth)
            .map(part => part.firstElementChild.id || part.firstElementChild.tagName)""")
        self.assertEqual(wide, [])

    def test_light_and_dark_can_be_read(self):
        grounds = set()
        for scheme in ("light", "dark"):
            self.browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            self.page(EXAMPLES / "multi_threaded_fails" / "trace")
            grounds.add(self.browser.evaluate("getComputedStyle(document.body).backgroundColor"))
            contrast = self.browser.evaluate(CONTRAST)
            self.assertEqual({where: ratio for where, ratio in contrast.items() if ratio < 4.5}, {}, scheme)
            shapes = self.browser.evaluate(SHAPES)
            self.assertEqual({name: ratio for name, ratio in shapes.items() if not ratio >= 3}, {}, scheme)
        self.assertEqual(len(grounds), 2)

    def test_everything_has_a_name(self):
        self.page(EXAMPLES / "multi_threaded_fails" / "trace")
        self.assertEqual(self.browser.evaluate(NAMELESS), [])


    def test_keys_reach_everything_and_show_where_they_are(self):
        self.page(EXAMPLES / "multi_threaded_fails" / "trace")
        wanted = self.browser.evaluate("""[...document.querySelectorAll("button, input, canvas, summary, a, .scroll")]
            .filter(node => node.checkVisibility() && !node.closest("details:not([open]) > :not(summary)")).length""")
        reached = []
        for _ in range(wanted):
            for kind in ("keyDown", "keyUp"):
                self.browser.call("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
            reached.append(self.browser.evaluate("""(() => { const node = document.activeElement, style = getComputedStyle(node);
                node.dataset.reached = "yes";
                return [node.tagName, node.textContent.slice(0, 20), style.outlineStyle, parseFloat(style.outlineWidth)]; })()"""))
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('[data-reached]').length"), wanted)
        self.assertEqual([node for node in reached if node[2] == "none" or node[3] < 2], [])

    def test_the_timeline_goes_from_run_to_run_by_keys(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")
        first = self.browser.evaluate("cie.timeline.marked.i")
        key = "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: '%s'}))"
        self.do(key % "n")
        self.assertEqual(self.browser.evaluate("cie.timeline.marked.i"), first + 1)
        self.assertIn("run #", self.see(".tip")[0])
        self.do(key % "p")
        self.assertEqual(self.browser.evaluate("cie.timeline.marked.i"), first)


class Hostile(Page):
    """Names that try to become markup, written over those of an example with as many bytes."""
    GOOD = b"/a/plan@Timer(20000000)"
    EVIL = (b"</script><svg/onload=x>", b"<img src=//a onerror=x>", b'"><b onclick=x>&lt;\xff\x1b&#', b"<!--<script>\xe2\x80\xa8]]>'}-->")

    def test_names_stay_text(self):
        for evil in self.EVIL:
            with self.subTest(evil):
                self.assertEqual(len(evil), len(self.GOOD))
                trace = self.folder / "trace"
                shutil.rmtree(trace, ignore_errors=True)
                shutil.copytree(EXAMPLES / "multi_threaded_fails" / "trace", trace)
                for file in trace.rglob("*"):
                    if file.is_file():
                        file.chmod(0o644)
                        file.write_bytes(file.read_bytes().replace(self.GOOD, evil))
                self.page(trace)
                self.assertIn(evil.decode(errors="replace"), [name.split(" (pid")[0] for name in self.rows()])
                self.assertEqual(self.browser.evaluate("document.querySelectorAll('img, b, [onload], [onclick], [onerror]').length"), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
