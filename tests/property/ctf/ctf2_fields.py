#!/usr/bin/env python3
"""What only CTF 2 has: integers of variable length, booleans, bits in either order, bit maps, blobs, texts
of known length, optional fields, ranges that select and label, lengths found through scopes, variants and
parents, roles anywhere. A recording is written once so, with an encoder of its own, and once in the plain
CTF 1.8 that readers_agree.py checks against libbabeltrace2: cie must print the same of both.

Usage: ctf2_fields.py CIE [--traces N] [--seed S] [--keep DIR]"""
import argparse
import csv
import random
import shutil
import struct
import sys
import tempfile
import uuid
from pathlib import Path

import readers_agree
from readers_agree import EVENTS, Bits, output, recording

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from ctf2_of_tsdl import sequence  # noqa: E402

ORDERS = {"le": "little-endian", "be": "big-endian"}


def leb128(value):
    """Signed or not: of a number that is not negative bit 6 of the last byte stays free if it must."""
    out, signed = bytearray(), value[1]
    value = value[0]
    while True:
        byte, value = value & 0x7F, value >> 7
        if value == 0 and not (signed and byte & 0x40) or value == -1 and byte & 0x40:
            return bytes(out + bytes([byte]))
        out.append(byte | 0x80)


def put_bytes(bits, data):
    bits.align(8)
    bits.data += data
    bits.at = 8 * len(bits.data)


class Number:
    """An integer of any class that can hold `least` bits and a sign, in any order of bits and bytes."""

    def __init__(self, rng, order, least, signed=None, whole=False, roles=()):
        self.signed = rng.random() < 0.4 if signed is None else signed
        self.roles = list(roles)
        self.leb = rng.random() < 0.4
        self.whole = whole or rng.random() < 0.5
        need = min(64, least + self.signed)
        self.size = rng.choice([s for s in (8, 16, 32, 64) if s >= need]) if self.whole else rng.randint(need, 64)
        self.alignment = 8 if self.leb else rng.choice([8, 8, 16, 64] if self.whole else [1, 1, 2, 8])
        self.order = order
        if self.whole and rng.random() < 0.3:
            self.order = {"le": "be", "be": "le"}[order]
        self.odd_bits = rng.random() < 0.3
        self.mappings = None

    def json(self):
        sign = "signed" if self.signed else "unsigned"
        out = {"type": f"variable-length-{sign}-integer"}
        if not self.leb:
            out = {"type": f"fixed-length-{sign}-integer", "length": self.size, "alignment": self.alignment,
                   "byte-order": ORDERS[self.order]}
            usual, other = ("first-to-last", "last-to-first") if self.order == "le" else (
                "last-to-first", "first-to-last")
            if self.odd_bits:
                out["bit-order"] = other
            elif self.size % 3 == 0:
                out["bit-order"] = usual
        if self.mappings:
            out["mappings"] = self.mappings
        if self.roles:
            out["roles"] = self.roles
        return dict(out, attributes={"nobody": [1, {"reads": None}]})

    def write(self, bits, value):
        if self.leb:
            put_bytes(bits, leb128((value, self.signed)))
            return
        bits.align(self.alignment)
        value &= (1 << self.size) - 1
        if self.odd_bits:
            value = int(f"{value:0{self.size}b}"[::-1], 2)
        bits.put(value, self.size, self.order == "be")


class Labels(Number):
    """Labels as ranges of numbers, some of them below 0."""

    def __init__(self, rng, order, labels):
        super().__init__(rng, order, 8)
        self.rng, base = rng, -60 if self.signed else 3
        self.values = {label: [[base + 20 * i, base + 20 * i + rng.randint(0, 8)],
                               [base + 20 * i + 10, base + 20 * i + 10]] for i, label in enumerate(labels)}
        # What the class cannot have does no harm.
        self.mappings = dict(self.values, beyond=[[-(1 << 63), -200], [1 << 63, (1 << 64) - 1]])

    def write(self, bits, label):
        super().write(bits, self.rng.randint(*self.rng.choice(self.values[label])))


class Text:
    def __init__(self, rng, order, name):
        self.rng = rng
        self.kind = rng.choice(["null-terminated", "static-length", "dynamic-length"])
        self.length = rng.randint(24, 40)
        self.count = Number(rng, order, 8, signed=False, whole=True)
        self.name = name

    def members(self):
        out = {"type": f"{self.kind}-string", "encoding": "utf-8"}
        if self.kind == "static-length":
            out["length"] = self.length
        if self.kind != "dynamic-length":
            return [(self.name, out, 8)]
        out["length-field-location"] = {"path": [self.name + " bytes"]}
        return [(self.name + " bytes", self.count.json(), self.count.alignment), (self.name, out, 8)]

    def write(self, bits, value):
        data = value.encode()
        if self.kind == "null-terminated":
            put_bytes(bits, data + b"\0")
        elif self.kind == "static-length":
            # What follows the first NUL is anything.
            data += b"\0" + self.rng.randbytes(self.length) if len(data) < self.length else b""
            put_bytes(bits, data[:self.length])
        else:
            data += self.rng.choice([b"", b"\0", b"\0garbage"])
            self.count.write(bits, len(data))
            put_bytes(bits, data)


class Cpus:
    def __init__(self, rng, order, name):
        self.name = name
        self.length = Number(rng, order, 8, signed=False, whole=True)
        self.element = Number(rng, order, 8, whole=True)

    def members(self):
        alignment = max(self.element.alignment, 32)
        return [("count", {"type": "structure", "member-classes": [{"name": "of", "field-class": self.length.json()}]},
                 self.length.alignment),
                (self.name, {"type": "dynamic-length-array", "element-field-class": self.element.json(),
                             "minimum-alignment": 32, "length-field-location": {"path": ["count", "of"]}}, alignment)]

    def write(self, bits, values):
        bits.align(self.length.alignment)
        self.length.write(bits, len(values))
        bits.align(max(self.element.alignment, 32))
        for value in values:
            self.element.write(bits, value)


def structure(members, alignment=1):
    return {"type": "structure", "minimum-alignment": alignment,
            "member-classes": [{"name": name, "field-class": made} for name, made in members]}


class Filler:
    """A field that nobody asks for. `known`: lengths elsewhere, by location, with their values when written."""

    KINDS = ("bits", "bitmap", "flags", "wide", "real", "blob", "text", "texts", "optional", "ranges", "both", "variant",
             "chosen length", "parents", "elements", "elsewhere", "missing length")

    def __init__(self, rng, order, kind=None):
        self.rng, self.order, self.kind = rng, order, kind or rng.choice(self.KINDS)
        self.length = Number(rng, order, 8, signed=False, whole=True)
        self.tag = Number(rng, order, 8, whole=True)
        self.inner = [Number(rng, order, 8, signed=False, whole=True) for _ in range(3)]
        self.boolean = rng.choice([1, 8, 8, 12, 32])
        self.size = rng.choice([65, 100, 128, 192])
        self.unit = rng.choice([16, 32])

    def number(self):
        return self.inner[0]

    def truth(self):
        return {"type": "fixed-length-boolean", "length": self.boolean, "byte-order": ORDERS[self.order], "alignment": 8}

    def json(self):
        kind, order = self.kind, ORDERS[self.order]
        blob = {"type": "dynamic-length-blob", "length-field-location": {"path": ["n"]}}
        if kind == "bits":
            return {"type": "fixed-length-bit-array", "length": 13, "byte-order": order}
        if kind == "bitmap":
            return {"type": "fixed-length-bit-map", "length": 16, "byte-order": order, "flags": {"A": [[3, 3]], "B": [[0, 9]]}}
        if kind == "flags":
            return {"type": "static-length-array", "length": 11, "minimum-alignment": 32, "element-field-class":
                    {"type": "fixed-length-boolean", "length": 1, "byte-order": order}}
        if kind == "wide":
            return {"type": "fixed-length-unsigned-integer", "length": self.size, "byte-order": order}
        if kind == "real":
            return {"type": "fixed-length-floating-point-number", "length": self.size // 32 * 32 if self.size > 127 else 16,
                    "byte-order": order, "alignment": 8}
        if kind == "blob":
            return {"type": "static-length-blob", "length": 7, "media-type": "text/csv"}
        if kind == "text":
            return {"type": "null-terminated-string", "encoding": f"utf-{self.unit}le"}
        if kind == "texts":
            return {"type": "static-length-string", "encoding": f"utf-{self.unit}be", "length": 2 * self.unit // 8}
        if kind in ("optional", "missing length"):
            here = {"type": "optional", "selector-field-location": {"path": ["is"]}}
            members = [("is", self.truth()), ("n", dict(here, **{"field-class": self.inner[0].json()}))]
            if kind == "missing length":
                members.append(("data", dict(here, **{"field-class": blob})))
            return structure(members)
        if kind in ("ranges", "both"):
            low = [[-5, -3], [2, 2], [9, 20]] if self.tag.signed else [[0, 2], [9, 20]]
            inside = self.inner[0].json()
            if kind == "both":
                inside = {"type": "variant", "selector-field-location": {"path": ["of"]}, "options": [
                    {"selector-field-ranges": low[:-1], "field-class": self.inner[0].json()},
                    {"selector-field-ranges": low[-1:], "field-class": self.inner[1].json(), "name": "named"}]}
            return structure([("of", self.tag.json()), ("there", {
                "type": "optional", "selector-field-location": {"path": ["of"]}, "selector-field-ranges": low,
                "field-class": inside})])
        options = [{"selector-field-ranges": [[i, i], [100 + i, 100 + i]], "field-class": made.json()}
                   for i, made in enumerate(self.inner)]
        chosen = {"type": "variant", "selector-field-location": {"path": ["t"]}, "options": options}
        if kind == "variant":
            return structure([("t", self.tag.json()), ("v", chosen)], 16)
        if kind == "chosen length":
            return structure([("t", self.tag.json()), ("n", chosen), ("data", blob)])
        if kind == "parents":
            deep = {"type": "dynamic-length-blob", "length-field-location": {"path": [None, None, "head", "n"]}}
            return structure([("head", structure([("n", self.length.json())])),
                              ("a", structure([("b", structure([("data", deep)]))]))])
        if kind == "elements":
            return structure([("n", self.length.json()), ("all", {
                "type": "dynamic-length-array", "length-field-location": {"path": ["n"]},
                "element-field-class": structure([("n", self.inner[0].json()), ("data", blob)])})])
        where = self.rng.choice([("event-record-common-context", "ctx len"), ("packet-context", "user len"),
                                 ("packet-header", "header len")])
        self.where = where[1]
        return {"type": "dynamic-length-array", "length-field-location": {"origin": where[0], "path": [where[1]]},
                "element-field-class": {"type": "variable-length-signed-integer"}}

    def alignment(self):
        a = [n.alignment for n in self.inner]
        return {"bits": 1, "bitmap": 1, "flags": 32, "wide": 1, "real": 8, "optional": 8, "missing length": 8,
                "ranges": self.tag.alignment, "both": self.tag.alignment, "variant": max(16, self.tag.alignment),
                "chosen length": max(self.tag.alignment, 8), "parents": max(self.length.alignment, 8),
                "elements": max(self.length.alignment, a[0], 8)}.get(self.kind, 8)

    def write(self, bits, known):
        rng, big, kind = self.rng, self.order == "be", self.kind
        bits.align(self.alignment())
        count = rng.randint(0, 5)
        if kind in ("bits", "bitmap", "wide"):
            size = {"bits": 13, "bitmap": 16}.get(kind, self.size)
            bits.put(rng.getrandbits(size), size, big)
        elif kind == "flags":
            for _ in range(11):
                bits.put(rng.getrandbits(1), 1, big)
        elif kind == "real":
            put_bytes(bits, rng.randbytes(self.size // 32 * 4 if self.size > 127 else 2))
        elif kind == "blob":
            put_bytes(bits, rng.randbytes(7))
        elif kind == "text":
            put_bytes(bits, "Grüße, 世界"[:count].encode(f"utf-{self.unit}-le") + bytes(self.unit // 8))
        elif kind == "texts":
            put_bytes(bits, "é世".encode(f"utf-{self.unit}-be"))
        elif kind in ("optional", "missing length"):
            bits.align(8)
            truth = rng.choice([0, rng.randint(1, (1 << self.boolean) - 1)])
            bits.put(truth, self.boolean, big)
            if truth:
                self.inner[0].write(bits, count)
                if kind == "missing length":
                    put_bytes(bits, rng.randbytes(count))
        elif kind in ("ranges", "both"):
            low = [-5, -4, -3, 2] if self.tag.signed else [0, 1, 2]
            value = rng.choice([*low, 9, 15, 20, 5, 21, 60])
            self.tag.write(bits, value)
            if value in low or kind == "ranges" and 9 <= value <= 20:
                self.inner[0].write(bits, rng.randint(0, 200))
            elif 9 <= value <= 20:
                self.inner[1].write(bits, rng.randint(0, 200))
        elif kind in ("variant", "chosen length"):
            choice = rng.randrange(3)
            self.tag.write(bits, choice + rng.choice([0, 100]))
            self.inner[choice].write(bits, count)
            if kind == "chosen length":
                put_bytes(bits, rng.randbytes(count))
        elif kind == "parents":
            self.length.write(bits, count)
            put_bytes(bits, rng.randbytes(count))
        elif kind == "elements":
            self.length.write(bits, count)
            bits.align(max(self.inner[0].alignment, 8))  # even where no element follows
            for _ in range(count):
                bits.align(max(self.inner[0].alignment, 8))
                inside = rng.randint(0, 4)
                self.inner[0].write(bits, inside)
                put_bytes(bits, rng.randbytes(inside))
        else:
            for _ in range(known[self.where]):
                put_bytes(bits, leb128((rng.randint(-70000, 70000), True)))


class Layout:
    """One way to write a recording in CTF 2. Names of headers say nothing: roles do."""

    def __init__(self, rng):
        self.rng = self.splits = rng
        self.order = rng.choice(["le", "le", "be"])
        order = self.order
        self.uuid = uuid.UUID(int=rng.getrandbits(128))
        self.magic = dict(type="fixed-length-unsigned-integer", length=32, roles=["packet-magic-number"],
                          **{"byte-order": ORDERS[order]})
        unsigned = lambda least, role: Number(rng, order, least, signed=False, whole=True, roles=[role])  # noqa: E731
        self.header = [unsigned(8, "data-stream-class-id"), unsigned(8, "data-stream-id"),
                       Number(rng, order, 8, signed=False, whole=True)]
        self.context = [("size", unsigned(32, "packet-total-length")), ("content", unsigned(32, "packet-content-length")),
                        ("begin", unsigned(64, "default-clock-timestamp")),
                        ("end", unsigned(64, "packet-end-default-clock-timestamp")),
                        ("number", unsigned(32, "packet-sequence-number")),
                        ("lost", unsigned(32, "discarded-event-record-counter-snapshot")),
                        ("cpu", Number(rng, order, 8, signed=False, whole=True)),
                        ("user", Number(rng, order, 8, signed=False, whole=True))]
        for _, number in self.context[:2]:  # sizes are known only when all is written
            number.leb = False
        rng.shuffle(self.context)
        self.one_size = rng.random() < 0.3
        if self.one_size:  # one field with two roles
            self.context = [c for c in self.context if c[0] != "content"]
            dict(self.context)["size"].roles.append("packet-content-length")
        self.id, self.time = unsigned(8, "event-record-class-id"), Number(
            rng, order, 40, signed=False, whole=True, roles=["default-clock-timestamp"])
        self.nested = rng.random() < 0.5
        self.pid, self.tid, self.ctx_len = (Number(rng, order, 16, whole=True) for _ in range(3))
        self.ctx_len.signed = False
        self.class_id = rng.choice([0, 7, 200])
        self.events = {}
        for name, fields in EVENTS.items():
            plan = []
            for field, kind in fields:
                plan += [(None, Filler(rng, order))] * (rng.random() < 0.3)
                if kind is None:
                    plan.append((field, Text(rng, order, field)))
                elif kind == "cpus":
                    plan.append((field, Cpus(rng, order, field)))
                elif isinstance(kind, list):
                    plan.append((field, Labels(rng, order, kind)))
                else:
                    plan.append((field, Number(rng, order, kind)))
            self.events[name] = plan + [(None, Filler(rng, order)) for _ in range(rng.randint(0, 3))]
            if self.one_size:  # events end on whole bytes
                self.events[name].append((None, Filler(rng, order, "blob")))
        self.aligns = {}

    NAMES = {"cpu": "cpu_id", "user": "user len"}

    def metadata(self):
        out = [{"type": "preamble", "version": 2, "uuid": list(self.uuid.bytes), "extensions": {"empty": {}},
                "attributes": {"a": {"deep": [[[[]]]]}}}]
        blob = {"type": "static-length-blob", "length": 16, "roles": ["metadata-stream-uuid"]}
        ids = structure([("timestamp", self.header[0].json()), ("id", self.header[1].json())])
        out.append({"type": "field-class-alias", "name": "ids", "field-class": ids})
        out.append({"type": "trace-class", "namespace": "x", "name": "y", "uid": "z",
                    "environment": {"hostname": "h", "domain": "ust", "tracer_name": "lttng-ust", "tracer_major": 2},
                    "packet-header-field-class": structure([("the magic", self.magic), ("the uuid", blob), ("ids", "ids"),
                                                            ("header len", self.header[2].json())])})
        out.append({"type": "clock-class", "id": "some clock", "name": "m", "frequency": 1_000_000_000,
                    "uid": "11111111-2222-3333-4444-555555555555", "origin": "unix-epoch", "precision": 3,
                    "offset-from-origin": {"seconds": 1_700_000_000}})
        header = [("timestamp", self.id.json()), ("id", self.time.json())]
        if self.nested:
            header = [("both", structure(header))]
        out.append({"type": "data-stream-class", "id": self.class_id, "default-clock-class-id": "some clock",
                    "packet-context-field-class": structure([(self.NAMES.get(n, "packet_" + n), number.json())
                                                             for n, number in self.context]),
                    "event-record-header-field-class": structure(header),
                    "event-record-common-context-field-class": structure(
                        [("vpid", self.pid.json()), ("vtid", self.tid.json()), ("ctx len", self.ctx_len.json())])})
        for number, (name, plan) in enumerate(self.events.items()):
            members, align = [], 1
            for i, (field, made) in enumerate(plan):
                if isinstance(made, (Text, Cpus)):
                    for inner, field_class, alignment in made.members():
                        members.append((inner, field_class))
                        align = max(align, alignment)
                    continue
                members.append((field or f"_{i}", made.json()))
                align = max(align, made.alignment() if isinstance(made, Filler) else made.alignment)
            self.aligns[name] = align
            out.append({"type": "event-record-class", "id": number, "data-stream-class-id": self.class_id, "name": name,
                        "payload-field-class": structure(members)})
        return sequence(out)

    def write_event(self, bits, known, time, name, tid, values):
        bits.align(max(self.id.alignment, self.time.alignment))
        self.id.write(bits, list(self.events).index(name))
        self.time.write(bits, time)
        bits.align(max(self.pid.alignment, self.tid.alignment, self.ctx_len.alignment))
        known["ctx len"] = self.rng.randint(0, 3)
        for number, value in ((self.pid, 4001), (self.tid, tid), (self.ctx_len, known["ctx len"])):
            number.write(bits, value)
        bits.align(self.aligns[name])
        for field, made in self.events[name]:
            if field is None:
                made.write(bits, known)
            else:
                made.write(bits, values[field])

    def packet(self, cpu, number, begin, end, events):
        """A packet whose sizes are written at the second attempt: the first one measures it."""
        state, size, content = self.rng.getstate(), 0, 0
        for _ in range(2):
            self.rng.setstate(state)
            known = {"header len": self.rng.randint(0, 2), "user len": self.rng.randint(0, 3)}
            padding = 0 if self.one_size else self.rng.choice([0, 0, 3, 64])
            bits = Bits()
            bits.put(0xC1FC1FC1, 32, self.order == "be")
            put_bytes(bits, self.uuid.bytes)
            bits.align(max(h.alignment for h in self.header[:2]))
            for made, value in zip(self.header, (self.class_id, cpu, known["header len"])):
                made.write(bits, value)
            bits.align(max(c.alignment for _, c in self.context))
            values = {"size": size, "content": content, "begin": begin, "end": end, "number": number, "lost": 0,
                      "cpu": cpu, "user": known["user len"]}
            for name, made in self.context:
                made.write(bits, values[name])
            for time, *event in events:
                self.write_event(bits, known, time, *event)
            content = bits.at
            size = (-(-content // 8) + padding) * 8
        return bytes(bits.data).ljust(size // 8, b"\0")

    def stream(self, cpu, events, window):
        out, number = b"", 0
        while events or number == 0:
            count = self.splits.randint(1, 12)
            part, events = events[:count], events[count:]
            begin = part[0][0] if number else window[0]
            out += self.packet(cpu, number, begin, part[-1][0] if events else window[1], part)
            number += 1
        return out


def write(trace, metadata, streams):
    trace.mkdir()
    (trace / "metadata").write_bytes(metadata)
    for number, stream in enumerate(streams):
        (trace / f"s{number}").write_bytes(stream)


def compare(cie, folder, seed):
    """What differs; the trace is folder/ctf2/trace."""
    for kind in ("plain", "ctf2"):
        (folder / kind).mkdir(parents=True)
    plain = readers_agree.Layout(random.Random(seed))
    plain.splits = random.Random(seed)
    streams, instances = recording(plain, random.Random(seed))
    write(folder / "plain" / "trace", plain.metadata().encode(), streams)
    layout = Layout(random.Random(seed))
    layout.splits = random.Random(seed)
    metadata = layout.metadata()
    streams, _ = recording(layout, random.Random(seed))
    write(folder / "ctf2" / "trace", metadata, streams)
    problems = []
    for command in ("instances", "report --format json", "verify --format json"):
        one, other = (output(cie, command, "trace", folder / kind) for kind in ("ctf2", "plain"))
        if one != other:
            problems.append(f"{command}: exit {one[0]} and {other[0]}; {one[2]!r} {other[2]!r}")
    rows = csv.DictReader(output(cie, "instances", folder / "ctf2" / "trace")[1].decode().splitlines())
    seen = sorted((r["logical_id"], int(r["seq"]), int(r["start_ns"]), int(r["end_ns"])) for r in rows if r["end_ns"])
    if seen != sorted(instances):
        problems.append(f"{len(seen)} instances read, {len(instances)} written")
    return problems


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("cie", type=lambda path: str(Path(path).resolve()))
    parser.add_argument("--traces", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    failures = 0
    with tempfile.TemporaryDirectory(prefix="cie-ctf2-") as scratch:
        for seed in range(options.seed, options.seed + options.traces):
            folder = Path(scratch) / str(seed)
            if problems := compare(options.cie, folder, seed):
                failures += 1
                print(f"seed {seed}:", *problems, sep="\n  ")
                if options.keep:
                    shutil.copytree(folder, options.keep / str(seed), dirs_exist_ok=True)
            shutil.rmtree(folder)
    print(f"{options.traces} traces, {failures} differ")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
