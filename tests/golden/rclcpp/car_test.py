#!/usr/bin/env python3
"""The double of rclcpp held against rclcpp: car.json says what the car of executor/rclcpp/examples was seen to be
under Humble (rclcpp 16.0.11, rmw_cyclonedds), and it is the same on the double. How often each callback runs is
arithmetic, and holds for both.

To record it anew, in an environment of ROS 2: car_test.py --programs BIN --car CAR_OF_ROS2 --update
"""
import argparse
import collections
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

options: argparse.Namespace
GOLDEN = Path(__file__).with_name("car.json")
CARS = {
    "plain": ["--seconds", "1"],
    "through the process": ["--seconds", "1", "--intra-process"],
    "one group of two": ["--seconds", "1", "--equal-timers", "--client-with-subscription"],
    "late": ["--seconds", "2", "--late"],
}
# Whose every run sends one message, and who gets it.
LINKS = [("/car/sensor@Timer(20000000)", "/car/fusion@Subscription(/car/lidar)"),
         ("/car/sensor@Timer(50000000)", "/car/fusion@Subscription(/car/camera)"),
         ("/car/fusion@Timer(200000000)", "/car/plan@Subscription(/car/fused)"),
         ("/car/plan@Timer(100000000)", "/car/plan@Service(/car/enable)"),
         ("/car/plan@Service(/car/enable)", "/car/plan@Client(/car/enable)")]
NONE = 0xFFFFFFFF


def ours():
    """cie itself runs without ROS 2's libraries."""
    return {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}


def record(arguments, folder):
    done = subprocess.run([options.programs / "cie", "record", "-o", folder, "--kernel=no", "--", options.car, *arguments],
                          env={**os.environ, "PATH": f"{options.programs}:{os.environ['PATH']}"},
                          capture_output=True, text=True, timeout=100, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stdout + done.stderr)
    printed = subprocess.run([options.programs / "cie", "events", folder, "-f", "json", "--name", "cie:*"],
                             env=ours(), capture_output=True, text=True, timeout=100, check=True).stdout
    events = collections.defaultdict(list)
    for line in printed.splitlines():
        event = json.loads(line)
        events[event["name"].removeprefix("cie:")].append({"time_ns": event["time_ns"], **event["fields"]})
    return events


def described(events):
    """What does not differ from run to run."""
    groups = {group["group_id"]: group["type"] for group in events["group_init"]}
    sizes = collections.Counter(callback["group_id"] for callback in events["callback_init"])
    ids = {callback["callback_id"]: callback["logical_id"] for callback in events["callback_init"]}
    begun_with = os.nice(0)
    nice = {thread["tid"]: 0 if thread["nice"] == begun_with else thread["nice"]
            for thread in events["thread_sched"] if thread["moment"] == "applied"}
    return {
        "executor": events["run_begin"][0]["executor"],
        "nodes": [node["name"] for node in events["node_init"]],
        "callbacks": [{
            "logical_id": callback["logical_id"],
            "kind": callback["kind"],
            "source": callback["source"],
            "period_ns": callback["period_ns"],
            "queue_depth": callback["queue_depth"],
            "group": groups[callback["group_id"]],
            "alone_in_group": sizes[callback["group_id"]] == 1,
            **told([start for start in events["callback_start"] if start["callback_id"] == callback["callback_id"]],
                   callback["queue_depth"]),
        } for callback in events["callback_init"]],
        "threads": sorted([{
            "role": thread["role"],
            "name": thread["name"],
            "callback": None if thread["callback_id"] == NONE else ids[thread["callback_id"]],
            "nice": nice[thread["tid"]],
        } for thread in events["thread_init"]], key=lambda thread: (thread["role"], thread["name"], str(thread["callback"]))),
    }


def told(starts, depth):
    """Which facts instances carry. What came before the executor listened, a queue at most, has no release."""
    while starts and depth > 0 and starts[0]["release_ns"] < 0:
        starts, depth = starts[1:], depth - 1
    def which(has):
        found = {has(start) for start in starts}
        return found.pop() if len(found) == 1 else "some"
    return {
        "release": which(lambda start: start["release_kind"] if start["release_ns"] > 0 else "unknown"),
        "has_source_timestamp": which(lambda start: start["source_timestamp_realtime_ns"] > 0),
        "has_writer": which(lambda start: start["writer_gid"] > 0),
    }


class Car(unittest.TestCase):
    maxDiff = None

    def test_is_the_same_on_the_double(self):
        golden = json.loads(GOLDEN.read_text())
        for name, arguments in CARS.items():
            with self.subTest(name), tempfile.TemporaryDirectory(prefix="cie-golden-") as folder:
                events = record(arguments, Path(folder, "out"))
                self.assertEqual(described(events), golden[name])
                self.assert_arithmetic(events)

    def assert_arithmetic(self, events):
        starts = collections.defaultdict(list)
        for start in events["callback_start"]:
            starts[start["callback_id"]].append(start)
        end = max(start["time_ns"] for start in events["callback_start"])
        begin = events["run_begin"][0]["time_ns"]  # the timers were created later
        of = {}
        for callback in events["callback_init"]:
            runs, period = starts[callback["callback_id"]], callback["period_ns"]
            of[callback["logical_id"]] = len(runs)
            if period == 0:
                continue
            # Each expiry from the first run to the last was run or missed, however busy the machine was.
            self.assertGreaterEqual(len(runs), 2)
            expiries = sum(1 + run["missed"] for run in runs[1:])
            self.assertEqual(expiries * period, runs[-1]["release_ns"] - runs[0]["release_ns"])
            self.assertLessEqual(1 + runs[0]["missed"] + expiries, (end - begin) // period)
        for sender, receiver in LINKS:
            self.assertLessEqual(of[receiver], of[sender])
            self.assertGreaterEqual(of[receiver] + 2, of[sender], (sender, receiver))


def update():
    golden = {}
    for name, arguments in CARS.items():
        with tempfile.TemporaryDirectory(prefix="cie-golden-") as folder:
            golden[name] = described(record(arguments, Path(folder, "out")))
    # A line for each callback and thread.
    text = json.dumps(golden, indent=1)
    for block in (part for car in golden.values() for key in ("callbacks", "threads") for part in car[key]):
        text = text.replace(json.dumps(block, indent=1).replace("\n", "\n   "), json.dumps(block))
    GOLDEN.write_text(text + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--car", type=Path, required=True)
    parser.add_argument("--update", action="store_true", help="write what the car is into car.json")
    options = parser.parse_args()
    if options.update:
        update()
    else:
        unittest.main(argv=sys.argv[:1], verbosity=2)
