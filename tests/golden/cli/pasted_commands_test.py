#!/usr/bin/env python3
"""Commands that reports and verdicts name, pasted into a shell. Arguments: CIE EXAMPLES."""
import csv
import functools
import io
import json
import os
import re
import shutil
import subprocess
import sys
import unittest

from program import CIE, EXAMPLES, Folder, SPEC, TRACE, cie


def whole_commands(text):
    """Those that are broken where a line ends are one command for a shell."""
    return re.sub(r" \\\n +", " ", text)


class ToPaste(Folder):
    """Commands that are printed for pasting."""

    def test_the_evidence_of_a_report_is_that_of_what_was_reported(self):
        spec = os.path.join(self.folder, "a spec's.yaml")
        with open(spec, "w", encoding="utf-8") as file:
            file.write("callback_groups:\n  - id: nobody@Timer(1)\n    response_deadline: 7\n")
        for options in ((), ("--spec", spec), ("--window", "+10ms..-10ms"), ("--spec", spec, "--window=-50ms..")):
            text = cie("report", TRACE, *options, "--all").stdout.decode()
            command, = re.findall(r"^Evidence   (cie verify .*)$", text, re.M)
            told = re.search(r"^Verdict    (PASS|FAIL|INCONCLUSIVE)", text, re.M)[1]
            pasted = subprocess.run(["sh", "-c", command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=200, check=False,
                                    env={**os.environ, "PATH": os.path.dirname(os.path.abspath(CIE)) + ":" + os.environ["PATH"]}).stdout
            self.assertEqual(pasted, cie("verify", TRACE, *options).stdout, command)
            self.assertTrue(pasted.decode().startswith(f"{told}  "), command)

    def test_the_commands_of_a_verdict_judge_likewise(self):
        violating = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
        accepted = self.write("it's.yaml", b'suppressions:\n  - {rule: M3, subject: "*", reason: known, expires: 2026-06-15}\n')
        for options in ((), ("--only", "M2,M9"), ("--skip", "M2"), ("--window=+10ms..-10ms", "--require-lossless", "--allow-crash"),
                        ("--suppressions", accepted, "--now", "2026-06-01"), ("--spec", SPEC, "--check")):
            text = whole_commands(cie("verify", violating, *options).stdout.decode())
            everything, page = (re.search(rf"(?m)(?:^| )  {word}: (cie .*?)(?:    |$)", text)[1] for word in ("evidence", "rule"))
            run = functools.partial(subprocess.run, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=200, check=False,
                                    env={**os.environ, "PATH": os.path.dirname(os.path.abspath(CIE)) + ":" + os.environ["PATH"]})
            self.assertEqual(run(["sh", "-c", everything]).stdout, cie("verify", violating, *options, "--all").stdout, everything)
            self.assertRegex(run(["sh", "-c", page]).stdout.decode(), "^M[23] ")

    def test_what_is_suppressed_is_shown_in_full(self):
        violating = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
        accepted = self.write("ok.yaml", b'suppressions:\n  - {rule: M2, subject: "*", reason: a pool, expires: never}\n')
        options = ("--only", "M2", "--suppressions", accepted)
        text = whole_commands(cie("verify", violating, *options).stdout.decode())
        self.assertRegex(text, r"^PASS  trace: no rule is kept without what is suppressed: M2\n  M2  suppressed for ever: a pool\n")
        command = re.search(r"(?m)^  evidence: (cie .*?)(?:    |$)", text)[1]
        everything = subprocess.run(["sh", "-c", command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=200, check=False,
                                    env={**os.environ, "PATH": os.path.dirname(os.path.abspath(CIE)) + ":" + os.environ["PATH"]}).stdout
        self.assertEqual(everything, cie("verify", violating, *options, "--all").stdout)
        self.assertIn(b"SUPPRESSED FAIL  M2", everything)

    def test_the_events_around_damage_at_an_unknown_time_are_shown(self):
        trace = self.path("cut")
        shutil.copytree(TRACE, trace, copy_function=shutil.copyfile)
        with open(self.path("cut", "ust", "uid", "0", "64-bit", "channel0_1"), "r+b") as stream:
            stream.truncate(100)  # no packet of it is whole
        text = cie("verify", trace, "--only", "T1", "--all").stdout.decode()
        self.assertIn("at an unknown time  damaged_packet", text)
        command, = re.findall(r"^ +(cie events .*)$", text, re.M)
        shown = subprocess.run(["sh", "-c", command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=200, check=False,
                               env={**os.environ, "PATH": os.path.dirname(os.path.abspath(CIE)) + ":" + os.environ["PATH"]})
        self.assertEqual((shown.returncode, shown.stdout), (0, cie("events", trace).stdout))
        told, = json.loads(cie("verify", trace, "--only", "T1", "--format", "json").stdout)["rules"][0]["subjects"]
        self.assertEqual({evidence["time_ns"] for evidence in told["evidence"]}, {None})

    def test_the_commands_of_a_report_show_more_of_the_same(self):
        spec = self.write("a spec's.yaml", b"callback_groups:\n  - id: nobody@Timer(1)\n    response_deadline: 7\n")
        for options in ((), ("--spec", spec), ("--window", "+10ms..-10ms"), ("--ids",)):
            screen = cie("report", TRACE, *options).stdout.decode()
            self.assertLessEqual(len(screen.splitlines()), 23)
            text = whole_commands(screen)
            environment = {**os.environ, "PATH": os.path.dirname(os.path.abspath(CIE)) + ":" + os.environ["PATH"]}
            for label, others in {"all": ["--all"], "threads": ["--threads"], "chains": ["--chains"]}.items():
                told = re.search(rf"(?m)(?:^| )  {label}: (cie report .*?)(?:    |$)", text)
                if not told:  # long ones are told once
                    self.assertIn("in place of --all: --threads", text)
                    continue
                pasted = subprocess.run(["sh", "-c", told[1]], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=200,
                                        check=False, env=environment).stdout
                self.assertEqual(pasted, cie("report", TRACE, *options, *others).stdout, told[1])
                self.assertTrue(pasted)
            rules = re.search(r"(?m)(?:^| )  rules: (cie verify .*?)(?:    |$)", text)[1]
            pasted = subprocess.run(["sh", "-c", rules], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=200, check=False,
                                    env=environment).stdout
            self.assertEqual(pasted, cie("verify", TRACE, *[o for o in options if o != "--ids"]).stdout, rules)

    def test_what_shares_threads_fails_where_somebody_claimed_it_does_not(self):
        shared = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
        spec = self.write("empty.yaml", b"callback_groups: []\n")
        for options, head in (((), "trace: callbacks share threads: 8 of 8\n"),
                              (("--expect", "isolated"), "FAIL  trace: 8 of 8 callbacks share threads\n"),
                              (("--spec", spec), "FAIL  trace: 8 of 8 callbacks share threads\n")):
            done = cie("report", shared, *options)
            self.assertEqual(done.returncode, 0)
            self.assertTrue(done.stdout.decode().startswith(head), done.stdout)
        self.assertEqual(cie("report", shared, "--expect", "shared").returncode, 2)

    def test_late_runs_are_counted(self):
        rows = [row for row in csv.DictReader(io.StringIO(cie("instances", TRACE).stdout.decode()))
                if row["logical_id"] == "/a/plan@Timer(20000000)" and row["end_ns"]]
        times = sorted(int(row["end_ns"]) - int(row["release_ns"]) for row in rows)
        for deadline in (times[0] - 1, times[0], times[3], times[-1] - 1):
            spec = self.write("late.yaml", f"callback_groups:\n  - id: /a/plan@Timer(20000000)\n"
                                           f"    response_deadline: {deadline}\n".encode())
            late = sum(time > deadline for time in times)
            text = cie("verify", TRACE, "--spec", spec).stdout.decode()
            self.assertIn(f"callback missed deadlines: late {late} of {len(times)} instances\n", text)
            self.assertRegex(text, rf"  late {late} of {len(times)}, up to [^,>]* > [^,>]* \(late\.yaml:2\)\n")

    def test_what_lies_below_is_said_to_lie_below(self):
        lost = os.path.join(self.folder, "lost")
        shutil.copytree(TRACE, lost, copy_function=shutil.copyfile)
        streams = [os.path.join(where, name) for where, _, names in os.walk(os.path.join(lost, "ust")) for name in names
                   if name != "metadata" and os.path.basename(where) != "index"]
        os.remove(max(streams, key=os.path.getsize))
        text = cie("report", lost, "--all").stdout.decode()
        self.assertLess(text.index("see the defects below"), text.index("Defects of the trace"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
