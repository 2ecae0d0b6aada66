"""clang-tidy over the product's sources, as a tree of clang compiles them: many files at once.

    tidy.py BUILD_TREE [--jobs N] [PART_OF_A_NAME…]

Half of clang-tidy's time goes to the headers of each translation unit, so it reads several unity files of one target as
one. Needs what the tree generates (headers of messages, the precompiled headers). Prints each finding once; exit code 1 if
there is one.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

FOLDERS = ("tracepoints", "executor", "analysis", "viewer_export")
FINDING = re.compile(r"^(/\S+?):(\d+):(\d+): (?:error|warning): (.*)$")
# Files that include sources, and nothing else, are what is read here.
WITHOUT = "-bugprone-suspicious-include"
AT_ONCE = 5  # unity files: a dozen sources each, some 40 s and 1.3 GB


def sources(entry):
    """What it compiles: a file, or those that a unity file includes."""
    file = pathlib.Path(entry["file"])
    if file.parent.name != "Unity":
        return [entry["file"]]
    return re.findall(r'^#include "(.*)"$', file.read_text("utf-8"), re.MULTILINE)


def entries(root, tree):
    """Of the compilation database: those of the product's sources, some of which targets of tests compile."""
    wanted = tuple(str(place / folder) + "/" for place in (root, tree) for folder in FOLDERS)
    left_out = re.compile(r"/header_check/|/cmake_pch\.|\.c$")
    database = json.loads((tree / "compile_commands.json").read_text("utf-8"))
    return [entry for entry in database if not left_out.search(entry["file"])
            and any(source.startswith(wanted) for source in sources(entry))]


def named(compiled, names):
    """The entries of sources whose path has one of the names in it, also if a unity file includes them; all, if there is none."""
    return [entry for entry in compiled
            if not names or any(name in source for name in names for source in sources(entry))]


def groups(compiled):
    """Lists of entries that can be read as one: unity files that are compiled alike. The largest come first."""
    alike = {}
    for entry in compiled:
        command = re.sub(r" -o \S+ -c \S+$", "", entry["command"])
        alike.setdefault(command if "/Unity/" in entry["file"] else entry["file"], []).append(entry)
    parts = []
    for members in alike.values():
        count = -(-len(members) // AT_ONCE)
        size = -(-len(members) // count)
        parts += [members[at:at + size] for at in range(0, len(members), size)]
    return sorted(parts, key=len, reverse=True)


def findings(root, members):
    """What clang-tidy says of the members as one file, or of each by itself if they do not compile together: names may be
    the same, and a header's macros in another's way."""
    texts = read_as_one(root, members)
    if len(members) > 1 and any("clang-diagnostic-error" in text for text in texts):
        return [text for member in members for text in read_as_one(root, [member])]
    return texts


def read_as_one(root, members):
    shown = f"{re.escape(str(root))}/({'|'.join(FOLDERS)})/.*[.][ch]pp$"
    with tempfile.TemporaryDirectory() as place:
        unit = pathlib.Path(place, "unit.cxx")
        unit.write_text("".join(f'#include "{entry["file"]}"\n' for entry in members), "utf-8")
        first = members[0]
        database = [{"directory": first["directory"], "file": str(unit), "command": first["command"].replace(first["file"], str(unit))}]
        pathlib.Path(place, "compile_commands.json").write_text(json.dumps(database), "utf-8")
        command = ["clang-tidy", "--quiet", "-p", place, f"--config-file={root / '.clang-tidy'}", f"--header-filter={shown}",
                   f"--checks={WITHOUT}", "--extra-arg=-Wno-unknown-warning-option", str(unit)]
        run = subprocess.run(command, capture_output=True, text=True)
    found = [FINDING.match(line) for line in run.stdout.splitlines()]
    texts = [f"{os.path.relpath(m[1], root)}:{m[2]}:{m[3]}: {m[4]}" for m in found if m]
    if run.returncode and not texts:
        texts = [f"{first['file']}: clang-tidy failed: {(run.stderr.strip() or run.stdout.strip())[-500:]}"]
    return texts


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("tree", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("names", nargs="*")
    options = parser.parse_intermixed_args()
    root = pathlib.Path(__file__).resolve().parent.parent
    compiled = named(entries(root, options.tree), options.names)
    if not compiled:
        sys.exit(f"tidy: {options.tree} compiles none of these sources")
    printed = set()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for texts in pool.map(lambda members: findings(root, members), groups(compiled)):
            for text in texts:
                if text not in printed:
                    print(text, flush=True)
                printed.add(text)
    print(f"tidy: {len(compiled)} compiled files, {len(printed)} findings", file=sys.stderr)
    return 1 if printed else 0


if __name__ == "__main__":
    sys.exit(main())
