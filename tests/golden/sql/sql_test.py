#!/usr/bin/env python3
"""The questions of viewer_export/sql, asked of SQLite, DuckDB and ClickHouse: one answer, and the report's numbers.

Arguments: CIE QUESTIONS TRACE...
"""
import collections
import sys
import tempfile
import unittest
from pathlib import Path

import engines

from cie import Cie  # of tests/support, where engines looks
from other_host import on_host  # of tests/browser, where it looks, too

cie = Cie(sys.argv[1])
QUESTIONS = {file.stem: file.read_text() for file in sorted(Path(sys.argv[2]).glob("*.sql"))}
TRACES = [Path(trace).resolve() for trace in sys.argv[3:]]
TABLES = ("instances", "callbacks", "callback_threads", "threads", "processes", "edges", "chains", "chain_hops",
          "verdicts", "losses")


class Recording:
    """A trace, its report, and its tables in one engine after the other."""

    def __init__(self, trace: Path, folder: Path):
        self.folder = folder
        self.report = cie.json("report", trace)
        cie.text("export", trace, "--to", "sqlite", "-o", folder / "run.db")
        for table in TABLES:
            for form in ("parquet", "csv", "jsonl"):
                cie.text("export", trace, "--to", form, "--table", table, "-o", folder / f"{table}.{form}")
        self.sqlite = engines.Sqlite(folder / "run.db")
        self.columns = {table: {name: kind for _, name, kind, *_ in self.sqlite.ask(f"PRAGMA table_info({table})")}
                        for table in TABLES}
        self.callbacks = {(c["logical_id"], c["pid"]): c for c in self.report["callbacks"]}

    def sources(self, kind):
        """{form: {table: what reads it}} of an engine."""
        if kind is engines.ClickHouse:
            kinds = {"INTEGER": "Int64", "BOOLEAN": "Bool", "REAL": "Float64", "TEXT": "String"}
            structures = {table: ", ".join(f"`{name}` Nullable({kinds[kind]})" for name, kind in self.columns[table].items())
                          for table in TABLES}
            return {"parquet": {table: f"file('{table}.parquet')" for table in TABLES},
                    "jsonl": {table: f"file('{table}.jsonl', JSONEachRow, '{structures[table]}')" for table in TABLES}}
        kinds = {"INTEGER": "BIGINT", "BOOLEAN": "BOOLEAN", "REAL": "DOUBLE", "TEXT": "VARCHAR"}
        return {"parquet": {table: f"read_parquet('{self.folder}/{table}.parquet')" for table in TABLES},
                "csv": {table: f"read_csv('{self.folder}/{table}.csv', header=true, allow_quoted_nulls=false, columns="
                               f"{dict((name, kinds[kind]) for name, kind in self.columns[table].items())})"
                        for table in TABLES}}


class Sql(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.recordings = []
        for number, trace in enumerate(TRACES):
            (cls.folder / str(number)).mkdir()
            recording = Recording(trace, cls.folder / str(number))
            cls.addClassCleanup(recording.sqlite.close)
            cls.recordings.append(recording)

    def answers_as_sqlite_does(self, kind):
        for recording in self.recordings:
            for form, sources in recording.sources(kind).items():
                try:
                    engine = kind(recording.folder)
                except engines.Unavailable as reason:
                    self.skipTest(f"not possible here: {reason}")
                try:
                    for table, source in sources.items():
                        engine.ask(f"CREATE VIEW {table} AS SELECT * FROM {source}")
                    for name, question in QUESTIONS.items():
                        self.assertEqual(engine.ask(question), recording.sqlite.ask(question), (name, kind, form))
                finally:
                    engine.close()

    def test_duckdb_answers_as_sqlite_does(self):
        self.answers_as_sqlite_does(engines.DuckDb)

    def test_clickhouse_answers_as_sqlite_does(self):
        self.answers_as_sqlite_does(engines.ClickHouse)

    # SQLite's answers are the report's; the others' are SQLite's.

    def counted(self, recording):
        """Callbacks of which every ended instance counts: none was cut by an edge of the trace or a loss."""
        ended = dict(((i, p), n) for i, p, n in recording.sqlite.ask(
            "SELECT logical_id, pid, count(end_ns) FROM instances GROUP BY logical_id, pid"))
        return {key for key, c in recording.callbacks.items() if c["instances"] > 0 and c["instances"] == ended[key]}

    def test_percentiles_are_the_reports(self):
        checked = 0
        for recording in self.recordings:
            whole = self.counted(recording)
            self.assertTrue(whole)
            for logical_id, pid, n, low, p50, p90, p99, high, _ in recording.sqlite.ask(QUESTIONS["percentiles"]):
                if (logical_id, pid) not in whole:
                    continue
                told = recording.callbacks[logical_id, pid]["response_time_ns"]
                self.assertEqual((n, low, high), (told["count"], told["min"], told["max"]))
                for exact, name in ((p50, "p50"), (p90, "p90"), (p99, "p99")):
                    self.assertLessEqual(abs(told[name] - exact), 0.008 * exact, "the stated error is 0.8 %")
                checked += 1
        self.assertGreater(checked, 10)

    def test_percentiles_are_nearest_rank(self):
        """Of the numbers 1 to n, at place ⌈p·n⌉."""
        import sqlite3
        database = sqlite3.connect(":memory:")
        database.execute("CREATE TABLE instances (host, logical_id, pid, release_ns, end_ns, release_source, callback_index)")
        for n in (1, 2, 3, 10, 99, 100, 101, 1000):
            database.executemany("INSERT INTO instances VALUES ('h', ?, 1, 0, ?, 'exact', ?)", [(f"/n{n}", i + 1, n) for i in range(n)])
        for name, _, n, low, p50, p90, p99, high, _ in database.execute(QUESTIONS["percentiles"]):
            self.assertEqual((low, p50, p90, p99, high), (1, -(-50 * n // 100), -(-90 * n // 100), -(-99 * n // 100), n), name)
        database.close()

    def test_misses_are_the_reports(self):
        for recording in self.recordings:
            for logical_id, pid, missed, deadline, judged, late, _ in recording.sqlite.ask(QUESTIONS["misses"]):
                callback = recording.callbacks[logical_id, pid]
                self.assertEqual(missed, callback["missed_releases"])
                self.assertEqual((deadline, judged, late), (callback["response_deadline_ns"], callback["instances"],
                                                            callback["late"]))

    def test_misses_are_of_the_deadlines_of_the_spec(self):
        (self.folder / "deadline.yaml").write_text(
            "callback_groups:\n  - {id: '/a/plan@Timer(20000000)', response_deadline: 1us}\n", encoding="utf-8")
        cie.text("export", TRACES[0], "--to", "sqlite", "--spec", self.folder / "deadline.yaml", "-o", self.folder / "late.db")
        engine = engines.Sqlite(self.folder / "late.db")
        self.addCleanup(engine.close)
        answer = {row[0]: row[3:6] for row in engine.ask(QUESTIONS["misses"])}
        deadline, judged, late = answer["/a/plan@Timer(20000000)"]
        self.assertEqual((deadline, late), (1000, judged), "every run of it takes longer than 1 us")

    def test_time_spent_is_the_reports(self):
        parts = ("execution_time_ns", "preempted_ns", "blocked_ns", "wake_delay_ns")
        for recording in self.recordings:
            whole = self.counted(recording)
            for logical_id, pid, runs, with_parts, waited, duration, *spent, _ in recording.sqlite.ask(QUESTIONS["time_spent"]):
                if with_parts:
                    self.assertEqual(duration, sum(spent))
                if (logical_id, pid) not in whole:
                    continue
                callback = recording.callbacks[logical_id, pid]
                self.assertEqual(runs, callback["instances"])
                self.assertEqual(waited, (callback["start_latency_ns"] or {}).get("sum"))
                self.assertEqual(spent, [(callback[part] or {}).get("sum") for part in parts])

    def test_mapping_is_the_reports(self):
        for recording in self.recordings:
            alone = collections.defaultdict(set)
            for logical_id, pid, tid, _, instances, of_thread, of_callback, _ in recording.sqlite.ask(QUESTIONS["mapping"]):
                callback = recording.callbacks[logical_id, pid]
                self.assertEqual([t["instances"] for t in callback["threads"] if t["tid"] == tid], [instances])
                alone[logical_id, pid].add((of_thread, of_callback))
            for key, callback in recording.callbacks.items():
                self.assertEqual(callback["isolated"], alone.get(key) == {(1, 1)}, key)

    def test_isolation_counts_the_three_states(self):
        for recording in self.recordings:
            states = collections.Counter(c["isolation"] or "unknown" for c in recording.report["callbacks"])
            self.assertEqual({state: n for _, state, n, _ in recording.sqlite.ask(QUESTIONS["isolation"])}, states)

    def test_hosts_with_the_same_pids_and_ids_stay_apart(self):
        """Two recordings as two hosts': every question answers of each what it answers of it alone."""
        hosts = ("left", "right")
        traces = [on_host(trace, host, self.folder / host) for trace, host in zip(TRACES[:2], hosts)]
        cie.text("export", *traces, "--to", "sqlite", "-o", self.folder / "both.db")
        both = engines.Sqlite(self.folder / "both.db")
        self.addCleanup(both.close)
        for name in ("percentiles", "misses", "time_spent", "mapping"):
            answer = both.ask(QUESTIONS[name])
            for host, recording in zip(hosts, self.recordings):
                wanted = [row[:-1] for row in recording.sqlite.ask(QUESTIONS[name])]
                self.assertEqual([row[:-1] for row in answer if row[-1] == host], wanted, (name, host))
        chains = both.ask(QUESTIONS["chains"])
        for host, recording in zip(hosts, self.recordings):
            self.assertEqual([row[:2] + row[3:] for row in chains if row[2] == host],
                             [row[:2] + row[3:] for row in recording.sqlite.ask(QUESTIONS["chains"])], host)

    def test_chains_add_up(self):
        checked = 0
        for recording in self.recordings:
            chains = {(c["name"], c["pid"] or 0): c for c in recording.report["chains"] if c["hop_table"]}
            answers = recording.sqlite.ask(QUESTIONS["chains"])
            self.assertEqual(len(answers), len(chains))
            for name, pid, _, hops, instances, inside, between in answers:
                chain = chains[name, pid]
                self.assertEqual(hops, len(chain["hops"]))
                if chain["path_latency_ns"] is None:
                    continue
                self.assertEqual(instances, chain["path_latency_ns"]["count"])
                undivided = chain.get("undivided_ns") or {"sum": 0}
                self.assertEqual(inside + (between or 0) + undivided["sum"], chain["path_latency_ns"]["sum"])
                checked += 1
        self.assertGreater(checked, 0)

    def test_worst_violations_and_losses_are_the_reports(self):
        for recording in self.recordings:
            whole = self.counted(recording)
            responses = [c["response_time_ns"]["max"] for c in recording.report["callbacks"] if c["response_time_ns"]]
            worst = [row for row in recording.sqlite.ask(QUESTIONS["worst"]) if tuple(row[:2]) in whole]
            if responses:
                self.assertEqual(worst[0][4], max(responses))
            self.assertEqual(recording.sqlite.ask(QUESTIONS["losses"]), sorted(
                (d["severity"], d["kind"], d["count"]) for d in recording.report["defects"]))
            for rule, subject, verdict, _, evidence, *_ in recording.sqlite.ask(QUESTIONS["violations"]):
                self.assertIn(verdict, ("FAIL", "INCONCLUSIVE"))
                self.assertTrue(evidence or verdict == "INCONCLUSIVE", (rule, subject))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
