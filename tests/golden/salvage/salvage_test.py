"""Recordings whose metadata is lost, read with that of a recording like them (--metadata)."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

CIE, EXAMPLES = sys.argv[1:3]
USER = "ust/uid/0/64-bit/metadata"


def cie(*arguments):
    done = subprocess.run([CIE, *map(str, arguments)], capture_output=True, text=True, timeout=60,
                          check=False)
    return done.returncode, done.stdout, done.stderr


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
        code, _, error = cie("report", self.damaged("isolated_ok", 0))
        self.assertEqual(code, 4)
        self.assertIn("--metadata", error)

    def test_numbers_are_those_of_the_whole_recording(self):
        for keep in 0, 0.5, 0.99:
            with self.subTest(keep=keep):
                trace = self.damaged("isolated_ok", keep)
                code, text, error = cie("report", trace, "-f", "json", "--metadata",
                                        self.whole("isolated_ok") / USER)
                self.assertEqual(code, 0, error)
                told = json.loads(text)
                whole = json.loads(cie("report", self.whole("isolated_ok"), "-f", "json")[1])
                self.assertEqual(told["callbacks"], whole["callbacks"])
                self.assertEqual(told["chains"], whole["chains"])
                self.assertIn("foreign-metadata", [d["kind"] for d in told["defects"]])
                shutil.rmtree(trace)

    def test_what_would_pass_is_undecided(self):
        self.assertEqual(cie("verify", self.whole("isolated_ok"))[0], 0)
        code, text, _ = cie("verify", self.damaged("isolated_ok", 0), "-f", "json", "--metadata",
                            self.whole("isolated_ok") / USER)
        self.assertEqual(code, 3)
        rules = {r["id"]: r for r in json.loads(text)["rules"]}
        self.assertEqual(rules["T1"]["verdict"], "INCONCLUSIVE")
        evidence = rules["T1"]["subjects"][0]["evidence"][0]
        self.assertEqual(evidence["event"], "foreign_metadata")
        self.assertIn("it is empty", evidence["note"])

    def test_what_fails_still_fails(self):
        code, text, _ = cie("verify", self.damaged("multi_threaded_fails", 0), "-f", "json",
                            "--metadata", self.whole("isolated_ok") / USER)
        self.assertEqual(code, 1)
        self.assertEqual({r["id"]: r["verdict"] for r in json.loads(text)["rules"]}["M2"], "FAIL")

    def test_the_clock_is_that_of_the_sound_traces_beside_it(self):
        # Another recording's offset would set the two domains apart.
        other = self.folder / "metadata"
        content = (self.whole("isolated_ok") / USER).read_bytes()
        at = content.index(b"offset = ") + len(b"offset = ")
        other.write_bytes(content[:at] + b"9" + content[at + 1:])
        trace = self.damaged("isolated_ok", 0)
        told = json.loads(cie("report", trace, "-f", "json", "--metadata", other)[1])
        whole = json.loads(cie("report", self.whole("isolated_ok"), "-f", "json")[1])
        self.assertEqual(told["callbacks"], whole["callbacks"])

    def test_metadata_of_something_else_never_passes(self):
        code, _, _ = cie("verify", self.damaged("isolated_ok", 0), "--metadata",
                         self.whole("isolated_ok") / "kernel/metadata")
        self.assertIn(code, (3, 4))

    def test_sound_traces_need_no_help(self):
        _, helped, _ = cie("report", self.whole("isolated_ok"), "-f", "json", "--metadata",
                           self.whole("multi_threaded_fails") / USER)
        self.assertEqual(helped, cie("report", self.whole("isolated_ok"), "-f", "json")[1])

    def test_the_other_reader_cannot(self):
        code, _, error = cie("report", self.whole("isolated_ok"), "--reader", "babeltrace2",
                             "--metadata", self.whole("isolated_ok") / USER)
        self.assertEqual(code, 2)
        self.assertIn("native", error)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
