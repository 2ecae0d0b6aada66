"""The report of the contract as plain data, quantiles exact from all values."""

from typing import Any

from .chains import Chain, ChainFinder
from .entities import Callback, Instance, Thread
from .model import Model
from .packets import whole_window
from .proof import Proof, contiguous
from .succession import succession


def summary(values: list[int]) -> dict[str, Any] | None:
    """Nearest-rank quantiles, exact."""
    if not values:
        return None
    ordered = sorted(values)
    n = len(ordered)

    def quantile(permille: int) -> int:
        return ordered[max(1, -(-permille * n // 1000)) - 1]

    return {"count": n, "min": ordered[0], "max": ordered[-1], "sum": sum(ordered),
            "mean": sum(ordered) / n, "p50": quantile(500), "p90": quantile(900),
            "p99": quantile(990), "p99_9": quantile(999)}


def lower_bound(i: Instance) -> int:
    """Of the response time of an inexact, ended instance."""
    if i.release_source == "wakeup":
        return i.end - i.release
    return i.end - i.start


def upper_bound(i: Instance) -> int | None:
    """Empty where the clock was set meanwhile: no message is written after it was taken."""
    return i.end - i.source_time if i.source_time is not None and i.source_time <= i.start else None


def inter_arrivals(instances: list[Instance]) -> list[int]:
    """Of consecutive seqs, both exact."""
    by_seq = {i.seq: i for i in instances if i.exact}
    return [by_seq[s + 1].release - by_seq[s].release for s in sorted(by_seq) if s + 1 in by_seq]


def longest_queue(callback: Callback, proof: Proof, has_releases: bool) -> int | None:
    """The most samples that were released, not overwritten, and whose instance had not started."""
    numbers = [e.release_seq for e in callback.releases]
    unended = callback.process.end is not None and callback.fini is None
    if callback.kind != "subscription" or not has_releases or not contiguous(numbers):
        return None
    if proof.callback_tainted(callback) or unended:
        return None
    longest, first = 0, callback.inits[0].next_seq
    for e in callback.releases:
        before = [s.seq + 1 for s in callback.starts if (s.time, s.order) < (e.time, e.order)]
        longest = max(longest, e.release_seq + 1 - e.overwritten - max([first] + before))
    return longest


def isolation(callback: Callback, proof: Proof) -> str | None:
    """One thread at a time, replaced only with a new registration, which ran nothing else."""
    threads = {i.thread for i in callback.instances}
    if not threads:
        return "never_ran"
    together, moved, lost = succession(callback, proof)
    if together or any(i.callback is not callback for t in threads for i in t.instances):
        return "not_isolated"
    if moved and all(t.init for t in threads):
        return "not_isolated"
    return None if moved or lost else "isolated"  # moved: a callback_init may be missing as well


def callback_report(callback: Callback, proof: Proof, has_releases: bool) -> dict[str, Any]:
    counted = [i for i in callback.instances if i.counted]
    exact = [i for i in counted if i.exact]
    inexact = [i for i in counted if not i.exact]
    threads: dict[Thread, int] = {}
    for i in callback.instances:
        threads[i.thread] = threads.get(i.thread, 0) + (1 if i.counted else 0)
    init = callback.inits[0] if callback.inits else None
    sources = {i.release_source for i in counted}
    uppers = [u for i in inexact if (u := upper_bound(i)) is not None]
    return {
        "logical_id": callback.logical_id,
        "pid": callback.process.pid,
        "node": callback.process.nodes.get(init.node_id, "") if init else "",
        "kind": callback.kind,
        "source": callback.source,
        "symbol": init.symbol if init else "",
        "period_ns": init.period_ns if callback.kind == "timer" else None,
        "group": init.group_id if init else None,
        "threads": [{"tid": t.tid, "name": t.name, "instances": n}
                    for t, n in sorted(threads.items(), key=lambda x: x[0].tid)],
        "isolated": isolation(callback, proof) == "isolated",
        "isolation": isolation(callback, proof),
        "instances": len(counted),
        "incomplete": sum(i.end is None for i in callback.instances),
        "exceptions": sum(i.end_event.status == "exception" for i in counted),
        "missed_releases": (sum(i.missed for i in callback.instances)
                            if callback.kind == "timer" else None),
        "longest_queue": longest_queue(callback, proof, has_releases),
        "release_source": (None if not sources else "mixed" if len(sources) > 1
                           else next(iter(sources))),
        "response_time_ns": summary([i.end - i.release for i in exact]),
        "response_time_lower_ns": summary([lower_bound(i) for i in inexact]),
        "response_time_upper_ns": summary(uppers),
        "start_latency_ns": summary([i.start - i.release for i in exact]),
        "duration_ns": summary([i.end - i.start for i in counted]),
        "inter_arrival_ns": summary(inter_arrivals(counted)),
        "execution_time_ns": summary([i.execution for i in counted if i.execution is not None]),
        "preempted_ns": summary([i.preempted for i in counted if i.preempted is not None]),
        "blocked_ns": summary([i.blocked for i in counted if i.blocked is not None]),
        "wake_delay_ns": summary([i.wake_delay for i in counted if i.wake_delay is not None]),
        "wakeup_latency_ns": summary([i.switched_in - i.waking for i in counted
                                      if i.switched_in is not None]),
    }


def chain_report(chain: Chain) -> dict[str, Any]:
    measured = [c for c in chain.instances if c.measured]
    hops = []
    for k, hop in enumerate(chain.hops):
        last = k == len(chain.hops) - 1
        processing = [c.left(k) - c.instances[k].release for c in measured if c.instances[k].exact]
        communication = [c.instances[k + 1].release - c.left(k) for c in measured
                         if not last and c.instances[k + 1].exact]
        hops.append({"from": hop, "to": None if last else chain.hops[k + 1],
                     "processing_ns": summary(processing),
                     "communication_ns": summary(communication)})
    pids = {i.process.pid for c in chain.instances for i in c.instances}
    said = {"name": chain.name, "pid": next(iter(pids)) if len(pids) == 1 else None,
            "hops": chain.hops, "instances": len(chain.instances),
            "path_latency_ns": summary(chain.path_latencies()),
            "reaction_time_ns": summary(chain.reaction_times()),
            "data_age_ns": summary(chain.data_ages()), "hop_table": hops}
    if undivided := [c.undivided for c in measured if not c.divided]:
        said["undivided_ns"] = summary(undivided)
    return said


def chains_of(model: Model, spec: dict[str, Any] | None) -> list[Chain]:
    finder = ChainFinder(model)
    if spec is not None:
        return [finder.find(c["name"], c["callbacks"]) for c in spec.get("chains") or []]
    paths = [[c.logical_id for c in path] for path in finder.maximal_paths()]
    found = [finder.find(" -> ".join(path), path) for path in sorted(paths)]
    return [chain for chain in found if chain.instances]


def busy(thread: Thread, model: Model) -> int | None:
    """On-CPU time; None where it is not known without a hole."""
    if not model.has_kernel:
        return None
    host, begin, end = thread.process.host, thread.first_seen, thread.last_seen
    if model.kernel_gap(host, begin, end) or model.ran_unrecorded(thread):
        return None
    if model.kernel_lacks_cpus(host) and not model.confined(thread, begin, 2**63):
        return None
    total, since, left = 0, None, None
    seen = [e for e in thread.kernel if e.name == "sched_switch"] + thread.user
    for e in sorted(seen, key=lambda e: (e.time, e.is_user, e.order)):
        if e.is_user:  # it runs, whatever was seen before, unless it left in this very nanosecond
            since = e.time if since is None and left != e.time else since
        elif e.next_tid == thread.tid:
            since = e.time
        elif since is not None:
            total += e.time - since
            since, left = None, e.time
    return total


def report(model: Model, spec: dict[str, Any] | None, complete: bool | None) -> dict[str, Any]:
    threads = []
    for t in model.all_threads():
        last = t.scheds[-1] if t.scheds else None
        threads.append({
            "pid": t.process.pid, "tid": t.tid, "name": t.name, "role": t.role,
            "callbacks": sorted({i.callback.logical_id for i in t.instances}),
            "sched": ({"policy": last.policy, "priority": last.priority, "nice": last.nice,
                       "cpus": last.cpus} if last else None),
            "busy_ns": busy(t, model)})
    proof = Proof(model)
    has_releases = any(e.name == "cie:callback_release" for e in model.events)
    lost = [x.count for x in model.losses]
    whole = whole_window(model.streams)
    return {
        "schema": "cie.report/2",
        "trace": {"begin_ns": whole[0] if whole else None, "end_ns": whole[1] if whole else None,
                  "events": len(model.all_events), "streams": len(model.streams),
                  "hosts": sorted({e.host for e in model.all_events}),
                  "lost_events": (None if None in lost or any(s.damaged for s in model.streams)
                                  else sum(lost)),
                  "complete": complete},
        "processes": [{"host": p.host, "pid": p.pid,
                       "executor": p.begins[0].executor if p.begins else None}
                      for p in sorted(model.processes, key=lambda p: (p.pid, p.start_ns or 0))],
        "callbacks": [callback_report(c, proof, has_releases) for c in model.all_callbacks()],
        "threads": threads,
        "chains": [chain_report(c) for c in chains_of(model, spec)],
    }
