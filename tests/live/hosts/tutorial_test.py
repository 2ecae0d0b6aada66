#!/usr/bin/env python3
"""The commands of viewer_export/docs/several_machines.md, as they stand there, on machines of their own."""

import re
import shlex
import signal
import unittest
from pathlib import Path

import machines
from machines import CIE, PROGRAMS, Network, cie, report, wait_for

PAGE = Path(__file__).resolve().parents[3] / "viewer_export" / "docs" / "several_machines.md"


class Tutorial(unittest.TestCase):
    def test_its_commands(self):
        text = PAGE.read_text(encoding="utf-8")
        collect, robot, desk, live, look = re.findall(r"^```sh\n(.*?)\n```$", text, re.MULTILINE | re.DOTALL)
        network = Network(self.addCleanup, "robot", "desk")

        def start(machine, command):
            words = shlex.split(command.replace("--duration 20", "--duration 6"))
            words = [str(PROGRAMS / word) if word.startswith("cie") else word for word in words]
            folder = machines.scratch / machine.name
            folder.mkdir(exist_ok=True)
            return machine.run("sh", "-c", 'cd "$0" && exec "$@"', folder, *words)

        collecting = start(network.collector, collect)
        wait_for(lambda: "on each machine" in collecting.said(), "cie collect")
        recorders = [start(network["robot"], robot), start(network["desk"], desk)]
        fleet = machines.scratch / "collector" / "fleet"
        wait_for(lambda: len(list(fleet.glob("*/*"))) == 2, "both sessions")
        watching = start(network.collector, live)
        self.assertEqual(watching.wait(), 0, watching.said())
        self.assertRegex(watching.said(), r"(?m)^robot: (streaming|waiting)")
        for recorder in recorders:
            self.assertEqual(recorder.wait(), 0, recorder.said())
        self.assertEqual(collecting.end(signal.SIGINT), 0, collecting.said())
        for command in look.splitlines():
            program, *arguments = shlex.split(command)
            self.assertEqual(program, CIE.name)
            done = cie.run(*[fleet if word == "fleet" else word for word in arguments])
            self.assertIn(done.returncode, (0, 1, 3), done.stderr)
            self.assertRegex(done.stdout, "PASS|FAIL|INCONCLUSIVE")
        self.assertRegex(cie.run("report", fleet, "--all").stdout, r"(?m)^.*\bdesk\b.*\brobot\b")
        clocks, = report(fleet)["clocks"]
        self.assertEqual(sum(count > 0 for count in clocks["messages"]), 1, "the demo's messages go one way")
        self.assertIsNone(clocks["error_ns"])


if __name__ == "__main__":
    machines.main("tutorial")
