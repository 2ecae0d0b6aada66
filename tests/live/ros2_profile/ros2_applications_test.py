#!/usr/bin/env python3
"""`cie record --ros2` and `cie live --ros2`: applications of ROS 2, which emit no event of `cie`."""
import json
import os
import subprocess
import sys
import unittest
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of  # noqa: E402  pylint: disable=wrong-import-position

PROGRAMS, ROS2_APP, CIE_APP = (Path(argument).resolve() for argument in sys.argv[1:4])
cie = Cie(PROGRAMS / "cie")
scratch: Path


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, timeout=200,
                          **options)


def record(name, *arguments):
    done = cie.run("record", "--kernel", "no", "-o", scratch / name, *arguments)
    assert done.returncode == 0, done
    return manifest_of(scratch / name), done.stderr


def callbacks(name):
    return {row["logical_id"]: row["instances"] for row in cie.json("report", scratch / name)["callbacks"]}


def live_callbacks(lines):
    """Of the last snapshot of several."""
    return {row["logical_id"]: row["total"]["instances"] for row in json.loads(lines.splitlines()[-1])["callbacks"]}


def verdict(name, rule):
    return cie.verdicts(scratch / name)[rule]


class Ros2(unittest.TestCase):
    def test_a_command_is_recorded_with_its_processes_and_no_warning(self):
        # A launcher that is no application of ROS 2 itself starts two of them.
        manifest, said = record("launched", "--ros2", "--", "sh", "-c", f"'{ROS2_APP}' & '{ROS2_APP}'; wait")
        self.assertNotIn("registered", said)
        self.assertEqual([process["name"] for process in manifest["processes"]], ["live_ros2_app"] * 2)
        self.assertEqual(manifest["session"]["events"], ["cie:*", "ros2:*", "ros2_caret:*", "agnocast:*"])
        self.assertEqual(callbacks("launched"), {"/robot/leg@Timer(20000000)": 5})
        self.assertEqual(verdict("launched", "T2"), "PASS")

    # Each is process 1 of its namespace.
    def test_processes_of_several_pid_namespaces_are_told_apart(self):
        if run("unshare", "--pid", "--fork", "true").returncode != 0:
            self.skipTest("not possible here: a pid namespace of its own needs CAP_SYS_ADMIN")
        apart = f"unshare --pid --fork '{ROS2_APP}'"
        record("namespaces", "--ros2", "--", "sh", "-c", f"{apart} & {apart}; wait")
        events = [json.loads(line) for line in
                  cie.run("events", scratch / "namespaces", "--name", "ros2:callback_start", "-f", "json").stdout.splitlines()]
        self.assertEqual({event["pid"] for event in events}, {1})
        self.assertEqual(len({event["context"]["pid_ns"] for event in events}), 2)
        report = cie.json("report", scratch / "namespaces")
        self.assertEqual([(row["logical_id"], row["instances"]) for row in report["callbacks"]],
                         [("/robot/leg@Timer(20000000)", 5)] * 2)
        self.assertNotIn("shared-pid", [defect["kind"] for defect in report["defects"]])

    def test_applications_of_both_kinds_are_told_once(self):
        manifest, _ = record("both", "--ros2", "--", "sh", "-c", f"'{ROS2_APP}'; '{CIE_APP}'")
        # Of a program that has ended its thread's name is known.
        self.assertEqual(sorted(process["name"][:15] for process in manifest["processes"]),
                         ["live_profile_ap", "live_ros2_app"])
        self.assertEqual(callbacks("both")["/robot/leg@Timer(20000000)"], 5)

    def test_without_it_the_warning_names_it(self):
        _, said = run_without()
        self.assertIn("--ros2", said)

    def test_attached_the_duration_begins_with_the_first_application(self):
        isolated_main.session_daemon(self)
        ready = scratch / "ready"
        with subprocess.Popen([ROS2_APP, ready], env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"}) as app:
            self.addCleanup(app.kill)
            isolated_main.wait_for(ready.exists, "the application")
            recorder = subprocess.Popen(
                [PROGRAMS / "cie", "record", "--kernel", "no", "--ros2", "--attach", "--duration", "8",
                 "-o", scratch / "attached"], stderr=subprocess.PIPE, text=True)
            self.addCleanup(recorder.kill)
            app.wait(timeout=200)
            said = recorder.communicate(timeout=200)[1]
        self.assertEqual(recorder.returncode, 0, said)
        manifest = manifest_of(scratch / "attached")
        self.assertEqual([(process["pid"], process["name"]) for process in manifest["processes"]],
                         [(app.pid, "live_ros2_app")])
        self.assertGreaterEqual(manifest["end"]["monotonic_ns"] - manifest["begin"]["monotonic_ns"], 8_000_000_000)
        self.assertEqual(callbacks("attached"), {"/robot/leg@Timer(20000000)": 5})

    # As `ros2 trace --dual-session` does: a flight recorder of what is made, and later a session of what runs.
    def test_runs_may_be_recorded_by_a_session_of_their_own(self):
        isolated_main.session_daemon(self)
        made = ["rcl_init", "rcl_node_init", "rcl_timer_init", "rclcpp_timer_callback_added", "rclcpp_callback_register",
                "rclcpp_timer_link_node"]
        folder = scratch / "dual"
        self.session("objects", ",".join("ros2:" + name for name in made), "--snapshot", f"--output={folder}/snapshot")
        ready = scratch / "made"
        with subprocess.Popen([ROS2_APP, ready, "later"], env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"}) as app:
            self.addCleanup(app.kill)
            isolated_main.wait_for(ready.exists, "the objects")
            self.lttng("snapshot", "record", "-s", "objects")
            self.session("runs", "ros2:*", f"--output={folder}/runtime")
            app.wait(timeout=200)
        self.lttng("destroy", "runs")
        self.lttng("destroy", "objects")
        self.assertEqual(callbacks("dual"), {"/robot/leg@Timer(20000000)": 5})
        report = cie.json("report", folder)
        gap = next(defect for defect in report["defects"] if defect["kind"] == "host-gap")
        self.assertIn("what its applications made, and nothing in between", gap["advice"])
        self.assertEqual(verdict("dual", "M3"), "INCONCLUSIVE", "a client may have been made in between")

    def test_what_two_sessions_recorded_at_once_counts_once(self):
        isolated_main.session_daemon(self)
        names = ("one", "two")
        for name in names:
            self.session(name, "ros2:*", f"--output={scratch}/at_once/{name}")
        done = run(ROS2_APP, env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"})
        self.assertEqual(done.returncode, 0, done)
        for name in names:
            self.lttng("destroy", name)
        for recording in ("at_once/one", "at_once/two", "at_once"):
            self.assertEqual(callbacks(recording), {"/robot/leg@Timer(20000000)": 5}, recording)
            self.assertEqual([verdict(recording, rule) for rule in ("M3", "E2", "E3", "T2")], ["PASS"] * 4, recording)

    def lttng(self, *arguments):
        done = run("lttng", *arguments)
        self.assertEqual(done.returncode, 0, done)

    def session(self, name, events, *options):
        self.lttng("create", name, *options)
        self.lttng("enable-channel", "-s", name, "-u", "ros2")
        self.lttng("add-context", "-s", name, "-c", "ros2", "-u", "-t", "vpid", "-t", "vtid", "-t", "procname")
        self.lttng("enable-event", "-s", name, "-c", "ros2", "-u", events)
        self.lttng("start", name)

    def test_live_shows_a_command(self):
        done = cie.run("live", "--ros2", "--json", "--interval", "0.2", "--", ROS2_APP)
        self.assertEqual(done.returncode, 0, done)
        self.assertEqual(live_callbacks(done.stdout), {"/robot/leg@Timer(20000000)": 5})

    def test_live_attaches(self):
        isolated_main.session_daemon(self)
        ready = scratch / "ready-live"
        with subprocess.Popen([ROS2_APP, ready], env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"}) as app:
            self.addCleanup(app.kill)
            isolated_main.wait_for(ready.exists, "the application")
            # It runs when it is watched; the snapshots after its last run show all of them.
            live = subprocess.Popen([PROGRAMS / "cie", "live", "--ros2", "--json", "--interval", "0.2"],
                                    stdout=subprocess.PIPE, text=True)
            self.addCleanup(live.kill)
            for line in live.stdout:
                if live_callbacks(line) == {"/robot/leg@Timer(20000000)": 5}:
                    break
            else:
                self.fail("cie live ended before it saw the five runs")
            live.terminate()
            live.communicate(timeout=200)
            app.wait(timeout=200)

    def test_live_goes_without_a_session(self):
        done = cie.run("live", "--ros2", "net://localhost")
        self.assertEqual((done.returncode, "--ros2" in done.stderr), (2, True), done)

    def test_goes_without_the_profile(self):
        done = cie.run("record", "--ros2", "--profile", "ros2", "--", "true")
        self.assertEqual(done.returncode, 2, done)


def run_without():
    done = cie.run("record", "--kernel", "no", "-o", scratch / "without", "--registration-timeout", "0.2", "--",
               "sh", "-c", f"'{ROS2_APP}'; sleep 1")
    return done.returncode, done.stderr


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("ros2-applications", sys.argv[4:], begin)
