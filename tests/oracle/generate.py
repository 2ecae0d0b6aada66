#!/usr/bin/env python3
"""Generates contract traces with known truth: trace, spec.yaml, instances.csv, report.json,
verify.json, as in the contract examples. Deterministic: same name and seed, same bytes."""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from oracle import scenarios  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where to write NAME-SEED/")
    parser.add_argument("scenario", nargs="*", help="default: all")
    parser.add_argument("--seeds", type=int, default=1, help="how many of each")
    parser.add_argument("--list", action="store_true", help="print the scenarios and stop")
    args = parser.parse_args()
    if args.list:
        print("\n".join(scenarios.ALL))
        return 0
    for name in args.scenario or scenarios.ALL:
        for seed in range(args.seeds):
            scenarios.generate(name, seed, args.folder / f"{name}-{seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
