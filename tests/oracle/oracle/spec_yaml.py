"""The scheduling spec, read with a small parser for the part of YAML such files use.

Block mappings and sequences, flow sequences and mappings, plain, single- and double-quoted scalars,
comments. Anything else is an error rather than a guess.
"""

import re
from fractions import Fraction
from typing import Any

UNITS = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9}


def load(path: str) -> dict[str, Any]:
    with open(path, encoding="utf-8") as file:
        lines = [(len(line) - len(line.lstrip(" ")), text)
                 for line in file.read().split("\n")
                 if (text := _strip_comment(line).strip()) and text not in ("---", "...")]
    value, rest = _block(lines, 0, 0)
    if rest != len(lines):
        raise ValueError(f"{path}: cannot read: {lines[rest][1]!r}")
    return value or {}


def _strip_comment(line: str) -> str:
    quote = ""
    for i, c in enumerate(line):
        if quote:
            quote = "" if c == quote and not _escaped(line, i, quote) else quote
        elif c in "\"'":
            quote = c
        elif c == "#" and (i == 0 or line[i - 1] in " \t"):
            return line[:i]
    return line


def _escaped(text: str, at: int, quote: str) -> bool:
    """Whether the quote at `at` is a character of a double-quoted scalar."""
    backslashes = len(text[:at]) - len(text[:at].rstrip("\\"))
    return quote == '"' and backslashes % 2 == 1


def _block(lines: list[tuple[int, str]], at: int, indent: int) -> tuple[Any, int]:
    if at >= len(lines) or lines[at][0] < indent:
        return None, at
    indent = lines[at][0]
    if lines[at][1].startswith("- ") or lines[at][1] == "-":
        items = []
        while at < len(lines) and lines[at][0] == indent and lines[at][1].startswith("-"):
            rest = lines[at][1][1:].lstrip()
            if _is_mapping(rest):
                inner = indent + len(lines[at][1]) - len(rest)
                lines[at] = (inner, rest)
                item, at = _block(lines, at, inner)
            elif rest:
                item, at = _scalar(rest), at + 1
            else:
                item, at = _block(lines, at + 1, indent + 1)
            items.append(item)
        return items, at
    mapping: dict[str, Any] = {}
    while at < len(lines) and lines[at][0] == indent:
        match = re.match(r'("(?:[^"\\]|\\.)*"|[^:\[\]{}]+?)\s*:(?:\s+(.*))?$', lines[at][1])
        if not match:
            raise ValueError(f"no key: {lines[at][1]!r}")
        key, rest = _scalar(match.group(1)), match.group(2) or ""
        if rest:
            mapping[key], at = _scalar(rest), at + 1
        else:
            deeper = indent
            if at + 1 < len(lines) and not lines[at + 1][1].startswith("-"):
                deeper = indent + 1
            mapping[key], at = _block(lines, at + 1, deeper)
    return mapping, at


def _is_mapping(text: str) -> bool:
    return bool(re.match(r'("(?:[^"\\]|\\.)*"|[A-Za-z_]\w*)\s*:(\s|$)', text))


def _scalar(text: str) -> Any:
    text = text.strip()
    if text[:1] == '"':
        return re.sub(r"\\(.)", r"\1", text[1:-1])
    if text[:1] == "'":
        return text[1:-1].replace("''", "'")
    if text[:1] == "[":
        return [_scalar(item) for item in _split(text[1:-1])]
    if text[:1] == "{":
        pairs = (item.split(":", 1) for item in _split(text[1:-1]))
        return {_scalar(key): _scalar(value) for key, value in pairs}
    if text in ("~", "null", ""):
        return None
    if re.fullmatch(r"[-+]?\d+", text):
        return int(text)
    if match := re.fullmatch(r"(\d+(?:\.\d+)?)(ns|us|ms|s|min)", text):
        return int(Fraction(match[1]) * UNITS[match[2]])
    return text


def _split(text: str) -> list[str]:
    items, depth, quote, start = [], 0, "", 0
    for i, c in enumerate(text):
        if quote:
            quote = "" if c == quote and not _escaped(text, i, quote) else quote
        elif c in "\"'":
            quote = c
        elif c in "[{":
            depth += 1
        elif c in "]}":
            depth -= 1
        elif c == "," and not depth:
            items.append(text[start:i])
            start = i + 1
    items.append(text[start:])
    return [item for item in items if item.strip()]
