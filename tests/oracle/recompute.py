#!/usr/bin/env python3
"""Recomputes what `cie instances`, `report` and `verify` must print, from babeltrace2's text.

An independent reading of the contract, the definitions and the rules: it shares nothing with the
program that it checks. Quantiles are exact.
"""

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from oracle.check import recompute  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trace", nargs="+")
    parser.add_argument("--spec", metavar="FILE", help="scheduling spec")
    parser.add_argument("--what", choices=("report", "instances", "verify"), default="report")
    args = parser.parse_args()
    answer = recompute(args.trace, args.spec)[args.what]
    if isinstance(answer, str):
        sys.stdout.write(answer)
    else:
        json.dump(answer, sys.stdout, indent=1)
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
