"""Compares what two builds of cie decide of the same recordings: each verdict that differs, per rule and subject, and how
many are decided by each. For a change to how verdicts come about: nothing decided may become undecided unsaid.

    tests/compare_verdicts.py OLD/cie NEW/cie RECORDING-OR-FOLDER...

Exit status: 0 no verdict differs, 1 some do, 2 usage."""
import collections
import json
import pathlib
import subprocess
import sys

DECIDED = {"PASS", "FAIL"}


def recordings(folders):
    """Every folder below with traces of its own: what holds LTTng's ust or kernel, or metadata."""
    found = set()
    for folder in folders:
        for metadata in pathlib.Path(folder).rglob("metadata"):
            parts = metadata.parent.parts
            domain = next((i for i, part in enumerate(parts) if part in ("ust", "kernel")), len(parts))
            found.add(pathlib.Path(*parts[:domain]))
    return sorted(found)


def verdicts(cie, recording):
    """By rule, subject, index, and how many of these there were before."""
    done = subprocess.run([cie, "verify", "-f", "json", recording], capture_output=True, timeout=600, check=False)
    try:
        rules = json.loads(done.stdout)["rules"]
    except ValueError:
        return {("exit status",): str(done.returncode)}
    seen = collections.Counter()
    found = {}
    for rule in rules:
        for subject in rule["subjects"]:
            name = (rule["id"], subject["subject"], subject["index"])
            found[(*name, seen[name])] = subject["verdict"]
            seen[name] += 1
    return found


def main():
    if len(sys.argv) < 4:
        print(__doc__, file=sys.stderr)
        return 2
    old, new, *folders = sys.argv[1:]
    decided = [0, 0]
    differences = 0
    of = recordings(folders)
    for recording in of:
        before, after = verdicts(old, recording), verdicts(new, recording)
        decided[0] += sum(verdict in DECIDED for verdict in before.values())
        decided[1] += sum(verdict in DECIDED for verdict in after.values())
        for name in sorted(before.keys() | after.keys(), key=str):
            was, became = before.get(name, "not judged"), after.get(name, "not judged")
            if was != became:
                differences += 1
                print(f"{recording}: {name[0]} {' '.join(map(str, name[1:2]))}: {was} -> {became}")
    print(f"{len(of)} recordings, {differences} verdicts differ; decided: {decided[0]} before, {decided[1]} after")
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main())
