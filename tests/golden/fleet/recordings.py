"""Recordings of a small fleet by the oracle's simulated machine, with the truth about them."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "oracle"))
from oracle.scenario import Scenario  # noqa: E402  pylint: disable=wrong-import-position

DAY_NS = 86_400 * 10**9


class Recording:
    """One host's: `days` since 1970-01-01, callbacks take `slower` times as long, `executor` runs them."""

    def __init__(self, folder: pathlib.Path, number: int, *, host: str, software: str, days: int, slower: int = 1,
                 executor: str = "isolated", milliseconds: int = 1200):
        scenario = Scenario("fleet", number, milliseconds=milliseconds)
        scenario.kernel = False
        app = scenario.standard(executor, pid=4001 + number)
        app.host = host
        for callback in app.callbacks:
            callback.work = (40_000 * slower, 160_000 * slower)
            callback.blocking = 0
        # The first event is at noon of that day.
        offset = days * DAY_NS + DAY_NS // 2 - scenario.begin
        scenario.machine.realtime_offset = offset
        scenario.layout.update(hostname=host.replace("\\", "\\\\").replace('"', '\\"'), offset=offset)
        scenario.run()
        scenario.write(folder)
        self.trace = folder / "trace"
        self.host, self.software, self.pid = host, software, app.pid
        self.spec = folder / "spec.yaml"
        self.responses = {}  # true response times by logical id
        self.durations = {}
        for row in scenario.rows():
            if scenario.counted(row):
                self.durations.setdefault(row.callback.logical_id, []).append(row.end - row.start)
                if row.release_known:
                    self.responses.setdefault(row.callback.logical_id, []).append(row.end - row.release)


def fleet(folder: pathlib.Path) -> list:
    """Two versions of the software. The second is slower, and does not isolate callbacks."""
    return [
        Recording(folder / "0", 0, host="car-1", software="1.0", days=20_400),
        Recording(folder / "1", 1, host="car 2/=%'\"\\é", software="1.0", days=20_401),
        Recording(folder / "2", 2, host="car-3", software="1.1", days=20_402, slower=3, executor="multi_threaded"),
    ]
