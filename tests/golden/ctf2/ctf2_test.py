"""Recordings with their metadata said in CTF 2: everything printed is the same, and what happens to cut
metadata is what happens to that of CTF 1.8."""
import pathlib
import shutil
import sys
import tempfile
import unittest

GOLDEN = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(GOLDEN.parent / "support"))
from cie import Cie  # noqa: E402
from ctf2_of_tsdl import convert_copy  # noqa: E402

cie = Cie(sys.argv[1])
EXAMPLE = GOLDEN / "contract/examples/isolated_ok/trace"
USER = "ust/uid/0/64-bit/metadata"
RECORDING = GOLDEN / "salvage/recording"
TRACES = (EXAMPLE, GOLDEN / "contract/examples/multi_threaded_fails/trace",
          GOLDEN / "ros2/recordings/isolated", GOLDEN / "ros2/recordings/multi_threaded", RECORDING)


def said(*arguments, folder):
    done = cie.run(*arguments, cwd=folder)
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
                    one = said(*command, name, folder=trace.parent)
                    self.assertIn(one[0], (0, 1, 3))
                    self.assertEqual(said(*command, name, folder=self.folder), one)
            shutil.rmtree(copy)

    def test_traces_of_both_formats_are_read_together(self):
        copy = self.converted(EXAMPLE)
        shutil.copy(EXAMPLE / "kernel/metadata", copy / "kernel/metadata")
        self.assertEqual(said("report", "trace", "-f", "json", folder=self.folder),
                         said("report", "trace", "-f", "json", folder=EXAMPLE.parent))

    def test_cut_metadata_of_a_recording_of_cie_is_replaced_by_its_schema(self):
        whole = cie.json("report", RECORDING)
        copy = self.converted(RECORDING)
        content = (copy / "metadata").read_bytes()
        for kept in (0, 1, 100, 5000, len(content) // 2, len(content) - 3):
            with self.subTest(kept=kept):
                (copy / "metadata").write_bytes(content[:kept])
                told = cie.json("report", copy)
                for part in ("processes", "callbacks", "threads", "chains"):
                    self.assertEqual(told[part], whole[part], part)
                self.assertIn("foreign-metadata", [d["kind"] for d in told["defects"]])
                self.assertEqual(cie.run("verify", copy).returncode, 3)

    def test_cut_metadata_is_replaced_by_that_of_a_recording_like_it(self):
        whole = cie.json("report", EXAMPLE)
        copy = self.converted(EXAMPLE)
        metadata = copy / USER
        content = metadata.read_bytes()
        other = self.folder / "other"
        other.write_bytes(content)
        for kept in (0, len(content) // 2, len(content) - 3):
            with self.subTest(kept=kept):
                metadata.write_bytes(content[:kept])
                error = cie.refusal("report", copy, code=4)
                self.assertIn("--metadata", error)
                self.assertEqual(error.count("\n"), 1)
                # Of either format.
                for source in (other, EXAMPLE / USER):
                    self.assertEqual(cie.json("report", copy, "--metadata", source)["callbacks"], whole["callbacks"])
                    self.assertEqual(cie.run("verify", copy, "--metadata", source).returncode, 3)

    def test_a_cut_names_its_fragment(self):
        copy = self.converted(EXAMPLE)
        content = (copy / USER).read_bytes()
        (copy / USER).write_bytes(content[:len(content) - 3])
        error = cie.run("report", copy).stderr
        fragments = content.count(b"\x1e")
        self.assertIn(f"fragment {fragments}: it is cut at byte {len(content) - 3}", error)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
