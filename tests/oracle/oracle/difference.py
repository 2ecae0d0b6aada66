"""Readable differences between what is expected and what was said."""

from typing import Any

QUANTILES = ("p50", "p90", "p99", "p99_9")
KEYS = (("logical_id", "pid"), ("name", "hops"), ("pid", "tid"), ("tid",), ("pid",), ("from",))


def _keyed(items: list[Any]) -> dict[Any, Any] | None:
    """Lists of records are compared by what names a record, so an insertion reads as one."""
    if not items or not all(isinstance(i, dict) for i in items):
        return None
    for key in KEYS:
        if all(all(k in i for k in key) for i in items):
            names = [str(tuple(i[k] for k in key)) for i in items]
            if len(set(names)) == len(names):
                return dict(zip(names, items))
    return None


def compare(expected: Any, got: Any, where: str = "") -> list[str]:
    """What `expected` says and `got` does not; what only `got` says is not looked at.

    A dictionary with "count" and quantiles is a summary: mean within rounding, quantiles within
    the 0.8 % that the histogram promises, everything else exactly.
    """
    if isinstance(expected, dict):
        if not isinstance(got, dict):
            return [f"{where}: expected {_short(expected)}, got {_short(got)}"]
        lines = []
        for key, value in expected.items():
            place = f"{where}.{key}" if where else key
            if key not in got:
                lines.append(f"{place}: missing, expected {_short(value)}")
            elif key in QUANTILES and isinstance(value, int) and isinstance(got[key], int):
                if abs(got[key] - value) * 1000 > 8 * abs(value):
                    lines.append(f"{place}: {got[key]} is not within 0.8 % of {value}")
            elif key == "mean" and isinstance(value, float) and isinstance(got[key], (int, float)):
                if abs(got[key] - value) > 1e-6 * max(1.0, abs(value)):
                    lines.append(f"{place}: expected {value}, got {got[key]}")
            else:
                lines += compare(value, got[key], place)
        return lines
    if isinstance(expected, list) and isinstance(got, list):
        left, right = _keyed(expected), _keyed(got)
        if left is not None and right is not None:
            lines = compare(left, right, where)
            lines += [f"{where}{key}: not expected" for key in right if key not in left]
            return lines
        if len(expected) != len(got):
            return [f"{where}: expected {_short(expected)}, got {_short(got)}"]
        return [line for n, (a, b) in enumerate(zip(expected, got))
                for line in compare(a, b, f"{where}[{n}]")]
    if expected != got or isinstance(expected, bool) != isinstance(got, bool):
        return [f"{where}: expected {_short(expected)}, got {_short(got)}"]
    return []


def compare_text(expected: str, got: str, name: str, limit: int = 6) -> list[str]:
    if expected == got:
        return []
    lines, left, right = [], expected.split("\n"), got.split("\n")
    if len(left) != len(right):
        lines.append(f"{name}: expected {len(left)} lines, got {len(right)}")
    for n, (a, b) in enumerate(zip(left, right)):
        if a != b:
            lines += [f"{name}:{n + 1}: expected {a}", f"{name}:{n + 1}: got      {b}"]
            if len(lines) > limit:
                break
    return lines


def compare_verdicts(expected: dict[str, Any], got: dict[str, Any],
                     undecided: set[tuple[str, str]] = frozenset()) -> list[str]:
    """By rule and subject. Subjects that are not applicable may be left out on either side; a
    verdict of "*" is not judged: the documents leave it open."""
    lines = []
    if expected.get("verdict") not in ("*", None) and expected["verdict"] != got.get("verdict"):
        lines.append(f"overall: expected {expected['verdict']}, got {got.get('verdict')}")
    ids = [r["id"] for r in got.get("rules", [])]
    wanted = [r["id"] for r in expected["rules"]]
    if ids != wanted:
        lines.append(f"rules: expected {wanted}, got {ids}")
    rules = {r["id"]: r for r in got.get("rules", [])}
    for rule in expected["rules"]:
        other = rules.get(rule["id"])
        if other is None:
            continue
        if rule["verdict"] != "*" and rule["verdict"] != other["verdict"]:
            lines.append(f"{rule['id']}: expected {rule['verdict']}, got {other['verdict']}")
        left = {s["subject"]: s["verdict"] for s in rule["subjects"]}
        right = {s["subject"]: s["verdict"] for s in other["subjects"]}
        if left.get("*") == "*":
            continue
        for subject in sorted(left.keys() | right.keys()):
            a, b = left.get(subject, "NOT_APPLICABLE"), right.get(subject, "NOT_APPLICABLE")
            if a not in (b, "*") and (rule["id"], subject) not in undecided:
                lines.append(f"{rule['id']} {subject}: expected {a}, got {b}"
                             + _evidence(other, subject))
        for subject in other["subjects"]:
            if subject["verdict"] in ("PASS", "FAIL") and subject.get("checked", 1) < 1:
                lines.append(f"{rule['id']} {subject['subject']}: {subject['verdict']} with nothing "
                             "checked")
            if subject["verdict"] == "FAIL" and not subject.get("evidence", True):
                lines.append(f"{rule['id']} {subject['subject']}: FAIL without evidence")
    return lines


def _evidence(rule: dict[str, Any], subject: str) -> str:
    for s in rule["subjects"]:
        if s["subject"] == subject and s.get("evidence"):
            return f" ({s['evidence'][0].get('note', '')})"
    return ""


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 160 else text[:157] + "..."


def compare_weaker(expected: dict[str, Any], got: dict[str, Any], flips: bool) -> list[str]:
    """Law L2: loss never makes a false FAIL and never lets a violation pass over all.

    `flips`: neither may a single subject go from FAIL to PASS. That holds when what is missing
    leaves holes; a missing tail is a crash, and the rules judge what was before it. M7 is left out:
    its table has no INCONCLUSIVE.
    """
    lines = []
    wanted = expected["verdict"]
    if (wanted, got.get("verdict")) in (("PASS", "FAIL"), ("FAIL", "PASS")):
        lines.append(f"overall: {got['verdict']}, though without the loss it is {wanted}")
    rules = {r["id"]: r for r in got.get("rules", [])}
    for rule in expected["rules"]:
        truth = {s["subject"]: s["verdict"] for s in rule["subjects"]}
        for s in rules.get(rule["id"], {}).get("subjects", []):
            before, after = truth.get(s["subject"], "NOT_APPLICABLE"), s["verdict"]
            if s["subject"].startswith("callback ?"):  # its announcement is missing
                continue
            false_fail = after == "FAIL" and before not in ("FAIL", "*")
            flip = flips and after == "PASS" and before == "FAIL" and rule["id"] != "M7"
            if false_fail or flip:
                lines.append(f"{rule['id']} {s['subject']}: {after}, though without the loss it is "
                             f"{before}" + _evidence(rules[rule["id"]], s["subject"]))
    return lines
