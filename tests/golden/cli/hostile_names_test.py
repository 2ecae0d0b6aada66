#!/usr/bin/env python3
"""A trace whose names try to control the terminal and to break formats. Arguments: CIE EXAMPLES.

The names are written over those of an example trace, with the same number of bytes, so that every
number stays known.
"""
import csv
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from on_terminal import on_terminal  # pylint: disable=wrong-import-position

CIE = os.path.abspath(sys.argv[1])
EXAMPLE = os.path.join(os.path.abspath(sys.argv[2]), "multi_threaded_fails")

GOOD = b"/a/plan@Timer(20000000)"
EVIL = b'\x1b[2J\x1b]0;x\x07",\n\r\t\xc2\x9b\xff\xe2\x80\xaeab'
SEEN = EVIL.decode(errors="replace")
assert len(EVIL) == len(GOOD)


class HostileNames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.trace = os.path.join(folder.name, "trace")
        shutil.copytree(os.path.join(EXAMPLE, "trace"), cls.trace)
        replaced = 0
        for where, _, names in os.walk(cls.trace):
            for name in names:
                path = os.path.join(where, name)
                os.chmod(path, 0o644)
                with open(path, "rb") as file:
                    content = file.read()
                replaced += content.count(GOOD)
                with open(path, "wb") as file:
                    file.write(content.replace(GOOD, EVIL))
        assert replaced > 0, "the example no longer holds the name"

    def cie(self, command, *arguments, code=0):
        result = subprocess.run([CIE, command, self.trace, *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, timeout=200, check=False)
        self.assertEqual((result.returncode, result.stderr), (code, b""))
        return result.stdout

    def test_text_shows_the_name_and_obeys_nothing_in_it(self):
        for text in (self.cie("report", "--all"), self.cie("report"), self.cie("verify", code=1)):
            for control in (b"\x1b", b"\x07", b"\r", b"\t", b"\xc2\x9b", b"\xff", b"\xe2\x80\xae"):
                self.assertNotIn(control, text)
            self.assertIn(rb'\x1b[2J\x1b]0;x\x07",\x0a\x0d\x09\x9b', text)
            self.assertIn(rb"\u{202e}", text)

    def test_events_show_it_and_obey_nothing_in_it(self):
        text = self.cie("events")
        for control in (b"\x1b", b"\x07", b"\r", b"\t", b"\xc2\x9b", b"\xff", b"\xe2\x80\xae"):
            self.assertNotIn(control, text)
        self.assertIn(rb'logical_id = "\x1b[2J\x1b]0;x\x07\",\x0a\x0d\x09\x9b', text)
        lines = self.cie("events", "-f", "json").decode().splitlines()
        self.assertEqual(len(lines), text.count(b"\n"))
        self.assertIn(SEEN, [json.loads(line)["fields"].get("logical_id") for line in lines])
        rows = csv.DictReader(io.StringIO(self.cie("events", "-f", "csv").decode(), newline=""))
        self.assertIn(SEEN, [json.loads(row["fields"]).get("logical_id") for row in rows])

    def test_json_gives_it_back(self):
        report = json.loads(self.cie("report", "-f", "json"))
        self.assertIn(SEEN, [callback["logical_id"] for callback in report["callbacks"]])
        verdicts = json.loads(self.cie("verify", "-f", "json", code=1))
        subjects = [subject["subject"] for rule in verdicts["rules"] for subject in rule["subjects"]]
        self.assertIn("callback " + SEEN, subjects)

    def test_tables_give_it_back(self):
        for command in ("instances", "report"):
            text = self.cie(command, "--format", "csv").decode()
            rows = list(csv.DictReader(io.StringIO(text, newline="")))
            self.assertIn(SEEN, [row["logical_id"] for row in rows])
            self.assertNotIn(None, [key for row in rows for key in row], "no row is longer than the header")
        lines = self.cie("instances", "--format", "jsonl").decode().split("\n")
        self.assertEqual(lines.pop(), "")
        self.assertEqual(sum(json.loads(line)["logical_id"] == SEEN for line in lines), 7)

    def test_a_terminal_obeys_nothing_in_tables(self):
        for arguments in (["instances"], ["report", "-f", "csv"], ["events", "-f", "csv"], ["export", "--to", "csv"]):
            exact = self.cie(*arguments).decode()
            rows = list(csv.reader(io.StringIO(exact, newline="")))
            code, lines = on_terminal([CIE, arguments[0], self.trace, *arguments[1:]], os.environ, 200)
            # Progress and notes come before.
            shown = lines[len(lines) - len(rows):]
            self.assertEqual((code, shown[0].split(",")), (0, rows[0]), "a line for each row")
            for control in "\x1b\x07\r\t\x9b\u202e":
                self.assertNotIn(control, "".join(shown))

    def test_perfetto_gets_valid_text(self):
        exported = self.cie("export", "--to", "perfetto")
        self.assertIn(SEEN.encode(), exported)
        self.assertNotIn(EVIL, exported)


    def export(self, viewer):
        exported = self.cie("export", "--to", viewer)
        self.assertNotIn(EVIL, exported)
        for control in (b"\x1b", b"\x07", b"\r", b"\t"):  # in JSON they are escaped
            self.assertNotIn(control, exported if viewer != "mcap" else b"")
        return exported

    def test_chrome_gives_it_back(self):
        events = json.loads(self.export("chrome"))["traceEvents"]
        self.assertEqual(sum(event["name"] == SEEN and event["ph"] == "X" for event in events), 7)

    def test_speedscope_gives_it_back(self):
        self.assertIn({"name": SEEN}, json.loads(self.export("speedscope"))["shared"]["frames"])

    def test_otlp_gives_it_back(self):
        lines = self.export("otlp").decode().split("\n")
        self.assertEqual(lines.pop(), "")
        spans = [span for line in lines for resource in json.loads(line)["resourceSpans"]
                 for scope in resource["scopeSpans"] for span in scope["spans"]]
        self.assertEqual(sum(span["name"] == SEEN for span in spans), 7)

    def test_mcap_gets_valid_text(self):
        exported = self.export("mcap")
        self.assertIn(("/callbacks" + SEEN).encode(), exported, "the topic")
        escaped = json.dumps(SEEN, ensure_ascii=False).replace("\x9b", r"\u009b").replace("\u202e", r"\u202e")
        self.assertEqual(exported.count(escaped.encode()), 7, "in each message")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
