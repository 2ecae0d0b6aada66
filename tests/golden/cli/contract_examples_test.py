#!/usr/bin/env python3
"""cie on the contract's two example traces, whose every number is known. Arguments: CIE EXAMPLES."""
import csv
import io
import json
import os
import shlex
import subprocess
import sys
import unittest

from program import CIE, EXAMPLES, cie


def read(*names):
    with open(os.path.join(EXAMPLES, *names), "rb") as file:
        return file.read()


class Example:
    name = ""
    verify_exit = 0

    def run_cie(self, command, *arguments):
        result = cie(command, os.path.join(EXAMPLES, self.name, "trace"), *arguments)
        self.assertEqual(result.stderr, b"")
        return result

    def with_spec(self, command, *arguments):
        return self.run_cie(command, "--spec", os.path.join(EXAMPLES, self.name, "spec.yaml"), *arguments)

    def test_instances_are_equal_byte_for_byte(self):
        self.assertEqual(self.run_cie("instances").stdout, read(self.name, "instances.csv"))

    def test_json_lines_say_what_the_csv_says(self):
        lines = self.run_cie("instances", "--format", "jsonl").stdout.decode().splitlines()
        rows = list(csv.DictReader(io.StringIO(read(self.name, "instances.csv").decode())))
        self.assertEqual(len(lines), len(rows))
        for line, row in zip(lines, rows):
            self.assertEqual({key: "" if value is None else str(value) for key, value in json.loads(line).items()}, row)

    def assert_contains(self, actual, expected, where="report"):
        """Everything expected is there and equal; more may be there."""
        if isinstance(expected, dict):
            for key, value in expected.items():
                self.assertIn(key, actual, where)
                self.assert_contains(actual[key], value, f"{where}.{key}")
        elif isinstance(expected, list):
            self.assertEqual(len(actual), len(expected), where)
            for index, (one, other) in enumerate(zip(actual, expected)):
                self.assert_contains(one, other, f"{where}[{index}]")
        else:
            self.assertEqual(actual, expected, where)

    def test_report_has_every_exact_value(self):
        report = json.loads(self.with_spec("report", "--format", "json").stdout)
        expected = json.loads(read(self.name, "report.json"))
        for one in (report, expected):
            one["callbacks"].sort(key=lambda callback: (callback["pid"], callback["logical_id"]))
        self.assert_contains(report, expected)

    def test_report_csv_agrees_with_its_json(self):
        report = json.loads(self.with_spec("report", "--format", "json").stdout)
        rows = list(csv.DictReader(io.StringIO(self.with_spec("report", "--format", "csv").stdout.decode())))
        self.assertEqual([row["logical_id"] for row in rows], [callback["logical_id"] for callback in report["callbacks"]])
        for row, callback in zip(rows, report["callbacks"]):
            for quantity in (key for key in callback if key.endswith("_time_ns") or key == "duration_ns"):
                for part in ("count", "min", "max", "sum", "p50", "p90", "p99", "p99_9"):
                    value = "" if callback[quantity] is None else str(callback[quantity][part])
                    self.assertEqual(row[f"{quantity}_{part}"], value)

    def test_verdicts(self):
        result = self.with_spec("verify", "--format", "json")
        self.assertEqual(result.returncode, self.verify_exit)
        verdicts = json.loads(result.stdout)
        expected = json.loads(read(self.name, "verify.json"))
        self.assertEqual(verdicts["schema"], "cie.verify/2")
        self.assertEqual(verdicts["verdict"], expected["verdict"])
        self.assertEqual([rule["id"] for rule in verdicts["rules"]], [rule["id"] for rule in expected["rules"]])
        for rule, other in zip(verdicts["rules"], expected["rules"]):
            allowed = {other["verdict"]} | ({"NOT_APPLICABLE"} if rule["id"] == "S5" else set())
            self.assertIn(rule["verdict"], allowed, rule["id"])
            for subject in rule["subjects"]:
                if subject["verdict"] in ("PASS", "FAIL"):
                    self.assertGreaterEqual(subject["checked"], 1, (rule["id"], subject))
                if subject["verdict"] == "FAIL":
                    self.assertTrue(subject["evidence"], (rule["id"], subject))

    def test_the_suggested_command_shows_the_evidence(self):
        verdicts = json.loads(self.with_spec("verify", "--format", "json").stdout)
        text = self.with_spec("verify", "--all").stdout.decode()
        commands = [line.strip() for line in text.splitlines() if line.startswith("    cie events ")]
        witnesses = [subject["evidence"] for rule in verdicts["rules"] for subject in rule["subjects"]
                     if subject["verdict"] == "FAIL"]
        self.assertEqual(len(commands), len(witnesses))
        for command, evidence in zip(commands, witnesses):
            shown = subprocess.run([CIE, *shlex.split(command)[1:]], stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=True,
                                   timeout=200).stdout.decode()
            for item in evidence:
                self.assertRegex(shown, rf"cie:{item['event']}: .*vpid = {item['pid']}, vtid = {item['tid']} ")

    def test_texts_fit_and_nothing_depends_on_the_moment(self):
        for command, arguments in (("report", ()), ("verify", ()), ("report", ("-f", "json")), ("verify", ("-f", "json")),
                                   ("export", ("--to", "perfetto"))):
            once = self.run_cie(command, *arguments).stdout
            self.assertEqual(once, self.run_cie(command, *arguments).stdout, command)
        for options in ((), ("--all",), ("--threads", "--chains")):
            text = self.with_spec("report", *options).stdout.decode()
            # Paths are as long as they are; everything else keeps within 100 columns.
            for name in ("trace", "spec.yaml"):
                text = text.replace(os.path.join(EXAMPLES, self.name, name), name)
            for line in text.splitlines():
                self.assertLessEqual(len(line), 100)


class IsolatedOk(Example, unittest.TestCase):
    name = "isolated_ok"


class MultiThreadedFails(Example, unittest.TestCase):
    name = "multi_threaded_fails"
    verify_exit = 1


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
