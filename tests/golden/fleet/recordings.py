"""Recordings of a small fleet by the oracle's simulated machine, with the truth about them."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "oracle"))
from oracle.scenario import Scenario  # noqa: E402  pylint: disable=wrong-import-position

DAY_NS = 86_400 * 10**9


class Recording:
    """One host's: `days` since 1970-01-01, callbacks take `slower` times as long, `executor` runs them."""

    def __init__(self, folder: pathlib.Path, number: int, *, host: str, software: str, days: int, slower: int = 1,
                 executor: str = "isolated", milliseconds: int = 150):
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
        self.host, self.software, self.pid, self.day = host, software, app.pid, days
        self.spec = folder / "spec.yaml"
        self.responses = {}  # true response times by logical id
        self.durations = {}
        for row in scenario.rows():
            if scenario.counted(row):
                self.durations.setdefault(row.callback.logical_id, []).append(row.end - row.start)
                if row.release_known:
                    self.responses.setdefault(row.callback.logical_id, []).append(row.end - row.release)


HOSTS = ("car-1", "007", "car 2/=%'\"\\é", *(f"car-{number}" for number in range(4, 11)))


def version_of(day: int) -> str:
    return "1.0" if day < 4 else "1.1" if day < 7 else "1.2"


def fleet(folder: pathlib.Path) -> list:
    """A recording of every host on ten days, and one of the day before. Version 1.1 of the software is slower, and does
    not isolate callbacks."""
    of_days = [(host, day) for day in range(10) for host in HOSTS]
    recordings = [Recording(folder / "before", 0, host=HOSTS[0], software="0.9", days=20_399)]
    for number, (host, day) in enumerate(of_days, 1):
        is_slow = version_of(day) == "1.1"
        recordings.append(Recording(folder / str(number), number, host=host, software=version_of(day), days=20_400 + day,
                                    slower=3 if is_slow else 1, executor="multi_threaded" if is_slow else "isolated"))
    return recordings
