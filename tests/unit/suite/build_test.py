#!/usr/bin/env python3
"""./run and CMake's options: for whom a warning is an error, and which versions the build accepts.
Arguments: CMAKE SOURCES."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CMAKE, SOURCES = sys.argv[1], Path(sys.argv[2]).resolve()


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

    def calls_of_cmake(self, *arguments):
        shutil.copy(SOURCES / "run", self.folder)
        tools = self.folder / "tools"
        tools.mkdir()
        for name, script in (("cmake", 'mkdir -p build/dev; echo "$@" >>calls'), ("dpkg-query", "echo installed")):
            (tools / name).write_text(f"#!/bin/sh\n{script}\n", "utf-8")
            (tools / name).chmod(0o755)
        subprocess.run([self.folder / "run", *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                       env={**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"}, timeout=100)
        return (self.folder / "calls").read_text("utf-8").splitlines()

    def test_build_takes_no_warning_for_an_error(self):
        configuring, building = self.calls_of_cmake("build")
        self.assertIn("--preset dev ", configuring)
        self.assertIn(" -DCIE_WERROR=OFF", configuring)
        self.assertIn("--build --preset dev", building)


class CycloneDds(unittest.TestCase):
    def accepts(self, version):
        done = subprocess.run([CMAKE, f"-DCycloneDDS_VERSION={version}", "-P",
                               SOURCES / "executor" / "cmake" / "CieCycloneDdsVersion.cmake"],
                              stderr=subprocess.PIPE, text=True, check=False, timeout=100)
        if done.returncode != 0:
            self.assertIn(f"found {version}", re.sub(r"\s+", " ", done.stderr))
        return done.returncode == 0

    def test_versions_that_were_tried_and_no_others(self):
        self.assertEqual([v for v in ("0.10.1", "0.10.2", "0.10.3", "0.10.4", "0.10.5", "0.10.6", "0.11.0", "0.9.1", "1.0.0")
                          if self.accepts(v)], ["0.10.2", "0.10.3", "0.10.4", "0.10.5"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
