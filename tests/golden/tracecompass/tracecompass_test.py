#!/usr/bin/env python3
"""cie.xml for Trace Compass, run over the contract's examples. Arguments: CIE_XML EXAMPLES."""
import collections
import csv
import os
import re
import subprocess
import sys
import unittest
import xml.etree.ElementTree

import data_driven

CIE_XML, EXAMPLES = sys.argv[1:3]
NAMES = ("isolated_ok", "multi_threaded_fails")
RUNNING = 1


class Event:
    """One line of babeltrace2, with fields as Trace Compass names them; times are the clock's own, as those of instances."""

    PATTERN = re.compile(r"^\[(\d+)\] \S+ (\S+): \{.*?\}, \{(.*?)\}, \{(.*)\}$")
    FIELD = re.compile(r'(\w+) = (?:\( "[^"]*" : container = )?("(?:[^"\\]|\\.)*"|-?\d+)')

    def __init__(self, line):
        time, self.name, context, fields = self.PATTERN.match(line).groups()
        self.time = int(time)
        self.fields = {f"context._{key}": self.number(value) for key, value in self.FIELD.findall(context)}
        self.fields.update((key, self.number(value)) for key, value in self.FIELD.findall(fields))

    @staticmethod
    def number(text):
        return text[1:-1] if text.startswith('"') else int(text)

    def field(self, name):
        return self.fields[name]  # a KeyError: the event has no such field


def events_of(name):
    text = subprocess.run(["babeltrace2", "--clock-cycles", "--no-delta", os.path.join(EXAMPLES, name, "trace", "ust")],
                          stdout=subprocess.PIPE, check=True, timeout=200).stdout.decode()
    return [Event(line) for line in text.splitlines()]


def instances_of(name):
    with open(os.path.join(EXAMPLES, name, "instances.csv"), encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class TraceCompass(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = xml.etree.ElementTree.parse(CIE_XML).getroot()

    def run_over(self, name):
        provider = data_driven.StateProvider(self.root.find("stateProvider"))
        pattern = data_driven.Pattern(self.root.find("pattern"))
        for event in events_of(name):
            provider.handle(event)
            pattern.handle(event)
        spans = [(row["logical_id"], int(row["pid"]), int(row["tid"]), int(row["seq"]), int(row["start_ns"]),
                  int(row["end_ns"])) for row in instances_of(name)]
        return provider, pattern, spans

    def test_every_reference_has_a_target(self):
        for element in self.root:
            ids = {tag: [one.get("id") for one in element.iter(tag)] for tag in ("location", "test", "action", "state", "final", "fsm")}
            for tag, names in ids.items():
                self.assertEqual(len(names), len(set(names)), tag)
            for attribute in element.iter("stateAttribute"):
                if attribute.get("type") == "location":
                    self.assertIn(attribute.get("value"), ids["location"])
            for transition in element.iter("transition"):
                self.assertIn(transition.get("target"), ids["state"] + ids["final"])
                if transition.get("cond"):
                    self.assertIn(transition.get("cond"), ids["test"])
                self.assertLessEqual(set((transition.get("action") or "").split(":")), {"", *ids["action"]})
        analyses = {element.get("id") for element in self.root if element.tag in ("stateProvider", "pattern")}
        for analysis in self.root.iter("analysis"):
            self.assertIn(analysis.get("id"), analyses)

    def test_callbacks_run_when_the_instances_say(self):
        for name in NAMES:
            provider, _, spans = self.run_over(name)
            states = provider.states
            names = {path[:3]: value for path, value in states.now.items() if path[0] == "Callbacks" and path[-1] == "Name"}
            shown = collections.defaultdict(list)
            for path, intervals in states.intervals.items():
                if path[0] == "Callbacks" and path[-1] == "Status":
                    shown[names[path[:3]], int(path[1])] += [(begin, end) for begin, end, value in intervals
                                                             if value == RUNNING]
            expected = collections.defaultdict(list)
            for logical_id, pid, _, _, start, end in spans:
                expected[logical_id, pid].append((start, end))
            self.assertEqual(shown, expected)

    def test_callbacks_wait_from_the_first_release_to_the_start(self):
        provider, _, spans = self.run_over(NAMES[0])
        waits = [(path, begin, end) for path, intervals in provider.states.intervals.items() if path[-1] == "Status"
                 for begin, end, value in intervals if value != RUNNING]
        starts = {start for *_, start, _ in spans}
        self.assertGreater(len(waits), 10)
        for path, begin, end in waits:
            self.assertLess(begin, end)
            self.assertIn(end, starts, path)

    def test_threads_run_what_the_instances_say(self):
        for name in NAMES:
            provider, _, spans = self.run_over(name)
            shown = {(int(path[1]), int(path[2])): [(value, begin, end) for begin, end, value in intervals]
                     for path, intervals in provider.states.intervals.items()
                     if path[0] == "Threads" and path[-1] == "Callback"}
            expected = collections.defaultdict(list)
            for logical_id, pid, tid, _, start, end in spans:
                expected[pid, tid].append((logical_id, start, end))
            self.assertEqual(shown, expected)
            self.assertTrue(all(provider.states.now[("Threads", str(pid), str(tid), "Name")] for pid, tid in shown))

    def test_a_segment_for_every_instance(self):
        for name in NAMES:
            _, pattern, spans = self.run_over(name)
            self.assertEqual(sorted((callback, *(fields[key] for key in ("pid", "tid", "seq")), begin, end)
                                    for begin, end, callback, fields in pattern.segments), sorted(spans))

    def test_views_show_attributes_that_there_are(self):
        provider, _, _ = self.run_over(NAMES[0])
        paths = {path for path in provider.states.now}
        for view in self.root.findall("timeGraphView"):
            top = view.find("entry")
            self.assertTrue(top.get("path").endswith("/*"))
            for shown in ("display", "name"):
                leaf = top.find(f"entry/{shown}").get("value")
                self.assertTrue(any(path[0] == top.get("path")[:-2] and len(path) == 4 and path[3] == leaf for path in paths),
                                leaf)
            values = {int(value.get("value")) for value in view.findall("definedValue")}
            if values:
                named = {int(value.get("value")) for value in self.root.findall("stateProvider/definedValue")}
                self.assertEqual(values, named)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
