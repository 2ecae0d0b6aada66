"""What the simulated application is made of: callbacks with their faults, samples, true instances."""

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from .simulator import Command, SimThread

if TYPE_CHECKING:
    from .application import App

NONE = 0xFFFFFFFF
POLICY_NUMBERS = {"SCHED_OTHER": 0, "SCHED_FIFO": 1, "SCHED_RR": 2, "SCHED_BATCH": 3,
                  "SCHED_IDLE": 5, "SCHED_DEADLINE": 6}
Body = Generator[Command, None, None]


@dataclass(eq=False)
class Sample:
    topic: str
    writer_gid: int = 0
    stamp: int = 0
    published: int = 0
    source: "Truth | None" = None
    arrival: int = 0


@dataclass(eq=False)
class Truth:
    """One instance as it was."""

    app: "App"
    callback: "SimCallback"
    thread: SimThread
    seq: int
    release: int
    release_known: bool
    missed: int
    start: int
    cpu_start: int
    wakeup: int | None
    waking: int | None
    switched_in: int | None
    sample: Sample | None
    sums: dict[str, int]
    end: int | None = None
    cpu_end: int | None = None
    status: str = ""
    publishes: list[Sample] = field(default_factory=list)
    open_at_crash: bool = False


@dataclass(eq=False)
class SimCallback:
    id: int
    kind: str
    node: str
    source: str = ""
    period: int = 0
    work: tuple[int, int] = (50_000, 150_000)
    publishes: str | None = None
    publish_count: int = 1
    priority: int = 0
    affinity: tuple[int, ...] = (0,)
    group: int = 0
    group_type: str = "mutually_exclusive"
    depth: int = 10
    suffix: str = ""
    first_expiry: int = 0
    blocking: float = 0.0
    deadline: int = 0
    policy: str = ""  # empty: by priority
    nice: int = 0
    triple: tuple[int, int, int] = (0, 0, 0)
    # Faults, each off by default.
    unknown_release: bool = False
    unknown_seqs: tuple[int, ...] = ()
    extra_end_at: int | None = None
    uncounted_second_end_at: int | None = None
    second_end_at: int | None = None
    no_end_at: int | None = None
    oversleep_at: int | None = None
    exception_at: int | None = None
    late_apply: bool = False
    never_apply: bool = False
    applied_priority: int | None = None
    foreign_work: int = 0
    lost_samples: int = 0
    exit_after: int | None = None
    early_bye_after: int | None = None
    silent: bool = False
    unannounced: bool = False
    steals: "SimCallback | None" = None
    nests: "SimCallback | None" = None
    # State.
    queue: deque[Sample] = field(default_factory=deque)
    expiry: int = 0
    running: int = 0
    started: int = 0
    ended: int = 0
    released: int = 0
    overwritten: int = 0
    lost: int = 0
    waiting: list[tuple[int, int]] = field(default_factory=list)  # (time, queued), as it is told
    thread: SimThread | None = None

    @property
    def logical_id(self) -> str:
        if self.kind == "timer":
            return f"{self.node}@Timer({self.period}){self.suffix}"
        return f"{self.node}@{self.kind.capitalize()}({self.source}){self.suffix}"

    @property
    def policy_name(self) -> str:
        return self.policy or ("SCHED_FIFO" if self.priority else "SCHED_OTHER")

    @property
    def listens(self) -> str:
        return {"service": "request:", "client": "reply:"}.get(self.kind, "") + self.source
