#!/usr/bin/env python3
"""Holds the recomputation against the contract examples and against the simulator's truth.

Two readings of the documents that agree are not proof, but one that disagrees with itself is none.
Needs babeltrace2, not cie.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from oracle import check, difference, scenarios  # noqa: E402


def differences(folder: Path) -> list[str]:
    how = check.how_to(folder)
    if not how["recomputable"]:
        return []
    got = check.recompute([str(folder / t) for t in how["traces"]],
                          str(folder / "spec.yaml"))
    truth = json.loads((folder / "verify.json").read_text())
    if how["weaker"]:
        lines = difference.compare_weaker(truth, got["verify"], how["flips"])
    else:
        lines = difference.compare_verdicts(truth, got["verify"])
    if how["numbers"]:
        lines += difference.compare(json.loads((folder / "report.json").read_text()), got["report"])
        lines += difference.compare_text((folder / "instances.csv").read_text(), got["instances"],
                                         "instances.csv")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("examples", type=Path)
    parser.add_argument("scenario", nargs="*", help="default: all")
    parser.add_argument("--seeds", type=int, default=1)
    args = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="cie-oracle-") as scratch:
        folders = sorted(p.parent for p in args.examples.glob("*/verify.json"))
        assert folders, f"no examples in {args.examples}"
        for name in args.scenario or scenarios.ALL:
            for seed in range(args.seeds):
                folders.append(Path(scratch) / f"{name}-{seed}")
                scenarios.generate(name, seed, folders[-1])
        for folder in folders:
            lines = differences(folder)
            if lines:
                wrong += 1
                check.print_differences(folder.name, lines)
    print(f"{len(folders)} traces, {wrong} differ")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
