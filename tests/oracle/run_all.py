#!/usr/bin/env python3
"""Generates every scenario with several seeds and compares `cie` with the truth of each."""

import argparse
import sys
import tempfile
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from oracle import check, scenarios  # noqa: E402


def read_known(path: Path) -> dict[str, str]:
    lines = [line.strip() for line in path.read_text().splitlines()]
    pairs = (line.split(":", 1) for line in lines if line and not line.startswith("#"))
    return {name.strip(): reason.strip() for name, reason in pairs}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cie", help="the cie program")
    parser.add_argument("scenario", nargs="*", help="default: all")
    parser.add_argument("--seeds", type=int, default=1, help="of each scenario (default 1)")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, metavar="DIR", help="leave the traces there")
    parser.add_argument("--no-recompute", action="store_true",
                        help="hold against the simulator's truth only")
    parser.add_argument("--known", type=Path, metavar="FILE",
                        help="scenarios that may differ, one `name: reason` a line")
    parser.add_argument("--verbose", action="store_true", help="print what agrees as well")
    args = parser.parse_args()
    known = read_known(args.known) if args.known else {}
    began, wrong, done, excused = time.monotonic(), 0, 0, 0
    differing: set[str] = set()
    with tempfile.TemporaryDirectory(prefix="cie-oracle-") as scratch:
        root = args.keep or Path(scratch)
        for name in args.scenario or scenarios.ALL:
            for seed in range(args.first_seed, args.first_seed + args.seeds):
                folder = root / f"{name}-{seed}"
                try:
                    scenarios.generate(name, seed, folder)
                    lines = check.check(args.cie, folder, independent=not args.no_recompute)
                except Exception:  # a broken scenario must not hide the others
                    lines = traceback.format_exc(limit=-3).splitlines()
                done += 1
                if lines:
                    differing.add(name)
                if lines and name in known:
                    excused += 1
                    print(f"{name} {seed}: {len(lines)} difference(s), known: {known[name]}")
                elif lines:
                    wrong += 1
                    check.print_differences(f"{name} {seed}", lines)
                elif args.verbose:
                    print(f"{name} {seed}: ok")
    for name in sorted((known.keys() & set(args.scenario or scenarios.ALL)) - differing):
        print(f"{name}: listed in {args.known.name}, yet nothing differs any more: take it out")
    print(f"{done} traces, {wrong} differ, {excused} differ as known, "
          f"{time.monotonic() - began:.1f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
