"""One generated trace with its true answers.

A scenario configures applications, runs the machine, may take events away or damage files, and
declares what differs from the answer that a flawless trace would get. Verdicts that only the
mapping and the times decide (M2, M3, E2, E3, R1) are computed here from the simulator's truth.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .application import App
from .ctf_writer import Layout, Record, Writer
from .sim_entities import SimCallback, Truth
from .simulator import Machine, SimThread
from .spec_writer import spec_text

PASS, FAIL, INCONCLUSIVE, NOT_APPLICABLE, OPEN = (
    "PASS", "FAIL", "INCONCLUSIVE", "NOT_APPLICABLE", "*")
WEIGHT = {"NOT_APPLICABLE": 0, "*": 0, "PASS": 1, "INCONCLUSIVE": 2, "FAIL": 3}
RULES = ["T1", "T2", "T3", "T4", "T5", "T6", "M1", "M2", "M3", "M4", "M5", "M6", "M7", "M8", "M9",
         "S1", "S2", "S3", "S4", "S5", "E1", "E2", "E3", "R1", "R2", "R3", "R4", "R5", "Q1", "Q2"]
MS = 1_000_000


def summary(values: list[int]) -> dict[str, int] | None:
    if not values:
        return None
    return {"count": len(values), "min": min(values), "max": max(values), "sum": sum(values)}


class Scenario:
    def __init__(self, name: str, seed: int, cpus: int = 2, milliseconds: int = 100) -> None:
        self.name, self.seed, self.cpus = name, seed, cpus
        self.begin = 983_000_000_000 + (seed * 3_700_000_000) % 50_000_000_000
        if seed % 5 == 4:  # the 32 bits of a compact time wrap in mid-trace
            self.begin = (self.begin >> 32 << 32) - 43_000_000
        self.machine = Machine(seed * 1000 + sum(name.encode()), cpus, self.begin)
        self.end = self.begin + (milliseconds + 15) * MS
        self.stop_at = self.begin + milliseconds * MS
        self.apps: list[App] = []
        self.kernel = True
        self.chains: list[tuple[str, list[SimCallback]]] = []
        self.overrides: dict[tuple[str, str], str] = {}
        self.spec_changes: dict[str, dict[str, Any]] = {}
        self.spec_ids: dict[str, str] = {}  # entries under another id
        self.extra_entries: list[dict[str, Any]] = []
        self.non_ros: list[dict[str, Any]] = []
        self.chain_changes: dict[str, int] = {}
        self.window_begin = self.begin
        self.dropped_user: list[Record] = []
        self.discarded_user: list[tuple[int, int]] = []
        self.discarded_kernel: list[tuple[int, int]] = []
        self.damage: list[Callable[[Path], None]] = []
        self.hidden: set[int] = set()      # ids of truth rows that the trace no longer shows
        self.unpaired: set[int] = set()    # rows whose end the trace no longer shows
        self.weaker = False                # verdicts may only be weaker than declared
        self.flips = True                  # and never go from FAIL to PASS
        self.recomputable = True           # babeltrace2 reads everything of it
        self.numbers = True                # report and instances are known
        self.dropped = False               # events are missing
        self.report_open: set[str] = set()  # report keys that the documents leave open
        self.registered_anew: set[SimCallback] = set()  # whenever its thread was replaced
        self.layout = {"large_ids": seed % 3 == 2, "packet_bytes": (4096, 8192, 65536)[seed % 3]}
        self.user_layout: dict[str, Any] = {}
        self.kernel_layout: dict[str, Any] = {}
        self.window_end: int | None = None  # of the user streams, when it is not `end`
        self.traces = ["trace"]
        self.exact: list[str] = []  # rules that are held to their verdict even when `weaker`
        self.renamed = False  # ask once more with the stream files under other names
        self.exit_codes: list[tuple[list[str], int]] = []  # (options of verify, exit code)
        self.require: str | None = None    # overall verdict, where subjects are left open

    # -- configuring ---------------------------------------------------------------------------

    def standard(self, executor: str = "isolated", pid: int = 4001, pool: int = 3) -> App:
        """Three timers, a chain of three with a fan-out, a service and its client."""
        everywhere = tuple(range(self.cpus))
        work = (40_000, 160_000)

        def make(n: int, kind: str, node: str, priority: int, **more: Any) -> SimCallback:
            return SimCallback(n, kind, node, priority=priority, affinity=everywhere, group=n + 1,
                               work=work, **more)

        callbacks = [
            make(0, "timer", "/a/plan", 46, period=20 * MS, publishes="/t0"),
            make(1, "subscription", "/b/track", 10, source="/t0", publishes="/t1"),
            make(2, "subscription", "/b/drive", 27, source="/t1", blocking=0.5),
            make(3, "subscription", "/b/track", 0, source="/t0", suffix="#2"),
            make(4, "timer", "/a/slow", 46, period=20 * MS),
            make(5, "timer", "/a/fast", 13, period=10 * MS, publishes="request:/srv"),
            make(6, "service", "/b/drive", 8, source="/srv", publishes="reply:/srv"),
            make(7, "client", "/a/fast", 6, source="/srv"),
        ]
        for n, offset in ((0, 5), (4, 15), (5, 10)):
            callbacks[n].first_expiry = self.begin + offset * MS + 137 * (n + 1)
        app = self.add(App(self.machine, pid, executor, callbacks, pool if executor == "multi_threaded"
                           else 1))
        if not self.chains:
            self.chains = [("chain0", callbacks[0:3]), ("chain1", [callbacks[0], callbacks[3]])]
        return app

    def add(self, app: App) -> App:
        app.stop_at = self.stop_at
        app.audits = [self.begin + 50 * MS, self.begin + 80 * MS]
        self.apps.append(app)
        return app

    def run(self) -> None:
        m = self.machine
        for app in self.apps:
            app.peers = self.apps
            m.at(max(app.process_start + 6_000_000, self.begin + 8000), app.start)
        noise = SimThread(900, "noise0", 900, self._noise(), 15, 1, affinity=tuple(range(self.cpus)))
        m.threads.append(noise)
        noise.since = m.now
        noise.state = "ready"
        for cpu in range(self.cpus):
            self._marks(cpu, self.begin + 500 + 1000 * cpu)
        m.at(self.begin + 7000, lambda: None)
        m.run_until(self.end - 10_000)
        for cpu in range(self.cpus):
            self._marks(cpu, self.end - 9000 + 1000 * cpu)

    def _noise(self) -> Any:
        m = self.machine
        while True:
            yield "wait", m.now + m.random.randint(2 * MS, 12 * MS)
            yield "run", m.random.randint(30_000, 300_000)

    def _marks(self, cpu: int, time: int) -> None:
        """A sign of life of every CPU at both edges of the trace."""
        m = self.machine
        m.user.append(Record(time, cpu, "clock_sync", 4000, 4000, {
            "monotonic_ns": time, "realtime_ns": time + m.realtime_offset}))
        running = m.current[cpu]
        who = ((running.name, running.tid, running.kernel_priority()) if running
               else (f"swapper/{cpu}", 0, 20))
        worker = (f"kworker/{cpu}:1", 20 + cpu, 20)
        for at, old, new, state in ((time, who, worker, 0), (time + 400, worker, who, 1)):
            m.kernel.append(Record(at, cpu, "sched_switch", None, None, {
                "prev_comm": old[0], "prev_tid": old[1], "prev_prio": old[2], "prev_state": state,
                "next_comm": new[0], "next_tid": new[1], "next_prio": new[2]}))

    # -- names ---------------------------------------------------------------------------------

    def suffix(self, app: App) -> str:
        return f" (pid {app.pid})" if len(self.apps) > 1 else ""

    def callback(self, c: SimCallback, app: App | None = None) -> str:
        return f"callback {c.logical_id}{self.suffix(app or self.apps[0])}"

    def thread(self, t: SimThread, app: App | None = None) -> str:
        return f"thread {t.tid}{self.suffix(app or self.apps[0])}"

    def expect(self, rule: str, subject: str, verdict: str) -> None:
        self.overrides[rule, subject] = verdict

    def tainted(self, c: SimCallback, app: App | None = None) -> None:
        """L5: on a tainted callback every rule that judges each instance is INCONCLUSIVE."""
        app = app or self.apps[0]
        for rule in ("M3", "E1", "E2", "R1", "R3", "R4", "R5"):
            self.expect(rule, self.callback(c, app), INCONCLUSIVE)
        self.expect("R2" if c.kind == "timer" else "Q1", self.callback(c, app), INCONCLUSIVE)
        for t in {r.thread for r in self.rows() if r.callback is c}:
            for rule in ("M2", "E3") + (("M6",) if app.executor == "isolated" else ()):
                self.expect(rule, self.thread(t, app), INCONCLUSIVE)
        for name, members in self.chains:
            if c in members:
                self.expect("Q2", f"chain {name}{self.suffix(app)}", INCONCLUSIVE)

    # -- taking events away --------------------------------------------------------------------

    def drop(self, gone: Callable[[Record], bool], declared: bool) -> list[Record]:
        """User events that never reach the trace; `declared`: the tracer counts them."""
        m = self.machine
        self.dropped = True
        doomed = [gone(r) for r in m.user]
        lost = [r for r, away in zip(m.user, doomed) if away]
        m.user = [r for r, away in zip(m.user, doomed) if not away]
        if declared:
            self.discarded_user += [(r.time, r.cpu) for r in lost]
        return lost

    # -- truth ---------------------------------------------------------------------------------

    def rows(self) -> list[Truth]:
        last = self.window_end or self.end
        rows = [r for a in self.apps for r in a.truth
                if self.window_begin <= r.start <= last and id(r) not in self.hidden]
        return sorted(rows, key=lambda r: (r.start, r.thread.tid))

    def end_of(self, r: Truth) -> int | None:
        return None if id(r) in self.unpaired else r.end

    def counted(self, r: Truth) -> bool:
        """It ended, and within the window."""
        end = self.end_of(r)
        return end is not None and end <= (self.window_end or self.end)

    def release(self, r: Truth) -> tuple[int, str]:
        """The release or its bound, and the source: the first available of four."""
        if r.release_known:
            return r.release, "exact"
        if r.app.executor == "isolated":
            if self.kernel and r.waking is not None and r.waking >= self.window_begin:
                return r.waking, "wakeup"
            if r.wakeup is not None:
                return r.wakeup, "wakeup"
        if r.sample and r.sample.stamp:
            return r.sample.stamp - self.machine.realtime_offset, "source_timestamp"
        return r.start, "start"

    def instances_csv(self) -> str:
        lines = ["logical_id,pid,tid,seq,release_ns,wakeup_ns,start_ns,end_ns,cpu_start,cpu_end,"
                 "execution_ns,preempted_ns,blocked_ns,release_source,waking_ns,wake_delay_ns,missed,status,"
                 "host"]
        for r in self.rows():
            release, source = self.release(r)
            end = self.end_of(r)
            parts = r.sums if self.kernel and end is not None else {}
            name = r.callback.logical_id
            if any(x in name for x in ',"'):
                name = '"' + name.replace('"', '""') + '"'
            row = [name, r.app.pid, r.thread.tid, r.seq, release, r.wakeup,
                   r.start, end, r.cpu_start, r.cpu_end if end is not None else None,
                   parts.get("run"), parts.get("preempted"), parts.get("blocked"), source,
                   r.waking if self.kernel else None, parts.get("wake"), r.missed,
                   r.status if end is not None else None, r.app.host]
            lines.append(",".join("" if x is None else str(x) for x in row))
        return "\n".join(lines) + "\n"

    def _is_whole(self, app: App) -> bool:
        """The recording has everything from the process's begin to its end."""
        shown = {id(r) for r in self.rows()}
        return (not self.dropped and self.window_end is None
                and any(r.name == "run_end" and r.vpid == app.pid for r in self.machine.user)
                and all(id(r) in shown for r in app.truth)
                and all(t >= self.window_begin for x in app.callbacks for t, _ in x.waiting))

    def _callback_report(self, c: SimCallback, app: App) -> dict[str, Any]:
        rows = [r for r in self.rows() if r.callback is c]
        done = [r for r in rows if self.counted(r)]
        exact = [r for r in done if r.release_known]
        inexact = [r for r in done if not r.release_known]
        tids: dict[int, int] = {}
        for r in rows:
            tids[r.thread.tid] = tids.get(r.thread.tid, 0) + self.counted(r)
        by_seq = {r.seq: r.release for r in exact}
        threads = {r.thread for r in rows}
        others = {r.callback for r in self.rows() if r.thread in threads}
        is_alone = others == {c} and (len(threads) == 1 or c in self.registered_anew)
        sources = {self.release(r)[1] for r in done}
        lower = [r.end - (self.release(r)[0] if self.release(r)[1] == "wakeup" else r.start)
                 for r in inexact]
        upper = [r.end - (r.sample.stamp - self.machine.realtime_offset) for r in inexact
                 if r.sample and r.sample.stamp]
        measured = done if self.kernel else []
        woken = [r for r in measured if r.waking is not None and r.switched_in is not None]
        queue = {}
        if c.kind != "subscription":
            queue["longest_queue"] = None
        elif self._is_whole(app) and any(x.waiting for a in self.apps for x in a.callbacks):
            queue["longest_queue"] = max((n for _, n in c.waiting), default=0)
        return queue | {
            "exceptions": sum(r.status == "exception" for r in done),
            "logical_id": c.logical_id, "pid": app.pid, "kind": c.kind, "source": c.source,
            "node": c.node, "symbol": f"app::{c.kind}_{c.id}", "group": c.group,
            "isolated": is_alone,
            "isolation": "never_ran" if not rows else "isolated" if is_alone else "not_isolated",
            "period_ns": c.period if c.kind == "timer" else None,
            "instances": len(done),
            "incomplete": sum(self.end_of(r) is None for r in rows),
            "missed_releases": sum(r.missed for r in rows) if c.kind == "timer" else None,
            "release_source": (None if not sources else "mixed" if len(sources) > 1
                               else next(iter(sources))),
            "threads": [{"tid": t, "instances": n} for t, n in sorted(tids.items())],
            "response_time_ns": summary([r.end - r.release for r in exact]),
            "response_time_lower_ns": summary(lower),
            "response_time_upper_ns": summary(upper),
            "start_latency_ns": summary([r.start - r.release for r in exact]),
            "duration_ns": summary([r.end - r.start for r in done]),
            "inter_arrival_ns": summary([by_seq[s + 1] - by_seq[s] for s in by_seq
                                         if s + 1 in by_seq]),
            "execution_time_ns": summary([r.sums["run"] for r in measured]),
            "preempted_ns": summary([r.sums["preempted"] for r in measured]),
            "blocked_ns": summary([r.sums["blocked"] for r in measured]),
            "wake_delay_ns": summary([r.sums["wake"] for r in measured]),
            "wakeup_latency_ns": summary([r.switched_in - r.waking for r in woken]),
        }

    def chain_paths(self, members: list[SimCallback]) -> list[list[Truth]]:
        """Chain instances by lineage: each sample knows the instance that published it."""
        paths = []
        for last in self.rows():
            if last.callback is not members[-1] or not self.counted(last):
                continue
            path = [last]
            for c in reversed(members[:-1]):
                source = path[0].sample.source if path[0].sample else None
                if source is None or source.callback is not c or source not in self.rows():
                    break
                path.insert(0, source)
            else:
                paths.append(path)
        return sorted(paths, key=lambda p: p[-1].end)

    def _chain_report(self, name: str, members: list[SimCallback]) -> dict[str, Any]:
        paths = self.chain_paths(members)
        exact = [p for p in paths if p[0].release_known]
        reads = [r.start for r in self.rows() if r.callback is members[0]]
        pairs = [(a, b) for a, b in zip(paths, paths[1:])]
        pids = {r.app.pid for p in paths for r in p}
        report = {"name": name, "hops": [c.logical_id for c in members], "instances": len(paths),
                  "path_latency_ns": summary([p[-1].end - p[0].release for p in exact])}
        if len({(r.app.pid) for r in (q for p in paths for q in p)}) <= 2:
            # From the first chain on, every read waits for the first chain that begins after it.
            answers = [(read, next((p[-1].end for p in paths if p[0].start > read), None))
                       for read in reads if paths and read >= paths[0][0].start]
            report["reaction_time_ns"] = summary([end - read for read, end in answers
                                                  if end is not None])
            report["data_age_ns"] = summary([b[-1].end - a[0].start for a, b in pairs])
        if paths:
            report["pid"] = next(iter(pids)) if len(pids) == 1 else None
        return report

    def report(self) -> dict[str, Any]:
        m = self.machine
        report = {
            "schema": "cie.report/2",
            "trace": {"events": len(m.user) + (len(m.kernel) if self.kernel else 0),
                      "streams": self.cpus * (2 if self.kernel else 1),
                      "lost_events": len(self.discarded_user) + len(self.discarded_kernel),
                      "begin_ns": self.window_begin, "end_ns": self.window_end or self.end},
            "processes": [{"pid": a.pid, "executor": a.executor} for a in self.apps],
            "callbacks": [self._callback_report(c, a) for a in self.apps for c in a.callbacks],
            "chains": [self._chain_report(name, members) for name, members in self.chains],
        }
        if not self.chains:
            del report["chains"]  # a spec without chains: none, or those seen?
        if "chains" in self.report_open:
            report.pop("chains", None)
        for c in report["callbacks"]:
            for key in self.report_open:
                c.pop(key, None)
        return report

    # -- verdicts ------------------------------------------------------------------------------

    def verify(self) -> dict[str, Any]:
        table: dict[str, dict[str, str]] = {rule: {} for rule in RULES}
        for rule in ("T1", "T2", "T5", "T6"):
            table[rule]["trace"] = PASS
        for app in self.apps:
            self._flawless(app, table)
        for name, members in self.chains:
            paths = self.chain_paths(members)
            apps = {r.app for p in paths for r in p}
            suffix = self.suffix(next(iter(apps))) if len(apps) == 1 else ""
            table["Q2"][f"chain {name}{suffix}"] = PASS if paths else INCONCLUSIVE
        for entry in self.extra_entries:
            table["M1"].setdefault(f"callback {entry['id']}", PASS)
        for entry in self.non_ros:
            table["M1"].setdefault(f"thread {entry['id']}", PASS)
        for (rule, subject), verdict in self.overrides.items():
            if verdict == "absent":
                table[rule].pop(subject, None)
            else:
                table[rule][subject] = verdict
        rules, overall = [], NOT_APPLICABLE
        for rule in RULES:
            subjects = table[rule]
            worst = max(subjects.values(), key=WEIGHT.__getitem__, default=NOT_APPLICABLE)
            if OPEN in subjects.values() and worst in (PASS, OPEN, NOT_APPLICABLE):
                worst = OPEN
            overall = max(overall, worst, key=WEIGHT.__getitem__)
            rules.append({"id": rule, "verdict": worst, "subjects": [
                {"subject": s, "verdict": v} for s, v in sorted(subjects.items())]})
        undecided = any(r["verdict"] == OPEN for r in rules)
        if self.require:
            overall = self.require
        elif undecided and overall == PASS:
            overall = OPEN
        return {"schema": "cie.verify/2", "verdict": overall, "rules": rules}

    def _flawless(self, app: App, table: dict[str, dict[str, str]]) -> None:
        rows = [r for r in self.rows() if r.app is app]
        table["T4"][f"process {app.pid}{self.suffix(app)}"] = PASS
        announced = [(t, role) for t, role, *_ in app.announced]
        real_time = any(t.priority for t, _ in announced)
        for t, role in announced:
            subject = self.thread(t, app)
            table["S3"][subject] = PASS if t.priority or role == "callback" else NOT_APPLICABLE
            table["S4"][subject] = PASS
            if real_time:
                table["S5"][subject] = PASS
        for t in {r.thread for r in rows}:
            subject = self.thread(t, app)
            mine = [r for r in rows if r.thread is t]
            together = len({r.callback for r in mine}) > 1
            table["M2"][subject] = FAIL if together else table["M2"].get(subject, PASS)
            table["M9"][subject] = PASS
            nested = any(a is not b and a.end and a.start <= b.start < a.end
                         for a in mine for b in mine)
            table["E3"][subject] = FAIL if nested else PASS
            if app.executor == "isolated":
                table["M6"][subject] = PASS
        for c in app.callbacks:
            self._flawless_callback(app, c, [r for r in rows if r.callback is c], table)

    def _flawless_callback(self, app: App, c: SimCallback, mine: list[Truth],
                           table: dict[str, dict[str, str]]) -> None:
        subject = self.callback(c, app)
        table["M7"][subject] = PASS
        if c.kind != "timer":
            table["Q1"][subject] = PASS
        if app.executor == "isolated":
            table["M8"][f"group {c.group}{self.suffix(app)}"] = PASS
            table["S1"][subject] = PASS
            if mine and mine[0].seq == 0:
                table["S2"][subject] = PASS
        if not mine:
            return
        for rule in ("T3", "M1", "M4", "E1", "R3", "R4"):
            table[rule][subject] = PASS
        threads = {r.thread for r in mine}
        table["M3"][subject] = FAIL if len(threads) > 1 else PASS
        overlap = any(a is not b and a.end and a.start <= b.start < a.end for a in mine for b in mine)
        table["E2"][subject] = FAIL if overlap else PASS
        done = [r for r in mine if self.end_of(r) is not None]
        by_seq = {r.seq: r.release for r in done}
        gaps = [by_seq[s + 1] - by_seq[s] for s in by_seq if s + 1 in by_seq]
        if gaps:
            table["R1"][subject] = (FAIL if min(gaps) <= max(r.end - r.release for r in done)
                                    else PASS)
            table["R5"][subject] = PASS
        if c.kind == "timer":
            table["R2"][subject] = PASS

    # -- writing -------------------------------------------------------------------------------

    def write(self, folder: Path) -> None:
        """trace/, spec.yaml, instances.csv, report.json, verify.json, how.json."""
        folder.mkdir(parents=True, exist_ok=True)
        m = self.machine
        user = [r for r in m.user if r.time >= self.window_begin]
        kernel = [r for r in m.kernel if r.time >= self.window_begin]
        m.user, m.kernel = user, kernel
        trace = folder / "trace"
        Writer(Layout("ust", **{**self.layout, **self.user_layout})).write(
            trace / "ust/uid/0/64-bit", user, self.cpus, self.window_begin, self.end,
            self.discarded_user)
        if self.kernel:
            Writer(Layout("kernel", **{**self.layout, **self.kernel_layout})).write(
                trace / "kernel", kernel, self.cpus, self.window_begin, self.end,
                self.discarded_kernel)
        for damage in self.damage:
            damage(trace)
        (folder / "spec.yaml").write_text(spec_text(self), encoding="utf-8")
        (folder / "instances.csv").write_text(self.instances_csv())
        for name, data in (("report", self.report()), ("verify", self.verify()),
                           ("how", {"scenario": self.name, "seed": self.seed,
                                    "weaker": self.weaker, "flips": self.flips, "recomputable": self.recomputable,
                                    "numbers": self.numbers, "traces": self.traces,
                                    "exact": self.exact, "exit_codes": self.exit_codes,
                                    "renamed": self.renamed})):
            (folder / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n")
