#!/usr/bin/env python3
"""systemd's units: well formed, with few rights, and of options that there are. Arguments: FOLDER-OF-PROGRAMS SOURCES."""
import glob
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

from programs import Programs

PROGRAMS = Programs(sys.argv[1])
UNITS = glob.glob(os.path.join(os.path.abspath(sys.argv[2]), "*", "systemd", "*.service"))
MOST_EXPOSURE = 15  # of 100, in systemd's own count; a socket for this machine costs 7


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


class Units(unittest.TestCase):
    def test_there_are_some(self):
        self.assertIn("cie-record.service", [os.path.basename(path) for path in UNITS])

    def test_systemd_understands_them(self):
        for path in UNITS:
            with self.subTest(os.path.basename(path)), tempfile.TemporaryDirectory() as folder:
                # The programs where they are now, so that it is the units that are looked at.
                copy = os.path.join(folder, os.path.basename(path))
                with open(copy, "w", encoding="utf-8") as file:
                    file.write(read(path).replace("/usr/bin/cie", PROGRAMS.folder + "/cie"))
                result = subprocess.run(["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", copy],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
                self.assertEqual((result.returncode, result.stdout), (0, ""))

    def test_rights_are_few(self):
        for path in UNITS:
            with self.subTest(os.path.basename(path)):
                result = subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager",
                                         f"--threshold={MOST_EXPOSURE}", path],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
                self.assertEqual(result.returncode, 0, result.stdout)

    def test_what_listens_has_a_bound_on_its_memory(self):
        for path in UNITS:
            if "--listen" in read(path):
                self.assertRegex(read(path), r"(?m)^MemoryMax=\d+[MG]$")

    def test_options_exist(self):
        for path in UNITS:
            text = read(path)
            command = shlex.split(re.search(r"^ExecStart=(.*)$", text, re.M).group(1))
            for name, value in re.findall(r'^Environment="(\w+)=(.*)"$', text, re.M):
                at = command.index("$" + name)
                command[at:at + 1] = shlex.split(value)
            self.assertFalse([word for word in command if "$" in word], path)
            program = os.path.basename(command[0])
            begin = 2 if program == "cie" else 1
            known = {name for option in PROGRAMS.options(program, *command[1:begin]) for name in option.names}
            used = [word.split("=")[0] for word in command[begin:] if word.startswith("-")]
            self.assertTrue(used)
            self.assertEqual([option for option in used if option not in known], [])

    def test_a_program_that_starts_others_ends_them_itself(self):
        """systemd would tell all at once: `cie live` then found its stream broken, and the unit had failed."""
        starting = [path for path in UNITS if re.search(r"^ExecStart=/usr/bin/cie live\b", read(path), re.M)]
        self.assertTrue(starting)
        for path in starting:
            self.assertRegex(read(path), r"(?m)^KillMode=mixed$", path)

    def test_users_are_made(self):
        for path in UNITS:
            user = re.search(r"^User=(.*)$", read(path), re.M)
            if user:
                self.assertRegex(read(path.replace(".service", ".sysusers")), rf"(?m)^u {re.escape(user.group(1))} ")


if __name__ == "__main__":
    if shutil.which("systemd-analyze") is None:
        print("SKIPPED: systemd-analyze is not installed")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=1)
