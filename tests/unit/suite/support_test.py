#!/usr/bin/env python3
"""What tests in Python share: how they run cie, and how live ones wait. Argument: TESTS."""
import sys
import tempfile
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(sys.argv[1], folder)) for folder in ("support", "live")]
from cie import Cie, rules_of, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402  pylint: disable=wrong-import-position

JUDGED = {"rules": [{"id": "M2", "verdict": "FAIL", "subjects": []}, {"id": "T1", "verdict": "PASS", "subjects": []}]}


class RunsCie(unittest.TestCase):
    def program(self, code, output="", error=""):
        """A double of cie, which says its arguments where it is told nothing else."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        file = Path(folder.name, "cie")
        file.write_text(f"#!/bin/sh\nprintf '%s' '{output}'\n[ '{output}' ] || echo \"$@\"\necho '{error}' >&2\nexit {code}\n", "utf-8")
        file.chmod(0o755)
        return Cie(file)

    def test_tells_what_it_prints_and_what_it_refuses(self):
        self.assertEqual(self.program(0).text("report", Path("/trace")), "report /trace\n")
        self.assertEqual(self.program(2, error="no such option").refusal("report", code=2), "no such option\n")
        done = self.program(4, error="no trace").run("report")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (4, "report\n", "no trace\n"))

    def test_another_exit_code_fails_with_what_was_said(self):
        for ask in (Cie.text, Cie.json, Cie.verdicts, lambda cie, *arguments: cie.refusal(*arguments, code=2)):
            with self.assertRaisesRegex(AssertionError, "/trace.* 4, .*no trace"):
                ask(self.program(4, error="no trace"), "/trace")

    def test_a_verdict_is_an_answer(self):
        judged = '{"rules": [{"id": "M2", "verdict": "FAIL"}]}'
        for code in (0, 1, 3):
            self.assertEqual(self.program(code, judged).verdicts("/trace"), {"M2": "FAIL"})

    def test_line_ends_stay(self):
        self.assertEqual(self.program(0, "a\r\nb").text("report"), "a\r\nb")

    def test_rules_by_their_ids(self):
        self.assertEqual(rules_of(JUDGED)["T1"], JUDGED["rules"][1])
        self.assertEqual(verdicts_of(JUDGED), {"M2": "FAIL", "T1": "PASS"})


class Waits(unittest.TestCase):
    def test_for_the_first_result_that_is_true(self):
        results = iter((None, 0, "it", "more"))
        self.assertEqual(wait_for(lambda: next(results), "it"), "it")

    def test_no_longer_than_it_may_and_says_for_what(self):
        with self.assertRaisesRegex(AssertionError, "never within 0.05 s: the application"):
            wait_for(lambda: False, "the application", 0.05)

    def test_what_is_there_is_found_however_late_it_looks(self):
        self.assertTrue(wait_for(lambda: True, "it", 0))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
