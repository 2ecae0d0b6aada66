#!/usr/bin/env python3
"""The Chrome JSON, read by Perfetto's trace_processor. Arguments: CIE MAKE_EXPORT EXAMPLES."""
import json
import os
import sys
import unittest  # noqa: F401

from viewer_case import BEGIN, FLOWS, INSTANCES, NAMES, ViewerCase, main, truth_of

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "perfetto"))
import trace_processor  # noqa: E402

QUERIES = {
    "alarms": "select name, value from stats where value != 0 and severity != 'info'",
    "slices": "select s.name, t.tid, s.ts, s.ts + s.dur, s.dur from slice s join thread_track tt on s.track_id = tt.id"
              " join thread t using(utid) where s.category = 'callback' order by s.ts, t.tid",
    "overlapping": "select name, ts, ts + dur from slice where category = 'overlapping' order by ts",
    "waits": "select name, ts, ts + dur from slice where category = 'wait' order by ts, name",
    "publications": "select ts from slice where category = 'publish' order by ts",
    "nested": "select count(*) from slice s join slice p on s.parent_id = p.id where s.category = 'publish'"
              " and p.category = 'callback'",
    "flows": "select o.ts, o.category, i.ts, i.name from flow f join slice o on f.slice_out = o.id"
             " join slice i on f.slice_in = i.id order by 1, 3",
    "response": "select sum(extract_arg(arg_set_id, 'args.response_time_ns')) from slice where category = 'callback'",
    "threads": "select p.pid, t.tid, t.name from thread t join process p using(upid) where t.name is not null",
}


class Chrome(ViewerCase):
    format = "chrome"

    def test_an_application_of_which_everything_is_known(self):
        path, counts = self.made()
        answer = trace_processor.query(path, QUERIES)
        self.assertEqual(answer["alarms"], [])
        # What never ended is drawn without an end; what overlaps is not on the thread's own track.
        self.assertEqual([(name, tid, start + BEGIN, None if duration == -1 else end + BEGIN)
                          for name, tid, start, end, duration in answer["slices"]],
                         [instance[:4] for instance in INSTANCES if not instance[4]])
        self.assertEqual([(name, start + BEGIN, end + BEGIN) for name, start, end in answer["overlapping"]],
                         [(name, start, end) for name, _, start, end, overlaps in INSTANCES if overlaps])
        self.assertEqual([time + BEGIN for time, in answer["publications"]], [1400, 2100, 5000])
        self.assertEqual([(out + BEGIN, into + BEGIN, name) for out, _, into, name in answer["flows"]], FLOWS)
        self.assertEqual({category for _, category, *_ in answer["flows"]}, {"publish"})
        self.assertEqual(len(answer["waits"]), 9)
        self.assertEqual((counts["instances"], counts["flows"], counts["publications"]), (10, 3, 3))

    def test_the_examples_agree_with_the_analyzer(self):
        for name in NAMES:
            truth = truth_of(name)
            path = self.exported(name)
            with open(path, encoding="utf-8") as file:
                begin = int(json.load(file)["otherData"]["begin_monotonic_ns"])
            self.assertEqual(begin, min(int(row[key]) for row in truth.instances for key in ("release_ns", "start_ns")))
            answer = trace_processor.query(path, QUERIES)
            self.assertEqual(answer["alarms"], [])
            self.assertEqual([(callback, str(tid), str(start + begin), str(end + begin))
                              for callback, tid, start, end, _ in answer["slices"]],
                             [tuple(row[key] for key in ("logical_id", "tid", "start_ns", "end_ns"))
                              for row in truth.instances])
            self.assertEqual(len(answer["waits"]), len(truth.waits))
            self.assertEqual(len(answer["flows"]), truth.flows)
            self.assertEqual(len(answer["publications"]), truth.publications)
            self.assertEqual(answer["nested"], [[truth.publications]])
            self.assertEqual(answer["response"], [[sum(int(row["end_ns"]) - int(row["release_ns"])
                                                       for row in truth.instances if row["release_source"] == "exact")]])


if __name__ == "__main__":
    main(Chrome, trace_processor.assets)
