"""Scenarios: executors and processes, beginning and end of a recording, restarts."""

from .application import App
from .register import scenario
from .scenario import FAIL, INCONCLUSIVE, MS, NOT_APPLICABLE, OPEN, PASS, Scenario
from .sim_entities import SimCallback

# -- executors and processes -------------------------------------------------------------------------


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


# -- end and beginning of a recording ----------------------------------------------------------------


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


# -- restart -----------------------------------------------------------------------------------------


def _restart(s: Scenario, changed: bool, pid: int = 5001, deadline: int = 0,
             cpus: tuple[int, ...] = ()) -> App:
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
    second = lifetime(pid, 31 if changed else 30, s.begin + 50 * MS, s.stop_at)
    for c in second.callbacks:
        c.first_expiry += 6 * MS
    second.callbacks[0].deadline = deadline
    second.callbacks[0].affinity = cpus or everywhere
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
    return second


@scenario
def restart(s: Scenario) -> None:
    _restart(s, changed=False)


@scenario
def restart_with_other_priority(s: Scenario) -> None:
    _restart(s, changed=True)


@scenario
def restart_with_same_pid(s: Scenario) -> None:
    _restart(s, changed=False, pid=4001)
    s.weaker = True  # two processes share their subjects' names


@scenario
def attached_in_mid_instance(s: Scenario) -> None:
    """The recording begins inside an instance; the announcement follows a little later."""
    app = s.standard()
    app.announce_at = s.begin + 43 * MS
    s.run()
    cut = [r for r in app.truth if s.begin + 24 * MS < r.start and r.end < s.begin + 42 * MS]
    cut = s.machine.random.choice(cut)
    s.window_begin = begin = cut.start + (cut.end - cut.start) // 2
    m = s.machine
    for r in s.rows():  # what came before the recording is not in it
        if r.wakeup is not None and r.wakeup < begin:
            r.wakeup = None
        if r.waking is not None and r.waking < begin:
            later = [k.time for k in m.kernel if k.name == "sched_wakeup" and k.time >= begin
                     and k.fields["tid"] == r.thread.tid and k.time <= r.start]
            r.waking = later[-1] if later else None  # sched_wakeup if there is no other
    for t, *_ in app.announced:
        s.expect("S3", s.thread(t), PASS)
        s.expect("S5", s.thread(t), OPEN)
    for c in app.callbacks:
        s.expect("S2", s.callback(c), NOT_APPLICABLE)
    s.report_open.update(("wakeup_latency_ns", "execution_time_ns", "preempted_ns", "blocked_ns",
                          "wake_delay_ns"))
    for name in ("chain0", "chain1"):
        s.expect("Q2", f"chain {name}", OPEN)  # a message published by the instance that was cut


@scenario
def crash_of_one_of_two(s: Scenario) -> None:
    s.standard()
    c = SimCallback(0, "timer", "/c/tick", period=10 * MS, priority=20,
                    affinity=tuple(range(s.cpus)), group=1, first_expiry=s.begin + 12 * MS)
    other = s.add(App(s.machine, 5001, "isolated", [c]))
    other.next_tid = 5004
    s.machine.at(s.begin + 55 * MS, other.crash)
    s.run()
    s.expect("T4", "process 5001 (pid 5001)", INCONCLUSIVE)
    s.report_open.add("incomplete")


@scenario
def restart_with_other_deadline(s: Scenario) -> None:
    second = _restart(s, changed=False, deadline=7 * MS)
    s.expect("M5", s.callback(second.callbacks[0], second), FAIL)


@scenario
def restart_with_other_cpus(s: Scenario) -> None:
    if s.cpus == 1:
        s.cpus = s.machine.cpus = 2
        s.machine.current = [None, None]
    second = _restart(s, changed=False, cpus=(1,))
    c = second.callbacks[0]
    s.expect("M5", s.callback(c, second), FAIL)
    s.spec_changes[c.logical_id] = {"policy": None, "affinity": None, "priority": None}
    for app in s.apps:
        for rule in ("S1", "S2"):
            s.expect(rule, s.callback(app.callbacks[0], app), "absent")


def _events_absent(s: Scenario, name: str) -> None:
    s.standard()
    s.run()
    s.drop(lambda r: r.name == name, declared=False)
    s.expect("T5", "trace", INCONCLUSIVE)
    s.weaker, s.numbers = True, False
    s.exact = ["T5"]
    s.require = INCONCLUSIVE


@scenario
def no_run_begin(s: Scenario) -> None:
    _events_absent(s, "run_begin")


@scenario
def no_callback_init(s: Scenario) -> None:
    _events_absent(s, "callback_init")


@scenario
def no_thread_init(s: Scenario) -> None:
    _events_absent(s, "thread_init")


@scenario
def no_callback_start(s: Scenario) -> None:
    _events_absent(s, "callback_start")


@scenario
def no_callback_end(s: Scenario) -> None:
    _events_absent(s, "callback_end")
