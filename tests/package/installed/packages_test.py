#!/usr/bin/env python3
"""What is in the Debian packages. Arguments: FOLDER-OF-PACKAGES BUILD-TREE [--lintian]."""
import functools
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

FOLDER, BUILD_TREE = (os.path.abspath(argument) for argument in sys.argv[1:3])
with open(os.path.join(BUILD_TREE, "CMakeCache.txt"), encoding="utf-8") as cache:
    VERSION = re.search(r"^CMAKE_PROJECT_VERSION:STATIC=(.*)$", cache.read(), re.M)[1]
LIBRARIES = "libcie" + VERSION.rpartition(".")[0]
NAMES = {"cie", "cie-doc", "cie-robot", LIBRARIES, "libcie-dev", "babeltrace2-plugin-cie"}
# What the robot needs and the desk must not.
ROBOT_ONLY = re.compile(r"ddsc|cyclonedds|lttng|libcie[0-9]|libbpf|libtraceevent")


def out(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


def is_elf(path):
    with open(path, "rb") as file:
        return file.read(4) == b"\x7fELF"


class Package:
    def __init__(self, path, unpacked):
        self.path = path
        self.name = os.path.basename(path).split("_")[0]
        self.root = os.path.join(unpacked, self.name)
        subprocess.run(["dpkg-deb", "-x", path, self.root], check=True)

    def field(self, name):
        return out("dpkg-deb", "-f", self.path, name).strip()

    def depends(self):
        """Names of the packages this one depends on."""
        return {re.split(r"[ (:]", item.strip())[0] for item in self.field("Depends").split(",")} - {""}

    def files(self):
        return {os.path.relpath(os.path.join(folder, name), self.root)
                for folder, _, names in os.walk(self.root) for name in names}


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.packages = {package.name: package for package in
                        (Package(path, folder.name) for path in glob.glob(os.path.join(FOLDER, "*.deb")))}
        cls.installed = os.path.join(folder.name, "installed")
        subprocess.run(["cmake", "--install", BUILD_TREE, "--prefix", os.path.join(cls.installed, "usr")],
                       stdout=subprocess.DEVNULL, check=True)

    def test_there_is_one_for_each_purpose(self):
        self.assertEqual(set(self.packages), NAMES)
        self.assertEqual({package.field("Version") for package in self.packages.values()}, {VERSION + "-1"})

    def test_no_file_is_in_two_and_none_in_no_package(self):
        owners = {}
        for package in self.packages.values():
            for file in package.files():
                self.assertNotIn(file, owners, package.name)
                owners[file] = package.name
        installed = {os.path.relpath(os.path.join(folder, name), self.installed)
                     for folder, _, names in os.walk(self.installed) for name in names}
        self.assertGreater(len(installed), 50)
        packed = {re.sub(r"(/man/.*)\.gz$", r"\1", file) for file in owners
                  if not re.search(r"/share/(doc/[^/]+/(changelog|copyright)|lintian/overrides/)", file)}
        self.assertEqual(packed, installed)

    def test_libraries_that_programs_need_are_depended_on(self):
        ours = {os.path.basename(file): package.name for package in self.packages.values() for file in package.files()}
        checked = 0
        for package in self.packages.values():
            for file in package.files():
                path = os.path.join(package.root, file)
                if os.path.islink(path) or not is_elf(path):
                    continue
                for soname in re.findall(r"\(NEEDED\).*\[(.*)\]", out("readelf", "-d", path)):
                    checked += 1
                    if ours.get(soname) != package.name:
                        owner = {ours[soname]} if soname in ours else self.owners(soname)
                        self.assertTrue(owner & package.depends(), f"{file} needs {soname} of {owner}")
        self.assertGreater(checked, 30)

    @staticmethod
    @functools.lru_cache(maxsize=None)
    def owners(soname):
        found = subprocess.run(["dpkg-query", "-S", f"*/{soname}"], stdout=subprocess.PIPE, text=True, check=False).stdout
        return {line.split(":")[0] for line in found.splitlines()}

    def test_the_desk_needs_neither_dds_nor_lttng(self):
        for name in ("cie", "babeltrace2-plugin-cie"):
            self.assertEqual([one for one in self.packages[name].depends() if ROBOT_ONLY.search(one)], [])
        self.assertTrue({"lttng-tools", LIBRARIES} <= self.packages["cie-robot"].depends())

    def test_each_says_what_it_is_and_whose(self):
        summaries = set()
        for package in self.packages.values():
            summary, *text = package.field("Description").splitlines()
            self.assertLessEqual(len(summary), 80)
            self.assertGreater(len(text), 3)
            summaries.add(summary)
            doc = os.path.join(package.root, "usr/share/doc", package.name)
            self.assertEqual(sorted(os.listdir(doc)), ["changelog.Debian.gz", "changelog.gz", "copyright"])
            with open(os.path.join(doc, "copyright"), encoding="utf-8") as file:
                self.assertIn("/usr/share/common-licenses/Apache-2.0", file.read())
        self.assertEqual(len(summaries), len(self.packages))

    def test_who_builds_against_it_gets_modules(self):
        modules = {os.path.basename(file) for file in self.packages["libcie-dev"].files() if "/cmake/cie/" in file}
        self.assertTrue({"cieConfig.cmake", "CieMessages.cmake", "CieComponents.cmake", "std_msgs.idl"} <= modules, modules)

    def test_who_reads_gets_pages_whose_links_hold(self):
        package = self.packages["cie-doc"]
        self.assertEqual((package.field("Architecture"), package.depends()), ("all", set()))
        documents = {file for file in package.files() if file.startswith("usr/share/doc/cie/")}
        self.assertTrue({f"usr/share/doc/cie/{name}" for name in
                         ("CHANGELOG.md", "README.md", "executor/README.md", "tracepoints/README.md", "analysis/README.md",
                          "viewer_export/README.md", "viewer_export/docs/reference.md", "executor/docs/nodes.md")} <= documents)
        links = 0
        for document in documents:
            if not document.endswith(".md"):
                continue
            with open(os.path.join(package.root, document), encoding="utf-8") as text:
                for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text.read()):
                    if not re.match(r"https?:", target):
                        links += 1
                        self.assertIn(os.path.normpath(os.path.join(os.path.dirname(document), target)), documents, document)
        self.assertGreater(links, 30)

    def test_files_that_changed_their_package_replace_the_former_one(self):
        for relation in ("Breaks", "Replaces"):
            self.assertEqual(self.packages["cie-doc"].field(relation), "libcie-dev (<< 0.2.0)")

    def test_units_have_scripts_that_a_shell_can_read(self):
        for name, units in (("cie-robot", ("cie-record", "cie-collect")), ("cie", ("cie-live",))):
            package = self.packages[name]
            self.assertEqual({os.path.basename(file) for file in package.files() if file.endswith(".service")},
                             {unit + ".service" for unit in units})
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run(["dpkg-deb", "--control", package.path, folder], check=True)
                for script in ("postinst", "prerm", "postrm"):
                    path = os.path.join(folder, script)
                    subprocess.run(["sh", "-n", path], check=True)
                    with open(path, encoding="utf-8") as text:
                        self.assertIn("for unit in " + " ".join(units) + ";", text.read(), script)

    def test_programs_and_libraries_are_stripped(self):
        for name in ("cie", "cie-robot", LIBRARIES, "babeltrace2-plugin-cie"):
            for file in self.packages[name].files():
                path = os.path.join(self.packages[name].root, file)
                if re.search(r"usr/bin/|\.so", file) and not os.path.islink(path):
                    self.assertNotIn(".debug_info", out("readelf", "-S", path), file)


class Lintian(unittest.TestCase):
    """Only with --lintian: it takes long, and packages for a quick test are not compressed."""

    def test_lintian_finds_nothing(self):
        result = subprocess.run(["lintian", "--allow-root", "--fail-on", "error,warning", *glob.glob(os.path.join(FOLDER, "*.deb"))],
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stdout)


if __name__ == "__main__":
    if shutil.which("dpkg-deb") is None:
        print("not possible here: no Debian, no dpkg-deb")
        sys.exit(77)
    if "--lintian" not in sys.argv:
        del Lintian
    unittest.main(argv=sys.argv[:1], verbosity=1)
