#!/usr/bin/env python3
"""Recordings as disks, crashes and people leave them: bits flipped, regions zeroed, repeated or cut
away, files missing, metadata (of CTF 1.8 and 2) edited. On none of them may cie die of a signal, hang, tell an instance
that was not recorded, or find a rule kept that is not kept (or not provable) in the whole recording.

CTF has no checksums: a flipped bit or edited metadata may turn one good event into another. Such
damage is held to everything but the comparison of instances and single rules.

Usage: damaged_traces.py CIE TRACE... [--traces N] [--seed S] [--jobs N] [--keep DIR]"""
import argparse
import concurrent.futures
import csv
import io
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
from cie import verdicts_of  # noqa: E402
from ctf2_of_tsdl import convert  # noqa: E402

TIMEOUT = 60  # seconds; cie itself gives up earlier
PACKET_MAGIC = b"\xc1\x1f\xfc\xc1"


class Failure(Exception):
    pass


# --- damage: each returns what it did, and whether what remains are events as they were recorded ---

def stream_files(folder):
    return sorted(f for f in folder.rglob("*") if f.is_file() and f.name != "metadata"
                  and f.stat().st_size > 0 and "index" not in f.parts)


def change(rng, folder):
    """A stream file, its bytes, and a region of it."""
    file = rng.choice(stream_files(folder))
    data = bytearray(file.read_bytes())
    begin = rng.randrange(len(data))
    length = min(len(data) - begin, rng.choice([1, 4, 16, 100, 1000, 4096, 100_000]))
    return file, data, begin, length


def flip_bits(rng, folder):
    file, data, _, _ = change(rng, folder)
    places = [rng.randrange(len(data) * 8) for _ in range(rng.choice([1, 1, 3, 20]))]
    for bit in places:
        data[bit // 8] ^= 1 << bit % 8
    file.write_bytes(data)
    return f"flipped bits {places} of {file.name}", False


def zero_region(rng, folder):
    file, data, begin, length = change(rng, folder)
    data[begin:begin + length] = bytes(length)
    file.write_bytes(data)
    return f"zeroed {length} bytes at {begin} of {file.name}", False


def zero_packets(rng, folder):
    file, data, _, _ = change(rng, folder)
    begin = rng.choice([m.start() for m in re.finditer(re.escape(PACKET_MAGIC), data)] or [0])
    end = data.find(PACKET_MAGIC, begin + 4)
    end = len(data) if end < 0 else end
    data[begin:end] = bytes(end - begin)
    file.write_bytes(data)
    return f"zeroed the packet at {begin} of {file.name}", True


def repeat_region(rng, folder):
    file, data, begin, length = change(rng, folder)
    data[begin:begin] = data[begin:begin + length]
    file.write_bytes(data)
    return f"repeated {length} bytes at {begin} of {file.name}", False


def repeat_packet(rng, folder):
    file, data, _, _ = change(rng, folder)
    begin = rng.choice([m.start() for m in re.finditer(re.escape(PACKET_MAGIC), data)] or [0])
    end = data.find(PACKET_MAGIC, begin + 4)
    end = len(data) if end < 0 else end
    at = rng.choice([end, len(data)])
    data[at:at] = data[begin:end]
    file.write_bytes(data)
    return f"repeated the packet at {begin} of {file.name} at {at}", True


def cut_end(rng, folder):
    file, data, begin, _ = change(rng, folder)
    file.write_bytes(data[:begin])
    return f"cut {file.name} at {begin} of {len(data)}", True


def cut_out(rng, folder):
    file, data, begin, length = change(rng, folder)
    del data[begin:begin + length]
    file.write_bytes(data)
    return f"cut {length} bytes at {begin} out of {file.name}", False


def overwrite(rng, folder):
    file, data, begin, length = change(rng, folder)
    data[begin:begin + length] = rng.randbytes(length)
    file.write_bytes(data)
    return f"overwrote {length} bytes at {begin} of {file.name}", False


def swap_files(rng, folder):
    files = stream_files(folder)
    a, b = rng.choice(files), rng.choice(files)
    one, other = a.read_bytes(), b.read_bytes()
    a.write_bytes(other)
    b.write_bytes(one)
    return f"swapped {a.name} and {b.name}", a.parent == b.parent


def remove_file(rng, folder):
    file = rng.choice(stream_files(folder))
    file.unlink()
    return f"removed {file.relative_to(folder)}", True


def empty_file(rng, folder):
    file = rng.choice(stream_files(folder))
    file.write_bytes(b"")
    return f"emptied {file.relative_to(folder)}", True


def metadata_of(rng, folder):
    file = rng.choice(sorted(folder.rglob("metadata")))
    return file, bytearray(file.read_bytes())


def cut_metadata(rng, folder):
    file, data = metadata_of(rng, folder)
    at = rng.choice([0, rng.randrange(len(data))])
    file.write_bytes(data[:at])
    return f"cut {file.relative_to(folder)} at {at}", False


def remove_metadata(rng, folder):
    file, _ = metadata_of(rng, folder)
    file.unlink()
    return f"removed {file.relative_to(folder)}", False


def flip_metadata(rng, folder):
    file, data = metadata_of(rng, folder)
    bit = rng.randrange(len(data) * 8)
    data[bit // 8] ^= 1 << bit % 8
    file.write_bytes(data)
    return f"flipped bit {bit} of {file.relative_to(folder)}", False


def edit_metadata(rng, folder):
    file, data = metadata_of(rng, folder)
    words = list(re.finditer(rb"\b(?:size = \d+|align = \d+|id = \d+|signed = \d|cie:\w+|_\w+|uuid|stream_id"
                             rb"|struct|integer|string|:=|[{};])", data))
    words += re.finditer(rb'("length": \d+|"alignment": \d+|"id": \d+|"roles": \["[a-z-]+"\]|"path"|"type": "[a-z-]+"'
                         rb'|null|\[\[\d+, \d+\]\]|\x1e|"name": "\w+")', data)
    if not words:  # an earlier damage left too little of it
        return flip_metadata(rng, folder)
    word, other = rng.choice(words), rng.choice(words)
    new = rng.choice([b"", other.group(), b"size = 64", b"size = 7", b"align = 1", b"id = 3"])
    # Same length, as packets of metadata count their bytes.
    new = new[:len(word.group())].ljust(len(word.group()))
    data[word.start():word.end()] = new
    file.write_bytes(data)
    return (f"edited {file.relative_to(folder)} at {word.start()}: "
            f"{word.group().decode()} to {new.decode()}"), False


DAMAGES = [flip_bits, flip_bits, zero_region, zero_packets, repeat_region, repeat_packet, cut_end, cut_end,
           cut_out, overwrite, swap_files, remove_file, empty_file, cut_metadata, remove_metadata,
           flip_metadata, edit_metadata, edit_metadata]


# --- what cie says ---

def run(cie, *arguments):
    try:
        done = subprocess.run([cie, *arguments], capture_output=True, timeout=TIMEOUT, check=False)
    except subprocess.TimeoutExpired as hung:
        raise Failure(f"cie {arguments[0]} hung") from hung
    if done.returncode not in (0, 1, 3, 4):
        raise Failure(f"cie {arguments[0]} ended with {done.returncode}: {done.stderr[-500:]!r}")
    if b"signal" in done.stderr or b"ended by" in done.stderr:
        raise Failure(f"cie {arguments[0]}: {done.stderr[-500:]!r}")
    return done.returncode, done.stdout.decode(errors="replace")


def judgement_of(cie, trace):
    code, text = run(cie, "verify", str(trace), "-f", "json")
    if code == 4:
        return None
    told = json.loads(text)
    rules = {}
    for rule in told["rules"]:
        for subject in rule["subjects"]:
            rules[rule["id"], subject["subject"]] = subject["verdict"]
    return told["verdict"], verdicts_of(told), rules


def instances_of(cie, trace):
    code, text = run(cie, "instances", str(trace), "-f", "csv")
    if code == 4:
        return set()
    return {(r["pid"], r["tid"], r["seq"], r["start_ns"], r["end_ns"])
            for r in csv.DictReader(io.StringIO(text)) if r["end_ns"]}


def check(cie, original, seed, keep):
    rng = random.Random(seed)
    trace, whole, as_ctf2 = original
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "trace"
        shutil.copytree(trace, folder)
        done = []
        if rng.random() < 0.3:
            done.append("metadata as CTF 2")
            for name, data in as_ctf2.items():
                (folder / name).write_bytes(data)
        is_faithful = True
        for _ in range(rng.choice([1, 1, 1, 2, 3])):
            if not stream_files(folder) or not list(folder.rglob("metadata")):
                break
            files = sorted(folder.rglob("metadata"))
            if any(f.stat().st_size == 0 for f in files):
                break
            what, faithful = rng.choice(DAMAGES)(rng, folder)
            done.append(what)
            is_faithful = is_faithful and faithful
        try:
            compare(cie, folder, whole, is_faithful)
        except Failure as failure:
            if keep:
                shutil.copytree(folder, Path(keep) / str(seed), dirs_exist_ok=True)
            return f"seed {seed} of {trace}: {failure}\n  after: " + "; ".join(done)
    return None


def compare(cie, folder, whole, is_faithful):
    verdicts, instances = whole
    now = judgement_of(cie, folder)
    if now is None:
        return
    if now[0] == "PASS" and verdicts[0] != "PASS":
        raise Failure(f"PASS, but the whole recording is {verdicts[0]}")
    if not is_faithful:
        return
    for rule, verdict in now[1].items():
        if verdict == "PASS" and verdicts[1][rule] in ("FAIL", "INCONCLUSIVE"):
            raise Failure(f"{rule} PASS, but {verdicts[1][rule]} in the whole recording")
    for subject, verdict in now[2].items():
        if verdict == "PASS" and verdicts[2].get(subject) in ("FAIL", "INCONCLUSIVE"):
            raise Failure(f"{subject} PASS, but {verdicts[2][subject]} in the whole recording")
    # Where nothing is numbered, a run's number is its place among those seen, and an end that was
    # lost unnoticed leaves its start to a later end: then starts are compared.
    is_numbered = verdicts[1]["T3"] == "PASS"
    seen = instances_of(cie, folder)
    if not is_numbered:
        seen = {(pid, tid, start) for pid, tid, _, start, _ in seen}
        instances = {(pid, tid, start) for pid, tid, _, start, _ in instances}
    invented = seen - instances
    if invented:
        raise Failure(f"instances that were not recorded: {sorted(invented)[:3]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cie")
    parser.add_argument("recordings", nargs="+", metavar="TRACE")
    parser.add_argument("--traces", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep")
    options = parser.parse_args()
    originals = [(trace, (judgement_of(options.cie, trace), instances_of(options.cie, trace)),
                  {file.relative_to(trace): convert(file.read_bytes()) for file in Path(trace).rglob("metadata")})
                 for trace in options.recordings]
    for trace, (verdicts, instances), _ in originals:
        if verdicts is None or not instances:
            sys.exit(f"{trace} is no recording with instances")
    failures = []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        jobs = [pool.submit(check, options.cie, originals[i % len(originals)], options.seed + i,
                            options.keep) for i in range(options.traces)]
        for number, job in enumerate(jobs, 1):
            failure = job.result()
            if failure:
                failures.append(failure)
                print(failure, flush=True)
            if number % 1000 == 0:
                print(f"{number} damaged traces, {len(failures)} failures", flush=True)
    print(f"{options.traces} damaged traces, {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
