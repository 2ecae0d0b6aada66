#!/usr/bin/env python3
"""cie live on all that several machines stream to one relay daemon: they are told apart, and one that dies does not
take the others along."""

import json
import subprocess
import unittest

import machines
from machines import CIE, HOST_APP, Network, wait_for

PING = "/desk@Subscription(/ping)"
PONG = "/robot@Subscription(/pong)"


class Live:
    """cie live on the collecting machine, whose lines are read as they come."""

    def __init__(self, test, network, *arguments):
        collector = network.collector
        self.process = subprocess.Popen(
            [*collector.enter, "--", CIE, "live", "--json", "--interval", "0.3", *arguments], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            preexec_fn=machines.die_with_parent)  # pylint: disable=subprocess-popen-preexec-fn
        test.addCleanup(self.end)

    def end(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def until(self, condition, what):
        last = None
        found = []

        def is_there():
            nonlocal last
            line = self.process.stdout.readline()  # one comes every interval
            assert line.startswith("{"), line
            last = json.loads(line)
            if condition(last):
                found.append(last)
            return bool(found)
        try:
            wait_for(is_there, what)
        except AssertionError as error:
            raise AssertionError(f"{error}; the last: {last}") from None
        return found[0]


def states(snapshot):
    return {host["host"]: host["state"] for host in snapshot["hosts"]}


def recent(snapshot, host, logical_id):
    """Instances of a callback of that machine in the window."""
    return sum(c["window"]["instances"] for c in snapshot["callbacks"] if (c["host"], c["logical_id"]) == (host, logical_id))


class LiveHosts(unittest.TestCase):
    def test_machines_are_told_apart_and_one_dies(self):
        clocks = {"desk": 500_000} if machines.can_have_clocks() else {}
        network = Network(self.addCleanup, "robot", "desk", monotonic=clocks)
        network.collect(machines.scratch / "all")
        options = ["--flush-interval", "200"]
        recorders = {"robot": network["robot"].record("robot", HOST_APP, "robot", options=options)}
        wait_for(lambda: list((machines.scratch / "all").glob("robot/*")), "the robot's session")
        live = Live(self, network, f"net://{Network.ADDRESS}:5344")
        live.until(lambda s: set(states(s)) == {"robot"}, "the robot is followed")
        # A machine that comes later is found.
        recorders["desk"] = network["desk"].record("desk", HOST_APP, "desk", options=options)
        both = live.until(lambda s: recent(s, "robot", PONG) > 10 and recent(s, "desk", PING) > 10, "both talk")
        self.assertEqual(states(both), {"robot": "streaming", "desk": "streaming"})
        self.assertEqual({c["host"] for c in both["callbacks"] if c["logical_id"] == PING}, {"desk"})
        self.assertEqual({c["host"] for c in both["callbacks"] if c["logical_id"] == PONG}, {"robot"})
        self.assertEqual({t["host"] for t in both["threads"]}, {"robot", "desk"})
        self.assertEqual([v for v in both["verdicts"] if v["verdict"] == "FAIL" and v["rule"] not in ("R1", "R2", "Q1")], [])

        total = recent(both, "robot", "/robot@Timer(10000000)")
        self.assertGreater(total, 0)
        network["desk"].kill()
        dead = live.until(lambda s: states(s)["desk"] in ("silent", "ended"), "the desk's death is noticed")
        self.assertEqual(states(dead)["robot"], "streaming")
        self.assertNotIn(dead["source"]["state"], ("lost", "ended"))
        after = dead["events"]
        live.until(lambda s: s["events"] > after + 100, "the robot goes on")
        live.until(lambda s: states(s)["desk"] == "ended", "the relay daemon gives the desk up")
        self.assertEqual(recorders["robot"].end(), 0, recorders["robot"].said())
        last = live.until(lambda s: s["source"]["state"] == "ended", "all ended")
        ended = {host["host"]: host for host in last["hosts"]}
        self.assertEqual(ended["robot"]["state"], "ended")
        self.assertEqual(ended["robot"]["message"], "")
        self.assertRegex(ended["desk"]["message"], "its processes had not ended")
        self.assertEqual(live.process.wait(60), 0)


if __name__ == "__main__":
    machines.main("live_hosts")
