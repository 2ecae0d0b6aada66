#!/usr/bin/env python3
"""README's "What you see" is what the demo prints of the recordings in demo.tar.xz, on a terminal of 80 columns.
Arguments: FOLDER-OF-PROGRAMS SOURCES [--update]."""
import os
import re
import sys
import tarfile
import tempfile
import unittest
from pathlib import Path

PROGRAMS = Path(sys.argv[1]).resolve()
SOURCES = Path(sys.argv[2]).resolve()
README = SOURCES / "README.md"
RECORDINGS = SOURCES / "tests/golden/readme/demo.tar.xz"
BLOCK = re.compile(r"(?<=^```console\n)(== 1\. .*?)(?=^```$)", re.M | re.S)

sys.path.insert(0, str(SOURCES / "tests/support"))
from on_terminal import on_terminal  # noqa: E402  pylint: disable=wrong-import-position


def demo():
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(RECORDINGS) as archive:
            archive.extractall(folder)
        environment = {**os.environ, "PATH": f"{PROGRAMS}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8", "TERM": "xterm",
                       "NO_COLOR": "1"}
        script = SOURCES / "executor/examples/demo/compare_executors"
        # The folder is called as ./run demo calls it.
        code, lines = on_terminal(["sh", "-c", f"cd '{folder}' && exec '{script}' build/demo recordings"], environment, 80)
    text = "\n".join(lines) + "\n"
    assert code == 0, text
    return text


class WhatYouSee(unittest.TestCase):
    maxDiff = None

    def test_is_what_the_demo_prints(self):
        shown, = BLOCK.findall(README.read_text(encoding="utf-8"))
        self.assertEqual(shown, demo(), "if that is meant: readme_test.py FOLDER-OF-PROGRAMS SOURCES --update")

    def test_fits_a_page(self):
        lines = BLOCK.search(README.read_text(encoding="utf-8"))[1].splitlines()
        self.assertLessEqual(len(lines), 60)
        self.assertLessEqual(max(map(len, lines)), 80)


if __name__ == "__main__":
    if "--update" in sys.argv:
        text = README.read_text(encoding="utf-8")
        README.write_text(BLOCK.sub(lambda _: demo(), text), encoding="utf-8")
        sys.exit(0)
    unittest.main(argv=sys.argv[:1], verbosity=2)
