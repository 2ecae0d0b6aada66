"""Scenarios: lost events, damaged streams."""

from pathlib import Path

from .application import App
from .register import BUILDERS, scenario
from .scenario import INCONCLUSIVE, MS, OPEN, PASS, Scenario
from .sim_entities import SimCallback

# -- loss --------------------------------------------------------------------------------------------


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
def lost_end_in_between(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[4]
    row = [r for r in s.rows() if r.callback is c][1]
    s.drop(lambda e: e.name == "callback_end" and e.fields["callback_id"] == c.id
           and e.fields["seq"] == row.seq, declared=False)
    s.unpaired.add(id(row))
    s.tainted(c)
    s.expect("T3", s.callback(c), INCONCLUSIVE)  # ends carry seq, too: it jumps
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
def missing_kernel_stream(s: Scenario) -> None:
    if s.cpus == 1:
        s.cpus = s.machine.cpus = 2
        s.machine.current = [None, None]
    s.standard()
    s.run()
    s.damage.append(lambda trace: (trace / "kernel/channel0_1").unlink())
    s.weaker, s.numbers = True, False
    s.require = None  # only parts of instances are gone


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


@scenario
def lost_publish(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.drop(lambda e: e.name == "publish" and e.fields["publisher_id"] == 0
           and e.fields["seq"] == 2, declared=False)
    s.expect("T3", "topic /t0", INCONCLUSIVE)  # its seq jumps
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # published != seen
    for name in ("chain0", "chain1"):
        s.expect("Q2", f"chain {name}", INCONCLUSIVE)  # the publish is unseen
    for key in ("chains",):
        s.report_open.add(key)


@scenario
def lost_release(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[1]
    s.drop(lambda e: e.name == "callback_release" and e.fields["callback_id"] == c.id
           and e.fields["release_seq"] == 2, declared=False)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # released != seen
    s.tainted(c)  # "a subject whose totals disagree with what was seen is tainted likewise"


@scenario
def lost_first_publish(s: Scenario) -> None:
    app = s.standard()
    s.run()
    s.drop(lambda e: e.name == "publish" and e.fields["publisher_id"] == 1
           and e.fields["seq"] == 0, declared=False)
    s.expect("T3", "topic /t1", INCONCLUSIVE)  # the first seen is above publisher_init's next_seq
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)  # published != seen
    # The message taken first precedes the first one seen of its writer, but the writer was announced
    # before it: nothing came "before the recording", it is lost.
    s.expect("Q2", "chain chain0", INCONCLUSIVE)
    s.report_open.add("chains")


@scenario
def lost_first_instance(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[4]
    row = [r for r in s.rows() if r.callback is c][0]
    s.drop(lambda r: r.name in ("callback_start", "callback_end")
           and r.fields["callback_id"] == c.id and r.fields["seq"] == 0, declared=False)
    s.hidden.add(id(row))
    s.tainted(c)
    s.expect("T3", s.callback(c), INCONCLUSIVE)  # the first start is above next_seq
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)
    s.expect("S2", s.callback(c), INCONCLUSIVE)  # either event lost
    # W and U of seq 1 are its own: it waited after the lost one as well.


@scenario
def lost_last_instance(s: Scenario) -> None:
    app = s.standard()
    s.run()
    c = app.callbacks[4]
    row = [r for r in s.rows() if r.callback is c][-1]
    s.drop(lambda r: r.name in ("callback_start", "callback_end")
           and r.fields["callback_id"] == c.id and r.fields["seq"] == row.seq, declared=False)
    s.hidden.add(id(row))
    s.tainted(c)  # no seq jumps: only the totals tell
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)


@scenario
def lost_last_publish(s: Scenario) -> None:
    app = s.standard()
    s.run()
    last = app.published["/t1"] - 1
    s.drop(lambda e: e.name == "publish" and e.fields["publisher_id"] == 1
           and e.fields["seq"] == last, declared=False)
    s.expect("T4", f"process {app.pid}", INCONCLUSIVE)
    s.expect("Q2", "chain chain0", INCONCLUSIVE)
    s.report_open.add("chains")
