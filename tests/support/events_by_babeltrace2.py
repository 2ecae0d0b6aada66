"""What `cie events` prints, held against what babeltrace2 prints of the same traces: every event, every field."""
import collections
import itertools
import json
import math
import re
import subprocess

HEAD = re.compile(r"\[(-?\d+)\] \(\+[\d?]+\) (?:(\S+) )?([^ {}]+): ")
NAME = re.compile(r"\s*([A-Za-z_]\w*) = ")
INDEX = re.compile(r"\s*\[\d+\] = ")
NUMBER = re.compile(r"-?(?:0x[0-9A-Fa-f]+|inf|nan|\d+(?:\.\d+)?(?:e[+-]?\d+)?)")
STRING = re.compile(r'"((?:[^"\\]|\\.)*)"', re.S)
LABEL = re.compile(r'\s*(?:"((?:[^"\\]|\\.)*)"|<unknown>)\s*')
ESCAPE = re.compile(rb"\\(x[0-9a-fA-F]{2}|.)", re.S)
ESCAPED = {b"n": b"\n", b"t": b"\t", b"a": b"\a", b"b": b"\b", b"f": b"\f", b"r": b"\r", b"v": b"\v", b"e": b"\x1b"}


def unescaped(text):
    def one(match):
        letter = match.group(1)
        return bytes.fromhex(letter[1:].decode()) if len(letter) == 3 else ESCAPED.get(letter, letter)
    return ESCAPE.sub(one, text.encode("utf-8", "surrogateescape")).decode("utf-8", "replace")


class Line:
    def __init__(self, text, at):
        self.text, self.at = text, at

    def skip(self, what):
        while self.text[self.at:self.at + 1] == " ":
            self.at += 1
        found = self.text.startswith(what, self.at)
        self.at += len(what) if found else 0
        return found

    def take(self, pattern):
        match = pattern.match(self.text, self.at)
        if match:
            self.at = match.end()
        return match

    def structure(self):
        values = {}
        while not self.skip("}"):
            name = self.take(NAME)
            assert name, self.text[self.at:self.at + 60]
            values[name.group(1)] = self.value()
            self.skip(",")
        return values

    def value(self):
        if self.skip("{"):
            # A variant is its option in braces.
            at = self.at
            if self.skip("}") or self.take(NAME):
                self.at = at
                return self.structure()
            value = self.value()
            assert self.skip("}"), self.text[self.at:self.at + 60]
            return value
        if self.skip("["):
            items = []
            while not self.skip("]"):
                self.take(INDEX)
                items.append(self.value())
                self.skip(",")
            return items
        if self.skip("("):
            return self.label()
        if match := self.take(STRING):
            return unescaped(match.group(1))
        match = self.take(NUMBER)
        assert match, self.text[self.at:self.at + 60]
        text = match.group(0)
        return int(text, 0) if re.fullmatch(r"-?(0x[0-9A-Fa-f]+|\d+)", text) else float(text)

    def label(self):
        several = self.skip("{")
        labels = []
        while match := self.take(LABEL):
            labels.append(match.group(1))
            self.skip(",")
        if several:
            self.skip("}")
        self.skip(": container = ")
        number = self.value()
        self.skip(")")
        return number if labels in ([], [None]) else unescaped(labels[0])


def printed_by_babeltrace2(traces):
    done = subprocess.run(["babeltrace2", "--clock-cycles", *map(str, traces)], capture_output=True, timeout=600, check=True)
    for text in done.stdout.decode("utf-8", "surrogateescape").split("\n"):
        if not text:
            continue
        head = HEAD.match(text)
        assert head, text[:100]
        line, fields = Line(text, head.end()), {}
        while line.skip("{"):
            fields.update(line.structure())
            line.skip(",")
        yield (int(head.group(1)), head.group(3), head.group(2) or "", fields.pop("cpu_id", None)), fields


def printed_by_cie(cie, traces, *options):
    done = subprocess.run([cie, "events", "-f", "json", *options, *map(str, traces)], capture_output=True, timeout=600,
                          check=True)
    for text in done.stdout.decode("utf-8").splitlines():
        event = json.loads(text)
        yield (event["time_ns"], event["name"], event["host"], event["cpu"]), {**event["context"], **event["fields"]}


def is_same(ours, theirs):
    if isinstance(ours, dict):
        return isinstance(theirs, dict) and ours.keys() == theirs.keys() and all(is_same(ours[k], theirs[k]) for k in ours)
    if isinstance(ours, list):
        return isinstance(theirs, list) and len(ours) == len(theirs) and all(map(is_same, ours, theirs))
    if isinstance(theirs, float) and not isinstance(ours, list):
        ours = float(ours)  # "nan" as well
        return (math.isnan(ours) and math.isnan(theirs)) or math.isclose(ours, theirs, rel_tol=1e-5)
    if isinstance(ours, float):  # of which babeltrace2 prints six digits
        return math.isclose(ours, theirs, rel_tol=1e-5)
    # babeltrace2 2.0.4 prints the text before instead of an empty one.
    return ours == theirs or (ours == "" and isinstance(theirs, str))


def differences(cie, *traces):
    """The first few, in words, and the number of events."""
    ours, theirs = (sorted(events, key=lambda event: str(event[0]))
                    for events in (printed_by_cie(cie, traces), printed_by_babeltrace2(traces)))
    if len(ours) != len(theirs):
        return [f"{len(ours)} events, {len(theirs)} by babeltrace2"], len(ours)
    pairs = zip(ours, theirs)
    different = ((a, b) for a, b in pairs if a[0] != b[0] or not is_same(a[1], b[1]))
    return [f"{a}\n    by babeltrace2 {b}" for a, b in itertools.islice(different, 3)], len(ours)


def counts(traces):
    """Events by name, as babeltrace2 prints them."""
    return collections.Counter(head[1] for head, _ in printed_by_babeltrace2(traces))
