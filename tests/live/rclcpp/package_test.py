#!/usr/bin/env python3
"""cie_rclcpp as users of ROS 2 build it: cie installed somewhere, the package and a package of theirs in a workspace
(their files are those of executor/rclcpp/README.md), found by ament's index, run without a path to libraries of cie's.

--build: the tree whose cie is installed; --source: the project.
"""
import argparse
import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from xml.etree import ElementTree

options: argparse.Namespace


def blocks(language):
    """What README.md shows of that language."""
    text = (options.source / "executor/rclcpp/README.md").read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def run(command, env=None, expected=0):
    done = subprocess.run([str(word) for word in command], env=env, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False, timeout=900)
    if done.returncode != expected:
        raise AssertionError(f"{command} exits {done.returncode}:\n{done.stdout[-4000:]}")
    return done.stdout


class Workspace:
    """Two packages, each installed in a prefix of its own, as colcon does it."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.cie = self.folder / "cie"
        run(["cmake", "--install", options.build, "--prefix", self.cie])
        self.log = self.build(options.source / "executor/rclcpp", "cie_rclcpp")
        mine = self.folder / "src/my_package"
        (mine / "src").mkdir(parents=True)
        (mine / "launch").mkdir()
        (mine / "CMakeLists.txt").write_text(blocks("cmake")[0], encoding="utf-8")
        (mine / "package.xml").write_text(blocks("xml")[0], encoding="utf-8")
        (mine / "launch/car.launch.py").write_text(blocks("python")[0], encoding="utf-8")
        shutil.copy(options.source / "executor/rclcpp/examples/car.cpp", mine / "src/car.cpp")
        cmake = (mine / "CMakeLists.txt").read_text(encoding="utf-8")
        cmake = cmake.replace("find_package(std_msgs REQUIRED)",  # what this car uses beside
                              "find_package(std_msgs REQUIRED)\nfind_package(std_srvs REQUIRED)")
        cmake = cmake.replace("${std_msgs_TARGETS}", "${std_msgs_TARGETS} ${std_srvs_TARGETS}")
        (mine / "CMakeLists.txt").write_text(cmake, encoding="utf-8")
        self.build(mine, "my_package")

    def prefix(self, package):
        return self.folder / "install" / package

    def build(self, source, package):
        build = self.folder / "build" / package
        prefixes = [self.prefix("cie_rclcpp"), self.cie, *os.environ["AMENT_PREFIX_PATH"].split(":")]
        log = run(["cmake", "-S", source, "-B", build, f"-DCMAKE_INSTALL_PREFIX={self.prefix(package)}",
                   "-DCMAKE_BUILD_TYPE=RelWithDebInfo", f"-DCMAKE_PREFIX_PATH={';'.join(map(str, prefixes))}",
                   *options.cmake])
        run(["cmake", "--build", build, "--parallel", "2", "--target", "install"])
        return log

    def sourced(self, package):
        """The environment after the package's own setup, of which the libraries' path is ROS 2's alone."""
        script = self.prefix(package) / f"share/{package}/local_setup.bash"
        text = run(["bash", "-c", f'export AMENT_CURRENT_PREFIX={self.prefix(package)}; . "{script}" && env -0'])
        env = dict(line.split("=", 1) for line in text.split("\0") if "=" in line)
        return {**env, "LD_LIBRARY_PATH": os.environ.get("LD_LIBRARY_PATH", "")}


class TextTest(unittest.TestCase):
    """What the README shows, where there is no ROS 2 to build it."""

    def test_the_files_of_a_users_package_are_whole(self):
        package = ElementTree.fromstring(blocks("xml")[0])
        self.assertIn("cie_rclcpp", {each.text for each in package.findall("depend")})
        self.assertEqual(package.findtext("export/build_type"), "ament_cmake")
        ast.parse(blocks("python")[0])
        self.assertIn("cie_rclcpp::cie_rclcpp", blocks("cmake")[0])
        self.assertIn("ament_package()", blocks("cmake")[0])

    def test_the_package_is_one_that_ament_finds(self):
        package = ElementTree.parse(options.source / "executor/rclcpp/package.xml").getroot()
        self.assertEqual(package.findtext("export/build_type"), "ament_cmake")
        self.assertIn("ament_cmake", {each.text for each in package.findall("buildtool_depend")})
        self.assertIn("ament_package(", (options.source / "executor/rclcpp/CMakeLists.txt").read_text(encoding="utf-8"))


class BuiltTest(unittest.TestCase):
    """Against ROS 2."""

    @classmethod
    def setUpClass(cls):
        if not options.ros2:
            raise unittest.SkipTest("not possible here: AMENT_PREFIX_PATH leads to no ROS 2")
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.workspace = Workspace(cls.temporary.name)

    def test_aments_index_finds_the_packages(self):
        for package, program in (("cie_rclcpp", "cie_rclcpp_car"), ("my_package", "car")):
            prefix, env = self.workspace.prefix(package), self.workspace.sourced(package)
            self.assertIn(str(prefix), env["AMENT_PREFIX_PATH"].split(":"))
            self.assertTrue((prefix / "share/ament_index/resource_index/packages" / package).is_file())
            self.assertTrue((prefix / "lib" / package / program).is_file())
            found = run([sys.executable, "-c", "from ament_index_python import get_package_prefix as found\n"
                         f"print(found('{package}'))"], env)
            self.assertEqual(found.strip(), str(prefix))

    def test_programs_run_without_a_path_to_our_libraries(self):
        for package, program in (("cie_rclcpp", "cie_rclcpp_car"), ("my_package", "car")):
            path = self.workspace.prefix(package) / "lib" / package / program
            env = {**os.environ, "ROS_DOMAIN_ID": str(40 + os.getpid() % 60)}
            self.assertNotIn("not found", run(["ldd", path], env))
            run([path, "--seconds", "1"], env)

    def test_configuring_says_what_is_left_out(self):
        has_container = (self.workspace.prefix("cie_rclcpp") / "lib/cie_rclcpp/cie_component_container").is_file()
        self.assertNotEqual(has_container, "there is no rclcpp_components" in self.workspace.log)
        empty = self.workspace.folder / "build/without_components"
        log = run(["cmake", "-S", options.source / "executor/rclcpp", "-B", empty, *options.cmake,
                   "-DCMAKE_DISABLE_FIND_PACKAGE_rclcpp_components=ON",
                   f"-DCMAKE_PREFIX_PATH={self.workspace.cie};{os.environ['AMENT_PREFIX_PATH'].replace(':', ';')}"])
        self.assertIn("there is no rclcpp_components: cie_component_container is not built",
                      " ".join(log.split()))  # CMake breaks a warning's lines


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--ros2", action="store_true")
    parser.add_argument("--cmake", action="append", default=[])
    options, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
