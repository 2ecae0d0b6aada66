#!/usr/bin/env python3
"""The first program of executor/README.md, as it stands there: built, recorded, ended by Ctrl-C, verified.
Arguments: PREFIX README COMPILER."""
import os
import re
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "live"))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position

PREFIX, README = (Path(argument).resolve() for argument in sys.argv[1:3])
COMPILER = sys.argv[3]


def run(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)


class FirstProgram(unittest.TestCase):
    def test_it_ends_by_ctrl_c_and_passes(self):
        project = scratch / "project"
        project.mkdir()
        section = re.search(r"^## Write a node$(.*?)^## ", README.read_text(), re.M | re.S).group(1)
        for name, text in re.findall(r"^```\w+\n(?://|#) (\S+)\n(.*?)^```$", section, re.M | re.S):
            (project / name).write_text(text)
        self.assertEqual({file.name for file in project.iterdir()}, {"my_msgs.idl", "lidar.cpp", "CMakeLists.txt"})
        configured = run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={PREFIX}",
                         f"-DCMAKE_CXX_COMPILER={COMPILER}")
        self.assertEqual(configured.returncode, 0, configured.stdout)
        self.assertIn("my_messages.hpp", configured.stdout)
        built = run("cmake", "--build", project / "build")
        self.assertEqual(built.returncode, 0, built.stdout)

        out = scratch / "out"
        environment = {**os.environ, "CIE_LOOPBACK": "1", "CIE_DISCOVERY_TAG": f"first-{os.getpid()}"}
        # A terminal sends Ctrl-C to the whole foreground group.
        with subprocess.Popen([PREFIX / "bin" / "cie", "record", "--kernel=no", "-o", out, "--", project / "build" / "lidar"],
                              env=environment, start_new_session=True, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as recorder:
            isolated_main.wait_for(lambda: any(file.stat().st_size > 0 for file in out.rglob("*_0")) or recorder.poll() is not None,
                                   "something is recorded")
            try:
                output, _ = recorder.communicate(timeout=2)  # some periods of the timer
                self.fail(f"ended by itself: {output}")
            except subprocess.TimeoutExpired:
                os.killpg(recorder.pid, signal.SIGINT)
            output, _ = recorder.communicate(timeout=120)
        verdict = run(PREFIX / "bin" / "cie", "verify", out)
        self.assertEqual(verdict.returncode, 0, output + verdict.stdout)
        self.assertIn("PASS", verdict.stdout)


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("first-program", [], begin)
