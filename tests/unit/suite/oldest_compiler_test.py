#!/usr/bin/env python3
"""The public headers before the oldest compiler that README names. Argument: a build tree."""
import json
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from system_package import lacking  # noqa: E402  pylint: disable=wrong-import-position

TREE = Path(sys.argv.pop()).resolve()
COMPILER = "g++-11"


def header_checks():
    """Of each library: the sources that the tree compiles to check its headers, and where these find others."""
    checks = {}
    for entry in json.loads((TREE / "compile_commands.json").read_text("utf-8")):
        library = re.search(r"(\w+)_header_check\.dir/", entry["command"])
        if library:
            flags = re.findall(r"(?:-I|-isystem |-D)\S+", entry["command"])
            checks.setdefault(library[1], (set(), flags))[0].add(entry["file"])
    return checks


class Headers(unittest.TestCase):
    def test_it_compiles_each(self):
        if not shutil.which(COMPILER):
            self.skipTest(lacking(COMPILER))
        checks = header_checks()
        self.assertLessEqual({"cie_schema", "cie_analysis", "cie_viewer_export"}, set(checks))
        for library, (sources, flags) in checks.items():
            with self.subTest(library), tempfile.NamedTemporaryFile("w", suffix=".cpp") as all_of_them:
                all_of_them.writelines(f'#include "{source}"\n' for source in sorted(sources))
                all_of_them.flush()
                done = subprocess.run([COMPILER, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
                                       *shlex.split(" ".join(flags)), all_of_them.name],
                                      capture_output=True, text=True, check=False, timeout=200)
                self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
