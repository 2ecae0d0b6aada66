"""Scenarios: which callback ran on which thread, and whose work a thread did."""

from .register import scenario
from .scenario import FAIL, INCONCLUSIVE, MS, OPEN, PASS, Scenario
from .sim_entities import SimCallback


@scenario
def never_ran(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.silent = True
    s.run()
    s.expect("M1", s.callback(c), FAIL)  # registered, never ran, and the totals prove it


@scenario
def never_registered(s: Scenario) -> None:
    s.standard()
    s.run()
    s.extra_entries.append({"id": "/a/ghost@Timer(1000)"})
    s.expect("M1", "callback /a/ghost@Timer(1000)", FAIL)


@scenario
def never_registered_without_proof(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.drop(lambda r: r.name == "run_end", declared=False)
    s.extra_entries.append({"id": "/a/ghost@Timer(1000)"})
    s.expect("M1", "callback /a/ghost@Timer(1000)", INCONCLUSIVE)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)


@scenario
def wildcard_never_seen(s: Scenario) -> None:
    s.standard()
    s.run()
    s.extra_entries.append({"id": "/a/ghost/*"})  # M1 is for callbacks named exactly
    s.expect("M1", "callback /a/ghost/*", "absent")


@scenario
def thread_never_announced(s: Scenario) -> None:
    s.standard()
    s.run()
    s.non_ros.append({"id": "recvv"})
    s.expect("M1", "thread recvv", FAIL)


@scenario
def chain_never_linked(s: Scenario) -> None:
    app = s.standard()
    s.chains.append(("backwards", [app.callbacks[2], app.callbacks[0]]))
    s.run()  # Both run, and no message leads from the one to the other: Q2 cannot tell.


@scenario
def chain_of_nobody(s: Scenario) -> None:
    app = s.standard()
    ghost = SimCallback(99, "timer", "/a/ghost", period=1000)
    s.run()
    s.chains.append(("ghosts", [ghost, app.callbacks[2]]))
    s.expect("M1", f"callback {ghost.logical_id}", FAIL)


@scenario
def replaced_thread(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.exit_after = 2
    s.run()
    s.expect("M4", s.callback(c), FAIL)   # moved to another incarnation, no new callback_init
    s.expect("M3", s.callback(c), PASS)   # the threads were not alive together


@scenario
def started_after_thread_fini(s: Scenario) -> None:
    app = s.standard()
    app.audits = []  # they would be of a thread that has ended
    c = app.callbacks[4]
    c.early_bye_after = 2
    s.run()
    s.expect("M9", s.thread(c.thread), FAIL)  # nobody announced it anew, as run_end proves
    s.expect("M4", s.callback(c), FAIL)       # the callback went on on another incarnation
    s.expect("M3", s.callback(c), PASS)
    for rule in ("S3", "S4", "M6"):
        s.expect(rule, s.thread(c.thread), OPEN)  # of the two, one has no read-back
    # Its thread is two: whose the wake-up and the time on a CPU between them are is left open.
    s.numbers = s.recomputable = False


@scenario
def replaced_thread_announced(s: Scenario) -> None:
    app = s.standard()
    app.replacement_init = True
    c = app.callbacks[4]
    c.exit_after = 2
    s.registered_anew.add(c)
    s.run()
    s.expect("M3", s.callback(c), PASS)   # and M4 passes: the callback was registered anew


@scenario
def replaced_thread_exit_unseen(s: Scenario) -> None:
    app = s.standard()
    s.kernel = False
    c = app.callbacks[4]
    c.exit_after = 2
    s.run()
    first = [r for r in s.rows() if r.callback is c][0].thread
    s.drop(lambda e: e.name == "thread_fini" and e.fields["tid"] == first.tid, declared=False)
    s.report_open.add("isolation")  # not known, as little as what M3 and M4 ask
    s.expect("M3", s.callback(c), INCONCLUSIVE)  # nothing shows the earlier thread alive later
    s.expect("M4", s.callback(c), INCONCLUSIVE)  # thread exit lost
    s.expect("S3", s.thread(first), INCONCLUSIVE)  # gone before any audit, no kernel events
    # T4 does not name a missing thread_fini; without it a last read-back may be missing as well.
    s.expect("T4", f"process {app.pid}", OPEN)
    s.expect("S1", s.callback(c), OPEN)
    s.expect("S4", s.thread(first), OPEN)


@scenario
def reused_tid_same_callback(s: Scenario) -> None:
    app = s.standard()
    app.reuse_tid = 1
    c = app.callbacks[4]
    c.exit_after = 2
    s.run()
    s.report_open.add("threads")          # one entry per tid or per incarnation?
    s.expect("M4", s.callback(c), FAIL)   # tid reused: another incarnation all the same
    s.expect("M3", s.callback(c), PASS)


@scenario
def reused_tid_other_callback(s: Scenario) -> None:
    app = s.standard()
    app.reuse_tid = 1
    app.added = SimCallback(8, "timer", "/a/slow", period=15 * MS, priority=22,
                            affinity=tuple(range(s.cpus)), group=5)
    app.callbacks[4].exit_after = 2
    s.run()
    # Two incarnations, one callback each: M2 passes although the tid ran two. Their group is one
    # group of two callbacks, each on an isolated thread.
    for t in {r.thread for r in s.rows() if r.callback in (app.callbacks[4], app.added)}:
        s.expect("M2", s.thread(t), PASS)
    s.expect("M8", "group 5", FAIL)


@scenario
def duplicate_ids(s: Scenario) -> None:
    app = s.standard()
    app.callbacks[3].suffix = ""  # both track the same topic under one name
    s.chains = []
    s.run()
    # Limits for two callbacks under one id are those of both; the parameters differ, so judge none.
    s.spec_changes[app.callbacks[3].logical_id] = {"policy": None, "affinity": None,
                                                  "priority": None, "nice": None}
    s.expect("M7", s.callback(app.callbacks[1]), FAIL)
    s.expect("S1", s.callback(app.callbacks[1]), "absent")
    s.expect("S2", s.callback(app.callbacks[1]), "absent")


@scenario
def second_callback_in_group(s: Scenario) -> None:
    app = s.standard()
    a, b = app.callbacks[4], app.callbacks[5]
    b.group = a.group
    s.run()
    s.expect("M8", f"group {a.group}", FAIL)
    s.expect("M6", s.thread(a.thread), PASS)  # what its group holds is registered to the thread
    s.expect("S1", s.callback(b), OPEN)       # the thread is announced for the first of them
    s.expect("S2", s.callback(b), OPEN)


@scenario
def reentrant_group(s: Scenario) -> None:
    app = s.standard()
    app.callbacks[4].group_type = "reentrant"
    s.run()
    s.expect("M8", f"group {app.callbacks[4].group}", FAIL)


@scenario
def unannounced_thread(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.unannounced = True
    c.never_apply = True
    s.run()
    t = c.thread
    s.expect("M9", s.thread(t), FAIL)  # run_end proves that no announcement is missing
    s.expect("M6", s.thread(t), "absent")
    s.expect("S4", s.thread(t), OPEN)  # no read-back; but is an unannounced thread a subject?
    s.expect("M8", f"group {c.group}", "absent")
    for rule in ("S1", "S2"):
        s.expect(rule, s.callback(c), "absent")


@scenario
def lost_thread_init(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[4]
    t = c.thread
    s.drop(lambda e: e.name in ("thread_init", "thread_sched", "thread_fini")
           and e.fields.get("tid") == t.tid, declared=False)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # run_end counts one thread more
    s.expect("M9", s.thread(t), INCONCLUSIVE)
    s.expect("M4", s.callback(c), INCONCLUSIVE)  # the thread's end is lost as well
    # Where M9 is INCONCLUSIVE for a thread, so are M6, M8, S1, S2.
    s.expect("M6", s.thread(t), INCONCLUSIVE)
    s.expect("M8", f"group {c.group}", INCONCLUSIVE)
    s.expect("S1", s.callback(c), INCONCLUSIVE)
    s.expect("S2", s.callback(c), INCONCLUSIVE)
    for rule in ("S3", "S4", "S5"):
        s.expect(rule, s.thread(t), OPEN)


@scenario
def stolen_callback(s: Scenario) -> None:
    app = s.standard()
    thief, victim = app.callbacks[4], app.callbacks[1]
    thief.first_expiry = app.callbacks[0].first_expiry + 400_000
    thief.steals = victim
    victim.queue.clear()
    s.cpus = s.machine.cpus
    victim_ready = victim
    # The owner dozes at the moment of the theft: it is not woken for its fourth sample.
    original = app._alert

    def alert(c: SimCallback, cpu: int) -> None:
        if c is victim_ready and thief.steals is not None and thief.started == 3:
            return
        original(c, cpu)

    app._alert = alert
    s.run()
    if any(r.callback is victim and r.thread is thief.thread for r in s.rows()):
        s.expect("M6", s.thread(thief.thread), FAIL)  # not registered to it
        # M2 (thief's thread ran two) and M3 (both threads alive) follow from who ran where.


@scenario
def foreign_work(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.foreign_work = 300_000
    s.run()
    s.spec_changes[c.logical_id] = {"foreign_work_budget": 5 * MS}  # 15 ms per s are spent
    s.expect("M6", s.thread(c.thread), FAIL)


@scenario
def foreign_work_within_budget(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.foreign_work = 300_000
    s.run()
    s.spec_changes[c.logical_id] = {"foreign_work_budget": 100 * MS}


@scenario
def replaced_thread_exit_in_kernel(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.exit_after = 2
    s.run()
    first = [r for r in s.rows() if r.callback is c][0].thread
    s.drop(lambda e: e.name == "thread_fini" and e.fields["tid"] == first.tid, declared=False)
    s.expect("M3", s.callback(c), PASS)  # sched_process_exit is an exit seen
    s.expect("M4", s.callback(c), FAIL)
    s.expect("T4", f"process {app.pid}", OPEN)
    s.expect("S1", s.callback(c), OPEN)
    for rule in ("S3", "S4"):
        s.expect(rule, s.thread(first), OPEN)


@scenario
def replaced_thread_first_unseen(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.exit_after = 2
    s.run()
    first = [r for r in s.rows() if r.callback is c][0].thread
    s.drop(lambda e: e.name in ("thread_init", "thread_sched", "thread_fini")
           and e.fields.get("tid") == first.tid, declared=False)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # run_end counts one thread more
    # seq 0 ran on the thread that nothing is known of; that a later thread was configured later
    # says nothing about it. Where M9 is INCONCLUSIVE for a thread, so are M6, M8, S1, S2.
    s.expect("M9", s.thread(first), INCONCLUSIVE)
    s.expect("M6", s.thread(first), INCONCLUSIVE)
    s.expect("M8", f"group {c.group}", INCONCLUSIVE)
    for rule in ("S1", "S2"):
        s.expect(rule, s.callback(c), INCONCLUSIVE)
    s.report_open.add("isolation")  # as M3 and M4
    for rule in ("M3", "M4"):
        s.expect(rule, s.callback(c), OPEN)
    for rule in ("S3", "S4", "S5"):
        s.expect(rule, s.thread(first), OPEN)
    s.require = OPEN  # M4 may well have seen enough to FAIL
