#!/usr/bin/env python3
"""The OTLP JSON lines, read with OpenTelemetry's message types. Arguments: CIE MAKE_EXPORT EXAMPLES."""
import json
import re
import unittest  # noqa: F401

from viewer_case import FLOWS, INSTANCES, NAMES, OFFSET, NodeReaderCase, main, truth_of  # isort: skip

# protobufjs's minimal build is one file without dependencies, under the name it is asked for.
TRANSFORMER = ("@opentelemetry/otlp-transformer@0.57.2",
               "d6e997a096e4c2edf27244b92acbcd99371d88660799c7212ea11c1324521c00",
               {"package/build/src/generated/root.js": "build/src/generated/root.js"})
PROTOBUF = ("protobufjs@7.4.0", "6a459db68c1b79f3d33f07c93729d5f206135a19e8ec5854efba59ea1c2b8519",
            {"package/dist/minimal/protobuf.js": "minimal.js"})
# Without it protobufjs rounds 64-bit integers.
LONG = ("long@5.2.3", "906bdaa4c78baa54881946559aace8eaec9639761e611832bd62e258da9c8c4a",
        {"package/umd/index.js": "index.js"})
PACKAGES = [TRANSFORMER, PROTOBUF, LONG]
INTERNAL, PRODUCER, CONSUMER = 1, 4, 5


def attributes_of(span):
    return {one["key"]: next(iter(one["value"].values())) for one in span["attributes"]}


class Otlp(NodeReaderCase):
    format = "otlp"
    packages = PACKAGES
    reader = "read_otlp.cjs"

    def read(self, path):
        """All spans, in order of start; what holds for every file is checked."""
        lines = self.read_by_node(path)["lines"]
        spans = []
        for line in lines:
            for resource in line["resourceSpans"]:
                process = attributes_of(resource["resource"])
                self.assertEqual(set(process), {"service.name", "process.pid", "host.name", "cie.clock"})
                for scope in resource["scopeSpans"]:
                    self.assertEqual(scope["scope"]["name"], "cie")
                    self.assertLessEqual(len(scope["spans"]), 512)
                    spans += [{**span, "process": process} for span in scope["spans"]]
        by_id = {span["spanId"]: span for span in spans}
        self.assertEqual(len(by_id), len(spans), "every span has an id of its own")
        for span in spans:
            self.assertRegex(span["traceId"], "^[0-9a-f]{32}$")
            self.assertRegex(span["spanId"], "^[0-9a-f]{16}$")
            parent = by_id.get(span.get("parentSpanId"))
            if parent:
                self.assertEqual(span["traceId"], parent["traceId"])
            for link in span.get("links", []):
                self.assertEqual(link, {"traceId": span["traceId"], "spanId": span["parentSpanId"]})
        spans.sort(key=lambda span: (int(span["startTimeUnixNano"]), span["kind"] == PRODUCER))
        return spans, by_id

    def test_an_application_of_which_everything_is_known(self):
        path, counts = self.made()
        spans, by_id = self.read(path)
        callbacks = [span for span in spans if span["kind"] != PRODUCER]
        self.assertEqual([(s["name"], int(attributes_of(s)["thread.id"]), int(s["startTimeUnixNano"]) - OFFSET,
                           int(s["endTimeUnixNano"]) - OFFSET) for s in callbacks],
                         [instance[:4] for instance in INSTANCES if instance[3] is not None])
        self.assertEqual(counts["unfinished"], 1)
        publications = {int(span["startTimeUnixNano"]) - OFFSET: span for span in spans if span["kind"] == PRODUCER}
        self.assertEqual(sorted(publications), [1400, 2100, 5000])
        # The first two lie inside the timer's instances, the last one outside of all.
        starts = {int(span["startTimeUnixNano"]) - OFFSET: span for span in callbacks}
        self.assertEqual(publications[1400]["parentSpanId"], starts[1100]["spanId"])
        self.assertEqual(publications[2100]["parentSpanId"], starts[2100]["spanId"])
        self.assertNotIn("parentSpanId", publications[5000])
        for published, start, name in FLOWS:
            receiver = starts[start]
            self.assertEqual((receiver["name"], receiver["kind"]), (name, CONSUMER))
            self.assertEqual(receiver["parentSpanId"], publications[published]["spanId"])
            self.assertEqual([link["spanId"] for link in receiver["links"]], [publications[published]["spanId"]])
            self.assertEqual(attributes_of(receiver)["messaging.destination.name"], "/points")
        # Two chains, and what belongs to none: taken before it was published, or from an unseen one.
        self.assertEqual(starts[1100]["traceId"], starts[1600]["traceId"])
        self.assertNotEqual(starts[1100]["traceId"], starts[2100]["traceId"])
        self.assertEqual([(starts[time]["kind"], "parentSpanId" in starts[time]) for time in (3100, 3350, 3000)],
                         [(CONSUMER, False), (CONSUMER, False), (INTERNAL, False)])
        self.assertEqual(attributes_of(publications[1400])["cie.writer_gid"], str(0xfedcba9876543210))
        self.assertEqual(len(by_id), counts["instances"] + counts["publications"])

    def test_ids_are_the_same_each_time(self):
        once = self.exported(NAMES[0])
        with open(once, "rb") as file:
            text = file.read()
        self.assertGreater(len(set(re.findall(rb'"spanId":"([^"]*)"', text))), 20)
        with open(self.exported(NAMES[0]), "rb") as file:
            self.assertEqual(file.read(), text)

    def test_the_examples(self):
        for name in NAMES:
            truth = truth_of(name)
            spans, by_id = self.read(self.exported(name))
            callbacks = [span for span in spans if span["kind"] != PRODUCER]
            publications = [span for span in spans if span["kind"] == PRODUCER]
            self.assertEqual(sorted((s["name"], attributes_of(s)["cie.seq"],
                                     str(int(s["endTimeUnixNano"]) - int(s["startTimeUnixNano"]))) for s in callbacks),
                             sorted((row["logical_id"], row["seq"], str(int(row["end_ns"]) - int(row["start_ns"])))
                                    for row in truth.instances))
            self.assertEqual(len(publications), truth.publications)
            self.assertTrue(all(by_id[span["parentSpanId"]] in callbacks for span in publications))
            self.assertEqual(sum(len(span.get("links", [])) for span in callbacks), truth.flows)
            for span in callbacks:
                if "parentSpanId" in span:
                    self.assertEqual(by_id[span["parentSpanId"]]["kind"], PRODUCER)
                    self.assertLessEqual(int(by_id[span["parentSpanId"]]["startTimeUnixNano"]),
                                         int(span["startTimeUnixNano"]))


if __name__ == "__main__":
    main(Otlp, Otlp.requirement)
