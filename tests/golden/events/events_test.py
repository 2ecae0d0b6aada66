#!/usr/bin/env python3
"""`cie events` prints what is recorded, as babeltrace2 reads it. Arguments: CIE GOLDEN."""
import collections
import csv
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from events_by_babeltrace2 import counts, differences, printed_by_babeltrace2  # noqa: E402

CIE = sys.argv[1]
GOLDEN = pathlib.Path(sys.argv[2])
TRACE = GOLDEN / "contract" / "examples" / "isolated_ok" / "trace"


def recordings():
    """Directories with a recording that babeltrace2 reads whole."""
    yield from sorted((GOLDEN / "contract" / "examples").glob("*/trace"))
    yield from sorted(path for path in (GOLDEN / "ros2" / "recordings").iterdir() if path.is_dir())
    more = os.environ.get("CIE_TRACES")
    if more:
        yield from sorted({path.parent for path in pathlib.Path(more).rglob("metadata")})


def events(*arguments):
    done = subprocess.run([CIE, "events", *map(str, arguments)], capture_output=True, timeout=600, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def lines(*arguments):
    code, out, err = events(*arguments)
    assert code == 0 and not err, err
    return out.splitlines()


@unittest.skipUnless(shutil.which("babeltrace2"), "babeltrace2 is not installed")
class BesideBabeltrace2(unittest.TestCase):
    def test_every_event_and_field(self):
        total = 0
        for trace in recordings():
            with self.subTest(str(trace)):
                found, number = differences(CIE, trace)
                self.assertEqual(found, [])
                total += number
        self.assertGreater(total, 1000)

    def test_counts(self):
        for trace in recordings():
            with self.subTest(str(trace)):
                rows = map(json.loads, lines(trace, "--count", "-f", "json"))
                self.assertEqual({row["name"]: row["events"] for row in rows}, dict(counts([trace])))

    def test_a_window_and_a_glob(self):
        times = sorted(head[0] for head, _ in printed_by_babeltrace2([TRACE]))
        begin, end = times[len(times) // 3], times[len(times) // 2]
        expected = collections.Counter(head[1] for head, _ in printed_by_babeltrace2([TRACE])
                                       if begin <= head[0] <= end and head[1].startswith("cie:callback_"))
        self.assertGreater(len(expected), 1)
        options = (TRACE, "--window", f"{begin}..{end}", "--name", "cie:callback_*", "-f", "json")
        self.assertEqual(collections.Counter(json.loads(line)["name"] for line in lines(*options)), expected)
        self.assertEqual({row["name"]: row["events"] for row in map(json.loads, lines(*options, "--count"))}, expected)


class Output(unittest.TestCase):
    def test_formats_say_the_same(self):
        objects = [json.loads(line) for line in lines(TRACE, "-f", "json")]
        rows = list(csv.DictReader(io.StringIO("\n".join(lines(TRACE, "-f", "csv")))))
        text = lines(TRACE)
        self.assertEqual(len(objects), len(rows))
        self.assertEqual(len(objects), len(text))
        for event, row, line in zip(objects, rows, text):
            for name in ("time_ns", "host", "cpu", "pid", "tid", "name"):
                self.assertEqual(row[name], "" if event[name] is None else str(event[name]))
            for name in ("context", "fields"):
                self.assertEqual(json.loads(row[name]), event[name])
            self.assertTrue(line.startswith(f"{event['time_ns']} {event['host']} {event['name']}: "), line)
            for name, value in event["fields"].items():
                if isinstance(value, int):
                    self.assertRegex(line, rf"\b{name} = ({value}\b|{value:#x}\b)")

    def test_counts_as_text(self):
        rows = [json.loads(line) for line in lines(TRACE, "--count", "-f", "json")]
        self.assertEqual(sorted(rows, key=lambda row: (-row["events"], row["name"])), rows)
        *listed, last = lines(TRACE, "--count")
        self.assertEqual([line.split() for line in listed], [[str(row["events"]), row["name"]] for row in rows])
        self.assertEqual(last.split(), [str(sum(row["events"] for row in rows)), "in", "all"])

    def test_names(self):
        self.assertEqual({line.split()[2] for line in lines(TRACE, "--name", "cie:run_*", "--name", "cie:node_init")},
                         {"cie:run_begin:", "cie:run_end:", "cie:node_init:"})
        code, out, err = events(TRACE, "--name", "cie:callbck_start")
        self.assertEqual((code, out), (2, ""))
        self.assertIn('no class of events is called "cie:callbck_start"', err)
        self.assertIn("cie:callback_start", err)

    def test_each_name_that_there_is_nothing_of_is_told(self):
        for count in ((), ("--count",)):
            code, _, err = events(TRACE, "--name", "cie:run_begin", "--name", "nothing", *count)
            self.assertEqual((code, err), (2, 'cie: --name: no class of events is called "nothing"; --count in place of --name '
                                           "lists what there is\nTry: cie events --help\n"))
        # Of a class that the metadata names nothing need have been recorded.
        nothing = (TRACE, "--window", "..+1us", "--name", "cie:run_end")
        self.assertEqual(events(*nothing), (0, "", "cie: note: 0 events of cie:run_end\n"))
        self.assertEqual(events(*nothing, "-q"), (0, "", ""))

    def test_what_is_missing_is_told(self):
        code, out, err = events(GOLDEN / "salvage" / "recording")
        self.assertEqual(code, 0)
        self.assertEqual(out.count("\n"), sum(json.loads(line)["events"] for line in events(
            GOLDEN / "salvage" / "recording", "--count", "-f", "json")[1].splitlines()))
        self.assertEqual(events(GOLDEN / "salvage" / "recording", "-q")[2], "", err)

    def test_usage(self):
        for arguments in ((), (TRACE, "-f", "xml"), (TRACE, "--window", "5..4"), (TRACE, "--window", "x")):
            self.assertEqual(events(*arguments)[0], 2, arguments)
        self.assertEqual(events("/nonexistent")[0], 4)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
