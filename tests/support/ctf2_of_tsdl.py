#!/usr/bin/env python3
"""Says in the words of CTF 2 (JSON) what a trace's metadata says in those of CTF 1.8 (TSDL): the files
of streams need no change. Written from the two specifications, apart from the reader that it tests.

Usage: ctf2_of_tsdl.py METADATA > METADATA2, or ctf2_of_tsdl.py TRACE COPY (every trace below it)"""
import json
import re
import shutil
import struct
import sys
import uuid
from pathlib import Path

TOKEN = re.compile(r'\s+|/\*.*?\*/|//[^\n]*|("(?:[^"\\]|\\.)*")|([A-Za-z_]\w*)|(0[xX][0-9a-fA-F]+|\d+)[uUlL]*|'
                   r'(:=|\.\.\.|->|[-+{}()<>\[\];:,.=*])', re.DOTALL)
HEADER_ROLES = {"magic": "packet-magic-number", "uuid": "metadata-stream-uuid", "stream_id": "data-stream-class-id",
                "stream_instance_id": "data-stream-id"}
PACKET_ROLES = {"packet_size": "packet-total-length", "content_size": "packet-content-length",
                "timestamp_begin": "default-clock-timestamp", "timestamp_end": "packet-end-default-clock-timestamp",
                "events_discarded": "discarded-event-record-counter-snapshot",
                "packet_seq_num": "packet-sequence-number"}
SCOPES = {"trace.packet.header": "packet-header", "stream.packet.context": "packet-context",
          "stream.event.header": "event-record-header", "stream.event.context": "event-record-common-context",
          "event.context": "event-record-specific-context", "event.fields": "event-record-payload"}
ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "0": "\0"}


def text_of(data):
    """The TSDL of a metadata file, out of its packets if it comes in some."""
    for order in "<>":
        if data[:4] == struct.pack(order + "I", 0x75D11D57):
            out, at = b"", 0
            while at < len(data):
                content, packet = struct.unpack_from(order + "II", data, at + 24)
                out += data[at + 37:at + content // 8]
                at += packet // 8
            return out.decode()
    return data.decode()


class Reader:
    """TSDL into field classes. A class still has its names from CTF 1.8 (in "1.8")."""

    def __init__(self, text):
        self.tokens, at = [], 0
        while at < len(text):
            match = TOKEN.match(text, at)
            if not match:
                raise ValueError(f"not TSDL: {text[at:at + 40]!r}")
            at = match.end()
            for kind, token in zip(("text", "name", "number", "sign"), match.groups()):
                if token is not None:
                    self.tokens.append((kind, token))
        self.at, self.scopes, self.order = 0, [{}], "little-endian"
        self.trace, self.env, self.clocks, self.streams, self.events = {}, {}, [], [], []

    def peek(self, ahead=0):
        return self.tokens[self.at + ahead][1] if self.at + ahead < len(self.tokens) else None

    def kind(self):
        return self.tokens[self.at][0]

    def take(self):
        self.at += 1
        return self.tokens[self.at - 1][1]

    def accept(self, token):
        if self.peek() == token:
            self.at += 1
            return True
        return False

    def expect(self, token):
        if not self.accept(token):
            raise ValueError(f"expected {token}, not {self.peek()}")

    def word(self):
        kind, token = self.tokens[self.at]
        self.at += 1
        if kind == "text":
            return re.sub(r"\\(.)", lambda m: ESCAPES.get(m[1], m[1]), token[1:-1])
        return token

    def number(self):
        sign = 1
        while self.peek() in ("-", "+"):
            sign = -sign if self.take() == "-" else sign
        return sign * int(self.take(), 0)

    def path(self):
        name = self.take()
        while self.accept(".") or self.accept("->"):
            name += "." + self.take()
        return name

    def value(self):
        if self.kind() == "text":
            return self.word()
        if self.kind() == "name":
            return self.path()
        return self.number()

    def attributes(self):
        found = {}
        self.expect("{")
        while not self.accept("}"):
            name = self.path()
            self.expect("=")
            found[name] = self.value()
            self.accept(";")
        return found

    def named(self, name):
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name]
        raise ValueError(f"unknown type {name}")

    def byte_order(self, given):
        return {"le": "little-endian", "be": "big-endian", "network": "big-endian"}.get(given, self.order)

    def integer(self):
        a = self.attributes()
        made = {"type": "fixed-length-signed-integer" if a.get("signed") in (1, "true", "TRUE") else
                "fixed-length-unsigned-integer", "length": a["size"], "byte-order": self.byte_order(a.get("byte_order")),
                "alignment": a.get("align", 8 if a["size"] % 8 == 0 else 1), "1.8": {}}
        if a.get("encoding", "none") != "none":
            made["1.8"]["text"] = True
        if "map" in a:
            made["1.8"]["clock"] = a["map"].split(".")[1]
        return made

    def enumeration(self):
        name = self.take() if self.kind() == "name" else None
        container = self.type(False) if self.accept(":") else None
        if not self.accept("{"):
            return self.named("enum " + name)
        made = dict(container or self.named("int"), mappings={})
        after = 0
        while not self.accept("}"):
            label = self.word()
            low = high = after
            if self.accept("="):
                low = high = self.number()
                if self.accept("..."):
                    high = self.number()
            made["mappings"].setdefault(label, []).append([low, high])
            after = high + 1
            self.accept(",")
        if name:
            self.scopes[-1]["enum " + name] = made
        return made

    def members(self):
        found = []
        self.expect("{")
        self.scopes.append({})
        while not self.accept("}"):
            if self.declaration():
                continue
            base = self.type(True)
            while True:
                found.append(self.declarator(base))
                if not self.accept(","):
                    break
            self.expect(";")
        self.scopes.pop()
        return found

    def structure(self):
        name = self.take() if self.kind() == "name" and self.peek() != "align" else None
        if self.peek() != "{":
            return self.named("struct " + name)
        made = {"type": "structure", "1.8": {"members": self.members()}}
        if self.accept("align"):
            self.expect("(")
            made["minimum-alignment"] = self.number()
            self.expect(")")
        if name:
            self.scopes[-1]["struct " + name] = made
        return made

    def variant(self):
        name = self.take() if self.kind() == "name" else None
        tag = None
        if self.accept("<"):
            tag = self.path()
            self.expect(">")
        made = {"type": "variant", "1.8": {"options": self.members()}} if self.peek() == "{" else (
            dict(self.named("variant " + name)))
        made["1.8"] = dict(made["1.8"], **({"tag": tag} if tag else {}))
        if name and "options" in made["1.8"]:
            self.scopes[-1]["variant " + name] = made
        return made

    def type(self, before_declarator):
        self.accept("const")
        for word, read in (("integer", self.integer), ("enum", self.enumeration), ("struct", self.structure),
                           ("variant", self.variant)):
            if self.accept(word):
                return read()
        if self.accept("floating_point"):
            a = self.attributes()
            bits = a["exp_dig"] + a["mant_dig"]
            return {"type": "fixed-length-floating-point-number", "length": bits, "1.8": {},
                    "byte-order": self.byte_order(a.get("byte_order")), "alignment": a.get("align", 8)}
        if self.accept("string"):
            if self.peek() == "{":
                self.attributes()
            return {"type": "null-terminated-string", "1.8": {}}
        name = self.take()
        while self.tokens[self.at][0] == "name" and not (
                before_declarator and self.tokens[self.at + 1][0] != "name"):
            name += " " + self.take()
        return self.named(name)

    def declarator(self, base):
        name, dimensions = self.take(), []
        while self.accept("["):
            dimensions.append(self.number() if self.kind() == "number" else self.path())
            self.expect("]")
        for dimension in reversed(dimensions):
            if isinstance(dimension, int):
                base = {"type": "static-length-array", "element-field-class": base, "length": dimension, "1.8": {}}
            else:
                base = {"type": "dynamic-length-array", "element-field-class": base, "1.8": {"length": dimension}}
        return name, base

    def declaration(self):
        if self.accept("typealias"):
            made = self.type(False)
            self.expect(":=")
            name = self.take()
            while self.kind() == "name":
                name += " " + self.take()
            self.expect(";")
            self.scopes[-1][name] = made
            return True
        if self.accept("typedef"):
            name, made = self.declarator(self.type(True))
            self.expect(";")
            self.scopes[-1][name] = made
            return True
        return self.accept(";")

    def block(self):
        found = {}
        self.expect("{")
        self.scopes.append({})
        while not self.accept("}"):
            if self.declaration():
                continue
            name = self.word() if self.kind() == "text" else self.path()
            found[name] = self.type(False) if self.accept(":=") else (self.expect("="), self.value())[1]
            if name == "byte_order":
                self.order = self.byte_order(found[name])
            self.accept(";")
        self.scopes.pop()
        return found

    def read(self):
        # Types before the trace block have its byte order as well.
        for i, (_, token) in enumerate(self.tokens):
            if token == "byte_order" and self.tokens[i + 2][1] in ("le", "be", "network"):
                self.order = self.byte_order(self.tokens[i + 2][1])
                break
        while self.at < len(self.tokens):
            if self.declaration():
                continue
            word = self.peek()
            if word in ("trace", "env", "clock", "stream", "event", "callsite"):
                self.take()
                found = self.block()
                {"trace": self.trace.update, "env": self.env.update, "clock": self.clocks.append,
                 "stream": self.streams.append, "event": self.events.append, "callsite": lambda _: None}[word](found)
            else:
                self.type(False)
        return self


def plain(name):
    return name[1:] if name.startswith("_") else name


class Writer:
    """Field classes with the roles, names and locations of CTF 2. Every structure on the way to a field
    is known by its members of CTF 1.8, so that what they refer to is found."""

    def __init__(self, roles=None, is_header=False):
        self.roles, self.is_header = roles or {}, is_header

    def scope(self, made, earlier):
        """`earlier`: (name of the scope, its members) of those before, the nearest one last."""
        self.earlier = earlier
        return self.structure(made, [], True)

    def structure(self, made, around, is_root=False):
        members, below = [], [*around, []]
        for name, member in made["1.8"]["members"]:
            out = self.write(member, name, below, is_root)
            members.append({"name": plain(name), "field-class": out})
            below[-1].append((name, member))
        return {"type": "structure", "member-classes": members,
                **({"minimum-alignment": made["minimum-alignment"]} if "minimum-alignment" in made else {})}

    def location(self, reference, around):
        """Where a name leads, and what is there."""
        path = reference.split(".")
        for scope, origin in SCOPES.items():
            if reference.startswith(scope + "."):
                path = path[scope.count(".") + 1:]
                for name, members in self.earlier:
                    if name == scope:
                        return {"origin": origin, "path": [plain(p) for p in path]}, self.walk(members, path)
                return {"origin": origin, "path": [plain(p) for p in path]}, self.walk(around[0], path)
        for up, members in enumerate(reversed(around)):
            if found := self.walk(members, path):
                return {"path": [None] * up + [plain(p) for p in path]}, found
        for name, members in reversed(self.earlier):
            if found := self.walk(members, path):
                return {"origin": SCOPES[name], "path": [plain(p) for p in path]}, found
        raise ValueError(f"nothing is called {reference}")

    @staticmethod
    def walk(members, path):
        for i, step in enumerate(path):
            found = next((made for name, made in reversed(members) if name == step), None)
            if found is None:
                return None
            members = found["1.8"].get("members", [])
            if i + 1 == len(path):
                return found
        return None

    def role(self, name, made, is_root):
        if self.is_header:
            if "clock" in made["1.8"] or name == "timestamp":
                return "default-clock-timestamp"
            return "event-record-class-id" if name == "id" else None
        return self.roles.get(name) if is_root else None

    def write(self, made, name, around, is_root=False):
        kind = made["type"]
        out = {k: v for k, v in made.items() if k != "1.8"}
        if kind == "structure":
            return self.structure(made, around)
        if kind in ("static-length-array", "dynamic-length-array"):
            element = made["element-field-class"]
            if kind == "dynamic-length-array":
                out["length-field-location"] = self.location(made["1.8"]["length"], around)[0]
            if is_root and self.roles.get(name) == "metadata-stream-uuid":
                return {"type": "static-length-blob", "length": made["length"], "roles": [self.roles[name]]}
            if "text" in element["1.8"] and element["length"] == 8:
                del out["element-field-class"]
                return dict(out, type=kind.replace("array", "string"))
            return dict(out, **{"element-field-class": self.write(element, "", around)})
        if kind == "variant":
            location, tag = self.location(made["1.8"]["tag"], around)
            options = []
            for option, inner in made["1.8"]["options"]:
                ranges = next((r for label, r in tag["mappings"].items() if plain(label) == plain(option)), None)
                if ranges:
                    options.append({"name": plain(option), "selector-field-ranges": ranges,
                                    "field-class": self.write(inner, option, around)})
            return {"type": "variant", "selector-field-location": location, "options": options}
        if kind.startswith("fixed-length-") and (role := self.role(name, made, is_root)):
            out["roles"] = [role]
        return out


def clock_in(made):
    """The clock that some field below is a time of."""
    if isinstance(made, dict):
        if "clock" in made.get("1.8", {}):
            return made["1.8"]["clock"]
        inner = made.get("1.8", {})
        for _, member in inner.get("members", []) + inner.get("options", []):
            if found := clock_in(member):
                return found
    return None


def fragments(tsdl):
    read = Reader(tsdl).read()
    preamble = {"type": "preamble", "version": 2}
    if "uuid" in read.trace:
        preamble["uuid"] = list(uuid.UUID(read.trace["uuid"]).bytes)
    yield preamble

    def members(made):
        return made["1.8"]["members"] if made else []

    trace = {"type": "trace-class", "environment": read.env}
    header = read.trace.get("packet.header")
    if header:
        trace["packet-header-field-class"] = Writer(HEADER_ROLES).scope(header, [])
    yield trace
    for clock in read.clocks:
        out = {"type": "clock-class", "id": clock["name"], "name": clock["name"],
               "frequency": clock.get("freq", 1_000_000_000), "origin": "unix-epoch"}
        whole, cycles = divmod(clock.get("offset", 0), out["frequency"])
        out["offset-from-origin"] = {"seconds": clock.get("offset_s", 0) + whole, "cycles": cycles}
        out.update({name: clock[key] for name, key in (("uid", "uuid"), ("description", "description")) if key in clock})
        yield out
    for stream in read.streams or [{}]:
        packet, head, context = (stream.get(k) for k in ("packet.context", "event.header", "event.context"))
        known = [("trace.packet.header", members(header)), ("stream.packet.context", members(packet)),
                 ("stream.event.header", members(head)), ("stream.event.context", members(context))]
        out = {"type": "data-stream-class", "id": stream.get("id", 0)}
        clock = clock_in(head) or clock_in(packet) or (read.clocks[0]["name"] if read.clocks else None)
        if clock:
            out["default-clock-class-id"] = clock
        for key, made, writer, before in (
                ("packet-context-field-class", packet, Writer(PACKET_ROLES), 1),
                ("event-record-header-field-class", head, Writer(is_header=True), 2),
                ("event-record-common-context-field-class", context, Writer(), 3)):
            if made:
                out[key] = writer.scope(made, known[:before])
        yield out
        for event in read.events:
            if event.get("stream_id", 0) != stream.get("id", 0):
                continue
            own, fields = event.get("context"), event.get("fields")
            out = {"type": "event-record-class", "id": event.get("id", 0),
                   "data-stream-class-id": event.get("stream_id", 0), "name": event["name"]}
            if own:
                out["specific-context-field-class"] = Writer().scope(own, known)
            if fields:
                out["payload-field-class"] = Writer().scope(fields, [*known, ("event.context", members(own))])
            yield out


def sequence(objects):
    return b"".join(b"\x1e" + json.dumps(o).encode() + b"\n" for o in objects)


def convert(data):
    """CTF 1.8's metadata, packets or not, as CTF 2's."""
    return sequence(fragments(text_of(data)))


def convert_copy(trace, copy):
    shutil.copytree(trace, copy)
    for metadata in copy.rglob("metadata"):
        metadata.write_bytes(convert(metadata.read_bytes()))


if __name__ == "__main__":
    if len(sys.argv) == 3:
        convert_copy(Path(sys.argv[1]), Path(sys.argv[2]))
    else:
        sys.stdout.buffer.write(convert(Path(sys.argv[1]).read_bytes()))
