"""The verdict of every rule on every subject, straight from the table of rules."""

from collections import defaultdict
from typing import Any

from . import scheduling_rules, timing_rules
from .entities import NONE, Callback, Process, Thread
from .model import Model
from .proof import Proof
from .succession import succession

NAMES = {
    "T1": "trace-readable", "T2": "no-loss", "T3": "seq-contiguous", "T4": "run-complete",
    "T5": "required-events", "T6": "time-sane", "M1": "specified-callback-seen",
    "M2": "one-callback-per-thread", "M3": "one-thread-per-callback", "M4": "mapping-persistent",
    "M5": "mapping-survives-restart", "M6": "no-foreign-work", "M7": "unique-logical-id",
    "M8": "single-callback-group", "M9": "thread-known", "S1": "parameters-as-specified",
    "S2": "parameters-before-first-callback", "S3": "parameters-unchanged",
    "S4": "allowed-cpus-only", "S5": "no-parameter-leak", "E1": "start-end-paired",
    "E2": "non-reentrant", "E3": "no-nesting", "R1": "arrival-exceeds-turnaround",
    "R2": "no-missed-release", "R3": "deadline", "R4": "budget", "R5": "rate",
    "Q1": "no-queue-overflow", "Q2": "chain-bounds"}
WEIGHT = {"NOT_APPLICABLE": 0, "PASS": 1, "INCONCLUSIVE": 2, "FAIL": 3}
PASS, FAIL, INCONCLUSIVE, NOT_APPLICABLE = "PASS", "FAIL", "INCONCLUSIVE", "NOT_APPLICABLE"


class Judge:
    """Collects verdicts; several for one subject leave the worst."""

    def __init__(self, model: Model, spec: dict[str, Any] | None, spec_sha256: str) -> None:
        self.model = model
        self.spec = spec
        self.spec_sha256 = spec_sha256
        self.proof = Proof(model)
        self.verdicts: dict[str, dict[str, str]] = {rule: {} for rule in NAMES}
        self.several = len(model.processes) > 1

    def put(self, rule: str, subject: str, verdict: str) -> None:
        old = self.verdicts[rule].get(subject, NOT_APPLICABLE)
        self.verdicts[rule][subject] = max(old, verdict, key=WEIGHT.__getitem__)

    def name(self, kind: str, what: Any, process: Process | None) -> str:
        suffix = f" (pid {process.pid})" if self.several and process else ""
        return f"{kind} {what}{suffix}"

    def callback(self, c: Callback) -> str:
        return self.name("callback", c.logical_id, c.process)

    def thread(self, t: Thread) -> str:
        return self.name("thread", t.tid, t.process)

    def soften(self, verdict: str, tainted: bool, law: str) -> str:
        """What loss leaves of a verdict: of an R rule its FAIL, of an L rule nothing."""
        if tainted and (law == "L" or verdict != FAIL) and verdict != NOT_APPLICABLE:
            return INCONCLUSIVE
        return verdict

    def thread_ran_tainted(self, t: Thread) -> bool:
        return any(self.proof.callback_tainted(i.callback) for i in t.instances)

    def result(self) -> dict[str, Any]:
        rules = []
        for rule, subjects in self.verdicts.items():
            worst = max(subjects.values(), key=WEIGHT.__getitem__, default=NOT_APPLICABLE)
            rules.append({"id": rule, "name": NAMES[rule], "verdict": worst, "subjects": [
                {"subject": s, "verdict": v} for s, v in sorted(subjects.items())]})
        overall = max((r["verdict"] for r in rules), key=WEIGHT.__getitem__)
        return {"schema": "cie.verify/2",
                "verdict": INCONCLUSIVE if overall == NOT_APPLICABLE else overall, "rules": rules}


def judge(model: Model, spec: dict[str, Any] | None, spec_sha256: str = "") -> dict[str, Any]:
    j = Judge(model, spec, spec_sha256)
    _mapping(j)
    scheduling_rules.judge(j)
    _pairing(j)
    timing_rules.judge(j)
    _trace(j)  # last: T2 asks what loss has cost the others
    return j.result()


def _trace(j: Judge) -> None:
    m, proof = j.model, j.proof
    j.put("T1", "trace", INCONCLUSIVE if any(s.damaged for s in m.streams) else PASS)
    for c in m.all_callbacks():
        if c.known and (c.starts or proof.callback_jump[c]):
            j.put("T3", j.callback(c), INCONCLUSIVE if proof.callback_jump[c] else PASS)
    for (process, publisher), jump in proof.publisher_jump.items():
        if jump and publisher in process.publishers:
            j.put("T3", j.name("topic", process.publishers[publisher].topic, process), INCONCLUSIVE)
    for t, jump in proof.thread_jump.items():
        if jump:
            j.put("T3", j.thread(t), INCONCLUSIVE)
    for p in m.processes:
        j.put("T4", j.name("process", p.pid, p), PASS if proof.whole[p] else INCONCLUSIVE)
    seen = {e.name for e in m.events}
    needed = {f"cie:{n}" for n in ("run_begin", "callback_init", "thread_init", "callback_start",
                                   "callback_end")}
    contexts = all(e.vpid is not None and e.vtid is not None for e in m.events if e.is_user)
    j.put("T5", "trace", PASS if needed <= seen and contexts else INCONCLUSIVE)
    clocks = {s.clock_uuid for s in m.streams}
    impossible = any(i.start_event.release_kind != "none" and i.start_event.release_ns > i.start
                     for i in m.instances if i.start_event)
    j.put("T6", "trace", PASS if len(clocks) <= 1 and not impossible else INCONCLUSIVE)
    user_loss = any(x.domain == "ust" for x in m.losses)
    unproved = INCONCLUSIVE in j.verdicts["T3"].values() or any(
        p.end and not proof.whole[p] for p in m.processes)
    cost = user_loss and unproved  # holes in the kernel's record cost only what needs it (L6)
    j.put("T2", "trace", INCONCLUSIVE if cost else PASS)


def _mapping(j: Judge) -> None:
    m, proof = j.model, j.proof
    _specified_seen(j)
    if any(e.name == "cie:callback_start" and e.vpid is not None and e.vtid is None
           for e in m.events):  # on what threads is unknown
        for rule in ("M2", "M4", "M6", "M9", "E3"):
            j.put(rule, "trace", INCONCLUSIVE)
    for t in m.all_threads():
        if t.instances:
            callbacks = {i.callback for i in t.instances}
            verdict = FAIL if len(callbacks) > 1 else PASS
            unknown = any(not c.known for c in callbacks)
            j.put("M2", j.thread(t), j.soften(verdict, unknown or j.thread_ran_tainted(t), "R"))
            j.put("M9", j.thread(t), PASS if t.init else
                  FAIL if proof.whole[t.process] else INCONCLUSIVE)
            if not t.init and not proof.whole[t.process]:
                j.put("M6", j.thread(t), INCONCLUSIVE)
                for c in callbacks:
                    if c.known:
                        j.put("M8", j.name("group", c.inits[0].group_id, c.process), INCONCLUSIVE)
        if t.isolated:
            _isolated_thread(j, t)
    for c in m.all_callbacks():
        if c.known:
            _threads_of(j, c)
            twins = [d for d in c.process.callbacks.values()
                     if d is not c and d.logical_id == c.logical_id and _alive_together(c, d)]
            unseen = _has_unseen_callbacks(c.process)
            j.put("M7", j.callback(c), FAIL if twins else INCONCLUSIVE if unseen else PASS)
    _restarts(j)


def _has_unseen_callbacks(process: Process) -> bool:
    """run_end counts callbacks of which there is no event at all: they may have any id."""
    whole = process.end is not None and process.begins and not process.announced_late
    return bool(whole and process.end.fields["callbacks"] > len(process.callbacks))


def _specified_seen(j: Judge) -> None:
    spec = j.spec or {}
    asked = [str(e["id"]) for e in spec.get("callback_groups") or []]
    asked += [member for chain in spec.get("chains") or [] for member in chain["callbacks"]]
    missing = FAIL if j.proof.all_whole() else INCONCLUSIVE
    for name in dict.fromkeys(a for a in asked if not a.endswith("/*")):
        found = [c for c in j.model.all_callbacks() if c.logical_id == name]
        ran = [c for c in found if c.starts or (c.fini and c.fini.started) or (c.base or 0) > 0]
        if not found:
            j.put("M1", f"callback {name}", missing)
        for c in ran or found:
            j.put("M1", j.callback(c), PASS if ran else missing)
    names = {t.name for t in j.model.all_threads() if t.init and t.role != "callback"}
    for entry in spec.get("non_ros_threads") or []:
        j.put("M1", f"thread {entry['id']}", PASS if entry["id"] in names else missing)


def _alive_together(c: Callback, d: Callback) -> bool:
    end = 2**63
    c_end, d_end = (x.fini.time if x.fini else end for x in (c, d))
    return c.inits[0].time < d_end and d.inits[0].time < c_end


def _threads_of(j: Judge, c: Callback) -> None:
    """M3 and M4: threads alive together, or one after the other."""
    if not c.instances:
        return
    together, moved, lost = succession(c, j.proof)
    verdict = FAIL if together else INCONCLUSIVE if lost else PASS
    end = c.process.end
    if end and sum(t.init is not None for t in c.process.threads) < end.threads:
        lost |= any(t.init is None and t.fini is None for t in {i.thread for i in c.instances})  # its end is lost, too
    j.put("M3", j.callback(c), j.soften(verdict, j.proof.callback_tainted(c), "R"))
    j.put("M4", j.callback(c), FAIL if moved else INCONCLUSIVE if lost else PASS)


def _isolated_thread(j: Judge, t: Thread) -> None:
    process = t.process
    own, group = t.init.callback_id, t.init.group_id
    if group == NONE:
        registered = process.callbacks.get(own)
        group = registered.inits[0].group_id if registered and registered.known else NONE
    if t.instances:
        foreign = any(i.callback.id != own
                      and not (i.callback.known and i.callback.inits[0].group_id == group)
                      for i in t.instances)
        verdict = j.soften(FAIL if foreign else PASS, j.thread_ran_tainted(t), "R")
        j.put("M6", j.thread(t), verdict)
    scheduling_rules.foreign_work(j, t)
    members = [c for c in process.callbacks.values() if c.known and c.inits[0].group_id == group]
    subject = j.name("group", f"of thread {t.tid}" if group == NONE else group, process)
    init = process.groups.get(group)
    if len(members) > 1 or (init and init.type == "reentrant"):
        j.put("M8", subject, FAIL)
    else:
        j.put("M8", subject, PASS if init and members else INCONCLUSIVE)


def _has_never_run(j: Judge, c: Callback) -> bool:
    """Nothing is missing, and it neither ran nor had a thread that was read back."""
    read = any(t.scheds for t in c.process.threads if t.isolated and t.init.callback_id == c.id)
    ran = c.starts or c.ends or c.base or not c.fini or c.fini.started
    return not ran and not read and j.proof.whole[c.process]


def _restarts(j: Judge) -> None:
    """M5: each lifetime against the last one before it that ran or was read back."""
    lives: dict[tuple[str, str], list[Callback]] = defaultdict(list)
    for c in j.model.all_callbacks():
        if c.logical_id:
            lives[c.process.host, c.logical_id].append(c)
    for callbacks in lives.values():
        callbacks.sort(key=lambda c: c.process.start_ns or 0)
        for k, new in enumerate(callbacks):
            before = [c for c in callbacks[:k] if not _has_never_run(j, c)]
            if not before or new.process.start_ns is None:
                continue
            old = before[-1]
            if old.process is new.process:
                continue
            if old.process.last_event >= new.process.start_ns:
                continue
            a, b = old.inits[0], new.inits[0]
            same = old.source == new.source and all(
                a.fields[k] == b.fields[k] for k in ("kind", "period_ns", "deadline_ns"))
            x, y = scheduling_rules.last_applied_of(old), scheduling_rules.last_applied_of(new)
            if x and y:
                same &= scheduling_rules.parameters(x) == scheduling_rules.parameters(y)
            unproved = bool(x) != bool(y) or any(
                j.proof.callback_tainted(c) or scheduling_rules.read_backs_tainted(j, c)
                for c in (old, new))
            told = old.fini or old.process.end or old.process.pid == new.process.pid
            verdict = j.soften(PASS if same else FAIL, unproved or not (same or told), "L")
            j.put("M5", j.callback(new), verdict)


def _pairing(j: Judge) -> None:
    m, proof = j.model, j.proof
    for c in m.all_callbacks():
        if not c.instances or not c.known:
            continue
        tainted = proof.callback_tainted(c)
        paired, witnessed = _paired(j, c)
        # Events that are there, one too many, are no artefact of loss; absence may be.
        j.put("E1", j.callback(c), j.soften(paired, tainted and not witnessed, "L"))
        ordered = sorted(c.instances, key=lambda i: i.start)
        overlap = any(a.end is not None and b.start < a.end
                      for k, a in enumerate(ordered) for b in ordered[k + 1:])
        j.put("E2", j.callback(c), j.soften(FAIL if overlap else PASS, tainted, "L"))
    for t in m.all_threads():
        if t.instances:
            nested = any(i.nested_in and i.nested_in.end is not None for i in t.instances)
            j.put("E3", j.thread(t),
                  j.soften(FAIL if nested else PASS, j.thread_ran_tainted(t), "L"))


def _paired(j: Judge, c: Callback) -> tuple[str, bool]:
    """The verdict of E1, and whether it rests on an end that should not be there."""
    clean = c.process.end is not None
    again = [e for e in j.model.second_ends
             if e.callback_id == c.id and j.model.process_of(e) is c.process]
    unpaired = [e for e in j.model.unpaired_ends if e.callback_id == c.id
                and j.model.process_of(e) is c.process and e.seq >= min(s.seq for s in c.starts)]
    if again or (c.fini and any(e.seq >= c.fini.started for e in unpaired)):
        return FAIL, True
    if c.fini and clean and c.fini.started != c.fini.ended:
        return FAIL, False
    last = max(e.seq for e in c.starts)
    # Open at the end of a crashed process: cut by the edge. Open before a later start: unpaired.
    opened = [i for i in c.instances if i.end is None and (clean or i.seq < last)]
    return INCONCLUSIVE if opened or unpaired else PASS, False
