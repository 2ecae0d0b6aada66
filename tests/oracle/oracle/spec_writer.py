"""The scheduling spec of a generated trace."""

import json
from typing import TYPE_CHECKING, Any

from .sim_entities import SimCallback

if TYPE_CHECKING:
    from .scenario import Scenario

MS = 1_000_000


def spec_text(s: "Scenario") -> str:
    """The scheduling spec whose limits this run keeps, with what the scenario changes in it."""
    lines, seen = ["callback_groups:"], set()
    for app in s.apps:
        for c in app.callbacks:
            if c.logical_id not in seen:
                seen.add(c.logical_id)
                lines += _entry({"id": s.spec_ids.get(c.logical_id, c.logical_id),
                                 **_limits(s, c)})
    for entry in s.extra_entries:
        lines += _entry(entry)
    lines.append("non_ros_threads:" + (" []" if not s.non_ros else ""))
    for entry in s.non_ros:
        lines += _entry(entry)
    lines.append("chains:" + (" []" if not s.chains else ""))
    for name, members in s.chains:
        paths = s.chain_paths(members)
        latest = max([p[-1].end - p[0].release for p in paths], default=MS)
        ages = max([b[-1].end - a[0].start for a, b in zip(paths, paths[1:])], default=MS)
        bounds = {"path_latency": latest * 2, "reaction_time": ages * 2, "data_age": ages * 2}
        for key, value in s.chain_changes.items():
            if key.startswith(f"{name}."):
                bounds[key.split(".")[1]] = value
        lines += _entry({"name": name, "callbacks": [c.logical_id for c in members],
                         **bounds})
    return "\n".join(lines) + "\n"


def _entry(entry: dict[str, Any]) -> list[str]:
    lines = []
    for key, value in entry.items():
        plain = isinstance(value, str) and key not in ("id", "name")
        text = value if plain else json.dumps(value, ensure_ascii=False)
        lines.append(("  - " if not lines else "    ") + f"{key}: {text}")
    return lines


def _limits(s: "Scenario", c: SimCallback) -> dict[str, Any]:
    """Limits that this run keeps with room to spare."""
    same = [r for a in s.apps for r in a.truth if r.callback.logical_id == c.logical_id]
    done = [r for r in same if r.end is not None]
    limits: dict[str, Any] = {"policy": c.policy_name, "affinity": list(c.affinity)}
    if c.policy_name in ("SCHED_FIFO", "SCHED_RR"):
        limits["priority"] = c.priority
    elif c.policy_name == "SCHED_DEADLINE":
        limits.update(zip(("runtime", "deadline", "period"), c.triple))
    elif c.policy_name != "SCHED_IDLE":
        limits["nice"] = c.nice
    if done:
        oldest = [min(r.release, r.sample.stamp - s.machine.realtime_offset
                      if r.sample and r.sample.stamp else r.release) for r in done]
        limits["response_deadline"] = max(r.end - o for r, o in zip(done, oldest)) * 2
        limits["wcet"] = max(r.end - r.start for r in done) * 2
    gaps = []
    for a in s.apps:
        by_seq = {r.seq: r.release for r in a.truth if r.callback.logical_id == c.logical_id}
        gaps += [by_seq[n + 1] - by_seq[n] for n in by_seq if n + 1 in by_seq]
    if gaps:
        limits["min_inter_arrival"] = min(gaps) * 9 // 10
        limits["max_inter_arrival"] = max(gaps) * 11 // 10
    if c.kind == "timer":
        limits["missed_releases_allowed"] = 0
    limits.update(s.spec_changes.get(c.logical_id, {}))
    return {k: v for k, v in limits.items() if v is not None}
