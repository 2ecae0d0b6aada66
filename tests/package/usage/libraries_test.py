"""Which libraries programs load does not depend on the directory in which one starts them: it may be a stranger's trace."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

FOLDER = os.path.abspath(sys.argv[1])
PROGRAMS = sorted(name for name in os.listdir(FOLDER) if re.fullmatch(r"cie(-[a-z]+)?", name))


def dynamic(path):
    return subprocess.run(["readelf", "-d", path], stdout=subprocess.PIPE, text=True, timeout=60, check=True).stdout


def needed(program):
    return re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic(os.path.join(FOLDER, program)))


class Libraries(unittest.TestCase):
    def test_paths_are_of_the_program_or_absolute(self):
        libraries = os.path.join(FOLDER, "..", "lib")
        ours = [os.path.join(FOLDER, name) for name in PROGRAMS]
        ours += [os.path.join(libraries, name) for name in os.listdir(libraries) if re.fullmatch(r"libcie_[a-z0-9_]+\.so", name)]
        self.assertGreater(len(ours), len(PROGRAMS))
        for path in ours:
            found = re.search(r"\((?:RUNPATH|RPATH)\).*\[(.*)\]", dynamic(path))
            for entry in found.group(1).split(":") if found else []:
                self.assertRegex(entry, r"^(\$ORIGIN|/)", path)

    def test_commands_load_what_they_need_from_packages_alone(self):
        for name in ("libbabeltrace2.so.0", "libncursesw.so.6"):
            self.assertIn(name, needed("cie-live"))
            self.assertNotIn(name, needed("cie"), "half a millisecond of each start")
        for name in ("cie", "cie-live", "cie-record", "cie-collect"):
            if name in PROGRAMS:
                self.assertNotRegex(dynamic(os.path.join(FOLDER, name)), "RUNPATH|RPATH", name)

    def test_the_library_for_cpp_is_loaded_once_or_linked_from_its_archive(self):
        loaded = subprocess.run(["ldd", os.path.join(FOLDER, "cie")], stdout=subprocess.PIPE, text=True, timeout=60, check=True).stdout
        if "libstdc++.so.6" not in needed("cie"):
            self.assertNotIn("libstdc++", loaded)
            self.assertNotIn("libgcc_s", loaded)

    def test_a_library_in_the_current_directory_is_not_loaded(self):
        names = {name for program in PROGRAMS for name in needed(program)}
        self.assertIn("libc.so.6", names)
        with tempfile.TemporaryDirectory() as strange:
            for name in names:
                with open(os.path.join(strange, name), "w", encoding="ascii") as file:
                    file.write("no library\n")
            for name in PROGRAMS:
                shown = subprocess.run([os.path.join(FOLDER, name), "--help"], cwd=strange, stdin=subprocess.DEVNULL,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
                self.assertEqual((shown.returncode, shown.stderr), (0, ""), name)


unittest.main(argv=sys.argv[:1])
