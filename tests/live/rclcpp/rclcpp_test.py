#!/usr/bin/env python3
"""An application of rclcpp under cie_rclcpp::CallbackIsolatedExecutor, recorded as a user does: which callbacks there
are, that each has a thread of its own, that threads run as the spec says, that nothing is lost or invented. Times are
asserted nowhere, but for what is arithmetic: a timer's expiries lie on its grid.

--ros2: the program was built with rclcpp itself, not with the double of it; more is asked of it then.
"""
import argparse
import csv
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from cie import Cie, rules_of  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
SENSOR_20, SENSOR_50 = "/car/sensor@Timer(20000000)", "/car/sensor@Timer(50000000)"
LIDAR, CAMERA = "/car/fusion@Subscription(/car/lidar)", "/car/fusion@Subscription(/car/camera)"
FUSION, PLAN = "/car/fusion@Timer(200000000)", "/car/plan@Timer(100000000)"
FUSED = "/car/plan@Subscription(/car/fused)"
SERVICE, CLIENT = "/car/plan@Service(/car/enable)", "/car/plan@Client(/car/enable)"
ALL = {SENSOR_20, SENSOR_50, LIDAR, CAMERA, FUSION, PLAN, FUSED, SERVICE, CLIENT}
LOOPBACK = ("<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
            "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
            "<Peers><Peer Address='localhost'/></Peers></Discovery></Domain></CycloneDDS>")
# Rules about time, which a busy machine breaks.
TIME_RULES = {"R1", "R2", "R3", "R4", "R5", "R6", "R7", "R8"}


class Recorded:
    """One recording, and what cie says of it."""

    def __init__(self, folder, code, output):
        self.folder, self.code, self.output = folder, code, output
        self.report = cie().json("report", folder)
        self.callbacks = {row["logical_id"]: row for row in self.report["callbacks"]}

    def runs(self, logical_id):
        return self.callbacks[logical_id]["instances"]

    def rules(self, *arguments):
        return rules_of(cie().json("verify", self.folder, *arguments))


def environment():
    return {**os.environ, "PATH": f"{options.programs}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8", "NO_COLOR": "1",
            "ROS_DOMAIN_ID": str(40 + os.getpid() % 60), "CYCLONEDDS_URI": LOOPBACK}


def cie():
    """Without ROS 2's libraries, which may be other versions of ours."""
    ours = {name: value for name, value in environment().items() if name != "LD_LIBRARY_PATH"}
    return Cie(options.programs / "cie", env=ours, timeout=300)


def wait_for_thread(session, name):
    """Until a process of the session has a thread of that name."""
    for _ in range(600):
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                if int(stat.read_text().rpartition(")")[2].split()[3]) != session:
                    continue
                if any(comm.read_text().strip() == name for comm in stat.parent.glob("task/*/comm")):
                    return
            except (OSError, ValueError):
                continue  # it has ended meanwhile
        time.sleep(0.1)
    raise AssertionError(f"no thread {name} within a minute")


class Application(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="cie-rclcpp-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.recordings = 0

    def record(self, *command, variables=(), ros2=False):
        self.recordings += 1
        out = self.folder / f"out{self.recordings}"
        done = subprocess.run(
            ["cie", "record", "-o", out, "--kernel=no", *(["--ros2"] if ros2 else []), "--", *map(str, command)],
            env={**environment(), **dict(variables)}, capture_output=True, text=True, timeout=200, check=False)
        return Recorded(out, done.returncode, done.stdout + done.stderr)

    def car(self, *arguments, seconds="2", **more):
        return self.record(options.car, "--seconds", seconds, *arguments, **more)

    def assert_verdicts(self, recorded, failing=(), arguments=()):
        """Every rule that is not about time holds, but those that are meant to fail."""
        for rule_id, rule in recorded.rules(*arguments).items():
            if rule_id in TIME_RULES or rule["verdict"] == "NOT_APPLICABLE":
                continue
            expected = "FAIL" if rule_id in failing else "PASS"
            self.assertEqual(rule["verdict"], expected, json.dumps(rule, indent=1)[:2000] + recorded.output)

    def assert_on_grid(self, recorded, row):
        """E(k+1) = E(k) + (1 + missed(k+1)) * period, exactly, for every run: the grid never drifts. What was missed
        before the first run lies between no two."""
        period = row["period_ns"]
        runs = [(int(run["seq"]), int(run["release_ns"]), int(run["missed"]))
                for run in csv.DictReader(cie().text("instances", recorded.folder).splitlines())
                if run["logical_id"] == row["logical_id"]]
        self.assertEqual(len(runs), row["instances"])
        self.assertGreater(len(runs), 1)
        for (_, former, _), (seq, release, missed) in itertools.pairwise(sorted(runs)):
            self.assertEqual(release - former, (1 + missed) * period, f"{row['logical_id']}, run {seq}")
        self.assertEqual(sum(missed for _, _, missed in runs), row["missed_releases"])
        self.assertEqual(row["release_source"], "exact")

    def test_each_callback_has_a_thread_that_runs_as_the_spec_says(self):
        spec = self.folder / "car.yaml"
        spec.write_text("callback_groups:\n" + "".join(
            f"  - {{id: \"{logical_id}\", policy: SCHED_OTHER, nice: {1 + i}, affinity: [0]}}\n"
            for i, logical_id in enumerate(sorted(ALL))) + "non_ros_threads:\n  - {id: cie-rclcpp, policy: SCHED_OTHER, nice: 15}\n")
        recorded = self.car(variables={"CIE_SPEC": str(spec)}.items())
        self.assertEqual(recorded.code, 0, recorded.output)
        self.assert_verdicts(recorded, arguments=("--spec", spec))
        self.assertEqual(set(recorded.callbacks), ALL)
        named = {thread["name"]: thread for thread in recorded.report["threads"]}
        self.assertEqual(named["sensor:20ms"]["sched"]["nice"], 1 + sorted(ALL).index(SENSOR_20))
        self.assertEqual(named["cie-rclcpp"]["sched"]["nice"], 15)
        self.assertEqual(named["cie-rclcpp"]["role"], "worker")
        for row in recorded.callbacks.values():
            self.assertEqual(row["isolation"], "isolated", row["logical_id"])
            self.assertEqual(len(row["threads"]), 1)
            self.assertEqual(row["incomplete"], 0)
            if row["kind"] == "timer":
                self.assert_on_grid(recorded, row)
        # Nothing is lost or invented: each message of a timer runs one callback, each call one of either end.
        for source, target in ((SENSOR_20, LIDAR), (SENSOR_50, CAMERA), (FUSION, FUSED), (PLAN, SERVICE), (SERVICE, CLIENT)):
            self.assertLessEqual(recorded.runs(target), recorded.runs(source))
            self.assertGreaterEqual(recorded.runs(target), recorded.runs(source) - 2)
        self.assertGreater(recorded.runs(SENSOR_20), 20)

    def test_a_client_and_a_subscription_in_one_group_share_a_thread(self):
        recorded = self.car("--client-with-subscription")
        self.assert_verdicts(recorded, failing=("M2", "M8"))
        self.assertEqual([row["logical_id"] for row in recorded.callbacks.values() if row["isolation"] != "isolated"],
                         sorted([CLIENT, FUSED], key=list(recorded.callbacks).index))

    def test_messages_within_the_process(self):
        recorded = self.car("--intra-process")
        self.assert_verdicts(recorded)
        for source, target in ((SENSOR_20, LIDAR), (SENSOR_50, CAMERA)):
            self.assertLessEqual(recorded.runs(target), recorded.runs(source))
            self.assertGreaterEqual(recorded.runs(target), recorded.runs(source) - 2)

    def test_timers_of_equal_period_are_told_apart_at_each_start(self):
        ids = [SENSOR_50, SENSOR_50 + "#2", SENSOR_50 + "#3"]
        spec = self.folder / "equal.yaml"
        spec.write_text("callback_groups:\n" + "".join(
            f"  - {{id: \"{logical_id}\", policy: SCHED_OTHER, nice: {5 + i}}}\n" for i, logical_id in enumerate(ids)))
        for _ in range(10 if options.ros2 else 3):
            recorded = self.car("--equal-timers", seconds="1", variables={"CIE_SPEC": str(spec)}.items())
            self.assert_verdicts(recorded, arguments=("--spec", spec))
            self.assertLessEqual(set(ids), set(recorded.callbacks))
            for i, logical_id in enumerate(ids):
                row = recorded.callbacks[logical_id]
                index = row["threads"][0]["thread"]
                thread = next(each for each in recorded.report["threads"] if each["index"] == index)
                self.assertEqual(thread["sched"]["nice"], 5 + i, logical_id)

    def test_a_node_that_comes_and_goes_while_spinning(self):
        recorded = self.car("--late", seconds="3")
        self.assert_verdicts(recorded)
        late = recorded.callbacks["/car/late@Subscription(/car/lidar)"]
        self.assertGreater(late["instances"], 10)
        self.assertLess(late["instances"], recorded.runs(SENSOR_20))

    def test_a_timer_that_is_cancelled_and_reset_goes_on(self):
        recorded = self.car("--cancel-timer", seconds="3")
        self.assert_verdicts(recorded)
        self.assertGreater(recorded.runs(PLAN), 6)  # three before the cancellation
        self.assertLess(recorded.runs(PLAN), 28)    # of 30

    def test_what_a_callback_throws_ends_spinning(self):
        recorded = self.car("--throw")
        self.assertIn(f'callback "{FUSION}" threw: no more fuel', recorded.output)
        self.assertEqual((recorded.runs(FUSION), recorded.callbacks[FUSION]["exceptions"]), (3, 1))
        self.assert_verdicts(recorded)

    def test_sigint_ends_it_cleanly(self):
        out = self.folder / "out"
        with subprocess.Popen(["cie", "record", "-o", out, "--kernel=no", "--", options.car], env=environment(),
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True) as process:
            wait_for_thread(process.pid, "plan:100ms")  # of the last node
            time.sleep(1)
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does at Ctrl-C
            output, _ = process.communicate(timeout=60)
            recorded = Recorded(out, process.returncode, output)
        self.assertEqual(recorded.code, 0, output)
        self.assert_verdicts(recorded)
        self.assertEqual(set(recorded.callbacks), ALL)

    def test_a_spec_that_cannot_be_used_is_refused_before_anything_runs(self):
        spec = self.folder / "wrong.yaml"
        spec.write_text("callback_groups:\n  - {id: /car/sensor, policy: SCHED_FASTEST}\n")
        done = subprocess.run([options.car, "--seconds", "1", "--ros-args", "-p", f"cie_spec:={spec}"], env=environment(),
                              capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn(f"{spec}:2", done.stderr)

    def test_components_are_loaded_and_unloaded_while_running(self):
        if not options.ros2:
            return  # the container is rclcpp_components'
        self.assertIsNotNone(options.container, "rclcpp_components is missing")
        prefixes = f"{options.prefix}:{os.environ['AMENT_PREFIX_PATH']}"
        variables = {**environment(), "AMENT_PREFIX_PATH": prefixes}
        out = self.folder / "out"
        with subprocess.Popen(["cie", "record", "-o", out, "--kernel=no", "--", options.container], env=variables,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True) as process:
            loader = subprocess.run([options.loader], env=variables, capture_output=True, text=True, timeout=100, check=False)
            os.killpg(process.pid, signal.SIGINT)
            output, _ = process.communicate(timeout=60)
        self.assertEqual((loader.returncode, loader.stdout), (0, "loaded 2, unloaded 1\n"), loader.stderr + output)
        recorded = Recorded(out, process.returncode, output)
        self.assertEqual(recorded.code, 0, output)
        self.assert_verdicts(recorded)
        expected = {f"/{node}@{what}" for node in ("first", "second")
                    for what in ("Timer(20000000)", "Subscription(/echoed)")}
        self.assertEqual(set(recorded.callbacks), expected)
        self.assertGreater(recorded.runs("/second@Timer(20000000)"), recorded.runs("/first@Timer(20000000)"))

    def test_actions_and_events_of_qos_are_callbacks(self):
        if not options.ros2:
            return
        self.assertIsNotNone(options.actions, "rclcpp_action or example_interfaces is missing")
        recorded = self.record(options.actions)
        self.assertEqual(recorded.code, 0, recorded.output)
        self.assertIn("results 5, missed some\n", recorded.output)
        waitables = {row["logical_id"]: row for row in recorded.callbacks.values() if row["kind"] == "waitable"}
        # Of five goals the server gets a request each and is asked for each result; the client gets the answers.
        self.assertGreaterEqual(waitables["/actions@Waitable(rclcpp_action::Server)"]["instances"], 10)
        self.assertGreaterEqual(waitables["/actions@Waitable(rclcpp_action::Client)"]["instances"], 10)
        event = next(row for name, row in waitables.items() if "EventHandler" in name)
        self.assertGreaterEqual(event["instances"], 1)
        # The event is in its subscription's group, as rclcpp has it, and so shares its thread if both run.
        self.assert_verdicts(recorded, failing=("M2", "M8"))

    def test_with_the_events_of_ros2_there_are_publications_and_chains(self):
        if not options.ros2:
            return  # the double has no tracetools
        recorded = self.car(ros2=True)
        self.assertEqual(recorded.code, 0, recorded.output)
        self.assertEqual(set(recorded.callbacks), ALL)
        self.assert_verdicts(recorded)
        edges = {(edge["from"], edge["to"]) for edge in recorded.report["edges"] if "from" in edge}
        self.assertTrue(recorded.report["chains"], sorted(edges))
        for source, target in ((SENSOR_20, LIDAR), (SENSOR_50, CAMERA)):  # each told once
            self.assertLessEqual(recorded.runs(target), recorded.runs(source))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--car", type=Path, required=True)
    parser.add_argument("--ros2", action="store_true")
    parser.add_argument("--container", type=Path)
    parser.add_argument("--loader", type=Path)
    parser.add_argument("--prefix", type=Path)
    parser.add_argument("--actions", type=Path)
    options, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
