#!/usr/bin/env python3
"""What the component container says to components and files that it cannot use."""

import os
import signal
import subprocess
import time
import unittest
from pathlib import Path

import harness
from harness import (ENDED_WELL, FAILED, UNUSABLE, app_file, component, order,
                     run_and_end, run_to_its_end, Running, wait_for)


class BadComponents(unittest.TestCase):
    """One does not take the others down, and each is told by name."""

    def assert_told(self, bad, *parts):
        file = app_file(component("first"), bad, component("last"))
        code, _, said = run_and_end(file)
        self.assertEqual(code, ENDED_WELL, said)
        self.assertIn('loaded "/first"', said)
        self.assertIn('loaded "/last"', said)
        self.assertIn("2 components under the executor \"isolated\", 1 could not be loaded", said)
        line = next(line for line in said.splitlines() if "is not loaded" in line)
        for part in (f'{file}:7: component "/bad"', *parts):
            self.assertIn(part, line)

    def test_missing_library(self):
        self.assert_told(component("bad", library="libabsent.so"), "libabsent.so",
                         "No such file or directory")

    def test_no_entry_point(self):
        self.assert_told(component("bad", library="libno_entry.so"), "cie_component_library()")

    def test_other_interface_version(self):
        self.assert_told(component("bad", library="libold_abi.so"), "version 2", "rebuild it")

    def test_unknown_class(self):
        self.assert_told(component("bad", of="Absent"), 'no class "odd::Absent"', "odd::Good")

    def test_throwing_constructor(self):
        self.assert_told(component("bad", of="ThrowsInConstructor"), "no lidar is connected")

    def test_unknown_parameter(self):
        self.assert_told(component("bad", more="parameters: {raet: 1}"), "no parameter raet")

    def test_an_unknown_parameter_of_the_command_line_is_named_by_it(self):
        given = "/bad:raet:=1"
        status, text = run_to_its_end(app_file(component("bad")), "-p", given)
        self.assertEqual(status, 4, text)
        self.assertIn(f'-p {given}: component "/bad"', text)
        self.assertNotIn("app.yaml:", text)

    def test_other_name(self):
        self.assert_told(component("bad", of="NamesItselfOtherwise"), '"/somebody_else"')

    def test_none_is_left(self):
        code, said = run_to_its_end(app_file(component("bad", of="ThrowsInConstructor")))
        self.assertEqual(code, FAILED, said)
        self.assertIn("none of the components could be loaded", said)

    def test_throwing_callback(self):
        file = app_file(component("first"), component("bad", of="ThrowsInCallback"))
        code, _, said = run_and_end(file)
        self.assertEqual(code, FAILED, said)
        self.assertEqual(said.count("threw: odd"), 1, said)
        self.assertIn('callback "/bad@Timer(10000000)"', said)
        self.assertRegex(said, r"ended by an exception \d+ time")


class BadFiles(unittest.TestCase):

    def assert_unusable(self, file, *parts, arguments=()):
        code, said = run_to_its_end(file, *arguments)
        self.assertEqual(code, UNUSABLE, said)
        for part in parts:
            self.assertIn(part, said)

    def test_unknown_key(self):
        file = app_file(component("a"), head="executer: single\n")
        self.assert_unusable(file, f'{file}:3: unknown key "executer"')

    def test_missing_file(self):
        self.assert_unusable(harness.scratch / "absent.yaml", "absent.yaml: cannot read it")

    def test_missing_spec(self):
        self.assert_unusable(app_file(component("a"), head="spec: absent.yaml\n"),
                             f"{harness.scratch}/absent.yaml: cannot read it")

    def test_bad_spec(self):
        spec = harness.scratch / "bad_spec.yaml"
        spec.write_text("callback_groups:\n  - id: /a@Timer(50000000)\n    policy: SCHED_NOPE\n")
        self.assert_unusable(app_file(component("a"), head="spec: bad_spec.yaml\n"),
                             f'{spec}:3: entry "/a@Timer(50000000)": unknown policy')

    def test_spec_of_another_machine(self):
        spec = harness.scratch / "abacus.yaml"
        spec.write_text("callback_groups: []\nhardware_info: {model_name: abacus}\n")
        said = f'{spec}:2: entry "hardware_info": "model_name" should be "abacus"'
        self.assert_unusable(app_file(component("a"), head="spec: abacus.yaml\n"), said)
        code, _, told = run_and_end(app_file(component("a"),
                                             head="spec: abacus.yaml\non_error: warn\n"))
        self.assertEqual(code, ENDED_WELL)
        self.assertIn("warning: " + said, told)

    def test_spec_with_a_misspelt_id(self):
        spec = harness.scratch / "misspelt.yaml"
        spec.write_text("callback_groups:\n  - id: /a@Timer(5000000)\n")
        code, _, told = run_and_end(app_file(component("a"), head="spec: misspelt.yaml\n"))
        self.assertEqual(code, ENDED_WELL, told)
        said = (f'warning: {spec}:2: "/a@Timer(5000000)": no callback has this id: it configures nothing; '
                'did you mean "/a@Timer(50000000)"?')
        self.assertEqual(told.count(said), 1, told)

    @unittest.skipIf(os.nice(0) > 3, "not possible here: runs at a nice value that an ordinary user cannot lower")
    def test_spec_of_the_domain(self):
        spec = harness.scratch / "domains.yaml"
        spec.write_text("callback_groups:\n"
                        "  - {id: /a@Timer(50000000), domain_id: 3, policy: SCHED_OTHER, nice: 3}\n"
                        "  - {id: /a@Timer(50000000), domain_id: 4, policy: SCHED_OTHER, nice: 4}\n"
                        "dds_threads: [{name: dq.*, policy: SCHED_OTHER, nice: 7}]\n")
        file = app_file(component("a"), head="spec: domains.yaml\ndomain: 4\n")
        with Running(file) as running:
            def nice_of(name):
                for task in Path(f"/proc/{running.process.pid}/task").iterdir():
                    if (task / "comm").read_text().strip() == name:
                        # The 19th field; the second may hold spaces, but ends with the last ")".
                        return int((task / "stat").read_text().rsplit(")", 1)[1].split()[16])
                return None
            wait_for(lambda: nice_of("a:50ms") == 4, "the spec's nice value")
            self.assertEqual({name: nice_of(name) for name in ("a:50ms", "dq.user", "dq.builtins",
                                                               "gc")},
                             {"a:50ms": 4, "dq.user": 7, "dq.builtins": 7, "gc": os.nice(0)})

    def test_unknown_executor(self):
        self.assert_unusable(app_file(component("a")), "--executor",
                             arguments=["--executor", "magic"])

    def test_spec_that_cannot_be_applied(self):
        spec = harness.scratch / "too_many_cpus.yaml"
        spec.write_text("callback_groups:\n  - id: /a@Timer(50000000)\n    affinity: [1023]\n")
        head = "spec: too_many_cpus.yaml\n"
        code, said = run_to_its_end(app_file(component("a"), head=head))
        self.assertEqual(code, FAILED, said)
        self.assertIn(f'{spec}:2: "/a@Timer(50000000)"', said)
        code, _, said = run_and_end(app_file(component("a"), head=head + "on_error: warn\n"))
        self.assertEqual(code, ENDED_WELL, said)
        self.assertIn(f'warning: {spec}:2: "/a@Timer(50000000)"', said)


NO_FILE = "it is a FIFO, a device or a socket, and no file"


class WhatMakesWait(unittest.TestCase):
    """A FIFO of which nobody writes in place of a file; what never returns."""

    def setUp(self):
        self.fifo = harness.scratch / f"fifo{self.id()}.yaml"
        os.mkfifo(self.fifo)
        writer = os.open(self.fifo, os.O_RDWR)
        self.addCleanup(os.close, writer)

    def assert_ends(self, running, code=ENDED_WELL):
        self.assertEqual(running.end()[0], code, running.text())

    def test_an_application_file(self):
        self.assertEqual(run_to_its_end(self.fifo)[0], UNUSABLE)
        self.assertEqual(run_to_its_end("/dev/zero")[0], UNUSABLE)

    def test_a_file_of_parameters(self):
        code, said = run_to_its_end(app_file(component("a")), "--params-file", self.fifo)
        self.assertEqual((code, f"{self.fifo}: cannot read it: {NO_FILE}" in said), (UNUSABLE, True), said)

    def test_a_spec(self):
        code, said = run_to_its_end(app_file(component("a"), head=f"spec: {self.fifo.name}\n"))
        self.assertEqual((code, NO_FILE in said), (UNUSABLE, True), said)

    def test_a_shared_object(self):
        library = harness.scratch / f"{self.id()}.so"
        os.mkfifo(library)
        with Running(app_file(component("a"), component("b", library=library))) as running:
            self.assertIn(f"{library}: {NO_FILE}", running.text())
            self.assert_ends(running)

    def test_a_spec_that_has_become_one(self):
        spec = harness.scratch / "changed.yaml"
        spec.write_text("callback_groups: []\n")
        with Running(app_file(component("a"), head="spec: changed.yaml\n")) as running:
            spec.unlink()
            os.mkfifo(spec)
            running.process.send_signal(signal.SIGHUP)
            wait_for(lambda: "the former spec stays in force" in running.text(), "it says that it cannot read it")
            self.assertIn(NO_FILE, running.text())
            self.assert_ends(running)

    def test_a_component_that_never_loads(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            file = app_file(component("a"), component("b", of="NeverLoads"))
            with Running(file, runs=False) as running:
                wait_for(lambda: 'loaded "/a"' in running.text(), "the first one is loaded")  # pylint: disable=cell-var-from-loop
                self.assert_ends_by_force(running, number)

    def test_an_order_that_never_ends(self):
        with Running(app_file(component("a", of="Tunable"))) as running:
            words = [harness.options.programs / "cie-run", "--control", "param", "set", "/a", "rate", "6"]
            with subprocess.Popen(words, stderr=subprocess.PIPE) as ordering:
                time.sleep(0.3)
                self.assert_ends_by_force(running, signal.SIGINT)
                ordering.communicate(timeout=200)

    def assert_ends_by_force(self, running, number):
        self.assertEqual(running.end(number)[0], FAILED, running.text())
        self.assertIn("ended by force", running.text())


if __name__ == "__main__":
    harness.main(__doc__)
