"""A traced application on the simulated machine: executors, callbacks, messages.

It follows the contract as an executor would, and writes down what really happened (`Truth`) from
its own knowledge: which sample was taken, when it arrived, when the thread was woken.
"""

from collections import deque
from typing import Any

from .announcer import Announcer
from .sim_entities import NONE, POLICY_NUMBERS, Body, Sample, SimCallback, Truth
from .simulator import Machine, SimThread


class App(Announcer):
    def __init__(self, machine: Machine, pid: int, executor: str, callbacks: list[SimCallback],
                 pool: int = 1, host: str = "robot") -> None:
        super().__init__(machine, pid, executor, callbacks, host)
        self.pool_size = pool
        self.peers: list[App] = [self]
        self.truth: list[Truth] = []
        self.last_stamp = dict.fromkeys(self.topics, 0)
        self.inbox: deque[Sample] = deque()
        self.stopping = False
        self.crashed = False
        self.threads: list[SimThread] = []
        self.audits: list[int] = []
        self.given: dict[int, tuple[SimCallback, int]] = {}  # at an audit's time: another priority
        self.announce_at: int | None = None
        self.announced_at: int | None = None
        self.stop_at = 0
        self.reuse_tid: int | None = None
        self.replacement_init = False
        self.recv_priority = 70
        self.leaked_worker = False
        self.next_tid = pid + 3
        self.recv: SimThread | None = None
        self.stray: SimCallback | None = None
        self.changed_priority: tuple[SimCallback, int] | None = None
        self.concurrent: SimCallback | None = None
        self.added: SimCallback | None = None
        self.ever_registered = 0

    # -- small steps ---------------------------------------------------------------------------

    def start(self) -> None:
        self.main = SimThread(self.pid, "app", self.pid, self._main(),
                              affinity=tuple(range(self.machine.cpus)))
        self.machine.spawn(self.main, None)

    def crash(self) -> None:
        self.crashed = True
        for row in self.truth:
            row.open_at_crash |= row.end is None
        self.machine.kill([*self.threads, self.main])

    # -- the main thread -----------------------------------------------------------------------

    def _main(self) -> Body:
        me, m = self.main, self.machine
        yield from self._run_begin("start")
        yield from self._state(announce=False)
        for c in self.callbacks:
            c.expiry = c.first_expiry
        yield from self._spawn_all()
        times = sorted([*self.audits, *([self.announce_at] if self.announce_at else [])])
        for time in times:
            while m.now < time:
                yield "wait", time
                yield self._spend(200, 400)
            if time == self.announce_at:
                while any(t.state != "blocked" for t in self.threads):
                    yield "wait", m.now + 150_000
                    yield self._spend(200, 400)
                self.announced_at = m.now
                yield from self._run_begin("announce")
                yield from self._state(announce=True)
                for thread, role, callback, group in list(self.announced):
                    yield from self._thread_init(me, thread, role, callback, group)
            yield from self._say(me, "clock_sync", monotonic_ns=m.now, realtime_ns=m.realtime())
            for thread, *_ in list(self.announced):
                own, priority = self.given.get(time, (None, 0))
                if own and own.thread is thread:
                    thread.priority = priority
                    yield from self._sched(me, thread, "applied")
                elif thread.state != "dead":
                    yield from self._sched(me, thread, "audit")
        while m.now < self.stop_at:
            yield "wait", self.stop_at
            yield self._spend(200, 400)
        self.stopping = True
        for thread in self.threads:
            m.wake(thread, me.cpu)
            yield self._spend(100, 300)
        while any(t.state != "dead" for t in self.threads):
            for thread in self.threads:
                m.wake(thread, me.cpu)
            yield "wait", m.now + 1_000_000
            yield self._spend(200, 400)
        for c in self.callbacks:
            yield from self._say(me, "callback_fini", callback_id=c.id, started=c.started,
                                 ended=c.ended, released=c.released, overwritten=c.overwritten,
                                 lost=c.lost)
        for n, topic in enumerate(self.topics):
            yield from self._say(me, "publisher_fini", publisher_id=n,
                                 published=self.published[topic])
        yield from self._say(me, "clock_sync", monotonic_ns=m.now, realtime_ns=m.realtime())
        yield from self._say(me, "run_end", callbacks=len(self.callbacks),
                             threads=len(self.announced),
                             groups=len({c.group for c in self.callbacks}),
                             publishers=len(self.topics), status=0)
        yield "run", 900

    def _spawn_all(self) -> Body:
        everywhere = tuple(range(self.machine.cpus))
        self.recv = self._spawn("recv", lambda t: self._receive(t), everywhere)
        yield self._spend(8000, 15000)
        if self.leaked_worker:
            leaked = self._spawn("leak", lambda t: self._idle_worker(t), everywhere)
            leaked.policy, leaked.priority = 1, 33
            yield self._spend(8000, 15000)
        if self.executor == "isolated":
            for group in sorted({c.group for c in self.callbacks}):
                members = [c for c in self.callbacks if c.group == group]
                self._spawn(f"cie-{members[0].id}",
                            lambda t, cs=members: self._isolated(t, cs), everywhere,
                            members[0])
                yield self._spend(8000, 15000)
        else:
            for n in range(self.pool_size):
                self._spawn(f"pool-{n}", lambda t: self._pool(t), everywhere)
                yield self._spend(8000, 15000)

    def _spawn(self, name: str, body: Any, affinity: tuple[int, ...],
               callback: SimCallback | None = None, tid: int | None = None,
               parent: SimThread | None = None) -> SimThread:
        if tid is None:
            tid = self.next_tid
            self.next_tid += self.machine.random.randint(1, 4)
        thread = SimThread(tid, name, self.pid, iter(()), affinity=affinity)
        thread.body = body(thread)
        if callback:
            callback.thread = thread
        self.threads.append(thread)
        self.machine.spawn(thread, parent or self.main)
        return thread

    # -- receive thread ------------------------------------------------------------------------

    def _receive(self, me: SimThread) -> Body:
        yield from self._hello(me, "worker")
        if self.executor == "isolated":
            yield from self._apply(me, 1, self.recv_priority, me.affinity)
        while not self.stopping:
            if not self.inbox:
                yield "wait", None
                yield self._spend(500, 1200)
                continue
            sample = self.inbox.popleft()
            for c in self.callbacks:
                if c.listens != sample.topic or c.kind == "timer":
                    continue
                taken = Sample(sample.topic, sample.writer_gid, sample.stamp, sample.published,
                               sample.source, self.machine.now)
                if c.lost_samples and c.released == 2:
                    c.lost += c.lost_samples
                    yield from self._say(me, "sample_lost", callback_id=c.id, count=c.lost_samples,
                                         total=c.lost)
                    c.lost_samples = 0
                if len(c.queue) >= c.depth:
                    c.queue.popleft()
                    c.overwritten += 1
                c.queue.append(taken)
                c.released += 1
                yield self._spend(50, 90)
                c.waiting.append((self.machine.now, len(c.queue)))
                self.machine.emit(me, "callback_release", callback_id=c.id,
                                  release_seq=c.released - 1, overwritten=c.overwritten)
                self._alert(c, me.cpu)
                yield self._spend(60, 200)
        yield from self._bye(me)

    def _alert(self, c: SimCallback, cpu: int) -> None:
        if self.executor == "isolated":
            if c.thread:
                self.machine.wake(c.thread, cpu)
        else:
            for thread in self.threads:
                if thread.name.startswith("pool") and thread.state == "blocked":
                    self.machine.wake(thread, cpu)
                    break

    def _idle_worker(self, me: SimThread) -> Body:
        yield from self._hello(me, "worker")
        while not self.stopping:
            yield "wait", None
            yield self._spend(200, 400)
        yield from self._bye(me)

    # -- executors -----------------------------------------------------------------------------

    def _ready(self, c: SimCallback) -> bool:
        if c.silent:
            return False
        if c.running and c is not self.concurrent:
            return False
        return self.machine.now >= c.expiry if c.kind == "timer" else bool(c.queue)

    def _isolated(self, me: SimThread, members: list[SimCallback]) -> Body:
        own = members[0]
        if own.unannounced:
            self.read_backs[me] = 0
        else:
            yield from self._hello(me, "callback", own.id, own.group)
        configured = False
        if not own.late_apply and not own.never_apply:
            yield from self._configure(me, own)
            configured = True
        runs = 0
        while not self.stopping:
            ready = [c for c in members if self._ready(c)]
            stolen = own.steals
            if stolen and stolen.queue and own.started == 3:
                own.steals = None
                yield from self._instance(me, stolen)
                continue
            if not ready:
                timers = [c.expiry for c in members if c.kind == "timer" and not c.silent]
                until = min(timers) if timers else None
                if until is not None and own.oversleep_at == own.started:
                    own.oversleep_at = None
                    until += own.period + 20_000
                before = self.machine.now
                yield "wait", until
                yield self._spend(60, 250)
                if me.waking is not None and me.waking >= before:
                    reason = "guard" if self.stopping else "data" if own.kind != "timer" else "timer"
                    yield from self._wakeup(me, own.id if len(members) == 1 else NONE, reason)
                continue
            yield self._spend(900, 2500)
            yield from self._instance(me, ready[0])
            runs += 1
            if own.foreign_work:
                yield "run", own.foreign_work
            if not configured and own.late_apply:
                yield from self._configure(me, own)
                configured = True
            if own.early_bye_after == runs:
                yield from self._bye(me)
            if own.exit_after == runs:
                own.exit_after = None
                yield from self._bye(me)
                self._replace(me, own)
                return
        if not own.unannounced and own.early_bye_after is None:
            yield from self._bye(me)

    def _apply(self, me: SimThread, policy: int, priority: int, affinity: tuple[int, ...]) -> Body:
        yield self._spend(700, 1500)
        me.policy, me.priority, me.affinity = policy, priority, affinity
        if me.cpu not in affinity:
            yield "wait", self.machine.now + 1000  # the kernel moves it
        yield self._spend(100, 300)
        yield from self._sched(me, me, "applied")

    def _configure(self, me: SimThread, own: SimCallback) -> Body:
        priority = own.applied_priority if own.applied_priority is not None else own.priority
        me.nice, me.triple = own.nice, own.triple
        yield from self._apply(me, POLICY_NUMBERS[own.policy_name], priority, own.affinity)
        if own is self.stray:
            outside = [c for c in range(self.machine.cpus) if c not in own.affinity]
            me.stray_cpu = outside[0]

    def _replace(self, old: SimThread, own: SimCallback) -> None:
        """The thread ends; a moment later another takes its place (or its tid another callback)."""
        m = self.machine
        tid = old.tid if self.reuse_tid is not None else None
        heir = self.added or own
        own.thread = None

        def successor(t: SimThread) -> Body:
            if self.replacement_init or self.added:
                yield from self._callback_init(t, heir)
            yield from self._isolated(t, [heir])

        def born() -> None:
            if self.stopping:
                return
            if self.added:
                self.callbacks.append(heir)
                own.silent = True
                heir.expiry = m.now + heir.period
            self._spawn(f"cie-{heir.id}", successor, tuple(range(m.cpus)), heir, tid,
                        parent=self.main)

        m.at(m.now + 200_000, born)

    def _pool(self, me: SimThread) -> Body:
        yield from self._hello(me, "pool")
        while not self.stopping:
            ready = [c for c in self.callbacks if self._ready(c)]
            if ready:
                chosen = ready[0]
                chosen.running += 1
                yield self._spend(900, 2500)
                chosen.running -= 1
                if chosen.kind == "timer" or chosen.queue:
                    yield from self._instance(me, chosen)
                continue
            timers = [c.expiry for c in self.callbacks
                      if c.kind == "timer" and not c.running and not c.silent]
            before = self.machine.now
            yield "wait", min(timers) if timers else self.machine.now + 5_000_000
            yield self._spend(60, 250)
            if me.waking is not None and me.waking >= before:
                reason = "guard" if self.stopping else "spurious"
                yield from self._wakeup(me, NONE, reason)
        yield from self._bye(me)

    def _wakeup(self, me: SimThread, callback: int, reason: str) -> Body:
        me.wakeup = self.machine.now
        yield from self._say(me, "thread_wakeup", callback_id=callback, reason=reason)

    # -- an instance ---------------------------------------------------------------------------

    def _instance(self, me: SimThread, c: SimCallback) -> Body:
        m = self.machine
        c.running += 1
        missed, sample = 0, None
        if c.kind == "timer":
            missed = max(0, (m.now - c.expiry) // c.period)
            release = c.expiry + missed * c.period
            c.expiry = release + c.period
            release = min(release, m.now)  # another callback may run it before it is due
        else:
            sample = c.queue.popleft()
            release = sample.arrival
        seq, c.started = c.started, c.started + 1
        kind = "timer" if c.kind == "timer" else "data"
        unknown = c.unknown_release or seq in c.unknown_seqs
        m.emit(me, "callback_start", callback_id=c.id, seq=seq, release_kind=kind,
               release_ns=-1 if unknown else release, missed=missed,
               source_timestamp_realtime_ns=sample.stamp if sample else 0,
               writer_gid=sample.writer_gid if sample else 0)
        row = Truth(self, c, me, seq, release, not unknown, missed, m.now, me.cpu,
                    me.wakeup, me.waking, me.switched_in, sample, m.totals(me))
        self.truth.append(row)
        work = m.random.randint(*c.work)
        first = work * m.random.randint(30, 70) // 100
        yield "run", first
        if c.nests and seq == 2:
            inner, c.nests = c.nests, None
            if inner.kind == "timer" or inner.queue:
                yield from self._instance(me, inner)
                yield self._spend(1000, 2000)
        if c.publishes:
            for _ in range(c.publish_count):
                yield from self._publish(me, c, row)
        if c.blocking and m.random.random() < c.blocking:
            yield "wait", m.now + m.random.randint(10_000, 60_000)
        yield "run", max(1000, work - first)
        if c.no_end_at == seq:
            row.open_at_crash = False
            c.running -= 1
            me.wakeup = me.waking = me.switched_in = None
            yield self._spend(100, 200)
            return
        status = "exception" if c.exception_at == seq else "ok"
        m.emit(me, "callback_end", callback_id=c.id, seq=seq, status=status)
        row.end, row.cpu_end, row.status = m.now, me.cpu, status
        row.sums = {k: v - row.sums[k] for k, v in m.totals(me).items()}
        c.ended += 1
        c.running -= 1
        me.wakeup = me.waking = me.switched_in = None
        yield self._spend(150, 400)
        if c.uncounted_second_end_at == seq or c.extra_end_at == seq:
            end = seq if c.uncounted_second_end_at == seq else 1000
            yield from self._say(me, "callback_end", callback_id=c.id, seq=end, status="ok")
        if c.second_end_at == seq:
            c.ended += 1
            yield from self._say(me, "callback_end", callback_id=c.id, seq=seq, status="ok")

    def _publish(self, me: SimThread, c: SimCallback, row: Truth) -> Body:
        m, topic = self.machine, c.publishes
        sample = Sample(topic, published=m.now, source=row)
        if topic in self.writer:
            sample.writer_gid = self.writer[topic]
            sample.stamp = max(m.realtime() - m.random.randint(0, 40), self.last_stamp[topic] + 1)
            self.last_stamp[topic] = sample.stamp
            m.emit(me, "publish", publisher_id=self.topics.index(topic), seq=self.published[topic],
                   source_timestamp_realtime_ns=sample.stamp)
            self.published[topic] += 1
            row.publishes.append(sample)
        yield self._spend(300, 900)
        cpu = me.cpu
        for app in self.peers:
            if any(x.listens == topic and x.kind != "timer" for x in app.callbacks):
                delay = m.random.randint(20_000, 60_000)

                def arrive(target: App = app) -> None:
                    target.inbox.append(sample)
                    if target.recv:
                        m.wake(target.recv, cpu)

                m.at(m.now + delay, arrive)
        yield self._spend(300, 900)
