"""What clang-tidy reads at once, and what it says then."""
import importlib.util
import os
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

spec = importlib.util.spec_from_file_location("tidy", sys.argv[1])
tidy = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tidy)

# Says of each file that the one it reads includes: its name is a finding. Two that are named "same" do not go together.
CLANG_TIDY = """#!/usr/bin/env python3
import re, sys
text = open(sys.argv[-1]).read()
files = re.findall('#include "(.*)"', text)
if sum("same" in file for file in files) > 1:
    print(files[-1] + ":1:1: error: redefinition of 'same' [clang-diagnostic-error]")
for file in files:
    print(file + ":7:3: error: a finding [a-check]")
sys.exit(1)
"""


def unity(number, flags="-DONE", folder="/t/a.dir"):
    file = f"{folder}/Unity/unity_{number}_cxx.cxx"
    return {"directory": "/t", "file": file, "command": f"clang++ {flags} -o {file}.o -c {file}"}


class Groups(unittest.TestCase):
    def test_unity_files_that_are_compiled_alike_are_read_as_one(self):
        alike, other = [unity(0), unity(1)], unity(0, "-DTWO", "/t/b.dir")
        self.assertEqual(tidy.groups([*alike, other]), [alike, [other]])

    def test_no_more_than_some_at_once_and_as_many_in_each(self):
        members = [unity(number) for number in range(tidy.AT_ONCE + 1)]
        half = len(members) // 2
        self.assertEqual(tidy.groups(members), [members[:half], members[half:]])

    def test_a_source_that_is_no_unity_file_stays_alone(self):
        alone = [{"directory": "/t", "file": f"/t/{name}.cpp", "command": "clang++ -o x.o -c x.cpp"} for name in "xy"]
        self.assertEqual(tidy.groups(alone), [[alone[0]], [alone[1]]])


class Names(unittest.TestCase):
    def test_a_unity_file_goes_by_those_of_its_sources(self):
        with tempfile.TemporaryDirectory() as folder:
            entries = [unity(number, folder=folder) for number in (0, 1)]
            pathlib.Path(folder, "Unity").mkdir()
            for entry, source in zip(entries, ("inbox", "entity")):
                pathlib.Path(entry["file"]).write_text(f'#include "/t/src/{source}.cpp"\n')
            alone = {"directory": "/t", "file": "/t/inbox_main.cpp", "command": "clang++ -c /t/inbox_main.cpp"}
            self.assertEqual(tidy.named([*entries, alone], ["src/inbox"]), [entries[0]])
            self.assertEqual(tidy.named([*entries, alone], ["inbox"]), [entries[0], alone])
            self.assertEqual(tidy.named([*entries, alone], []), [*entries, alone])


class Findings(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        program = pathlib.Path(kept.name, "clang-tidy")
        program.write_text(CLANG_TIDY)
        program.chmod(0o755)
        path = mock.patch.dict(os.environ, PATH=f"{kept.name}:{os.environ['PATH']}")
        path.start()
        self.addCleanup(path.stop)

    def of(self, *names):
        entries = [{"directory": "/t", "file": f"/t/{name}", "command": f"clang++ -o x.o -c /t/{name}"} for name in names]
        return tidy.findings(pathlib.Path("/t"), entries)

    def test_each_is_told_by_its_place(self):
        self.assertEqual(self.of("one.cxx", "two.cxx"), ["one.cxx:7:3: a finding [a-check]", "two.cxx:7:3: a finding [a-check]"])

    def test_what_does_not_compile_together_is_read_by_itself(self):
        self.assertEqual(self.of("same1.cxx", "same2.cxx"), ["same1.cxx:7:3: a finding [a-check]", "same2.cxx:7:3: a finding [a-check]"])


unittest.main(argv=sys.argv[:1])
