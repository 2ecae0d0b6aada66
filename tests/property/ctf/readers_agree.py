#!/usr/bin/env python3
"""cie's reader and libbabeltrace2 on recordings of random layout: integers of any width, alignment and byte order, reals,
strings, nested structures, arrays, sequences and variants between the fields that count, any event
header, any split into packets. The report of `cie` and that of `sink.cie.report` in babeltrace2
must be the same, and the instances those that were written; and so must be what `cie events` and babeltrace2 print.

Usage: readers_agree.py CIE --plugins DIR [--traces N] [--seed S] [--keep DIR]"""
import argparse
import csv
import json
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import uuid
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from ctf2_of_tsdl import convert  # noqa: E402
from events_by_babeltrace2 import differences  # noqa: E402

EVENTS = {  # name: fields with their least width; None: a string; a list: labels
    "cie:node_init": [("node_id", 8), ("name", None)],
    "cie:group_init": [("group_id", 8), ("node_id", 8), ("type", ["mutually_exclusive", "reentrant"])],
    "cie:callback_init": [("callback_id", 8), ("group_id", 8), ("node_id", 8),
                          ("kind", ["timer", "subscription", "service", "client", "waitable"]),
                          ("logical_id", None), ("source", None), ("symbol", None), ("period_ns", 32),
                          ("deadline_ns", 8)],
    "cie:thread_init": [("tid", 16), ("role", ["callback", "pool", "dispatcher", "worker"]),
                        ("callback_id", 8), ("group_id", 8), ("name", None), ("start_ns", 48)],
    "cie:thread_sched": [("tid", 16), ("moment", ["initial", "applied", "audit"]), ("n", 8), ("cpus", "cpus"),
                         ("policy", 8), ("flags", 8), ("nice", 8), ("priority", 8), ("runtime_ns", 8),
                         ("deadline_ns", 8), ("period_ns", 8), ("error", 8)],
    "cie:callback_start": [("callback_id", 8), ("seq", 16), ("release_kind", ["timer", "data", "none"]),
                           ("release_ns", 48), ("missed", 8)],
    "cie:callback_end": [("callback_id", 8), ("seq", 16), ("status", ["ok", "exception"])],
    "other:noise": [],
}


class Bits:
    """Bits in the order of CTF: from the least significant one in little endian, else from the most."""

    def __init__(self):
        self.data = bytearray()
        self.at = 0

    def align(self, bits):
        self.at = -(-self.at // bits) * bits
        self.grow()

    def grow(self):
        self.data.extend(b"\0" * (-(-self.at // 8) - len(self.data)))

    def put(self, value, size, big):
        for i in range(size):
            bit = value >> (size - 1 - i if big else i) & 1
            position = self.at + i
            if position // 8 == len(self.data):
                self.data.append(0)
            self.data[position // 8] |= bit << (7 - position % 8 if big else position % 8)
        self.at += size

    def text(self, value):
        self.align(8)
        self.data += value.encode() + b"\0"
        self.at = 8 * len(self.data)


class Integer:
    def __init__(self, rng, order, least, labels=None, whole=None, signed=None):
        whole = rng.random() < 0.6 if whole is None else whole
        if whole:
            self.size = rng.choice([s for s in (8, 16, 32, 64) if s >= least])
        else:
            self.size = rng.randint(least, 64)
        self.signed = rng.random() < 0.4 if signed is None else signed
        if self.signed and self.size == least:
            self.size = min(64, self.size + (self.size if whole else 1))
        self.align = rng.choice([8, 8, 8, 16, 32, 64] if whole else [1, 1, 1, 2, 4, 8])
        self.big = order == "be"
        # A field of another byte order must begin on a byte, and so must what follows.
        self.other = whole and rng.random() < 0.3
        if self.other:
            self.big = not self.big
        self.labels = labels

    def declare(self):
        text = f"integer {{ size = {self.size}; align = {self.align}; signed = {int(self.signed)};"
        if self.other:
            text += f" byte_order = {'be' if self.big else 'le'};"
        text += " }"
        if self.labels:
            text = f"enum : {text} {{ " + ", ".join(f'"{l}" = {i}' for i, l in enumerate(self.labels)) + " }"
        return text

    def write(self, bits, value):
        bits.align(self.align)
        bits.put(value & ((1 << self.size) - 1), self.size, self.big)


class Filler:
    """A field that nobody asks for; its value is random each time."""

    def __init__(self, rng, order, depth=0):
        self.rng = rng
        kinds = ["integer", "integer", "real", "string"]
        if depth < 2:
            kinds += ["struct", "array", "sequence", "variant"]
        self.kind = rng.choice(kinds)
        self.integer = Integer(rng, order, 1, whole=None)
        self.parts = []
        if self.kind == "struct":
            self.parts = [Filler(rng, order, depth + 1) for _ in range(rng.randint(1, 3))]
            self.align = rng.choice([1, 8, 32])
        elif self.kind in ("array", "sequence"):
            self.parts = [Filler(rng, order, depth + 1)]
            self.count = rng.randint(0, 3)
            self.length = Integer(rng, order, 8, whole=True, signed=False)
        elif self.kind == "variant":
            self.parts = [Filler(rng, order, depth + 1) for _ in range(3)]
            self.tag = Integer(rng, order, 8, labels=["o0", "o1", "o2"], whole=True)
        self.big = order == "be"

    def declare(self, name):
        if self.kind == "integer":
            return f"{self.integer.declare()} {name};"
        if self.kind == "real":
            return f"floating_point {{ exp_dig = 11; mant_dig = 53; align = 8; }} {name};"
        if self.kind == "string":
            return f"string {name};"
        if self.kind == "struct":
            return "struct { " + " ".join(p.declare(f"p{i}") for i, p in enumerate(self.parts)) + \
                f" }} align({self.align}) {name};"
        if self.kind in ("array", "sequence"):
            element = "struct { " + self.parts[0].declare("e") + " }"
            if self.kind == "array":
                return f"{element} {name}[{self.count}];"
            return f"{self.length.declare()} {name}_n; {element} {name}[{name}_n];"
        options = " ".join(f"struct {{ {p.declare('p')} }} o{i};" for i, p in enumerate(self.parts))
        return f"{self.tag.declare()} {name}_t; variant <{name}_t> {{ {options} }} {name};"

    def alignment(self):
        if self.kind == "integer":
            return self.integer.align
        if self.kind in ("real", "string"):
            return 8
        if self.kind == "struct":
            return max([self.align] + [p.alignment() for p in self.parts])
        if self.kind in ("array", "sequence"):
            own = self.parts[0].alignment()
            return max(own, self.length.align) if self.kind == "sequence" else own
        return self.tag.align

    def write(self, bits):
        if self.kind == "integer":
            self.integer.write(bits, self.rng.getrandbits(64))
        elif self.kind == "real":
            bits.align(8)
            bits.put(self.rng.getrandbits(64), 64, self.big)
        elif self.kind == "string":
            bits.text("x" * self.rng.randint(0, 5))
        elif self.kind == "struct":
            bits.align(self.alignment())
            for part in self.parts:
                part.write(bits)
        elif self.kind in ("array", "sequence"):
            count = self.count
            if self.kind == "sequence":
                count = self.rng.randint(0, 4)
                self.length.write(bits, count)
            bits.align(self.parts[0].alignment())
            for _ in range(count):
                bits.align(self.parts[0].alignment())
                self.parts[0].write(bits)
        else:
            choice = self.rng.randrange(3)
            self.tag.write(bits, choice)
            bits.align(self.parts[choice].alignment())
            self.parts[choice].write(bits)


class Cpus:
    def __init__(self, rng, order):
        self.length = Integer(rng, order, 8, whole=True, signed=False)
        self.element = Integer(rng, order, 8, whole=True)

    def declare(self):
        return f"{self.length.declare()} _cpus_length; {self.element.declare()} _cpus[_cpus_length];"

    def write(self, bits, values):
        self.length.write(bits, len(values))
        bits.align(self.element.align)
        for value in values:
            self.element.write(bits, value)


class Layout:
    def __init__(self, rng):
        self.rng = self.splits = rng
        self.order = rng.choice(["le", "le", "be"])
        self.uuid = uuid.UUID(int=rng.getrandbits(128))
        self.header = rng.choice(["large", "compact", "plain"])
        self.context = [Filler(rng, self.order, 2) for _ in range(rng.randint(0, 1))]  # libbabeltrace2 aborts on more
        self.pid, self.tid = (Integer(rng, self.order, 16, whole=True) for _ in range(2))
        self.events = {}
        for name, fields in EVENTS.items():
            plan = []
            for field, kind in fields:
                if rng.random() < 0.3:
                    plan.append((None, Filler(rng, self.order)))
                if kind is None:
                    plan.append((field, None))
                elif kind == "cpus":
                    plan.append((field, Cpus(rng, self.order)))
                elif isinstance(kind, list):
                    plan.append((field, Integer(rng, self.order, 8, labels=kind)))
                else:
                    plan.append((field, Integer(rng, self.order, kind)))
            plan += [(None, Filler(rng, self.order)) for _ in range(rng.randint(0, 2))]
            self.events[name] = plan

    def metadata(self):
        def clocked(size, align=8):
            return f"integer {{ size = {size}; align = {align}; map = clock.m.value; }}"

        u32, u64 = "integer { size = 32; align = 8; }", "integer { size = 64; align = 8; }"
        header = {
            "large": "struct { enum : integer { size = 16; align = 8; } { compact = 0 ... 65534, extended = 65535 } "
                     f"id; variant <id> {{ struct {{ {clocked(32)} timestamp; }} compact; struct {{ {u32} id; "
                     f"{clocked(64)} timestamp; }} extended; }} v; }} align(8)",
            "compact": "struct { enum : integer { size = 5; align = 1; } { compact = 0 ... 30, extended = 31 } id; "
                       f"variant <id> {{ struct {{ {clocked(27, 1)} timestamp; }} compact; struct {{ {u32} id; "
                       f"{clocked(64)} timestamp; }} extended; }} v; }} align(8)",
            "plain": f"struct {{ {u64} id; {clocked(64)} timestamp; }}"}[self.header]
        context = " ".join(f.declare(f"c{i}") for i, f in enumerate(self.context))
        text = (f'/* CTF 1.8 */\ntrace {{ major = 1; minor = 8; uuid = "{self.uuid}"; byte_order = {self.order};\n'
                f" packet.header := struct {{ {u32} magic; integer {{ size = 8; align = 8; }} uuid[16]; {u32} stream_id;"
                f" {u64} stream_instance_id; }}; }};\n"
                'env { hostname = "h"; domain = "ust"; tracer_name = "lttng-ust"; tracer_major = 2; tracer_minor = 13; };\n'
                'clock { name = m; uuid = "11111111-2222-3333-4444-555555555555"; freq = 1000000000; offset_s = 1700000000; };\n'
                f"stream {{ id = 0; event.header := {header};\n packet.context := struct {{ {clocked(64)} timestamp_begin; "
                f"{clocked(64)} timestamp_end; {u64} content_size; {u64} packet_size; {u64} packet_seq_num; "
                f"{u64} events_discarded; {u32} cpu_id; }};\n"
                f" event.context := struct {{ {context} {self.pid.declare()} _vpid; {self.tid.declare()} _vtid; }}; }};\n")
        for number, (name, plan) in enumerate(self.events.items()):
            fields = []
            for i, (field, kind) in enumerate(plan):
                if field is None:
                    fields.append(kind.declare(f"f{i}"))
                elif kind is None:
                    fields.append(f"string _{field};")
                elif isinstance(kind, Cpus):
                    fields.append(kind.declare())
                else:
                    fields.append(f"{kind.declare()} _{field};")
            text += f'event {{ name = "{name}"; id = {number}; stream_id = 0; fields := struct {{ {" ".join(fields)} }}; }};\n'
        return text

    def write_event(self, bits, last, time, name, tid, values):
        big = self.order == "be"
        number = list(self.events).index(name)
        bits.align(8)
        if self.header == "plain":
            bits.put(number, 64, big)
            bits.put(time, 64, big)
        else:
            id_bits, time_bits = (16, 32) if self.header == "large" else (5, 27)
            near = time - last < 1 << time_bits and self.rng.random() < 0.9
            bits.put(number if near else (1 << id_bits) - 1, id_bits, big)
            if near:
                bits.put(time & ((1 << time_bits) - 1), time_bits, big)
            else:
                bits.align(8)
                bits.put(number, 32, big)
                bits.put(time, 64, big)
        bits.align(max([self.pid.align, self.tid.align] + [f.alignment() for f in self.context]))
        for filler in self.context:
            filler.write(bits)
        self.pid.write(bits, 4001)
        self.tid.write(bits, tid)
        plan = self.events[name]
        aligns = [1]
        for field, kind in plan:
            if kind is None:
                aligns.append(8)
            elif isinstance(kind, Filler):
                aligns.append(kind.alignment())
            elif isinstance(kind, Cpus):
                aligns += [kind.length.align, kind.element.align]
            else:
                aligns.append(kind.align)
        bits.align(max(aligns))
        for field, kind in plan:
            if field is None:
                kind.write(bits)
            elif kind is None:
                bits.text(values[field])
            elif isinstance(kind, Integer) and kind.labels:
                kind.write(bits, kind.labels.index(values[field]))
            else:
                kind.write(bits, values[field])

    def stream(self, cpu, events, window):
        """events: (time, name, tid, values), in order of time."""
        prefix, out = (">" if self.order == "be" else "<"), b""
        number = 0
        while events or number == 0:
            count = self.splits.randint(1, 12)
            part, events = events[:count], events[count:]
            begin = part[0][0] if number else window[0]
            last = begin
            bits = Bits()
            bits.data += bytes(84)
            bits.at = 84 * 8
            for time, *event in part:
                self.write_event(bits, last, time, *event)
                last = time
            content = bits.at
            size = -(-content // 8) + self.rng.choice([0, 0, 3, 64])
            head = struct.pack(prefix + "I16sIQ", 0xC1FC1FC1, self.uuid.bytes, 0, cpu)
            end = last if events else window[1]
            head += struct.pack(prefix + "QQQQQQI", begin, end, content, size * 8, number, 0, cpu)
            out += (head + bytes(bits.data[84:])).ljust(size, b"\0")
            number += 1
        return out


def recording(layout, rng):
    """Streams and the instances in them: (logical id, seq, start, end)."""
    streams, instances = [], []
    for cpu in range(rng.randint(1, 3)):
        callback, tid = cpu, 4002 + cpu
        name = f"/n@Timer({1000 + cpu})"
        time = 1_000_000 + cpu
        events = [(time, "cie:node_init", 4001, {"node_id": cpu, "name": "/n"}),
                  (time, "cie:group_init", 4001, {"group_id": cpu, "node_id": cpu, "type": "reentrant"}),
                  (time, "cie:callback_init", 4001, {"callback_id": callback, "group_id": cpu, "node_id": cpu,
                                                     "kind": "timer", "logical_id": name, "source": "",
                                                     "symbol": "s", "period_ns": 1000 + cpu, "deadline_ns": 0}),
                  (time, "cie:thread_init", tid, {"tid": tid, "role": "callback", "callback_id": callback,
                                                  "group_id": cpu, "name": f"t{cpu}", "start_ns": time}),
                  (time, "cie:thread_sched", tid, {"tid": tid, "moment": "applied", "n": 0, "policy": 1,
                                                   "flags": 0, "nice": 0, "priority": 40 + cpu, "runtime_ns": 0,
                                                   "deadline_ns": 0, "period_ns": 0, "error": 0, "cpus": list(range(rng.randint(0, 5)))})]
        for seq in range(rng.randint(0, 40)):
            time += rng.choice([10, 1000, 1 << 20, 1 << 28, 1 << 33])
            start = time
            events.append((start, "cie:callback_start", tid, {"callback_id": callback, "seq": seq,
                                                              "release_kind": "timer", "release_ns": start - 3,
                                                              "missed": 0}))
            if rng.random() < 0.3:
                events.append((time + 1, "other:noise", tid, {}))
            time += rng.randint(2, 5000)
            events.append((time, "cie:callback_end", tid, {"callback_id": callback, "seq": seq, "status": "ok"}))
            instances.append((name, seq, start, time))
        streams.append(events)
    # One window for all, so that every instance lies in it.
    window = 1000, max(events[-1][0] for events in streams) + 1
    return [layout.stream(cpu, events, window) for cpu, events in enumerate(streams)], instances


def output(cie, command, trace, folder=None):
    result = subprocess.run([cie, *command.split(), str(trace)], capture_output=True, timeout=200, check=False,
                            cwd=folder)
    return result.returncode, result.stdout, result.stderr


def report(done):
    """Of a JSON text, without where the trace lies, which a graph of babeltrace2 does not know."""
    code, text, error = done
    if code != 0:
        return code, text, error
    data = json.loads(text)
    data["trace"].pop("paths")
    return data


def report_by_babeltrace2(plugins, trace):
    result = subprocess.run(["babeltrace2", f"--plugin-path={plugins}", str(trace), "-c", "sink.cie.report", "-p",
                             'format="json"'], capture_output=True, timeout=200, check=False)
    return report((result.returncode, result.stdout, result.stderr))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("cie")
    parser.add_argument("--plugins", required=True)
    parser.add_argument("--traces", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    failures = 0
    with tempfile.TemporaryDirectory(prefix="cie-readers-") as folder:
        for seed in range(options.seed, options.seed + options.traces):
            rng = random.Random(seed)
            layout = Layout(rng)
            streams, instances = recording(layout, rng)
            trace = Path(folder) / f"trace-{seed}"
            trace.mkdir()
            (trace / "metadata").write_text(layout.metadata())
            for number, stream in enumerate(streams):
                (trace / f"s{number}").write_bytes(stream)
            problems = []
            natives = {command: output(options.cie, command, trace)
                       for command in ("instances", "report --format json", "verify --format json", "events -f json")}
            native, other = report(natives["report --format json"]), report_by_babeltrace2(options.plugins, trace)
            if native != other:
                problems.append(f"report: {native}\n  by babeltrace2: {other}")
            problems += differences(options.cie, trace)[0]
            rows = csv.DictReader(natives["instances"][1].decode().splitlines())
            seen = sorted((r["logical_id"], int(r["seq"]), int(r["start_ns"]), int(r["end_ns"])) for r in rows)
            if seen != sorted(instances):
                problems.append(f"{len(seen)} instances read, {len(instances)} written")
            (trace / "metadata").write_bytes(convert(layout.metadata().encode()))
            for command, native in natives.items():
                other = output(options.cie, command, trace)
                if native != other:
                    problems.append(f"{command} of CTF 2: exit {native[0]} and {other[0]}; {native[2]!r} {other[2]!r}")
            if problems:
                failures += 1
                print(f"seed {seed}:", *problems, sep="\n  ")
                if options.keep:
                    shutil.copytree(trace, options.keep / trace.name, dirs_exist_ok=True)
    print(f"{options.traces} traces, {failures} differ")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
