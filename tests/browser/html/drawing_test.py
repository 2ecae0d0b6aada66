#!/usr/bin/env python3
"""What the HTML report draws of data that no example has, in a real Chromium. Arguments: CIE EXAMPLES."""
import json

from page import Page, main


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

    def test_threads_that_may_have_served_what_nobody_sees_are_named_all_the_same(self):
        def change(report):
            report["callbacks"][0].update(isolated=False, isolation=None)
            report["callbacks"][1].update(isolated=False, isolation=None, threads=[])
        report = self.shown(change)
        short = self.see("#short li")
        self.assertIn("?Whether 1 callback had a thread of its own is not known, for the thread may also have served a client or an action "
                      f"of ROS 2: {self.names[0]}.", short)
        self.assertIn(f"?The trace does not name the threads of 1 callback: {self.names[1]}.", short)
        marks = self.browser.evaluate("""[...document.querySelectorAll("#matrix ~ .scroll rect")].map(r =>
            [r.getAttribute("class"), r.querySelector("title").textContent])""")
        name = report["callbacks"][0]["logical_id"]
        self.assertEqual([(kind, title.endswith(", perhaps not isolated")) for kind, title in marks if title.startswith(name + " on ")],
                         [("f-lost", True)])
        self.assertEqual({kind for kind, title in marks if not title.startswith(name + " on ")}, {"f-run"})

    def test_missed_releases_are_held_against_timers_that_may_not_miss_them(self):
        def missed(verdict):
            def change(document):
                timer = next(c for c in document["report"]["callbacks"] if c["kind"] == "timer")
                timer["missed_releases"] = 2
                self.timer = timer["logical_id"]
                rule = next(rule for rule in document["verdicts"]["rules"] if rule["id"] == "R2")
                rule.update(verdict=verdict, subjects=[{"subject": "callback " + self.timer, "verdict": verdict, "checked": 9,
                                                        "evidence": [], "kind": "callback", "index": timer["index"], "process": 0}])
                document["head"].update(claimed=True)
            self.shown(change, of=None)
            return next(line for line in self.see("#short li") if "missed: " in line), self.cells("missed")[self.timer]
        line, cell = missed("PASS")
        self.assertTrue(line.startswith("\u20132 releases of 1 timer were missed: "), line)
        self.assertEqual(cell, "2")
        line, cell = missed("FAIL")
        self.assertTrue(line.startswith("\u2717"), line)
        self.assertEqual(cell, "\u2717 2")

    def test_only_releases_that_may_not_be_missed_are_held_against_timers(self):
        def change(document):
            names = dict(zip((c["index"] for c in document["report"]["callbacks"]), document["names"]["callbacks"]))
            self.timers = [c for c in document["report"]["callbacks"] if c["isolation"] != "never_ran"][:3]
            self.called = [names[c["index"]] for c in self.timers]
            for callback, count in zip(self.timers, (2, 3, 24)):
                callback["missed_releases"] = count
            rule = next(rule for rule in document["verdicts"]["rules"] if rule["id"] == "R2")
            rule.update(verdict="FAIL", subjects=[
                {"subject": "callback " + c["logical_id"], "verdict": verdict, "checked": 9, "evidence": [], "kind": "callback",
                 "index": c["index"], "process": 0} for c, verdict in zip(self.timers, ("FAIL", "PASS", "FAIL"))])
            document["head"].update(claimed=True)
        self.shown(change, of=None)
        two, three, many = self.called
        self.assertEqual([line for line in self.see("#short li") if "missed" in line and "R2" not in line],
                         [f"\u271726 releases of 2 timers were missed: 24 of {many}, 2 of {two}.",
                          f"\u20133 releases of 1 other timer were missed: {three}."])

    def test_rules_tell_the_worst_first_and_what_to_do(self):
        def change(document):
            rule = next(rule for rule in document["verdicts"]["rules"] if rule["id"] == "R2")
            rule.update(verdict="FAIL", subjects=[
                {"subject": f"callback {n}", "verdict": verdict, "checked": 9, "evidence": [], "kind": "callback", "index": 0,
                 "process": 0} for n, verdict in enumerate(("FAIL", "PASS", "FAIL"))])
            document["names"]["order"]["R2"] = [2, 0]
            document["head"]["remedies"]["R2"] = "make room"
        self.shown(change, of=None)
        self.assertEqual(self.see("#rules ~ details p"),
                         ["callback 2 (9 checked)", "callback 0 (9 checked)", "\u2192 make room"])

    def test_times_have_the_unit_that_fits_when_they_are_rounded(self):
        self.shown(lambda report: None)
        times = {999: "999 ns", 1000: "1.000 us", 999_949: "999.9 us", 999_951: "1.000 ms", 999_951_000: "1.000 s",
                 14_400_000_000_000: "14400 s"}
        for ns, text in times.items():
            self.assertEqual(self.browser.evaluate(f"cie.time({ns})"), text.replace(" ", "\u202f"))

    def test_names_of_threads_turn_no_text_around(self):
        def change(report):
            thread = report["threads"][-1]
            thread["name"] = "a\u202eb\x1b"
            for callback in report["callbacks"]:
                for ran in callback["threads"]:
                    ran["name"] = "a\u202eb\x1b"
        self.shown(change)
        self.assertIn("a\\u{202e}b\\x1b", self.see("#threads ~ .scroll td"))
        self.assertNotIn("\u202e", "".join(self.see("main")))

    def test_what_preempted_it_besides_those_named_is_told(self):
        def change(report):
            for callback in report["callbacks"]:
                callback["preempted_by"] = [{"tid": i, "name": "hog", "ns": 1000 - i} for i in range(1, 7)]
                callback["preempted_ns"] = {**callback["response_time_ns"], "sum": total}

        told = "Preempted by: hog 1 999 ns, hog 2 998 ns, hog 3 997 ns, hog 4 996 ns and "
        for total, rest in ((5979, "2 threads more, 1.989 us"), (6979, "at least 2 threads more, 2.989 us")):
            self.shown(change)
            self.assertIn(f"{told}{rest} (all instances)", " ".join(" ".join(self.see("p")).split()))

    def test_a_callback_whose_cpu_is_idle_is_preempted_by_nobody(self):
        def change(document):
            for callback in document["report"]["callbacks"]:
                callback["preempted_by"] = [{"tid": 0, "name": "swapper/0", "ns": 900}, {"tid": 7, "name": "hog", "ns": 99}]
                callback["preempted_ns"] = {**callback["response_time_ns"], "sum": 999}
                document["head"]["idle"][str(callback["index"])] = "perhaps throttled"

        self.shown(change, of=None)
        told = " ".join(" ".join(self.see("p")).split())
        self.assertIn("Preempted by: hog 7 99 ns (all instances)", told)
        self.assertIn("runnable while its CPU was idle: 900 ns (all instances), perhaps throttled", told)

    def test_means_of_different_runs_are_not_added_up(self):
        def change(report):
            callback = max(report["callbacks"], key=lambda c: c["response_time_ns"]["max"] if c["response_time_ns"] else 0)
            self.runs = callback["instances"]
            for key in ("execution_time_ns", "preempted_ns", "blocked_ns", "wake_delay_ns"):
                callback[key] = {**callback["duration_ns"], "count": self.runs - 1, "mean": 1000.0}
        self.shown(change)
        told = next(text for text in self.see(".detail p") if text.startswith("Where the time goes"))
        self.assertEqual(told, f"Where the time goes, on average of {self.runs - 1} of {self.runs} instances, from start to end:")
        self.assertNotIn("start latency", " ".join(self.see(".detail .key")))

    def test_timing_is_not_enforcement(self):
        def change(document):
            rules = document["verdicts"]["rules"]
            for rule in rules:
                rule["verdict"] = "FAIL" if rule["id"] == "R1" else "PASS"
            document["head"].update(claimed=True, accused=["R1"])
            self.others = sum(not rule["id"].startswith(("R", "Q")) for rule in rules)
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
        for part in ("7 instances", "p50 1.200\u202fms", "max 2.500\u202fms at least", "9.000\u202fs at most"):
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
        def change(document):
            report = document["report"]
            document["head"]["worst"] = None  # none of them ran
            first = report["callbacks"][0]
            edge = report["edges"][0]
            report["callbacks"] = [{**first, "index": i, "logical_id": f"/node_{i}@Subscription(/topic_of_{i})", "response_time_ns": None,
                                    "threads": [], "isolation": "never_ran"} for layer in self.LAYERS for i in layer]
            report["edges"] = [{**edge, "from": a, "to": b, "topic": f"/topic_of_{b}"} for a, b in self.LINKS]
            report["threads"] = report["chains"] = []
            self.names[:] = [f"node_{i} \u2190 /topic_of_{i}" for i in range(len(report["callbacks"]))]
        return self.shown(change, of=None)

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
        self.assertEqual(self.see("#chain-table tbody td")[3:6], ["\u2265 21.00\u202fus"] * 3)
        hops = self.see("#chains ~ details tbody tr:first-child td")
        self.assertEqual(hops[1:7], ["5.000\u202fus"] * 3 + ["7.000\u202fus"] * 3)
        notes = self.see("#chains ~ details p.soft")
        self.assertEqual(len(notes), 1, "of what is not divided nothing is said: the rows need no release")
        self.assertIn("at least that from the first start, and at most 40.00\u202fus", notes[0])
        self.assertNotIn("not divided", self.see("#chains ~ details td.name"))

    def test_without_an_upper_bound_of_every_run_none_is_told(self):
        for upper in (0, 1):
            self.drawn(upper)
            self.assertNotIn("at most", self.see("#chains ~ details p.soft")[0])


if __name__ == "__main__":
    main()
