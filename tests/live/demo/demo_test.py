#!/usr/bin/env python3
"""The demo for somebody who sees it for the first time: one screenful after another on a terminal of 80 columns,
exit code 0 on a machine that is busy, too. How late what was is asserted nowhere."""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from on_terminal import on_terminal  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
COLUMNS = 80
LINES = 60
LINES_WHERE_TIME_RULES_FAIL = LINES + 4  # it says so, and that the machine may be busy
ORDINARY = 65534


class Demo(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="cie-demo-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def run_demo(self, user=None):
        if user is not None:
            os.chown(self.folder, user, user)
            if subprocess.run(["setpriv", f"--reuid={user}", "--clear-groups", "test", "-x", options.programs / "cie"],
                              check=False).returncode != 0:
                self.skipTest("not possible here: other users may not execute what was built")
        environment = {**os.environ, "PATH": f"{options.programs}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8", "TERM": "xterm",
                       "NO_COLOR": "1", "HOME": str(self.folder), "CIE_DEMO_SECONDS": "2"}
        code, lines = on_terminal([options.sources / "executor/examples/demo/compare_executors",
                                   self.folder / "out"], environment, COLUMNS, user)
        text = "\n".join(lines)
        self.assertEqual(code, 0, text)
        self.check(lines, text)
        return text

    def check(self, lines, text):
        self.assertEqual([line for line in lines if len(line) > COLUMNS], [], text)
        is_isolated_on_time = "✓ PASS  isolated: 28 of 28 callbacks had a thread of their own" in text
        self.assertLessEqual(len(lines), LINES if is_isolated_on_time else LINES_WHERE_TIME_RULES_FAIL, text)
        if not is_isolated_on_time:
            self.assertRegex(" ".join(text.split()), "(not all was in time|is not decided): is this machine busy\\?")
        self.assertRegex(text, r"\nLate: \d+ of \d+ instances before, \d+ of \d+ after; 19 callbacks have a deadline\n")
        self.assertRegex(text, r"\n  isolation  0 of 28 callbacks had a thread of their own before, 28 of 28 after\n")
        if "\nTimes undecided" not in text:
            self.assertRegex(text, r"\n  callback +quantity +before +after +change\n")
        self.assertIn("✗ FAIL  multi: 28 of 28 callbacks share threads", text)
        self.assertIn("  → run with --executor isolated", text)
        named = re.search(r"== 4\. Pictures, in (\S+)\n  (\S+), (\S+)  .*\n  (\S+), (\S+)  ", text)
        for name in named.groups()[1:]:
            self.assertGreater((Path(named[1]) / name).stat().st_size, 10_000, name)

    def test_as_whoever_runs_the_tests(self):
        self.run_demo()

    def test_as_an_ordinary_user(self):
        if os.geteuid() != 0:
            self.skipTest("not possible here: only root may become somebody else")
        text = self.run_demo(ORDINARY)
        self.assertIn("No right to real-time scheduling here: demo.yaml asks for nice values only.\n", text)
        self.assertIn("No kernel events, so who had the CPU is not known (why: ", text)

    def test_it_explains_itself(self):
        run = options.sources / "run"
        done = subprocess.run([run, "demo", "--help"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue(done.stdout.startswith("usage: ./run demo\n"))
        self.assertLessEqual(max(map(len, done.stdout.splitlines())), COLUMNS)
        self.assertEqual(subprocess.run([run, "demo", "quickly"], capture_output=True, check=False).returncode, 2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--sources", type=Path, required=True)
    options = parser.parse_args()
    unittest.main(argv=sys.argv[:1], verbosity=2)
