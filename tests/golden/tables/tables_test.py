#!/usr/bin/env python3
"""The same rows and the same answers from every format of every table. Arguments: CIE MAKE_TABLE EXAMPLES."""
import collections
import csv
import io
import json
import os
import sqlite3
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "browser"), str(TESTS / "support")]
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position
import npm_package  # noqa: E402  pylint: disable=wrong-import-position

cie = Cie(sys.argv[1])
MAKE_TABLE = os.path.abspath(sys.argv[2])
EXAMPLES = Path(sys.argv[3]).resolve()
TRACES = [EXAMPLES / name / "trace" for name in ("isolated_ok", "multi_threaded_fails")]
TABLES = ("instances", "callbacks", "callback_threads", "threads", "processes", "edges", "chains", "chain_hops",
          "verdicts", "losses")
HYPARQUET = ("hyparquet@1.25.6", "4171b8ee64710c846be9d5dddfbaf210980b4bdb176c6d2478926b8b6f1667f7",
             {f"package/src/{name}.js": f"src/{name}.js" for name in (
                 "assemble", "column", "constants", "convert", "datapage", "delta", "encoding", "filter", "geoparquet",
                 "index", "indexes", "metadata", "node", "plain", "plan", "query", "read", "rowgroup", "schema", "snappy",
                 "thrift", "utils", "variant", "wkb")} | {"package/package.json": "package.json"})
READ_PARQUET = Path(__file__).with_name("read_parquet.mjs")


def text_of(value):
    """As CSV has it, so that all formats can be compared."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):  # an integer of 64 bits, from Parquet
        return value["integer"]
    return str(value)


class Tables(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)

    def rows(self, trace, table):
        reader = csv.reader(io.StringIO(cie.text("export", trace, "--to", "csv", "--table", table)))
        return next(reader), list(reader)

    def database(self, trace):
        path = self.folder / "run.db"
        cie.text("export", trace, "--to", "sqlite", "-o", path)
        return sqlite3.connect(path)

    def parquet(self, path):
        try:
            library = npm_package.assets(*HYPARQUET)
        except npm_package.Unavailable as reason:
            self.skipTest(f"not possible here: {reason}")
        done = subprocess.run(["node", READ_PARQUET, library, path], stdout=subprocess.PIPE, check=True, timeout=200)
        return json.loads(done.stdout)

    def same(self, columns, expected, rows, table):
        """Numbers are compared as numbers: 1.5 may be written in several ways."""
        self.assertEqual(len(rows), len(expected), table)
        for row, other in zip(rows, expected):
            for name, value, wanted in zip(columns, row, other):
                if isinstance(value, float):
                    self.assertEqual(value, float(wanted), (table, name))
                elif isinstance(value, int) and wanted in ("true", "false"):  # SQLite has no booleans
                    self.assertEqual(bool(value), wanted == "true", (table, name))
                else:
                    self.assertEqual(text_of(value), wanted, (table, name))

    def test_there_are_no_others(self):
        self.assertEqual({name for (name,) in self.database(TRACES[0]).execute("SELECT name FROM sqlite_master")},
                         set(TABLES))
        message = cie.refusal("export", TRACES[0], "--to", "csv", "--table", "callback", code=2)
        self.assertIn('--table does not know "callback"', message)
        self.assertIn("callbacks", message)

    def test_json_lines_have_the_rows_of_csv(self):
        for trace in TRACES:
            for table in TABLES:
                columns, expected = self.rows(trace, table)
                lines = [json.loads(line) for line in cie.text("export", trace, "--to", "jsonl", "--table", table).splitlines()]
                for line in lines:
                    self.assertEqual(list(line), columns)
                self.same(columns, expected, [list(line.values()) for line in lines], table)

    def test_sqlite_has_the_rows_of_csv(self):
        for trace in TRACES:
            database = self.database(trace)
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))
            for table in TABLES:
                columns, expected = self.rows(trace, table)
                found = database.execute(f"SELECT * FROM {table}")
                self.assertEqual([column[0] for column in found.description], columns)
                self.same(columns, expected, [list(row) for row in found], table)

    def test_parquet_has_the_rows_of_csv(self):
        for trace in TRACES:
            for table in TABLES:
                columns, expected = self.rows(trace, table)
                path = self.folder / "table.parquet"
                cie.text("export", trace, "--to", "parquet", "--table", table, "-o", path)
                found = self.parquet(path)
                self.assertEqual([name for name, _ in found["columns"]], columns)
                self.same(columns, expected, [[row[name] for name in columns] for row in found["rows"]], table)

    def test_parquet_of_several_row_groups_and_every_type(self):
        count = 250_001
        path = self.folder / "many.parquet"
        subprocess.run([MAKE_TABLE, str(count), path], check=True, timeout=200)
        found = self.parquet(path)
        self.assertEqual(found["groups"], 3)
        self.assertEqual(len(found["rows"]), count)
        for i, row in enumerate(found["rows"]):
            wanted = {"integer": None if i % 7 == 0 else {"integer": str(-i * 1_000_000_007)},
                      "real": None if i % 5 == 0 else i / 2, "boolean": None if i % 11 == 0 else i % 3 == 0,
                      "text": None if i % 13 == 0 else f"caf\u00e9 \ufffd {i}", "nothing": None}
            self.assertEqual(row, wanted)

    def test_sql_gives_the_reports_numbers(self):
        for trace in TRACES:
            report = cie.json("report", trace)
            database = self.database(trace)
            counted = dict(database.execute("""SELECT c.logical_id || c.pid, count(*) FROM instances i
                JOIN callbacks c ON c.callback_index = i.callback_index
                WHERE i.end_ns IS NOT NULL GROUP BY 1""").fetchall())
            for callback in report["callbacks"]:
                self.assertGreaterEqual(counted.get(callback["logical_id"] + str(callback["pid"]), 0), callback["instances"])
            shared = database.execute("""SELECT count(DISTINCT logical_id || '/' || pid) FROM callback_threads WHERE
                thread_index IN (SELECT thread_index FROM callback_threads GROUP BY 1 HAVING count(*) > 1) OR
                callback_index IN (SELECT callback_index FROM callback_threads GROUP BY 1 HAVING count(*) > 1)""").fetchone()[0]
            self.assertEqual(shared, sum(not callback["isolated"] and callback["instances"] > 0 for callback in report["callbacks"]))
            worst = database.execute("SELECT max(response_time_ns_max) FROM callbacks").fetchone()[0]
            self.assertEqual(worst, max(c["response_time_ns"]["max"] for c in report["callbacks"] if c["response_time_ns"]))

    def test_an_index_is_that_of_one_row_of_the_report(self):
        """Rows are joined by index: it names the same callback, thread and process in every table."""
        for trace in TRACES:
            database = self.database(trace)
            report = cie.json("report", trace)
            callbacks = {c["index"]: (c["logical_id"], c["pid"]) for c in report["callbacks"]}
            threads = {t["index"]: (t["pid"], t["tid"]) for t in report["threads"]}

            def told(columns, table, database=database):
                return [tuple(row) for row in database.execute(f"SELECT DISTINCT {columns} FROM {table}")]

            self.assertEqual({i: (name, pid) for i, name, pid in told("callback_index, logical_id, pid", "callbacks")}, callbacks)
            self.assertEqual({i: (pid, tid) for i, pid, tid in told("thread_index, pid, tid", "threads")}, threads)
            for table in ("instances", "callback_threads"):
                for index, name, pid in told("callback_index, logical_id, pid", table):
                    self.assertEqual(callbacks[index], (name, pid), table)
            for index, pid, tid in told("thread_index, pid, tid", "callback_threads"):
                self.assertEqual(threads[index], (pid, tid))
            for index, name, pid in told("to_callback_index, to_logical_id, to_pid", "edges"):
                self.assertEqual(callbacks[index], (name, pid))
            for index, subject in told("subject_index, subject", "verdicts WHERE subject_kind = 'callback' AND subject_index IS NOT NULL"):
                self.assertIn(callbacks[index][0], subject)

    def test_nearest_rank_percentiles_are_those_of_sql(self):
        """The response at place ⌈p·n⌉, within the histogram's stated error."""
        database = self.database(TRACES[0])
        for logical_id, pid, p50, p99 in database.execute(
                "SELECT logical_id, pid, response_time_ns_p50, response_time_ns_p99 FROM callbacks"):
            responses = [row[0] for row in database.execute(
                """SELECT end_ns - release_ns FROM instances WHERE logical_id = ? AND pid = ? AND release_source = 'exact'
                   AND end_ns IS NOT NULL ORDER BY 1""", (logical_id, pid))]
            if p50 is None:
                continue
            for told, percent in ((p50, 50), (p99, 99)):
                exact = responses[-(-percent * len(responses) // 100) - 1]
                self.assertAlmostEqual(told, exact, delta=0.008 * exact, msg="the stated error is 0.8 %")

    def test_verdicts_are_the_verifiers(self):
        for trace, code in zip(TRACES, (0, 1)):
            done = cie.run("verify", trace, "--format", "json")
            self.assertEqual(done.returncode, code)
            wanted = collections.Counter((rule["id"], subject["subject"], subject["verdict"])
                                         for rule in json.loads(done.stdout)["rules"] for subject in rule["subjects"])
            found = collections.Counter(self.database(trace).execute("SELECT rule, subject, verdict FROM verdicts").fetchall())
            self.assertEqual(found, wanted)

    def test_a_failed_export_leaves_nothing_behind(self):
        path = self.folder / "nothing" / "run.db"
        path.parent.mkdir()
        cie.refusal("export", self.folder / "no_trace", "--to", "sqlite", "-o", path, code=4)
        self.assertEqual(list(path.parent.iterdir()), [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
