"""Three SQL engines: SQLite, DuckDB, ClickHouse (chDB: the engine without its server).

Each has `ask(sql)`: rows of int, float, str and None. Booleans are 0 and 1.
"""
import atexit
import functools
import json
import pathlib
import sqlite3
import subprocess
import sys
import tempfile

TESTS = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "browser"), str(TESTS / "support")]
import npm_package  # noqa: E402  pylint: disable=wrong-import-position
from npm_package import Unavailable  # noqa: E402  pylint: disable=wrong-import-position

DUCKDB = (("@duckdb/node-api@1.5.6-r.1", "64d5080af3c0144329f9cbdbff7bc867c9c1f9df57a7e7e2a8b13bc6ed2bc664"),
          ("@duckdb/node-bindings@1.5.6-r.1", "9d1ebca9020dcd5680e2e38bd182f1a0e69e59f00d31dfc5afca2623b8a34ac3"),
          ("@duckdb/node-bindings-linux-x64@1.5.6-r.1", "1b9f82478539bb9a1d1df44bd103121a12ae52142c07158dc52b97d2ec1d69ff"))
CLICKHOUSE = (("chdb@3.4.0", "47bad24d64658bc3c84d9d7651f53290012ae78deb98912d6a06b84d858be26b"),
              ("@chdb/lib-linux-x64-gnu@26.7.3-stable.1", "c0d32b129e988f2b9a9a31c9141aecf5e1e2453f9a079efc4d36ab8e3f92b2ad"))


class Refused(AssertionError):
    """What an engine said instead of an answer, and to what."""


class Sqlite:
    def __init__(self, database: pathlib.Path):
        self.database = sqlite3.connect(database)

    def ask(self, sql: str) -> list:
        return self.database.execute(sql).fetchall()

    def close(self) -> None:
        self.database.close()


@functools.cache
def _modules(packages: tuple) -> str:
    folder = tempfile.TemporaryDirectory(prefix="cie-engine-")  # pylint: disable=consider-using-with
    atexit.register(folder.cleanup)
    return npm_package.modules(packages, pathlib.Path(folder.name, "node_modules"))


class _Engine:
    """One in a process of Node.js; names of files are relative to `folder`. Raises Unavailable."""
    name = ""
    packages: tuple = ()

    def __init__(self, folder: pathlib.Path):
        modules = _modules(self.packages)
        self.process = subprocess.Popen(  # pylint: disable=consider-using-with
            ["node", pathlib.Path(__file__).with_name("engine.cjs"), modules, self.name], cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def ask(self, sql: str) -> list:
        self.process.stdin.write(json.dumps(sql) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            raise Refused(answer["error"], sql)
        return [tuple(int(cell["integer"]) if isinstance(cell, dict) else int(cell) if isinstance(cell, bool) else cell
                      for cell in row) for row in answer["rows"]]

    def tell(self, statements: str) -> None:
        for statement in statements.split(";\n"):
            if statement.strip():
                self.ask(statement)

    def close(self) -> None:
        self.process.stdin.close()
        self.process.stdout.close()
        assert self.process.wait(timeout=200) == 0


class DuckDb(_Engine):
    name, packages = "duckdb", DUCKDB


class ClickHouse(_Engine):
    name, packages = "clickhouse", CLICKHOUSE
