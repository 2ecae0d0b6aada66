#!/usr/bin/env python3
"""No line is wider than the terminal, nor than 100 columns elsewhere, but for what is there to be copied whole.
Arguments: CIE EXAMPLES."""
import os
import re
import shutil
import sys
import unittest

from program import EXAMPLES, Folder, SPEC, TRACE, cie, on_terminal

SHARED = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
COMMANDS = [
    (*command, *more) for command in (
        ("report", TRACE), ("report", SHARED, "--all"), ("report", SHARED, "--threads"), ("report", SHARED, "--chains"),
        ("verify", SHARED), ("verify", SHARED, "--all"), ("analyze", "schedulability", TRACE),
        ("analyze", "schedulability", TRACE, "--all"), ("diff", TRACE, SHARED), ("diff", TRACE, SHARED, "--all"))
    for more in ((), ("--spec", SPEC))] + [("spec", "check", SPEC), ("doctor",)]


def is_for_copying(line):
    """A command, or nothing but a path beside a label."""
    return re.search(r"\bcie (events|verify|report|view|diff) ", line) or len([word for word in line.split() if word != "\\"]) <= 2


class Width(Folder):
    def check(self, command, text, columns):
        wide = [line for line in text.splitlines() if len(line) > columns and not is_for_copying(line)]
        self.assertEqual(wide, [], command)

    def test_on_a_terminal(self):
        for command in COMMANDS:
            for columns in (80, 120):
                with self.subTest(command=command, columns=columns):
                    _, shown, _ = on_terminal(*command, columns=columns, environment={"NO_COLOR": "1"})
                    self.check(command, shown.decode().replace("\r", ""), columns)

    def test_elsewhere(self):
        for command in COMMANDS:
            with self.subTest(command=command):
                self.check(command, cie(*command).stdout.decode(), 100)

    def test_a_screen_leaves_room_for_what_is_told_before_it(self):
        """Of a recording that goes on, on standard error."""
        growing = self.path("recording-that-goes-on")
        shutil.copytree(SHARED, growing, copy_function=shutil.copyfile)
        self.write("recording-that-goes-on/.cie-record", b"")
        for command in (("report", growing), ("report", growing, "--spec", SPEC), ("verify", growing),
                        ("analyze", "schedulability", growing), ("diff", growing, TRACE)):
            for columns in (60, 80, 132):
                with self.subTest(command=command, columns=columns):
                    _, shown, _ = on_terminal(*command, columns=columns, environment={"NO_COLOR": "1"}, has_errors=True)
                    text = shown.decode().replace("\r", "")
                    self.assertIn("is still being recorded", " ".join(text.split()))
                    self.assertLessEqual(len(text.splitlines()), 23, text)

    def test_all_columns_of_bounds_fit(self):
        _, shown, _ = on_terminal("analyze", "schedulability", TRACE, "--all", columns=80, environment={"NO_COLOR": "1"})
        for title in ("policy", "CPUs", "execution", "inter-arr.", "deadline", "bound", "observed"):
            self.assertRegex(shown.decode(), rf"(?m)^  callback .*\b{title}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
