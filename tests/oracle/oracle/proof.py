"""What is proved to be whole: totals against what was seen, per process, callback and thread."""

from typing import Any

from .entities import Callback, Instance, Process, Thread
from .model import Model
from .text_trace import Event


def contiguous(seqs: list[int]) -> bool:
    seen = set(seqs)
    return not seen or len(seen) == max(seen) - min(seen) + 1


def _running_total(events: list[Event], first: str, count: int, process: Process) -> int | None:
    """How many there were in all, by an event that numbers itself from 0; None: cannot know."""
    if events:
        return min(e.fields[first] for e in events) + count
    return None if process.announced_late else 0


class Proof:
    """Loss judged per subject (L2, L5)."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.callback_jump = {c: self._callback_jump(c) for c in model.all_callbacks()}
        self.callback_totals = {c: self._callback_totals(c) for c in model.all_callbacks()}
        self.publisher_jump = {(p, k): self._publisher_jump(p, k) for p in model.processes
                               for k in set(p.publishers) | set(p.publishes)}
        self.thread_jump = {t: self._thread_jump(t) for t in model.all_threads()}
        self.whole = {p: self._process_whole(p) for p in model.processes}

    def callback_tainted(self, c: Callback) -> bool:
        return self.callback_jump[c] or bool(self.callback_totals[c] and c.process.end)

    def thread_tainted(self, t: Thread) -> bool:
        return self.thread_jump[t] or (self._read_backs_missing(t) and t.process.end is not None)

    def publisher_tainted(self, process: Process, publisher: int) -> bool:
        return self.publisher_jump.get((process, publisher), False) or (
            process.end is not None and self._publisher_totals(process, publisher))

    def all_whole(self) -> bool:
        return bool(self.whole) and all(self.whole.values())

    def _callback_jump(self, c: Callback) -> bool:
        seqs = [e.seq for e in c.starts]
        if not contiguous(seqs):
            return True
        if seqs and c.inits and min(seqs) > c.inits[0].next_seq:
            return True
        if self._end_missing(c):
            return True
        starts_proved = c.fini is not None and c.base is not None and (
            c.fini.started == c.base + len(set(seqs)))
        if starts_proved or not seqs:
            return False
        return any(e.seq > max(seqs) for e in c.ends)

    def _end_missing(self, c: Callback) -> bool:
        """A hole in the numbers of the ends, but for instances that have none: they never ended, as
        the totals say, or were running when the record of a crash ended."""
        started, ended = {e.seq for e in c.starts}, {e.seq for e in c.ends}
        if not started or not ended:
            return False
        holes = set(range(min(started), max(ended))) - ended
        if not holes:
            return False
        if c.fini is not None:
            return (len(started - ended) > max(0, c.fini.started - c.fini.ended)
                    or c.base == 0 and len(c.ends) < c.fini.ended)

        def ran_on(i: Instance) -> bool:
            return all(x.start <= i.start and (x.end or 0) <= i.start for x in i.thread.instances)

        running = {i.seq for i in c.instances if i.end is None and ran_on(i)}
        return bool(holes - running)

    def _callback_totals(self, c: Callback) -> list[str]:
        """The totals of callback_fini that disagree with what was seen."""
        if c.fini is None or c.base is None:
            return []
        wrong = []
        if c.fini.started != c.base + len({e.seq for e in c.starts}):
            wrong.append("started")
        if c.fini.ended != c.base + len([e for e in c.ends if e.seq >= c.base]):
            wrong.append("ended")
        released = _running_total(c.releases, "release_seq", len(c.releases), c.process)
        if released is not None and released != c.fini.released:
            wrong.append("released")
        lost = c.lost[-1].total if c.lost else (None if c.process.announced_late else 0)
        if lost is not None and lost != c.fini.lost:
            wrong.append("lost")
        return wrong

    def _publisher_jump(self, p: Process, publisher: int) -> bool:
        seqs = [e.seq for e in p.publishes.get(publisher, [])]
        init = p.publishers.get(publisher)
        return not contiguous(seqs) or bool(seqs and init and min(seqs) > init.next_seq)

    def _publisher_totals(self, p: Process, publisher: int) -> bool:
        fini, init = p.publisher_finis.get(publisher), p.publishers.get(publisher)
        if fini is None or init is None:
            return False
        seqs = {e.seq for e in p.publishes.get(publisher, [])}
        return fini.published != min({init.next_seq} | seqs) + len(seqs)

    def _thread_jump(self, t: Thread) -> bool:
        ns = [e.n for e in t.scheds]
        if not contiguous(ns):
            return True
        return bool(ns) and min(ns) > 0 and not t.process.announced_late

    def _read_backs_missing(self, t: Thread) -> bool:
        if t.fini is None:
            return False
        if not t.scheds:
            return t.fini.read_backs > 0 and not t.process.announced_late
        return t.fini.read_backs != max(e.n for e in t.scheds) + 1

    def hole_after(self, t: Thread, n: int) -> bool:
        """Whether a read-back later than number n may be missing."""
        later = [e.n for e in t.scheds if e.n >= n]
        return not contiguous(later) or self._read_backs_missing(t)

    def certain_between(self, t: Thread, time: int) -> bool:
        """Whether no read-back is missing between the last one before `time` and the next one."""
        before = [e.n for e in t.scheds if e.time <= time]
        after = [e.n for e in t.scheds if e.time > time]
        if not before:
            return False
        if after:
            return min(after) == max(before) + 1
        return not self._read_backs_missing(t)

    def _process_whole(self, p: Process) -> bool:
        if not p.begins or p.end is None:
            return False
        registered = [c for c in p.callbacks.values() if c.known]
        seen = {"callbacks": len(registered), "threads": sum(t.init is not None for t in p.threads),
                "groups": len(p.groups), "publishers": len(p.publishers)}
        if any(p.end.fields[k] != n for k, n in seen.items()):
            return False
        if any(c.fini is None or self.callback_totals[c] for c in registered):
            return False
        if any(self._publisher_totals(p, k) for k in p.publishers):
            return False
        return not any(self._read_backs_missing(t) for t in p.threads)


def spec_entry(spec: dict[str, Any] | None, logical_id: str) -> dict[str, Any] | None:
    """The entry for a callback: an exact id wins over a `<node>/*` wildcard."""
    entries = (spec or {}).get("callback_groups") or []
    for entry in entries:
        if entry.get("id") == logical_id:
            return entry
    for entry in entries:
        if str(entry.get("id", "")).endswith("/*") and logical_id.split("@")[0] == entry["id"][:-2]:
            return entry
    return None
