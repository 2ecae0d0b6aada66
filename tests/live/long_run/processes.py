"""Memory, processor time, descriptors and threads of processes and of what they started."""

import os
from pathlib import Path

TICK = os.sysconf("SC_CLK_TCK")
MEMORY = {"VmRSS": "rss", "RssAnon": "anon", "RssShmem": "shared", "Threads": "threads"}


def children_of(pid):
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        found += [int(child) for child in (task / "children").read_text().split()]
    return found


def tree_of(roots):
    """Every process below those of `roots` (name: pid), by a name that says what it is. Those that come and go are
    left out, as are the workers of stress-ng."""
    tree = {}
    for name, pid in roots.items():
        try:
            tree[name] = pid
            if name != "stress-ng":
                add_below(tree, name, pid)
        except OSError:
            continue
    return {name: pid for name, pid in tree.items() if name != "stress-ng"}


def add_below(tree, name, pid):
    for child in children_of(pid):
        program = Path(f"/proc/{child}/comm").read_text().strip()
        if program == "lttng-sessiond":
            continue  # sampled as such, whoever started it
        label = f"{name}: {program}"
        while label in tree:
            label += "'"
        tree[label] = child
        add_below(tree, name, child)


def sample_of(tree):
    samples = {}
    for name, pid in tree.items():
        try:
            samples[name] = one(pid)
        except (OSError, IndexError, ValueError):
            continue  # it ended meanwhile
    return samples


def one(pid):
    facts = {"pid": pid}
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        key, _, value = line.partition(":")
        if key in MEMORY:
            facts[MEMORY[key]] = int(value.split()[0])  # KiB, or a number
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    facts["cpu"] = (int(fields[11]) + int(fields[12])) / TICK
    facts["descriptors"] = len(list(Path(f"/proc/{pid}/fd").iterdir()))
    return facts
