#!/usr/bin/env python3
"""`cie export --to parquet --partition` of a hundred recordings: DuckDB and ClickHouse, reports and the truth give one
answer to the questions of viewer_export/sql.

Arguments: CIE QUESTIONS
"""
import collections
import contextlib
import itertools
import json
import shutil
import signal
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "sql"))
import engines  # noqa: E402
from cie import Cie  # noqa: E402  of tests/support, where engines looks
from recordings import HOSTS, fleet  # noqa: E402

cie = Cie(sys.argv[1])
QUESTIONS = {file.stem: file.read_text() for file in sorted(Path(sys.argv[2]).glob("fleet/*.sql"))}
OF_ONE = {file.stem: file.read_text() for file in sorted(Path(sys.argv[2]).glob("*.sql"))}
TABLES = ("instances", "callbacks", "callback_threads", "threads", "processes", "edges", "chains", "chain_hops", "verdicts",
          "losses")
TOLERANCE = 1.05
ENGINES = {engines.DuckDb: "views.sql", engines.ClickHouse: "views_clickhouse.sql"}


def nearest_rank(values, per_mille):
    return sorted(values)[max(1, -(-per_mille * len(values) // 1000)) - 1]


def export(recording, tree, **labels):
    labels = {"software": recording.software, **labels}
    options = [option for name, value in labels.items() for option in ("--label", f"{name}={value}")]
    cie.text("export", recording.trace, "--to", "parquet", "--partition", *options, "-o", tree)


def files(tree):
    return sorted(path.relative_to(tree) for path in tree.rglob("*.parquet"))


def of_recording(question, identity):
    """A question about one recording, asked of the tables of all."""
    return "WITH " + ", ".join(f"{table} AS (SELECT * FROM {table} WHERE recording = '{identity}')"
                               for table in TABLES) + "\n" + question


class Fleet(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="cie-fleet-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.recordings = fleet(cls.folder / "recordings")
        cls.by_software = collections.defaultdict(list)
        for recording in cls.recordings:
            cls.by_software[recording.software].append(recording)
        cls.tree = cls.folder / "tree"
        late, *others, again = cls.recordings
        export(again, cls.tree, software="unknown")
        cls.of_again = files(cls.tree)
        for recording in (*others, again):
            export(recording, cls.tree)
        export(late, cls.tree)
        # One analysis of everything of the first version.
        cls.joint = cls.folder / "joint"
        cie.text("export", *(r.trace for r in cls.by_software["1.0"]), "--to", "parquet", "--partition", "--label",
                 "software=1.0", "-o", cls.joint)

    @contextlib.contextmanager
    def engine(self, kind, tree):
        try:
            engine = kind(tree)
        except engines.Unavailable as reason:
            self.skipTest(f"not possible here: {reason}")
        try:
            engine.tell((tree / ENGINES[kind]).read_text())
            yield engine
        finally:
            engine.close()

    # What there is to compare with.

    def check_percentiles(self, answer):
        truth = collections.defaultdict(list)
        for recording in self.recordings:
            for logical_id, values in recording.responses.items():
                truth[recording.software, logical_id] += values
        exact = {tuple(row[:2]): row[3:] for row in answer if row[2] == "response_time_ns"}
        self.assertEqual(set(exact), set(truth))
        for key, (instances, low, p50, p90, p99, p99_9, high) in exact.items():
            values = truth[key]
            self.assertEqual((instances, low, high), (len(values), min(values), max(values)), key)
            for found, per_mille in ((p50, 500), (p90, 900), (p99, 990), (p99_9, 999)):
                wanted = nearest_rank(values, per_mille)
                self.assertLessEqual(abs(found - wanted), 0.008 * wanted, (key, per_mille))

        # Of the oldest version there is one recording, and a report has the very same numbers.
        report = cie.json("report", self.by_software["0.9"][0].trace)
        told = {c["logical_id"]: c["response_time_ns"] for c in report["callbacks"] if c["response_time_ns"]}
        self.assertEqual({key[1]: row for key, row in exact.items() if key[0] == "0.9"}, {
            name: tuple(s[part] for part in ("count", "min", "p50", "p90", "p99", "p99_9", "max")) for name, s in told.items()})

    def check_regressions(self, answer):
        """Every callback that the simulator slowed down, with the numbers of the truth and those of `cie diff`."""
        wanted = {}
        for pair in itertools.pairwise(self.by_software):
            sides = []
            for software in pair:
                sides.append(self.folder / f"version {software}")
                sides[-1].mkdir(exist_ok=True)
                for recording in self.by_software[software]:
                    link = sides[-1] / recording.trace.parent.name
                    if not link.is_symlink():
                        link.symlink_to(recording.trace)
            for callback in cie.json("diff", *sides)["callbacks"]:
                for q in callback["quantities"]:
                    if q["change"] == "worse":
                        wanted[callback["logical_id"], q["quantity"] + "_ns", round(1000 * q["quantile"]), *pair] = (
                            callback["instances_before"], callback["instances_after"], q["before_ns"]["estimate"],
                            q["after_ns"]["estimate"])
        self.assertEqual({row[:5]: row[5:9] for row in answer}, wanted)
        found = {row[:5] for row in answer}
        for logical_id in self.recordings[0].durations:
            self.assertIn((logical_id, "duration_ns", 500, "1.0", "1.1"), found)
        for logical_id, quantity, per_mille, *pair, n_before, n_after, before, after, at_most, at_least in answer:
            self.assertGreaterEqual(at_most, before)
            self.assertLessEqual(at_least, after)
            self.assertGreater(at_least, TOLERANCE * at_most)
            field = {"response_time_ns": "responses", "duration_ns": "durations"}.get(quantity)
            if field is None:
                continue
            sides = [[v for r in self.by_software[s] for v in getattr(r, field)[logical_id]] for s in pair]
            self.assertEqual([n_before, n_after], list(map(len, sides)))
            for estimate, values in zip((before, after), sides):
                exact = nearest_rank(values, per_mille)
                self.assertLessEqual(abs(estimate - exact), 0.008 * exact)

    def check_mapping_violations(self, answer):
        wanted = collections.defaultdict(lambda: [0, 0, 0, 0])
        for recording in self.recordings:
            for rule in cie.json("verify", recording.trace)["rules"]:
                judged = [s["verdict"] for s in rule["subjects"] if s["verdict"] != "NOT_APPLICABLE"]
                if rule["id"].startswith("M") and judged:
                    counts = wanted[recording.software, rule["id"], rule["name"]]
                    counts[0] += 1
                    counts[1] += "FAIL" in judged
                    counts[2] += "INCONCLUSIVE" in judged
                    counts[3] += judged.count("FAIL")
        self.assertEqual({tuple(row[:3]): list(row[3:7]) for row in answer}, dict(wanted))
        self.assertGreater(wanted["1.1", "M2", "one-callback-per-thread"][3], 0)

    def check_isolation(self, answer):
        """Version 1.1 isolates no callback, the others every one; the simulator has all of them run."""
        wanted = {(software, logical_id): (len(group), *((0, len(group), 0) if software == "1.1" else (len(group), 0, 0)))
                  for software, group in self.by_software.items() for logical_id in group[0].durations}
        self.assertEqual({tuple(row[:2]): tuple(row[2:6]) for row in answer}, wanted)

    def check_worst(self, answer):
        rows = sorted(((value, r) for r in self.recordings for values in r.responses.values() for value in values),
                      key=lambda pair: -pair[0])
        self.assertEqual([row[7] for row in answer], [value for value, _ in rows[:20]])
        self.assertEqual(answer[0][1], rows[0][1].host)

    # The tests.

    def test_every_question_has_one_answer_and_it_is_true(self):
        answers = []
        for kind in ENGINES:
            with self.engine(kind, self.tree) as engine:
                answers.append({name: engine.ask(question) for name, question in QUESTIONS.items()})
        self.assertEqual(*answers)
        for name, answer in answers[0].items():
            with self.subTest(name):
                getattr(self, f"check_{name}")(answer)
        for kind in ENGINES:
            with self.engine(kind, self.joint) as engine, self.subTest("one analysis of all", engine=kind):
                self.assertEqual(engine.ask(QUESTIONS["percentiles"]),
                                 [row for row in answers[0]["percentiles"] if row[0] == "1.0"])

    def test_questions_about_one_recording_are_answered_as_of_it_alone(self):
        asked = [self.by_software[software][-1] for software in ("0.9", "1.0", "1.1")]
        for recording in asked:
            cie.text("export", recording.trace, "--to", "sqlite", "-o", recording.trace.parent / "run.db")
        for kind in ENGINES:
            with self.engine(kind, self.tree) as engine:
                for recording in asked:
                    alone = engines.Sqlite(recording.trace.parent / "run.db")
                    self.addCleanup(alone.close)
                    (identity,), = engine.ask(f"SELECT recording FROM processes WHERE pid = {recording.pid}")
                    for name, question in OF_ONE.items():
                        self.assertEqual(engine.ask(of_recording(question, identity)), alone.ask(question),
                                         (name, kind, recording.software))

    def test_every_table_arrives_as_it_is(self):
        traces = [recording.trace for recording in self.by_software["1.0"]]
        rows_of = {table: [json.loads(line) for line in cie.text("export", *traces, "--to", "jsonl", "--table", table).splitlines()]
                   for table in TABLES}
        report = cie.json("report", *traces)
        kept = ("logical_id", "pid", "node", "kind", "source", "symbol", "period_ns", "group", "tids", "isolated", "instances",
                "incomplete", "missed_releases", "release_source", "deadline_ns", "exceptions", "longest_queue",
                "response_deadline_ns", "late", "isolation", "host", "callback_index", "process_index")
        # The statistics of callbacks are a table of their own.
        rows_of["callbacks"] = [{k: v for k, v in row.items() if k in kept} for row in rows_of["callbacks"]]
        statistics = [(c["logical_id"], quantity, *s.values()) for c in report["callbacks"] for quantity, s in c.items()
                      if isinstance(s, dict)]
        hosts = " ".join(sorted(HOSTS))
        for kind in ENGINES:
            with self.engine(kind, self.joint) as engine:
                for table, rows in rows_of.items():
                    names = ", ".join(f'"{name}"' for name in rows[0]) if rows else "count(*)"
                    found = engine.ask(f"SELECT {names} FROM {table} WHERE (SELECT missing FROM check_{table}) = 0")
                    wanted = [tuple(int(v) if isinstance(v, bool) else v for v in row.values()) for row in rows] or [(0,)]
                    self.assertEqual(collections.Counter(found), collections.Counter(wanted), table)
                self.assertEqual(collections.Counter(engine.ask(
                    "SELECT logical_id, quantity, count, min, max, sum, mean, p50, p90, p99, p99_9 FROM summaries "
                    "WHERE (SELECT missing FROM check_summaries) = 0")), collections.Counter(statistics))
                self.assertEqual(engine.ask("SELECT CAST(day AS VARCHAR), software, host, process, hosts FROM recordings"),
                                 [("2025-11-08", "1.0", None, None, hosts)])

    def test_a_recording_has_its_place_and_takes_it_again(self):
        encoded = {"car 2/=%'\"\\é": "car%202%2F%3D%25%27%22%5C%C3%A9"}
        self.assertEqual({path.parent.as_posix() for path in files(self.tree / "instances")},
                         {f"day=2025-11-{r.day - 20_392:02}/host={encoded.get(r.host, r.host)}/process=pid-{r.pid}"
                          for r in self.recordings})
        again = self.recordings[-1]
        self.assertEqual([path for path in files(self.tree) if path.name.startswith(self.of_again[0].name[:32])], self.of_again)
        for kind in ENGINES:
            with self.engine(kind, self.tree) as engine:
                self.assertEqual(engine.ask(f"SELECT DISTINCT software, host, process FROM instances WHERE pid = {again.pid}"),
                                 [(again.software, again.host, f"pid-{again.pid}")])
                self.assertEqual(engine.ask("SELECT software, count(*) FROM recordings GROUP BY software ORDER BY software"),
                                 [(software, len(group)) for software, group in self.by_software.items()])
                self.assertEqual(
                    engine.ask("SELECT DISTINCT CAST(day AS VARCHAR), host FROM instances WHERE day = '2025-11-09' ORDER BY host"),
                    [("2025-11-09", host) for host in sorted(HOSTS)])

    def test_views_of_some_days_of_a_tree_elsewhere(self):
        """With the words that viewer_export/docs/fleet.md replaces."""
        for kind, views in ENGINES.items():
            text = (self.tree / views).read_text()
            reader = "read_parquet('" if kind is engines.DuckDb else "file('"
            self.assertEqual(text.count(reader), 15, "a view of each table")
            try:
                engine = kind(self.folder)
            except engines.Unavailable as reason:
                self.skipTest(f"not possible here: {reason}")
            self.addCleanup(engine.close)
            engine.tell(text.replace(reader, f"{reader}{self.tree}/").replace("/**/", "/day=2025-11-1*/**/"))
            late = [recording for recording in self.recordings if recording.day >= 20_402]
            self.assertEqual(engine.ask("SELECT software, count(*) FROM recordings GROUP BY software ORDER BY software"),
                             sorted(collections.Counter(recording.software for recording in late).items()))
            self.assertEqual({(row[0], row[2]) for row in engine.ask(QUESTIONS["isolation"])},
                             set(collections.Counter(recording.software for recording in late).items()))

    def test_what_is_missing_is_an_error_and_never_a_smaller_number(self):
        tree = self.folder / "damaged"
        for recording in self.recordings[:2]:
            export(recording, tree)
        whole = {kind: None for kind in ENGINES}
        for kind in ENGINES:
            with self.engine(kind, tree) as engine:
                whole[kind] = {name: engine.ask(question) for name, question in QUESTIONS.items()}
        asked_of = {"instances": "worst", "histograms": "percentiles", "callbacks": "isolation", "verdicts": "mapping_violations",
                    "recordings": "regressions"}
        for kind in ENGINES:
            with self.engine(kind, tree) as engine:
                for table, question in asked_of.items():
                    # Rows are missing, or nobody announced them.
                    for place, said in ((table, f"{table} of 1 recordings"), ("contents", "of 1 recordings")):
                        lost = next((tree / place).rglob("*.parquet"))
                        lost.rename(self.folder / "hidden")
                        with self.assertRaisesRegex(engines.Refused, f"{said} are not complete: {lost.name[:32]}"):
                            engine.ask(QUESTIONS[question])
                        (self.folder / "hidden").rename(lost)
                    self.assertEqual(engine.ask(QUESTIONS[question]), whole[kind][question])
        export(self.recordings[0], tree, day="2025-11-20")  # beside the day that it says itself
        for kind in ENGINES:
            with self.engine(kind, tree) as engine:
                for question in QUESTIONS.values():
                    with self.assertRaisesRegex(engines.Refused, "recordings are not complete"):
                        engine.ask(question)
        shutil.rmtree(tree)

    def test_wrong_usage_is_told(self):
        trace = self.recordings[0].trace
        partition = ("--to", "parquet", "--partition")
        for arguments, reason in (
                (partition, "-o DIRECTORY"), (("--to", "csv", "--partition"), "--partition is for --to parquet"),
                (("--to", "parquet", "--label", "a=b"), "--label is for"), ((*partition, "--label", "a"), "is no label"),
                ((*partition, "-o", self.folder / "x", "--label", "day=2026-02-30"), "is no day"),
                ((*partition, "--table", "edges", "-o", self.folder / "x"), "--table"),
                ((*partition, "-o", __file__), "no directory")):
            self.assertIn(reason, cie.refusal("export", trace, *arguments, code=2))
        self.assertFalse((self.folder / "x").exists())


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that folders go
    unittest.main(argv=sys.argv[:1], verbosity=2)
