"""Recordings whose metadata is lost: read with that of a recording like them (--metadata), or, those
of `cie record`, with the schema of its provider. `recording` is one, of a demo of one second."""
import json
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from cie import Cie, rules_of  # noqa: E402  pylint: disable=wrong-import-position

cie, EXAMPLES = Cie(sys.argv[1]), sys.argv[2]
USER = "ust/uid/0/64-bit/metadata"
RECORDING = pathlib.Path(__file__).resolve().parent / "recording"


class Salvage(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def damaged(self, example, keep):
        """A copy of an example whose user metadata is cut after `keep` of its bytes."""
        trace = self.folder / example
        shutil.copytree(f"{EXAMPLES}/{example}/trace", trace)
        metadata = trace / USER
        content = metadata.read_bytes()
        metadata.write_bytes(content[:int(len(content) * keep)])
        return trace

    def whole(self, example):
        return pathlib.Path(EXAMPLES, example, "trace")

    def test_without_other_metadata_it_is_refused_and_the_way_out_is_named(self):
        self.assertIn("--metadata", cie.refusal("report", self.damaged("isolated_ok", 0), code=4))

    def test_numbers_are_those_of_the_whole_recording(self):
        for keep in 0, 0.5, 0.99:
            with self.subTest(keep=keep):
                trace = self.damaged("isolated_ok", keep)
                told = cie.json("report", trace, "--metadata", self.whole("isolated_ok") / USER)
                whole = cie.json("report", self.whole("isolated_ok"))
                self.assertEqual(told["callbacks"], whole["callbacks"])
                self.assertEqual(told["chains"], whole["chains"])
                self.assertIn("foreign-metadata", [d["kind"] for d in told["defects"]])
                shutil.rmtree(trace)

    def test_what_would_pass_is_undecided(self):
        self.assertEqual(cie.run("verify", self.whole("isolated_ok")).returncode, 0)
        done = cie.run("verify", self.damaged("isolated_ok", 0), "-f", "json", "--metadata",
                       self.whole("isolated_ok") / USER)
        self.assertEqual(done.returncode, 3)
        rules = rules_of(json.loads(done.stdout))
        self.assertEqual(rules["T1"]["verdict"], "INCONCLUSIVE")
        evidence = rules["T1"]["subjects"][0]["evidence"][0]
        self.assertEqual(evidence["event"], "foreign_metadata")
        self.assertIn("it is empty", evidence["note"])

    def test_what_fails_still_fails(self):
        done = cie.run("verify", self.damaged("multi_threaded_fails", 0), "-f", "json",
                       "--metadata", self.whole("isolated_ok") / USER)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(rules_of(json.loads(done.stdout))["M2"]["verdict"], "FAIL")

    def test_the_clock_is_that_of_the_sound_traces_beside_it(self):
        # Another recording's offset would set the two domains apart.
        other = self.folder / "metadata"
        content = (self.whole("isolated_ok") / USER).read_bytes()
        at = content.index(b"offset = ") + len(b"offset = ")
        other.write_bytes(content[:at] + b"9" + content[at + 1:])
        trace = self.damaged("isolated_ok", 0)
        told = cie.json("report", trace, "--metadata", other)
        whole = cie.json("report", self.whole("isolated_ok"))
        self.assertEqual(told["callbacks"], whole["callbacks"])

    def test_metadata_of_something_else_never_passes(self):
        done = cie.run("verify", self.damaged("isolated_ok", 0), "--metadata",
                       self.whole("isolated_ok") / "kernel/metadata")
        self.assertIn(done.returncode, (3, 4))

    def test_sound_traces_need_no_help(self):
        helped = cie.text("report", self.whole("isolated_ok"), "-f", "json", "--metadata",
                          self.whole("multi_threaded_fails") / USER)
        self.assertEqual(helped, cie.text("report", self.whole("isolated_ok"), "-f", "json"))


class OwnSchema(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.trace = pathlib.Path(scratch.name, "trace")
        shutil.copytree(RECORDING, self.trace)

    def lose_metadata(self):
        (self.trace / "metadata").unlink()

    def assert_refused(self, why):
        error = cie.refusal("report", self.trace, code=4)
        self.assertIn(why, error)
        self.assertEqual(error.count("\n"), 1)

    def test_numbers_are_those_of_the_whole_recording(self):
        whole = cie.json("report", RECORDING)
        self.assertGreater(sum(c["instances"] for c in whole["callbacks"]), 100)
        content = (RECORDING / "metadata").read_bytes()
        for kept in (0, 1, 100, 5000, len(content) // 2, None):
            with self.subTest(kept=kept):
                self.lose_metadata()
                if kept is not None:
                    (self.trace / "metadata").write_bytes(content[:kept])
                told = cie.json("report", self.trace)
                for part in ("processes", "callbacks", "threads", "chains"):
                    self.assertEqual(told[part], whole[part], part)
                for part in ("begin_ns", "end_ns", "events", "streams", "hosts", "lost_events"):
                    self.assertEqual(told["trace"][part], whole["trace"][part], part)
                self.assertIn("foreign-metadata", [d["kind"] for d in told["defects"]])
                if kept is None:
                    (self.trace / "metadata").touch()

    def test_instances_are_those_of_the_whole_recording(self):
        self.lose_metadata()
        self.assertEqual(cie.text("instances", self.trace), cie.text("instances", RECORDING))

    def test_what_would_pass_is_undecided(self):
        self.assertEqual(cie.run("verify", RECORDING).returncode, 0)
        self.lose_metadata()
        done = cie.run("verify", self.trace, "-f", "json")
        self.assertEqual(done.returncode, 3)
        rules = rules_of(json.loads(done.stdout))
        self.assertEqual(rules["T1"]["verdict"], "INCONCLUSIVE")
        self.assertIn("the schema of `cie record`",
                      rules["T1"]["subjects"][0]["evidence"][0]["note"])

    def test_a_cut_stream_is_used_as_far_as_it_goes(self):
        self.lose_metadata()
        stream = self.trace / "events_1"
        stream.write_bytes(stream.read_bytes()[:-5000])
        kinds = [d["kind"] for d in cie.json("report", self.trace)["defects"]]
        self.assertIn("damaged-packets", kinds)
        self.assertIn("foreign-metadata", kinds)

    def test_channels_of_something_else_are_refused(self):
        (self.trace / "metadata").write_bytes(b"")
        (self.trace / "events_0").rename(self.trace / "mine_0")
        self.assert_refused("mine_0")

    def test_events_of_something_else_are_refused(self):
        self.lose_metadata()
        for cpu in "01":
            (self.trace / f"state_{cpu}").rename(self.trace / "between")
            (self.trace / f"events_{cpu}").rename(self.trace / f"state_{cpu}")
            (self.trace / "between").rename(self.trace / f"events_{cpu}")
        self.assert_refused("its events are none of cie's")

    def test_packets_of_several_traces_are_refused(self):
        self.lose_metadata()
        stream = self.trace / "events_1"
        content = bytearray(stream.read_bytes())
        content[4] ^= 1  # of the uuid
        stream.write_bytes(content)
        self.assert_refused("several traces")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
