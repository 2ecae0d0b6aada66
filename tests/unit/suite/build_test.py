#!/usr/bin/env python3
"""./run and CMake's options: for whom a warning is an error, which versions the build accepts, and its own.
Arguments: CMAKE SOURCES [FOLDER-OF-CYCLONEDDSCONFIG]."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path
from xml.etree import ElementTree

CMAKE, SOURCES = sys.argv[1], Path(sys.argv[2]).resolve()
CYCLONE_DDS = Path(sys.argv[3]) if len(sys.argv) > 3 and sys.argv[3] else None


def read(name):
    return (SOURCES / name).read_text("utf-8")


class Scratch(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="cie-build-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)


class Warnings(Scratch):
    def option(self, *arguments):
        """Whether CIE_WERROR is on after configuring the least there is."""
        tree = self.folder / "tree"
        subprocess.run([CMAKE, "-S", SOURCES, "-B", tree, *arguments, "-DCIE_BUILD_ROBOT=OFF", "-DCIE_BUILD_DESK=OFF",
                        "-DCIE_BUILD_TESTS=OFF", "-DCIE_BUILD_FUZZERS=OFF"], check=True, stdout=subprocess.DEVNULL, timeout=200)
        return re.search(r"^CIE_WERROR:\w+=(\w+)$", (tree / "CMakeCache.txt").read_text("utf-8"), re.M)[1]

    def test_who_only_builds_is_not_stopped_by_one(self):
        self.assertEqual(self.option(), "OFF")

    def test_nor_is_who_builds_a_release_or_packages(self):
        presets = json.loads(read("CMakePresets.json"))["configurePresets"]
        self.assertEqual([one["name"] for one in presets if "CIE_WERROR" in one.get("cacheVariables", {})], ["dev"])
        for errors in ("OFF", "ON"):
            tree = self.folder / errors
            subprocess.run([CMAKE, "-G", "Ninja", "-S", SOURCES, "-B", tree, f"-DCIE_WERROR={errors}", "-DCIE_WITH_DDS=OFF",
                            "-DCIE_BUILD_DESK=OFF", "-DCIE_BUILD_TESTS=OFF"], check=True, stdout=subprocess.DEVNULL, timeout=200)
            self.assertEqual("-Werror" in (tree / "build.ninja").read_text("utf-8"), errors == "ON")

    def test_who_develops_is(self):
        self.assertEqual(self.option("--preset", "dev"), "ON")


class WithoutDds(Scratch):
    """cie::scheduling alone, on a machine that has no Cyclone DDS."""

    def configured(self, *arguments):
        return subprocess.run([CMAKE, "-S", SOURCES, "-B", self.folder / "tree", "-DCIE_BUILD_DESK=OFF",
                               "-DCMAKE_DISABLE_FIND_PACKAGE_CycloneDDS=ON", *arguments],
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False, timeout=200)

    def test_the_scheduling_and_its_tests_are_built_without_looking_for_it(self):
        done = self.configured("-DCIE_WITH_DDS=OFF")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("CycloneDDS_DIR", (self.folder / "tree" / "CMakeCache.txt").read_text("utf-8"))
        targets = set(re.findall(r"[\w-]+", subprocess.run([CMAKE, "--build", self.folder / "tree", "--target", "help"],
                                                           check=True, capture_output=True, text=True, timeout=100).stdout))
        self.assertLessEqual({"cie_tracepoints", "cie_scheduling", "unit_scheduling"}, targets)
        self.assertFalse(targets & {"cie_executor", "cie_container", "cie-run", "cie-demo", "unit_executor"})

    def test_the_executor_is_not_built_without_it(self):
        done = self.configured("-DCIE_BUILD_TESTS=OFF")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("CycloneDDS", done.stderr)


class Run(Scratch):
    """./run, with commands in place of the real ones that say what they were called with."""

    def scripts(self, folder, **scripts):
        (self.folder / folder).mkdir(parents=True)
        for name, script in scripts.items():
            path = self.folder / folder / name.replace("_", "-" if folder == "tools" else "_")
            path.write_text(f"#!/bin/sh\n{script}\n", "utf-8")
            path.chmod(0o755)

    def run_it(self, *arguments):
        shutil.copy(SOURCES / "run", self.folder)
        self.scripts("tools", cmake='mkdir -p build/dev; echo "$@" >>calls', dpkg_query="echo installed", dpkg="")
        return subprocess.run([self.folder / "run", *arguments], check=False, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              env={**os.environ, "PATH": f"{self.folder / 'tools'}:{os.environ['PATH']}"}, text=True, timeout=100)

    def calls(self, *arguments):
        self.assertEqual(self.run_it(*arguments).returncode, 0)
        return (self.folder / "calls").read_text("utf-8").splitlines()

    def test_build_takes_no_warning_for_an_error(self):
        configuring, building = self.calls("build")
        self.assertIn("--preset dev ", configuring)
        self.assertIn(" -DCIE_WERROR=OFF", configuring)
        self.assertIn("--build --preset dev", building)

    def test_whoever_calls_adds_options_of_cmake(self):
        with unittest.mock.patch.dict(os.environ, CIE_CMAKE="-DCIE_WITH_DDS=OFF -DCIE_BUILD_DESK=ON"):
            configuring, _ = self.calls("build")
        self.assertTrue(configuring.endswith(" -DCIE_WITH_DDS=OFF -DCIE_BUILD_DESK=ON"), configuring)

    def test_commands_refuse_what_they_do_not_know_before_they_begin(self):
        for command in ("build", "fuzz"):
            done = self.run_it(command, "--help")
            shutil.rmtree(self.folder / "tools")
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, rf'^run: {command}: no option "--help"[^\n]*\n$')

    @unittest.skipUnless(os.geteuid() == 0, "not possible here: only root makes a system of its own")
    def test_packages_of_another_debian_are_built_and_tried_there(self):
        self.scripts("tests/package/elsewhere", in_another_system='printf "%s\\n" "$@" >calls; mkdir -p "$4"; touch "$4/a.deb"')
        self.assertEqual(self.calls("package", "--try", "debian13"),
                         ["trixie", "./run package --try", "build/package/packages", "build/package/debian13"])

    @unittest.skipUnless(os.geteuid() == 0, "not possible here: only root makes a system of its own")
    def test_the_two_commands_are_tried_elsewhere(self):
        self.scripts("tests/package/elsewhere", in_another_system='printf "%s\n" "$@" >>calls')
        self.assertEqual(self.calls("elsewhere", "ubuntu24.04"), ["noble", "./run demo && ./run test"])

    def test_a_package_is_there_only_by_its_very_name(self):
        self.scripts("tools", dpkg_query="exit 1",
                     apt_cache='case $2 in there) echo "there:\n  Installed: (none)\n  Candidate: 11.3";; '
                               'gone) echo "gone:\n  Candidate: (none)";; *) echo "lib-g++-110:\n  Candidate: 1.0";; esac')
        function = re.search(r"^need_if_there\(\) {.*?^}", read("run"), re.M | re.S)[0]
        done = subprocess.run(["bash", "-euc", "is_installed() { return 1; }\nneed() { echo \"$*\"; }\n" + function +
                               "\nneed_if_there there g++-11 gone; echo \"$CIE_NO_PACKAGES\""], check=True, capture_output=True,
                              env={**os.environ, "PATH": f"{self.folder / 'tools'}:{os.environ['PATH']}"}, text=True, timeout=20)
        self.assertEqual(done.stdout.splitlines(), ["there", "g++-11 gone"])

    def test_packages_of_another_architecture_come_into_no_system_but_their_own(self):
        done = self.run_it("arm64")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("./run elsewhere arm64", done.stderr)
        self.assertFalse((self.folder / "calls").exists())


class CycloneDds(unittest.TestCase):
    def accepts(self, version):
        done = subprocess.run([CMAKE, f"-DCycloneDDS_VERSION={version}", "-P",
                               SOURCES / "executor" / "cmake" / "CieCycloneDdsVersion.cmake"],
                              stderr=subprocess.PIPE, text=True, check=False, timeout=100)
        if done.returncode != 0:
            self.assertIn(f"{version} was not tried", re.sub(r"\s+", " ", done.stderr))
        return done.returncode == 0

    def test_versions_that_were_tried_and_no_others(self):
        self.assertEqual([v for v in ("0.10.1", "0.10.2", "0.10.3", "0.10.4", "0.10.5", "0.10.6", "0.11.0", "0.9.1", "1.0.0")
                          if self.accepts(v)], ["0.10.2", "0.10.3", "0.10.4", "0.10.5"])


@unittest.skipUnless(CYCLONE_DDS, "not possible here: this tree is built without Cyclone DDS")
class AnotherCycloneDds(Scratch):
    """The robot's half is configured with the Cyclone DDS that is here, after something of it was changed."""

    def configured(self, *options, version="0.10.2", has="Config", header=None, old="", new=""):
        """What CMake says, in one line; empty if it succeeds."""
        (self.folder / "CycloneDDSConfigVersion.cmake").write_text(
            f"set(PACKAGE_VERSION {version})\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n", "utf-8")
        (self.folder / "CycloneDDSConfig.cmake").write_text(
            f'include("{CYCLONE_DDS}/CycloneDDS{has}.cmake")\n'
            f'target_include_directories(CycloneDDS::ddsc BEFORE INTERFACE "{self.folder}/include")\n', "utf-8")
        (self.folder / "include").mkdir(exist_ok=True)
        if header:
            prefix = next(one for one in CYCLONE_DDS.parents if (one / "include" / header).exists())
            text = (prefix / "include" / header).read_text("utf-8")
            self.assertIn(old, text)
            changed = self.folder / "include" / header
            changed.parent.mkdir(parents=True)
            changed.write_text(text.replace(old, new), "utf-8")
        done = subprocess.run([CMAKE, "-S", SOURCES, "-B", self.folder / "tree", f"-DCycloneDDS_DIR={self.folder}",
                               "-DCIE_BUILD_DESK=OFF", "-DCIE_BUILD_TESTS=OFF", *options],
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False, timeout=200)
        return re.sub(r"\s+", " ", done.stderr) if done.returncode else ""

    def test_the_same_is_good_enough(self):
        self.assertEqual(self.configured(), "")

    def test_a_version_that_was_not_tried_is_built_for_a_trial_only(self):
        refused = self.configured(version="0.11.0")
        self.assertIn("Cyclone DDS 0.11.0 was not tried.", refused)
        self.assertIn("-DCIE_CYCLONEDDS_UNTRIED=ON", refused)
        self.assertEqual(self.configured("-DCIE_CYCLONEDDS_UNTRIED=ON", version="0.11.0"), "")

    def test_one_without_its_compiler_of_idl_is_refused(self):
        self.assertIn("was built without its compiler of IDL", self.configured(has="Targets"))

    def test_a_sample_cache_with_one_more_operation_is_refused(self):
        self.assertIn("lacks what dds/delivery.cpp of executor/src need",
                      self.configured(header="dds/ddsc/dds_rhc.h", old="dds_rhc_associate_t associate;",
                                      new="dds_rhc_associate_t associate; dds_rhc_associate_t another;"))

    def test_so_is_a_type_with_one_that_is_called_differently(self):
        said = self.configured(header="dds/ddsi/ddsi_sertype.h", old="bool (*ddsi_sertype_equal_t) (",
                               new="bool (*ddsi_sertype_equal_t) (bool is_strict, ")
        self.assertIn("lacks what dds/message_data.cpp of executor/src need", said)
        self.assertIn("it was written for", said)
        self.assertIn("0.10.2: Debian 12", said)

    def test_so_is_a_stream_that_takes_something_else(self):
        self.assertIn("lacks what dds/cdr_bytes.cpp and others of executor/src need",
                      self.configured(header="dds/ddsi/ddsi_cdrstream.h", old="void dds_istream_init (dds_istream_t * __restrict st, ",
                                      new="void dds_istream_init (dds_istream_t * __restrict st, void *allocator, "))


class Version(unittest.TestCase):
    """CMake's is the one home; these need a word of their own."""

    def test_packages_of_ros_and_changelog_have_the_same(self):
        version = re.search(r"^project\(cie VERSION (\S+)", read("CMakeLists.txt"), re.M)[1]
        self.assertEqual(ElementTree.fromstring(read("executor/rclcpp/package.xml")).findtext("version"), version)
        sections = re.findall(r"^## (.*)$", read("CHANGELOG.md"), re.M)
        self.assertEqual([one for one in sections if one != "Unreleased"][0], version)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
