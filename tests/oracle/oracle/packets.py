"""Packet headers of CTF 1.8 stream files: windows and loss, which the text output does not show.

Reads only what it needs of the metadata: byte order, `packet.header`, `packet.context` and the
clock. Knows the LTTng layouts and the plain one that babeltrace2 writes.
"""

import re
import struct
from dataclasses import dataclass
from pathlib import Path

MAGIC = 0xC1FC1FC1
ALIASES = {"uint8_t": 8, "uint16_t": 16, "uint32_t": 32, "uint64_t": 64, "unsigned long": 64,
           "uint64_clock_monotonic_t": 64, "uint32_clock_monotonic_t": 32}


@dataclass
class Packet:
    begin: int
    end: int
    discarded: int | None
    seq: int | None
    has_events: bool = True
    damaged: bool = False


@dataclass
class Stream:
    """One stream file. `channel` tells streams of one channel from others'."""

    path: Path
    channel: str
    domain: str
    hostname: str
    clock_uuid: str
    cpu: int | None
    packets: list[Packet]
    damaged: bool
    stream_class: int = 0
    hot: bool = False  # carries callback_start, or kernel events
    tracer: str = ""

    @property
    def idle(self) -> bool:
        return not any(p.has_events for p in self.packets)


def find_traces(roots: list[str]) -> list[Path]:
    """The directories below `roots` that hold a metadata file, sorted."""
    found = set()
    for root in roots:
        found.update(path.parent for path in Path(root).rglob("metadata") if path.is_file())
    return sorted(found)


def metadata_text(path: Path) -> str:
    """TSDL text, whether plain or in LTTng's metadata packets."""
    data = path.read_bytes()
    if data[:4] not in (b"\x57\x1d\xd1\x75", b"\x75\xd1\x1d\x57"):
        return data.decode("utf-8", "replace")
    text, at = b"", 0
    while at + 37 <= len(data):
        content, size = struct.unpack_from("<II", data, at + 24)
        if size < 296 or content < 296:
            break
        text += data[at + 37:at + content // 8]
        at += size // 8
    return text.decode("utf-8", "replace")


def _block(text: str, opening: str) -> str:
    """The text between the braces after `opening`; empty when there is none."""
    match = re.search(re.escape(opening) + r"\s*:=\s*struct\s*(\w*)\s*(\{)?", text)
    if not match:
        return ""
    if not match.group(2):  # named structure, defined elsewhere
        match = re.search(r"struct\s+" + match.group(1) + r"\s*\{", text)
        if not match:
            return ""
    at, depth = match.end(), 1
    while depth:
        depth += {"{": 1, "}": -1}.get(text[at], 0)
        at += 1
    return text[match.end():at - 1]


def _fields(body: str) -> list[tuple[str, int, int]]:
    """(name, bits, count) of each integer, in order. All alignments are whole bytes."""
    fields = []
    for line in body.split("\n"):
        inline = re.match(r"\s*integer\s*\{([^}]*)\}\s*(\w+)(?:\[(\d+)\])?\s*;", line)
        alias = re.match(r"\s*([a-z_0-9 ]+?)\s+(\w+)(?:\[(\d+)\])?\s*;", line)
        if inline:
            bits = int(re.search(r"size\s*=\s*(\d+)", inline.group(1)).group(1))
            fields.append((inline.group(2).lstrip("_"), bits, int(inline.group(3) or 1)))
        elif alias:
            fields.append((alias.group(2).lstrip("_"), ALIASES[alias.group(1)],
                           int(alias.group(3) or 1)))
    return fields


def _read(data: bytes, at: int, fields: list[tuple[str, int, int]]) -> tuple[dict[str, int], int]:
    values = {}
    for name, bits, count in fields:
        size = bits // 8
        if at + size * count > len(data):
            raise EOFError
        values[name] = int.from_bytes(data[at:at + size], "little")
        at += size * count
    return values, at


def read_streams(roots: list[str]) -> list[Stream]:
    """Every stream file below `roots`; damaged packets are marked, what follows one is not read."""
    streams = []
    for folder in find_traces(roots):
        text = metadata_text(folder / "metadata")
        header = _fields(_block(text, "packet.header"))
        context = _fields(_block(text, "packet.context"))
        domain = re.search(r'domain = "(\w+)"', text)
        tracer = re.search(r'tracer_name = "([^"]*)"', text)
        host = re.search(r'hostname = "([^"]*)"', text)
        clock = re.search(r'clock\s*\{[^}]*uuid = "?([0-9a-f-]+)', text)
        for path in sorted(folder.iterdir()):
            if path.name == "metadata" or not path.is_file() or path.name.startswith("."):
                continue
            stream = _read_stream(path, header, context)
            stream.domain = domain.group(1) if domain else ""
            stream.hostname = host.group(1) if host else ""
            stream.clock_uuid = clock.group(1) if clock else ""
            stream.tracer = tracer.group(1) if tracer else ""
            stream.hot = stream.domain != "ust" or stream.stream_class in _hot_classes(text)
            streams.append(stream)
    return streams


def _hot_classes(text: str) -> set[int]:
    """Ids of the stream classes (LTTng: channels) that callback_start is recorded in."""
    classes = set()
    for body in re.findall(r"\nevent\s*\{(.*?)\n\};", text, re.S):
        if '"cie:callback_start"' in body:
            number = re.search(r"stream_id\s*=\s*(\d+)", body)
            classes.add(int(number.group(1)) if number else 0)
    return classes


def _read_stream(path: Path, header: list, context: list) -> Stream:
    data = path.read_bytes()
    stream = Stream(path, f"{path.parent}/{path.name.rsplit('_', 1)[0]}", "", "", "", None, [], False)
    at = 0
    while at < len(data):
        try:
            head, after = _read(data, at, header)
            values, events_at = _read(data, after, context)
        except EOFError:
            stream.damaged = True
            break
        size = values.get("packet_size", 0) // 8
        if head.get("magic") != MAGIC or size <= 0 or at + size > len(data):
            stream.damaged = True
            break
        stream.cpu = values.get("cpu_id", stream.cpu)
        stream.stream_class = head.get("stream_id", 0)
        stream.packets.append(Packet(values["timestamp_begin"], values["timestamp_end"],
                                     values.get("events_discarded"), values.get("packet_seq_num"),
                                     values.get("content_size", size * 8) > (events_at - at) * 8))
        at += size
    return stream


def _channel_windows(streams: list[Stream]) -> list[tuple[int, int]]:
    """Of channels that have events. A stream without any covers everything up to its end."""
    channels: dict[str, list[Stream]] = {}
    for s in streams:
        if s.packets:
            channels.setdefault(s.channel, []).append(s)
    return [(max(s.packets[0].begin for s in used if not s.idle), min(s.packets[-1].end for s in used))
            for used in channels.values() if not all(s.idle for s in used)]


def window(streams: list[Stream], domain: str) -> tuple[int, int] | None:
    """[latest first-packet begin, earliest last-packet end] over the streams of the channel that
    instances are recorded in; several such channels (processes, users) all count."""
    windows = _channel_windows([s for s in streams if s.domain == domain and s.hot])
    if not windows:
        return None
    return min(w[0] for w in windows), max(w[1] for w in windows)


def whole_window(streams: list[Stream]) -> tuple[int, int] | None:
    """What the windows of all user-space channels have in common: the report's begin and end."""
    windows = _channel_windows([s for s in streams if s.domain == "ust"])
    if not windows:
        return None
    return max(w[0] for w in windows), min(w[1] for w in windows)


@dataclass
class Loss:
    """Events (`count`) or packets that a stream lost between `begin` and `end`."""

    domain: str
    hostname: str
    cpu: int | None
    begin: int
    end: int
    count: int | None  # None: whole packets, nobody knows how many events


def losses(streams: list[Stream]) -> list[Loss]:
    found = []
    for s in streams:
        previous: Packet | None = None
        for p in s.packets:
            # The counter runs from the start of the session; the first packet of a later chunk
            # (rotation) brings along what earlier chunks lost.
            before = previous.discarded if previous else p.discarded if p.seq else 0
            if p.discarded is not None and p.discarded > (before or 0):
                found.append(Loss(s.domain, s.hostname, s.cpu, previous.end if previous else p.begin,
                                  p.end, p.discarded - (before or 0)))
            expected = previous.seq + 1 if previous and previous.seq is not None else None
            if expected is not None and p.seq is not None and p.seq != expected:
                found.append(Loss(s.domain, s.hostname, s.cpu, previous.end, p.begin, None))
            previous = p
    return found
