"""Cause-effect chains: instances linked by the messages they publish and take."""

from collections import defaultdict
from dataclasses import dataclass, field

from .entities import Callback, Instance
from .model import Model
from .text_trace import Event


@dataclass(eq=False)
class ChainInstance:
    instances: list[Instance]
    publishes: list[Event]  # one per link

    @property
    def read(self) -> int:
        return self.instances[0].start

    @property
    def write(self) -> int:
        return self.instances[-1].end

    @property
    def measured(self) -> bool:
        return self.instances[0].exact

    @property
    def divided(self) -> bool:
        return all(i.exact for i in self.instances)

    @property
    def path_latency(self) -> int:
        return self.instances[-1].end - self.instances[0].release

    @property
    def latest_latency(self) -> int | None:
        """At most: the first release was not before its message was written."""
        written = self.instances[0].source_time
        return None if written is None or written > self.read else self.write - written

    def left(self, hop: int) -> int:
        """When what the path carries left a callback."""
        return self.write if hop + 1 == len(self.instances) else self.publishes[hop].time

    @property
    def undivided(self) -> int:
        """From publish to publish, where the release between them is unknown."""
        return sum(self.left(k) - self.left(k - 1)
                   for k, i in enumerate(self.instances) if k and not i.exact)


@dataclass(eq=False)
class Chain:
    name: str
    hops: list[str]
    instances: list[ChainInstance] = field(default_factory=list)
    broken: int = 0  # completed last instances whose publish is unseen

    def path_latencies(self) -> list[int]:
        return [c.path_latency for c in self.instances if c.measured]

    @staticmethod
    def _whole(a: ChainInstance, b: ChainInstance) -> bool:
        """No callback of the chain lost a seq between the two."""
        for x, y in zip(a.instances, b.instances):
            if x.process is not y.process:
                return False
            seen = {i.seq for i in x.callback.instances}
            if any(s not in seen for s in range(x.seq, y.seq)):
                return False
        return True

    def _stretches(self) -> list[list[ChainInstance]]:
        """Chain instances by their writes, apart where something was lost between two."""
        stretches: list[list[ChainInstance]] = []
        for c in sorted(self.instances, key=lambda c: (c.write, c.read)):
            if stretches and self._whole(stretches[-1][-1], c):
                stretches[-1].append(c)
            else:
                stretches.append([c])
        return stretches

    def reaction_times(self) -> list[int]:
        """Of every read from a stretch's first on, whether or not a chain begins with it."""
        times = []
        for stretch in self._stretches():
            first = stretch[0].instances[0]
            for i in first.callback.instances:
                if i.start < first.start:
                    continue
                writes = [c.write for c in stretch if c.read > i.start]
                if writes:
                    times.append(writes[0] - i.start)
        return times

    def data_ages(self) -> list[int]:
        return [b.write - a.read for stretch in self._stretches()
                for a, b in zip(stretch, stretch[1:])]


class ChainFinder:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.messages: dict[tuple[int, int], tuple[Event, Instance | None]] = {}
        self.first_stamp: dict[int, int] = {}
        inside: dict[int, Instance] = {}
        for i in model.instances:
            for p in i.publishes:
                inside.setdefault(id(p), i)
        for process in model.processes:
            for publisher, events in process.publishes.items():
                init = process.publishers.get(publisher)
                if init is None:
                    continue
                gid = init.writer_gid
                for e in events:
                    stamp = e.source_timestamp_realtime_ns
                    self.messages[gid, stamp] = (e, inside.get(id(e)))
                    self.first_stamp[gid] = min(stamp, self.first_stamp.get(gid, stamp))

    def source(self, i: Instance) -> tuple[Event, Instance | None] | None:
        s = i.start_event
        if not s.source_timestamp_realtime_ns:
            return None
        return self.messages.get((s.writer_gid, s.source_timestamp_realtime_ns))

    def before_first_seen(self, i: Instance) -> bool:
        s = i.start_event
        first = self.first_stamp.get(s.writer_gid)
        return first is not None and s.source_timestamp_realtime_ns < first

    def find(self, name: str, hops: list[str]) -> Chain:
        chain = Chain(name, hops)
        for last in self.model.instances:
            if last.callback.logical_id != hops[-1] or not last.counted:
                continue
            path, links, at = [last], [], last
            for hop in reversed(hops[:-1]):
                found = self.source(at)
                if found is None:
                    if at.start_event.source_timestamp_realtime_ns and not self.before_first_seen(at):
                        chain.broken += 1
                    break
                event, instance = found
                if instance is None or instance.callback.logical_id != hop:
                    break
                path.insert(0, instance)
                links.insert(0, event)
                at = instance
            else:
                chain.instances.append(ChainInstance(path, links))
        return chain

    def maximal_paths(self) -> list[list[Callback]]:
        """Every maximal source-to-sink path that messages were seen to take."""
        successors: dict[Callback, set[Callback]] = defaultdict(set)
        sinks: set[Callback] = set()
        for i in self.model.instances:
            found = self.source(i)
            if found and found[1]:
                successors[found[1].callback].add(i.callback)
                sinks.add(i.callback)
        paths: list[list[Callback]] = []

        def walk(path: list[Callback]) -> None:
            after = [c for c in successors.get(path[-1], ()) if c not in path]
            if not after:
                paths.append(path)
            for c in after:
                walk([*path, c])

        for source in list(successors):
            if source not in sinks:
                walk([source])
        return paths
