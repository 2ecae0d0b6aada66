"""Three SQL engines with the tables of one recording in each: SQLite, DuckDB, ClickHouse.

Each has `ask(sql)`: rows of int, float, str and None. Booleans are 0 and 1.
"""
import json
import os
import pathlib
import shutil
import socket
import sqlite3
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request

TESTS = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "browser"), str(TESTS / "support")]
import npm_package  # noqa: E402  pylint: disable=wrong-import-position
from system_package import lacking  # noqa: E402  pylint: disable=wrong-import-position
from npm_package import Unavailable  # noqa: E402  pylint: disable=wrong-import-position

DUCKDB = [("@duckdb/node-api@1.5.6-r.1", "64d5080af3c0144329f9cbdbff7bc867c9c1f9df57a7e7e2a8b13bc6ed2bc664"),
          ("@duckdb/node-bindings@1.5.6-r.1", "9d1ebca9020dcd5680e2e38bd182f1a0e69e59f00d31dfc5afca2623b8a34ac3"),
          ("@duckdb/node-bindings-linux-x64@1.5.6-r.1", "1b9f82478539bb9a1d1df44bd103121a12ae52142c07158dc52b97d2ec1d69ff")]
CLICKHOUSE = shutil.which("clickhouse-server", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")


class Refused(AssertionError):
    """What an engine said instead of an answer, and to what."""


class Sqlite:
    def __init__(self, database: pathlib.Path):
        self.database = sqlite3.connect(database)

    def ask(self, sql: str) -> list:
        return self.database.execute(sql).fetchall()

    def close(self) -> None:
        self.database.close()


class DuckDb:
    """Views on files: `sources` is {table: expression that reads it}. Raises Unavailable."""

    def __init__(self, folder: pathlib.Path, sources: dict):
        modules = folder / "node_modules"
        if not modules.is_dir():
            npm_package.modules(DUCKDB, modules)
        self.process = subprocess.Popen(  # pylint: disable=consider-using-with
            ["node", pathlib.Path(__file__).with_name("duckdb.cjs"), modules], text=True, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE)
        for table, source in sources.items():
            self.ask(f"CREATE VIEW {table} AS SELECT * FROM {source}")

    def ask(self, sql: str) -> list:
        self.process.stdin.write(json.dumps(sql) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            raise Refused(answer["error"], sql)
        return [tuple(int(cell["integer"]) if isinstance(cell, dict) else int(cell) if isinstance(cell, bool) else cell
                      for cell in row) for row in answer["rows"]]

    def close(self) -> None:
        self.process.stdin.close()
        self.process.stdout.close()
        assert self.process.wait(timeout=200) == 0


SERVER = """<yandex>
  <logger><level>warning</level><log>{folder}/log</log><errorlog>{folder}/errors</errorlog></logger>
  <listen_host>127.0.0.1</listen_host> <http_port>{http}</http_port> <tcp_port>{tcp}</tcp_port>
  <path>{folder}/data/</path> <tmp_path>{folder}/tmp/</tmp_path> <users_config>{folder}/users.xml</users_config>
  <default_profile>default</default_profile> <default_database>default</default_database>
  <mark_cache_size>1048576</mark_cache_size> <max_concurrent_queries>50</max_concurrent_queries>
  <remote_servers>{cluster}</remote_servers>
</yandex>
"""
SHARD = "<shard><replica><host>127.0.0.1</host><port>{tcp}</port></replica></shard>"
# A machine may be slow, and then 50 ms do not suffice to be connected.
USERS = """<yandex>
  <profiles><default>
    <connect_timeout_with_failover_ms>30000</connect_timeout_with_failover_ms> <max_threads>2</max_threads>
    <background_pool_size>2</background_pool_size> <fsync_metadata>0</fsync_metadata>
  </default></profiles>
  <quotas><default/></quotas>
  <users><default>
    <password/> <networks><ip>127.0.0.1</ip></networks> <profile>default</profile> <quota>default</quota>
  </default></users>
</yandex>
"""
COLUMN_TYPES = {"INTEGER": "Int64", "BOOLEAN": "UInt8", "REAL": "Float64", "TEXT": "String"}


def free_ports(count: int) -> list:
    """Of the loopback interface. They are free until somebody else takes them."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]
    finally:
        for each in sockets:
            each.close()


def clickhouse_cluster(folder: pathlib.Path, count: int) -> list:
    """Servers that are the shards of a cluster "fleet". Raises Unavailable."""
    for attempt in range(5):  # somebody else may take a port meanwhile
        ports = free_ports(2 * count)
        tcp = ports[count:]
        servers = []
        try:
            for number in range(count):
                servers.append(ClickHouse(folder / f"{attempt}-{number}", (ports[number], tcp[number]), tcp))
            return servers
        except AssertionError as reason:
            for server in servers:
                server.close()
            if "Address already in use" not in str(reason) or attempt == 4:
                raise
    raise AssertionError("not reached")


class ClickHouse:
    """A server of its own on the loopback interface, in `folder`; it ends with close(), or with this process.
    Raises Unavailable."""

    def __init__(self, folder: pathlib.Path, ports: tuple = (), shards: list = ()):
        if CLICKHOUSE is None:
            raise Unavailable(lacking("clickhouse-server"))
        folder.mkdir(parents=True)
        self.folder = folder
        self.http, self.tcp = ports or free_ports(2)
        self.url = f"http://127.0.0.1:{self.http}/"
        cluster = "".join(SHARD.format(tcp=port) for port in shards)
        (folder / "users.xml").write_text(USERS)
        (folder / "config.xml").write_text(SERVER.format(folder=folder, http=self.http, tcp=self.tcp,
                                                         cluster=f"<fleet>{cluster}</fleet>" if shards else ""))
        self.start()

    def start(self) -> None:
        with open(self.folder / "output", "wb") as output:
            self.process = subprocess.Popen(  # pylint: disable=consider-using-with
                ["setpriv", "--pdeathsig", "KILL", CLICKHOUSE, f"--config-file={self.folder}/config.xml"],
                cwd=self.folder, stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        deadline = time.monotonic() + 200
        while not self._is_up():
            if self.process.poll() is not None or time.monotonic() > deadline:
                self.close()
                said = [self.folder / name for name in ("output", "errors")]
                raise AssertionError("".join(file.read_text(errors="replace") for file in said if file.exists()))
            time.sleep(0.05)

    def _is_up(self) -> bool:
        try:
            with urllib.request.urlopen(self.url, timeout=5) as answer:
                return answer.read() == b"Ok.\n"
        except OSError:
            return False

    def _post(self, query: str, body: bytes = b"", database: str = "default") -> bytes:
        parameters = urllib.parse.urlencode({"query": query, "database": database})
        try:
            with urllib.request.urlopen(f"{self.url}?{parameters}", body, timeout=300) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            raise Refused(error.read().decode(errors="replace"), query) from error

    def tell(self, statement: str) -> None:
        self._post(statement)

    def load(self, table: str, columns: dict, rows: bytes, row_format: str) -> None:
        """`columns` is {name: type as SQLite calls it}; what was in the table before is gone."""
        described = ", ".join(f"{name} Nullable({COLUMN_TYPES[kind]})" for name, kind in columns.items())
        self._post(f"DROP TABLE IF EXISTS {table}")
        self._post(f"CREATE TABLE {table} ({described}) ENGINE = Memory")
        self._post(f"INSERT INTO {table} FORMAT {row_format}", rows)

    def ask(self, sql: str, database: str = "default") -> list:
        """Raises Refused, or OSError when nobody answers."""
        answer = json.loads(self._post(sql + "\nFORMAT JSONCompact", database=database))
        is_integer = ["Int" in column["type"] and "Array" not in column["type"] for column in answer["meta"]]
        return [tuple(int(cell) if exact and cell is not None else cell for cell, exact in zip(row, is_integer))
                for row in answer["data"]]

    def kill(self) -> None:
        """As a crash would."""
        self.process.kill()
        self.process.wait()

    def close(self) -> None:
        self.process.terminate()
        try:
            self.process.wait(timeout=200)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
