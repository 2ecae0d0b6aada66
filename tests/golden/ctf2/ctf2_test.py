"""Recordings with their metadata said in CTF 2: everything printed is the same, and what happens to cut
metadata is what happens to that of CTF 1.8."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

GOLDEN = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(GOLDEN.parent / "support"))
from ctf2_of_tsdl import convert_copy  # noqa: E402

CIE = str(pathlib.Path(sys.argv[1]).resolve())
EXAMPLE = GOLDEN / "contract/examples/isolated_ok/trace"
USER = "ust/uid/0/64-bit/metadata"
RECORDING = GOLDEN / "salvage/recording"
TRACES = (EXAMPLE, GOLDEN / "contract/examples/multi_threaded_fails/trace",
          GOLDEN / "ros2/recordings/isolated", GOLDEN / "ros2/recordings/multi_threaded", RECORDING)


def cie(*arguments, folder=None):
    done = subprocess.run([CIE, *map(str, arguments)], capture_output=True, text=True, timeout=200,
                          check=False, cwd=folder)
    return done.returncode, done.stdout, done.stderr


class Ctf2(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def converted(self, trace, name="trace"):
        convert_copy(trace, self.folder / name)
        return self.folder / name

    def test_everything_printed_is_the_same(self):
        for trace in TRACES:
            name = trace.name
            copy = self.converted(trace, name)
            for command in (["report"], ["report", "-f", "json"], ["verify"], ["verify", "-f", "json"],
                            ["instances"], ["export", "--to", "dot"]):
                with self.subTest(trace=trace, command=command):
                    one = cie(*command, name, folder=trace.parent)
                    self.assertIn(one[0], (0, 1, 3))
                    self.assertEqual(cie(*command, name, folder=self.folder), one)
            shutil.rmtree(copy)

    def test_traces_of_both_formats_are_read_together(self):
        copy = self.converted(EXAMPLE)
        shutil.copy(EXAMPLE / "kernel/metadata", copy / "kernel/metadata")
        self.assertEqual(cie("report", "trace", "-f", "json", folder=self.folder),
                         cie("report", "trace", "-f", "json", folder=EXAMPLE.parent))

    def test_cut_metadata_of_a_recording_of_cie_is_replaced_by_its_schema(self):
        whole = json.loads(cie("report", RECORDING, "-f", "json")[1])
        copy = self.converted(RECORDING)
        content = (copy / "metadata").read_bytes()
        for kept in (0, 1, 100, 5000, len(content) // 2, len(content) - 3):
            with self.subTest(kept=kept):
                (copy / "metadata").write_bytes(content[:kept])
                code, text, error = cie("report", copy, "-f", "json")
                self.assertEqual(code, 0, error)
                told = json.loads(text)
                for part in ("processes", "callbacks", "threads", "chains"):
                    self.assertEqual(told[part], whole[part], part)
                self.assertIn("foreign-metadata", [d["kind"] for d in told["defects"]])
                self.assertEqual(cie("verify", copy)[0], 3)

    def test_cut_metadata_is_replaced_by_that_of_a_recording_like_it(self):
        whole = json.loads(cie("report", EXAMPLE, "-f", "json")[1])
        copy = self.converted(EXAMPLE)
        metadata = copy / USER
        content = metadata.read_bytes()
        other = self.folder / "other"
        other.write_bytes(content)
        for kept in (0, len(content) // 2, len(content) - 3):
            with self.subTest(kept=kept):
                metadata.write_bytes(content[:kept])
                code, _, error = cie("report", copy)
                self.assertEqual(code, 4)
                self.assertIn("--metadata", error)
                self.assertEqual(error.count("\n"), 1)
                # Of either format.
                for source in (other, EXAMPLE / USER):
                    code, text, error = cie("report", copy, "-f", "json", "--metadata", source)
                    self.assertEqual(code, 0, error)
                    self.assertEqual(json.loads(text)["callbacks"], whole["callbacks"])
                    self.assertEqual(cie("verify", copy, "--metadata", source)[0], 3)

    def test_a_cut_names_its_fragment(self):
        copy = self.converted(EXAMPLE)
        content = (copy / USER).read_bytes()
        (copy / USER).write_bytes(content[:len(content) - 3])
        error = cie("report", copy)[2]
        fragments = content.count(b"\x1e")
        self.assertIn(f"fragment {fragments}: it is cut at byte {len(content) - 3}", error)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
