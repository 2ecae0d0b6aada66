#!/usr/bin/env python3
"""Compares `cie instances`, `report` and `verify` with expected files and with the recomputation.

EXPECTED_DIR holds spec.yaml, instances.csv, report.json and verify.json. Without it the traces are
any recordings, held against the recomputation alone. Exits with 1 on any difference, which is
printed.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from oracle import check  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cie", help="the cie program")
    parser.add_argument("trace", type=Path)
    parser.add_argument("expected", type=Path, nargs="?", metavar="EXPECTED_DIR")
    parser.add_argument("--spec", help="scheduling spec, where there is no EXPECTED_DIR")
    parser.add_argument("--no-recompute", action="store_true",
                        help="hold against the expected files only")
    args = parser.parse_args()
    if args.expected:
        lines = check.check(args.cie, args.expected, args.trace, not args.no_recompute)
    else:
        lines = check.check_recording(args.cie, [str(args.trace)], args.spec)
    if lines:
        check.print_differences(str(args.trace), lines)
        return 1
    print(f"{args.trace}: no difference")
    return 0


if __name__ == "__main__":
    sys.exit(main())
