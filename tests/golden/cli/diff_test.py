#!/usr/bin/env python3
"""cie diff: what is worse than before, and beyond chance. Arguments: CIE EXAMPLES."""
import json
import os
import re
import sys
import unittest

from program import Folder, TRACE, cie


class Diff(Folder):
    def report(self, name, change=lambda report: None):
        report = json.loads(cie("report", TRACE, "-f", "json").stdout)
        change(report)
        return self.write(name, json.dumps(report).encode())

    def test_nothing_is_worse_than_itself(self):
        for inputs in ((TRACE, TRACE), (self.report("a.json"), self.report("b.json"))):
            done = cie("diff", *inputs)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(done.stdout.startswith(b"No regression"), done.stdout)
            self.assertEqual(json.loads(cie("diff", *inputs, "-f", "json").stdout)["outcome"], "no_regression")

    # Its callbacks ran up to 16 times: too seldom to tell anything from chance.
    def test_what_ran_too_seldom_is_undecided(self):
        def faster(report):
            for callback in report["callbacks"]:
                for quantity in ("response_time_ns", "start_latency_ns", "duration_ns"):
                    if callback[quantity]:
                        callback[quantity]["min"] -= 1

        inputs = (self.report("a.json"), self.report("b.json", faster))
        done = cie("diff", *inputs)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertTrue(done.stdout.startswith(b"Times undecided: of 48 quantiles none is certain; no other regression\n"),
                        done.stdout)
        self.assertEqual(json.loads(cie("diff", *inputs, "-f", "json").stdout)["outcome"], "undecided")
        for how, code in (("warn", 0), ("fail", 1)):
            self.assertEqual(cie("diff", *inputs, "--inconclusive", how).returncode, code)

    def test_a_file_that_is_no_report_is_refused_in_words(self):
        for content, why in ((b"no json", b"is neither a recording nor a report: parse error at line 1"),
                             (b"{}", b"is neither a recording nor a report: key 'schema' not found")):
            done = cie("diff", self.write("other", content), TRACE)
            self.assertEqual((done.returncode, done.stdout), (4, b""))
            self.assertIn(why, done.stderr)

    # No count is negative, has a part, or takes more than 64 bits.
    def test_an_impossible_count_is_refused_by_its_place(self):
        for count in (-5, 1.5, 1e30, 2**64):
            for place, change in (("callbacks[1].instances", lambda report: report["callbacks"][1].update(instances=count)),
                                  ("callbacks[0].duration_ns.count",
                                   lambda report: report["callbacks"][0]["duration_ns"].update(count=count)),
                                  ("callbacks[0].threads[0].instances",
                                   lambda report: report["callbacks"][0]["threads"][0].update(instances=count)),
                                  ("trace.events", lambda report: report["trace"].update(events=count))):
                changed = self.report("changed.json", change)
                for inputs in ((TRACE, changed), (changed, TRACE)):
                    done = cie("diff", *inputs)
                    self.assertEqual((done.returncode, done.stdout), (4, b""), (place, count))
                    self.assertRegex(done.stderr.decode(), "changed.json\" is neither a recording nor a report: "
                                     + re.escape(place) + " is .* and not an integer from 0 to 18446744073709551615")

    def test_a_callback_that_is_gone_or_shares_its_thread_is_a_regression(self):
        def drop(report):
            del report["callbacks"][0]

        def share(report):
            report["callbacks"][0].update(isolated=False, isolation="not_isolated")

        for change, said in ((drop, b"is gone"), (share, b"no longer has a thread of its own")):
            done = cie("diff", TRACE, self.report("changed.json", change))
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(said, done.stdout)

    def test_what_is_slower_beyond_chance(self):
        def scaled(count, factor):
            def change(report):
                for callback in report["callbacks"]:
                    callback["response_time_ns"] = {
                        "count": count, "sum": 0, "mean": 0,
                        **{k: int(v * factor) for k, v in
                           {"min": 1000, "max": 1090, "p50": 1020, "p90": 1050, "p99": 1080, "p99_9": 1090}.items()}}
            return change

        # Every value known lies above every value known before: certain with 1000, not with 2.
        for count, code in ((1000, 1), (2, 3)):
            before = self.report("before.json", scaled(count, 1))
            after = self.report("after.json", scaled(count, 2))
            done = cie("diff", before, after, "-f", "json")
            self.assertEqual(done.returncode, code, (count, done.stderr))
            diff = json.loads(done.stdout)
            self.assertEqual((diff["schema"], diff["regression"]), ("cie.diff/1", code == 1))
            self.assertEqual(cie("diff", before, after, "--tolerance", "150").returncode, 0)

    def test_reports_of_version_1_are_compared(self):
        def version_1(report):
            report["schema"] = "cie.report/1"
            for rows in (report["processes"], report["callbacks"], report["threads"]):
                for row in rows:
                    for key in ("index", "process", "ran", "deadline_ns", "exceptions", "longest_queue", "preempted_by",
                                "isolation", "response_deadline_ns", "late", "lost_samples", "overwritten_samples"):
                        row.pop(key, None)
            for callback in report["callbacks"]:
                for thread in callback["threads"]:
                    del thread["thread"]

        old = self.report("old.json", version_1)
        done = cie("diff", old, self.report("new.json"), "-f", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        same = cie("diff", self.report("same.json"), self.report("new.json"), "-f", "json")

        def compared(diff):
            return [{key: value for key, value in callback.items() if not key.startswith(("exceptions", "lost_samples", "overwritten_samples"))}
                    for callback in json.loads(diff.stdout)["callbacks"]]
        self.assertEqual(compared(done), compared(same))

    def test_callbacks_of_one_id_in_several_processes_are_one(self):
        def doubled(factor):
            def change(report):
                report["callbacks"] = report["callbacks"][:1] * 2
                report["callbacks"] = [json.loads(json.dumps(callback)) for callback in report["callbacks"]]
                for callback, slower in zip(report["callbacks"], (factor, 1)):
                    callback["duration_ns"] = {
                        "count": 1000, "sum": 0, "mean": 0,
                        **dict.fromkeys(("min", "max", "p50", "p90", "p99", "p99_9"), 1_000_000 * slower)}
            return change

        before = self.report("before.json", doubled(1))
        for factor, code in ((1, 0), (8, 1)):
            done = cie("diff", before, self.report("after.json", doubled(factor)), "-f", "json")
            self.assertEqual(done.returncode, code, done.stderr)
            callback, = json.loads(done.stdout)["callbacks"]
            self.assertEqual((callback["processes_before"], callback["processes_after"]), (2, 2))
            # Half of the runs take 8 ms: the 99th percentile is among them.
            duration = [q for q in callback["quantities"] if q["quantity"] == "duration" and q["quantile"] == 0.99]
            self.assertEqual(duration[0]["after_ns"], {**dict.fromkeys(("estimate", "lower", "upper"), 1_000_000 * factor),
                                                       "estimate_is_lower_bound": False})

    def test_what_a_record_lacks_is_told_and_decides_nothing(self):
        def lossy(report):
            report["trace"]["complete"] = False
            report["defects"].append({"kind": "seq-gaps", "severity": "loss", "count": 5, "advice": ""})

        def drop(report):
            lossy(report)
            del report["callbacks"][0]

        for change, said in ((lossy, b"after lacks instances: seq-gaps x 5"), (drop, b"may be gone: ")):
            done = cie("diff", TRACE, self.report("lossy.json", change))
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertTrue(done.stdout.startswith(b"Undecided: no regression in what was recorded"), done.stdout)
            self.assertIn(said, done.stdout)
            for how, code in (("warn", 0), ("fail", 1)):
                done = cie("diff", TRACE, self.report("lossy.json", change), "--inconclusive", how)
                self.assertEqual(done.returncode, code, done.stderr)

    def test_nothing_is_compared(self):
        done = cie("diff", self.report("empty.json", lambda report: report.update(callbacks=[])), TRACE)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertTrue(done.stdout.startswith(b"Nothing to compare: "), done.stdout)
        done = cie("diff", TRACE, self.report("empty.json", lambda report: report.update(callbacks=[])))
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn(b"may be gone: ", done.stdout)
        for sides in ((TRACE, "empty.json"), ("empty.json", TRACE)):  # which is no reason to go on
            for how, code in (("warn", 3), ("fail", 1)):
                done = cie("diff", *(os.path.join(self.folder, side) for side in sides), "--inconclusive", how)
                self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(cie("diff", TRACE, TRACE, "--inconclusive", "never").returncode, 2)

    def test_what_is_named_and_is_not_there(self):
        with open(os.path.join(self.folder, "spec.yaml"), "w", encoding="utf-8") as spec:
            spec.write("callback_groups: []\n")
        for options in ((), ("--spec", spec.name)):
            done = cie("diff", TRACE, "nope", *options)
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertIn(b"No such file or directory", done.stderr)
        done = cie("diff", TRACE, TRACE, "third")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stderr, b'cie: one argument too many: "third"\nTry: cie diff --help\n')

    def test_bad_input_is_named(self):
        self.assertEqual(cie("diff", TRACE).returncode, 2)
        for schema in ("cie.report/1", "cie.report/2"):
            done = cie("diff", TRACE, self.write("bad.json", json.dumps({"schema": schema, "callbacks": [{}]}).encode()))
            self.assertEqual(done.returncode, 4, schema)
        self.assertEqual(cie("diff", TRACE, TRACE, "--tolerance", "much").returncode, 2)
        for content in ("", "[", "{}", '{"schema": "cie.verify/1"}', '{"schema": "cie.report/1", "callbacks": [{}]}'):
            done = cie("diff", TRACE, self.write("bad.json", content.encode()))
            self.assertEqual(done.returncode, 4, content)
            self.assertIn(b"bad.json", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
