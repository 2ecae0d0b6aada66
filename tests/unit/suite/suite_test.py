#!/usr/bin/env python3
"""tests/suite.py with suites of shell commands. Argument: the script."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SUITE = os.path.abspath(sys.argv[1])
ONCE = 'test -e "$FLAG" || { touch "$FLAG"; echo "a_test.cpp:7: Failure"; echo "Expected: 1"; exit 1; }'


class Suite(unittest.TestCase):
    def run_suite(self, tests, *options, more=()):
        """`tests`: name → shell command, where $FLAG is a file of its own; `more`: lines of CTest's file. Returns the exit code, the
        output, the short text."""
        folder = tempfile.TemporaryDirectory(prefix="cie-suite-")
        self.addCleanup(folder.cleanup)
        self.tree = Path(folder.name)
        lines = []
        for number, (name, command) in enumerate(tests.items()):
            lines += [f"add_test([=[{name}]=] sh -c [=[echo ran >>'{self.tree}/runs-{name}'; {command}]=])",
                      f"set_tests_properties([=[{name}]=] PROPERTIES LABELS unit TIMEOUT 20 ENVIRONMENT FLAG={self.tree}/flag-{number})"]
        (self.tree / "CTestTestfile.cmake").write_text("\n".join([*lines, *more]), "utf-8")
        done = subprocess.run([sys.executable, SUITE, self.tree, self.tree / "tests", *options],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=200, check=False)
        return done.returncode, done.stdout, (self.tree / "tests.txt").read_text("utf-8")

    def runs(self, name):
        return (self.tree / f"runs-{name}").read_text("ascii").count("ran")

    def test_a_live_test_that_fails_once_passes_and_is_named(self):
        name = "live.As.Counts(User)  # GetParam() = a [user]"
        code, out, brief = self.run_suite({"unit.other": "true", name: ONCE, "live.other": "true"})
        self.assertEqual(code, 0, out)
        self.assertEqual([self.runs(test) for test in ("unit.other", name, "live.other")], [1, 2, 1], "nothing else runs again")
        self.assertEqual(brief, f"passed only when run again: {name} (Failed)\n    a_test.cpp:7: Failure\n    Expected: 1\n")
        self.assertTrue(out.endswith(brief), out)

    def test_it_is_what_failed_that_runs_again_whatever_was_left_out(self):
        fails = 'echo "AssertionError: 1 != 2"; exit 1'
        for options in (("-E", "^unit"), ("-R", "^live"), ("-E", "^unit", "-R", "a$")):
            with self.subTest(options):
                code, out, brief = self.run_suite({"unit.a": "true", "unit.b": "true", "live.a": fails, "live.aa": "true"}, *options)
                self.assertEqual((code, self.runs("live.a"), self.runs("live.aa")), (1, 2, 1), out)
                self.assertEqual(brief, "FAILED: live.a (Failed)\n    AssertionError: 1 != 2\n")

    def test_a_live_test_that_fails_twice_fails(self):
        code, out, brief = self.run_suite({"live.a": "seq 200; echo 'AssertionError: 1 != 2 : seconds'; exit 1"})
        self.assertEqual((code, self.runs("live.a")), (1, 2))
        self.assertEqual(brief, "FAILED: live.a (Failed)\n    AssertionError: 1 != 2 : seconds\n")
        shown = out[out.rindex("the end of its output"):]
        self.assertIn("\n142\n", shown, "60 lines with the last")
        self.assertNotIn("\n141\n", shown)

    def test_other_kinds_never_run_again(self):
        for name in ("unit.a", "golden.a", "property.a", "package.a"):
            with self.subTest(name):
                code, out, brief = self.run_suite({name: ONCE})
                self.assertEqual((code, self.runs(name)), (1, 1), out)
                self.assertIn(f"FAILED: {name} (Failed)", brief)

    def test_what_crashed_or_a_sanitizer_reported_never_runs_again(self):
        for end in ("kill -SEGV $$", "kill -ABRT $$", "echo 'WARNING: ThreadSanitizer: data race (pid=1)'; exit 66",
                    "echo 'a.cpp:1:2: runtime error: signed integer overflow'; exit 1"):
            with self.subTest(end):
                code, out, brief = self.run_suite({"live.a": f'test -e "$FLAG" || {{ touch "$FLAG"; {end}; }}'})
                self.assertEqual((code, self.runs("live.a")), (1, 1), out)
                self.assertIn("FAILED: live.a", brief)

    def test_many_failures_are_no_accident(self):
        names = [f"live.{number}" for number in range(11)]
        code, out, _ = self.run_suite({name: ONCE for name in names}, "-j", "2")
        self.assertEqual((code, [self.runs(name) for name in names]), (1, [1] * 11), out)

    def test_of_a_program_of_many_tests_those_that_failed_are_named(self):
        code, out, brief = self.run_suite({"unit.program": """cat <<'END'
[ RUN      ] A.passes
[       OK ] A.passes (0 ms)
[ RUN      ] A.fails
a_test.cpp:7: Failure
Expected: 1
[  FAILED  ] A.fails (0 ms)
[ RUN      ] A.races
WARNING: ThreadSanitizer: data race (pid=1)
[       OK ] A.races (0 ms)
END
exit 1"""})
        self.assertEqual(code, 1, out)
        self.assertEqual(brief.splitlines(), [
            "FAILED: unit.program (Failed)",
            "    [ RUN      ] A.fails", "    a_test.cpp:7: Failure", "    Expected: 1", "    [  FAILED  ] A.fails (0 ms)",
            "    [ RUN      ] A.races", "    WARNING: ThreadSanitizer: data race (pid=1)", "    [       OK ] A.races (0 ms)"])

    def test_everything_passing_says_nothing_more(self):
        code, out, brief = self.run_suite({"unit.a": "true", "live.b": "true"})
        self.assertEqual((code, brief), (0, ""), out)

    def test_no_tests_and_skips_without_a_reason_fail(self):
        code, _, brief = self.run_suite({"unit.a": "true"}, "-R", "nothing")
        self.assertEqual((code, brief), (1, "FAILED: ctest did not come to its end\n"))
        code, _, brief = self.run_suite({"unit.b": "echo 'test_a (m.C.test_a) ... skipped \"no program\"'"})
        self.assertEqual((code, brief), (1, "FAILED: 1 skipped tests could have run here\n"))
        for reason, expected in (("no program", 1), ("not possible here: no PMU", 0)):
            code, out, _ = self.run_suite({"unit.program": f"""cat <<'END'
[ RUN      ] A.skips
a_test.cpp:7: Skipped
{reason}
[  SKIPPED ] A.skips (0 ms)
[ RUN      ] A.passes
[       OK ] A.passes (0 ms)
[  SKIPPED ] 1 test, listed below:
[  SKIPPED ] A.skips
END"""})
            self.assertEqual(code, expected, out)
            self.assertEqual(out.count("skipped: unit.program: A.skips: "), 1, out)
        self.assertEqual(self.run_suite({"unit.c": "echo 'test_a (m.C.test_a) ... skipped \"not possible here: no PMU\"'"})[0], 0)

    def test_what_lacked_its_fixture_was_not_skipped(self):
        code, out, brief = self.run_suite({"unit.setup": "echo wrong; false", "unit.user": "true"}, more=[
            "set_tests_properties(unit.setup PROPERTIES FIXTURES_SETUP ready)",
            "set_tests_properties(unit.user PROPERTIES FIXTURES_REQUIRED ready)"])
        self.assertEqual((code, brief), (1, "FAILED: unit.setup (Failed)\n    wrong\n"
                                            "FAILED: unit.user (Not Run)\n    Failed test dependencies: unit.setup\n"), out)

    def test_what_lacked_the_fixture_of_a_live_test_runs_again_with_it(self):
        fixture = ["set_tests_properties(live.setup PROPERTIES FIXTURES_SETUP ready)",
                   "set_tests_properties(live.user PROPERTIES FIXTURES_REQUIRED ready)"]
        code, out, brief = self.run_suite({"live.setup": ONCE, "live.user": "true"}, more=fixture)
        self.assertEqual(code, 0, out)
        self.assertEqual([line for line in brief.splitlines() if line[0] != " "],
                         ["passed only when run again: live.setup (Failed)", "passed only when run again: live.user (Not Run)"])
        self.assertEqual((self.runs("live.setup"), self.runs("live.user")), (2, 1))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
