"""What a manifest says was recorded, and what is there of it: whatever is taken away from a recording
while its manifest stays, no verdict becomes better (law L7). The recordings are the contract's examples,
which are real ones; their manifests are written here."""
import hashlib
import json
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from cie import Cie, verdicts_of  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of  # noqa: E402  pylint: disable=wrong-import-position

cie, EXAMPLES = Cie(sys.argv[1]), sys.argv[2]
STATE = "ust/uid/0/64-bit/channel0_0"
PROVEN = ("PASS", "NOT_APPLICABLE")


def files_of(trace):
    return sorted(path for path in trace.rglob("*") if path.is_file())


def seal(trace, **said):
    """Writes a manifest of what lies there."""
    files = [{"path": str(path.relative_to(trace)), "size": path.stat().st_size,
              "sha256": hashlib.sha256(path.read_bytes()).hexdigest()} for path in files_of(trace)]
    manifest = {"schema": "cie.recording/1", "mode": "command", "command": ["demo", "--fast"],
                "exit": {"status": 0}, "problems": [], "kernel_events": (trace / "kernel").exists(),
                "processes": [], "files": files} | said
    (trace / "manifest.json").write_text(json.dumps(manifest))


class Manifest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def recording(self, example="isolated_ok", **said):
        trace = self.folder / example
        shutil.rmtree(trace, ignore_errors=True)
        shutil.copytree(f"{EXAMPLES}/{example}/trace", trace)
        report = cie.json("report", trace)
        processes = [{"pid": p["pid"], "name": p["name"]} for p in report["processes"]]
        seal(trace, **({"processes": processes, "host": report["trace"]["hosts"][0]} | said))
        return trace

    def verify(self, trace, *options):
        done = cie.run("verify", trace, "-f", "json", *options)
        if done.returncode == 4:
            return done.returncode, None, done.stderr
        told = json.loads(done.stdout)
        return done.returncode, told, verdicts_of(told)

    def notes(self, told, rule):
        return [item["note"] for r in told["rules"] if r["id"] == rule for s in r["subjects"] for item in s["evidence"]]

    def assert_no_better(self, before, trace, what, *options):
        """Of a recording that was judged `before`; T1 or T2 says why."""
        code, told, after = self.verify(trace, *options)
        if told is None:
            return  # nothing can be read
        self.assertIn(code, (1, 3), what)
        self.assertIn("INCONCLUSIVE", (after["T1"], after["T2"]), what)
        for rule, verdict in before.items():
            self.assertFalse(verdict not in PROVEN and after[rule] in PROVEN,
                             f"{rule} was {verdict} and is {after[rule]}: {what}")

    def test_a_recording_that_is_whole_is_judged_as_without_a_manifest(self):
        for example in "isolated_ok", "multi_threaded_fails":
            trace = self.recording(example)
            without = self.verify(pathlib.Path(EXAMPLES, example, "trace"))
            for options in (), ("--check",):
                code, told, verdicts = self.verify(trace, *options)
                self.assertEqual((code, verdicts), (without[0], without[2]), self.notes(told, "T1"))

    def test_of_each_file_that_is_taken_away(self):
        for example in "isolated_ok", "multi_threaded_fails":
            trace = self.recording(example)
            before = self.verify(trace)[2]
            for file in files_of(trace):
                name = str(file.relative_to(trace))
                if name == "manifest.json":
                    continue
                with self.subTest(example=example, file=name):
                    content = file.read_bytes()
                    file.unlink()
                    self.assert_no_better(before, trace, f"without {name}")
                    told = self.verify(trace)[1]
                    if told:
                        self.assertIn(f"{name} is missing ({trace})", self.notes(told, "T1"))
                    file.write_bytes(content[:len(content) // 2])
                    self.assert_no_better(before, trace, f"half of {name}")
                    file.write_bytes(content)

    def test_of_each_file_that_has_another_content(self):
        trace = self.recording()
        before = self.verify(trace, "--check")[2]
        for file in files_of(trace):
            name = str(file.relative_to(trace))
            if name == "manifest.json":
                continue
            with self.subTest(file=name):
                content = file.read_bytes()
                file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
                self.assert_no_better(before, trace, f"another {name}", "--check")
                file.write_bytes(content)

    def test_of_all_files_of_a_directory(self):
        trace = self.recording("multi_threaded_fails")
        before = self.verify(trace)[2]
        for part in "kernel", "ust":
            with self.subTest(part=part):
                (trace / part).rename(self.folder / part)
                self.assert_no_better(before, trace, f"without {part}")
                (self.folder / part).rename(trace / part)

    def test_of_a_process(self):
        trace = self.recording()
        before = self.verify(trace)[2]
        manifest = manifest_of(trace)
        manifest["processes"].append({"pid": 424242, "name": "planner", "start_ns": 5})
        (trace / "manifest.json").write_text(json.dumps(manifest))
        self.assert_no_better(before, trace, "without a process")
        told = self.verify(trace)[1]
        self.assertIn(f"process planner (424242) was recorded, and nothing is here of it ({trace})",
                      self.notes(told, "T2"))

    def test_of_the_events_of_the_kernel(self):
        trace = self.recording()
        before = self.verify(trace)[2]
        shutil.rmtree(trace / "kernel")
        manifest = manifest_of(trace)
        manifest["files"] = [file for file in manifest["files"] if not file["path"].startswith("kernel/")]
        (trace / "manifest.json").write_text(json.dumps(manifest))
        self.assert_no_better(before, trace, "without the kernel's events")
        self.assertIn("events of the kernel", " ".join(self.notes(self.verify(trace)[1], "T2")))

    def test_even_by_one_rule_alone_what_is_missing_does_not_pass(self):
        trace = self.recording("multi_threaded_fails")
        self.assertEqual(self.verify(trace, "--only", "M2")[0], 1)
        (trace / STATE).unlink()
        self.assertIn(self.verify(trace, "--only", "M2")[0], (1, 3))

    def test_text_and_report_tell_it(self):
        trace = self.recording()
        (trace / STATE).unlink()
        self.assertEqual(self.verify(trace)[0], 3)
        text = cie.run("verify", trace).stdout
        self.assertIn(f"{STATE} is missing", text)
        report = cie.json("report", trace)
        self.assertFalse(report["trace"]["complete"])
        self.assertIn("missing-files", [defect["kind"] for defect in report["defects"]])

    def test_a_file_is_no_link_to_somewhere_else(self):
        trace = self.recording()
        secret = self.folder / "secret"
        shutil.copy(trace / STATE, secret)
        (trace / STATE).unlink()
        (trace / STATE).symlink_to(secret)
        told = self.verify(trace)[1]
        self.assertIn(f"{STATE} is a link that leads out of the recording ({trace})", self.notes(told, "T1"))
        (trace / STATE).unlink()
        os.mkfifo(trace / "pipe")
        manifest = manifest_of(trace)
        manifest["files"] = [{"path": "pipe", "size": 0, "sha256": ""}]
        (trace / "manifest.json").write_text(json.dumps(manifest))
        self.assertIn(f"pipe is no file any more ({trace})", self.notes(self.verify(trace, "--check")[1], "T1"))

    def test_a_damaged_manifest_is_a_doubt_and_no_crash(self):
        trace = self.recording()
        whole = (trace / "manifest.json").read_bytes()
        for damaged in (b"", whole[:100], whole[:-5], b"\xff\xfe", b"[" * 100_000, b"\0" * 100,
                        whole.replace(b'"files": [', b'"files": [[], '),
                        whole.replace(b'"ust/', b'"../../ust/'),
                        whole.replace(b"recording/1", b"recording/9")):
            with self.subTest(manifest=damaged[:20]):
                (trace / "manifest.json").write_bytes(damaged)
                code, told, verdicts = self.verify(trace)
                self.assertEqual((code, verdicts["T1"]), (3, "INCONCLUSIVE"))
                self.assertIn("manifest.json says nothing that can be relied on", " ".join(self.notes(told, "T1")))
                self.assertEqual(cie.run("report", trace).returncode, 0)
        (trace / "manifest.json").write_text('{"name": "of something else"}')
        self.assertEqual(self.verify(trace)[0], 0)

    def test_what_a_recorder_that_failed_or_did_not_end_lost_is_unknown(self):
        for said in ({"problems": ["the session daemon ended"], "names_all_processes": False}, None):
            with self.subTest(manifest=said):
                trace = self.recording(**(said or {}))
                if said is None:
                    (trace / "manifest.json").rename(trace / ".cie-record")
                code, told, verdicts = self.verify(trace, "--allow-crash", "--require-lossless")
                self.assertEqual((code, verdicts["T1"], verdicts["T2"]), (3, "PASS", "INCONCLUSIVE"))
                self.assertIn("ended" if said else "not finished", " ".join(self.notes(told, "T2")))
                self.assertIsNone(cie.json("report", trace)["trace"]["lost_events"])
                for command in ("report", "verify"):
                    text = cie.run(command, trace).stdout
                    self.assertNotIn("nothing lost", text)
                    self.assertIn("losses unknown", text)

    def test_what_the_recorder_wrote_down_is_told(self):
        trace = self.recording(exit={"status": 3}, problems=["LTTng did not end the session\n\x1b[31m"])
        for command in "report", "verify":
            told = cie.json(command, trace)["recordings"]
            self.assertEqual(len(told), 1)
            self.assertEqual(told[0]["path"], str(trace))
            self.assertEqual(told[0]["exit"], {"status": 3})
            self.assertEqual(told[0]["command"], ["demo", "--fast"])
            self.assertEqual(told[0]["problems"], ["LTTng did not end the session\n\x1b[31m"])
            text = " ".join(cie.run(command, trace, "--all").stdout.split())  # however its lines are broken
            self.assertIn("demo exited with status 3", text)
            self.assertIn("cie record says: LTTng did not end the session", text)
            self.assertNotIn("\x1b[31m", text)
        trace = self.recording()
        self.assertNotIn("recordings", cie.json("report", trace))
        self.assertIn("demo exited with status 0", cie.run("report", trace, "--all").stdout)
        trace = self.recording(exit={"signal": 9})
        self.assertIn("demo was killed by signal 9 (Killed)", cie.run("verify", trace).stdout)
        self.assertIn("demo was killed by signal 9 (Killed)", cie.run("report", trace).stdout)

    def test_chunks(self):
        """Each is a recording of its own; here all hold the same."""
        whole = self.folder / "whole"
        for number in 1, 2, 3:
            chunk = whole / f"chunk-{number:06}"
            shutil.copytree(f"{EXAMPLES}/isolated_ok/trace", chunk)
            seal(chunk, chunk=number, begin={"monotonic_ns": number, "realtime_ns": number * 86_400 * 10**9})
        names = [f"chunk-{number:06}/manifest.json" for number in (1, 2, 3)]
        seal(whole, files=[{"path": name, "size": (whole / name).stat().st_size,
                            "sha256": hashlib.sha256((whole / name).read_bytes()).hexdigest()} for name in names])
        code, told, verdicts = self.verify(whole / "chunk-000002")
        self.assertEqual(verdicts["T1"], "PASS", self.notes(told, "T1"))
        self.assertFalse(cie.json("report", whole / "chunk-000002")["trace"]["complete"])
        self.assertTrue(cie.json("report", whole / "chunk-000001")["trace"]["complete"])
        _, told, before = self.verify(whole)
        self.assertEqual((before["T1"], before["T2"]), ("PASS", "PASS"))
        for number in 1, 2, 3:
            (whole / f"chunk-{number:06}").rename(self.folder / "away")
            self.assert_no_better(before, whole, f"without chunk {number}")
            told = self.verify(whole)[1]
            self.assertIn(f"chunk-{number:06} was recorded, and is not here ({whole})", self.notes(told, "T2"))
            self.assertIn(f"chunk-{number:06}/manifest.json is missing ({whole})", self.notes(told, "T1"))
            if number == 1:
                text = cie.run("report", whole, "--all").stdout
                self.assertNotIn("the recording is complete", text)
                self.assertIn("begins with chunk 2: those before are not here", text)
                report = cie.json("report", whole)
                self.assertIn(f"{whole} is from 1970-01-03 00:00:00 UTC on",
                              " ".join(defect["advice"] for defect in report["defects"]))
                self.assertEqual(report["recordings"][0]["first_chunk"], 2)
            (self.folder / "away").rename(whole / f"chunk-{number:06}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
