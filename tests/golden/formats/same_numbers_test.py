#!/usr/bin/env python3
"""Every number that is shown in two places is the same number.

What JSON says of a recording against the text report, CSV, the tables, the page's data, and verdicts in text, JUnit,
SARIF and TAP. Parquet, SQLite and JSON Lines against CSV: tests/golden/tables. Perfetto's counts and percentiles, and
what the page draws: tests/browser. Arguments: CIE TRACE_OR_TRACE+SPEC...
"""
import collections
import csv
import io
import json
import re
import sys
import unittest
import xml.etree.ElementTree
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from cie import ANSWERED, Cie, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position

cie = Cie(sys.argv[1])
RECORDINGS = [argument.split("+") for argument in sys.argv[2:]]
PARTS = ("count", "min", "max", "sum", "mean", "p50", "p90", "p99", "p99_9")
QUANTITIES = ("response_time_ns", "response_time_lower_ns", "response_time_upper_ns", "start_latency_ns", "duration_ns",
              "inter_arrival_ns", "execution_time_ns", "preempted_ns", "blocked_ns", "wake_delay_ns", "wakeup_latency_ns")
UNITS = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9}


def is_printed_as(text, nanoseconds):
    """Whether "710.4 us" is the number, rounded to the digits that are there."""
    value, unit = text.split()
    digit = 10 ** -len(value.partition(".")[2])
    return abs(float(value) - nanoseconds / UNITS[unit]) <= digit / 2 + 1e-9


def as_csv(value):
    return "" if value is None else {True: "true", False: "false"}.get(value, str(value)) if isinstance(value, bool) else str(value)


class Recording:
    def __init__(self, trace, spec=None):
        self.trace, self.spec = trace, ["--spec", spec] if spec else []
        self.report = cie.json("report", trace, *self.spec)
        self.verdict = json.loads(self.verify("json"))
        self.plain_verdict = cie.json("verify", trace)
        self.plain_report = cie.json("report", trace)

    def verify(self, form, *options):
        return cie.text("verify", self.trace, *self.spec, "-f", form, *options, codes=ANSWERED)

    def table(self, name):
        return list(csv.DictReader(io.StringIO(cie.text("export", self.trace, "--to", "csv", "--table", name))))


class SameNumbers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recordings = [Recording(*recording) for recording in RECORDINGS]

    def summary(self, row, name, summary):
        """Nine columns of a table and an S of the report."""
        for part in PARTS:
            told = row[f"{name}_{part}"]
            if summary is None:
                self.assertEqual(told, "", (name, part))
            elif part == "mean":
                self.assertEqual(float(told), summary[part], name)
            else:
                self.assertEqual(told, str(summary[part]), (name, part))

    def test_callbacks_in_csv(self):
        for recording in self.recordings:
            by_report = list(csv.DictReader(io.StringIO(cie.text("report", recording.trace, *recording.spec, "-f", "csv"))))
            self.assertEqual(len(by_report), len(recording.report["callbacks"]))
            of_spec = ("response_deadline_ns", "late") if recording.spec else ()  # tables are exported without one
            self.assertEqual([{key: row[key] for key in row if key not in of_spec} for row in recording.table("callbacks")],
                             [{key: row[key] for key in row if key not in of_spec} for row in by_report])
            for row, callback in zip(by_report, recording.report["callbacks"]):
                for name in ("logical_id", "pid", "node", "kind", "source", "symbol", "period_ns", "group", "isolated", "instances",
                             "incomplete", "missed_releases", "release_source"):
                    self.assertEqual(row[name], as_csv(callback[name]), name)
                self.assertEqual(row["tids"], " ".join(str(t["tid"]) for t in callback["threads"]))
                for quantity in QUANTITIES:
                    self.summary(row, quantity, callback[quantity])

    def test_tables_of_chains_threads_and_losses(self):
        for recording in self.recordings:
            report = recording.plain_report  # tables know no spec
            for row, chain in zip(recording.table("chains"), report["chains"], strict=True):
                self.assertEqual((row["name"], row["pid"], row["instances"], row["hops"]),
                                 (chain["name"], as_csv(chain["pid"]), str(chain["instances"]), str(len(chain["hops"]))))
                for quantity in ("path_latency_ns", "reaction_time_ns", "data_age_ns", "undivided_ns"):
                    self.summary(row, quantity, chain.get(quantity))
            hops = [hop for chain in report["chains"] for hop in chain["hop_table"]]
            for row, hop in zip(recording.table("chain_hops"), hops, strict=True):
                self.assertEqual((row["from_logical_id"], row["to_logical_id"]), (hop["from"], as_csv(hop["to"])))
                self.summary(row, "processing_ns", hop["processing_ns"])
                self.summary(row, "communication_ns", hop["communication_ns"])
            for row, thread in zip(recording.table("threads"), report["threads"], strict=True):
                self.assertEqual((row["pid"], row["tid"], row["name"], row["busy_ns"], row["callbacks"]),
                                 (str(thread["pid"]), str(thread["tid"]), thread["name"], as_csv(thread["busy_ns"]),
                                  str(len(thread["callbacks"]))))
            self.assertEqual([(r["kind"], r["severity"], r["count"]) for r in recording.table("losses")],
                             [(d["kind"], d["severity"], str(d["count"])) for d in report["defects"]])

    def test_verdicts_of_every_format(self):
        for recording in self.recordings:
            subjects = collections.Counter((rule["id"], s["subject"], s["verdict"], str(s["checked"]))
                                           for rule in recording.plain_verdict["rules"] for s in rule["subjects"])
            self.assertEqual(collections.Counter((r["rule"], r["subject"], r["verdict"], r["checked"])
                                                 for r in recording.table("verdicts")), subjects)
            self.assertEqual(self.in_text(recording.verify("text", "--all")),
                             (recording.verdict["verdict"], verdicts_of(recording.verdict)))
            by_subject = collections.Counter((rule["id"], s["verdict"]) for rule in recording.verdict["rules"]
                                             for s in rule["subjects"] or [rule])
            sarif = json.loads(recording.verify("sarif"))["runs"][0]["results"]
            kinds = {"fail": "FAIL", "open": "INCONCLUSIVE", "pass": "PASS", "notApplicable": "NOT_APPLICABLE"}
            self.assertEqual(collections.Counter((r["ruleId"], kinds[r["kind"]]) for r in sarif), by_subject)
            cases = xml.etree.ElementTree.fromstring(recording.verify("junit")).iter("testcase")
            kinds = {"failure": "FAIL", "error": "INCONCLUSIVE", "skipped": "NOT_APPLICABLE"}
            in_junit = collections.Counter((re.search(r"\b([A-Z]\d)\b", case.get("classname") + " " + case.get("name"))[1],
                                            next((kinds[child.tag] for child in case if child.tag in kinds), "PASS"))
                                           for case in cases)
            self.assertEqual(in_junit, by_subject)
            tap = collections.Counter()
            for line in recording.verify("tap").splitlines():
                if found := re.match(r"(ok|not ok) \d+ - ([A-Z]\d)\b.*?(# SKIP.*)?$", line):
                    tap[found[2], found[1] == "ok", found[3] is not None] += 1
            wanted = collections.Counter()
            for (rule, verdict), count in by_subject.items():
                wanted[rule, verdict in ("PASS", "NOT_APPLICABLE"), verdict == "NOT_APPLICABLE"] += count
            self.assertEqual(tap, wanted)

    def in_text(self, text):
        """The verdict and each rule's, from the summary that `cie verify --all` begins with."""
        words = {"violated": "FAIL", "undecided": "INCONCLUSIVE", "passed": "PASS", "not applicable": "NOT_APPLICABLE"}
        summary = text.partition("\n\n")[0].splitlines()
        rules, verdict = {}, None
        for line in summary[1:]:
            word = next((w for w in words if line.strip().startswith(w + " ")), None)
            verdict = words[word] if word else verdict
            for rule in re.findall(r"\b[A-Z]\d\b", line):
                rules[rule] = verdict
        return summary[0].split()[1], rules

    def rows(self, section):
        """Cells of a table of callbacks by the lower line of the columns' titles; the execution time is the second that is
        called "time max". A long name stands on a line of its own."""
        lines = section.split("\n\n")[0].splitlines()
        titles = re.split(r" {2,}", lines[2].strip())
        if titles.count("time max") > 1:
            titles[len(titles) - 1 - titles[::-1].index("time max")] = "exec. time max"
        name = []
        for line in lines[3:]:
            cells = name + re.split(r" {2,}", line.strip())
            name = cells if len(cells) == 1 else []
            if len(cells) > 1:
                self.assertEqual(len(cells), len(titles), line)
                yield dict(zip(titles, cells))

    def test_the_text_report(self):
        checked = 0
        for recording in self.recordings:
            text = cie.text("report", recording.trace, *recording.spec, "--all")
            self.assertIn(f"{recording.verdict['verdict']}: ", text)
            rows = [row for section in re.split(r"\n(?=Callbacks of pid |Threads of pid |Chain )", text)
                    if section.startswith("Callbacks of pid ") for row in self.rows(section)]
            ran = [callback for callback in recording.report["callbacks"] if callback["instances"] + callback["incomplete"] + callback["cut"]]
            self.assertEqual(len(rows), len(ran))
            for row, callback in zip(rows, ran):
                name, runs, p50, p99, longest = (row.get(column, "-") for column in (
                    "callback", "count", "time p50", "time p99", "time max"))
                start, execution, missed, isolated, deadline, late = (row.get(column, "-") for column in (
                    "lat. max", "exec. time max", "missed", "lated", "deadline", "late"))
                head, _, tail = callback["logical_id"].partition("...") if "..." not in name else name.partition("...")
                self.assertTrue(callback["logical_id"].startswith(head) and callback["logical_id"].endswith(tail), name)
                partly_seen = callback["incomplete"] + callback["cut"]
                incomplete = f"+{partly_seen}" if partly_seen else ""
                self.assertEqual(runs, f"{callback['instances']}{incomplete}")
                exact, lower, upper = (callback[f"response_time_{bound}ns"] for bound in ("", "lower_", "upper_"))
                for told, part in ((p50, "p50"), (p99, "p99"), (longest, "max")):
                    if exact or lower:
                        is_settled = exact and upper and upper["count"] == lower["count"] and upper["max"] <= exact["max"]
                        is_settled = is_settled if part == "max" else part == "p50" and callback.get("median_known")
                        is_bound = lower and not is_settled
                        self.assertEqual(told.startswith(">"), bool(is_bound), (told, part))
                        source = (callback["response_time_at_least_ns"] if exact and lower else exact or lower)[part]
                        self.assertTrue(is_printed_as(told.lstrip(">"), source), (told, part))
                        checked += 1
                    else:
                        self.assertEqual(told, "-")
                for told, quantity in ((start, "start_latency_ns"), (execution, "execution_time_ns")):
                    self.assertEqual(told == "-", callback[quantity] is None)
                    if callback[quantity]:
                        self.assertTrue(is_printed_as(told, callback[quantity]["max"]), (told, quantity))
                self.assertEqual(late, "-" if callback["late"] is None else str(callback["late"]))
                if callback["response_deadline_ns"] is not None:
                    self.assertTrue(is_printed_as(deadline, callback["response_deadline_ns"]), deadline)
                self.assertEqual(missed, "-" if callback["missed_releases"] is None else str(callback["missed_releases"]))
                self.assertEqual(isolated, {"isolated": "yes", "not_isolated": "NO"}.get(callback["isolation"], "-"))
            worst = max((c[times]["max"] for c in recording.report["callbacks"]
                         for times in ("response_time_ns", "response_time_lower_ns") if c[times]), default=None)
            if worst:
                self.assertTrue(is_printed_as(re.search(r"longest response time +>?(\S+ \S+)", text)[1], worst))
            for defect in recording.report["defects"]:
                self.assertRegex(text, rf"(ERROR|LOSS |info ) {re.escape(defect['kind'])} x {defect['count']}\n")
        self.assertGreater(checked, 50)

    def test_the_page_carries_both(self):
        for recording in self.recordings:
            page = cie.text("report", recording.trace, *recording.spec, "-f", "html")
            data = json.loads(re.search(r'<script type="application/json" id="document">(.*?)</script>', page, re.S)[1])
            self.assertEqual(data["report"], recording.report)
            self.assertEqual(data["verdicts"], recording.verdict)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
