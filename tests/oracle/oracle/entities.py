"""Processes, threads, callbacks and instances as a trace shows them."""

from collections import defaultdict
from dataclasses import dataclass, field

from .text_trace import Event

NONE = 0xFFFFFFFF


@dataclass(eq=False)
class Instance:
    process: "Process"
    callback: "Callback"
    thread: "Thread"
    start_event: Event
    end_event: Event | None = None
    wakeup: int | None = None       # U
    waking: int | None = None       # W
    switched_in: int | None = None  # first I after W
    publishes: list[Event] = field(default_factory=list)
    release: int | None = None
    release_source: str = "start"
    source_time: int | None = None  # S on the monotonic clock, same host only
    execution: int | None = None
    preempted: int | None = None
    blocked: int | None = None
    wake_delay: int | None = None
    nested_in: "Instance | None" = None
    cut: bool = False

    @property
    def seq(self) -> int:
        return self.start_event.seq

    @property
    def start(self) -> int:
        return self.start_event.time

    @property
    def end(self) -> int | None:
        return self.end_event.time if self.end_event else None

    @property
    def exact(self) -> bool:
        return self.release_source == "exact"

    @property
    def missed(self) -> int:
        return self.start_event.missed if self.callback.kind == "timer" else 0

    @property
    def counted(self) -> bool:
        return self.end is not None and not self.cut


@dataclass(eq=False)
class Callback:
    process: "Process"
    id: int
    inits: list[Event] = field(default_factory=list)
    fini: Event | None = None
    starts: list[Event] = field(default_factory=list)
    ends: list[Event] = field(default_factory=list)
    releases: list[Event] = field(default_factory=list)
    lost: list[Event] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)

    @property
    def known(self) -> bool:
        return bool(self.inits)

    @property
    def logical_id(self) -> str:
        return self.inits[0].logical_id if self.inits else ""

    @property
    def kind(self) -> str:
        return self.inits[0].kind if self.inits else ""

    @property
    def source(self) -> str:
        """Empty for a timer. babeltrace2 2.0 prints an empty string as the one that the same field
        object held before when streams interleave, so the text is not asked for it."""
        return self.inits[0].fields["source"] if self.inits and self.kind != "timer" else ""

    @property
    def base(self) -> int | None:
        """The seq of the first start that this trace can hold."""
        bases = [self.inits[0].next_seq] if self.inits else []
        if self.starts:
            bases.append(min(e.seq for e in self.starts))
        return min(bases) if bases else None


@dataclass(eq=False)
class Thread:
    """An incarnation: a tid with the time of its creation."""

    process: "Process"
    tid: int
    start_ns: int | None  # None: never announced
    init: Event | None = None
    fini: Event | None = None
    scheds: list[Event] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    user: list[Event] = field(default_factory=list)    # events it emitted
    kernel: list[Event] = field(default_factory=list)  # switches and wake-ups of it
    exit: int | None = None
    after: int = 0  # of one that was never announced: when the tid's last thread ended
    open: list[Instance] = field(default_factory=list)
    waking: int | None = None
    wakeup: int | None = None

    @property
    def role(self) -> str | None:
        return self.init.role if self.init else None

    @property
    def isolated(self) -> bool:
        return self.role == "callback"

    @property
    def name(self) -> str:
        return self.init.fields["name"] if self.init else ""

    @property
    def first_seen(self) -> int:
        if self.start_ns is not None:
            return self.start_ns
        return min([e.time for e in self.user[:1]] + [e.time for e in self.kernel[:1]])

    @property
    def last_seen(self) -> int:
        """The last moment at which something shows it alive."""
        times = [e.time for e in self.user[-1:]]
        for e in self.kernel:
            dead = e.name == "sched_switch" and e.prev_tid == self.tid and e.prev_state & 0x30
            if not dead:
                times.append(e.time)
        return max(times, default=self.first_seen)


@dataclass(eq=False)
class Process:
    host: str
    pid: int
    start_ns: int | None
    begins: list[Event] = field(default_factory=list)
    end: Event | None = None
    events: int = 0
    last_event: int = 0
    nodes: dict[int, str] = field(default_factory=dict)
    groups: dict[int, Event] = field(default_factory=dict)
    callbacks: dict[int, Callback] = field(default_factory=dict)
    publishers: dict[int, Event] = field(default_factory=dict)
    publisher_finis: dict[int, Event] = field(default_factory=dict)
    publishes: dict[int, list[Event]] = field(default_factory=lambda: defaultdict(list))
    threads: list[Thread] = field(default_factory=list)

    @property
    def announced_late(self) -> bool:
        return bool(self.begins) and self.begins[0].moment == "announce"

    def callback(self, id_: int) -> Callback:
        return self.callbacks.setdefault(id_, Callback(self, id_))
