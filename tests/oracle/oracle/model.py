"""Who did what in a trace: lifetimes, incarnations and instances, by the definitions."""

from bisect import bisect_left
from collections import defaultdict
from typing import Any

from . import packets
from .entities import Callback, Instance, Process, Thread
from .text_trace import Event, read_events


class Model:
    """Everything one set of traces says. Build it with `load`."""

    def __init__(self, events: list[Event], streams: list[packets.Stream]) -> None:
        self.all_events = events
        self.events = [e for e in events if e.is_user or e.host not in unrelated_hosts(streams)]
        self.streams = streams
        self.losses = packets.losses(streams)
        self.window = packets.window(streams, "ust") or (0, 2**63)
        self.kernel_window = packets.window(
            [s for s in streams if s.hostname not in unrelated_hosts(streams)], "kernel")
        self.has_kernel = any(e.name == "sched_switch" for e in self.events)
        self.has_wakings = any(e.name == "sched_waking" for e in self.events)
        self.kernel_spans = {
            (s.hostname, s.cpu): (s.packets[0].begin, s.packets[-1].end) for s in streams
            if s.domain == "kernel" and s.packets and s.hostname not in unrelated_hosts(streams)}
        self.processes: list[Process] = []
        self.instances: list[Instance] = []
        self.unpaired_ends: list[Event] = []
        self.second_ends: list[Event] = []
        self.by_pid: dict[tuple[str, int], list[Process]] = defaultdict(list)
        self.writers: dict[int, tuple[Process, Event]] = {}
        self.offsets: dict[str, list[tuple[int, int]]] = defaultdict(list)
        # By the idle thread's priority; LTTng's scale where no CPU was ever idle.
        self.prio_offset = 100 if any(s.tracer == "lttng-modules" for s in streams) else 0
        self.kernel_gaps = self._kernel_gaps()
        self._lacking: dict[str, bool] = {}
        self._find_processes()
        self._find_threads()
        self._register()
        self._kernel_timelines()
        self._pair()
        for instance in self.instances:
            self._finish(instance)

    # -- who -----------------------------------------------------------------------------------

    def _find_processes(self) -> None:
        seen = {(e.host, e.vpid) for e in self.events if e.is_user and e.name != "cie:clock_sync"}
        for host, pid in sorted(seen, key=lambda k: (k[0], k[1] if k[1] is not None else -1)):
            for e in self.events:
                if e.name == "cie:run_begin" and (e.host, e.vpid) == (host, pid):
                    for process in self.by_pid[host, pid]:
                        if process.start_ns == e.process_start_ns:
                            process.begins.append(e)
                            break
                    else:
                        process = Process(host, pid, e.process_start_ns, [e])
                        self.by_pid[host, pid].append(process)
            if not self.by_pid[host, pid]:
                self.by_pid[host, pid].append(Process(host, pid, None))
            self.processes.extend(self.by_pid[host, pid])
        for e in self.events:
            process = self.process_of(e)
            if process:
                process.events += e.name != "cie:clock_sync"
                process.last_event = e.time
            if e.name in ("cie:clock_sync", "cie:run_begin"):
                self.offsets[e.host].append((e.time, e.realtime_ns - e.monotonic_ns))

    def process_of(self, e: Event) -> Process | None:
        lives = self.by_pid.get((e.host, e.vpid)) if e.is_user else None
        if not lives:
            return None
        best = lives[0]
        for life in lives:
            if life.start_ns is not None and life.start_ns <= e.time:
                best = life
        return best

    def _find_threads(self) -> None:
        for e in self.events:
            if e.name != "cie:thread_init":
                continue
            process = self.process_of(e)
            for thread in process.threads:
                if thread.tid == e.tid and thread.start_ns == e.start_ns:
                    break
            else:
                process.threads.append(Thread(process, e.tid, e.start_ns, e))
        for e in self.events:
            if e.name == "cie:thread_fini":
                thread = self.thread_at(self.process_of(e), e.tid, e.time, create=False)
                if thread:
                    thread.fini = e
                    thread.exit = e.time

    def thread_at(self, process: Process, tid: int, time: int, create: bool = True) -> Thread | None:
        lives = [t for t in process.threads if t.tid == tid]
        best: Thread | None = None
        for life in lives:
            if life.start_ns is not None and life.start_ns <= time:
                if best is None or best.start_ns is None or life.start_ns > best.start_ns:
                    best = life
        after = 0
        if best and best.exit is not None and best.exit < time:
            after = best.exit
            later = [t for t in lives if t.start_ns is None and t.first_seen > best.exit]
            best = later[0] if later else (None if create else best)
        if best is None:
            unknown = [t for t in lives if t.start_ns is None]
            best = unknown[-1] if unknown else None
        if best is None and create:
            best = Thread(process, tid, None, after=after)
            process.threads.append(best)
        return best

    # -- state events --------------------------------------------------------------------------

    def _register(self) -> None:
        for e in self.events:
            process = self.process_of(e)
            if process is None:
                continue
            if e.name not in ("cie:clock_sync",) and e.vtid is not None:
                interesting = e.name in ("cie:callback_start", "cie:callback_end", "cie:publish",
                                         "cie:thread_wakeup", "cie:sample_lost",
                                         "cie:callback_release")
                thread = self.thread_at(process, e.vtid, e.time,
                                        create=e.name == "cie:callback_start")
                if thread and (interesting or thread.init):
                    thread.user.append(e)
            match e.name.removeprefix("cie:"):
                case "run_end":
                    process.end = e
                case "node_init":
                    process.nodes[e.node_id] = e.fields["name"]
                case "group_init":
                    process.groups.setdefault(e.group_id, e)
                case "callback_init":
                    process.callback(e.callback_id).inits.append(e)
                case "callback_fini":
                    process.callback(e.callback_id).fini = e
                case "callback_release":
                    process.callback(e.callback_id).releases.append(e)
                case "sample_lost":
                    process.callback(e.callback_id).lost.append(e)
                case "publisher_init":
                    process.publishers.setdefault(e.publisher_id, e)
                    self.writers.setdefault(e.writer_gid, (process, e))
                case "publisher_fini":
                    process.publisher_finis[e.publisher_id] = e
                case "publish":
                    process.publishes[e.publisher_id].append(e)
                case "thread_sched":
                    thread = self.thread_at(process, e.tid, e.time, create=False)
                    if thread:
                        thread.scheds.append(e)

    # -- kernel --------------------------------------------------------------------------------

    def _kernel_gaps(self) -> list[tuple[str, int, int, int | None]]:
        """Intervals (host, begin, end, CPU) in which kernel events are missing."""
        gaps = [(x.hostname, x.begin, x.end, x.cpu) for x in self.losses
                if x.domain == "kernel" and x.hostname not in unrelated_hosts(self.streams)]
        last: dict[tuple[str, int], Event] = {}
        for e in self.events:
            if e.name == "sched_switch":
                before = last.get((e.host, e.cpu))
                if before is not None and before.next_tid != e.prev_tid:
                    gaps.append((e.host, before.time, e.time, e.cpu))
                last[e.host, e.cpu] = e
                if 0 in (e.prev_tid, e.next_tid):
                    prio = e.prev_prio if e.prev_tid == 0 else e.next_prio
                    self.prio_offset = 120 - prio
        return gaps

    def kernel_gap(self, host: str, begin: int, end: int, cpu: int | None = None) -> bool:
        return any(h in (host, "") and b <= end and e >= begin
                   and (cpu is None or c is None or c == cpu) for h, b, e, c in self.kernel_gaps)

    def kernel_lacks_cpus(self, host: str) -> bool:
        """The host has a CPU of which there is no kernel stream."""
        if host not in self._lacking:
            covered = {c for h, c in self.kernel_spans if h == host}
            seen = {e.cpu for e in self.events if e.is_user and e.host == host}
            seen |= {e.fields["dest_cpu"] for e in self.events if e.host == host
                     and e.name == "sched_migrate_task" and "dest_cpu" in e.fields}
            seen |= {e.fields["target_cpu"] for e in self.events if e.host == host
                     and e.name == "sched_wakeup" and "target_cpu" in e.fields}
            seen |= {c for e in self.events if e.host == host and e.name == "cie:thread_sched"
                     for c in e.fields.get("cpus") or []}
            online = max((e.fields.get("online_cpus", 0) for e in self.events
                          if e.name == "cie:run_begin" and e.host == host), default=0)
            self._lacking[host] = bool(covered) and (online > len(covered) or not seen <= covered)
        return self._lacking[host]

    def confined(self, thread: Thread, begin: int, end: int) -> bool:
        """It may use none but CPUs with a kernel stream, as it was read back before."""
        before = [e for e in thread.scheds if e.time <= end]
        from_begin = [e for e in before if e.time >= begin]
        before_begin = [e for e in before if e.time < begin][-1:]
        return bool(before_begin or from_begin) and all(
            e.cpus and all((thread.process.host, c) in self.kernel_spans for c in e.cpus)
            for e in before_begin + from_begin)

    def ran_unrecorded(self, thread: Thread) -> bool:
        """It emitted an event on a CPU whose kernel stream was not open while another's was."""
        spans = {c: s for (h, c), s in self.kernel_spans.items() if h == thread.process.host}
        return any(not spans.get(e.cpu, (1, 0))[0] <= e.time <= spans.get(e.cpu, (1, 0))[1]
                   and any(a <= e.time <= b for a, b in spans.values()) for e in thread.user)

    def _kernel_timelines(self) -> None:
        by_tid: dict[tuple[str, int], list[Thread]] = defaultdict(list)
        for process in self.processes:
            for thread in process.threads:
                by_tid[process.host, thread.tid].append(thread)
        for lives in by_tid.values():
            lives.sort(key=lambda t: t.first_seen if t.user or t.start_ns is not None else 0)

        gone: set[Thread] = set()  # what has their tid now is not theirs

        def owner(host: str, tid: int, time: int) -> Thread | None:
            best = None
            for life in by_tid.get((host, tid), []):
                if (life.after if life.start_ns is None else life.start_ns) <= time:
                    best = life
            return None if best in gone else best

        for e in self.events:
            tids = set()
            if e.name == "sched_switch":
                tids = {e.prev_tid, e.next_tid}
            elif e.name in ("sched_waking", "sched_wakeup"):
                tids = {e.tid}
            elif e.name == "sched_process_exit":
                tids = {e.tid}
            for tid in tids:
                thread = owner(e.host, tid, e.time)
                if thread is None:
                    continue
                thread.kernel.append(e)
                has_left = e.name == "sched_switch" and e.prev_tid == tid and e.prev_state & 0x30
                if (has_left or e.name == "sched_process_exit") and thread.exit is None:
                    thread.exit = e.time
                if has_left:
                    gone.add(thread)

    # -- instances -----------------------------------------------------------------------------

    def _pair(self) -> None:
        ended: set[tuple[Process, int, int]] = set()
        wakings: dict[Thread, list[Event]] = {}
        boundary: dict[Thread, int] = {}
        for process in self.processes:
            for thread in process.threads:
                wakings[thread] = [e for e in thread.kernel if e.name.startswith("sched_wak")]
                boundary[thread] = thread.start_ns if thread.start_ns is not None else -1
        for e in self.events:
            process = self.process_of(e)
            if process is None or e.vtid is None:
                continue
            if e.name == "cie:callback_start":
                callback = process.callback(e.callback_id)
                callback.starts.append(e)
                thread = self.thread_at(process, e.vtid, e.time)
                instance = Instance(process, callback, thread, e)
                if thread.open:
                    instance.nested_in = thread.open[-1]
                instance.wakeup = thread.wakeup
                since = boundary[thread]
                near = [w for w in wakings[thread] if since <= w.time <= e.time]
                kind = "sched_waking" if self.has_wakings else "sched_wakeup"
                of_kind = [w.time for w in near if w.name == kind]
                if of_kind:
                    instance.waking = of_kind[-1]
                host = process.host
                if instance.waking is not None and (
                        self.kernel_lacks_cpus(host) or not self.kernel_window
                        or not self.kernel_window[0] <= instance.waking <= e.time
                        or not e.time <= self.kernel_window[1]
                        or self.kernel_gap(host, instance.waking, e.time)):
                    instance.waking = None  # it may not be the last one
                if instance.waking is not None:
                    ins = [k.time for k in thread.kernel if k.name == "sched_switch"
                           and k.next_tid == thread.tid and instance.waking <= k.time <= e.time]
                    instance.switched_in = ins[0] if ins else None
                thread.open.append(instance)
                thread.instances.append(instance)
                callback.instances.append(instance)
                self.instances.append(instance)
            elif e.name == "cie:callback_end":
                callback = process.callback(e.callback_id)
                callback.ends.append(e)
                thread = self.thread_at(process, e.vtid, e.time, create=False)
                mine = [i for i in (thread.open if thread else [])
                        if i.callback is callback and i.seq == e.seq]
                if mine:
                    mine[-1].end_event = e
                    thread.open.remove(mine[-1])
                    ended.add((process, e.callback_id, e.seq))
                elif (process, e.callback_id, e.seq) in ended:
                    self.second_ends.append(e)
                else:
                    self.unpaired_ends.append(e)
                if thread:
                    boundary[thread] = e.time
                    thread.wakeup = None
            elif e.name == "cie:thread_wakeup":
                thread = self.thread_at(process, e.vtid, e.time, create=False)
                if thread:
                    thread.wakeup = e.time
            elif e.name == "cie:publish":
                thread = self.thread_at(process, e.vtid, e.time, create=False)
                for instance in thread.open if thread else []:
                    instance.publishes.append(e)

    def monotonic(self, host: str, realtime: int, near: int) -> int | None:
        """A realtime of `host` on its monotonic clock, by the last clock_sync before `near`."""
        offsets = self.offsets.get(host)
        if not offsets:
            return None
        at = bisect_left(offsets, (near, 2**70))
        return realtime - offsets[max(0, at - 1)][1]

    def _finish(self, i: Instance) -> None:
        s = i.start_event
        writer = self.writers.get(s.writer_gid) if s.source_timestamp_realtime_ns else None
        if writer and writer[0].host == i.process.host:
            i.source_time = self.monotonic(i.process.host, s.source_timestamp_realtime_ns, i.start)
        if s.release_kind != "none" and 0 <= s.release_ns <= i.start:
            i.release, i.release_source = s.release_ns, "exact"
        elif i.thread.isolated and (i.waking is not None or i.wakeup is not None):
            i.release = min(t for t in (i.waking, i.wakeup) if t is not None)
            i.release_source = "wakeup"
        elif i.source_time is not None:
            i.release, i.release_source = i.source_time, "source_timestamp"
        else:
            i.release, i.release_source = i.start, "start"
        i.cut = i.start < self.window[0] or (i.end is not None and i.end > self.window[1])
        if i.end is not None and self.has_kernel:
            self._measure(i)

    def _measure(self, i: Instance) -> None:
        begin, end, tid = i.start, i.end, i.thread.tid
        host = i.process.host
        if self.kernel_window and not self.kernel_window[0] <= begin <= end <= self.kernel_window[1]:
            return
        stays = not any(e.name == "sched_switch" and e.prev_tid == tid and begin <= e.time < end
                        for e in i.thread.kernel)
        if self.kernel_gap(host, begin, end, i.start_event.cpu if stays else None):
            return
        lacks = self.kernel_lacks_cpus(host)
        if lacks and not stays and not self.confined(i.thread, begin, end):
            return
        user = [e for e in i.thread.user if begin <= e.time <= end]
        if any((host, e.cpu) not in self.kernel_spans for e in user):
            return
        is_split_known = True
        sums = {"run": 0, "preempted": 0, "blocked": 0, "waking": 0}
        state, since = "run", begin
        merged = sorted([(e.time, 1, e.order, e) for e in i.thread.kernel if begin <= e.time <= end]
                        + [(e.time, 1 if e.name == "cie:callback_end" else 0, -1, e) for e in user],
                        key=lambda x: x[:3])
        for time, _, _, e in merged:
            new = state
            if e.is_user:
                if state != "run" and since != time:
                    return  # it runs, though no switch says so: events are missing
            elif e.name == "sched_switch" and e.prev_tid == tid and e.next_tid != tid:
                if state != "run" and time > begin:
                    return
                new = "preempted" if (e.prev_state & 0xFF) == 0 else "blocked"
            elif e.name == "sched_switch" and e.next_tid == tid:
                if state == "run" and time > begin:
                    return
                is_split_known &= state != "blocked"
                new = "run"
            elif e.name in ("sched_waking", "sched_wakeup") and state == "blocked":
                new = "waking"
            if new != state:
                sums[state] += time - since
                state, since = new, time
        if state != "run" and since != end:
            return
        sums[state] += end - since
        assert sum(sums.values()) == end - begin
        i.execution, i.preempted = sums["run"], sums["preempted"]
        # Who woke it may have done so on a CPU without a record.
        if is_split_known and not (lacks and sums["blocked"] + sums["waking"] > 0):
            i.blocked, i.wake_delay = sums["blocked"], sums["waking"]

    # -- answers -------------------------------------------------------------------------------

    def listed(self) -> list[Instance]:
        begin, end = self.window
        rows = [i for i in self.instances
                if i.start <= end and (i.end is None or i.end >= begin)]
        return sorted(rows, key=lambda i: (i.start, i.thread.tid))

    def all_callbacks(self) -> list[Callback]:
        """By pid, then in order of creation."""
        return [p.callbacks[k] for p in sorted(self.processes, key=lambda p: (p.pid, p.start_ns or 0))
                for k in sorted(p.callbacks)]

    def all_threads(self) -> list[Thread]:
        return [t for p in sorted(self.processes, key=lambda p: (p.pid, p.start_ns or 0))
                for t in sorted(p.threads, key=lambda t: (t.tid, t.start_ns or 0))]


def unrelated_hosts(streams: list[packets.Stream]) -> set[str]:
    """Hosts whose kernel trace has another clock than their user-space traces: no evidence."""
    clocks: dict[str, set[str]] = defaultdict(set)
    for s in streams:
        if s.domain == "ust":
            clocks[s.hostname].add(s.clock_uuid)
    return {s.hostname for s in streams if s.domain == "kernel" and s.hostname in clocks
            and clocks[s.hostname] != {s.clock_uuid}}


def load(traces: list[str]) -> tuple[Model, str]:
    events, warnings = read_events(traces)
    return Model(events, packets.read_streams(traces)), warnings


COLUMNS = ("logical_id,pid,tid,seq,release_ns,wakeup_ns,start_ns,end_ns,cpu_start,cpu_end,"
           "execution_ns,preempted_ns,blocked_ns,release_source,waking_ns,wake_delay_ns,missed,"
           "status,host")


def csv_cell(value: Any) -> str:
    if value is None:
        return ""
    text = str(value)
    if any(c in text for c in ',"\n\r'):
        return '"' + text.replace('"', '""') + '"'
    return text


def instances_csv(model: Model) -> str:
    lines = [COLUMNS]
    for i in model.listed():
        row = [i.callback.logical_id, i.process.pid, i.thread.tid, i.seq, i.release, i.wakeup,
               i.start, i.end, i.start_event.cpu, i.end_event.cpu if i.end_event else None,
               i.execution, i.preempted, i.blocked, i.release_source, i.waking, i.wake_delay,
               i.missed, i.end_event.status if i.end_event else None, i.process.host]
        lines.append(",".join(csv_cell(cell) for cell in row))
    return "\n".join(lines) + "\n"
