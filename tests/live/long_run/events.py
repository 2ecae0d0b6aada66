"""Events as babeltrace2 prints them: another reader than ours."""

import re
import subprocess
from collections import Counter

# Hot events whose totals the application tells at its end: the event, the object's field, the event with the
# totals and its field.
TOTALS = {
    "callback_start": ("callback_id", "callback_fini", "started"),
    "callback_end": ("callback_id", "callback_fini", "ended"),
    "publish": ("publisher_id", "publisher_fini", "published"),
}
NAME = re.compile(r" cie:(\w+): ")
FIELDS = {event: re.compile(rf"\b{field} = (\d+)") for event, (field, _, _) in TOTALS.items()}
SEQ = re.compile(r"\bseq = (\d+)")
NUMBERS = re.compile(r"\b(\w+) = (\d+)")
CPU = re.compile(r"cpu_id = (\d+)")


def lines_of(trace):
    with subprocess.Popen(["babeltrace2", "--clock-seconds", str(trace)], stdout=subprocess.PIPE, text=True) as reader:
        yield from reader.stdout
    if reader.returncode != 0:
        raise AssertionError(f"babeltrace2 cannot read {trace}")


class Counts:
    """Events recorded, per object; and what the application says it emitted."""

    def __init__(self):
        self.recorded = Counter()  # (event, object)
        self.by_kind = Counter()
        self.emitted = {}  # "event object": number
        self.names = {}

    @classmethod
    def of(cls, trace):
        counts = cls()
        for line in lines_of(trace):
            name = NAME.search(line)
            if not name:
                continue
            event = name[1]
            counts.by_kind[event] += 1
            if event in TOTALS:
                counts.recorded[event, FIELDS[event].search(line)[1]] += 1
            elif event in ("callback_fini", "publisher_fini"):
                counts.take_totals(event, dict(NUMBERS.findall(line)))
        return counts

    def take_totals(self, event, fields):
        for hot, (field, told_by, total) in TOTALS.items():
            if told_by == event:
                self.emitted[f"{hot} {fields[field]}"] = int(fields[total])

    def add(self, other):
        self.recorded += other.recorded
        self.by_kind += other.by_kind
        self.emitted |= other.emitted

    def total(self):
        return sum(self.by_kind.values())

    def by_object(self):
        return {f"{event} {number}": count for (event, number), count in self.recorded.items()}


class Snapshot:
    """Of what a flight recorder saved: whether everything is there from the moment on when no CPU's buffer was
    overwritten any more, until the first CPU's was taken (LTTng takes them one after the other), and how far it
    reaches. `ragged`: numbers that are missing later."""

    def __init__(self, trace):
        began, ended = {}, {}  # by CPU
        seen = []
        for line in lines_of(trace):
            name = NAME.search(line)
            if not name or name[1] not in TOTALS:
                continue
            time = line[1:line.index("]")]
            cpu = CPU.search(line)[1]
            began.setdefault(cpu, time)
            ended[cpu] = time
            seen.append((time, name[1], FIELDS[name[1]].search(line)[1], int(SEQ.search(line)[1])))
        self.events = len(seen)
        # Seconds since the epoch have equally many digits.
        begin = max(began.values(), default="")
        numbers = self.numbers_of(seen, begin, seen[-1][0] if seen else "")
        within = self.numbers_of(seen, begin, min(ended.values(), default=""))
        self.holes = self.holes_in(within)
        self.ragged = self.holes_in(numbers) - self.holes
        self.reached = {key: max(seqs) + 1 for key, seqs in numbers.items()}

    @staticmethod
    def numbers_of(seen, begin, end):
        numbers = {}
        for time, event, number, seq in seen:
            if begin <= time <= end:
                numbers.setdefault(f"{event} {number}", []).append(seq)
        return numbers

    @staticmethod
    def holes_in(numbers):
        return sum(max(seqs) - min(seqs) + 1 - len(set(seqs)) for seqs in numbers.values())
