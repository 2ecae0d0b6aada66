#!/usr/bin/env python3
"""README's "What you see" is what the demo prints of the recordings in demo.tar.xz, on a terminal of 80 columns;
screens.txt is what report and verify print of them, in 80 and 120 columns and into a pipe.
Arguments: FOLDER-OF-PROGRAMS SOURCES [--update]."""
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import unittest
from pathlib import Path

PROGRAMS = Path(sys.argv[1]).resolve()
SOURCES = Path(sys.argv[2]).resolve()
README = SOURCES / "README.md"
RECORDINGS = SOURCES / "tests/golden/readme/demo.tar.xz"
SCREENS = SOURCES / "tests/golden/readme/screens.txt"
ENVIRONMENT = {**os.environ, "PATH": f"{PROGRAMS}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8", "TERM": "xterm", "NO_COLOR": "1"}
BLOCK = re.compile(r"(?<=^```console\n)(== 1\. .*?)(?=^```$)", re.M | re.S)

sys.path.insert(0, str(SOURCES / "tests/support"))
from on_terminal import on_terminal  # noqa: E402  pylint: disable=wrong-import-position


def extract(folder):
    with tarfile.open(RECORDINGS) as archive:
        archive.extractall(folder)


def demo():
    with tempfile.TemporaryDirectory() as folder:
        extract(folder)
        script = SOURCES / "executor/examples/demo/compare_executors"
        # The folder is called as ./run demo calls it.
        code, lines = on_terminal(["sh", "-c", f"cd '{folder}' && exec '{script}' build/demo recordings"], ENVIRONMENT, 80)
    text = "\n".join(lines) + "\n"
    assert code == 0, text
    return text


def screens():
    """By their titles, each a list of lines."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        extract(folder)
        inside = f"cd '{folder}/recordings' && "
        for name in ("isolated", "multi"):
            for command in ("report", "verify"):
                line = f"cie {command} {name} --spec demo.yaml"
                for columns in (80, 120):
                    found[f"$ {line}    # {columns} columns"] = on_terminal(["sh", "-c", inside + line], ENVIRONMENT, columns)[1]
                piped = subprocess.run(["sh", "-c", inside + line], env=ENVIRONMENT, stdout=subprocess.PIPE, check=False).stdout
                found[f"$ {line} | cat"] = piped.decode("ascii").splitlines()
    return found


def as_text(found):
    return "\n".join("\n".join([title, *lines]) + "\n" for title, lines in found.items())


class WhatYouSee(unittest.TestCase):
    maxDiff = None

    def test_is_what_the_demo_prints(self):
        shown, = BLOCK.findall(README.read_text(encoding="utf-8"))
        self.assertEqual(shown, demo(), "if that is meant: readme_test.py FOLDER-OF-PROGRAMS SOURCES --update")

    def test_fits_a_page(self):
        lines = BLOCK.search(README.read_text(encoding="utf-8"))[1].splitlines()
        self.assertLessEqual(len(lines), 60)
        self.assertLessEqual(max(map(len, lines)), 80)

    def test_screens_are_as_they_were_looked_at(self):
        found = screens()
        for title, lines in found.items():
            self.assertLessEqual(len(lines), 24, title)
            self.assertLessEqual(max(map(len, lines)), 80 if "# 80" in title else 120 if "# 120" in title else 100, title)
        self.assertEqual(SCREENS.read_text(encoding="utf-8"), as_text(found), "if that is meant: --update, and look at it")


if __name__ == "__main__":
    if "--update" in sys.argv:
        SCREENS.write_text(as_text(screens()), encoding="utf-8")
        text = README.read_text(encoding="utf-8")
        README.write_text(BLOCK.sub(lambda _: demo(), text), encoding="utf-8")
        sys.exit(0)
    unittest.main(argv=sys.argv[:1], verbosity=2)
