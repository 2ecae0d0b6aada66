#!/usr/bin/env python3
"""The Autoware reference system has the published graph, runs under every executor, and counts right."""

import argparse
import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position

programs: Path
EXECUTORS = ["isolated", "single", "multi", "events", "isolated-waitset", "single-waitset",
             "multi-waitset"]

# The published benchmark's graph: which node publishes how often, and who listens to whom.
TIMERS_MS = {"FrontLidarDriver": 100, "RearLidarDriver": 100, "PointCloudMap": 120,
             "Visualizer": 60, "Lanelet2Map": 100, "EuclideanClusterSettings": 25,
             "BehaviorPlanner": 100}
LISTENS_TO = {
    "PointsTransformerFront": ["FrontLidarDriver"],
    "PointsTransformerRear": ["RearLidarDriver"],
    "VoxelGridDownsampler": ["PointCloudFusion"],
    "PointCloudMapLoader": ["PointCloudMap"],
    "RayGroundFilter": ["PointCloudFusion"],
    "ObjectCollisionEstimator": ["EuclideanClusterDetector"],
    "MPCController": ["BehaviorPlanner"],
    "ParkingPlanner": ["Lanelet2MapLoader"],
    "LanePlanner": ["Lanelet2MapLoader"],
    "PointCloudFusion": ["PointsTransformerFront", "PointsTransformerRear"],
    "NDTLocalizer": ["VoxelGridDownsampler", "PointCloudMapLoader"],
    "VehicleInterface": ["MPCController", "BehaviorPlanner"],
    "Lanelet2GlobalPlanner": ["Visualizer", "NDTLocalizer"],
    "Lanelet2MapLoader": ["Lanelet2Map", "Lanelet2GlobalPlanner"],
    "BehaviorPlanner": ["ObjectCollisionEstimator", "NDTLocalizer", "Lanelet2GlobalPlanner",
                        "Lanelet2MapLoader", "ParkingPlanner", "LanePlanner"],
    "EuclideanClusterDetector": ["RayGroundFilter", "EuclideanClusterSettings"],
    "VehicleDBWSystem": ["VehicleInterface"],
    "IntersectionOutput": ["EuclideanIntersection"],
}


def run(*command):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=200,
                          check=False)


def reference(executor, *arguments, seconds=2):
    return [programs / "cie-autoware-reference", "--executor", executor, "--duration", str(seconds),
            "--load", "0.02", *arguments]


class UnderEveryExecutor(unittest.TestCase):
    def test_it_runs_and_its_counts_agree(self):
        for executor in EXECUTORS:
            with self.subTest(executor):
                def counts(done):
                    self.assertEqual((done.returncode, done.stderr), (0, ""))
                    found = re.search(r"front lidar samples (\d+), object collision estimates (\d+)", done.stdout)
                    return [int(n) for n in found.groups()]
                done = isolated_main.with_time_enough(
                    lambda seconds: run(*reference(executor, seconds=seconds)),  # pylint: disable=cell-var-from-loop
                    lambda done: counts(done)[0] >= 5 and counts(done)[1] > 0, (1, 5, 25))
                samples, estimates = counts(done)
                self.assertGreaterEqual(samples, 5)  # of ten per second
                self.assertGreater(estimates, 0)
                self.assertLessEqual(estimates, samples)
                hot_path = re.search(r"hot path.*\n.*\((\d+)\)", done.stdout)
                self.assertEqual(int(hot_path.group(1)), estimates)
                dropped = re.search(r"dropped samples in transform nodes: (\d+)\n((?:  .*\n)*)",
                                    done.stdout)
                by_node = [int(n) for n in re.findall(r": (\d+) of \d+", dropped.group(2))]
                self.assertEqual(sum(by_node), int(dropped.group(1)))


class TheGraph(unittest.TestCase):
    def test_is_the_published_one_and_every_callback_is_isolated(self):
        expected = {f"/{node}@Timer({ms}000000)" for node, ms in TIMERS_MS.items()} | {
            f"/{node}@Subscription(/{source})"
            for node, sources in LISTENS_TO.items() for source in sources}
        with tempfile.TemporaryDirectory() as scratch:
            def record(seconds):
                trace = Path(scratch) / f"trace-{seconds}"
                done = run(programs / "cie", "record", "-o", trace, "--", *reference("isolated", seconds=seconds))
                self.assertEqual(done.returncode, 0, done.stderr)
                done = run(programs / "cie", "report", trace, "--format", "json")
                return trace, json.loads(done.stdout) if done.returncode == 0 else {"callbacks": []}
            trace, report = isolated_main.with_time_enough(
                record, lambda recorded: sum(c["instances"] > 0 for c in recorded[1]["callbacks"]) == len(expected), (2, 10, 50))
            verdicts = json.loads(run(programs / "cie", "verify", trace, "--format", "json").stdout)
        self.assertEqual({c["logical_id"] for c in report["callbacks"]}, expected)
        self.assertTrue(all(c["isolated"] for c in report["callbacks"]))
        self.assertTrue(all(c["instances"] > 0 for c in report["callbacks"]))
        broken = {r["id"] for r in verdicts["rules"] if r["verdict"] == "FAIL"}
        # A busy machine may miss releases; and where messages are replaced, that is what the
        # original's queues of one are for.
        self.assertLessEqual(broken, {"R1", "R2", "Q1"})


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    arguments, rest = parser.parse_known_args()
    programs = arguments.programs
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
