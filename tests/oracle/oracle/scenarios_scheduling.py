"""Scenarios: scheduling parameters, as specified, as applied and as kept."""

from collections.abc import Iterator

from .register import scenario
from .scenario import FAIL, INCONCLUSIVE, MS, NOT_APPLICABLE, OPEN, PASS, Scenario
from .simulator import SimThread


@scenario
def wrong_priority(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.applied_priority = 45
    s.run()
    s.expect("S1", s.callback(c), FAIL)
    s.expect("S2", s.callback(c), NOT_APPLICABLE)  # none of the `applied` matches


@scenario
def wrong_affinity(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    s.run()
    s.spec_changes[c.logical_id] = {"affinity": [s.cpus]}
    s.expect("S1", s.callback(c), FAIL)
    s.expect("S2", s.callback(c), NOT_APPLICABLE)


@scenario
def ran_on_other_cpu(s: Scenario) -> None:
    if s.cpus == 1:
        s.cpus = s.machine.cpus = 2
        s.machine.current = [None, None]
    app = s.standard()
    c = app.callbacks[4]
    c.affinity = (0,)
    app.stray = c
    s.run()
    s.expect("S4", s.thread(c.thread), FAIL)


@scenario
def late_parameters(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.late_apply = True
    s.run()
    s.expect("S2", s.callback(c), FAIL)


@scenario
def never_applied(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.never_apply = True
    s.run()
    s.expect("S1", s.callback(c), INCONCLUSIVE)     # no `applied` read-back
    s.expect("S2", s.callback(c), NOT_APPLICABLE)   # none of the `applied` matches
    s.expect("S3", s.thread(c.thread), NOT_APPLICABLE)


@scenario
def changed_priority(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]

    def change() -> None:
        if c.thread.state == "blocked":
            c.thread.priority = 44
        else:
            s.machine.at(s.machine.now + 50_000, change)

    s.machine.at(s.begin + 60 * MS, change)
    s.run()
    s.expect("S3", s.thread(c.thread), FAIL)  # the second audit and the switches say 44
    s.expect("S1", s.callback(c), FAIL)       # and an instance starts after that audit


@scenario
def applied_otherwise_and_back(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]  # starts 15, 35, 55 ms after the begin, and so on
    app.audits = [s.begin + n * MS for n in (42, 68, 88)]
    app.given = {app.audits[0]: (c, 44), app.audits[1]: (c, c.priority)}
    s.run()
    s.expect("S1", s.callback(c), FAIL)  # in force at 55 ms was 44, and what was applied last is right


@scenario
def changed_priority_kernel_only(s: Scenario) -> None:
    app = s.standard()
    app.audits = [s.begin + 30 * MS]
    changed_at = s.begin + 60 * MS
    c = app.callbacks[4]

    def change() -> None:
        if c.thread.state == "blocked":
            c.thread.priority = 44
        else:
            s.machine.at(s.machine.now + 50_000, change)

    s.machine.at(changed_at, change)
    s.run()
    s.expect("S3", s.thread(c.thread), FAIL)


@scenario
def leaked_policy(s: Scenario) -> None:
    app = s.standard()
    app.leaked_worker = True
    s.run()
    leaked = next(t for t, *_ in app.announced if t.name == "leak")
    s.expect("S5", s.thread(leaked), FAIL)          # its `initial` is real-time, nobody gave it
    s.expect("S3", s.thread(leaked), NOT_APPLICABLE)  # neither `applied` nor announced late


@scenario
def a_stranger_with_the_tid_of_one_that_ended(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.exit_after = 2
    former: list[SimThread] = []

    def busy() -> Iterator[tuple[str, int]]:
        for _ in range(20):
            yield "run", 300_000
            yield "wait", s.machine.now + 400_000

    def look() -> None:
        if not former and c.thread is not None:
            former.append(c.thread)
        if former and former[0].state == "dead":
            s.machine.spawn(SimThread(former[0].tid, "stranger", 4900, busy(), 61, 1,
                                      affinity=former[0].affinity), None)
        else:
            s.machine.at(s.machine.now + 100_000, look)

    s.machine.at(s.begin, look)
    s.run()
    # What runs with its tid, at another priority, is not it any more: its callback went on on another
    # thread after it had ended.
    s.expect("S3", s.thread(former[0]), PASS)
    s.expect("M4", s.callback(c), FAIL)
    s.expect("M3", s.callback(c), PASS)


@scenario
def named_worker(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.non_ros.append({"id": "recv", "policy": "SCHED_FIFO", "priority": 70})
    s.expect("S1", s.thread(app.recv), PASS)
    s.expect("M6", s.thread(app.recv), OPEN)
    s.expect("S2", s.thread(app.recv), OPEN)


@scenario
def named_worker_wrong(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.non_ros.append({"id": "recv", "policy": "SCHED_FIFO", "priority": 71})
    s.expect("S1", s.thread(app.recv), FAIL)
    s.expect("M6", s.thread(app.recv), OPEN)
    s.expect("S2", s.thread(app.recv), OPEN)


@scenario
def inherited_priority(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]

    def change(boost: int | None, time: int) -> None:
        def act() -> None:
            if c.thread.state == "blocked":
                s.machine.set_boost(c.thread, boost)
            else:
                s.machine.at(s.machine.now + 50_000, act)

        s.machine.at(time, act)

    change(-80, s.begin + 30 * MS)
    change(None, s.begin + 70 * MS)
    s.run()  # S3 passes: within a priority-inheritance interval the switches may say otherwise


@scenario
def all_policies(s: Scenario) -> None:
    app = s.standard()
    for n, policy, priority, nice in ((1, "SCHED_RR", 10, 0), (3, "SCHED_BATCH", 0, 5),
                                      (6, "SCHED_OTHER", 0, -5), (7, "SCHED_IDLE", 0, 0)):
        c = app.callbacks[n]
        c.policy, c.priority, c.nice = policy, priority, nice
    c = app.callbacks[4]
    c.policy, c.priority, c.triple = "SCHED_DEADLINE", 90, (2 * MS, 10 * MS, 20 * MS)
    s.run()


@scenario
def wrong_runtime(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.policy, c.priority, c.triple = "SCHED_DEADLINE", 90, (2 * MS, 10 * MS, 20 * MS)
    s.run()
    s.spec_changes[c.logical_id] = {"runtime": 3 * MS}
    s.expect("S1", s.callback(c), FAIL)
    s.expect("S2", s.callback(c), NOT_APPLICABLE)


@scenario
def wrong_nice(s: Scenario) -> None:
    c = s.standard().callbacks[3]
    c.nice = 3
    s.run()
    s.spec_changes[c.logical_id] = {"nice": 4}
    s.expect("S1", s.callback(c), FAIL)
    s.expect("S2", s.callback(c), NOT_APPLICABLE)


@scenario
def wildcard_entry(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    s.run()
    s.spec_ids[c.logical_id] = f"{c.node}/*"
    s.expect("M1", s.callback(c), "absent")  # not named exactly; every other rule as before


@scenario
def exact_entry_beats_wildcard(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.extra_entries.append({"id": f"{app.callbacks[4].node}/*", "policy": "SCHED_FIFO",
                            "priority": 99})
    s.expect("M1", f"callback {app.callbacks[4].node}/*", "absent")


@scenario
def no_parameters_in_spec(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    s.run()
    s.spec_changes[c.logical_id] = {"policy": None, "priority": None, "affinity": []}
    s.expect("S1", s.callback(c), "absent")  # absent and [] are not judged
    s.expect("S2", s.callback(c), "absent")


def _child(s: Scenario, priority: int) -> None:
    """A callback thread forks a helper that nobody announces."""
    app = s.standard()
    c = app.callbacks[4]

    def helper() -> Iterator[tuple[str, int]]:
        yield "run", 20_000

    child = SimThread(4900, "helper", app.pid, helper(), priority, 1 if priority else 0,
                      affinity=tuple(range(s.cpus)))
    s.machine.at(s.begin + 40 * MS, lambda: s.machine.spawn(child, c.thread))
    s.run()
    s.expect("S5", s.thread(child), FAIL if priority else PASS)


@scenario
def leaked_to_child(s: Scenario) -> None:
    _child(s, 46)  # a child of a real-time thread that runs at its parent's priority


@scenario
def child_without_priority(s: Scenario) -> None:
    _child(s, 0)
