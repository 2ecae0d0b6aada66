"""Scenarios: queues, releases, deadlines, chains, pairing of starts and ends."""

from .register import scenario
from .scenario import FAIL, INCONCLUSIVE, MS, OPEN, PASS, Scenario
from .sim_entities import SimCallback

# -- queues ------------------------------------------------------------------------------------------


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


# -- releases ----------------------------------------------------------------------------------------


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
    # R3 stays PASS: the deadline exceeds even the upper bound, F - S. So does Q2: of a chain's releases path
    # latency needs the first one only.


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


# -- pairing -----------------------------------------------------------------------------------------


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


@scenario
def end_beyond_total(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.extra_end_at = 2
    s.run()
    s.expect("E1", s.callback(c), FAIL)  # an end beyond the total
    _surplus(s, c)


@scenario
def second_end_uncounted(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[4]
    c.uncounted_second_end_at = 2
    s.run()
    s.expect("E1", s.callback(c), FAIL)  # a second end for one seq
    _surplus(s, c)


def _surplus(s: Scenario, c: SimCallback) -> None:
    """More was seen than the totals say. Is that a disagreement that taints? Left open."""
    s.expect("T3", s.callback(c), OPEN)
    s.expect("T4", f"process {s.apps[0].pid}", OPEN)
    for rule in ("M3", "E2", "R1", "R2", "R3", "R4", "R5"):
        s.expect(rule, s.callback(c), OPEN)
    for rule in ("M2", "M6", "E3"):
        s.expect(rule, s.thread(c.thread), OPEN)


@scenario
def mixed_releases(s: Scenario) -> None:
    app = s.standard()
    c = app.callbacks[5]
    c.unknown_seqs = (2, 5)
    s.run()
    for rule in ("R1", "R2", "R3", "R5"):
        s.expect(rule, s.callback(c), INCONCLUSIVE)


@scenario
def mixed_releases_no_kernel(s: Scenario) -> None:
    s.kernel = False
    mixed_releases(s)


def _unknown_service(s: Scenario, executor: str) -> None:
    c = s.standard(executor).callbacks[6]
    c.unknown_release = True
    s.run()
    for rule in ("R1", "R3", "R5"):  # no source timestamp: no upper bound either
        s.expect(rule, s.callback(c), INCONCLUSIVE)


@scenario
def unknown_release_service(s: Scenario) -> None:
    _unknown_service(s, "isolated")


@scenario
def unknown_release_service_pool(s: Scenario) -> None:
    _unknown_service(s, "multi_threaded")


@scenario
def lower_bound_beyond_deadline(s: Scenario) -> None:
    c = s.standard().callbacks[4]
    c.unknown_release = True
    s.run()
    least = max(r.end - s.release(r)[0] for r in s.rows() if r.callback is c)
    s.spec_changes[c.logical_id] = {"response_deadline": least - 1}
    for rule in ("R1", "R2", "R5"):
        s.expect(rule, s.callback(c), INCONCLUSIVE)
    s.expect("R3", s.callback(c), FAIL)  # even the lower bound is beyond it
