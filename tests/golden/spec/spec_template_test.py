#!/usr/bin/env python3
"""`cie spec template` on the contract's example traces, whose specs and reports are known. Arguments:
CIE EXAMPLES."""
import json
import os
import re
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from cie import Cie, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position

cie = Cie(sys.argv[1])
EXAMPLES = os.path.abspath(sys.argv[2])
APPLIED = ("policy", "priority", "nice", "affinity")


def entries(text):
    """The flat entries of a spec by id: what both the examples and the template are made of."""
    found, current = {}, None
    for line in text.split("\nchains:")[0].splitlines():
        start = re.fullmatch(r'  - (?:id|name): "?(.*?)"?', line)
        field = re.fullmatch(r"    (\w+): (.*)", line)
        if start:
            current = found.setdefault(start[1], {})
        elif field and current is not None:
            current[field[1]] = field[2]
        elif not line.startswith("    #"):
            current = None
    return found


class Template(unittest.TestCase):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.spec = os.path.join(folder.name, "spec.yaml")

    def write(self, example):
        trace = os.path.join(EXAMPLES, example, "trace")
        result = cie.run("spec", "template", trace, "-o", self.spec)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        with open(self.spec, encoding="utf-8") as file:
            return trace, file.read()

    def read(self, *names):
        with open(os.path.join(EXAMPLES, *names), encoding="utf-8") as file:
            return file.read()

    def test_says_what_the_run_was_asked_for(self):
        _, text = self.write("isolated_ok")
        asked = entries(self.read("isolated_ok", "spec.yaml"))
        seen = entries(text)
        self.assertGreaterEqual(len(asked), 8)
        self.assertEqual(seen.keys() & asked.keys(), asked.keys())
        for name, fields in asked.items():
            wanted = {key: value for key, value in fields.items() if key in APPLIED}
            self.assertEqual(seen[name], wanted, name)

    def test_tells_what_was_observed(self):
        _, text = self.write("isolated_ok")
        for callback in json.loads(self.read("isolated_ok", "report.json"))["callbacks"]:
            after = text[text.index(f'"{callback["logical_id"]}"\n'):]
            seen = next(line for line in after.splitlines() if "# seen" in line)
            for what, key in (("response time at most", "response_time_ns"),
                              ("execution time at most", "execution_time_ns"),
                              ("and at most", "inter_arrival_ns")):
                self.assertIn(f"{what} {callback[key]['max']}", seen)
            self.assertIn(f"; inter-arrival time at least {callback['inter_arrival_ns']['min']} and at most ", seen)
            self.assertIn(f"{callback['instances']} instances;", seen)

    def test_is_accepted_and_kept_by_the_same_trace(self):
        trace, _ = self.write("isolated_ok")
        self.assertEqual(cie.run("spec", "check", self.spec).returncode, 0)
        verdict = cie.run("verify", trace, "--spec", self.spec, "--format", "json")
        self.assertEqual(verdict.returncode, 0, verdict.stdout)
        verdicts = verdicts_of(json.loads(verdict.stdout))
        self.assertEqual([verdicts["S1"], verdicts["S2"]], ["PASS", "PASS"])

    def test_of_every_example_is_accepted(self):
        for example in sorted(os.listdir(EXAMPLES)):
            if os.path.isdir(os.path.join(EXAMPLES, example, "trace")):
                with self.subTest(example):
                    self.write(example)
                    check = cie.run("spec", "check", self.spec)
                    self.assertEqual(check.returncode, 0, check.stderr)

    def test_violates_no_rule_that_the_trace_alone_does_not(self):
        def failed(*arguments):
            return {rule for rule, verdict in cie.verdicts(*arguments).items() if verdict == "FAIL"}

        for example in sorted(os.listdir(EXAMPLES)):
            if os.path.isdir(os.path.join(EXAMPLES, example, "trace")):
                with self.subTest(example):
                    trace, _ = self.write(example)
                    self.assertLessEqual(failed(trace, "--spec", self.spec), failed(trace))

    def test_of_no_trace_fails(self):
        self.assertEqual(cie.run("spec", "template", EXAMPLES + "/absent", "-o", self.spec).returncode, 4)
        self.assertFalse(os.path.exists(self.spec))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
