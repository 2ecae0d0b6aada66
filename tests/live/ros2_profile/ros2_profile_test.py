#!/usr/bin/env python3
"""The profile `ros2`, read by babeltrace2's Python bindings as ROS 2's own tools read it: events and layouts
are tracetools 8.2's, handles lead where they should, and counts are those of this project's own events.
Arguments: PROGRAMS APP APP_OF_ROS2 (an application that has a provider `ros2` of its own)."""

import collections
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position

try:
    import bt2
except ImportError:  # Debian's, for an interpreter from elsewhere
    sys.path.append("/usr/lib/python3/dist-packages")
    import bt2

PROGRAMS, APP, APP_OF_ROS2 = (Path(argument).resolve() for argument in sys.argv[1:4])
scratch: Path

HANDLE, SIZE, TEXT, GID, INT32, INT64 = "u64 hex", "u64", "text", "24 u8", "i32", "i64"
# Fields in order, as `lttng list --ust --fields` shows them for ROS 2 Jazzy.
LAYOUTS = {
    "rcl_init": {"context_handle": HANDLE, "version": TEXT},
    "rcl_node_init": {"node_handle": HANDLE, "rmw_handle": HANDLE, "node_name": TEXT, "namespace": TEXT},
    "rmw_publisher_init": {"rmw_publisher_handle": HANDLE, "gid": GID},
    "rcl_publisher_init": {"publisher_handle": HANDLE, "node_handle": HANDLE, "rmw_publisher_handle": HANDLE,
                           "topic_name": TEXT, "queue_depth": SIZE},
    "rclcpp_publish": {"message": HANDLE},
    "rcl_publish": {"publisher_handle": HANDLE, "message": HANDLE},
    "rmw_publish": {"rmw_publisher_handle": HANDLE, "message": HANDLE, "timestamp": INT64},
    "rmw_subscription_init": {"rmw_subscription_handle": HANDLE, "gid": GID},
    "rcl_subscription_init": {"subscription_handle": HANDLE, "node_handle": HANDLE,
                              "rmw_subscription_handle": HANDLE, "topic_name": TEXT, "queue_depth": SIZE},
    "rclcpp_subscription_init": {"subscription_handle": HANDLE, "subscription": HANDLE},
    "rclcpp_subscription_callback_added": {"subscription": HANDLE, "callback": HANDLE},
    "rmw_take": {"rmw_subscription_handle": HANDLE, "message": HANDLE, "source_timestamp": INT64,
                 "taken": INT32},
    "rcl_take": {"message": HANDLE},
    "rclcpp_take": {"message": HANDLE},
    "rcl_service_init": {"service_handle": HANDLE, "node_handle": HANDLE, "rmw_service_handle": HANDLE,
                         "service_name": TEXT},
    "rclcpp_service_callback_added": {"service_handle": HANDLE, "callback": HANDLE},
    "rcl_client_init": {"client_handle": HANDLE, "node_handle": HANDLE, "rmw_client_handle": HANDLE,
                        "service_name": TEXT},
    "rcl_timer_init": {"timer_handle": HANDLE, "period": INT64},
    "rclcpp_timer_callback_added": {"timer_handle": HANDLE, "callback": HANDLE},
    "rclcpp_timer_link_node": {"timer_handle": HANDLE, "node_handle": HANDLE},
    "rclcpp_callback_register": {"callback": HANDLE, "symbol": TEXT},
    "callback_start": {"callback": HANDLE, "is_intra_process": INT32},
    "callback_end": {"callback": HANDLE},
    "rclcpp_executor_get_next_ready": {},
    "rclcpp_executor_wait_for_work": {"timeout": INT64},
    "rclcpp_executor_execute": {"handle": HANDLE},
}
# What profile_app.cpp does.
RUNS = {"timer": 5, "subscription": 7, "service": 3}
UNSEEN_RUNS = 2 + 2  # of the client and the waitable, which ROS 2 does not trace
PUBLISHED = 7
DESCRIBING = ("_init", "_added", "_register", "_node")  # ends of names

Event = collections.namedtuple("Event", "name time fields context layout")


def layout_of(field_class):
    if isinstance(field_class, bt2._StringFieldClassConst):
        return TEXT
    if isinstance(field_class, bt2._StaticArrayFieldClassConst):
        return f"{field_class.length} {layout_of(field_class.element_field_class)}"
    sign = "i" if isinstance(field_class, bt2._SignedIntegerFieldClassConst) else "u"
    base = " hex" if field_class.preferred_display_base == 16 else ""
    return f"{sign}{field_class.field_value_range}{base}"


def value_of(field):
    if isinstance(field, bt2._StringFieldConst):
        # babeltrace2 2.0.4 shows the text before instead of an empty one.
        return str(field) if len(field) else ""
    if isinstance(field, bt2._ArrayFieldConst):
        return bytes(int(element) for element in field)
    return int(field)


def ros2_events(trace):
    events = []
    for message in bt2.TraceCollectionMessageIterator(str(trace)):
        if not isinstance(message, bt2._EventMessageConst) or not message.event.name.startswith("ros2:"):
            continue
        event = message.event
        payload = event.payload_field
        context = event.common_context_field
        events.append(Event(
            name=event.name.removeprefix("ros2:"),
            time=message.default_clock_snapshot.value,
            fields={} if payload is None else {name: value_of(payload[name]) for name in payload},
            context={name: value_of(context[name]) for name in context},
            layout={} if payload is None else {name: layout_of(payload.cls[name].field_class)
                                               for name in payload}))
    return events


def run(*command, **keywords):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=200, check=False,
                          **keywords)


def record(name, *arguments, **keywords):
    done = run(PROGRAMS / "cie", "record", "--kernel", "no", "-o", scratch / name, *arguments, **keywords)
    assert done.returncode == 0, done.stderr
    return scratch / name


def described(trace):
    """How often each describing event is recorded, also while that goes on."""
    text = run("babeltrace2", trace).stdout
    return collections.Counter(name for name in re.findall(r"ros2:(\w+): ", text) if name.endswith(DESCRIBING))


def announcers_sleeps(pid):
    """How often the thread that announces has gone to sleep; it looks around whenever it wakes."""
    for task in Path(f"/proc/{pid}/task").iterdir():
        if (task / "comm").read_text() == "cie-announce\n":
            return int(re.search(r"^voluntary_ctxt_switches:\s+(\d+)", (task / "status").read_text(), re.MULTILINE)[1])
    raise AssertionError("no thread announces")


def streams_of(trace, prefixes, name):
    """A copy of a recording with only the streams of some channels."""
    metadata = next(trace.rglob("metadata"))
    copy = scratch / name
    copy.mkdir()
    for file in metadata.parent.iterdir():
        if file.name == "metadata" or file.is_file() and file.name.startswith(prefixes):
            shutil.copy(file, copy)
    return copy


def callbacks_of(trace):
    report = run(PROGRAMS / "cie", "report", trace, "-f", "json")
    return json.loads(report.stdout)["callbacks"]


class Profile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.trace = record("run", "--profile", "ros2", "--", APP)
        cls.events = ros2_events(cls.trace)

    def named(self, name):
        return [event for event in self.events if event.name == name]

    def only(self, name):
        found = self.named(name)
        self.assertEqual(len(found), 1, name)
        return found[0].fields

    def test_every_event_has_the_fields_of_ros_2(self):
        self.assertEqual({event.name for event in self.events}, set(LAYOUTS))
        for event in self.events:
            self.assertEqual(list(event.layout.items()), list(LAYOUTS[event.name].items()), event.name)

    def test_every_event_tells_who_emits_it(self):
        # Where its process runs in a session daemon of its own, pids are those that it sees itself.
        for event in self.events:
            self.assertEqual(set(event.context), {"vpid", "vtid", "procname"})
            self.assertEqual(event.context["procname"].rstrip("\0"), APP.name[:15])

    def test_handles_lead_from_callbacks_to_nodes_and_topics(self):
        node = self.only("rcl_node_init")
        self.assertEqual((node["namespace"], node["node_name"]), ("/robot", "arm"))
        self.assertTrue(self.only("rcl_init")["version"].startswith("8.2."))

        timer = self.only("rcl_timer_init")
        self.assertEqual(timer["period"], 2_000_000)
        self.assertEqual(self.only("rclcpp_timer_link_node"), {"timer_handle": timer["timer_handle"],
                                                               "node_handle": node["node_handle"]})
        subscription = self.only("rcl_subscription_init")
        self.assertEqual((subscription["node_handle"], subscription["topic_name"], subscription["queue_depth"]),
                         (node["node_handle"], "/robot/angle", 4))
        self.assertEqual(self.only("rmw_subscription_init")["rmw_subscription_handle"],
                         subscription["rmw_subscription_handle"])
        rclcpp = self.only("rclcpp_subscription_init")
        self.assertEqual(rclcpp["subscription_handle"], subscription["subscription_handle"])
        service = self.only("rcl_service_init")
        self.assertEqual((service["node_handle"], service["service_name"]), (node["node_handle"], "/robot/reset"))
        client = self.only("rcl_client_init")
        self.assertEqual((client["node_handle"], client["service_name"]),
                         (node["node_handle"], "/robot/calibrate"))
        publisher = self.only("rcl_publisher_init")
        self.assertEqual((publisher["node_handle"], publisher["topic_name"], publisher["queue_depth"]),
                         (node["node_handle"], "/robot/angle", 9))
        rmw = self.only("rmw_publisher_init")
        self.assertEqual(rmw["rmw_publisher_handle"], publisher["rmw_publisher_handle"])
        self.assertEqual(rmw["gid"], (0x0102030405060708).to_bytes(8, sys.byteorder) + bytes(16))

        added = {"timer": self.only("rclcpp_timer_callback_added"),
                 "subscription": self.only("rclcpp_subscription_callback_added"),
                 "service": self.only("rclcpp_service_callback_added")}
        self.assertEqual(added["timer"]["timer_handle"], timer["timer_handle"])
        self.assertEqual(added["subscription"]["subscription"], rclcpp["subscription"])
        self.assertEqual(added["service"]["service_handle"], service["service_handle"])
        symbols = {event.fields["callback"]: event.fields["symbol"]
                   for event in self.named("rclcpp_callback_register")}
        self.assertEqual(symbols, {fields["callback"]: f"Arm::{kind}" for kind, fields in added.items()})
        starts = collections.Counter(event.fields["callback"] for event in self.named("callback_start"))
        self.assertEqual(starts, {added[kind]["callback"]: runs for kind, runs in RUNS.items()})

    def test_every_callback_runs_from_its_start_to_its_end(self):
        ends = collections.Counter(event.fields["callback"] for event in self.named("callback_end"))
        self.assertEqual(sum(ends.values()), sum(RUNS.values()))
        running = None
        for event in self.events:  # of one thread
            if event.name == "callback_start":
                self.assertIsNone(running)
                running = event.fields["callback"]
            elif event.name == "callback_end":
                self.assertEqual(event.fields["callback"], running)
                running = None

    def test_a_message_keeps_its_source_timestamp_from_its_writer_to_its_reader(self):
        calls = [self.named(name) for name in ("rclcpp_publish", "rcl_publish", "rmw_publish")]
        self.assertEqual([len(events) for events in calls], [PUBLISHED] * 3)
        messages = [[event.fields["message"] for event in events] for events in calls]
        self.assertEqual(messages[0], messages[1])
        self.assertEqual(messages[0], messages[2])
        self.assertEqual(len(set(messages[0])), PUBLISHED)
        takes = [self.named(name) for name in ("rmw_take", "rcl_take", "rclcpp_take")]
        self.assertEqual([len(events) for events in takes], [RUNS["subscription"]] * 3)
        self.assertEqual([event.fields["source_timestamp"] for event in takes[0]],
                         [event.fields["timestamp"] for event in calls[2]])
        self.assertEqual({event.fields["taken"] for event in takes[0]}, {1})

    def test_an_executor_waits_finds_something_and_executes_it(self):
        names = [event.name for event in self.events
                 if event.name.startswith("rclcpp_executor") or event.name == "callback_start"]
        wait, ready, execute = ("rclcpp_executor_wait_for_work", "rclcpp_executor_get_next_ready",
                                "rclcpp_executor_execute")
        self.assertEqual(names, [execute, "callback_start"] * RUNS["timer"]
                         + [wait, ready, execute, "callback_start"] * RUNS["subscription"]
                         + [wait, ready, "callback_start"] * RUNS["service"]
                         + [wait, ready] * UNSEEN_RUNS)
        self.assertEqual({event.fields["timeout"] for event in self.named(wait)}, {-1})
        self.assertEqual(collections.Counter(event.fields["handle"] for event in self.named(execute)), {
            self.only("rcl_timer_init")["timer_handle"]: RUNS["timer"],
            self.only("rcl_subscription_init")["subscription_handle"]: RUNS["subscription"]})


class Processes(unittest.TestCase):
    def test_both_vocabularies_count_the_same_and_together_no_more(self):
        both = record("demo", "--profile", "ros2", "--", PROGRAMS / "cie-demo", "--duration", "1", "--load", "0.2",
                      "--tag", f"profile_{os.getpid()}")
        own = callbacks_of(streams_of(both, ("state_", "events_"), "demo_cie"))
        self.assertEqual(callbacks_of(both), own)
        ros2 = callbacks_of(streams_of(both, ("ros2_",), "demo_ros2"))
        self.assertGreater(len(own), 20)

        def counts(callbacks):
            return {tuple(str(callback[k]) for k in ("node", "kind", "source", "period_ns")): callback["instances"]
                    for callback in callbacks}
        self.assertEqual(counts(ros2), counts(own))

    def test_each_recording_of_a_running_process_describes_it_once(self):
        ready = scratch / "ready"
        # Outlives the recordings: the application would need seconds to find another one.
        isolated_main.session_daemon(self)
        app = subprocess.Popen([APP, ready], env=os.environ | {"CIE_TRACE_PROFILE": "ros2"})
        self.addCleanup(app.wait)
        self.addCleanup(app.kill)
        isolated_main.wait_for(ready.exists, "the application")
        wanted = {event: 3 if event == "rclcpp_callback_register" else 1 for event in LAYOUTS if event.endswith(DESCRIBING)}
        for name in ("first", "second"):
            if name == "second":  # the process sees first that the other one ended
                before = announcers_sleeps(app.pid)
                isolated_main.wait_for(lambda: announcers_sleeps(app.pid) >= before + 2, "a look around")  # pylint: disable=cell-var-from-loop
            recorder = subprocess.Popen(
                [PROGRAMS / "cie", "record", "--kernel", "no", "-o", scratch / name, "--profile", "ros2", "--attach",
                 "--flush-interval", "100"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            self.addCleanup(recorder.kill)
            isolated_main.wait_for(lambda: described(scratch / name).keys() >= wanted.keys(), name)  # pylint: disable=cell-var-from-loop
            time.sleep(0.4)  # in which nothing is described again
            recorder.send_signal(signal.SIGINT)
            said = recorder.communicate(timeout=200)[1]
            self.assertEqual(recorder.returncode, 0, said)
            self.assertEqual(described(scratch / name), wanted, name)

    def test_without_the_profile_there_is_no_such_event(self):
        done = run(PROGRAMS / "cie", "record", "--kernel", "no", "-o", scratch / "plain", "--event", "ros2:*", "--",
                   APP)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(ros2_events(scratch / "plain"), [])

    def test_a_profile_that_cannot_be_had_is_refused(self):
        for app, profile, why in ((APP, "ros3", 'there is no such profile; there is "ros2"'),
                                  (APP_OF_ROS2, "ros2", "this process has ROS 2's own tracepoints already")):
            done = run(app, env=os.environ | {"CIE_TRACE_PROFILE": profile})
            self.assertEqual(done.returncode, 3)
            self.assertIn(f"CIE_TRACE_PROFILE={profile}: {why}", done.stderr)
        self.assertEqual(run(APP_OF_ROS2).returncode, 0, "without the profile nothing is in the way")


def begin(directory):
    global scratch
    scratch = directory


if __name__ == "__main__":
    isolated_main.main("ros2-profile", sys.argv[4:], begin)
