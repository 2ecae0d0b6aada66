"""Writes CTF 1.8 the way LTTng 2.13 lays it out: large event headers, one stream per CPU, padded
packets with discarded counters, packetized metadata. A second layout, with 64-bit ids and times,
checks that readers follow the metadata."""

import struct
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import Any

U8, U32, U64, I32, I64, STR, CPUS = "u8", "u32", "u64", "i32", "i64", "str", "cpus"
ENUMS = {
    "moment_run": ("start", "announce"),
    "group_type": ("mutually_exclusive", "reentrant"),
    "kind": ("timer", "subscription", "service", "client", "waitable"),
    "role": ("callback", "pool", "dispatcher", "worker"),
    "moment_sched": ("initial", "applied", "audit"),
    "reason": ("timer", "data", "guard", "spurious"),
    "release_kind": ("timer", "data", "none"),
    "status": ("ok", "exception"),
}
USER_EVENTS: dict[str, list[tuple[str, str]]] = {
    "run_begin": [("contract_version", U32), ("tool_version", STR), ("executor", STR),
                  ("boot_id", STR), ("host", STR), ("pid", U32), ("pid_ns", U64),
                  ("process_start_ns", I64), ("monotonic_ns", I64), ("realtime_ns", I64),
                  ("online_cpus", U32), ("spec_sha256", STR), ("moment", "moment_run")],
    "run_end": [("callbacks", U32), ("threads", U32), ("groups", U32), ("publishers", U32),
                ("status", I32)],
    "node_init": [("node_id", U32), ("name", STR)],
    "group_init": [("group_id", U32), ("node_id", U32), ("type", "group_type")],
    "callback_init": [("callback_id", U32), ("group_id", U32), ("node_id", U32), ("kind", "kind"),
                      ("logical_id", STR), ("source", STR), ("symbol", STR), ("period_ns", U64),
                      ("queue_depth", U32), ("deadline_ns", U64), ("next_seq", U64)],
    "callback_fini": [("callback_id", U32), ("started", U64), ("ended", U64), ("released", U64),
                      ("overwritten", U64), ("lost", U64)],
    "publisher_init": [("publisher_id", U32), ("node_id", U32), ("topic", STR),
                       ("writer_gid", U64), ("next_seq", U64)],
    "publisher_fini": [("publisher_id", U32), ("published", U64)],
    "thread_init": [("tid", U32), ("role", "role"), ("callback_id", U32), ("group_id", U32),
                    ("name", STR), ("start_ns", I64)],
    "thread_fini": [("tid", U32), ("read_backs", U32)],
    "thread_sched": [("tid", U32), ("moment", "moment_sched"), ("n", U32), ("policy", I32),
                     ("flags", U64), ("nice", I32), ("priority", U32), ("runtime_ns", U64),
                     ("deadline_ns", U64), ("period_ns", U64), ("cpus", CPUS), ("error", I32)],
    "callback_release": [("callback_id", U32), ("release_seq", U64), ("overwritten", U64)],
    "thread_wakeup": [("callback_id", U32), ("reason", "reason")],
    "callback_start": [("callback_id", U32), ("seq", U64), ("release_kind", "release_kind"),
                       ("release_ns", I64), ("missed", U32), ("source_timestamp_realtime_ns", I64),
                       ("writer_gid", U64)],
    "callback_end": [("callback_id", U32), ("seq", U64), ("status", "status")],
    "publish": [("publisher_id", U32), ("seq", U64), ("source_timestamp_realtime_ns", I64)],
    "sample_lost": [("callback_id", U32), ("count", U32), ("total", U64)],
    "clock_sync": [("monotonic_ns", I64), ("realtime_ns", I64)],
}
KERNEL_EVENTS: dict[str, list[tuple[str, str]]] = {
    "sched_switch": [("prev_comm", STR), ("prev_tid", I32), ("prev_prio", I32),
                     ("prev_state", I64), ("next_comm", STR), ("next_tid", I32),
                     ("next_prio", I32)],
    "sched_waking": [("comm", STR), ("tid", I32), ("prio", I32), ("target_cpu", I32)],
    "sched_wakeup": [("comm", STR), ("tid", I32), ("prio", I32), ("target_cpu", I32)],
    "sched_process_fork": [("parent_comm", STR), ("parent_tid", I32), ("parent_pid", I32),
                           ("child_comm", STR), ("child_tid", I32), ("child_pid", I32)],
    "sched_process_exit": [("comm", STR), ("tid", I32), ("prio", I32)],
    "sched_pi_setprio": [("comm", STR), ("tid", I32), ("oldprio", I32), ("newprio", I32)],
}
PACK = {U8: "<B", U32: "<I", U64: "<Q", I32: "<i", I64: "<q"}


@dataclass
class Record:
    """One event before it is written. Kernel events have no vpid."""

    time: int
    cpu: int
    name: str
    vpid: int | None
    vtid: int | None
    fields: dict[str, Any]


@dataclass
class Layout:
    """How one trace is written."""

    domain: str                    # "ust" or "kernel"
    hostname: str = "robot"
    boot_id: str = "5a17c0de-0b07-4b1d-9abc-0123456789ab"
    offset: int = 1700000000123456789  # realtime - monotonic
    large_ids: bool = False        # 64-bit ids and times instead of LTTng's compact header
    packet_bytes: int = 4096
    contexts: bool = True          # vpid and vtid
    newer: bool = False            # a later contract: more fields at the end, unknown events
    tracer: str = ""               # instead of the domain's own
    ends: dict[int, int] | None = None    # streams that end early, by CPU
    begins: dict[int, int] | None = None  # streams that begin late


class Writer:
    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.user = layout.domain == "ust"
        self.classes = dict(USER_EVENTS if self.user else KERNEL_EVENTS)
        if layout.newer:
            self.classes = {n: [*f, ("added_later", U64), ("note", STR)]
                            for n, f in self.classes.items()}
            if self.user:
                self.classes["executor_mood"] = [("mood", STR), ("added_later", U64), ("note", STR)]
        self.ids = {name: n for n, name in enumerate(self.classes)}
        self.uuid = uuid.uuid5(uuid.NAMESPACE_OID, f"{layout.domain}{layout.hostname}")

    def write(self, folder: Path, records: list[Record], cpus: int, begin: int, end: int,
              discarded: list[tuple[int, int]] = ()) -> None:
        """`discarded`: (time, cpu) of events that the tracer counts as lost."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "metadata").write_bytes(self._metadata())
        for cpu in range(cpus):
            mine = [r for r in records if r.cpu == cpu]
            gone = sorted(t for t, c in discarded if c == cpu)
            first = (self.layout.begins or {}).get(cpu, begin)
            last = (self.layout.ends or {}).get(cpu, end)
            (folder / f"channel0_{cpu}").write_bytes(self._stream(mine, cpu, first, last, gone))

    def _stream(self, records: list[Record], cpu: int, begin: int, end: int,
                gone: list[int]) -> bytes:
        packets: list[tuple[list[bytes], int, int]] = []
        body: list[bytes] = []
        size, first, last = 0, begin, begin
        for r in sorted(records, key=lambda x: x.time):
            data = self._event(r, last)
            # A tracer drops events between packets: while no buffer is free.
            dropped = any(last < t <= r.time for t in gone)
            if dropped and body or size + len(data) > self.layout.packet_bytes - 128:
                packets.append((body, first, last))
                body, size, first = [], 0, r.time
                data = self._event(r, r.time)
            body.append(data)
            size += len(data)
            last = r.time
        packets.append((body, first, end))
        out = bytearray()
        for number, (events, p_begin, p_end) in enumerate(packets):
            lost = sum(t <= p_end for t in gone)
            out += self._packet(b"".join(events), p_begin, p_end, number, lost, cpu)
        return bytes(out)

    def _packet(self, body: bytes, begin: int, end: int, number: int, lost: int, cpu: int) -> bytes:
        head = struct.pack("<I16sIQ", 0xC1FC1FC1, self.uuid.bytes, 0, cpu)
        content = len(head) + 52 + len(body)
        padded = -(-content // self.layout.packet_bytes) * self.layout.packet_bytes
        head += struct.pack("<QQQQQQI", begin, end, content * 8, padded * 8, number, lost, cpu)
        return (head + body).ljust(padded, b"\0")

    def _event(self, r: Record, previous: int) -> bytes:
        number = self.ids[r.name]
        if self.layout.large_ids:
            out = struct.pack("<QQ", number, r.time)
        elif r.time - previous < 2**32:
            out = struct.pack("<HI", number, r.time & 0xFFFFFFFF)
        else:
            out = struct.pack("<HIQ", 0xFFFF, number, r.time)
        if self.user and self.layout.contexts:
            out += struct.pack("<ii", r.vpid, r.vtid)
        for name, kind in self.classes[r.name]:
            value = r.fields.get(name, "x" if kind == STR else 7) if self.layout.newer else (
                r.fields[name])
            if kind == STR:
                out += value.encode() + b"\0"
            elif kind == CPUS:
                out += struct.pack(f"<I{len(value)}I", len(value), *value)
            elif kind in ENUMS:
                out += struct.pack("<B", ENUMS[kind].index(value))
            else:
                out += struct.pack(PACK[kind], value)
        return out

    def _metadata(self) -> bytes:
        text = self._text()
        if self.layout.large_ids:
            return text.encode()
        out, data = b"", text.encode()
        for at in range(0, len(data), 4096 - 37):
            part = data[at:at + 4096 - 37]
            out += struct.pack("<I16sIIIBBBBB", 0x75D11D57, self.uuid.bytes, 0,
                               (37 + len(part)) * 8, 4096 * 8, 0, 0, 0, 1, 8)
            out += part.ljust(4096 - 37, b"\0")
        return out

    def _text(self) -> str:
        lay = self.layout
        clock_uuid = f'\tuuid = "{lay.boot_id}";\n' if lay.boot_id else ""
        integer = "integer {{ size = {0}; align = 8; signed = {1}; encoding = none; base = 10; }}"

        def whole(bits: int, signed: int = 0) -> str:
            return integer.format(bits, signed)

        kinds = {U8: whole(8), U32: whole(32), U64: whole(64), I32: whole(32, 1), I64: whole(64, 1)}
        clock = "integer {{ size = {0}; align = 8; signed = 0; map = clock.monotonic.value; }}"
        env = lay.tracer or {"ust": 'tracer_name = "lttng-ust";\n\ttracer_buffering_scheme = "uid";\n'
                      "\tarchitecture_bit_width = 64;",
               "kernel": 'tracer_name = "lttng-modules";'}[lay.domain]
        # Readers know that LTTng's clocks count from the epoch; of others they must be told.
        absolute = "\n\tabsolute = true;" if lay.tracer else ""
        if lay.large_ids:
            header = f"struct {{\n\t\t{whole(64)} id;\n\t\t{clock.format(64)} timestamp;\n\t}} align(8)"
            extra = ""
        else:
            header = "struct event_header_large"
            extra = """struct event_header_large {
	enum : uint16_t { compact = 0 ... 65534, extended = 65535 } id;
	variant <id> {
		struct {
			uint32_clock_monotonic_t timestamp;
		} compact;
		struct {
			uint32_t id;
			uint64_clock_monotonic_t timestamp;
		} extended;
	} v;
} align(8);

"""
        context = ""
        if self.user and lay.contexts:
            context = (f"\tevent.context := struct {{\n\t\t{whole(32, 1)} _vpid;\n"
                       f"\t\t{whole(32, 1)} _vtid;\n\t}};\n")
        text = f"""/* CTF 1.8 */

typealias integer {{ size = 8; align = 8; signed = false; }} := uint8_t;
typealias integer {{ size = 16; align = 8; signed = false; }} := uint16_t;
typealias integer {{ size = 32; align = 8; signed = false; }} := uint32_t;
typealias integer {{ size = 64; align = 8; signed = false; }} := uint64_t;

trace {{
	major = 1;
	minor = 8;
	uuid = "{self.uuid}";
	byte_order = le;
	packet.header := struct {{
		uint32_t magic;
		uint8_t  uuid[16];
		uint32_t stream_id;
		uint64_t stream_instance_id;
	}};
}};

env {{
	domain = "{lay.domain}";
	hostname = "{lay.hostname}";
	{env}
	tracer_major = 2;
	tracer_minor = 13;
}};

clock {{
	name = "monotonic";
{clock_uuid}	description = "Monotonic Clock";
	freq = 1000000000; /* Frequency, in Hz */
	offset = {lay.offset};{absolute}
}};

typealias integer {{ size = 32; align = 8; signed = false; map = clock.monotonic.value; }} := uint32_clock_monotonic_t;
typealias integer {{ size = 64; align = 8; signed = false; map = clock.monotonic.value; }} := uint64_clock_monotonic_t;

struct packet_context {{
	uint64_clock_monotonic_t timestamp_begin;
	uint64_clock_monotonic_t timestamp_end;
	uint64_t content_size;
	uint64_t packet_size;
	uint64_t packet_seq_num;
	uint64_t events_discarded;
	uint32_t cpu_id;
}};

{extra}stream {{
	id = 0;
	packet.context := struct packet_context;
	event.header := {header};
{context}}};

"""
        for name, fields in self.classes.items():
            full = f"cie:{name}" if self.user else name
            text += f'event {{\n\tname = "{full}";\n\tid = {self.ids[name]};\n\tstream_id = 0;\n'
            text += "\tfields := struct {\n"
            for field, kind in fields:
                if kind == STR:
                    text += f"\t\tstring _{field};\n"
                elif kind == CPUS:
                    text += f"\t\t{kinds[U32]} ___{field}_length;\n"
                    text += f"\t\t{kinds[U32]} _{field}[ ___{field}_length ];\n"
                elif kind in ENUMS:
                    labels = ", ".join(f'"{x}" = {n}' for n, x in enumerate(ENUMS[kind]))
                    text += f"\t\tenum : {kinds[U8]} {{ {labels} }} _{field};\n"
                else:
                    text += f"\t\t{kinds[kind]} _{field};\n"
            text += "\t};\n};\n\n"
        return text
