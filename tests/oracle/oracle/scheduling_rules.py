"""S1 to S5 and the kernel half of M6: thread parameters as read back and as the kernel shows them."""

from typing import TYPE_CHECKING, Any

from .entities import Callback, Thread
from .proof import spec_entry
from .text_trace import Event

if TYPE_CHECKING:
    from .rules import Judge

PASS, FAIL, INCONCLUSIVE, NOT_APPLICABLE = "PASS", "FAIL", "INCONCLUSIVE", "NOT_APPLICABLE"
POLICIES = {"SCHED_OTHER": 0, "SCHED_FIFO": 1, "SCHED_RR": 2, "SCHED_BATCH": 3, "SCHED_IDLE": 5,
            "SCHED_DEADLINE": 6}
REAL_TIME = (1, 2, 6)
RESET_ON_FORK = 1


def parameters(e: Event) -> tuple[Any, ...]:
    """What of a read-back is compared: what its policy uses, and the CPUs."""
    cpus = tuple(sorted(e.cpus))
    if e.policy in (1, 2):
        return (e.policy, e.priority, cpus)
    if e.policy == 6:
        return (e.policy, e.runtime_ns, e.deadline_ns, e.period_ns, cpus)
    return (e.policy, e.nice, cpus)


def kernel_priority(e: Event) -> int:
    """On the kernel's own scale: 99 - rt, -1 for deadline, 120 + nice."""
    if e.policy in (1, 2):
        return 99 - e.priority
    return -1 if e.policy == 6 else 120 + e.nice


def applied(t: Thread) -> list[Event]:
    """Its `applied` read-backs; attached late its first audit stands for them."""
    found = [e for e in t.scheds if e.moment == "applied"]
    if not found and t.process.announced_late:
        found = [e for e in t.scheds if e.moment == "audit"][:1]
    return found


def last_applied_of(c: Callback) -> Event | None:
    found = [e for t in c.process.threads if t.isolated and t.init.callback_id == c.id
             for e in applied(t)]
    return max(found, key=lambda e: e.time) if found else None


def read_backs_tainted(j: "Judge", c: Callback) -> bool:
    return any(j.proof.thread_tainted(t) for t in c.process.threads
               if t.isolated and t.init.callback_id == c.id)


def judged(entry: dict[str, Any]) -> bool:
    return entry.get("policy") is not None or bool(entry.get("affinity"))


def matches(entry: dict[str, Any], e: Event) -> bool | None:
    """None: the recording is too old to tell."""
    policy = entry.get("policy")
    if policy is not None:
        if POLICIES[policy] != e.policy:
            return False
        if e.policy in (1, 2) and entry.get("priority") is not None and (
                entry["priority"] != e.priority):
            return False
        if e.policy in (0, 3) and entry.get("nice") is not None and entry["nice"] != e.nice:
            return False
        if e.policy == 6:
            for key, value in (("runtime", e.runtime_ns), ("deadline", e.deadline_ns),
                               ("period", e.period_ns)):
                if entry.get(key) is not None and entry[key] != value:
                    return False
    if entry.get("affinity") and sorted(entry["affinity"]) != sorted(e.cpus):
        return False
    asked = [(entry[key], e.fields.get(field)) for key, field in
             (("slice", "slice_ns"), ("uclamp_min", "util_min"), ("uclamp_max", "util_max"))
             if entry.get(key) is not None]
    if any(value is not None and value != wanted for wanted, value in asked):
        return False
    if entry.get("uclamp_min") is not None and e.fields.get("util_max") == 0:
        return False  # the kernel has no clamps
    return None if any(value is None for _, value in asked) else True


def is_changing(t: Thread, time: int) -> bool:
    """An audit before told that the parameters change, and no `applied` followed yet."""
    changing, applied_change = False, 0
    for e in t.scheds:
        if e.time >= time:
            break
        change = e.fields.get("change", 0)
        if e.moment == "applied":
            changing, applied_change = False, change
        elif e.moment == "audit" and change > applied_change:
            changing = True
    return changing


def began_with_spec(j: "Judge", t: Thread) -> bool | None:
    """None: which spec the process began with was not seen."""
    begins = t.process.begins
    if not begins or begins[0].moment != "start":
        return None
    return begins[0].spec_sha256 == j.spec_sha256


def judge(j: "Judge") -> None:
    for t in j.model.all_threads():
        if not t.init:
            if t.instances:
                j.put("S4", j.thread(t), INCONCLUSIVE)  # no read-back
            unknown = t.instances and not j.proof.whole[t.process]
            for c in {i.callback for i in t.instances} if unknown else ():
                if c.known and spec_entry(j.spec, c.logical_id):
                    j.put("S1", j.callback(c), INCONCLUSIVE)
                    j.put("S2", j.callback(c), INCONCLUSIVE)
            continue
        if t.isolated:
            c = t.process.callbacks.get(t.init.callback_id)
            entry = spec_entry(j.spec, c.logical_id) if c and c.known else None
            if entry and judged(entry):
                j.put("S1", j.callback(c), _as_specified(j, t, entry))
                j.put("S2", j.callback(c), _before_first(j, t, c, entry))
        elif t.role == "worker":
            for entry in (j.spec or {}).get("non_ros_threads") or []:
                if entry["id"] == t.name and judged(entry):
                    j.put("S1", j.thread(t), _as_specified(j, t, entry))
        j.put("S3", j.thread(t), _unchanged(j, t))
        j.put("S4", j.thread(t), _allowed_cpus(j, t))
    _leaks(j)


def unended_change(t: Thread) -> bool:
    """A change began that was not seen to end."""
    found = applied(t)
    last = found[-1].fields.get("change", 0) if found else 0
    return any(e.fields.get("change", 0) > last for e in t.scheds)


def _as_specified(j: "Judge", t: Thread, entry: dict[str, Any]) -> str:
    started = _started_otherwise(j, t, entry)
    if started == FAIL:
        return FAIL
    found = applied(t)
    if not found or j.proof.hole_after(t, found[-1].n) or unended_change(t):
        return INCONCLUSIVE
    fits = matches(entry, found[-1])
    return INCONCLUSIVE if fits is None else started if fits else FAIL


def _had_another_spec(j: "Judge", t: Thread, begin: int, end: int) -> bool:
    """The process told of a reload, and had another spec than the one that is judged by meanwhile."""
    begins = t.process.begins
    if j.spec_sha256 not in [b.spec_sha256 for b in begins]:
        return False
    until = [b.time for b in begins[1:]] + [2**63]
    return any(b.spec_sha256 != j.spec_sha256 and b.time < end and until[k] > begin
               for k, b in enumerate(begins))


def _started_otherwise(j: "Judge", t: Thread, entry: dict[str, Any]) -> str:
    """Of each instance since the first parameters that match: those read back last before it."""
    found = applied(t)
    fitting = [e for e in found if matches(entry, e)]
    if not fitting:
        return PASS
    verdict = PASS
    for k, e in enumerate(t.scheds):
        following = t.scheds[k + 1].time if k + 1 < len(t.scheds) else 2**63
        wrong = e.moment != "initial" and e.n > fitting[0].n and matches(entry, e) is False
        if not wrong or is_changing(t, e.time + 1) or _had_another_spec(j, t, e.time, following):
            continue
        started = [i for i in t.instances if e.time <= i.start <= following]
        if any(e.time < i.start < following for i in started) and j.proof.certain_between(t, e.time):
            return FAIL
        if started or any(j.proof.callback_tainted(i.callback) for i in t.instances):
            verdict = INCONCLUSIVE
    hidden = [e.n for e in t.scheds if fitting[0].n <= e.n <= found[-1].n]
    if hidden and len(set(hidden)) != found[-1].n - fitting[0].n + 1:
        return INCONCLUSIVE
    return verdict


def _before_first(j: "Judge", t: Thread, c: Callback, entry: dict[str, Any]) -> str:
    fitting = [e for e in applied(t) if matches(entry, e)]
    first = [i for i in c.instances if i.seq == 0]
    if not first:
        lost = c.base == 0 and c.starts or c.base == 0 and c.fini and c.fini.started
        return INCONCLUSIVE if lost else NOT_APPLICABLE
    if first[0].start < j.model.window[0] or first[0].thread is not t:
        return NOT_APPLICABLE
    if not fitting:
        return INCONCLUSIVE if j.proof.thread_tainted(t) else NOT_APPLICABLE
    if fitting[0].fields.get("change", 0) and not (began := began_with_spec(j, t)):
        # What ran before ran as the former spec said.
        return INCONCLUSIVE if began is None or j.proof.thread_tainted(t) else NOT_APPLICABLE
    if fitting[0].time <= first[0].start:
        return PASS
    before = [e.n for e in t.scheds if e.n <= fitting[0].n]
    whole = len(set(before)) == fitting[0].n + 1
    return FAIL if whole else INCONCLUSIVE


def _inheritance(j: "Judge", t: Thread) -> list[Event]:
    """What the kernel told of the priorities that it inherited, in order of time."""
    return [e for e in j.model.events
            if e.name == "sched_pi_setprio" and e.host == t.process.host and e.tid == t.tid]


def _boosted(j: "Judge", t: Thread, time: int) -> bool:
    """Within a priority-inheritance interval, edges included. A lower priority is never inherited."""
    boosted = False
    for e in _inheritance(j, t):
        if e.time > time:
            break
        base = _base_priority(t, e.time, j)
        boosted = e.time == time or (base is not None and e.newprio < base)
    return boosted


def _may_be_boosted(j: "Judge", t: Thread, reference: Event, time: int) -> bool:
    """Who waited for it before may be more urgent than what was applied then; no event tells. Until it runs as that."""
    told = [e.time for e in _inheritance(j, t) if e.time <= time]
    if not told or told[-1] > reference.time:
        return False
    own = kernel_priority(reference)
    return not any(e.name == "sched_switch" and reference.time <= e.time < time and
                   _switch_priority(j, t, e) >= own for e in t.kernel)


def _switch_priority(j: "Judge", t: Thread, e: Event) -> int:
    prio: int = e.prev_prio if e.prev_tid == t.tid else e.next_prio
    return prio + j.model.prio_offset


def _is_taken_back(j: "Judge", t: Thread, time: int, own: int) -> bool:
    """Whether the kernel's next word on its inheritance ends it: so it inherited, if no event told since when."""
    later = [e for e in _inheritance(j, t) if e.time > time]
    return bool(later) and later[0].newprio + j.model.prio_offset == own


def _base_priority(t: Thread, time: int, j: "Judge") -> int | None:
    before = [e for e in applied(t) if e.time <= time]
    return kernel_priority(before[-1]) - j.model.prio_offset if before else None


def _unchanged(j: "Judge", t: Thread) -> str:
    found = applied(t)
    if not found:
        return NOT_APPLICABLE
    audits, switches, verdict = 0, 0, PASS
    is_untold = False  # what it runs with since is perhaps inherited
    for e in t.scheds:
        before = [a for a in found if a.time < e.time or a.n < e.n]
        if e.moment == "audit" and before and not is_changing(t, e.time):
            audits += 1
            if parameters(e) != parameters(before[-1]) and j.proof.certain_between(t, e.time - 1):
                verdict = FAIL
    for e in t.kernel:
        if e.name != "sched_switch" or is_changing(t, e.time):
            continue
        before = [a for a in found if a.time <= e.time]
        if not before:
            continue
        prio = _switch_priority(j, t, e)
        own = kernel_priority(before[-1])
        is_taken_back = prio < own and _is_taken_back(j, t, e.time, own)
        may_be_boosted = prio < own and _may_be_boosted(j, t, before[-1], e.time)
        is_untold = not is_taken_back and may_be_boosted or is_untold and prio < own
        switches += not may_be_boosted
        # A higher one may be inherited, by an event that is lost.
        is_excused = may_be_boosted or is_taken_back or (
            prio < own and _lossy(j, t.process.host, before[-1].time, e.time))
        if prio != own and not is_excused and (
                not _boosted(j, t, e.time) and j.proof.certain_between(t, e.time)):
            verdict = FAIL
    if verdict == PASS and not audits and (
            not switches or is_untold or _lossy(j, t.process.host, t.first_seen, t.last_seen)):
        return INCONCLUSIVE
    return j.soften(verdict, j.proof.thread_tainted(t) or unended_change(t), "R")


def _lossy(j: "Judge", host: str, begin: int, end: int) -> bool:
    """The kernel's record is not whole between the two."""
    return j.model.kernel_lacks_cpus(host) or j.model.kernel_gap(host, begin, end)


def _allowed_cpus(j: "Judge", t: Thread) -> str:
    if not t.scheds:
        return INCONCLUSIVE
    seen = [(e.time, e.cpu) for e in t.user]
    seen += [(e.time, e.cpu) for e in t.kernel if e.name == "sched_switch"]
    checked, verdict = 0, PASS
    for time, cpu in seen:
        before = [e for e in t.scheds if e.time <= time]
        if before and before[-1].cpus and not is_changing(t, time):
            checked += 1
            allowed = set(before[-1].cpus)
            if before[-1].moment == "initial":  # it may be on its way to where it is sent
                following = [e for e in t.scheds if e.time > time][:1]
                allowed |= {c for e in following if e.moment == "applied" for c in e.cpus}
            if cpu not in allowed and j.proof.certain_between(t, time):
                verdict = FAIL
    if not checked:
        return NOT_APPLICABLE
    return j.soften(verdict, j.proof.thread_tainted(t) or unended_change(t), "R")


def _leaks(j: "Judge") -> None:
    threads = [t for t in j.model.all_threads() if t.init]
    if not any(e.policy in REAL_TIME for t in threads for e in t.scheds):
        return
    for t in threads:
        first = [e for e in t.scheds if e.moment == "initial"]
        if first:
            leaked = first[0].policy in REAL_TIME  # whatever it was given afterwards
            j.put("S5", j.thread(t), FAIL if leaked else PASS)
    announced = {(t.process.host, t.tid) for t in threads}
    for fork in (e for e in j.model.events if e.name == "sched_process_fork"):
        parent = [t for t in threads if t.tid == fork.parent_tid and t.process.host == fork.host]
        read = [e for t in parent for e in t.scheds if e.time <= fork.time]
        if not read or read[-1].policy not in REAL_TIME or (fork.host, fork.child_tid) in announced:
            continue
        child = next((e for e in j.model.events if e.time >= fork.time
                      and e.name == "sched_switch" and e.next_tid == fork.child_tid), None)
        if child and not _lossy(j, fork.host, fork.time, child.time):
            prio = child.next_prio + j.model.prio_offset
            subject = j.name("thread", fork.child_tid, parent[0].process)
            if prio >= 100 or prio == kernel_priority(read[-1]):  # else it was given that
                j.put("S5", subject, PASS if prio >= 100 else FAIL)


def foreign_work(j: "Judge", t: Thread) -> None:
    """M6, kernel's half: on-CPU time outside callbacks, from the first wait to the end."""
    c = t.process.callbacks.get(t.init.callback_id)
    entry = spec_entry(j.spec, c.logical_id) if c and c.known else None
    budget = (entry or {}).get("foreign_work_budget")
    if budget is None:
        return
    if not j.model.has_kernel:
        j.put("M6", j.thread(t), INCONCLUSIVE)
        return
    switches = [e for e in t.kernel if e.name == "sched_switch"]
    waits = [e.time for e in switches if e.prev_tid == t.tid and e.prev_state & 0xFF]
    end = t.exit if t.exit is not None else j.model.window[1]
    if not waits or end <= waits[0]:
        return
    total, since = 0, None
    spans = [(i.start, i.end if i.end is not None else end) for i in t.instances]

    def outside(a: int, b: int) -> int:
        return b - a - sum(max(0, min(b, y) - max(a, x)) for x, y in spans)

    for e in switches:
        if e.time < waits[0]:
            continue
        if e.next_tid == t.tid:
            since = e.time
        elif since is not None:
            total += outside(since, min(e.time, end))
            since = None
    if since is not None and since < end:
        total += outside(since, end)
    verdict = FAIL if total * 10**9 > budget * (end - waits[0]) else PASS
    gap = _lossy(j, t.process.host, waits[0], end)
    j.put("M6", j.thread(t), j.soften(verdict, gap, "R"))
