"""Scenarios: other tracers and layouts, windows, names and numbers at their limits, options."""

from .application import App
from .register import BUILDERS, scenario
from .scenario import FAIL, INCONCLUSIVE, MS, NOT_APPLICABLE, OPEN, PASS, Scenario
from .sim_entities import SimCallback

# -- tracers and layouts ---------------------------------------------------------------------------


@scenario
def perf_scale(s: Scenario) -> None:
    """perf, ftrace and libbpf write 120 for nice 0, and flags above the state's low byte."""
    s.standard()
    s.run()
    for r in s.machine.kernel:
        for key in r.fields:
            if key.endswith("prio"):
                r.fields[key] += 100
        if r.name == "sched_switch" and r.fields["prev_tid"]:
            r.fields["prev_state"] |= 0x400  # a flag: only the low byte tells runnable
    s.kernel_layout["tracer"] = 'tracer_name = "perf";'


@scenario
def wakeups_without_waking(s: Scenario) -> None:
    app = s.standard()
    for c in app.callbacks:
        c.blocking = 0.0
    s.run()
    m = s.machine
    m.kernel = [r for r in m.kernel if r.name != "sched_waking"]
    for r in app.truth:  # W is sched_wakeup if there is no sched_waking
        if r.waking is not None:
            r.waking = max(k.time for k in m.kernel if k.name == "sched_wakeup"
                           and k.fields["tid"] == r.thread.tid and k.time <= r.start)


@scenario
def newer_contract(s: Scenario) -> None:
    s.standard()
    s.user_layout["newer"] = True  # fields may be added at the end of an event
    s.run()
    s.machine.emit(s.apps[0].main, "executor_mood", mood="fine")


@scenario
def two_paths(s: Scenario) -> None:
    s.standard()
    s.run()
    s.traces = ["trace/ust", "trace/kernel"]


@scenario
def no_contexts(s: Scenario) -> None:
    s.standard()
    s.user_layout["contexts"] = False
    s.run()
    s.expect("T5", "trace", INCONCLUSIVE)  # vpid or vtid absent
    s.weaker, s.numbers, s.recomputable = True, False, False
    s.exact = ["T5" if not s.user_layout.get("contexts", True) else "T6"]
    s.require = INCONCLUSIVE


@scenario
def other_boot(s: Scenario) -> None:
    s.standard()
    s.kernel_layout["boot_id"] = "00000000-0b07-4b1d-9abc-0123456789ab"
    s.run()
    s.expect("T6", "trace", INCONCLUSIVE)  # clocks cannot be related
    s.weaker, s.numbers, s.recomputable = True, False, False
    s.exact = ["T5" if not s.user_layout.get("contexts", True) else "T6"]
    s.require = INCONCLUSIVE


@scenario
def kernel_clock_without_uuid(s: Scenario) -> None:
    """Its switches would accuse threads that did nothing, if they were theirs."""
    s.standard()
    s.run()
    s.kernel_layout["boot_id"] = ""
    for r in s.machine.kernel:
        if r.name == "sched_switch":
            r.fields["next_prio"] -= 1
    s.expect("T6", "trace", INCONCLUSIVE)  # clocks cannot be related
    s.weaker, s.numbers = True, False
    s.require = None


@scenario
def stream_without_events(s: Scenario) -> None:
    s.standard()
    s.run()
    s.cpus += 1  # one more CPU, one empty packet in each of its streams


@scenario
def renamed_streams(s: Scenario) -> None:
    s.standard()
    s.run()
    s.renamed = True


@scenario
def renamed_streams_with_faults(s: Scenario) -> None:
    BUILDERS["lost_and_counted"](s)
    s.renamed = True


@scenario
def renamed_streams_in_a_pool(s: Scenario) -> None:
    BUILDERS["multi_threaded"](s)
    s.renamed = True


# -- windows ---------------------------------------------------------------------------------------


@scenario
def stream_ends_early(s: Scenario) -> None:
    s.standard()
    s.run()
    s.cpus += 1
    s.window_end = s.begin + 57 * MS
    s.user_layout["ends"] = {s.cpus - 1: s.window_end}
    # Instances after the earliest last-packet end are neither listed nor counted, though their
    # events are there; what the rules count as seen then is not told: law L2 only.
    s.weaker = True
    s.report_open.add("missed_releases")


@scenario
def idle_cpu(s: Scenario) -> None:
    s.standard()
    s.run()
    # Nothing ran on the last CPU: the only packet of its streams begins with the tracer's last flush,
    # after all others have ended.
    s.cpus += 1
    for layout in (s.user_layout, s.kernel_layout):
        layout["begins"] = {s.cpus - 1: s.end + 16_200}
        layout["ends"] = {s.cpus - 1: s.end + 16_300}


@scenario
def repeated_announcement(s: Scenario) -> None:
    app = s.standard()
    app.announce_at = s.begin + 43 * MS
    s.run()  # a second session started: everything is told again, nothing changes


@scenario
def stopped_before_the_end(s: Scenario) -> None:
    app = s.standard()
    s.run()
    last = s.begin + 61 * MS
    m = s.machine
    m.user = [r for r in m.user if r.time <= last]
    m.kernel = [r for r in m.kernel if r.time <= last]
    s.end = last
    for r in s.rows():
        if r.end is not None and r.end > last:
            s.unpaired.add(id(r))
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # no run_end
    for c in app.callbacks:
        if c.kind != "timer":
            s.expect("Q1", s.callback(c), OPEN)
    s.report_open.add("incomplete")
    s.require = INCONCLUSIVE


# -- names and numbers -----------------------------------------------------------------------------


@scenario
def odd_names(s: Scenario) -> None:
    app = s.standard()
    app.callbacks[3].suffix = '#"left, right" \\ µ'
    app.callbacks[4].suffix = "#a,b"
    s.run()


@scenario
def huge_numbers(s: Scenario) -> None:
    """Integers beyond 2^53, as after years of running: attached late to counters that are high."""
    app = s.standard()
    big = 2**60 + 1
    for c in app.callbacks:
        c.started = c.ended = big
        c.released = 0 if c.kind == "timer" else big
    for topic in app.topics:
        app.published[topic] = big
        app.writer[topic] |= 2**63
    BUILDERS["attach"](s)


def attach(s: Scenario) -> None:
    """Late attachment, for whatever application the scenario has."""
    app = s.apps[0]
    app.announce_at = s.begin + 43 * MS
    s.run()
    s.window_begin = app.announced_at
    for t, *_ in app.announced:
        s.expect("S3", s.thread(t), PASS)
        s.expect("S5", s.thread(t), OPEN)
    for c in app.callbacks:
        s.expect("S2", s.callback(c), NOT_APPLICABLE)
    s.report_open.update(("wakeup_latency_ns",))


BUILDERS["attach"] = attach


@scenario
def two_writers_on_a_topic(s: Scenario) -> None:
    first = s.standard()
    rival = SimCallback(0, "timer", "/c/rival", period=25 * MS, publishes="/t0", priority=20,
                        affinity=tuple(range(s.cpus)), group=1, first_expiry=s.begin + 18 * MS)
    second = s.add(App(s.machine, 5001, "isolated", [rival]))
    second.next_tid = 5004
    s.run()  # what rival publishes is taken, but belongs to no chain of the spec
    assert any(r.callback is first.callbacks[1] and r.sample.source.callback is rival
               for r in s.rows() if r.sample and r.sample.source)


# -- options and exit codes ------------------------------------------------------------------------


@scenario
def exit_codes_on_loss(s: Scenario) -> None:
    BUILDERS["lost_silently"](s)
    s.exit_codes = [([], 3), (["--inconclusive=warn"], 0), (["--inconclusive=fail"], 1)]


@scenario
def lossless_required(s: Scenario) -> None:
    BUILDERS["harmless_loss"](s)
    s.exit_codes = [([], 0), (["--require-lossless"], 1)]


@scenario
def crash_allowed(s: Scenario) -> None:
    c = SimCallback(0, "timer", "/a/tick", period=10 * MS, priority=20,
                    affinity=tuple(range(s.cpus)), group=1, first_expiry=s.begin + 5 * MS)
    app = s.add(App(s.machine, 4001, "isolated", [c]))

    def watch() -> None:
        if any(r.end is None and r.seq >= 5 for r in app.truth):
            app.crash()
        else:
            s.machine.at(s.machine.now + 10_000, watch)

    s.machine.at(s.begin + 40 * MS, watch)
    s.run()
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)
    s.report_open.add("incomplete")
    s.exit_codes = [([], 3), (["--allow-crash"], 0)]


@scenario
def violation_outweighs_loss(s: Scenario) -> None:
    app = s.standard("multi_threaded")
    s.run()
    s.drop(lambda r: r.name == "run_end", declared=False)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)
    s.exit_codes = [([], 1), (["--inconclusive=warn"], 1)]
    s.require = FAIL
