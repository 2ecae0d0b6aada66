#!/usr/bin/env python3
"""A long run: the Autoware reference system under load, with a flight recorder, a recording in chunks and cie live
attached at once, all through one session daemon of their own.

    ./run longrun [DURATION]          e.g. 90s, 30m, 2h (default 2h)
    tests/live/long_run/long_run.py --summarise DIR

What must hold, and is counted by another reader (babeltrace2) and by the application itself: every event emitted is
recorded, or told as discarded, or was overwritten where a flight recorder overwrites; memory, descriptors and threads
of everybody who takes part are flat; no process ends early; no rule of the mapping is violated, in any chunk or
snapshot. Samples, chunks and snapshots are written down as they come (DIR/log.jsonl), so that a run that was cut
short can be summarised. Exit status: 0 everything held, 1 something did not."""

import argparse
import ctypes
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402  pylint: disable=wrong-import-position
from cie import verdicts_of  # noqa: E402  pylint: disable=wrong-import-position
from recording import manifest_of  # noqa: E402  pylint: disable=wrong-import-position
from events import Counts, Snapshot  # noqa: E402  pylint: disable=wrong-import-position
from processes import sample_of, tree_of  # noqa: E402  pylint: disable=wrong-import-position
from summary import summarise  # noqa: E402  pylint: disable=wrong-import-position

UNITS = {"s": 1, "m": 60, "h": 3600}


def duration(text):
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([smh])", text)
    if not match:
        raise argparse.ArgumentTypeError(f'"{text}" is no duration: 90s, 30m, 2h')
    return float(match[1]) * UNITS[match[2]]


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", type=Path, help="directory of cie, cie-record and cie-autoware-reference")
    parser.add_argument("--duration", type=duration, default=duration("2h"))
    parser.add_argument("--output", type=Path, help="what is recorded and measured; default: kept only if a law is broken")
    parser.add_argument("--load", type=float, default=0.05, help="of the reference system, 1: as published")
    parser.add_argument("--stress", type=float, default=15, help="per cent of each CPU that stress-ng takes; 0: none")
    parser.add_argument("--sample", type=duration, default=duration("10s"), help="time between samples of memory")
    parser.add_argument("--chunk", type=duration, default=duration("60s"), help="length of a chunk")
    parser.add_argument("--save", type=duration, default=duration("300s"), help="time between snapshots on command")
    parser.add_argument("--summarise", type=Path, metavar="DIR", help="of a run that is over, or goes on")
    options = parser.parse_args()
    if not options.summarise and not options.programs:
        parser.error("--programs is missing")
    return options


def die_with_parent():
    """In a child: a long run that is killed leaves nobody behind."""
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG


class Log:
    """What happened, one JSON object per line."""

    def __init__(self, path):
        self.began = time.monotonic()
        self.file = open(path, "a", encoding="utf-8")  # pylint: disable=consider-using-with
        self.lock = threading.Lock()

    def add(self, kind, **facts):
        with self.lock:
            self.file.write(json.dumps({"kind": kind, "at": round(time.monotonic() - self.began, 3), **facts}) + "\n")
            self.file.flush()


class LongRun:
    def __init__(self, options, folder):
        self.options = options
        self.folder = folder
        self.cie = options.programs / "cie"
        self.log = Log(folder / "log.jsonl")
        self.started = {}
        self.recorded = Counts()
        self.done_chunks = set()
        self.is_stopping = threading.Event()

    # --- who takes part -----------------------------------------------------------------------------------------

    def start(self, name, *command, nice=0, **kwargs):
        def prepare():
            die_with_parent()
            os.nice(nice)

        log = open(self.folder / f"{name}.txt", "wb")  # pylint: disable=consider-using-with
        kwargs.setdefault("stdout", log)
        process = subprocess.Popen([str(part) for part in command], stderr=log, stdin=subprocess.DEVNULL,  # pylint: disable=consider-using-with,subprocess-popen-preexec-fn
                                   preexec_fn=prepare, **kwargs)
        self.started[name] = process
        return process

    def said(self, name):
        return (self.folder / f"{name}.txt").read_text(errors="replace")[-2000:]

    def sessions(self):
        done = subprocess.run(["lttng", "--no-sessiond", "list"], capture_output=True, text=True, check=False, timeout=60)
        return done.stdout.count("[active")

    def wait_for_session(self, number, name):
        wait_for(lambda: self.sessions() >= number or self.started[name].poll() is not None, f"{name} traces")
        if self.started[name].poll() is not None:
            raise AssertionError(f"{name} ended: {self.said(name)}")

    def begin(self):
        options = self.options
        self.start("flight recorder", self.cie, "record", "--attach", "--snapshot", "10", "--event-rate", "5000", "-o",
                   self.folder / "snapshots")
        self.wait_for_session(1, "flight recorder")
        self.start("chunk recorder", self.cie, "record", "--attach", "--rotate", options.chunk, "-o",
                   self.folder / "chunks")
        self.wait_for_session(2, "chunk recorder")
        live = self.start("live", self.cie, "live", "--json", "--interval", min(5, options.sample),
                          stdout=subprocess.PIPE, text=True)
        self.live = LiveLines(live.stdout)
        self.wait_for_session(3, "live")
        self.start("application", options.programs / "cie-autoware-reference", "--executor", "isolated", "--duration",
                   options.duration, "--load", options.load,
                   env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"})
        if options.stress > 0:
            self.start("stress-ng", "stress-ng", "--cpu", 0, "--cpu-load", options.stress, "--timeout",
                       int(options.duration) + 600, nice=10)
        self.log.add("begin", duration=options.duration, load=options.load, stress=options.stress,
                     sample=options.sample, chunk=options.chunk, save=options.save, cpus=os.cpu_count(),
                     kernel=os.uname().release)

    # --- while it runs ------------------------------------------------------------------------------------------

    def sample(self):
        daemon = Path("/run/lttng/lttng-sessiond.pid") if os.geteuid() == 0 else Path.home() / ".lttng/lttng-sessiond.pid"
        roots = {name: process.pid for name, process in self.started.items()}
        roots["session daemon"] = int(daemon.read_text())
        self.log.add("sample", processes=sample_of(tree_of(roots)), disk=usage_of(self.folder),
                     live=self.live.summary())

    def read_chunks(self):
        """Counts what is in chunks that are complete, and has them judged."""
        for chunk in sorted((self.folder / "chunks").glob("chunk-*")):
            if chunk.name in self.done_chunks:
                continue
            self.done_chunks.add(chunk.name)
            counts = Counts.of(chunk)
            self.recorded.add(counts)
            manifest = manifest_of(chunk)
            self.log.add("chunk", name=chunk.name, events=counts.total(),
                         starts=counts.by_kind["callback_start"], size=usage_of(chunk),
                         discarded=discarded_in(manifest), problems=manifest["problems"], verdicts=self.verdicts(chunk))

    def save(self):
        done = subprocess.run([self.cie, "record", "--save", self.folder / "snapshots"], capture_output=True, text=True,
                              check=False, timeout=120)
        if done.returncode != 0:
            self.log.add("failure", what="a snapshot could not be saved", why=done.stderr)
            return None
        directory = Path(done.stdout.strip())
        snapshot = Snapshot(directory)
        held = manifest_of(directory)["snapshot"]["held_ns"]
        self.log.add("snapshot", name=directory.name, events=snapshot.events, held=held / 1e9, holes=snapshot.holes, ragged=snapshot.ragged,
                     size=usage_of(directory), verdicts=self.verdicts(directory))
        return snapshot

    def verdicts(self, trace):
        done = subprocess.run([self.cie, "verify", trace, "-f", "json"], capture_output=True, text=True, check=False,
                              timeout=600)
        try:
            return verdicts_of(json.loads(done.stdout))
        except ValueError:
            return {"unreadable": "FAIL", "because": done.stderr[-500:]}

    def run(self):
        self.begin()
        options = self.options
        next_sample = next_chunk = time.monotonic()
        next_save = time.monotonic() + min(options.save, options.duration / 2)
        while self.started["application"].poll() is None and not self.is_stopping.is_set():
            now = time.monotonic()
            if now >= next_sample:
                next_sample = now + options.sample
                self.sample()
            if now >= next_chunk:
                next_chunk = now + options.chunk / 2
                self.read_chunks()
            if now >= next_save:
                next_save = now + options.save
                self.save()
            for name, process in self.started.items():
                if process.poll() is not None and name != "application":
                    self.log.add("failure", what=f"{name} ended", why=self.said(name))
                    self.is_stopping.set()
            self.is_stopping.wait(min(0.5, options.sample))
        self.end()

    # --- the end ------------------------------------------------------------------------------------------------

    def stop(self, name, number=signal.SIGTERM):
        process = self.started[name]
        if process.poll() is None:
            process.send_signal(number)
        try:
            return process.wait(timeout=120)
        except subprocess.TimeoutExpired:
            self.log.add("failure", what=f"{name} does not end")
            process.kill()
            return process.wait()

    def end(self):
        status = self.stop("application")
        if status != 0:
            self.log.add("failure", what=f"the application ended with {status}", why=self.said("application"))
        if "stress-ng" in self.started:
            self.stop("stress-ng")
        # Every route has seen the application's end before it is asked.
        deadline = time.monotonic() + 60
        while not self.live.has_ended() and time.monotonic() < deadline:
            time.sleep(0.1)
        last = self.save()
        self.stop("live", signal.SIGINT)
        self.live.join()
        for name in ("chunk recorder", "flight recorder"):
            if self.stop(name) != 0:
                self.log.add("failure", what=f"{name} failed", why=self.said(name))
        self.read_chunks()
        whole = self.folder / "chunks"
        manifest = manifest_of(whole)
        self.log.add("end", emitted=self.recorded.emitted, recorded=self.recorded.by_object(),
                     by_kind=self.recorded.by_kind, discarded=discarded_in(manifest),
                     last_snapshot=last.reached if last else None, live=self.live.totals(),
                     live_lost=self.live.lost(), verdicts=self.verdicts(whole))


def discarded_in(manifest):
    return {channel["name"]: channel["discarded_events"] for channel in manifest["channels"]}


def usage_of(folder):
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink())


class LiveLines(threading.Thread):
    """What cie live says, as it comes."""

    def __init__(self, stream):
        super().__init__(daemon=True)
        self.stream = stream
        self.last = {}
        self.instances = {}  # by callback, the most that was told
        self.all_ended = False
        self.violations = set()
        self.lines = 0
        self.start()

    def run(self):
        for text in self.stream:
            line = json.loads(text)
            self.lines += 1
            self.violations |= {verdict["rule"] for verdict in line["verdicts"] if verdict["verdict"] == "FAIL"}
            for callback in line["callbacks"]:
                name = callback["logical_id"]
                self.instances[name] = max(self.instances.get(name, 0), callback["total"]["instances"])
            self.all_ended = bool(line["callbacks"]) and all(callback["ended"] for callback in line["callbacks"])
            if line["events"] > 0:
                self.last = line

    def has_ended(self):
        return self.all_ended

    def summary(self):
        return {"lines": self.lines, "events": self.last.get("events"), "lost_events": self.last.get("lost_events"),
                "lost_packets": self.last.get("lost_packets"), "delay_ns": self.last.get("delay_ns"),
                "violations": sorted(self.violations)}

    def totals(self):
        return dict(self.instances)

    def lost(self):
        return {"events": self.last.get("lost_events"), "packets": self.last.get("lost_packets")}


def main():
    options = parse()
    if options.summarise:
        sys.exit(summarise(options.summarise))
    isolated_main.isolate()
    folder = (options.output or Path(tempfile.mkdtemp(prefix="cie-long-run-"))).absolute()
    home = folder / "home"
    home.mkdir(parents=True)
    os.environ["LTTNG_HOME"] = os.environ["HOME"] = str(home)
    options.programs = options.programs.absolute()
    run = LongRun(options, folder)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: run.is_stopping.set())
    try:
        run.run()
    except BaseException as error:
        run.log.add("failure", what="the run was abandoned", why=repr(error))
        raise
    finally:
        for process in run.started.values():
            if process.poll() is None:
                process.terminate()
        for process in run.started.values():
            process.wait(timeout=120)
    status = summarise(folder)
    if status == 0 and not options.output:
        shutil.rmtree(folder)
    sys.exit(status)


if __name__ == "__main__":
    main()
