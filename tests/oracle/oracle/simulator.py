"""A machine of a few CPUs under fixed-priority preemptive scheduling, in whole nanoseconds.

Threads are generators that yield ("run", ns), ("wait", until or None) or nothing more. The machine
emits the kernel's events and keeps its own account of each thread's time, which is the truth that
traces are later judged against.
"""

import heapq
import random
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from .ctf_writer import Record

Command = tuple[str, Any]


@dataclass(eq=False)
class SimThread:
    tid: int
    name: str
    pid: int
    body: Generator[Command, None, None]
    priority: int = 0       # real-time priority; 0: SCHED_OTHER
    policy: int = 0
    nice: int = 0
    affinity: tuple[int, ...] = (0,)
    state: str = "ready"    # ready, running, blocked, waking, dead
    cpu: int = 0
    remaining: int = 0
    version: int = 0
    account: str = "wake"   # run, preempted, blocked, wake
    since: int = 0
    sums: dict[str, int] = field(default_factory=lambda: dict.fromkeys(
        ("run", "preempted", "blocked", "wake"), 0))
    waking: int | None = None       # W
    switched_in: int | None = None  # first I after W
    wakeup: int | None = None       # U
    ready_order: int = 0
    start_ns: int = 0
    started: bool = False
    boost: int | None = None        # kernel priority while it inherits one
    triple: tuple[int, int, int] = (0, 0, 0)  # runtime, deadline, period of SCHED_DEADLINE
    stray_cpu: int | None = None    # fault: run here whatever the affinity says

    def kernel_priority(self) -> int:
        """As lttng-modules writes it."""
        if self.boost is not None:
            return self.boost
        if self.policy == 6:
            return -101
        return (99 - self.priority if self.policy in (1, 2) else 120 + self.nice) - 100


class Machine:
    def __init__(self, seed: int, cpus: int, begin: int) -> None:
        self.random = random.Random(seed)
        self.cpus = cpus
        self.now = begin
        self.heap: list[tuple[int, int, Callable[[], None]]] = []
        self.order = 0
        self.current: list[SimThread | None] = [None] * cpus
        self.threads: list[SimThread] = []
        self.user: list[Record] = []
        self.kernel: list[Record] = []
        self.realtime_offset = 1700000000123456789

    # -- time ----------------------------------------------------------------------------------

    def at(self, time: int, action: Callable[[], None]) -> None:
        self.order += 1
        heapq.heappush(self.heap, (max(time, self.now), self.order, action))

    def run_until(self, end: int) -> None:
        while self.heap and self.heap[0][0] <= end:
            self.now, _, action = heapq.heappop(self.heap)
            action()
            while self.heap and self.heap[0][0] == self.now:
                heapq.heappop(self.heap)[2]()
            self._reschedule()
        self.now = end

    # -- threads -------------------------------------------------------------------------------

    def spawn(self, thread: SimThread, parent: SimThread | None) -> None:
        self.threads.append(thread)
        thread.since = self.now
        thread.cpu = thread.affinity[0]
        if parent:
            self._kernel(parent.cpu, "sched_process_fork", parent_comm=parent.name,
                         parent_tid=parent.tid, parent_pid=parent.pid, child_comm=parent.name,
                         child_tid=thread.tid, child_pid=thread.pid)
        thread.state = "new"
        self.at(self.now + self.random.randint(1000, 4000), lambda: self._ready(thread))

    def wake(self, thread: SimThread, cpu: int) -> None:
        """A wake-up from `cpu`; nothing when the thread does not wait."""
        if thread.state != "blocked":
            return
        if thread.account == "run":  # on its way off the CPU in this very instant
            self.at(self.now + 1, lambda: self.wake(thread, cpu))
            return
        thread.version += 1
        self._account(thread, "wake")
        thread.state = "waking"
        thread.waking = self.now
        thread.switched_in = None
        self._kernel(cpu, "sched_waking", comm=thread.name, tid=thread.tid,
                     prio=thread.kernel_priority(), target_cpu=thread.cpu)

        def runnable() -> None:
            if thread.state == "waking":
                self._kernel(thread.cpu, "sched_wakeup", comm=thread.name, tid=thread.tid,
                             prio=thread.kernel_priority(), target_cpu=thread.cpu)
                self.at(self.now + 150, lambda: self._ready(thread))

        self.at(self.now + self.random.randint(200, 6000), runnable)

    def set_boost(self, thread: SimThread, boost: int | None) -> None:
        """Priority inheritance begins or ends."""
        old = thread.kernel_priority()
        thread.boost = boost
        self._kernel(thread.cpu, "sched_pi_setprio", comm=thread.name, tid=thread.tid, oldprio=old,
                     newprio=thread.kernel_priority())

    def kill(self, threads: list[SimThread]) -> None:
        """SIGKILL: they leave their CPUs and are gone."""
        for thread in threads:
            if thread.state == "dead":
                continue
            thread.version += 1
            self._account(thread, "blocked")
            thread.state = "dead"

    def _ready(self, thread: SimThread) -> None:
        if thread.state == "dead":
            return
        thread.state = "ready"
        self.order += 1
        thread.ready_order = self.order

    def _account(self, thread: SimThread, state: str) -> None:
        thread.sums[thread.account] += self.now - thread.since
        thread.account, thread.since = state, self.now

    def totals(self, thread: SimThread) -> dict[str, int]:
        """Its time in each state until now."""
        sums = dict(thread.sums)
        sums[thread.account] += self.now - thread.since
        return sums

    # -- scheduling ----------------------------------------------------------------------------

    def _reschedule(self) -> None:
        """Who runs where from now on. A thread that loses its CPU finds another a moment later."""
        before = list(self.current)
        for cpu, thread in enumerate(self.current):
            if thread and (thread.state != "running" or not self._allowed(thread, cpu)):
                if thread.state == "running":
                    self._ready(thread)
                self.current[cpu] = None
        waiting = sorted((t for t in self.threads if t.state == "ready" and t not in before
                          and not (t.account == "preempted" and t.since == self.now)),
                         key=lambda t: (-t.priority, t.ready_order))
        for thread in waiting:
            free = [c for c in range(self.cpus)
                    if self.current[c] is None and self._allowed(thread, c)]
            if not free:
                weaker = [c for c in range(self.cpus) if self._allowed(thread, c)
                          and self.current[c].priority < thread.priority]
                if not weaker:
                    continue
                victim = min(weaker, key=lambda c: (self.current[c].priority, c))
                self._ready(self.current[victim])
                free = [victim]
            cpu = thread.cpu if thread.cpu in free else free[0]
            self.current[cpu] = thread
            thread.state = "running"
        for cpu in range(self.cpus):
            if before[cpu] is not self.current[cpu]:
                self._switch(cpu, before[cpu], self.current[cpu])
        for cpu in range(self.cpus):
            if self.current[cpu] and before[cpu] is not self.current[cpu]:
                self._resume(self.current[cpu])
        idle = [c for c in range(self.cpus) if self.current[c] is None]
        if any(t.state == "ready" and any(self._allowed(t, c) for c in idle) for t in self.threads):
            self.at(self.now + 137, lambda: None)

    def _allowed(self, thread: SimThread, cpu: int) -> bool:
        if thread.stray_cpu is not None:
            return cpu == thread.stray_cpu
        return cpu in thread.affinity

    def _switch(self, cpu: int, old: SimThread | None, new: SimThread | None) -> None:
        state = 0
        if old:
            runnable = old.state in ("ready", "running")
            state = {True: self.random.choice((0, 256)), False: 1}[runnable]
            if old.state == "dead":
                state = 16
            if old.account == "run":
                old.remaining -= self.now - old.since
                self._account(old, "preempted" if runnable else "blocked")
                old.version += 1
        if new:
            new.cpu = cpu
            if new.waking is not None and new.switched_in is None:
                new.switched_in = self.now
        idle = (f"swapper/{cpu}", 0, 20)
        prev = (old.name, old.tid, old.kernel_priority()) if old else idle
        after = (new.name, new.tid, new.kernel_priority()) if new else idle
        self._kernel(cpu, "sched_switch", prev_comm=prev[0], prev_tid=prev[1], prev_prio=prev[2],
                     prev_state=state, next_comm=after[0], next_tid=after[1], next_prio=after[2])

    def _resume(self, thread: SimThread) -> None:
        self._account(thread, "run")
        if not thread.started:
            thread.started = True
            thread.start_ns = self.now
            thread.remaining = self.random.randint(150, 300)
        self._arm(thread)

    def _arm(self, thread: SimThread) -> None:
        thread.version += 1
        version = thread.version

        def done() -> None:
            if thread.version == version and thread.state == "running":
                thread.remaining = 0
                self._step(thread)

        self.at(self.now + thread.remaining, done)

    def _step(self, thread: SimThread) -> None:
        """Its computation is over: what does it do next?"""
        self._account(thread, "run")
        try:
            what, value = next(thread.body)
        except StopIteration:
            thread.state = "dead"
            self._kernel(thread.cpu, "sched_process_exit", comm=thread.name, tid=thread.tid,
                         prio=thread.kernel_priority())
            return
        if what == "run":
            thread.remaining = value
            self._arm(thread)
            return
        assert what == "wait", what
        thread.version += 1
        thread.state = "blocked"
        if value is not None:
            version = thread.version

            def expire() -> None:
                if thread.state == "blocked" and thread.version in (version, version + 1):
                    self.wake(thread, thread.cpu)

            self.at(value + self.random.randint(500, 3000), expire)

    # -- events --------------------------------------------------------------------------------

    def _kernel(self, cpu: int, event: str, **fields: Any) -> None:
        self.kernel.append(Record(self.now, cpu, event, None, None, fields))

    def emit(self, thread: SimThread, event: str, **fields: Any) -> None:
        self.user.append(Record(self.now, thread.cpu, event, thread.pid, thread.tid, fields))

    def realtime(self) -> int:
        return self.now + self.realtime_offset
