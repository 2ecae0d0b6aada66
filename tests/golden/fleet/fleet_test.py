#!/usr/bin/env python3
"""`cie export --to clickhouse` and `--to parquet --partition`: two shards and one of them missing, one big
run, DuckDB, the report and the truth give one answer to the questions of viewer_export/sql/fleet.

Arguments: CIE QUESTIONS
"""
import collections
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "sql"))
import engines  # noqa: E402
from cie import Cie  # noqa: E402  of tests/support, where engines looks
from recordings import fleet  # noqa: E402

cie = Cie(sys.argv[1])
QUESTIONS = {file.stem: file.read_text() for file in sorted(Path(sys.argv[2]).glob("*.sql"))}
ASKED = ("percentiles_arrays", "regressions_arrays", "mapping_violations", "isolation", "worst")  # of ClickHouse
TOLERANCE = 1.05


def nearest_rank(values, per_mille):
    return sorted(values)[max(1, -(-per_mille * len(values) // 1000)) - 1]


def load(export, server, *options):
    return subprocess.run([export / "load.sh", "--host", "127.0.0.1", "--port", str(server.tcp), *options],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=300,
                          check=False, text=True)


class Fleet(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="cie-fleet-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.recordings = fleet(cls.folder / "recordings")
        cls.exports = []
        for number, recording in enumerate(cls.recordings):
            cls.exports.append(cls.folder / f"export {number}")
            cie.text("export", recording.trace, "--to", "clickhouse", "--label", f"software={recording.software}",
                "-o", cls.exports[-1])
            cie.text("export", "--to", "parquet", "--partition", "--label", f"software={recording.software}",
                recording.trace, "-o", cls.folder / "parquet")
        cls.by_software = collections.defaultdict(list)
        for recording in cls.recordings:
            cls.by_software[recording.software].append(recording)
        # One analysis of everything of the first version.
        cls.joint = cls.folder / "joint"
        cie.text("export", *(r.trace for r in cls.by_software["1.0"]), "--to", "clickhouse", "--label", "software=1.0",
            "-o", cls.joint)

    @classmethod
    def servers(cls, count):
        if shutil.which("clickhouse-client") is None:
            raise unittest.SkipTest(engines.lacking("clickhouse-client"))
        try:
            return engines.clickhouse_cluster(cls.folder / f"servers-{time.monotonic_ns()}", count)
        except engines.Unavailable as reason:
            raise unittest.SkipTest(str(reason)) from reason

    def loaded(self, export, server, *options):
        done = load(export, server, *options)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout

    def ask(self, server, question):
        return server.ask(QUESTIONS.get(question, question), database="cie")

    def duckdb(self):
        try:
            engine = engines.DuckDb(self.folder, {})
        except engines.Unavailable as reason:
            self.skipTest(f"not possible here: {reason}")
        self.addCleanup(engine.close)
        engine.ask(f"SET file_search_path = '{self.folder}/parquet'")
        for statement in (self.folder / "parquet" / "views.sql").read_text().split(";\n"):
            if statement.strip():
                engine.ask(statement)
        return engine

    # What there is to compare with.

    def true_percentiles(self):
        """{(software, logical id): all response times}, by the simulator."""
        responses = collections.defaultdict(list)
        for recording in self.recordings:
            for logical_id, values in recording.responses.items():
                responses[recording.software, logical_id] += values
        return responses

    def check_percentiles(self, answer):
        truth = self.true_percentiles()
        exact = {tuple(row[:2]): row[3:] for row in answer if row[2] == "response_time_ns"}
        self.assertEqual(set(exact), set(truth))
        for key, (instances, low, p50, p90, p99, p99_9, high) in exact.items():
            values = truth[key]
            self.assertEqual((instances, low, high), (len(values), min(values), max(values)), key)
            for found, per_mille in ((p50, 500), (p90, 900), (p99, 990), (p99_9, 999)):
                wanted = nearest_rank(values, per_mille)
                self.assertLessEqual(abs(found - wanted), 0.008 * wanted, (key, per_mille))

        # Of the second version there is one recording, and a report has the very same numbers.
        report = cie.json("report", self.by_software["1.1"][0].trace)
        told = {c["logical_id"]: c["response_time_ns"] for c in report["callbacks"] if c["response_time_ns"]}
        self.assertEqual({key[1]: row for key, row in exact.items() if key[0] == "1.1"}, {
            name: tuple(s[part] for part in ("count", "min", "p50", "p90", "p99", "p99_9", "max")) for name, s in told.items()})

    def check_regressions(self, answer):
        """Every callback that the simulator slowed down, with the numbers of the truth and those of `cie diff`."""
        sides = []
        for software, group in self.by_software.items():
            sides.append(self.folder / f"version {software}")
            for number, recording in enumerate(group):
                shutil.copytree(recording.trace, sides[-1] / str(number))
        told = cie.json("diff", *sides)
        worse = {(c["logical_id"], q["quantity"] + "_ns", round(1000 * q["quantile"])):
                 (c["instances_before"], c["instances_after"], q["before_ns"]["estimate"], q["after_ns"]["estimate"])
                 for c in told["callbacks"] for q in c["quantities"] if q["change"] == "worse"}
        self.assertEqual({row[:3]: row[5:9] for row in answer}, worse)
        self.assertEqual({row[3:5] for row in answer}, {("1.0", "1.1")})
        found = {row[:3] for row in answer}
        for logical_id in self.recordings[0].durations:
            self.assertIn((logical_id, "duration_ns", 500), found)
        for logical_id, quantity, per_mille, _, _, n_before, n_after, *numbers in answer:
            field = {"response_time_ns": "responses", "duration_ns": "durations"}.get(quantity)
            if field is None:
                continue
            sides = [[v for r in self.by_software[s] for v in getattr(r, field)[logical_id]] for s in ("1.0", "1.1")]
            self.assertEqual([n_before, n_after], list(map(len, sides)))
            for estimate, values in zip(numbers[:2], sides):
                wanted = nearest_rank(values, per_mille)
                self.assertLessEqual(abs(estimate - wanted), 0.008 * wanted)
            at_most, at_least = numbers[2:]
            self.assertGreaterEqual(at_most, numbers[0])
            self.assertLessEqual(at_least, numbers[1])
            self.assertGreater(at_least, TOLERANCE * at_most)

    def check_violations(self, answer):
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
        """The first version isolates every callback, the second none; the simulator has all of them run."""
        wanted = {(software, logical_id): (len(group), *((len(group), 0, 0) if software == "1.0" else (0, len(group), 0)))
                  for software, group in self.by_software.items() for logical_id in group[0].durations}
        self.assertEqual({tuple(row[:2]): tuple(row[2:6]) for row in answer}, wanted)

    def check_worst(self, answer):
        rows = sorted(((value, r) for r in self.recordings for values in r.responses.values() for value in values),
                      key=lambda pair: -pair[0])
        self.assertEqual([row[7] for row in answer], [value for value, _ in rows[:20]])
        self.assertEqual(answer[0][1], rows[0][1].host)

    # The tests.

    def test_two_shards_answer_as_one_big_run_and_a_missing_one_is_an_error(self):
        shards = self.servers(2)
        for shard in shards:
            self.addCleanup(shard.close)
        homes = set()
        for export in self.exports[:2]:
            homes.add(self.loaded(export, shards[0], "--cluster", "fleet").split()[-1])
        self.interrupt_a_loader(shards, self.exports[2])
        homes.add(self.loaded(self.exports[2], shards[1], "--cluster", "fleet").split()[-1])
        self.assertEqual(len(homes), 2, "each shard has a part; other recordings spread if these do not")
        answers = {question: self.ask(shards[0], question) for question in ASKED}
        self.assertEqual(answers, {question: self.ask(shards[1], question) for question in ASKED})
        self.check_percentiles(answers["percentiles_arrays"])
        self.check_regressions(answers["regressions_arrays"])
        self.check_violations(answers["mapping_violations"])
        self.check_isolation(answers["isolation"])
        self.check_worst(answers["worst"])
        self.compare_with_one_big_run(answers)
        self.compare_with_duckdb(answers)
        self.load_again(shards, answers)
        self.lose_a_shard(shards, answers)

    def compare_with_one_big_run(self, answers):
        (single,) = self.servers(1)
        try:
            self.loaded(self.joint, single)
            self.assertEqual(self.ask(single, "percentiles_arrays"),
                             [row for row in answers["percentiles_arrays"] if row[0] == "1.0"])
            self.every_table_arrives_as_it_is(single)
        finally:
            single.close()

    def compare_with_duckdb(self, answers):
        try:
            engine = self.duckdb()
        except unittest.SkipTest as reason:
            print(reason)
            return
        for question, answer in answers.items():
            self.assertEqual(engine.ask(QUESTIONS[question.removesuffix("_arrays")]), answer, question)

    def load_again(self, shards, answers):
        said = self.loaded(self.exports[1], shards[1], "--cluster", "fleet")
        self.assertIn("is loaded already", said)
        # Whether it is loaded cannot be told: then nothing is touched.
        shards[0].tell("RENAME TABLE cie.contents TO cie.contents_elsewhere")
        shards[0].tell("CREATE VIEW cie.contents AS SELECT 1 AS nothing")
        failed = load(self.exports[1], shards[1], "--cluster", "fleet")
        self.assertEqual(failed.returncode, 1, failed)
        shards[0].tell("DROP TABLE cie.contents")
        shards[0].tell("RENAME TABLE cie.contents_elsewhere TO cie.contents")
        for question, answer in answers.items():
            self.assertEqual(self.ask(shards[0], question), answer, "nothing is doubled")

    def interrupt_a_loader(self, shards, export):
        """It fails half-way, and nobody notices; it ends between rows and contents, and questions fail."""
        before = self.ask(shards[0], "worst")
        hidden = export / "hidden"
        (export / "data" / "verdicts.rowbinary").rename(hidden)
        failed = load(export, shards[0], "--cluster", "fleet")
        self.assertEqual(failed.returncode, 1, failed)
        hidden.rename(export / "data" / "verdicts.rowbinary")
        self.assertEqual(self.ask(shards[0], "worst"), before)
        (home, staged), = [(shard, name) for shard in shards for (name,) in shard.ask(
            "SELECT name FROM system.tables WHERE database = 'cie' AND name LIKE 'load%instances'")]
        home.tell(f"ALTER TABLE cie.instances_shard ATTACH PARTITION '2025-11-10' FROM cie.{staged}")
        recording = staged.split("_")[1]
        for shard in shards:
            with self.assertRaisesRegex(engines.Refused, recording):
                self.ask(shard, "worst")

    def lose_a_shard(self, shards, answers):
        gone = shards[1]
        gone.kill()
        for question in ASKED:
            with self.assertRaises(engines.Refused):
                self.ask(shards[0], question)
            # Not even where the server was told to do without shards that it cannot reach.
            with self.assertRaisesRegex(engines.Refused, "recordings are not complete"):
                self.ask(shards[0], QUESTIONS[question] + "\nSETTINGS skip_unavailable_shards = 1")
        failed = load(self.exports[0], shards[0], "--cluster", "fleet")
        self.assertEqual(failed.returncode, 1, failed)
        gone.start()
        self.assertEqual({question: self.ask(shards[0], question) for question in ASKED}, answers)
        # Up again, but its disk is not what it was.
        gone.kill()
        shutil.rmtree(gone.folder / "data")
        gone.start()
        with self.assertRaises(engines.Refused):
            self.ask(shards[0], "worst")
        subprocess.run(["clickhouse-client", "--host", "127.0.0.1", "--port", str(gone.tcp), "--multiquery",
                        "--allow_experimental_low_cardinality_type=1", "--query",
                        "CREATE DATABASE cie; USE cie; " + (self.exports[0] / "schema.sql").read_text()],
                       check=True, timeout=60, stdin=subprocess.DEVNULL)
        for question in ASKED:
            with self.assertRaisesRegex(engines.Refused, "recordings are not complete"):
                self.ask(shards[0], question)

    def every_table_arrives_as_it_is(self, server):
        traces = [recording.trace for recording in self.by_software["1.0"]]
        for table in ("instances", "callbacks", "callback_threads", "threads", "edges", "chains", "chain_hops", "verdicts",
                      "losses"):
            rows = [json.loads(line) for line in cie.text("export", *traces, "--to", "jsonl", "--table", table).splitlines()]
            if table == "callbacks":  # whose statistics are a table of their own
                rows = [{k: v for k, v in row.items() if k in
                         ("logical_id", "pid", "node", "kind", "source", "symbol", "period_ns", "group", "tids", "isolated",
                          "instances", "incomplete", "missed_releases", "release_source", "deadline_ns",
                          "exceptions", "longest_queue", "response_deadline_ns", "late", "isolation", "host", "callback_index",
                          "process_index")}
                        for row in rows]
            columns = list(rows[0]) if rows else []
            names = ", ".join(f"`{column}`" for column in columns) or "count()"
            found = server.ask(f"SELECT {names} FROM cie.{table} WHERE (SELECT missing FROM cie.check_{table}) = 0")
            wanted = [tuple(int(v) if isinstance(v, bool) else v for v in row.values()) for row in rows] or [(0,)]
            self.assertEqual(collections.Counter(found), collections.Counter(wanted), table)
        report = cie.json("report", *traces)
        statistics = [(c["logical_id"], quantity, *s.values()) for c in report["callbacks"] for quantity, s in c.items()
                      if isinstance(s, dict)]
        self.assertEqual(collections.Counter(server.ask(
            "SELECT logical_id, quantity, count, min, max, sum, mean, p50, p90, p99, p99_9 FROM cie.summaries "
            "WHERE (SELECT missing FROM cie.check_summaries) = 0")), collections.Counter(statistics))
        hosts = [recording.host for recording in self.by_software["1.0"]]
        self.assertEqual(server.ask("SELECT toString(day), software, host, process, hosts FROM cie.recordings"),
                         [("2025-11-08", "1.0", "", "", " ".join(sorted(hosts)))])
        self.assertEqual(server.ask("SELECT DISTINCT host, process FROM cie.instances ORDER BY process"),
                         [(hosts[0], "pid-4001"), (hosts[1], "pid-4002")])
        self.assertEqual(server.ask("SELECT name, value FROM cie.labels"), [("software", "1.0")])

    def test_parquet_files_lie_by_day_host_and_process(self):
        folders = sorted(str(p.relative_to(self.folder / "parquet" / "instances")) for p in
                         (self.folder / "parquet" / "instances").glob("*/*/*"))
        self.assertEqual(folders, [f"day={day}/host={host}/process={process}" for day, host, process in (
            ("2025-11-08", "car-1", "pid-4001"), ("2025-11-09", "car%202%2F%3D%25%27%22%5C%C3%A9", "pid-4002"),
            ("2025-11-10", "car-3", "pid-4003"))])
        before = sorted((self.folder / "parquet").rglob("*.parquet"))
        cie.text("export", self.recordings[1].trace, "--to", "parquet", "--partition", "--label", "software=1.0", "-o",
            self.folder / "parquet")
        self.assertEqual(sorted((self.folder / "parquet").rglob("*.parquet")), before, "the same files again")
        engine = self.duckdb()
        self.assertEqual(engine.ask("SELECT DISTINCT CAST(day AS VARCHAR), host FROM instances WHERE software = '1.0' ORDER BY 1"),
                         [("2025-11-08", "car-1"), ("2025-11-09", self.recordings[1].host)])
        lost = next((self.folder / "parquet" / "histograms").rglob("*.parquet"))
        hidden = self.folder / "hidden"
        lost.rename(hidden)
        try:
            with self.assertRaisesRegex(engines.Refused, "recordings are not complete"):
                engine.ask(QUESTIONS["percentiles"])
        finally:
            hidden.rename(lost)

    def test_wrong_usage_is_told(self):
        trace = self.recordings[0].trace
        for arguments, reason in (
                (("--to", "clickhouse"), "-o DIRECTORY"), (("--to", "csv", "--partition"), "--partition is for --to parquet"),
                (("--to", "parquet", "--label", "a=b"), "--label is for"), (("--to", "clickhouse", "--label", "a"), "is no label"),
                (("--to", "clickhouse", "-o", self.folder / "x", "--label", "day=2026-02-30"), "is no day"),
                (("--to", "clickhouse", "--table", "edges", "-o", self.folder / "x"), "--table"),
                (("--to", "clickhouse", "-o", __file__), "no directory")):
            self.assertIn(reason, cie.refusal("export", trace, *arguments, code=2))
        self.assertFalse((self.folder / "x").exists())


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that servers and folders go
    unittest.main(argv=sys.argv[:1], verbosity=2)
