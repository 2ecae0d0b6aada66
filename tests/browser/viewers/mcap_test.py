#!/usr/bin/env python3
"""The MCAP file, read by @mcap/core. Arguments: CIE MAKE_EXPORT EXAMPLES."""
import json
import unittest  # noqa: F401

import jsonschema

from viewer_case import FLOWS, INSTANCES, NAMES, OFFSET, NodeReaderCase, main, truth_of  # isort: skip

PACKAGES = [("@mcap/core@2.2.2", "06807e4d853b40b90eafce720e939c2c9b0fbb266a41f439b818aa8ee1e63915"),
            ("@foxglove/crc@0.0.3", "b94e1c594df3d97823d22f272f1a030b168fafc9bc3228f7419e3ba09fb42a70"),
            ("heap-js@2.7.1", "8e9630d47d08f5c91890e27e0d66e6d1d3ff5241b4d2eded453a9b01f534f0c0"),
            ("tslib@2.8.1", "66f635d5eeabae44807534976913a102cf615b9a045368359c9f79ae6ee2119e")]


class Mcap(NodeReaderCase):
    format = "mcap"
    packages = PACKAGES
    reader = "read_mcap.mjs"

    def read(self, path):
        file = self.read_by_node(path)
        schemas = {schema["id"]: json.loads(schema["data"]) for schema in file["schemas"]}
        schema_of = {channel["topic"]: schemas[channel["schema"]] for channel in file["channels"]}
        for number, message in enumerate(file["messages"]):
            message["data"] = json.loads(message["data"])
            if number < 200:  # validation takes its time
                jsonschema.validate(message["data"], {**schema_of[message["topic"]], "additionalProperties": False})
        self.assertEqual({schema["encoding"] for schema in file["schemas"]}, {"jsonschema"})
        self.assertEqual({channel["encoding"] for channel in file["channels"]}, {"json"})
        statistics = file["statistics"]
        self.assertEqual(int(statistics["messageCount"]), len(file["messages"]))
        self.assertEqual(statistics["chunkCount"], len(file["chunks"]))
        self.assertEqual(statistics["channelCount"], len(file["channels"]))
        self.assertEqual(sum(int(count) for count in statistics["channelMessageCounts"].values()), len(file["messages"]))
        times = [int(message["log"]) for message in file["messages"]]
        self.assertEqual(times, sorted(times), "the reader gives them by time")
        self.assertEqual(file["later"]["count"], sum(time >= int(file["later"]["from"]) for time in times))
        self.assertEqual((int(statistics["messageStartTime"]), int(statistics["messageEndTime"])), (min(times), max(times)))
        return file

    def test_an_application_of_which_everything_is_known(self):
        path, counts = self.made()
        file = self.read(path)
        of_callbacks = [message for message in file["messages"] if message["topic"].startswith("/callbacks")]
        self.assertEqual([(m["topic"], m["data"]["tid"], int(m["log"]), m["data"].get("end_ns")) for m in of_callbacks],
                         [("/callbacks" + name, tid, start + OFFSET, end) for name, tid, start, end, _ in INSTANCES])
        self.assertEqual([m["data"].get("response_time_ns") for m in of_callbacks],
                         [400, 1150, 1240, 300, 750, 600, 200, 700, 60, None])
        of_topics = [message for message in file["messages"] if message["topic"] == "/publications/points"]
        self.assertEqual([(m["data"]["time_ns"], m["data"]["receivers"]) for m in of_topics],
                         [(time, sum(flow[0] == time for flow in FLOWS)) for time in (1400, 2100, 5000)])
        self.assertEqual([m["data"]["writer_gid"] for m in of_topics], [str(0xfedcba9876543210)] * 3)
        self.assertEqual((counts["instances"], counts["publications"]), (10, 3))

    def test_chunks_are_bounded(self):
        times = 600
        path, counts = self.made(times)
        file = self.read(path)
        self.assertEqual(counts["instances"], times * len(INSTANCES))
        self.assertEqual(len(file["messages"]), counts["instances"] + counts["publications"])
        self.assertGreater(len(file["chunks"]), 1)
        self.assertLess(max(int(chunk["size"]) for chunk in file["chunks"]), 1.01 * 2**20)
        self.assertEqual(file["kinds"]["Chunk"], len(file["chunks"]))

    def test_the_examples(self):
        for name in NAMES:
            truth = truth_of(name)
            file = self.read(self.exported(name))
            of_callbacks = [m["data"] for m in file["messages"] if m["topic"].startswith("/callbacks")]
            self.assertEqual([tuple(str(data[key]) for key in ("logical_id", "pid", "tid", "seq", "start_ns", "end_ns"))
                              for data in of_callbacks],
                             [tuple(row[key] for key in ("logical_id", "pid", "tid", "seq", "start_ns", "end_ns"))
                              for row in truth.instances])
            of_topics = [m["data"] for m in file["messages"] if m["topic"].startswith("/publications")]
            self.assertEqual(len(of_topics), truth.publications)
            self.assertEqual(sum(data["receivers"] for data in of_topics), truth.flows)


if __name__ == "__main__":
    main(Mcap, Mcap.requirement)
