#!/usr/bin/env python3
"""What "+1.500 s" counts from: the begin of the recording, also where a window of it is looked at. Arguments: CIE EXAMPLES."""
import csv
import io
import json
import os
import re
import sys
import unittest

from program import EXAMPLES, TRACE, cie

SHARED = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
WINDOW = "--window=+50ms..-20ms"
UNITS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


def begin_of(trace):
    return json.loads(cie("report", trace, "-f", "json").stdout)["trace"]["begin_ns"]


class Times(unittest.TestCase):
    def assert_is(self, shown, unit, time_ns):
        self.assertAlmostEqual(float(shown) * UNITS[unit] / time_ns, 1, delta=0.001)

    def test_of_the_worst_run(self):
        begin = begin_of(TRACE)
        rows = list(csv.DictReader(io.StringIO(cie("instances", TRACE).stdout.decode())))
        for options, said in (((), ""), ((WINDOW,), " of the recording")):
            text = " ".join(cie("report", TRACE, "--ids", *options).stdout.decode().split())
            name, seq, shown, unit = re.search(rf"worst: (\S+), instance (\d+) at \+(\S+) (\w+){said} took ", text).groups()
            run, = [row for row in rows if (row["logical_id"], row["seq"]) == (name, seq)]
            self.assert_is(shown, unit, int(run["start_ns"]) - begin)

    def test_of_evidence(self):
        begin = begin_of(SHARED)
        for options in ((), (WINDOW,)):
            text = cie("verify", SHARED, "--all", *options).stdout.decode()
            found = re.findall(r"at (\d+) ns \((\S+) (\w+) into the trace\)", text)
            self.assertGreater(len(found), 10)
            for time, shown, unit in found:
                if int(time) > begin:
                    self.assert_is(shown, unit, int(time) - begin)

    def test_of_the_page(self):
        for options in ((), (WINDOW,)):
            page = cie("report", TRACE, "-f", "html", *options).stdout.decode()
            document = json.loads(re.search(r'<script type="application/json" id="document">(.*?)</script>', page, re.S)[1])
            self.assertEqual(document["timeline"]["begin_ns"], begin_of(TRACE))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
