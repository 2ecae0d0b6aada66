#!/usr/bin/env python3
"""The cie program from outside: which commands and options there are, and what is refused with which words. Arguments: CIE EXAMPLES."""
import gzip
import json
import os
import pathlib
import re
import shutil
import sys
import tempfile
import unittest
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "browser"))
from other_host import on_host  # pylint: disable=wrong-import-position
from program import CIE, COMMANDS, EXAMPLES, Folder, SPEC, TRACE, cie


class Help(unittest.TestCase):
    def test_alone_it_prints_an_overview(self):
        for arguments in ((), ("--help",), ("-h",), ("help",)):
            result = cie(*arguments)
            self.assertEqual((result.returncode, result.stderr), (0, b""))
            self.assertLessEqual(max(map(len, result.stdout.decode().splitlines())), 80)
            for command in COMMANDS + ("run", "record"):
                self.assertIn(f"\n  {command} ".encode(), result.stdout)

    def test_version(self):
        self.assertRegex(
            cie("--version").stdout,
            rb"^cie \d+\.\d+\.\d+\n"
            rb"(commit [0-9a-f]{12}(-dirty)?, )?built with (g\+\+|clang) \d+\..*\n"
            rb"libgcrypt 1\.\S+, SQLite 3\.\S+, zlib 1\.\S+\n$")

        live = cie("--version", program=os.path.join(os.path.dirname(CIE), "cie-live"))
        self.assertRegex(live.stdout, rb"^cie-live \d+\.\d+\.\d+\nlibbabeltrace2 2\.\d+\.\d+\n$")

    def test_every_command_explains_itself(self):
        for command in COMMANDS:
            result = cie(command, "--help")
            self.assertEqual((result.returncode, result.stderr), (0, b""))
            self.assertEqual(result.stdout, cie("help", command).stdout)
            text = result.stdout.decode()
            self.assertTrue(text.startswith(f"Usage: cie {command} "), text)
            self.assertRegex(text, r"\nExamples?:\n  cie " + command)
            self.assertIn("\nExit codes: 0 ", text)
            self.assertLessEqual(max(map(len, text.splitlines())), 80, command)


class Usage(Folder):
    def assert_usage_error(self, arguments, message):
        result = cie(*arguments)
        self.assertEqual(result.returncode, 2, arguments)
        self.assertEqual(result.stdout, b"")
        lines = result.stderr.decode().splitlines()
        self.assertEqual(lines[0], "cie: " + message)
        self.assertRegex(lines[1], r"^Try: cie .*--help$")
        self.assertEqual(len(lines), 2)

    def test_a_value_that_is_empty(self):
        """As of a variable that a script does not have: the recording would be judged by no spec."""
        for arguments in (("verify", TRACE, "--spec", ""), ("report", "--window", "", TRACE), ("verify", TRACE, "--only", "")):
            option = next(argument for argument in arguments if argument.startswith("--"))
            result = cie(*arguments)
            self.assertEqual((result.returncode, result.stdout), (2, b""), arguments)
            self.assertIn(f"cie: {option} needs a value: {option} ".encode(), result.stderr)

    def test_a_directory_without_a_name(self):
        self.assert_usage_error(("export", TRACE, "--to", "parquet", "--partition", "-o", ""),
                                "--output needs a value: --output FILE")

    def test_a_recording_that_is_elsewhere(self):
        """Of one that was streamed this machine has the manifest."""
        streamed = {"schema": "cie.recording/1", "relay": {"address": "desk:5342", "sessions": [{"path": "robot/run-1"}]}}
        os.mkdir(self.path("streamed"))
        directory = os.path.dirname(self.write("streamed/manifest.json", json.dumps(streamed).encode()))
        for command in ("report", "verify", "events"):
            result = cie(command, directory)
            self.assertEqual((result.returncode, result.stdout), (4, b""))
            self.assertIn(b"it was streamed to desk:5342: read it there, in the directory of cie collect, as robot/run-1",
                          result.stderr)

    def test_streams_that_have_lost_their_metadata(self):
        """Whoever reads the rest alone would say that nothing was lost."""
        for part in ("kernel", os.path.join("ust", "uid", "0", "64-bit")):
            copy = self.path("copy")
            shutil.copytree(TRACE, copy, copy_function=shutil.copyfile)
            metadata = os.path.join(copy, part, "metadata")
            os.rename(metadata, self.path("metadata"))
            for file in os.listdir(os.path.dirname(metadata)):
                os.rename(os.path.join(copy, part, file), os.path.join(copy, part, "other_" + file))
            result = cie("verify", copy)
            self.assertEqual((result.returncode, result.stdout), (4, b""))
            self.assertIn(os.path.join(copy, part).encode() + b": its metadata", result.stderr)
            self.assertIn(b"or read it with --metadata", result.stderr)
            self.assertEqual(json.loads(cie("report", copy, "--metadata", self.path("metadata"), "-f", "json").stdout)["trace"]["events"],
                             json.loads(cie("report", TRACE, "-f", "json").stdout)["trace"]["events"])
            shutil.rmtree(copy)

    def test_a_recording_that_is_being_made(self):
        copy = os.path.join(self.folder, "running")
        shutil.copytree(TRACE, copy, copy_function=shutil.copyfile)
        self.assertEqual(cie("report", copy).stderr, b"")
        self.write("running/.cie-record", b"")
        self.assertIn(b"running is still being recorded, or its recorder was killed", cie("report", copy).stderr)

    def test_misspelt(self):
        self.assert_usage_error(("verfy", TRACE), 'there is no command "verfy"; did you mean "verify"?')
        self.assert_usage_error(("live", "./run1"), '"./run1" is neither a session\'s name nor its net:// URL; '
                                                 "a recording is read by cie report")
        self.assert_usage_error(("verify", TRACE, "--sepc", "x"), 'unknown option "--sepc"; did you mean "--spec"?')
        self.assert_usage_error(("report", TRACE, "--fromat=json"),
                                'unknown option "--fromat"; did you mean "--format"?')
        self.assert_usage_error(("report", TRACE, "--zzz"), 'unknown option "--zzz"')
        self.assert_usage_error(("--verison",), 'there is no command "--verison"; did you mean "--version"?')

    def test_missing(self):
        for command in ("report", "instances", "events", "verify"):
            self.assert_usage_error((command,), "no TRACE was given: name the directory that a recording is in")
        self.assert_usage_error(("export", TRACE), "--to is missing: name the viewer, for instance --to perfetto")
        self.assert_usage_error(("spec", "check"), "no FILE was given: name the spec to check")
        self.assert_usage_error(("spec", "template"),
                                "no TRACE was given: name the directory that a recording is in")
        for arguments in (("report", TRACE, "--spec"), ("report", TRACE, "-o"), ("report", TRACE, "-f", "a", "-f", "b")):
            self.assertEqual(cie(*arguments).returncode, 2, arguments)

    def test_rules_are_chosen(self):
        def rules(*arguments):
            return [r["id"] for r in json.loads(cie("verify", TRACE, "-f", "json", *arguments).stdout)["rules"]]
        everything = rules()
        self.assertEqual(rules("--only", "m2,M3"), ["M2", "M3"])
        self.assertEqual(rules("--skip", "M2,T1"), [r for r in everything if r not in ("M2", "T1")])
        self.assert_usage_error(("verify", TRACE, "--only", "M2,Z9"),
                                '--only: there is no rule "Z9"; cie verify --list-rules names them all')
        self.assert_usage_error(("verify", TRACE, "--only", "M2", "--skip", "M3"),
                                "--only and --skip exclude each other: name the rules that count, or those that do not")

    def test_no_rule_is_no_pass(self):
        everything = [r["id"] for r in json.loads(cie("verify", TRACE, "-f", "json").stdout)["rules"]]
        self.assert_usage_error(("verify", TRACE, "--skip", ",".join(everything)),
                                "--skip leaves no rule: nothing would be checked")

    def test_nothing_judged_is_no_pass(self):
        judged = cie("verify", TRACE, "--only", "S1")  # which asks for a spec
        self.assertEqual(judged.returncode, 3)
        self.assertIn(b"INCONCLUSIVE", judged.stdout)
        self.assertIn(b"nothing was judged", judged.stdout)
        self.assertNotIn(b"PASS", judged.stdout)
        self.assertEqual(cie("verify", TRACE, "--only", "S1", "--inconclusive", "warn").returncode, 0)
        self.assertEqual(json.loads(cie("verify", TRACE, "--only", "S1", "-f", "json").stdout)["verdict"], "INCONCLUSIVE")

    def test_behind_two_dashes_all_are_arguments(self):
        shutil.copytree(TRACE, self.path("-dash"))
        told = cie("instances", "--", "-dash", cwd=self.folder)
        self.assertEqual((told.returncode, told.stdout), (0, cie("instances", TRACE).stdout), told.stderr)

    def test_what_is_left_out_has_no_say(self):
        violating = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
        self.assertEqual(cie("verify", violating).returncode, 1)
        self.assertEqual(cie("verify", violating, "--only", "T1").returncode, 0)

    def suppressions(self, *fields):
        lines = "".join(f"  - {{rule: {rule}, subject: \"{subject}\", reason: known, expires: {expires}}}\n"
                        for rule, subject, expires in fields)
        return self.write("accepted.yaml", ("suppressions:\n" + lines).encode())

    def test_what_is_suppressed_has_no_say_until_it_expires(self):
        violating = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
        rules = [r["id"] for r in json.loads(cie("verify", violating, "-f", "json").stdout)["rules"]
                 if r["verdict"] in ("FAIL", "INCONCLUSIVE")]
        file = self.suppressions(*((rule, "*", "2026-06-15") for rule in rules))
        for date, code in (("2026-06-15", 0), ("2026-06-16", 1)):
            for form in ("text", "json", "junit", "sarif", "tap"):
                result = cie("verify", violating, "--suppressions", file, "--now", date, "-f", form, "--all")
                self.assertEqual((result.returncode, result.stderr), (code, b""))
                self.assertIn(b"known", result.stdout)
        self.assertEqual(cie("verify", violating, "--suppressions", self.suppressions(("R9", "*", "never"))).returncode, 2)
        forever = self.suppressions(*((rule, "*", "never") for rule in rules))
        self.assertEqual(cie("verify", violating, "--suppressions", forever).returncode, 0)

    def test_a_bad_suppressions_file_is_named_with_its_line(self):
        file = self.suppressions(("R2", "*", "tomorrow"))
        result = cie("verify", TRACE, "--suppressions", file)
        self.assertEqual((result.returncode, result.stdout), (2, b""))
        self.assertEqual(result.stderr.decode(),
                         f'cie: {file}:2: entry "R2 *": "expires" is "tomorrow"; write its last day as in '
                         "2026-12-31, or never\n")
        self.assert_usage_error(("verify", TRACE, "--now", "2026-01-01"),
                                "--now is the day that suppressions expire by: add --suppressions FILE")
        self.assert_usage_error(("verify", TRACE, "--suppressions", file, "--now", "today"),
                                '--now takes a date such as 2026-12-31, and not "today"')

    def test_a_window_is_judged_alone(self):
        begin, end = (json.loads(cie("report", TRACE, "-f", "json").stdout)["trace"][key] for key in ("begin_ns", "end_ns"))
        middle = begin + 50_000_000
        for text, window in ((f"{middle}..{middle + 7}", (middle, middle + 7)), ("+50ms..", (middle, end)),
                             ("..-0.01s", (begin, end - 10_000_000)), ("+50ms..-10ms", (middle, end - 10_000_000)),
                             (f"..{middle}", (begin, middle)), ("..", (begin, end)), ("-9s..+9s", (begin, end))):
            arguments = (TRACE, f"--window={text}", "-f", "json")
            result = cie("verify", *arguments)
            self.assertEqual(json.loads(result.stdout)["window"], {"begin_ns": window[0], "end_ns": window[1]}, text)
            self.assertEqual(result.returncode, 3 if text.startswith(str(middle)) else 0, text)
            trace = json.loads(cie("report", *arguments).stdout)["trace"]
            self.assertEqual((trace["begin_ns"], trace["end_ns"]), window)
        for form in ("text", "junit", "sarif", "tap"):
            self.assertIn(str(middle).encode(), cie("verify", TRACE, "--window", f"{middle}..", "-f", form).stdout)
        for command in (("verify", "-q"), ("report",), ("report", "--all"), ("report", "-f", "html")):
            self.assertIn(str(middle).encode(), cie(command[0], TRACE, "--window", f"{middle}..", *command[1:]).stdout)

    def test_a_window_outside_the_recording(self):
        for window in ("1..2", "+100s..", "+9223372036854775807ns..", "..1"):
            for command in (("report",), ("verify",), ("events",), ("events", "--count")):
                with self.subTest(window=window, command=command):
                    result = cie(command[0], TRACE, f"--window={window}", *command[1:])
                    self.assertEqual((result.returncode, result.stdout), (2, b""))
                    self.assertIn(f"--window {window} lies outside the recording".encode(), result.stderr)

    def test_a_window_of_machines_with_clocks_of_their_own(self):
        """Of two machines the second one was booted 5 s later; two containers of one machine share its clock."""
        with tempfile.TemporaryDirectory() as folder:
            machines = (TRACE, on_host(TRACE, "other", f"{folder}/other", 5_000_000_000))
            containers = (TRACE, on_host(TRACE, "container", f"{folder}/container"))
            begin = json.loads(cie("report", TRACE, "-f", "json").stdout)["trace"]["begin_ns"]
            for window in ("+0s..", f"{begin}.."):
                for command in (("report",), ("verify",), ("events",), ("events", "--count"), ("analyze", "schedulability")):
                    with self.subTest(window=window, command=command):
                        result = cie(*command, *machines, f"--window={window}")
                        self.assertEqual((result.returncode, result.stdout), (2, b""))
                        self.assertIn(b"--window: a window is by one clock, and the recording is of machines that have their own",
                                      result.stderr)
                        self.assertNotEqual(cie(*command, machines[1], f"--window={window}").returncode, 4)
                        self.assertNotIn(cie(*command, *containers, f"--window={window}").returncode, (2, 4))

    def test_a_bad_window(self):
        trace = json.loads(cie("report", TRACE, "-f", "json").stdout)["trace"]
        milliseconds = f"{(trace['end_ns'] - trace['begin_ns']) / 1e6:.1f}"
        recorded = f", which is +0s..+{milliseconds}ms, {trace['begin_ns']}..{trace['end_ns']} ns"
        for text, message in (("5", '--window does not understand "5"; write FROM..TO, each of them nanoseconds as outputs '
                                    "show them, +1.5s from the begin, -200ms from the end, or nothing; units are ns, "
                                    "us, ms, s and min"),
                              ("2..1", "--window 2..1 is empty: it begins at 2 ns and ends at 1 ns"),
                              ("1..2", "--window 1..2 lies outside the recording" + recorded),
                              ("+1h..", '--window does not understand "+1h"; write FROM..TO, each of them nanoseconds as '
                                        "outputs show them, +1.5s from the begin, -200ms from the end, or nothing; units "
                                        "are ns, us, ms, s and min")):
            self.assert_usage_error(("verify", TRACE, "--window", text), message)

    def test_schedulability(self):
        result = cie("analyze", "schedulability", TRACE, "-f", "json")
        document = json.loads(result.stdout)
        self.assertEqual(document["schema"], "cie.schedulability/1")
        told = document["deadlines"]
        is_undecided = told["count"] > 0 and told["decided"] == 0
        self.assertEqual(result.returncode, 1 if document["finding"] else 3 if is_undecided else 0, result.stderr)
        ids = [c["logical_id"] for c in json.loads(cie("report", TRACE, "-f", "json").stdout)["callbacks"]]
        self.assertEqual([c["logical_id"] for c in document["callbacks"]], ids)
        self.assert_usage_error(("analyze",), "say what to analyze: cie analyze schedulability TRACE")
        self.assert_usage_error(("analyze", "schedulabilty", TRACE),
                                'cie analyze does not know "schedulabilty"; did you mean "schedulability"? '
                                "available: schedulability")

    @unittest.skipIf("CIE_EMULATED" in os.environ, "not possible here: the emulator does not tell that posix_spawn() failed")
    def test_a_graph_is_drawn_where_graphviz_is(self):
        dot = cie("export", TRACE, "--to", "dot")
        self.assertEqual(dot.returncode, 0)
        self.assertIn(b"/a/plan@Timer(20000000)", dot.stdout)
        nowhere = cie("export", TRACE, "--to", "svg", env={**os.environ, "PATH": self.folder})
        self.assertEqual((nowhere.returncode, nowhere.stdout), (4, b""))
        self.assertIn(b"install graphviz, or use --to dot", nowhere.stderr)
        if shutil.which("dot") is None:
            self.skipTest("graphviz is not installed")
        svg = cie("export", TRACE, "--to", "svg")
        self.assertEqual(svg.returncode, 0, svg.stderr)
        texts = [e.text for e in xml.etree.ElementTree.fromstring(svg.stdout).iter("{http://www.w3.org/2000/svg}text")]
        self.assertIn("plan timer 20 ms", texts)

    def test_live_refuses_what_it_cannot_do(self):
        for arguments, message in ((("--batch", "--json"), "--batch or --json, not both"),
                                   (("net://x/host/y/z", "--", "true"), "a session or a command, not both"),
                                   (("--",), "no command after --"),
                                   (("--interval", "0"), '--interval takes 0.1 to 3600, and not "0"'),
                                   (("--interval", "1s"), '--interval takes 0.1 to 3600, and not "1s"'),
                                   (("-n", "0"), '--count takes 1 to 1000000000, and not "0"'),
                                   (("-n", "1.5"), '--count takes 1 to 1000000000, and not "1.5"'),
                                   (("-n", ""), "--count needs a value: --count COUNT"),
                                   (("--listen", ""), "--listen needs a value: --listen [ADDRESS:]PORT"),
                                   (("",), "SESSION is empty"),
                                   (("--sort", "colour"), '--sort does not know "colour"; available: p99, p50, max, rate, late, missed, name'),
                                   (("--listen", "127.0.0.1:"),
                                    '--listen takes [ADDRESS:]PORT, a port from 0 (any free one) to 65535: "127.0.0.1:"'),
                                   (("--listen", "65536"), '--listen takes [ADDRESS:]PORT, a port from 0 (any free one) to 65535: "65536"'),
                                   (("--batch", "--instances"), "--instances goes with --json")):
            with self.subTest(arguments=arguments):
                self.assert_usage_error(("live", *arguments), message)

    def test_viewers(self):
        self.assert_usage_error(("export", TRACE, "--to", "chrom"), '--to does not know "chrom"; did you mean "chrome"? available: perfetto, chrome,'
                                " speedscope, otlp, mcap, dot, svg, sqlite, csv, jsonl, parquet")
        self.assert_usage_error(("export", TRACE, "--to", "mcap", "--gzip"), "--gzip is for --to perfetto, chrome, speedscope and otlp")
        self.assert_usage_error(("export", TRACE, "--to", "csv", "--gzip"), "--gzip is for --to perfetto, chrome, speedscope and otlp")
        for viewer in ("chrome", "speedscope", "otlp"):
            self.assertIn(viewer, cie("export", "--help").stdout.decode())
            plain = cie("export", TRACE, "--to", viewer)
            packed = cie("export", TRACE, "--to", viewer, "--gzip")
            self.assertEqual((plain.returncode, packed.returncode), (0, 0), plain.stderr + packed.stderr)
            self.assertEqual(gzip.decompress(packed.stdout), plain.stdout)

    def test_unknown_choices(self):
        self.assert_usage_error(("verify", TRACE, "--inconclusive", "wran"),
                                '--inconclusive does not know "wran"; did you mean "warn"? available: warn, fail')
        self.assert_usage_error(("verify", "--explain", "Z9"),
                                '--explain: there is no rule "Z9"; cie verify --list-rules names them all')


class Rules(unittest.TestCase):
    def test_list_and_pages(self):
        lines = cie("verify", "--list-rules").stdout.decode().splitlines()
        ids = [line.split()[0] for line in lines]
        self.assertEqual(ids[:6], ["T1", "T2", "T3", "T4", "T5", "T6"])
        self.assertIn("M2  one-callback-per-thread", lines)
        self.assertEqual(len(ids), len(set(ids)))
        for rule in ids:
            page = cie("verify", "--explain", rule.lower())
            self.assertEqual(page.returncode, 0)
            self.assertTrue(page.stdout.decode().startswith(rule + " "), page.stdout)
            self.assertGreater(len(page.stdout), 100, "a page explains")


class Spec(Folder):
    def test_what_is_not_applied_is_said(self):
        spec = self.write("more.yaml", b"callback_groups: []\nirqs:\n  - {irq: 5, affinity: [1]}\n")
        result = cie("spec", "check", spec)
        self.assertEqual(result.returncode, 0)
        self.assertIn(b'more.yaml:3: note: "irqs" is about the machine and is not applied',
                      result.stdout)

    def test_periods_that_linux_refuses_are_said(self):
        entry = b"  - {id: /a@Timer(%d), policy: SCHED_DEADLINE, runtime: 10us, deadline: 20us, period: %s}\n"
        periods = (b"99us", b"100us", b"4194304us", b"4194305us")
        spec = self.write("deadline.yaml", b"callback_groups:\n" + b"".join(
            entry % (number, period) for number, period in enumerate(periods, 1)))
        result = cie("spec", "check", spec)
        self.assertEqual(result.returncode, 0)
        notes = re.findall(r"deadline\.yaml:(\d+): note: Linux refuses", " ".join(result.stdout.decode().split()))
        self.assertEqual(notes, ["2", "5"])

    def test_a_good_spec(self):
        result = cie("spec", "check", SPEC)
        self.assertEqual(result.returncode, 0)
        words = " ".join(result.stdout.decode().split())  # a long path takes more lines
        self.assertRegex(words, r"good: \d+ callbacks?, \d+ threads?, \d+ chains? sha256 [0-9a-f]{64}$")

    def test_a_bad_spec_is_named_with_its_line(self):
        spec = self.write("bad.yaml", b"callback_groups:\n  - id: /a@Timer(1)\n    policy: SCHED_OTHER\n    nice: 50\n")
        for arguments in (("spec", "check", spec), ("verify", TRACE, "--spec", spec), ("report", TRACE, "--spec", spec)):
            result = cie(*arguments)
            self.assertEqual((result.returncode, result.stdout), (2, b""), arguments)
            self.assertIn(b"bad.yaml:", result.stderr)

    def test_a_missing_spec(self):
        result = cie("verify", TRACE, "--spec", self.path("none.yaml"))
        self.assertEqual((result.returncode, result.stdout), (2, b""))
        self.assertIn(b"none.yaml", result.stderr)


class Doctor(Folder):
    def test_problems_decide_the_exit_code_and_come_with_advice(self):
        done = cie("doctor", "--root", self.folder, "-f", "json")
        report = json.loads(done.stdout)
        self.assertEqual((report["schema"], done.returncode), ("cie.doctor/1", 1))  # no real time, no /dev/shm
        counted = [check["health"] for check in report["checks"]]
        self.assertEqual((report["problems"], report["warnings"]),
                         (counted.count("problem"), counted.count("warning")))
        for check in report["checks"]:
            self.assertEqual(check["advice"] is None, check["health"] == "ok", check)
        text = cie("doctor", "--root", self.folder).stdout.decode()
        self.assertLessEqual(max(map(len, text.splitlines())), 100)
        for check in report["checks"]:
            self.assertIn(check["id"], text)

    def test_kernel_events_are_tried(self):
        """On this machine: recorded for a second, or it is said why not."""
        report = json.loads(cie("doctor", "-f", "json").stdout)
        checks = {check["id"]: check for check in report["checks"]}
        if checks["recorder"]["health"] != "ok":
            self.skipTest("cie-record is not installed")
        self.assertRegex(checks["kernel-events"]["finding"],
                         r"^by (bpf|tracefs), tried for \d\.\d s: .*switch|^they cannot be recorded: ")

    def test_what_is_no_recording_is_an_error(self):
        self.assertEqual(cie("doctor", "--trace", self.folder).returncode, 4)
        for path in (self.path("nowhere"), self.write("file", b"")):
            done = cie("doctor", "--trace", path)
            self.assertEqual((done.returncode, done.stderr), (4, cie("report", path).stderr))


class OtherPrograms(Folder):
    """`cie run`, `cie record`, `cie collect` and `cie live` start cie-run, cie-record, cie-collect and cie-live."""

    def setUp(self):
        super().setUp()
        os.mkdir(self.path("bin"))
        shutil.copy(CIE, self.path("bin", "cie"))
        self.program = self.path("bin", "cie")
        self.echo = b'#!/bin/sh\nprintf "%s|" "$0" "$@"\nexit 7\n'
        os.mkdir(self.path("path"))

    def start(self, *arguments):
        return cie(*arguments, program=self.program, env={**os.environ, "PATH": self.path("path") + ":/usr/bin:/bin"})

    def test_absent(self):
        robot = "It comes with the package cie-robot"
        for name, part in (("run", robot), ("record", robot), ("collect", robot), ("live", "It comes with cie")):
            result = self.start(name, "app.yaml")
            self.assertEqual((result.returncode, result.stdout), (4, b""))
            self.assertIn(f'"cie-{name}" is not installed'.encode(), result.stderr)
            self.assertIn(part.encode(), result.stderr)

    def test_doctor_says_that_nothing_can_be_recorded_without_the_recorder(self):
        result = self.start("doctor", "-f", "json")
        report = json.loads(result.stdout)
        self.assertEqual(result.returncode, 1)
        self.assertEqual(report["checks"][0], {
            "id": "recorder", "health": "problem", "finding": "cie-record is not installed: nothing can be recorded here",
            "advice": "install the package cie-robot, or name the folder of cie-record in PATH"})
        self.assertGreaterEqual(report["problems"], 1)

    def test_found_in_path_with_every_argument_as_it_is(self):
        self.write("path/cie-record", self.echo, 0o755)
        result = self.start("record", "--help", "-o", "a b", "--", "$(reboot)", "*", "")
        self.assertEqual(result.returncode, 7, "its exit code is passed on")
        self.assertEqual(result.stdout.decode(),
                         self.path("path", "cie-record") + "|--help|-o|a b|--|$(reboot)|*||")

    def test_the_one_beside_it_comes_first(self):
        self.write("path/cie-run", self.echo, 0o755)
        self.write("bin/cie-run", self.echo, 0o755)
        self.assertTrue(self.start("run", "x").stdout.decode().startswith(self.path("bin", "cie-run") + "|x|"))


class Verdicts(unittest.TestCase):
    def test_exit_codes(self):
        failing = os.path.join(EXAMPLES, "multi_threaded_fails")
        for form in ("text", "json"):
            self.assertEqual(cie("verify", TRACE, "--spec", SPEC, "-f", form).returncode, 0)
            result = cie("verify", os.path.join(failing, "trace"), "--spec", os.path.join(failing, "spec.yaml"), "-f", form)
            self.assertEqual(result.returncode, 1)
            self.assertIn(b"FAIL", result.stdout)
        self.assertIn(b"(6 need --spec)", cie("verify", TRACE).stdout)

    def test_without_the_kernel_or_the_user_half(self):
        kernel = cie("verify", os.path.join(TRACE, "kernel"), "-f", "json")
        self.assertEqual(kernel.returncode, 3, "no cie event is there: nothing is shown, nothing passes")
        self.assertEqual(json.loads(kernel.stdout)["verdict"], "INCONCLUSIVE")
        self.assertEqual(cie("verify", os.path.join(TRACE, "kernel"), "--inconclusive=warn").returncode, 0)
        self.assertEqual(cie("verify", os.path.join(TRACE, "kernel"), "--inconclusive=fail").returncode, 1)

if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
