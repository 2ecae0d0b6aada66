"""Runs `cie` on a generated trace and holds its answers against the truth and the recomputation."""

import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from . import difference, model, report, rules, spec_yaml

EXIT_CODES = {"PASS": 0, "FAIL": 1, "INCONCLUSIVE": 3}


def run_cie(cie: str, arguments: list[str]) -> tuple[int, str, str]:
    done = subprocess.run([cie, *arguments], capture_output=True, timeout=60, check=False)
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode(
        "utf-8", "replace")


def recompute(traces: list[str], spec_path: str | None) -> dict[str, Any]:
    """Instances (CSV text), report and verify (JSON data), with a babeltrace2 of its own."""
    spec = spec_yaml.load(spec_path) if spec_path else None
    seen, _ = model.load(traces)
    sha256 = hashlib.sha256(Path(spec_path).read_bytes()).hexdigest() if spec_path else ""
    verdicts = rules.judge(seen, spec, sha256)
    by_id = {r["id"]: r["verdict"] for r in verdicts["rules"]}
    complete = all(by_id[r] in ("PASS", "NOT_APPLICABLE") for r in ("T2", "T3", "T4"))
    return {"instances": model.instances_csv(seen),
            "report": report.report(seen, spec, complete), "verify": verdicts}


def answers(cie: str, traces: list[str], spec: str | None) -> tuple[dict[str, Any], list[str]]:
    """What cie says, and complaints about how it says it."""
    complaints: list[str] = []
    said: dict[str, Any] = {}
    code, said["instances"], err = run_cie(cie, ["instances", *traces, "--format", "csv"])
    if code != 0:
        complaints.append(f"cie instances: exit code {code}: {err.strip()[:300]}")
    for what in ("report", "verify"):
        code, out, err = run_cie(cie, [
            what, *traces, *(["--spec", spec] if spec else []), "--format", "json"])
        try:
            said[what] = json.loads(out)
        except ValueError as e:
            complaints.append(f"cie {what}: exit code {code}, no JSON ({e}): {err.strip()[:300]}")
            said[what] = {}
        if what == "report" and code != 0:
            complaints.append(f"cie report: exit code {code}")
        if what == "verify" and said[what]:
            wanted = EXIT_CODES.get(said[what].get("verdict", ""))
            if code != wanted:
                complaints.append(f"cie verify: verdict {said[what].get('verdict')}, exit code {code}")
    return said, complaints


def how_to(folder: Path) -> dict[str, Any]:
    """What of the expected files is to be held against whom."""
    how = {"weaker": False, "flips": True, "recomputable": True, "numbers": True,
           "traces": ["trace"], "exact": [], "exit_codes": [],
           "renamed": False}
    if (folder / "how.json").exists():
        how.update(json.loads((folder / "how.json").read_text()))
    return how


def order_matters(cie: str, folder: Path, said: dict[str, Any]) -> list[str]:
    """Law L4: the same bytes give the same answer, whatever the stream files are called."""
    with tempfile.TemporaryDirectory(prefix="cie-oracle-") as scratch:
        copy = Path(scratch) / "trace"
        shutil.copytree(folder / "trace", copy)
        for path in sorted(copy.rglob("channel0_*")):
            path.rename(path.with_name(f"channel0_{9 - int(path.name.rsplit('_', 1)[1])}"))
        again, _ = answers(cie, [str(copy)], str(folder / "spec.yaml"))
    lines = [f"L4, stream files renamed: {x}" for x in
             difference.compare_text(said["instances"], again["instances"], "instances.csv")]
    for what, key in (("verify", "rules"), ("report", "callbacks"), ("report", "chains")):
        before, after = (without_paths(run[what].get(key), folder, copy) for run in (said, again))
        if before != after:
            lines.append(f"L4, stream files renamed: {what} differs in {key}")
    return lines


def without_paths(value: Any, *folders: Path) -> str:
    """As text, evidence that names files of the trace or the spec made the same."""
    text = re.sub(r"channel0_\d+", "channel", json.dumps(value))
    for folder in folders:
        text = text.replace(str(folder), "")
    return text.replace("/trace", "")


def check(cie: str, folder: Path, trace: Path | None = None, independent: bool = True) -> list[str]:
    """Differences of `cie` from the expected files in `folder` and from the recomputation."""
    how = how_to(folder)
    traces = [str(trace)] if trace else [str(folder / t) for t in how["traces"]]
    spec = str(folder / "spec.yaml")
    said, lines = answers(cie, traces, spec)
    for options, wanted in how["exit_codes"]:
        code, _, err = run_cie(cie, ["verify", *traces, "--spec", spec, "--format", "json", *options])
        if code != wanted:
            lines.append(f"cie verify {' '.join(options)}: exit code {code}, expected {wanted} "
                         f"{err.strip()[:200]}")
    if how["renamed"]:
        lines += order_matters(cie, folder, said)
    truth = {name: json.loads((folder / f"{name}.json").read_text())
             for name in ("report", "verify")}
    if how["numbers"]:
        lines += difference.compare_text((folder / "instances.csv").read_text(), said["instances"],
                                         "instances.csv")
        lines += [f"report: {x}" for x in difference.compare(truth["report"], said["report"])]
    if how["weaker"]:
        lines += difference.compare_weaker(truth["verify"], said["verify"], how["flips"])
        verdicts = {r["id"]: r["verdict"] for r in said["verify"].get("rules", [])}
        lines += [f"{r['id']}: expected {r['verdict']}, got {verdicts.get(r['id'])}"
                  for r in truth["verify"]["rules"]
                  if r["id"] in how["exact"] and r["verdict"] != verdicts.get(r["id"])]
        if truth["verify"]["verdict"] == "INCONCLUSIVE" != said["verify"].get("verdict"):
            lines.append(f"overall: {said['verify'].get('verdict')}, expected INCONCLUSIVE")
    else:
        lines += difference.compare_verdicts(truth["verify"], said["verify"])
    if independent and how["recomputable"]:
        again = recompute(traces, spec)
        open_subjects = {(r["id"], s["subject"]) for r in truth["verify"]["rules"]
                         for s in r["subjects"] if s["verdict"] == "*"}
        if any(rule in ("T2", "T3", "T4") for rule, _ in open_subjects):
            again["report"]["trace"].pop("complete")
        if "chains" not in truth["report"]:
            again["report"].pop("chains")
        known = {line.split(": ", 1)[-1] for line in lines}
        more = difference.compare_text(again["instances"], said["instances"], "instances.csv")
        if not how["weaker"]:
            more += [f"report: {x}" for x in difference.compare(again["report"], said["report"])]
            for rule in again["verify"]["rules"]:
                if any(rule["id"] == i for i, _ in open_subjects):
                    rule["verdict"] = "*"
            if open_subjects:
                again["verify"]["verdict"] = "*"
            more += difference.compare_verdicts(again["verify"], said["verify"], open_subjects)
        lines += [f"recomputed {x}" for x in more if x.split(": ", 1)[-1] not in known]
    return lines


def check_recording(cie: str, traces: list[str], spec: str | None) -> list[str]:
    """Differences of `cie` from the recomputation, on a recording of which nothing is known."""
    said, lines = answers(cie, traces, spec)
    again = recompute(traces, spec)
    lines += difference.compare_text(again["instances"], said["instances"], "instances.csv")
    lines += [f"report: {x}" for x in difference.compare(again["report"], said["report"])]
    lines += difference.compare_verdicts(again["verify"], said["verify"])
    return lines


def print_differences(name: str, lines: list[str], limit: int = 40) -> None:
    print(f"{name}: {len(lines)} difference(s)")
    for line in lines[:limit]:
        print(f"    {line}")
    if len(lines) > limit:
        print(f"    … {len(lines) - limit} more")
    sys.stdout.flush()
