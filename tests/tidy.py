"""clang-tidy over the product's sources, as a tree of clang compiles them: many files at once.

    tidy.py BUILD_TREE [--jobs N] [--last N] [PART_OF_A_NAME…]

A unity file takes clang-tidy little longer than one of its dozen sources does. Needs what the tree generates (headers of
messages, the precompiled headers). Prints each finding once; exit code 1 if there is one. --last: only the N files whose
sources changed last, by git's log.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

FOLDERS = ("tracepoints", "executor", "analysis", "viewer_export")
FINDING = re.compile(r"^(/\S+?):(\d+):(\d+): (?:error|warning): (.*)$")
# A unity file is nothing but includes of sources.
WITHOUT = "-bugprone-suspicious-include"


def sources(tree):
    root = pathlib.Path(__file__).resolve().parent.parent
    wanted = [str(place / folder) + "/" for place in (root, tree) for folder in FOLDERS]
    with open(tree / "compile_commands.json") as commands:
        files = {entry["file"] for entry in json.load(commands)}
    left_out = re.compile(r"/header_check/|/cmake_pch\.|\.c$")
    return root, sorted(f for f in files if f.startswith(tuple(wanted)) and not left_out.search(f))


def included(file):
    """The sources that a unity file consists of; another file is its own."""
    if "/Unity/" not in file:
        return [file]
    return re.findall(r'^#include "(/[^"]+[.]cpp)"$', pathlib.Path(file).read_text("utf-8"), re.MULTILINE)


def changed_last(root, files, most):
    """The `most` of the files in which something changed last. A header stands for the sources beside it."""
    of_source, of_folder = {}, {}
    for file in files:
        for source in included(file):
            of_source[source] = file
            of_folder.setdefault(os.path.dirname(source), file)
    log = subprocess.run(["git", "-C", str(root), "log", "--name-only", "--format="], capture_output=True, text=True, check=True)
    chosen = []
    for name in log.stdout.split("\n"):
        path = str(root / name)
        file = of_source.get(path) or (of_folder.get(os.path.dirname(path)) if name.endswith(".hpp") else None)
        if file and file not in chosen:
            chosen.append(file)
    return chosen[:most]


def findings(root, tree, file):
    shown = f"{re.escape(str(root))}/({'|'.join(FOLDERS)})/.*[.][ch]pp$"
    command = ["clang-tidy", "--quiet", "-p", str(tree), f"--header-filter={shown}", f"--checks={WITHOUT}",
               "--extra-arg=-Wno-unknown-warning-option", file]
    run = subprocess.run(command, capture_output=True, text=True)
    found = [FINDING.match(line) for line in run.stdout.splitlines()]
    texts = [f"{os.path.relpath(m[1], root)}:{m[2]}:{m[3]}: {m[4]}" for m in found if m]
    if run.returncode and not texts:
        texts = [f"{file}: clang-tidy failed: {(run.stderr.strip() or run.stdout.strip())[-500:]}"]
    return texts


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("tree", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--last", type=int, metavar="N")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    root, files = sources(options.tree)
    files = [f for f in files if not options.names or any(name in f for name in options.names)]
    if options.last is not None:
        files = changed_last(root, files, options.last)
    if not files:
        sys.exit(f"tidy: {options.tree} compiles none of these sources")
    printed = set()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for texts in pool.map(lambda file: findings(root, options.tree, file), files):
            for text in texts:
                if text not in printed:
                    print(text, flush=True)
                printed.add(text)
    print(f"tidy: {len(files)} translation units, {len(printed)} findings", file=sys.stderr)
    return 1 if printed else 0


if __name__ == "__main__":
    sys.exit(main())
