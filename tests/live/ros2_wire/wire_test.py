#!/usr/bin/env python3
"""What an application of ours says on the wire, octet by octet, as rmw_cyclonedds says and expects it.
The other side is peer.cpp, which knows no types: encoding and decoding is done here, by hand. Values
are those of rmw_cyclonedds 1.3.4 (Humble) and rmw_dds_common."""

import argparse
import json
import os
import queue
import struct
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

options: argparse.Namespace
DOMAIN = 17
FOREVER = 0x7FFFFFFFFFFFFFFF
STRING = "std_msgs::msg::dds_::String_"
REQUEST = "example_interfaces::srv::dds_::AddTwoInts_Request_"
RESPONSE = "example_interfaces::srv::dds_::AddTwoInts_Response_"
CLIENT = "clientid=1.10.2b.0.0.1.c1.0.0.0.0.0.0.0.1.3;"
LITTLE, BIG = bytes([0, 1, 0, 0]), bytes([0, 0, 0, 0])
BOUND = 90  # seconds: "never", not "late"


class Process:
    """A program that takes and gives lines."""

    def __init__(self, arguments, environment):
        self.process = subprocess.Popen(arguments, env=environment, text=True, bufsize=1,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.lines = queue.Queue()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def wait_for(self, is_it):
        """The next line that is it; those before it are dropped."""
        end = time.monotonic() + BOUND
        while time.monotonic() < end:
            try:
                line = self.lines.get(timeout=0.1)
            except queue.Empty:
                continue
            if is_it(line):
                return line
        raise AssertionError("never came")

    def wait_for_all(self, expected):
        """Until each of the lines came, in whatever order."""
        missing = set(expected)
        while missing:
            missing.discard(self.wait_for(lambda line: line in missing))

    def end(self):
        self.process.stdin.close()
        code = self.process.wait(BOUND)
        self.process.stdout.close()
        return code


class Peer(Process):
    def __init__(self, environment):
        super().__init__([options.peer, str(DOMAIN)], environment)
        self.all = []

    def wait_for_json(self, **fields):
        """The first thing ever seen that has these fields."""
        end = time.monotonic() + BOUND
        at = 0
        while time.monotonic() < end:
            for seen in self.all[at:]:
                if all(seen.get(key) == value for key, value in fields.items()):
                    return seen
            at = len(self.all)
            try:
                self.all.append(json.loads(self.lines.get(timeout=0.1)))
            except queue.Empty:
                pass
        raise AssertionError(f"never came: {fields}")

    def next_sample(self, topic):
        """The next sample of a topic that was not given out yet."""
        sample = self.wait_for_json(sample=topic)
        self.all.remove(sample)
        return bytes.fromhex(sample["bytes"])

    def make(self, kind, topic, type_name, durability="volatile", user_data=""):
        self.tell(f"{kind} {topic} {type_name} {durability} {user_data}")
        self.wait_for_json(did=kind, topic=topic)

    def write(self, topic, octets):
        self.tell(f"write {topic} {octets.hex()}")


class Decoder:
    """Plain CDR, little endian; positions count from behind the four octets of the encoding."""

    def __init__(self, octets):
        assert octets[:2] == LITTLE[:2] and octets[2] == 0 and octets[3] < 4, octets[:4]
        self.padding = octets[3]
        self.octets, self.at = octets[4:], 0

    def number(self, size=4):
        self.at = (self.at + size - 1) // size * size
        value = int.from_bytes(self.raw(size), "little")
        return value

    def raw(self, size):
        assert self.at + size <= len(self.octets)
        self.at += size
        return self.octets[self.at - size:self.at]

    def text(self):
        octets = self.raw(self.number())
        assert octets[-1] == 0
        return octets[:-1].decode()

    def end(self):
        rest = self.octets[self.at:]
        assert rest == bytes(self.padding), rest


class Encoder:
    """The counterpart, from a position that is a multiple of four."""

    def __init__(self):
        self.octets = b""

    def number(self, value, size=4):
        self.octets += bytes(-len(self.octets) % size) + value.to_bytes(size, "little")
        return self

    def text(self, text):
        octets = text.encode() + b"\0"
        self.number(len(octets)).octets += octets
        return self


def cdr_string(text, encoding=LITTLE):
    octets = text.encode() + b"\0"
    order = "little" if encoding == LITTLE else "big"
    return encoding + len(octets).to_bytes(4, order) + octets


def discovery_info(octets, gid_size):
    """(participant, {fully qualified node: (readers, writers)}), all GUIDs as 32 digits."""
    decoder = Decoder(octets)

    def gid():
        octets = decoder.raw(gid_size)
        assert octets[16:] == bytes(gid_size - 16), octets
        return octets[:16].hex()

    participant = gid()
    nodes = {}
    for _ in range(decoder.number()):
        name_space, name = decoder.text(), decoder.text()
        readers = [gid() for _ in range(decoder.number())]
        writers = [gid() for _ in range(decoder.number())]
        nodes[name_space, name] = (readers, writers)
    decoder.end()
    return participant, nodes


class OnTheWire(unittest.TestCase):
    distribution = None
    arguments = ()

    def setUp(self):
        tag = f"wire{os.getpid()}"
        environment = {key: value for key, value in os.environ.items()
                       if not key.startswith(("ROS_", "CIE_", "CYCLONEDDS_"))}
        ours = environment | {"CIE_DOMAIN_ID": str(DOMAIN), "CIE_LOOPBACK": "1",
                              "CIE_DISCOVERY_TAG": tag}
        if self.distribution:
            ours["ROS_DISTRO"] = self.distribution
        theirs = environment | {"CYCLONEDDS_URI": (
            '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="lo" '
            'multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>'
            "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30"
            '</MaxAutoParticipantIndex><Peers><Peer address="localhost"/></Peers>'
            f"<Tag>{tag}</Tag></Discovery></Domain></CycloneDDS>")}
        self.peer = Peer(theirs)
        self.app = Process([options.app, *self.arguments], ours)

    def tearDown(self):
        self.assertEqual(self.app.end(), 0)
        self.assertEqual(self.peer.end(), 0)

    def tell(self, line):
        self.app.tell(line)
        self.app.wait_for(lambda answer: answer == "done " + line)


class Endpoints(OnTheWire):
    def test_the_participant_is_one_of_ros_2(self):
        self.tell("node talker /lab")
        self.assertEqual(self.peer.wait_for_json(seen="participant")["user_data"], "enclave=/;")

    def test_endpoints_have_the_names_and_qos_of_ros_2(self):
        self.tell("node talker /lab")
        self.tell("publisher chatter")
        self.tell("subscription /heard")
        expected = {"type": STRING, "reliable": 1, "max_blocking": 100_000_000, "durability": 0,
                    "keep_all": 0, "depth": 10, "user_data": ""}
        writer = self.peer.wait_for_json(seen="pub", topic="rt/lab/chatter")
        self.assertEqual(writer | expected | {"autodispose": 0}, writer)
        reader = self.peer.wait_for_json(seen="sub", topic="rt/heard")
        self.assertEqual(reader | expected, reader)
        # Both sides speak plain CDR and nothing else.
        for endpoint in (writer, reader):
            self.assertEqual(endpoint.get("representations", 1), 1)
            self.assertEqual(endpoint.get("representation", 0), 0)

    def test_transient_local_history_is_as_deep_as_the_queue(self):
        self.tell("node talker /lab")
        self.tell("latched map")
        writer = self.peer.wait_for_json(seen="pub", topic="rt/lab/map")
        expected = {"type": "std_msgs::msg::dds_::Header_", "reliable": 0, "durability": 1,
                    "service_cleanup": 0, "service_keep_all": 0, "service_depth": 3,
                    "service_limit": -1, "autodispose": 0}
        self.assertEqual(writer | expected, writer)

    def test_deadline_lifespan_and_liveliness_are_offered_and_asked_for(self):
        self.tell("node talker /lab")
        self.tell("offering chatter")
        self.tell("asking heard")
        expected = {"deadline": 250_000_000, "manual_by_topic": 1, "lease": 1_500_000_000}
        writer = self.peer.wait_for_json(seen="pub", topic="rt/lab/chatter")
        self.assertEqual(writer | expected | {"lifespan": 4_000_000_000}, writer)
        reader = self.peer.wait_for_json(seen="sub", topic="rt/lab/heard")
        self.assertEqual(reader | expected, reader)
        # Who asks for that much is connected.
        self.peer.make("sub", "rt/lab/chatter", STRING, "volatile,deadline=250000000,lease=1500000000,manual")
        self.app.tell("say hello")
        self.assertEqual(self.peer.next_sample("rt/lab/chatter")[4:], cdr_string("hello")[4:] + bytes(2))

    def test_a_subscription_is_told_what_becomes_of_its_publishers(self):
        self.tell("node listener /lab")
        self.tell("asking heard")
        self.peer.make("pub", "rt/lab/heard", STRING, "volatile,deadline=300000000,lease=1500000000,manual")
        self.app.wait_for(lambda line: line == "incompatible deadline 1 of 1")
        self.peer.make("pub", "rt/lab/heard", STRING, "volatile,deadline=250000000")
        self.app.wait_for(lambda line: line == "incompatible liveliness 1 of 2")
        self.peer.make("pub", "rt/lab/heard", STRING, "volatile,deadline=100000000,lease=1000000000,manual")
        self.app.wait_for_all({"matched 1 of 1, now 1", "alive 1, not 0"})
        self.peer.write("rt/lab/heard", cdr_string("once"))
        # Nothing comes for longer than the deadline, then for longer than the lease.
        self.app.wait_for_all({"heard once", "missed 1 of 1", "alive 0, not 1"})
        self.peer.write("rt/lab/heard", cdr_string("zero\0inside"))
        self.app.wait_for_all({"lost 1 of 1", "alive 1, not 0"})

    def test_strings_are_plain_cdr_both_ways(self):
        self.tell("node talker /lab")
        self.tell("publisher chatter")
        self.tell("subscription heard")
        self.peer.make("sub", "rt/lab/chatter", STRING)
        self.peer.make("pub", "rt/lab/heard", STRING)
        for verb, text in (("say", "hello"), ("shout", "hello"), ("say", "abc"), ("shout", "")):
            self.app.tell(f"{verb} {text}")
            octets = self.peer.next_sample("rt/lab/chatter")
            expected = cdr_string(text)
            padding = -len(expected) % 4
            self.assertEqual(octets, expected[:3] + bytes([padding]) + expected[4:] + bytes(padding))
        for encoding in (LITTLE, BIG):
            for text in ("from_a_peer", "x"):
                self.peer.write("rt/lab/heard", cdr_string(text, encoding))
                self.app.wait_for(lambda line: line == "heard " + text)
        # What is no string is dropped, and the next one arrives.
        self.peer.write("rt/lab/heard", LITTLE + bytes([255, 0, 0, 0, 65, 66, 67, 68]))
        self.peer.write("rt/lab/heard", cdr_string("good"))
        self.app.wait_for(lambda line: line.startswith("heard ") and line == "heard good")

    def test_a_service_answers_a_client_of_ros_2(self):
        self.tell("node adder /lab")
        self.tell("service add")
        for topic, type_name, kind in (("rq/lab/addRequest", REQUEST, "sub"),
                                       ("rr/lab/addReply", RESPONSE, "pub")):
            endpoint = self.peer.wait_for_json(seen=kind, topic=topic)
            expected = {"type": type_name, "reliable": 1, "durability": 0, "depth": 10}
            self.assertEqual(endpoint | expected, endpoint)
            self.assertRegex(endpoint["user_data"], r"^serviceid=([0-9a-f]+\.){15}[0-9a-f]+;$")
        # A client's number is its writer's instance handle, and not its identity.
        self.peer.make("sub", "rr/lab/addReply", RESPONSE, user_data=CLIENT)
        self.peer.make("pub", "rq/lab/addRequest", REQUEST, user_data=CLIENT)
        guid, seq = 0x0123456789ABCDEF, 77
        self.peer.write("rq/lab/addRequest", LITTLE + struct.pack("<Qqqq", guid, seq, 40, 2))
        self.assertEqual(self.peer.next_sample("rr/lab/addReply"),
                         LITTLE + struct.pack("<Qqq", guid, seq, 42))

    def test_the_first_response_to_a_client_of_ros_2_is_not_held_back(self):
        self.tell("node adder /lab")
        self.tell("service add")
        self.peer.make("sub", "rr/lab/addReply", RESPONSE, user_data=CLIENT)
        self.peer.wait_for_json(seen="pub", topic="rr/lab/addReply")
        waits = [BOUND]
        for seq in range(12):  # so many clients, as far as the service can tell; a busy machine delays
            # Half a second is what it waits for a reader that does not come.
            if min(waits) < 0.45:
                break
            self.peer.make("pub", "rq/lab/addRequest", REQUEST, user_data=CLIENT)
            time.sleep(0.3)  # both sides have discovered each other
            begin = time.monotonic()
            self.peer.write("rq/lab/addRequest", LITTLE + struct.pack("<Qqqq", 5, seq, 1, 1))
            self.peer.next_sample("rr/lab/addReply")
            waits.append(time.monotonic() - begin)
        self.assertLess(min(waits), 0.45)

    def test_a_client_calls_a_service_of_ros_2(self):
        self.tell("node caller /lab")
        self.tell("client add")
        identities = set()
        for topic, type_name, kind in (("rq/lab/addRequest", REQUEST, "pub"),
                                       ("rr/lab/addReply", RESPONSE, "sub")):
            endpoint = self.peer.wait_for_json(seen=kind, topic=topic)
            self.assertEqual(endpoint["type"], type_name)
            self.assertRegex(endpoint["user_data"], r"^clientid=([0-9a-f]+\.){15}[0-9a-f]+;$")
            identities.add(endpoint["user_data"])
        self.assertEqual(len(identities), 1)
        self.peer.make("sub", "rq/lab/addRequest", REQUEST, user_data="serviceid=1.2;")
        self.peer.make("pub", "rr/lab/addReply", RESPONSE, user_data="serviceid=1.2;")
        numbers = set()
        for a, b in ((40, 2), (-5, 3)):
            self.app.tell(f"call {a} {b}")
            octets = self.peer.next_sample("rq/lab/addRequest")
            self.assertEqual(octets[:4], LITTLE)
            guid, seq, got_a, got_b = struct.unpack("<Qqqq", octets[4:])
            self.assertEqual((got_a, got_b), (a, b))
            numbers.add((guid, seq))
            # Somebody else's response comes first, and is not taken for ours.
            self.peer.write("rr/lab/addReply", LITTLE + struct.pack("<Qqq", guid ^ 1, seq, 0))
            self.peer.write("rr/lab/addReply", LITTLE + struct.pack("<Qqq", guid, seq, a + b))
            self.app.wait_for(lambda line: line == f"sum {a + b}")
        self.assertEqual(len(numbers), 2)

    def test_parameters_are_asked_for_as_in_ros_2(self):
        self.tell("node talker /lab")
        self.tell("parameter gain 5")
        kinds = "rcl_interfaces::srv::dds_::GetParameters_"
        requests, replies = (f"{prefix}/lab/talker/get_parameters{suffix}"
                             for prefix, suffix in (("rq", "Request"), ("rr", "Reply")))
        self.assertEqual(self.peer.wait_for_json(seen="sub", topic=requests)["type"],
                         kinds + "Request_")
        self.peer.make("sub", replies, kinds + "Response_", user_data=CLIENT)
        self.peer.make("pub", requests, kinds + "Request_", user_data=CLIENT)
        self.peer.write(requests, LITTLE + struct.pack("<Qqi", 9, 1, 1) + cdr_string("gain")[4:])
        answer = Decoder(self.peer.next_sample(replies))
        self.assertEqual((answer.number(8), answer.number(8), answer.number()), (9, 1, 1))
        # A ParameterValue: type 2 is an integer, and only that member is set.
        self.assertEqual((answer.number(1), answer.number(1), answer.number(8), answer.number(8)),
                         (2, 0, 5, 0))
        self.assertEqual((answer.text(), [answer.number() for _ in range(5)]), ("", [0] * 5))
        answer.end()
        # Beside a name that is not declared nothing is told: an empty sequence, as rclcpp answers.
        names = Encoder().number(2).text("gain").text("no").octets
        self.peer.write(requests, LITTLE + struct.pack("<Qq", 9, 2) + names)
        answer = Decoder(self.peer.next_sample(replies))
        self.assertEqual((answer.number(8), answer.number(8), answer.number()), (9, 2, 0))
        answer.end()


class Texts(OnTheWire):
    def test_a_string_that_c_would_cut_is_no_message_and_is_told_once(self):
        self.tell("node talker /lab")
        self.tell("subscription heard")
        self.peer.make("pub", "rt/lab/heard", STRING)
        for text, encoding in (("one\0two", LITTLE), ("\0", BIG), ("whole", LITTLE)):
            self.peer.write("rt/lab/heard", cdr_string(text, encoding))
        lines = []
        while "heard whole" not in lines:
            lines.append(self.app.wait_for(lambda line: True))
        self.assertEqual(lines, [
            'warning a message on "/lab/heard" has a text with a zero inside, where texts of ours end: '
            "it is lost, and so are others like it", "heard whole"])


class TextsThatCycloneSerialises(Texts):
    arguments = ("serialized",)


class Graph(OnTheWire):
    def endpoint(self, kind, topic):
        return self.peer.wait_for_json(seen=kind, topic=topic)["guid"]

    def wait_for_nodes(self, expected):
        """Until ros_discovery_info says so; what it says before must be well formed, too."""
        gid_size = 16 if self.distribution else 24
        end = time.monotonic() + BOUND
        while time.monotonic() < end:
            participant, nodes = discovery_info(self.peer.next_sample("ros_discovery_info"),
                                                gid_size)
            self.assertEqual(participant, self.peer.wait_for_json(seen="participant")["guid"])
            if nodes == expected:
                return
        raise AssertionError(f"never came: {expected}")

    def test_the_graph_is_told_of_every_node_and_endpoint(self):
        self.tell("node talker /lab")
        info = self.peer.wait_for_json(seen="pub", topic="ros_discovery_info")
        expected = {"type": "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", "reliable": 1,
                    "durability": 1, "keep_all": 0, "depth": 1, "service_depth": 1,
                    "autodispose": 0}
        self.assertEqual(info | expected, info)
        # A late reader gets the latest state.
        self.peer.make("sub", "ros_discovery_info", info["type"], "transient_local")
        talker = ("/lab", "talker")
        self.wait_for_nodes({talker: ([], [])})
        self.tell("publisher chatter")
        chatter = self.endpoint("pub", "rt/lab/chatter")
        self.wait_for_nodes({talker: ([], [chatter])})
        self.tell("subscription heard")
        heard = self.endpoint("sub", "rt/lab/heard")
        self.wait_for_nodes({talker: ([heard], [chatter])})
        self.tell("service add")
        requests = self.endpoint("sub", "rq/lab/addRequest")
        replies = self.endpoint("pub", "rr/lab/addReply")
        self.wait_for_nodes({talker: ([heard, requests], [chatter, replies])})
        self.tell("client sum")
        own_replies = self.endpoint("sub", "rr/lab/sumReply")
        own_requests = self.endpoint("pub", "rq/lab/sumRequest")
        self.wait_for_nodes({talker: ([heard, requests, own_replies],
                                      [chatter, replies, own_requests])})
        self.tell("drop publisher")
        self.wait_for_nodes({talker: ([heard, requests, own_replies], [replies, own_requests])})
        self.peer.wait_for_json(gone="pub", guid=chatter)
        self.tell("drop node")
        self.wait_for_nodes({})
        self.tell("node other /")
        self.wait_for_nodes({("/", "other"): ([], [])})


class GraphOfIron(Graph):
    """Endpoints have shorter identities in the graph from Iron on; nothing else is different."""

    distribution = "jazzy"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--app", type=Path, required=True)
    parser.add_argument("--peer", type=Path, required=True)
    global options
    options, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)


if __name__ == "__main__":
    main()
