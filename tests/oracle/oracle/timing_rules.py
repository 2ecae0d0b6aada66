"""R1 to R5, Q1 and Q2: times, queues and chains against what is declared."""

from typing import TYPE_CHECKING, Any

from .chains import Chain
from .entities import Callback
from .proof import spec_entry
from .report import chains_of, inter_arrivals, lower_bound, upper_bound

if TYPE_CHECKING:
    from .rules import Judge

PASS, FAIL, INCONCLUSIVE, NOT_APPLICABLE = "PASS", "FAIL", "INCONCLUSIVE", "NOT_APPLICABLE"


def judge(j: "Judge") -> None:
    for c in j.model.all_callbacks():
        if not c.known:
            continue
        entry = spec_entry(j.spec, c.logical_id) or {}
        tainted = j.proof.callback_tainted(c)
        subject = j.callback(c)
        j.put("R1", subject, j.soften(_arrival(c, entry), tainted, "L"))
        if c.kind == "timer":
            j.put("R2", subject, j.soften(_missed(c, entry), tainted, "R"))
        deadline = entry.get("response_deadline") or c.inits[0].deadline_ns
        if deadline:
            j.put("R3", subject, j.soften(_deadline(j, c, deadline), tainted, "R"))
        if entry.get("wcet") is not None:
            j.put("R4", subject, j.soften(_budget(j, c, entry["wcet"]), tainted, "R"))
        if entry.get("min_inter_arrival") is not None or (
                entry.get("max_inter_arrival") is not None):
            j.put("R5", subject, j.soften(_rate(c, entry), tainted, "L"))
        if c.kind != "timer":
            j.put("Q1", subject, j.soften(_queue(c, entry), tainted, "R"))
    for chain, bounds in zip(chains_of(j.model, j.spec), (j.spec or {}).get("chains") or []):
        _chain(j, chain, bounds)


def _arrival(c: Callback, entry: dict[str, Any]) -> str:
    counted = [i for i in c.instances if i.counted]
    if len(counted) < 2:
        return NOT_APPLICABLE
    if c.kind == "waitable" and entry.get("min_inter_arrival") is None:
        return NOT_APPLICABLE
    arrivals = inter_arrivals(counted)
    responses = [i.end - i.release for i in counted if i.exact]
    if arrivals and responses and min(arrivals) <= max(responses):
        return FAIL
    return PASS if all(i.exact for i in counted) else INCONCLUSIVE


def _missed(c: Callback, entry: dict[str, Any]) -> str:
    if not c.instances:
        return NOT_APPLICABLE
    if sum(i.missed for i in c.instances) > (entry.get("missed_releases_allowed") or 0):
        return FAIL
    return PASS if all(i.exact for i in c.instances) else INCONCLUSIVE


def _deadline(j: "Judge", c: Callback, deadline: int) -> str:
    verdict = NOT_APPLICABLE
    for i in c.instances:
        if i.end is None:
            never = c.fini and c.fini.ended < c.fini.started and not j.proof.callback_tainted(c)
            if never and j.model.window[1] - i.release > deadline:
                return FAIL
            continue
        if i.cut:
            continue
        lower = i.end - i.release if i.exact else lower_bound(i)
        upper = i.end - i.release if i.exact else upper_bound(i)
        if lower > deadline:
            return FAIL
        if upper is None or upper > deadline:
            verdict = INCONCLUSIVE
        elif verdict == NOT_APPLICABLE:
            verdict = PASS
    return verdict


def _budget(j: "Judge", c: Callback, wcet: int) -> str:
    verdict = NOT_APPLICABLE
    for i in c.instances:
        if not i.counted:
            continue
        if i.execution is not None and i.execution > wcet:
            return FAIL
        if i.execution is None and i.end - i.start > wcet:
            verdict = INCONCLUSIVE
        elif verdict == NOT_APPLICABLE:
            verdict = PASS
    return verdict


def _rate(c: Callback, entry: dict[str, Any]) -> str:
    counted = [i for i in c.instances if i.counted]
    arrivals = inter_arrivals(counted)
    low, high = entry.get("min_inter_arrival"), entry.get("max_inter_arrival")
    if any((low is not None and a < low) or (high is not None and a > high) for a in arrivals):
        return FAIL
    if any(not i.exact for i in counted):
        return INCONCLUSIVE
    return PASS if arrivals else NOT_APPLICABLE


def _queue(c: Callback, entry: dict[str, Any]) -> str:
    allowed = entry.get("overwrites_allowed") or 0
    overwritten = max([e.overwritten for e in c.releases], default=0)
    lost = max([e.total for e in c.lost], default=0)
    if c.fini:
        overwritten, lost = max(overwritten, c.fini.overwritten), max(lost, c.fini.lost)
    if lost > 0 or overwritten > allowed:
        return FAIL
    running = c.process.announced_late and c.releases
    return PASS if c.fini or running else INCONCLUSIVE


def _chain(j: "Judge", chain: Chain, bounds: dict[str, Any]) -> None:
    checks = (("path_latency", chain.path_latencies()),
              ("reaction_time", chain.reaction_times()),
              ("data_age", chain.data_ages()))
    declared = [(key, values, bounds[key]) for key, values in checks if bounds.get(key) is not None]
    if not declared:
        return
    members = [c for c in j.model.all_callbacks() if c.logical_id in chain.hops]
    pids = {i.process for c in chain.instances for i in c.instances}
    subject = j.name("chain", chain.name, next(iter(pids)) if len(pids) == 1 else None)
    tainted = any(j.proof.callback_tainted(c) for c in members)
    for process in j.model.processes:
        for publisher, init in process.publishers.items():
            if any(c.source == init.topic for c in members):
                tainted |= j.proof.publisher_tainted(process, publisher)
    failed = any(v > bound for _, values, bound in declared for v in values)
    allowed = bounds.get("path_latency")
    unmeasured = [c for c in chain.instances if not c.measured] if allowed is not None else []
    failed |= any(c.write - c.read > allowed for c in unmeasured)
    inexact = any(c.latest_latency is None or c.latest_latency > allowed for c in unmeasured)
    unseen = any(not values for key, values, _ in declared if key != "path_latency" or not unmeasured)
    verdict = FAIL if failed else INCONCLUSIVE if inexact or unseen else PASS
    j.put("Q2", subject, j.soften(verdict, tainted or chain.broken > 0, "L"))
