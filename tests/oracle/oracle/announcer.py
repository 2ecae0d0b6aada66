"""What a traced application says about itself: the state events of the contract."""

from typing import Any

from .sim_entities import NONE, Body, SimCallback
from .simulator import Command, Machine, SimThread


class Announcer:
    def __init__(self, machine: Machine, pid: int, executor: str, callbacks: list[SimCallback],
                 host: str) -> None:
        self.machine, self.pid, self.executor, self.host = machine, pid, executor, host
        self.callbacks = callbacks
        self.topics = sorted({c.publishes for c in callbacks
                              if c.publishes and not c.publishes.startswith(("request:", "reply:"))})
        self.writer = {t: machine.random.getrandbits(63) | 1 for t in self.topics}
        self.published = dict.fromkeys(self.topics, 0)
        self.announced: list[tuple[SimThread, str, int, int]] = []
        self.read_backs: dict[SimThread, int] = {}
        self.process_start = machine.now - 6_000_000
        self.main: SimThread | None = None

    def _say(self, thread: SimThread, event: str, **fields: Any) -> Body:
        """A tracepoint and what it costs."""
        self.machine.emit(thread, event, **fields)
        yield "run", self.machine.random.randint(50, 250)

    def _spend(self, low: int, high: int) -> Command:
        return "run", self.machine.random.randint(low, high)

    def _run_begin(self, moment: str) -> Body:
        m = self.machine
        yield from self._say(
            self.main, "run_begin", contract_version=1, tool_version="sim", executor=self.executor,
            boot_id="5a17c0de-0b07-4b1d-9abc-0123456789ab", host=self.host, pid=self.pid,
            pid_ns=4026531836, process_start_ns=self.process_start, monotonic_ns=m.now,
            realtime_ns=m.realtime(), online_cpus=m.cpus, spec_sha256="", moment=moment)

    def _state(self, announce: bool) -> Body:
        me = self.main
        nodes = self._nodes()
        for n, node in enumerate(nodes):
            yield from self._say(me, "node_init", node_id=n, name=node)
        for group, c in sorted({c.group: c for c in reversed(self.callbacks)}.items()):
            yield from self._say(me, "group_init", group_id=group, node_id=nodes.index(c.node),
                                 type=c.group_type)
        for n, topic in enumerate(self.topics):
            node = next(c.node for c in self.callbacks if c.publishes == topic)
            yield from self._say(me, "publisher_init", publisher_id=n, node_id=nodes.index(node),
                                 topic=topic, writer_gid=self.writer[topic],
                                 next_seq=self.published[topic])
        for c in self.callbacks:
            yield from self._callback_init(me, c)

    def _nodes(self) -> list[str]:
        return sorted({c.node for c in self.callbacks})

    def _callback_init(self, thread: SimThread, c: SimCallback) -> Body:
        yield from self._say(thread, "callback_init", callback_id=c.id, group_id=c.group,
                             node_id=self._nodes().index(c.node), kind=c.kind,
                             logical_id=c.logical_id, source=c.source,
                             symbol=f"app::{c.kind}_{c.id}", period_ns=c.period,
                             queue_depth=c.depth, deadline_ns=c.deadline, next_seq=c.started)

    def _hello(self, me: SimThread, role: str, callback: int = NONE, group: int = NONE) -> Body:
        self.announced.append((me, role, callback, group))
        yield from self._thread_init(me, me, role, callback, group)
        yield from self._sched(me, me, "initial")

    def _thread_init(self, teller: SimThread, me: SimThread, role: str, callback: int,
                     group: int) -> Body:
        yield from self._say(teller, "thread_init", tid=me.tid, role=role, callback_id=callback,
                             group_id=group, name=me.name, start_ns=me.start_ns)

    def _sched(self, teller: SimThread, me: SimThread, moment: str) -> Body:
        n = self.read_backs.get(me, 0)
        self.read_backs[me] = n + 1
        yield from self._say(teller, "thread_sched", tid=me.tid, moment=moment, n=n,
                             policy=me.policy, flags=1 if me.policy else 0, nice=me.nice,
                             priority=me.priority if me.policy in (1, 2) else 0,
                             runtime_ns=me.triple[0], deadline_ns=me.triple[1],
                             period_ns=me.triple[2],
                             cpus=list(me.affinity), error=0)

    def _bye(self, me: SimThread) -> Body:
        yield from self._say(me, "thread_fini", tid=me.tid, read_backs=self.read_backs[me])
        yield "run", 700
