#!/usr/bin/env python3
"""What the HTML report says and draws, in a real Chromium. Arguments: CIE EXAMPLES."""
import base64
import csv
import gzip
import io
import json
import re

from page import EXAMPLES, NAMES, Page, cie, document_of, main  # first: it says where browsers and hosts are
from other_host import on_host


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
                    self.assertEqual(cells["count"][0].replace("\u202f", ""), str(callback["instances"]))
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
                verdicts = json.loads(cie("verify", EXAMPLES / name / "trace", "--format", "json", codes=(code,)))
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
        self.assertEqual(self.see(".detail svg rect.f-run > title")[:1], ["5.001\u202fms: 90 instances"])

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

    def test_what_loads_components_is_not_told_as_the_slowest(self):
        for name in NAMES:
            document = document_of(self.page(EXAMPLES / name / "trace"))
            report = cie("report", EXAMPLES / name / "trace")
            first = document["names"]["callbacks"][document["head"]["worst"]]
            rows = [line.split("  ")[1] for line in report.splitlines() if line.startswith("  ") and "us  " in line]
            self.assertEqual(rows[0], first.replace("\u2190", "<-").replace("\u21d0", "<="))
            self.assertIn("Slowest: " + first, " ".join(self.see("#short li")))

    def test_rules_are_told_with_times_that_people_read(self):
        trace = EXAMPLES / "multi_threaded_fails" / "trace"
        spec = self.folder / "deadline.yaml"
        spec.write_text("callback_groups:\n  - id: /a/plan@Timer(20000000)\n    response_deadline: 1\n", encoding="utf-8")
        self.page(trace, "--spec", spec)
        evidence = [text.split(" (")[0] for text in self.see("#rules ~ details li")]
        self.assertEqual([text for text in evidence if re.search(r"\d{4,} ns", text)], [])
        self.assertIn("\u2192 ", " ".join(self.see("#rules ~ details p.remedy")))

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

    def test_of_runs_that_are_not_drawn_nothing_is_known(self):
        self.page(EXAMPLES / "multi_threaded_fails" / "trace")
        known = "cie.lanes.lanes.map(l => cie.knowsWhomItWaitedFor(l, l.count - 1))"
        self.assertEqual(set(self.browser.evaluate(known)), {True})
        self.do("cie.lanes.lanes[0].of += 1")
        self.assertEqual(set(self.browser.evaluate(known)), {False})
        self.do("""(() => { const [lane] = cie.lanes.lanes; lane.of -= 1; lane.duration[lane.count - 2] = Number.NaN; cie.findLimits(lane); })()""")
        self.assertIn(True, self.browser.evaluate(known), "what began before it waited for none of it")
        self.assertIn(False, self.browser.evaluate("cie.lanes.lanes.flatMap(l => [...l.start.keys()].map(i => cie.knowsWhomItWaitedFor(l, i)))"))

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
        self.assertIn(f"instance #{worst['seq']} on thread {worst['tid']}", self.see(".tip")[0])
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

    def test_what_is_not_known_has_no_columns(self):
        """As in recordings of ROS 2's own executors without the kernel's events: durations, and no release."""
        def change(report):
            for callback in report["callbacks"]:
                duration = callback["duration_ns"]
                callback.update(dict.fromkeys((
                    "response_time_ns", "start_latency_ns", "execution_time_ns", "preempted_ns", "blocked_ns", "wake_delay_ns",
                    "response_time_upper_ns")), response_time_lower_ns=duration, release_source=duration and "start")
            for thread in report["threads"]:
                thread.update(role=None, sched=None, busy_ns=None)
            for chain in report["chains"]:
                chain.update(data_age_ns=None)
        self.shown(change)
        headers = self.see("#callback-table th")
        self.assertEqual(headers[:5], ["callback", "duration p50", "duration p99", "duration max", "isolated"])
        self.assertEqual(self.see("[aria-labelledby=threads] th"), ["thread", "pid", "tid", "callbacks"])
        self.assertNotIn("data age p50", self.see("#chain-table th"))
        self.assertEqual(self.see(".detail thead th")[:5], ["instance", "response time", "duration", "execution time", "preempted"])
        self.assertTrue(all(cell.startswith("\u2265") for cell in self.see(".detail tbody tr td:nth-child(2)")))
        self.assertRegex(" ".join(self.see("#short li")), r"Most of it: (execution time|blocked), \d")

    def test_late_runs_are_those_that_ended_and_the_open_ones(self):
        """As the text report has them."""
        def change(report):
            for callback, late, late_open in zip(report["callbacks"], (0, 2, 3), (1, 1, None)):
                callback.update(response_deadline_ns=1, late=late)
                if late_open:
                    callback["late_open"] = late_open
        report = self.shown(change)
        rows = self.rows()
        self.assertEqual([rows[callback["logical_id"]]["late"][0] for callback in report["callbacks"][:3]],
                         ["\u2717 0+1", "\u2717 2+1", "\u2717 3"])

    def test_messages_of_publishers_that_were_not_recorded_are_counted_once(self):
        self.shown(lambda report: None)
        self.assertNotIn("not recorded", " ".join(self.see("[aria-labelledby=chains] p")))
        self.shown(lambda report: report.update(taken={"messages": 1200, "unrecorded": 7}))
        self.assertIn("7 of 1\u202f200 messages taken came from publishers that were not recorded.",
                      self.see("[aria-labelledby=chains] p"))

    def test_messages_that_were_not_sent_are_counted_by_publisher(self):
        def change(report):
            report["processes"][0]["unsent"] = [{"node": "/a", "topic": "/scan", "messages": 1},
                                                {"node": "/a", "topic": "/map", "messages": 2}]
        self.shown(change)
        self.assertIn("3 messages were not sent in time and reached nobody: 2 on /map, 1 on /scan.",
                      self.see("[aria-labelledby=chains] p"))

    def test_rules_that_hold_are_folded_and_a_symbol_is_one_line(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")
        folded = self.browser.evaluate("[...document.querySelectorAll('#rules ~ details')].map(d => [d.open, d.querySelector('summary').textContent])")
        self.assertEqual([is_open for is_open, _ in folded], [False])
        self.assertRegex(folded[0][1], r"^\u2713 \d+ rules pass, \u2013 \d+ rules do not apply$")
        heights = self.browser.evaluate("""(() => { const [line] = document.querySelectorAll(".detail .line");
            return line ? [line.offsetHeight, parseFloat(getComputedStyle(line).fontSize)] : null; })()""")
        if heights:
            self.assertLess(heights[0], 2 * heights[1])

    def test_a_thread_that_nobody_read_back_is_as_its_switches_show_it(self):
        def change(report):
            for changes, thread in enumerate(report["threads"][:2]):
                thread.update(sched=None, switched={"prio": 125, "text": "nice 5", "changes": changes})
        self.shown(change)
        column = self.see("[aria-labelledby=threads] th").index("scheduling") + 1
        cells = self.see(f"[aria-labelledby=threads] tbody td:nth-child({column})")
        self.assertEqual(cells[:2], ["nice 5", "nice 5 (changed)"])

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


if __name__ == "__main__":
    main()
