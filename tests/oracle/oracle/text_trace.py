"""Events of CTF traces, read from babeltrace2's text output.

The text is what a human would check a number against, and its reader shares no line with the
project's own decoder. Times are raw clock cycles, which for these traces are CLOCK_MONOTONIC ns.
"""

import re
import subprocess
from dataclasses import dataclass, field
from typing import Any

LINE = re.compile(r"\[(\d+)\] \(\+[\d?]+\) (?:(\S+) )?([A-Za-z_][\w:]*): ")
NAME = re.compile(r"\s*([A-Za-z_]\w*) = ")
INDEX = re.compile(r"\s*\[\d+\] = ")
NUMBER = re.compile(r"-?(?:0x[0-9A-Fa-f]+|\d+(?:\.\d+)?)")
STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')
ESCAPES = {"n": "\n", "t": "\t", "a": "\a", "b": "\b", "f": "\f", "r": "\r", "v": "\v"}


@dataclass
class Event:
    """One event. `order` is its place in the merged output; ties in time keep it."""

    time: int
    order: int
    name: str
    host: str
    cpu: int | None
    vpid: int | None
    vtid: int | None
    fields: dict[str, Any] = field(default_factory=dict)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["fields"][name]
        except KeyError:
            raise AttributeError(f"{self.__dict__['name']} has no field {name}") from None

    @property
    def is_user(self) -> bool:
        return self.name.startswith("cie:")


class _Scanner:
    """Reads the values of one line: numbers, strings, enumerations, arrays, structures."""

    def __init__(self, text: str, position: int) -> None:
        self.text = text
        self.at = position

    def skip(self, expected: str) -> bool:
        while self.at < len(self.text) and self.text[self.at] == " ":
            self.at += 1
        if self.text.startswith(expected, self.at):
            self.at += len(expected)
            return True
        return False

    def structure(self) -> dict[str, Any]:
        """The opening brace is already read."""
        values: dict[str, Any] = {}
        while not self.skip("}"):
            match = NAME.match(self.text, self.at)
            if not match:
                raise ValueError(f"no field name at: {self.text[self.at:self.at + 40]!r}")
            self.at = match.end()
            values[match.group(1)] = self.value()
            self.skip(",")
        return values

    def value(self) -> Any:
        if self.skip("{"):
            return self.structure()
        if self.skip("["):
            items = []
            while not self.skip("]"):
                match = INDEX.match(self.text, self.at)
                if match:
                    self.at = match.end()
                items.append(self.value())
                self.skip(",")
            return items
        if self.skip("("):
            return self.enumeration()
        self.skip("")
        match = STRING.match(self.text, self.at)
        if match:
            self.at = match.end()
            return _unescape(match.group(1))
        match = NUMBER.match(self.text, self.at)
        if match:
            self.at = match.end()
            text = match.group(0)
            return float(text) if "." in text else int(text, 0)
        raise ValueError(f"no value at: {self.text[self.at:self.at + 40]!r}")

    def enumeration(self) -> str:
        """The label; the container's number when the value has none."""
        labels = []
        while True:
            if self.skip(": container = "):
                number = self.value()
                self.skip(")")
                return labels[0] if labels else str(number)
            self.skip(" ")
            match = STRING.match(self.text, self.at)
            if match:
                labels.append(_unescape(match.group(1)))
                self.at = match.end()
            else:
                end = self.text.index(" : container", self.at)
                self.at = end
            self.skip(",")


def _unescape(text: str) -> str:
    return re.sub(r"\\(.)", lambda m: ESCAPES.get(m.group(1), m.group(1)), text)


def parse_line(line: str, order: int) -> Event:
    """One line of `babeltrace2 --clock-cycles` as an event; ValueError if it is none."""
    match = LINE.match(line)
    if not match:
        raise ValueError(f"not an event line: {line[:80]!r}")
    scanner = _Scanner(line, match.end())
    groups = []
    while scanner.skip("{"):
        groups.append(scanner.structure())
        scanner.skip(",")
    payload = groups.pop() if groups else {}
    context: dict[str, Any] = {}
    for group in groups:
        context.update(group)
    return Event(int(match.group(1)), order, match.group(3), match.group(2) or "",
                 context.get("cpu_id"), context.get("vpid"), context.get("vtid"), payload)


def read_events(traces: list[str]) -> tuple[list[Event], str]:
    """All events of the traces merged by time, and babeltrace2's warnings."""
    done = subprocess.run(["babeltrace2", "--clock-cycles", *traces], capture_output=True,
                          timeout=120, check=False)
    text = done.stdout.decode("utf-8", "replace")
    events = []
    for order, line in enumerate(text.split("\n")):
        if line:
            events.append(parse_line(line, order))
    return events, done.stderr.decode("utf-8", "replace")
