#!/usr/bin/env python3
"""What is written in two places agrees. Each folder's README says which of its rooms may include which (a block ```arrows FOLDER); here sources are held
against it. Of a public header: it includes the standard library and public headers alone. Each code of a note in
`analysis` has a sentence in `viewer_export`, and no sentence has no code.

Usage: arrows_test.py BIN SOURCE
"""

import pathlib
import re
import sys
import unittest

SOURCE = pathlib.Path(sys.argv.pop()).resolve()
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
ARROWS = re.compile(r"```arrows (\S+)\n(.*?)```", re.DOTALL)
ROOTS = ("", "src", "live", "cli", "recorder")  # of a folder: what its includes are relative to
CODE = {".cpp", ".hpp", ".h", ".c", ".in"}


def arrow_lists():
    """Of each folder with a list: {room: rooms that it may include}; "*": all."""
    lists = {}
    for readme in sorted(SOURCE.glob("*/README.md")):
        for folder, text in ARROWS.findall(readme.read_text()):
            rooms = {}
            for line in text.splitlines():
                room, colon, allowed = line.partition(":")
                if not colon:
                    raise ValueError(f"{readme}: no \"ROOM: ROOMS\": {line}")
                rooms[room.strip()] = set(allowed.split())
            lists[folder] = rooms
    return lists


def sources(folder):
    return sorted(path for path in (SOURCE / folder).rglob("*") if path.suffix in CODE)


def room_of(path, folder):
    return str(path.parent.relative_to(SOURCE / folder))


def included(path, folder):
    """The files of the folder that a file includes."""
    for name in INCLUDE.findall(path.read_text(errors="replace")):
        for root in (path.parent, *(SOURCE / folder / below for below in ROOTS)):
            target = (root / name).resolve()
            if target.is_file() and target.is_relative_to(SOURCE / folder):
                yield target
                break


def wrong_arrows(folder, rooms):
    for path in sources(folder):
        room = room_of(path, folder)
        if room not in rooms:
            continue
        for target in included(path, folder):
            other = room_of(target, folder)
            if other != room and other not in rooms[room] and "*" not in rooms[room]:
                yield f"{path.relative_to(SOURCE)} includes {target.relative_to(SOURCE)}"


class Arrows(unittest.TestCase):
    def test_every_part_has_a_list(self):
        self.assertEqual(
            set(arrow_lists()), {"analysis/src", "executor", "tracepoints", "viewer_export"}
        )

    def test_every_room_is_in_its_list(self):
        for folder, rooms in arrow_lists().items():
            there = {room_of(path, folder) for path in sources(folder)
                     if path.suffix != ".in" and "examples" not in path.parts
                     and path.relative_to(SOURCE / folder).parts[0] not in ("include", "plugin", "container", "idl")}
            self.assertEqual(there - set(rooms), set(), f"{folder}: not in the README's list")
            self.assertEqual(set(rooms) - there, set(), f"{folder}: in the README's list, and not there")

    def test_no_include_runs_against_the_arrows(self):
        for folder, rooms in arrow_lists().items():
            self.assertEqual(list(wrong_arrows(folder, rooms)), [])

    def test_the_arrows_have_no_circle(self):
        for folder, rooms in arrow_lists().items():
            left = {room: others - {"*"} for room, others in rooms.items()}
            while left:
                free = [room for room, others in left.items() if not others & set(left)]
                self.assertTrue(free, f"{folder}: a circle among {sorted(left)}")
                for room in free:
                    del left[room]

    def test_public_headers_include_public_headers_alone(self):
        for header in sorted(SOURCE.glob("*/include/cie/**/*.hpp")):
            self.assertEqual(INCLUDE.findall(header.read_text()), [], header)

    def test_desk_and_robot_meet_in_the_schema_alone(self):
        forbidden = {"analysis": ("cie/executor/", "cie/scheduling/", "cie/viewer_export/"),
                     "viewer_export": ("cie/executor/", "cie/scheduling/"),
                     "executor": ("cie/analysis/", "cie/viewer_export/"),
                     # An executor over other middleware stands on it.
                     "executor/src/scheduling": ("cie/executor/",),
                     "executor/rclcpp": ("cie/executor/", "dds/"),
                     "executor/include/cie/scheduling": ("cie/executor/",),
                     "tracepoints": ("cie/executor/", "cie/scheduling/", "cie/analysis/", "cie/viewer_export/")}
        for folder, prefixes in forbidden.items():
            for path in sources(folder):
                for name in re.findall(r"#\s*include\s+<([^>]+)>", path.read_text(errors="replace")):
                    self.assertFalse(name.startswith(prefixes), f"{path.relative_to(SOURCE)} includes <{name}>")

    def test_each_code_of_a_note_has_a_sentence(self):
        table = (SOURCE / "viewer_export/src/words/note_sentences.cpp").read_text()
        codes = re.findall(r'^ +{"([a-z0-9-]+)",', table, re.MULTILINE)
        self.assertEqual(len(codes), len(set(codes)))
        code = "".join(path.read_text() for path in sources("analysis/src") + sources("analysis/include"))
        self.assertEqual({name for name in codes if f'"{name}"' not in code}, set(), "no rule has these codes")
        self.assertEqual(set(re.findall(r'\bnote\(\s*"([^"]+)"', code)) - set(codes), set())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
