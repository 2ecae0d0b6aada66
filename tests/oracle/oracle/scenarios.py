"""Scenarios: one fault each, and what the rules must say about it and why.

The reason for each expected verdict stands beside it, in terms of the table of rules. Verdicts not
mentioned are those of a flawless trace. OPEN marks what the documents do not decide.
"""

import shutil
from collections.abc import Callable
from pathlib import Path

from .application import App, SimCallback
from .scenario import FAIL, INCONCLUSIVE, MS, NOT_APPLICABLE, OPEN, PASS, Scenario

Build = Callable[[int], Scenario]
ALL: dict[str, Build] = {}
BUILDERS: dict[str, Callable[[Scenario], None]] = {}
CPUS = (2, 1, 4)


def scenario(build: Callable[[Scenario], None]) -> Callable[[Scenario], None]:
    """Registers `build`; the number of CPUs follows the seed."""

    def make(seed: int) -> Scenario:
        s = Scenario(build.__name__, seed, cpus=CPUS[seed % 3])
        build(s)
        return s

    ALL[build.__name__] = make
    BUILDERS[build.__name__] = build
    return build


# -- executors and processes -----------------------------------------------------------------------


@scenario
def isolated(s: Scenario) -> None:
    s.standard()
    s.run()


@scenario
def multi_threaded(s: Scenario) -> None:
    s.standard("multi_threaded")
    s.run()  # M2, M3 by who ran where; the threads are all alive together, so M4 passes


@scenario
def single_threaded(s: Scenario) -> None:
    s.standard("single_threaded")
    s.run()  # M2 fails on the one thread; every callback keeps to it, so M3 passes


@scenario
def two_processes(s: Scenario) -> None:
    first = s.standard(pid=4001)
    everywhere = tuple(range(s.cpus))
    listener = SimCallback(0, "subscription", "/c/show", "/t1", priority=20, affinity=everywhere,
                           group=1)
    second = s.add(App(s.machine, 5001, "isolated", [listener]))
    second.next_tid = 5004
    # The chain spans both processes: no pid belongs to its name.
    s.chains.append(("across", [first.callbacks[0], first.callbacks[1], listener]))
    s.run()


@scenario
def exceptions(s: Scenario) -> None:
    s.standard().callbacks[5].exception_at = 3
    s.run()  # an instance that ends with an exception has ended


@scenario
def no_kernel_events(s: Scenario) -> None:
    s.standard()
    s.kernel = False
    s.run()
    # S3 has its audits, S4 the CPUs of the events ("sampled"), S5 the announced threads; R4 passes
    # because no duration exceeds the declared WCET.


@scenario
def no_kernel_tight_wcet(s: Scenario) -> None:
    app = s.standard()
    s.kernel = False
    s.run()
    c = app.callbacks[2]
    longest = max(r.end - r.start for r in s.rows() if r.callback is c)
    s.spec_changes[c.logical_id] = {"wcet": longest - 1}
    s.expect("R4", s.callback(c), INCONCLUSIVE)  # no CPU time and duration > WCET


# -- end and beginning of a recording --------------------------------------------------------------


@scenario
def crash(s: Scenario) -> None:
    app = s.standard()
    victim = app.callbacks[5]

    def watch() -> None:
        inside = [r for r in app.truth if r.callback is victim and r.end is None and r.seq >= 5]
        if inside and s.machine.now - inside[0].start > 15_000:
            app.crash()
        else:
            s.machine.at(s.machine.now + 10_000, watch)

    s.machine.at(s.begin + 40 * MS, watch)
    s.run()
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # interrupted: no run_end, no totals
    # An instance open at the end of a process without run_end is cut by the edge: E1 and R3 judge
    # the others. R3: "one cut by a crash is not judged".
    for c in app.callbacks:
        if c.kind != "timer":
            s.expect("Q1", s.callback(c), OPEN)  # no totals; running ones count only "attached"
    s.report_open.add("incomplete")
    s.require = INCONCLUSIVE


@scenario
def late_attachment(s: Scenario) -> None:
    app = s.standard()
    app.announce_at = s.begin + 43 * MS
    s.run()
    s.window_begin = app.announced_at
    for t, *_ in app.announced:
        # The first audit stands for `applied`, for the receive thread as well; `initial` came
        # before the window, so S5 has nothing announced to judge.
        s.expect("S3", s.thread(t), PASS)
        s.expect("S5", s.thread(t), OPEN)
    for c in app.callbacks:
        s.expect("S2", s.callback(c), NOT_APPLICABLE)  # seq 0 lies before the window
    s.report_open.update(("wakeup_latency_ns",))


@scenario
def no_run_end(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.drop(lambda r: r.name == "run_end", declared=False)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)
    for c in app.callbacks:
        if c.kind != "timer":
            s.expect("Q1", s.callback(c), PASS)  # its own totals were seen
    s.require = INCONCLUSIVE


# -- loss ------------------------------------------------------------------------------------------


def _lose_instance(s: Scenario, app: App, declared: bool) -> SimCallback:
    """Both events of an instance in the middle whose successor has a wake-up of its own."""
    c = app.callbacks[4]
    rows = [r for r in s.rows() if r.callback is c]
    gone = rows[2]
    s.drop(lambda r: r.name in ("callback_start", "callback_end") and r.vpid == app.pid
           and r.fields["callback_id"] == c.id and r.fields["seq"] == gone.seq, declared)
    s.hidden.add(id(gone))
    s.tainted(c, app)
    s.expect("T3", s.callback(c, app), INCONCLUSIVE)  # the seq jumps
    s.expect("T4", f"process {app.pid}{s.suffix(app)}", INCONCLUSIVE)  # started != starts seen
    return c


@scenario
def lost_silently(s: Scenario) -> None:
    app = s.standard()
    s.run()
    _lose_instance(s, app, declared=False)
    # T2 speaks of discarded events and packets; the tracer reports none.


@scenario
def lost_and_counted(s: Scenario) -> None:
    app = s.standard()
    s.run()
    _lose_instance(s, app, declared=True)
    s.expect("T2", "trace", INCONCLUSIVE)  # discarded events cost a subject its proof


@scenario
def lost_in_one_of_two_processes(s: Scenario) -> None:
    first = s.standard()
    c = SimCallback(0, "timer", "/c/tick", period=10 * MS, priority=20,
                    affinity=tuple(range(s.cpus)), group=1, first_expiry=s.begin + 12 * MS)
    other = s.add(App(s.machine, 5001, "isolated", [c]))
    other.next_tid = 5004
    s.run()
    _lose_instance(s, first, declared=False)  # the other process keeps all its verdicts


@scenario
def harmless_loss(s: Scenario) -> None:
    app = s.standard()
    s.run()
    r = [r for r in s.rows() if r.callback is app.callbacks[4]][1]
    lost = s.drop(lambda e: e.name == "thread_wakeup" and e.time == r.wakeup
                  and e.vtid == r.thread.tid, declared=True)
    assert len(lost) == 1
    r.wakeup = None  # T2: discarded, but every subject still has its proof: PASS with loss named


@scenario
def lost_end(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[4]
    row = [r for r in s.rows() if r.callback is c][-1]
    s.drop(lambda e: e.name == "callback_end" and e.fields["callback_id"] == c.id
           and e.fields["seq"] == row.seq, declared=False)
    s.unpaired.add(id(row))
    s.tainted(c)  # totals disagree: `ended` says it ended
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)


@scenario
def lost_read_back(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[0]
    t = c.thread
    # The second audit, n = 3, is the last: read_backs of thread_fini says 4.
    s.drop(lambda e: e.name == "thread_sched" and e.fields["tid"] == t.tid and e.fields["n"] == 2,
           declared=False)
    s.expect("T3", s.thread(t), INCONCLUSIVE)  # n jumps
    s.expect("T4", f"process {app.pid}", OPEN)  # read_backs = last n + 1, yet one was not seen
    s.expect("S1", s.callback(c), INCONCLUSIVE)  # the hole is after the last applied
    s.expect("S3", s.thread(t), INCONCLUSIVE)
    s.expect("S4", s.thread(t), INCONCLUSIVE)
    s.require = INCONCLUSIVE


@scenario
def discarded_kernel_events(s: Scenario) -> None:
    s.standard()
    s.run()
    m = s.machine
    gone = [r for r in m.kernel if r.name == "sched_switch"
            and s.begin + 30 * MS < r.time < s.begin + 34 * MS]
    m.kernel = [r for r in m.kernel if r not in gone]
    s.discarded_kernel = [(r.time, r.cpu) for r in gone]
    s.weaker, s.numbers = True, False
    s.require = None


@scenario
def missing_stream(s: Scenario) -> None:
    if s.cpus == 1:
        s.cpus = s.machine.cpus = 2
        s.machine.current = [None, None]
    s.standard()
    s.run()

    def damage(trace: Path) -> None:
        (trace / "ust/uid/0/64-bit/channel0_1").unlink()

    s.damage.append(damage)
    s.weaker, s.numbers = True, False
    s.require = INCONCLUSIVE  # state events or instances are missing on every run


@scenario
def truncated_stream(s: Scenario) -> None:
    s.standard()
    s.layout["packet_bytes"] = 4096
    s.run()

    def damage(trace: Path) -> None:
        path = trace / "ust/uid/0/64-bit/channel0_0"
        path.write_bytes(path.read_bytes()[:-2048])

    s.damage.append(damage)
    s.expect("T1", "trace", INCONCLUSIVE)  # some packets damaged and skipped
    s.weaker, s.numbers, s.recomputable = True, False, False
    s.require = INCONCLUSIVE


@scenario
def damaged_packet(s: Scenario) -> None:
    s.standard()
    s.layout["packet_bytes"] = 4096
    s.run()

    def damage(trace: Path) -> None:
        path = trace / "ust/uid/0/64-bit/channel0_0"
        data = bytearray(path.read_bytes())
        at = len(data) // 4096 // 2 * 4096
        data[at:at + 4] = b"\0\0\0\0"  # the magic of a packet in the middle
        path.write_bytes(data)

    s.damage.append(damage)
    s.expect("T1", "trace", INCONCLUSIVE)
    s.weaker, s.numbers, s.recomputable = True, False, False
    s.require = INCONCLUSIVE


# -- queues ----------------------------------------------------------------------------------------


@scenario
def overwriting_queue(s: Scenario) -> None:
    s.cpus = s.machine.cpus = 1
    s.machine.current = [None]
    app = s.standard()
    plan, slow_sub = app.callbacks[0], app.callbacks[3]
    plan.publish_count, plan.blocking = 3, 0.0
    for c in (app.callbacks[1], slow_sub):
        c.depth, c.priority = 1, 5
    s.run()
    for c in (app.callbacks[1], slow_sub):
        if c.overwritten:
            s.expect("Q1", s.callback(c), FAIL)


@scenario
def overwrites_allowed(s: Scenario) -> None:
    overwriting_queue(s)
    for c in s.apps[0].callbacks:
        if c.overwritten:
            s.spec_changes[c.logical_id] = {"overwrites_allowed": c.overwritten}
            s.expect("Q1", s.callback(c), PASS)


@scenario
def lost_samples(s: Scenario) -> None:
    app = s.standard()
    app.callbacks[1].lost_samples = 2
    s.run()
    s.expect("Q1", s.callback(app.callbacks[1]), FAIL)


# -- releases --------------------------------------------------------------------------------------


def _unknown_timer(s: Scenario, c: SimCallback) -> None:
    c.unknown_release = True
    s.run()
    # Expiry unknown: no inter-arrival, no expiry, and only a lower bound of the response time,
    # which stays below the deadline, so the deadline lies between the bounds.
    for rule in ("R1", "R2", "R3", "R5"):
        s.expect(rule, s.callback(c), INCONCLUSIVE)


@scenario
def unknown_release_timer(s: Scenario) -> None:
    _unknown_timer(s, s.standard().callbacks[4])


@scenario
def unknown_release_timer_no_kernel(s: Scenario) -> None:
    s.kernel = False
    _unknown_timer(s, s.standard().callbacks[4])


@scenario
def unknown_release_timer_pool(s: Scenario) -> None:
    _unknown_timer(s, s.standard("multi_threaded").callbacks[4])


def _unknown_data(s: Scenario, c: SimCallback) -> None:
    c.unknown_release = True
    s.run()
    s.expect("R1", s.callback(c), INCONCLUSIVE)
    s.expect("R5", s.callback(c), INCONCLUSIVE)
    # R3 stays PASS: the deadline exceeds even the upper bound, F - S.
    s.expect("Q2", "chain chain1", INCONCLUSIVE)  # path latency needs every release of the chain


@scenario
def unknown_release_data(s: Scenario) -> None:
    _unknown_data(s, s.standard().callbacks[3])


@scenario
def unknown_release_data_pool(s: Scenario) -> None:
    _unknown_data(s, s.standard("multi_threaded").callbacks[3])


@scenario
def unknown_release_data_tight(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[3]
    _unknown_data(s, c)
    rows = [r for r in s.rows() if r.callback is c]
    lower = max(r.end - s.release(r)[0] for r in rows)
    upper = max(r.end - (r.sample.stamp - s.machine.realtime_offset) for r in rows)
    s.spec_changes[c.logical_id] = {"response_deadline": (lower + upper) // 2}
    s.expect("R3", s.callback(c), INCONCLUSIVE)  # bounds straddle the deadline


@scenario
def missed_periods(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.oversleep_at = 2
    s.run()
    assert any(r.missed == 1 for r in s.rows())
    s.expect("R2", s.callback(c), FAIL)


@scenario
def missed_periods_allowed(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.oversleep_at = 2
    s.run()
    s.spec_changes[c.logical_id] = {"missed_releases_allowed": 1}


@scenario
def deadline_missed(s: Scenario) -> None:
    c = s.standard().callbacks[1]
    s.run()
    longest = max(r.end - r.release for r in s.rows() if r.callback is c)
    s.spec_changes[c.logical_id] = {"response_deadline": longest - 1}
    s.expect("R3", s.callback(c), FAIL)


@scenario
def deadline_just_met(s: Scenario) -> None:
    c = s.standard().callbacks[1]
    s.run()
    longest = max(r.end - r.release for r in s.rows() if r.callback is c)
    s.spec_changes[c.logical_id] = {"response_deadline": longest}  # F > a + Dl is a miss


@scenario
def deadline_of_callback_init(s: Scenario) -> None:
    c = s.standard().callbacks[1]
    c.deadline = 1000
    s.run()
    s.spec_changes[c.logical_id] = {"response_deadline": None}
    s.expect("R3", s.callback(c), FAIL)


@scenario
def budget_exceeded(s: Scenario) -> None:
    c = s.standard().callbacks[2]
    s.run()
    most = max(r.sums["run"] for r in s.rows() if r.callback is c)
    s.spec_changes[c.logical_id] = {"wcet": most - 1}
    s.expect("R4", s.callback(c), FAIL)


@scenario
def budget_just_kept(s: Scenario) -> None:
    c = s.standard().callbacks[2]
    s.run()
    most = max(r.sums["run"] for r in s.rows() if r.callback is c)
    s.spec_changes[c.logical_id] = {"wcet": most}  # though the wall time is longer


@scenario
def rate_too_high(s: Scenario) -> None:
    c = s.standard().callbacks[5]
    s.run()
    s.spec_changes[c.logical_id] = {"min_inter_arrival": 10 * MS + 1, "max_inter_arrival": 20 * MS}
    s.expect("R5", s.callback(c), FAIL)


@scenario
def rate_too_low(s: Scenario) -> None:
    c = s.standard().callbacks[5]
    s.run()
    s.spec_changes[c.logical_id] = {"min_inter_arrival": MS, "max_inter_arrival": 10 * MS - 1}
    s.expect("R5", s.callback(c), FAIL)


@scenario
def burst_of_arrivals(s: Scenario) -> None:
    app = s.standard()
    app.callbacks[0].publish_count = 2  # the second sample arrives while the first is processed
    s.run()  # R1 by the simulator's inter-arrivals and response times


@scenario
def chain_too_slow(s: Scenario) -> None:
    app = s.standard()
    s.run()
    paths = s.chain_paths(app.callbacks[0:3])
    s.chain_changes["chain0.path_latency"] = max(p[-1].end - p[0].release for p in paths) - 1
    s.expect("Q2", "chain chain0", FAIL)


@scenario
def chain_too_old(s: Scenario) -> None:
    app = s.standard()
    s.run()
    paths = s.chain_paths(app.callbacks[0:3])
    ages = [b[-1].end - a[0].start for a, b in zip(paths, paths[1:])]
    s.chain_changes["chain0.data_age"] = max(ages) - 1
    s.expect("Q2", "chain chain0", FAIL)


# -- mapping ---------------------------------------------------------------------------------------


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
def replaced_thread(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.exit_after = 2
    s.run()
    s.expect("M4", s.callback(c), FAIL)   # moved to another incarnation, no new callback_init
    s.expect("M3", s.callback(c), PASS)   # the threads were not alive together


@scenario
def replaced_thread_announced(s: Scenario) -> None:
    app = s.standard()
    app.replacement_init = True
    c = app.callbacks[4]
    c.exit_after = 2
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
    s.expect("M3", s.callback(c), INCONCLUSIVE)  # nothing shows the earlier thread alive later
    s.expect("M4", s.callback(c), INCONCLUSIVE)  # thread exit lost
    s.expect("S3", s.thread(first), INCONCLUSIVE)  # gone before any audit, no kernel events
    s.expect("T4", f"process {app.pid}", OPEN)   # T4 does not name a missing thread_fini


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
    s.expect("M6", s.thread(a.thread), OPEN)  # is a callback of the thread's group foreign to it?
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


# -- scheduling ------------------------------------------------------------------------------------


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


# -- pairing ---------------------------------------------------------------------------------------


@scenario
def second_end(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.second_end_at = 2
    s.run()
    s.expect("E1", s.callback(c), FAIL)


@scenario
def never_ended(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.no_end_at = 4  # its last release: slow runs at 15, 35, 55, 75 and 95 ms
    s.run()
    row = [r for r in s.rows() if r.callback is c][-1]
    assert row.seq == 4 and row.end is None
    s.expect("E1", s.callback(c), FAIL)  # started != ended at a clean exit
    # The totals prove that it never ended; window end - release is far beyond the deadline.
    s.expect("R3", s.callback(c), FAIL)
    # An open instance ends nowhere: whether later ones overlap or nest in it is not the question
    # here, since none follows on its thread.


@scenario
def nested(s: Scenario) -> None:
    app = s.standard("single_threaded")
    outer, inner = app.callbacks[5], app.callbacks[4]
    outer.nests = inner
    s.run()  # E3 by the simulator's own intervals


@scenario
def overlapping(s: Scenario) -> None:
    if s.cpus == 1:
        s.cpus = s.machine.cpus = 2
        s.machine.current = [None, None]
    app = s.standard("multi_threaded")
    c = app.callbacks[3]
    app.callbacks[0].publish_count = 2
    app.concurrent = c
    c.work = (300_000, 400_000)
    s.run()  # E2 by the simulator's own intervals


# -- restart ---------------------------------------------------------------------------------------


def _restart(s: Scenario, changed: bool) -> None:
    everywhere = tuple(range(s.cpus))

    def lifetime(pid: int, priority: int, start: int, stop: int) -> App:
        c = SimCallback(0, "timer", "/a/slow", period=10 * MS, priority=priority,
                        affinity=everywhere, group=1, first_expiry=start + 5 * MS)
        d = SimCallback(1, "timer", "/a/fast", period=8 * MS, priority=20, affinity=everywhere,
                        group=2, first_expiry=start + 6 * MS)
        app = s.add(App(s.machine, pid, "isolated", [c, d]))
        app.next_tid = pid + 3
        app.process_start, app.stop_at = start, stop
        app.audits = [start + 20 * MS]
        return app

    first = lifetime(4001, 30, s.begin - 6 * MS, s.begin + 40 * MS)
    first.callbacks[0].first_expiry = s.begin + 5 * MS
    first.callbacks[1].first_expiry = s.begin + 6 * MS
    second = lifetime(5001, 31 if changed else 30, s.begin + 50 * MS, s.stop_at)
    for c in second.callbacks:
        c.first_expiry += 6 * MS
    s.run()
    for c in second.callbacks:
        s.expect("M5", s.callback(c, second), PASS)
    if changed:
        s.expect("M5", s.callback(second.callbacks[0], second), FAIL)
        # One spec cannot be right for both lifetimes: leave the parameters to M5.
        name = second.callbacks[0].logical_id
        s.spec_changes[name] = {"policy": None, "affinity": None, "priority": None}
        for app in (first, second):
            for rule in ("S1", "S2"):
                s.expect(rule, s.callback(app.callbacks[0], app), "absent")


@scenario
def restart(s: Scenario) -> None:
    _restart(s, changed=False)


@scenario
def restart_with_other_priority(s: Scenario) -> None:
    _restart(s, changed=True)


DELETION_BASES = ("isolated", "multi_threaded", "two_processes", "replaced_thread", "second_end",
                  "missed_periods", "nested", "stolen_callback", "late_parameters", "wrong_priority",
                  "changed_priority", "overwriting_queue", "burst_of_arrivals", "leaked_policy",
                  "ran_on_other_cpu", "deadline_missed", "chain_too_slow", "crash", "lost_samples",
                  "restart_with_other_priority", "late_attachment", "duplicate_ids")


@scenario
def deleted_at_random(s: Scenario) -> None:
    """Law L2: any subset of the user events may be missing without a trace of it."""
    base = DELETION_BASES[s.seed % len(DELETION_BASES)]
    BUILDERS[base](s)
    share = (0.002, 0.01, 0.05, 0.3)[s.seed // len(DELETION_BASES) % 4]
    s.drop(lambda r: s.machine.random.random() < share, declared=False)
    s.weaker, s.numbers, s.flips = True, False, share < 0.1
    s.require = None


@scenario
def cut_short(s: Scenario) -> None:
    """Law L2: everything after some moment is missing, as when a recorder dies."""
    base = DELETION_BASES[s.seed % len(DELETION_BASES)]
    if base == "restart_with_other_priority":  # nothing shows that a process that never was is missing
        base = "isolated"
    BUILDERS[base](s)
    last = s.begin + s.machine.random.randint(1, 110) * MS
    s.drop(lambda r: r.time > last, declared=False)
    s.weaker, s.numbers, s.flips = True, False, False
    s.require = None


def generate(name: str, seed: int, folder: Path) -> None:
    """Writes one scenario below `folder`, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    ALL[name](seed).write(folder)
