#!/usr/bin/env python3
"""What recording costs the application that is recorded: the time from publish to callback and the CPU time per
message of the paper's experiment, with all events on and without, in turns on the same machine.

    ./run bench tracing [--rounds 7] [--seconds 5] [-n 8] [--policy fifo]

The figures of a round are compared with those of the round's untraced run, because machines drift; printed are
medians over the rounds. CPU time is the application's: the session's daemons work besides, at low priority."""

import argparse
import csv
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

GOAL = 3.0  # per cent, of the p99


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("-n", "--pairs", type=int, default=8)
    parser.add_argument("--policy", choices=("fifo", "other"), default="fifo")
    parser.add_argument("--period", type=int, default=10, help="milliseconds")
    return parser.parse_args()


def experiment(options, path, table):
    return [options.programs / "cie-bench-executors", "--executors", "isolated", "--paths", path, "--phases",
            "staggered", "--policies", options.policy, "-n", options.pairs, "--seconds", options.seconds, "--period",
            options.period, "--csv", table]


def run(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False,
                          env=os.environ | {"LC_ALL": "C"})
    if done.returncode != 0:
        sys.exit(f"bench: {command[0]} failed:\n{done.stderr}")


def measure(options, path, is_traced, folder):
    """One run: its row of the experiment's table, and what LTTng discarded."""
    table = folder / "row.csv"
    recording = folder / "recording"
    command = experiment(options, path, table)
    if is_traced:
        command = [options.programs / "cie", "record", "--kernel", "no", "-o", recording, "--", *command]
    run(command)
    with open(table, encoding="utf-8") as file:
        row = next(csv.DictReader(file))
    lost = 0
    if is_traced:
        manifest = json.loads((recording / "manifest.json").read_text())
        lost = sum(channel["discarded_events"] for channel in manifest["channels"])
        shutil.rmtree(recording)
    return {"p50": float(row["latency_p50_us"]), "p99": float(row["latency_p99_us"]),
            "cpu": float(row["cpu_ns"]) / 1000 / float(row["messages"])}, lost


def compare(options, path, folder):
    plain, traced, lost = [], [], 0
    for number in range(options.rounds):
        order = (False, True) if number % 2 == 0 else (True, False)
        for is_traced in order:
            row, discarded = measure(options, path, is_traced, folder)
            (traced if is_traced else plain).append(row)
            lost += discarded
    changes = {}
    for name, label in (("p50", "publish to callback, p50 us"), ("p99", "publish to callback, p99 us"),
                        ("cpu", "CPU time per message, us")):
        changes[name] = statistics.median(100 * (b[name] / a[name] - 1) for a, b in zip(plain, traced))
        noise = max(row[name] for row in plain) / min(row[name] for row in plain) - 1
        print(f"{path:<6} {label:<29} {statistics.median(r[name] for r in plain):>9.2f} "
              f"{statistics.median(r[name] for r in traced):>9.2f} {changes[name]:>+8.1f} % "
              f"{100 * noise:>8.1f} %")
    print(f"{path:<6} events lost {lost}; goal for the p99: less than {GOAL:+.0f} %: "
          f"{'met' if changes['p99'] < GOAL else 'MISSED'}")


def main():
    options = parse()
    if options.rounds < 1:
        sys.exit("bench: at least one round")
    print(f"{options.rounds} rounds of {options.seconds:g} s, {options.pairs} timers and subscriptions every "
          f"{options.period} ms, {options.policy}")
    print(f"{'path':<6} {'':<29} {'untraced':>9} {'recorded':>9} {'change':>10} {'untraced':>10}\n"
          f"{'':<6} {'':<29} {'':>9} {'':>9} {'':>10} {'varies by':>10}")
    with tempfile.TemporaryDirectory(prefix="cie-bench-") as folder:
        for path in ("intra", "inter"):
            compare(options, path, Path(folder))


if __name__ == "__main__":
    main()
