#!/usr/bin/env python3
"""The Perfetto export, read by others: protoc (structure) and Perfetto's trace_processor.

Arguments: structure|trace_processor CIE MAKE_TRACE EXAMPLES. Exit code 77: skipped, with the reason.
"""
import collections
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import trace_processor  # noqa: E402
from example_truth import Truth, output_of  # noqa: E402
from other_host import on_host  # noqa: E402

CHECK, CIE, MAKE_TRACE, EXAMPLES = sys.argv[1:5]

TIMER = "/plan@Timer(20000000)"
TRACK = "/track@Subscription(/points)"
DRIVE = "/drive@Subscription(/points)"
# Of the examples' callbacks.
NAMES = ["drive \u2190 /t1", "drive \u21d0 /srv", "fast client /srv", "fast timer 10 ms", "plan timer 20 ms", "slow timer 20 ms",
         "track \u2190 /t0", "track \u2190 /t0 #2"]


def example(name):
    return os.path.join(EXAMPLES, name, "trace")


def truth_of(name):
    return Truth(os.path.join(EXAMPLES, name))


class Files(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)

    def made(self):
        path = os.path.join(self.folder.name, "made.pftrace")
        return path, json.loads(output_of(MAKE_TRACE, path))

    def exported(self, name, *options):
        path = os.path.join(self.folder.name, name + ".pftrace")
        output_of(CIE, "export", example(name), "--to", "perfetto", "-o", path, *options)
        return path


class Structure(Files):
    """Without Perfetto: the bytes are protobuf, and packets are counted by their field numbers."""

    @staticmethod
    def packets(path):
        with open(path, "rb") as file:
            text = output_of("protoc", "--decode_raw", stdin=file)
        return re.split(r"^1 \{\n", text, flags=re.M)[1:]

    @staticmethod
    def violations(name):
        verdicts = json.loads(subprocess.run([CIE, "verify", example(name), "-f", "json"], stdout=subprocess.PIPE,
                                             timeout=200, check=False).stdout)
        return sum(len(subject["evidence"]) for rule in verdicts["rules"] for subject in rule["subjects"]
                   if subject["verdict"] == "FAIL")

    def test_the_examples(self):
        for name in ("isolated_ok", "multi_threaded_fails"):
            truth = truth_of(name)
            self.assertGreater(truth.flows, 20)
            packets = self.packets(self.exported(name))
            self.assertRegex(packets[0], r"\n  6 \{", "the clock snapshot comes first")
            events = [packet for packet in packets if re.search(r"^  11 \{", packet, re.M)]
            kinds = collections.Counter(re.search(r"^    9: (\d)$", event, re.M).group(1) for event in events)
            drawn = len(truth.instances) + len(truth.waits)
            violations = self.violations(name)
            self.assertEqual(any("Enforcement" in packet for packet in packets), violations > 0)
            responses = sum(row["release_source"] == "exact" and row["end_ns"] != "" for row in truth.instances)
            self.assertEqual({kind: kinds[kind] for kind in "123"},
                             {"1": drawn, "2": drawn, "3": truth.publications + violations})
            self.assertGreater(kinds["4"], 0, "queue depths")
            values = [len(re.findall(rf"^    {field}: ", event, re.M)) for event in events for field in (12, 31)]
            self.assertEqual(sum(values), 2 * responses, "response times: a curve and its value, at ends")
            leaving = sum(len(re.findall(r"^    47: ", event, re.M)) for event in events)
            ending = sum(len(re.findall(r"^    48: ", event, re.M)) for event in events)
            self.assertEqual((leaving, ending), (truth.flows, truth.flows))
            self.assertTrue(any(re.search(r"^  1 \{\n    1: ", packet, re.M) for packet in packets), "kernel events")


class TraceProcessor(Files):
    """With Perfetto's own importer."""

    ALARMS = "select name, value from stats where value != 0 and severity != 'info'"

    def test_a_trace_of_which_everything_is_known(self):
        path, counts = self.made()
        answer = trace_processor.query(path, {
            "alarms": self.ALARMS,
            "slices": "select ts, dur, name, depth from slice where category = 'callback' order by ts, name",
            "waits": "select ts, dur, name from slice where category = 'wait' order by ts",
            "publications": "select ts, depth from slice where category = 'publish' order by ts",
            "flows": "select o.ts, i.ts, i.name from flow f join slice o on f.slice_out = o.id"
                     " join slice i on f.slice_in = i.id order by 1, 2",
            "response": "select ts, extract_arg(arg_set_id, 'debug.response_time_ns') from slice"
                        " where category = 'callback' order by ts",
            "threads": "select tid, t.name, p.pid, p.name from thread t join process p using(upid)"
                       " where tid between 11 and 14 order by tid",
            "sched": "select ts, dur, cpu, tid, end_state from sched join thread using(utid)"
                     " where tid != 0 order by ts",
            "states": "select ts, state, w.tid from thread_state s join thread t using(utid)"
                      " left join thread w on s.waker_utid = w.utid where t.tid = 12 order by ts",
            "counters": "select t.name, th.tid, c.ts, c.value from counter c join counter_track t on c.track_id = t.id"
                        " left join thread_counter_track tt on tt.id = t.id left join thread th on tt.utid = th.utid"
                        " order by t.name, c.ts",
            "units": "select distinct substr(name, 1, 11), unit from counter_track order by 1",
            "violations": "select s.ts, s.name, t.name, extract_arg(arg_set_id, 'debug.rule'),"
                          " extract_arg(arg_set_id, 'debug.subject'), extract_arg(arg_set_id, 'debug.demands'),"
                          " extract_arg(arg_set_id, 'debug.found'), extract_arg(arg_set_id, 'debug.evidence'),"
                          " extract_arg(arg_set_id, 'debug.tid'), extract_arg(arg_set_id, 'debug.suppression')"
                          " from slice s join track t on s.track_id = t.id where category = 'enforcement'"
                          " order by s.ts, 5 desc",
            "wall": "select clock_value from clock_snapshot where clock_name = 'REALTIME'",
        })
        self.assertEqual(answer["alarms"], [])
        self.assertEqual(answer["slices"], [
            [1100, 300, TIMER, 0], [1500, 1100, TRACK, 0], [1600, 1100, DRIVE, 0], [2100, 200, TIMER, 0],
            [2600, 300, TRACK, 0], [3000, 400, DRIVE, 0], [3100, 100, TRACK, 0], [3200, 400, DRIVE, 0],
            [3350, 10, TRACK, 0], [6000, -1, TIMER, 0]])
        self.assertEqual(answer["waits"], [
            [1000, 100, TIMER], [1450, 50, TRACK], [1460, 140, DRIVE], [2000, 100, TIMER], [2150, 450, TRACK],
            [2800, 200, DRIVE], [2900, 300, DRIVE], [3000, 100, TRACK], [3300, 50, TRACK]])
        self.assertEqual(answer["publications"], [[1400, 0], [2100, 1], [5000, 0]])
        self.assertEqual(answer["flows"], [[1400, 1500, TRACK], [1400, 1600, DRIVE], [2100, 2600, TRACK]])
        self.assertEqual([row[1] for row in answer["response"]], [400, 1150, 1240, 300, 750, 600, 200, 700, 60, None])
        self.assertEqual(answer["threads"], [
            [11, "plan thread of more than 15 letters", 4001, "demo"], [12, 'track "quoted" \x1b[31m', 4001, "demo"],
            [13, "drive", 4001, "demo"], [14, "pool", 4001, "demo"]])
        # 0x100 is "preempted", and the flags above it do not hide a state (0x402 is D).
        self.assertEqual(answer["sched"], [[1050, 450, 1, 11, "R+"], [1500, 500, 1, 12, "S"], [2050, 250, 1, 11, "D"]])
        # Woken by thread 11, it waits for the CPU; before that and after 2000 it sleeps.
        self.assertEqual(answer["states"][:2], [[1420, "R", 11], [1500, "Running", None]])
        self.assertEqual(answer["states"][2][:2], [2000, "S"])
        # Response time at each end; messages between arrival and start.
        response = {TIMER: {1400: 400, 2300: 300}, TRACK: {2600: 1150, 2900: 750, 3200: 200, 3360: 60},
                    DRIVE: {2700: 1240, 3400: 600, 3600: 700}}
        queue = {TRACK: {1450: 1, 1500: 0, 2150: 1, 2600: 0, 3000: 1, 3100: 0, 3300: 1, 3350: 0},
                 DRIVE: {1460: 1, 1600: 0}}
        drawn = collections.defaultdict(dict)
        for name, _, time, value in answer["counters"]:
            drawn[name][time] = value
        self.assertEqual(drawn, {**{"response time " + name: values for name, values in response.items()},
                                 **{"queue depth " + name: values for name, values in queue.items()}})
        self.assertEqual(answer["units"], [["queue depth", "count"], ["response ti", "ns"]])
        late = "callback " + TRACK
        known = "callback " + DRIVE
        found = "response time 1150 > 1000 \x1b[31m\ufffd"
        demands = answer["violations"][0][5]
        self.assertIn(demands, " ".join(output_of(CIE, "verify", "--explain", "R3").split()))
        self.assertTrue(demands)
        self.assertEqual(answer["violations"], [
            [900, "R3 deadline", "Enforcement", "R3", late, demands, "no time", "2 of 2", None, None],
            [2600, "R3 deadline", "Enforcement", "R3", late, demands, found, "1 of 2", 12, None],
            [2600, "R3 deadline", "Enforcement", "R3", known, demands, found, "1 of 1", 12,
             "suppressed for ever (accepted.yaml:3): known"]])
        self.assertEqual(counts["callback_slices"], len(answer["slices"]))
        self.assertEqual(counts["response_values"] + counts["queue_changes"], len(answer["counters"]))
        self.assertEqual(counts["violations"], len(answer["violations"]))
        self.assertEqual(counts["waits"], len(answer["waits"]))
        self.assertEqual(counts["flows"], len(answer["flows"]))

    def test_the_examples_agree_with_the_analyzer(self):
        self.check_example("isolated_ok", self.exported("isolated_ok", "--gzip"))
        self.check_example("multi_threaded_fails", self.exported("multi_threaded_fails"))

    def test_hosts_with_the_same_pids_stay_apart(self):
        traces = [str(on_host(example("isolated_ok"), host, os.path.join(self.folder.name, host))) for host in ("left", "right")]
        path = os.path.join(self.folder.name, "hosts.pftrace")
        output_of(CIE, "export", *traces, "--to", "perfetto", "-o", path)
        truth = truth_of("isolated_ok")
        report = json.loads(output_of(CIE, "report", *traces, "--format", "json"))
        self.assertEqual(report["trace"]["hosts"], ["left", "right"])
        answer = trace_processor.query(path, {
            "alarms": self.ALARMS,
            "slices": "select p.machine_id, p.pid, count(*) from slice s join thread_track tt on s.track_id = tt.id"
                      " join thread t using(utid) join process p using(upid) where s.category = 'callback'"
                      " group by 1, 2 order by 1, 2",
            "running": "select t.machine_id, tid, dur from sched join thread t using(utid) where tid != 0",
        })
        self.assertEqual(answer["alarms"], [])
        of_process = collections.Counter(int(row["pid"]) for row in truth.instances)
        machines = sorted({row[0] for row in answer["slices"]}, key=str)
        self.assertEqual(len(machines), 2)
        for machine in machines:
            self.assertEqual({pid: count for of, pid, count in answer["slices"] if of == machine}, of_process)
            self.assertEqual(sorted((tid, dur) for of, tid, dur in answer["running"] if of == machine),
                             sorted((tid, dur) for _, tid, dur in truth.running))

    def test_hosts_are_drawn_on_one_clock(self):
        later = 5_000_000_000
        traces = [str(on_host(example("isolated_ok"), "left", os.path.join(self.folder.name, "now"))),
                  str(on_host(example("isolated_ok"), "right", os.path.join(self.folder.name, "later"), later))]
        path = os.path.join(self.folder.name, "clocks.pftrace")
        output_of(CIE, "export", *traces, "--to", "perfetto", "-o", path)
        answer = trace_processor.query(path, {
            "alarms": self.ALARMS,
            "slices": "select p.machine_id, min(s.ts), max(s.ts) from slice s join thread_track tt on s.track_id = tt.id"
                      " join thread t using(utid) join process p using(upid) where s.category = 'callback' group by 1",
            "running": "select t.machine_id, min(ts), max(ts) from sched join thread t using(utid) where tid != 0 group by 1"})
        self.assertEqual(answer["alarms"], [])
        for rows in (answer["slices"], answer["running"]):
            (_, first, last), (_, first_later, last_later) = sorted(rows, key=lambda row: row[1])
            self.assertEqual((first_later - first, last_later - last), (later, later))

    def check_quantiles(self, figure, values):
        """Nearest rank of what is drawn; the report's own come from a histogram with bins of 1/128."""
        values.sort()
        self.assertEqual(figure["max"], values[-1])
        for key, share in (("p50", 0.5), ("p99", 0.99)):
            exact = values[math.ceil(share * len(values)) - 1]
            self.assertLessEqual(abs(figure[key] - exact), exact / 128)

    def check_example(self, name, path):
        truth = truth_of(name)
        report = json.loads(output_of(CIE, "report", example(name), "--format", "json"))
        answer = trace_processor.query(path, {
            "alarms": self.ALARMS,
            "instances": "select extract_arg(s.arg_set_id, 'debug.logical_id'), p.pid, t.tid, s.ts, s.ts + s.dur from slice s"
                         " join thread_track tt on s.track_id = tt.id join thread t using(utid)"
                         " join process p using(upid) where s.category = 'callback' order by s.ts, t.tid",
            "counts": "select category, count(*) from slice group by category",
            "flows": "select count(*) from flow",
            "nested": "select count(*) from slice s join slice p on s.parent_id = p.id"
                      " where s.category = 'publish' and p.category = 'callback'",
            "response": "select id, count(*), min(r), max(r), sum(r) from (select"
                        " extract_arg(arg_set_id, 'debug.logical_id') as id,"
                        " extract_arg(arg_set_id, 'debug.response_time_ns') as r from slice"
                        " where category = 'callback') group by id",
            "names": "select distinct name, extract_arg(arg_set_id, 'debug.logical_id') from slice"
                     " where category in ('callback', 'wait')",
            "threads": "select p.pid, tid, t.name from thread t join process p using(upid)",
            "running": "select cpu, tid, dur from sched join thread using(utid) where tid != 0",
            "states": "select count(*) from thread_state where state = 'Running' and utid != 0",
            "wakers": "select count(*) from thread_state where waker_utid is not null",
            "values": "select extract_arg(arg_set_id, 'debug.logical_id'),"
                      " extract_arg(arg_set_id, 'debug.response_time_ns') from slice"
                      " where category = 'callback'",
            "curves": "select t.name, count(*), max(c.value) from counter c join counter_track t on c.track_id = t.id"
                      " where t.name glob 'response time *' group by 1",
            "violations": "select extract_arg(arg_set_id, 'debug.rule'), extract_arg(arg_set_id, 'debug.subject'), ts"
                          " from slice where category = 'enforcement'",
        })
        self.assertEqual(answer["alarms"], [])
        self.assertEqual([[str(cell) for cell in row] for row in answer["instances"]],
                         [[row[key] for key in ("logical_id", "pid", "tid", "start_ns", "end_ns")]
                          for row in truth.instances])
        counts = dict(answer["counts"])
        self.assertEqual(counts["wait"], len(truth.waits))
        self.assertEqual(counts["publish"], truth.publications)
        self.assertEqual(answer["flows"], [[truth.flows]])
        self.assertEqual(answer["nested"], [[truth.publications]], "every message is published inside a callback")
        figures = {callback["logical_id"]: callback["response_time_ns"] for callback in report["callbacks"]}
        for logical_id, *values in answer["response"]:
            self.assertEqual(values, [figures[logical_id][part] for part in ("count", "min", "max", "sum")])
            self.check_quantiles(figures[logical_id], [value for name, value in answer["values"] if name == logical_id])
        names = {logical_id: name for name, logical_id in answer["names"]}
        self.assertEqual(sorted(names.values()), NAMES)
        self.assertEqual({name: [count, most] for name, count, most in answer["curves"]},
                         {"response time " + names[logical_id]: [figure["count"], figure["max"]]
                          for logical_id, figure in figures.items()})
        verdicts = json.loads(subprocess.run([CIE, "verify", example(name), "-f", "json"], stdout=subprocess.PIPE,
                                             timeout=200, check=False).stdout)
        self.assertEqual(sorted(map(tuple, answer["violations"])),
                         sorted((rule["id"], subject["subject"], evidence["time_ns"]) for rule in verdicts["rules"]
                                for subject in rule["subjects"] if subject["verdict"] == "FAIL"
                                for evidence in subject["evidence"]))
        self.assertGreater(answer["wakers"][0][0], 20)
        self.assertGreaterEqual(answer["states"][0][0], len(truth.running))
        names = {(pid, tid): name for pid, tid, name in answer["threads"]}
        for thread in report["threads"]:
            self.assertEqual(names[thread["pid"], thread["tid"]], thread["name"])
        self.assertEqual(sorted(map(tuple, answer["running"])), sorted(truth.running))


def main():
    if CHECK == "trace_processor":
        try:
            trace_processor.assets()
        except trace_processor.Unavailable as error:
            print(f"not possible here: {error}")
            return 77
    case = Structure if CHECK == "structure" else TraceProcessor
    result = unittest.TextTestRunner().run(unittest.defaultTestLoader.loadTestsFromTestCase(case))
    return 0 if result.wasSuccessful() and result.testsRun else 1


if __name__ == "__main__":
    sys.exit(main())
