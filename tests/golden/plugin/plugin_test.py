"""The babeltrace2 plugin against the cie program, by the babeltrace2 program itself."""
import csv
import io
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

TESTS = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "browser"), str(TESTS / "support")]
from cie import Cie  # pylint: disable=wrong-import-position
from on_terminal import on_terminal  # pylint: disable=wrong-import-position

cie = Cie(sys.argv[1])
PLUGINS, EXAMPLES, MAN, ROS2 = sys.argv[2:6]
ISOLATED = f"{EXAMPLES}/isolated_ok/trace"
MULTI = f"{EXAMPLES}/multi_threaded_fails/trace"


def babeltrace2(*arguments, expect=0):
    done = subprocess.run(["babeltrace2", f"--plugin-path={PLUGINS}", *arguments],
                          capture_output=True, text=True, timeout=200)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done.stdout if expect == 0 else done.stderr


def add_idle_cpu(trace):
    """A stream of a third CPU with one empty packet, which begins and ends with the last flush."""
    last_flush = 983_145_000_000
    first = pathlib.Path(trace, "ust/uid/0/64-bit/channel0_1")
    packet = bytearray(first.read_bytes()[:88])
    struct.pack_into("<Q", packet, 28, 2)  # stream_instance_id
    struct.pack_into("<QQQQ", packet, 36, 88 * 8, 88 * 8, last_flush, last_flush)
    struct.pack_into("<QQI", packet, 68, 0, 0, 2)  # packet_seq_num, events_discarded, cpu_id
    first.with_name("channel0_2").write_bytes(packet)


def report_of(text):
    """What both say of a trace: the sink reads no manifest, so it knows of nothing that it is complete."""
    report = json.loads(text)
    report["trace"].pop("paths")
    report["trace"].pop("complete")
    return report


class ReportSink(unittest.TestCase):
    def test_a_terminal_obeys_nothing_in_a_table(self):
        good, evil = b"/a/plan@Timer(20000000)", b"\x1b[2J\x1b]0;x\x07\",\n\r\t\xc2\x9b\xe2\x80\xaeabc"
        with tempfile.TemporaryDirectory() as folder:
            trace = pathlib.Path(folder, "trace")
            shutil.copytree(MULTI, trace)
            for file in filter(pathlib.Path.is_file, trace.rglob("*")):
                file.chmod(0o644)
                file.write_bytes(file.read_bytes().replace(good, evil))
            command = ["babeltrace2", f"--plugin-path={PLUGINS}", str(trace), "--component=sink.cie.report",
                       '--params=format="csv"']
            exact = subprocess.run(command, capture_output=True, check=True, timeout=200).stdout
            self.assertIn(evil.replace(b'"', b'""'), exact)
            code, lines = on_terminal(command, os.environ, 200)
        lines = [line for line in lines if line.replace("\x1b[0m", "")]  # babeltrace2 ends with that
        self.assertEqual((code, len(lines)), (0, len(list(csv.reader(io.StringIO(exact.decode(), newline=""))))))
        for control in "\x1b\x07\r\t\x9b\u202e":
            self.assertNotIn(control, "".join(lines))

    def test_says_what_the_command_says(self):
        for trace in ISOLATED, MULTI, f"{ROS2}/isolated", f"{ROS2}/multi_threaded":
            told = babeltrace2(trace, "-c", "sink.cie.report", "-p", 'format="json"')
            self.assertEqual(report_of(told), report_of(cie.text("report", trace, "-f", "json")))

    def test_an_idle_cpu_narrows_no_window(self):
        with tempfile.TemporaryDirectory() as folder:
            trace = shutil.copytree(ISOLATED, f"{folder}/trace")
            add_idle_cpu(trace)
            told = report_of(babeltrace2(trace, "-c", "sink.cie.report", "-p", 'format="json"'))
            self.assertEqual(told, report_of(cie.text("report", trace, "-f", "json")))
            self.assertEqual(sum(c["instances"] for c in told["callbacks"]), 72)

    def test_what_a_manifest_would_tell_is_not_known(self):
        told = babeltrace2(ISOLATED, "-c", "sink.cie.report")
        self.assertIn("whether it is complete is not known", " ".join(told.split()))
        self.assertNotIn("PASS", told)
        told = babeltrace2(ISOLATED, "-c", "sink.cie.report", "-p", 'format="json"')
        self.assertIs(json.loads(told)["trace"]["complete"], False)
        self.assertIn("FAIL", babeltrace2(MULTI, "-c", "sink.cie.report"))

    def test_a_full_disk_is_an_error(self):
        for redirection in (">/dev/full", ">&-"):
            done = subprocess.run(["sh", "-c", f'"$@" {redirection}', "sh", "babeltrace2", f"--plugin-path={PLUGINS}",
                                   ISOLATED, "-c", "sink.cie.report"], capture_output=True, text=True, check=False, timeout=200)
            self.assertEqual(done.returncode, 1, redirection)
            self.assertIn("cannot write standard output", done.stderr)

    def test_text_is_the_default(self):
        self.assertIn("response time", babeltrace2(ISOLATED, "-c", "sink.cie.report"))

    def test_merges_its_inputs_by_time(self):
        with tempfile.TemporaryDirectory() as folder:
            out = f"{folder}/report.json"
            sources = []
            for name in "kernel", "ust/uid/0/64-bit":
                sources += ["--component", f"{name.split('/')[0]}:source.ctf.fs", "--params",
                            f'inputs=["{ISOLATED}/{name}"]',
                            "--component", f"mux{name.split('/')[0]}:filter.utils.muxer"]
            babeltrace2("run", *sources, "--component", "report:sink.cie.report", "--params",
                        f'format="json",output="{out}"',
                        "--connect", "kernel:muxkernel", "--connect", "ust:muxust",
                        "--connect", "muxkernel:report", "--connect", "muxust:report")
            told = pathlib.Path(out).read_text(encoding="utf-8")
        self.assertEqual(report_of(told), report_of(cie.text("report", ISOLATED, "-f", "json")))

    # The half of the offset that is no whole seconds counts in cycles, too.
    def test_of_a_clock_that_counts_half_nanoseconds(self):
        with tempfile.TemporaryDirectory() as folder:
            trace = pathlib.Path(shutil.copytree(ISOLATED, f"{folder}/trace"))
            for metadata in trace.rglob("metadata"):
                text = metadata.read_text(encoding="utf-8")
                faster = text.replace("freq = 1000000000;", "freq = 2000000000;")
                self.assertNotEqual(faster, text)
                metadata.write_text(faster, encoding="utf-8")
            told = report_of(babeltrace2(str(trace), "-c", "sink.cie.report", "-p", 'format="json"'))
            self.assertEqual(told, report_of(cie.text("report", str(trace), "-f", "json")))
            self.assertEqual(told["trace"]["clock_offset_ns"], 1_700_000_000_000_000_000 + 123_456_789 // 2)

    def test_refuses_unknown_parameters(self):
        told = babeltrace2(ISOLATED, "-c", "sink.cie.report", "-p", 'colour="red"', expect=1)
        self.assertIn('unknown parameter "colour"', told)


class Queries(unittest.TestCase):
    def test_version_is_the_programs(self):
        version = babeltrace2("query", "sink.cie.report", "version").strip()
        self.assertIn(version, cie.text("--version"))

    def test_every_parameter_is_documented(self):
        told = babeltrace2("query", "sink.cie.report", "parameters")
        names = re.findall(r"^\s*(\w+):", told, re.MULTILINE)
        self.assertEqual(sorted(names), ["format", "output", "spec"])
        page = pathlib.Path(MAN, "babeltrace2-sink.cie.report.7").read_text(encoding="utf-8")
        for name in names:
            self.assertIn(rf"\fB{name}\fP=", page)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
