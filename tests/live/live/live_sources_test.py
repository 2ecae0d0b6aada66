#!/usr/bin/env python3
"""`cie live`: where events come from, what becomes of them, and how it ends.

Counts come from what the traced applications say of themselves.
"""
import fcntl
import json
import os
import re
import signal
import socket
import statistics
import subprocess
import time
import unittest
from pathlib import Path

import support
from support import CIE, PATIENCE, SHORT_SUBSCRIPTION, SHORT_TIMER, SUBSCRIPTION, TIMER, Relay, Running, app, callback, live, wait_for

MOST_RECENT = 32  # instances that a line shows of a callback


def lines_of(done):
    return [json.loads(line) for line in done.stdout.splitlines()]


class Command(unittest.TestCase):
    def test_every_instance_is_counted_and_violations_are_told_once(self):
        done = live("--json", "--interval", 0.2, "--", *app("--instances", 150, "--period-us", 5000))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("instances 150", done.stderr, "the command's output goes to standard error")
        lines = lines_of(done)
        self.assertGreater(len(lines), 2)
        self.assertEqual([line["sequence"] for line in lines], list(range(1, len(lines) + 1)))
        last = lines[-1]
        self.assertEqual((last["source"]["state"], last["lost_events"]), ("ended", 0))
        for name in (TIMER, SUBSCRIPTION):
            total = callback(last, name)["total"]
            self.assertEqual(total["instances"], 150)
            self.assertEqual(total["response_time_ns"]["count"], 150)
            self.assertEqual(sum(total["response_time_counts"]), 150)
            self.assertEqual(total["response_time_sum_ns"], total["response_time_ns"]["sum"])
        changes = [change for line in lines for change in line["changes"]]
        mapping = [change for change in changes if change["rule"] == "M2"]
        self.assertEqual([change["to"] for change in mapping], ["FAIL"], "both callbacks run on one thread")
        # It ends with an overwritten sample, which only its last words tell.
        self.assertNotIn("Q1", [change["rule"] for change in lines[0]["changes"]])
        self.assertEqual([change["to"] for change in changes if change["rule"] == "Q1"], ["FAIL"])

    def test_late_instances_are_those_beyond_the_specs_deadline(self):
        spec = support.scratch / "spec.yaml"
        spec.write_text(f"callback_groups:\n  - id: {TIMER}\n    response_deadline: 1000000\n", encoding="utf-8")
        lines = lines_of(live("--json", "--instances", "--interval", 0.1, "--spec", spec, "--",
                              *app("--instances", 100, "--period-us", 5000, "--work-us", 1500)))
        timer = callback(lines[-1], TIMER)
        self.assertEqual(timer["deadline_ns"], 1000000)
        self.assertEqual(timer["total"]["late"], 100, "each takes a millisecond and a half")
        before = 0
        for shown in filter(None, (callback(line, TIMER) for line in lines)):
            after = shown["total"]["instances"]
            self.assertEqual([i["seq"] for i in shown["recent"]], list(range(max(before, after - MOST_RECENT), after)))
            before = after
            for instance in shown["recent"]:
                self.assertEqual(instance["late"], instance["response_ns"] > 1000000)
        self.assertEqual(before, 100)
        busy = [t["cpu_percent"] for line in lines for t in line["threads"] if t["cpu_percent"] is not None]
        self.assertGreater(max(busy), 0, "1.5 ms of about 7, where it gets a CPU")
        self.assertGreaterEqual(min(busy), 0)
        self.assertLess(statistics.median(busy), 110, "of one CPU; one value is off where this program waited for a CPU itself")

    def test_lines_have_the_fields_that_the_documentation_names(self):
        text = (Path(__file__).resolve().parents[3] / "viewer_export" / "live" / "README.md").read_text("utf-8")
        block = re.search(r"## The lines: cie.live/1.*?```\n(.*?)```", text, re.DOTALL)[1]
        documented = set(re.findall(r'"(\w+)":', block))
        found = set()

        def collect(value):
            if isinstance(value, dict):
                found.update(value)
            for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
                collect(inner)
        collect(lines_of(live("--json", "--instances", "--interval", 0.2, "--",
                              *app("--instances", 400, "--period-us", 5000, "--burst", 5))))
        of_summary = {"count", "min", "max", "sum", "mean", "p50", "p90", "p99", "p99_9"}
        self.assertLessEqual(of_summary, found)
        self.assertEqual(found - of_summary - {"severity"}, documented - of_summary - {"severity", "session", "silent_ns"})

    def test_a_count_ends_it_and_the_command(self):
        done = live("--batch", "-n", 2, "--interval", 0.3, "--", *app("--until-signal", "--period-us", 1000))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("cie live  "), 2)
        self.assertEqual(support.no_leftovers(), [])

    def test_the_last_line_says_that_the_consumer_daemon_ended(self):
        program = Running(self, [CIE, "live", "--json", "--interval", "0.2", "--",
                                 *app("--until-signal", "--period-us", 5000)])
        program.until(lambda s: callback(s, TIMER))
        consumers = support.descendants(program.process.pid, "lttng-consumerd")
        self.assertEqual(len(consumers), 1)
        os.kill(consumers[0], signal.SIGKILL)
        last = program.until(lambda s: s["source"]["state"] == "ended")
        self.assertIn("the consumer daemon ended: nothing can be seen of", last["source"]["message"])
        self.assertIsNone(last["lost_events"])
        self.assertNotEqual(last["verdict"], "PASS")
        self.assertIn(["T2", "INCONCLUSIVE"], [[one["rule"], one["verdict"]] for one in last["verdicts"]])
        self.assertEqual(program.process.wait(PATIENCE), 4)
        self.assertEqual(support.no_leftovers(), [])

    def test_a_command_that_goes_on_is_killed(self):
        begun = time.monotonic()
        done = live("--json", "-n", 2, "--interval", 0.3, "--", "sh", "-c", "trap '' INT TERM; while :; do sleep 0.1; done")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(time.monotonic() - begun, 40, "5 s after SIGTERM, and what a busy machine needs")
        self.assertRegex(done.stderr, r'cie live: killed "sh" \(pid \d+\), which did not end\n')
        self.assertEqual(support.no_leftovers(), [])

    def test_a_reader_that_has_gone_ends_it_quietly(self):
        for view in ("--batch", "--json"):
            with self.subTest(view=view):
                reader, writer = os.pipe()
                with subprocess.Popen([CIE, "live", view, "--interval", "0.2", "--", *app("--until-signal")],
                                      stdin=subprocess.DEVNULL, stdout=writer, stderr=subprocess.PIPE, text=True) as program:
                    os.close(writer)
                    os.read(reader, 1)
                    os.close(reader)
                    _, err = program.communicate(timeout=PATIENCE)
                self.assertEqual(program.returncode, -signal.SIGPIPE, err)
                self.assertNotIn("cie", err)
                self.assertEqual(support.no_leftovers(), [])

    def test_a_reader_that_pauses_is_told_what_happens_when_it_goes_on(self):
        program = Running(self, [CIE, "live", "--json", "--interval", "0.2", "--",
                                 *app("--until-signal", "--period-us", 2000)])
        program.until(lambda s: callback(s, TIMER))
        program.process.send_signal(signal.SIGSTOP)
        time.sleep(6)  # twice as long as a relay daemon may be silent
        program.process.send_signal(signal.SIGCONT)
        begun = time.monotonic()
        after = [program.snapshot() for _ in range(50)]
        self.assertNotIn("lost", [line["source"]["state"] for line in after])
        self.assertLess(time.monotonic() - begun, 15, "20 were written meanwhile or at most 50 came since, 0.2 s apart")
        total = [callback(line, TIMER)["total"]["instances"] for line in after]
        self.assertGreater(total[-1], total[0])

    def test_lines_are_further_apart_than_a_silent_relay_daemon_is_waited_for(self):
        done = live("--json", "--interval", 5, "--", *app("--instances", 1000, "--period-us", 7000))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([line["source"]["state"] for line in lines_of(done)], ["streaming", "ended"])

    def test_text_tells_what_json_does(self):
        done = live("--batch", "--interval", 0.3, "--", *app("--instances", 50))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("VIOLATED M2 one-callback-per-thread"), 1)
        last = done.stdout[done.stdout.rindex("cie live  "):]
        self.assertIn("  ended  FAIL M2 one-callback-per-thread (1)", last)
        for name in (SHORT_TIMER, SHORT_SUBSCRIPTION.replace("\u2190", "<-")):
            self.assertIn(name, last)

    def test_signals_end_it_after_a_last_snapshot(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(signal=number):
                program = Running(self, [CIE, "live", "--json", "--interval", "0.2", "--",
                                         *app("--until-signal", "--period-us", 1000)])
                program.until(lambda s: callback(s, TIMER))
                program.process.send_signal(number)
                out, err = program.process.communicate(timeout=PATIENCE)
                self.assertEqual(program.process.returncode, 0, err)
                last = json.loads(out.splitlines()[-1])
                self.assertEqual(last["source"]["state"], "ended")
                said = int(re.search(r"instances (\d+)", err)[1])
                self.assertEqual(callback(last, TIMER)["total"]["instances"], said)

    def test_a_command_that_does_not_exist(self):
        done = live("--json", "--", "/nonexistent/program")
        self.assertEqual(done.returncode, 4, done)
        self.assertEqual(done.stderr, 'cie: cannot run "/nonexistent/program": No such file or directory\n')


class Attached(unittest.TestCase):
    def test_what_runs_already_is_seen_with_its_names(self):
        Relay(self)  # a session daemon to register with
        ready = support.scratch / "ready"
        running = Running(self, app("--until-signal", "--period-us", 2000, "--ready", ready))
        wait_for(ready.exists, "the application")
        program = Running(self, [CIE, "live", "--json", "--interval", "0.2"])
        first = program.until(lambda s: callback(s, TIMER))
        later = program.until(lambda s: callback(s, TIMER)["total"]["instances"]
                              > callback(first, TIMER)["total"]["instances"])
        self.assertEqual(callback(later, SUBSCRIPTION)["pid"], running.process.pid)
        program.process.send_signal(signal.SIGINT)
        _, err = program.process.communicate(timeout=PATIENCE)
        self.assertEqual(program.process.returncode, 0, err)
        self.assertIsNone(running.process.poll(), "it goes on")
        running.process.send_signal(signal.SIGTERM)
        self.assertEqual(running.process.wait(PATIENCE), 0)


class Session(unittest.TestCase):
    def setUp(self):
        self.relay = Relay(self)

    def follow(self, *arguments):
        return Running(self, [CIE, "live", "--json", "--interval", "0.2", *arguments])

    def test_a_session_of_somebody_else(self):
        url = self.relay.create("mine")
        for name in (url, self.relay.url):  # the only one there
            with self.subTest(name=name):
                program = self.follow(name)
                self.assertEqual(program.snapshot()["source"]["state"], "waiting")
                self.relay.command("start")
                subprocess.run(app("--instances", 50, "--period-us", 1000), check=True, stdout=subprocess.DEVNULL)
                program.until(lambda s: (callback(s, TIMER) or {"total": {"instances": 0}})["total"]["instances"] == 50)
                program.end()
                self.relay.command("stop")
        program = self.follow(url)
        program.snapshot()
        self.relay.command("destroy", "mine")
        out, err = program.process.communicate(timeout=PATIENCE)
        self.assertEqual(program.process.returncode, 0, err)
        self.assertEqual(json.loads(out.splitlines()[-1])["source"]["state"], "ended")

    def test_a_session_that_runs_already_names_its_callbacks_when_asked_to(self):
        url = self.relay.create("mine")
        self.relay.command("start")
        ready = support.scratch / "ready-before"
        Running(self, app("--until-signal", "--period-us", 2000, "--ready", ready))
        wait_for(ready.exists, "the application")
        # Its description has been sent, and no reader was there.
        wait_for(lambda: b"callback_start" in subprocess.run(
            ["babeltrace2", *support.traces(self.relay.folder)], capture_output=True, check=False).stdout, "the first packets")
        program = self.follow(url)
        nameless = program.until(lambda s: len(s["callbacks"]) == 2)
        self.assertEqual({c["logical_id"] for c in nameless["callbacks"]}, {"?0", "?1"})
        self.relay.command("regenerate", "statedump", "--session", "mine")
        program.until(lambda s: callback(s, TIMER) and callback(s, SUBSCRIPTION))

    def test_a_session_that_is_not_there(self):
        nobody = support.free_ports(1)[0]
        for name, code, message in ((f"net://127.0.0.1:{nobody}", 4, "no relay daemon answers"),
                                    (self.relay.url, 4, "has no live session"),
                                    (f"{self.relay.url}/host/h/s", 4, "cannot go on reading")):
            with self.subTest(name=name):
                done = live("--json", name)
                self.assertEqual((done.returncode, done.stdout), (code, ""))
                self.assertIn(message, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.relay.create("a")
        self.relay.create("b")
        done = live("--json", "c")
        self.assertEqual(done.returncode, 4, "there is no relay daemon at the usual place")

    def test_all_sessions_of_a_relay_daemon(self):
        for name in ("a", "b"):
            self.relay.create(name)
        program = self.follow(self.relay.url)
        program.until(lambda s: {h["session"] for h in s["hosts"]} == {"a", "b"})
        self.relay.command("start", "b")
        subprocess.run(app("--instances", 50, "--period-us", 1000), check=True, stdout=subprocess.DEVNULL)
        seen = program.until(lambda s: (callback(s, TIMER) or {"total": {"instances": 0}})["total"]["instances"] == 50)
        self.assertEqual({h["host"] for h in seen["hosts"]}, {socket.gethostname()})
        self.relay.command("destroy", "a")
        program.until(lambda s: {h["session"]: h["state"] for h in s["hosts"]}.get("b") in ("streaming", "silent")
                      and {h["session"]: h["state"] for h in s["hosts"]}.get("a", "ended") == "ended")
        self.relay.command("destroy", "b")
        out, err = program.process.communicate(timeout=60)
        self.assertEqual(program.process.returncode, 0, err)
        self.assertEqual(json.loads(out.splitlines()[-1])["source"]["state"], "ended")

    def test_what_begins_anew_when_the_relay_daemon_is_back_is_followed_and_known_to_come_after_a_gap(self):
        self.relay.create("before")
        program = self.follow(self.relay.url)
        program.snapshot()
        self.relay.command("start")
        Running(self, app("--until-signal", "--period-us", 2000))
        seen = program.until(lambda s: callback(s, TIMER) and callback(s, TIMER)["total"]["instances"] > 100)
        self.relay.relayd.kill()
        self.relay.relayd.wait()
        lost = program.until(lambda s: s["source"]["state"] == "lost")
        self.assertEqual([host["state"] for host in lost["hosts"]], ["lost"])
        subprocess.run(["lttng", "--no-sessiond", "destroy", "--no-wait", "before"], check=False, capture_output=True)
        self.relay.start_relay()
        program.until(lambda s: s["source"]["message"] == "the relay daemon does not have it any more")
        self.relay.create("after")
        self.relay.command("start")
        later = program.until(lambda s: callback(s, TIMER)["total"]["instances"]
                              > callback(seen, TIMER)["total"]["instances"] + 1000)
        self.assertEqual({host["session"]: host["state"] for host in later["hosts"]}, {"after": "streaming"})
        self.assertIn("host-gap", [defect["kind"] for defect in later["defects"]])

    def test_a_relay_daemon_that_hangs_or_dies_is_told_and_waited_for(self):
        url = self.relay.create("mine")
        program = self.follow(url)
        program.snapshot()
        self.relay.command("start")
        subprocess.run(app("--instances", 20, "--period-us", 1000), check=True, stdout=subprocess.DEVNULL)
        program.until(lambda s: callback(s, TIMER) and callback(s, TIMER)["total"]["instances"] == 20)
        self.relay.relayd.send_signal(signal.SIGSTOP)
        silent = program.until(lambda s: s["source"]["state"] == "lost")
        self.assertEqual(silent["source"]["message"], "no answer from the relay daemon for 3 s")
        self.relay.relayd.send_signal(signal.SIGCONT)
        program.until(lambda s: s["source"]["state"] != "lost")
        self.relay.relayd.kill()
        self.relay.relayd.wait()
        lost = program.until(lambda s: s["source"]["state"] == "lost")
        self.assertNotEqual(lost["source"]["message"], "")
        self.assertEqual(callback(lost, TIMER)["total"]["instances"], 20, "what was seen stays")
        subprocess.run(["lttng", "--no-sessiond", "destroy", "--no-wait", "mine"], check=False, capture_output=True)
        self.relay.start_relay()
        self.relay.create("mine")
        program.until(lambda s: s["source"]["state"] != "lost")
        self.relay.command("start")
        subprocess.run(app("--instances", 30, "--period-us", 1000), check=True, stdout=subprocess.DEVNULL)
        program.until(lambda s: sorted(c["total"]["instances"] for c in s["callbacks"] if c["logical_id"] == TIMER) == [20, 30])


def read_process(pid, name):
    """A file of /proc, empty once the process has gone."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text("ascii")
    except (FileNotFoundError, ProcessLookupError):
        return ""


class Burst(unittest.TestCase):
    def follow(self, instances, environment=None):
        """Follows a burst. Returns its last snapshot, how many events were emitted, and peaks of the feed's memory in kB."""
        program = Running(self, [CIE, "live", "--json", "--interval", "0.2", "--", support.BURST_APP, str(instances)],
                          env={**os.environ, **(environment or {})})
        # The program waits for this one, so that what is looked at between lines is of that time.
        fcntl.fcntl(program.process.stdout, fcntl.F_SETPIPE_SZ, 4096)
        feed = None
        peaks = []
        last = None
        for line in program.process.stdout:
            last = json.loads(line)
            for child in read_process(program.process.pid, f"task/{program.process.pid}/children").split():
                if read_process(child, "comm").strip() == "cie-live":
                    feed = child
            peak = re.search(r"VmHWM:\s+(\d+) kB", read_process(feed, "status"))
            if peak and last["events"] > 0:
                peaks.append(int(peak[1]))
        err = program.process.stderr.read()
        emitted = int(re.search(r"^(\d+)$", err, re.MULTILINE)[1])
        self.assertEqual(emitted, 4 * instances)
        self.assertEqual(last["source"]["state"], "ended")
        return last, emitted, peaks

    def assert_losses_are_counted(self, last, emitted):
        state_events = last["events"] + last["lost_events"] - emitted
        self.assertTrue(0 <= state_events < 200, (last["events"], last["lost_events"], emitted))

    def test_a_hot_source_is_bounded_and_its_losses_are_counted(self):
        last, emitted, peaks = self.follow(400_000)
        if "seq-gaps" in {defect["kind"] for defect in last["defects"]}:
            pass  # a stream's first packets were gone before they were asked for: only numbers in events tell
        elif last["lost_events"] is not None:
            self.assert_losses_are_counted(last, emitted)
        else:
            self.assertGreater(last["lost_packets"], 0)
        if last["events"] < emitted:
            self.assertNotEqual(last["defects"], [], "what is missing is told")
        self.assertGreater(len(peaks), 2)
        self.assertLess(peaks[-1], 200_000, "kB")
        self.assertLess(peaks[-1] - peaks[len(peaks) // 2], 30_000, peaks)

    def test_what_full_buffers_discard_at_last_is_counted(self):
        last, emitted, _ = self.follow(200_000, {"LD_PRELOAD": support.LATE_CONSUMER})
        self.assertEqual(last["lost_packets"], 0, "the relay daemon keeps more than this")
        self.assertGreater(last["lost_events"], 0)
        self.assert_losses_are_counted(last, emitted)


if __name__ == "__main__":
    support.main("live")
