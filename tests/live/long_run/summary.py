"""What a long run's log says, and whether the laws held."""

import json
import statistics
from collections import Counter

# Of a run that is shorter, memory says nothing: buffers are touched for the first time, caches fill.
LEAST_FOR_MEMORY = 900  # seconds
# Of the run. Until then ring buffers are touched for the first time, and the live view's histograms meet rare values.
WARM_UP = 0.5
MOST_GROWTH = 1024  # KiB per hour of private memory, beyond what the samples leave uncertain
# What some take by their nature, KiB per hour: the application keeps a latency and a start, 8 bytes each, of ten cycles
# a second for its key figures; a live view's histograms, each of 32 KiB at most, widen with values rarer than any before
# (0.4 MiB in the second half hour, 3.5 MiB in an hour in which the machine had twenty times more to do than it could).
OWN_GROWTH = {"application": 2 * 8 * 10 * 3600 / 1024, "live: cie": 4096}
MOST_CHANGE = 2  # of descriptors or threads, from the median after warm-up to that of the end
# Rules that a busy machine violates, and replaced messages, which this application's queues of one are for.
TIMING = {"R1", "R2", "Q1"}
# What a part of a run cannot decide: run_end, later read-backs and the totals of queues are not in it.
OPEN_IN_A_PART = {"T4", "S3", "Q1"}


def slope_of(times, values):
    """Least squares: KiB per hour, and two standard errors of it."""
    count = len(times)
    mean_t, mean_v = statistics.fmean(times), statistics.fmean(values)
    spread = sum((t - mean_t) ** 2 for t in times)
    slope = sum((t - mean_t) * (v - mean_v) for t, v in zip(times, values)) / spread
    residue = sum((v - mean_v - slope * (t - mean_t)) ** 2 for t, v in zip(times, values))
    error = (residue / max(1, count - 2) / spread) ** 0.5
    return slope * 3600, 2 * error * 3600


class Summary:
    def __init__(self, folder):
        self.folder = folder
        self.entries = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
        self.broken = []

    def of_kind(self, kind):
        return [entry for entry in self.entries if entry["kind"] == kind]

    def law(self, holds, text):
        print(f"  {'holds ' if holds else 'BROKEN'}  {text}")
        if not holds:
            self.broken.append(text)

    def print(self):
        begin, = self.of_kind("begin")
        end = self.of_kind("end")
        lasted = self.entries[-1]["at"]
        print(f"long run: {lasted / 3600:.2f} h of {begin['duration'] / 3600:.2f} h asked for, reference system at load "
              f"{begin['load']:g}, stress-ng {begin['stress']:g} % of each of {begin['cpus']} CPUs, Linux {begin['kernel']}")
        self.print_processes()
        print("\nlaws")
        self.check_failures()
        self.check_chunks()
        self.check_snapshots()
        if end:
            self.check_accounts(end[0])
        else:
            print("  the run has not ended: its accounts are open")
        self.check_processes(lasted)
        return 1 if self.broken else 0

    # --- the machine's side -------------------------------------------------------------------------------------

    def series(self):
        """By process: its samples, with their times."""
        found = {}
        for entry in self.of_kind("sample"):
            for name, facts in entry["processes"].items():
                found.setdefault(name, []).append({"at": entry["at"], **facts})
        # What was there once is a program that came and went.
        most = max((len(samples) for samples in found.values()), default=0)
        return {name: samples for name, samples in found.items() if 2 * len(samples) >= most and len(samples) > 2}

    def after_warm_up(self, samples):
        last = samples[-1]["at"]
        return [sample for sample in samples if sample["at"] >= WARM_UP * last]

    def print_processes(self):
        print(f"\n{'process':<38} {'CPU':>6} {'memory MiB: first':>18} {'warm':>7} {'last':>7} {'shared':>7} "
              f"{'private grows by KiB/h':>23} {'descriptors':>12} {'threads':>8}")
        for name, samples in self.series().items():
            warm = self.after_warm_up(samples)
            first, last = samples[0], samples[-1]
            cpu = 100 * (last["cpu"] - first["cpu"]) / (last["at"] - first["at"])
            slope, error = slope_of([s["at"] for s in warm], [s["anon"] for s in warm]) if len(warm) > 2 else (0, 0)
            print(f"{name:<38} {cpu:>5.1f}% {first['rss'] / 1024:>18.1f} {warm[0]['rss'] / 1024:>7.1f} "
                  f"{last['rss'] / 1024:>7.1f} {last['shared'] / 1024:>7.1f} {slope:>+14.0f} +- {error:<5.0f} "
                  f"{warm[0]['descriptors']:>5} > {last['descriptors']:<4} {warm[0]['threads']:>3} > {last['threads']:<3}")
        samples = self.of_kind("sample")
        if samples:
            live = samples[-1]["live"]
            print(f"disk {samples[-1]['disk'] / 2**20:.0f} MiB; cie live wrote {live['lines']} lines of {live['events']} events, "
                  f"violations told: {', '.join(live['violations']) or 'none'}")

    def check_processes(self, lasted):
        series = self.series()
        ids = {name: {sample["pid"] for sample in samples} for name, samples in series.items()}
        self.law(all(len(pids) == 1 for pids in ids.values()), "nobody ended and was started again")
        if lasted < LEAST_FOR_MEMORY:
            print(f"  memory, descriptors and threads are judged from {LEAST_FOR_MEMORY} s on")
            return
        growing, changing = [], []
        for name, samples in series.items():
            warm = self.after_warm_up(samples)
            slope, error = slope_of([s["at"] for s in warm], [s["anon"] for s in warm])
            if slope - error - OWN_GROWTH.get(name, 0) > MOST_GROWTH:
                growing.append(name)
            part = max(1, len(warm) // 5)
            for what in ("descriptors", "threads"):
                change = statistics.median(s[what] for s in warm[-part:]) - statistics.median(s[what] for s in warm[:part])
                if change > MOST_CHANGE:
                    changing.append(f"{name} ({what} {change:+g})")
        own = ", ".join(f"{name} {growth:.0f}" for name, growth in OWN_GROWTH.items())
        self.law(not growing, f"private memory grows by less than {MOST_GROWTH} KiB/h (besides: {own})" +
                 (": not that of " + ", ".join(growing) if growing else ""))
        self.law(not changing, "descriptors and threads are flat" + (": not " + ", ".join(changing) if changing else ""))

    # --- the events' side ---------------------------------------------------------------------------------------

    def check_failures(self):
        for failure in self.of_kind("failure"):
            self.law(False, f"{failure['what']}: {failure.get('why', '')}")

    def check_verdicts(self, what, parts, described):
        """`described`: those of the parts in which the application has had time to describe itself."""
        failed = Counter(rule for part in parts for rule, verdict in part["verdicts"].items() if verdict == "FAIL")
        unsure = Counter(rule for part in described for rule, verdict in part["verdicts"].items() if verdict == "INCONCLUSIVE")
        told = "; ".join(f"{rule} fails in {count}" for rule, count in sorted(failed.items()))
        self.law(set(failed) <= TIMING, f"{len(parts)} {what}: no rule but those about time is violated" +
                 (f" ({told})" if told else ""))
        told = ", ".join(f"{rule} in {count}" for rule, count in sorted(unsure.items()))
        # Where events were discarded nothing can be decided about what they told.
        is_whole = not any(sum(part.get("discarded", {}).values()) for part in parts)
        self.law(set(unsure) <= OPEN_IN_A_PART or not is_whole, f"{len(described)} {what}: undecided only what a part cannot decide" +
                 (f" ({told})" if told else ""))

    def check_chunks(self):
        chunks = self.of_kind("chunk")
        events = sum(chunk["events"] for chunk in chunks)
        size = sum(chunk["size"] for chunk in chunks)
        self.law(bool(chunks) and all(not chunk["problems"] for chunk in chunks),
                 f"{len(chunks)} chunks, {events} events, {size / 2**20:.0f} MiB: LTTng wrote all of them to their end")
        # In the one in which it ended it may have had no time to; those after that have nothing to judge.
        running = [chunk for chunk in chunks if chunk.get("starts", 1)]
        self.check_verdicts("chunks", chunks, running[:-1])

    def check_snapshots(self):
        snapshots = self.of_kind("snapshot")
        held = [snapshot["held"] for snapshot in snapshots]
        self.law(bool(snapshots) and all(snapshot["holes"] == 0 for snapshot in snapshots),
                 f"{len(snapshots)} snapshots of {min(held, default=0):.1f} to {max(held, default=0):.1f} s: nothing is missing "
                 "between the oldest event and the newest")
        ragged = [snapshot["ragged"] for snapshot in snapshots if snapshot.get("ragged")]
        if ragged:
            print(f"          {len(ragged)} of them lack {sum(ragged)} numbers after the moment when the first CPU's buffer was taken")
        self.check_verdicts("snapshots", snapshots, [snapshot for snapshot in snapshots if not snapshot.get("ragged")])

    def check_accounts(self, end):
        emitted, recorded = end["emitted"], end["recorded"]
        self.law(bool(emitted), f"the application said at its end what it emitted: {len(emitted)} totals")
        missing = sum(emitted.values()) - sum(recorded.get(key, 0) for key in emitted)
        discarded = end["discarded"].get("events", 0)
        text = (f"chunks: {sum(emitted.values())} starts, ends and publications emitted = "
                f"{sum(recorded.get(key, 0) for key in emitted)} recorded + {missing} missing, {discarded} events discarded")
        # thread_wakeup and the like have no totals, so of what was discarded some may be theirs.
        self.law(0 <= missing <= discarded and not set(recorded) - set(emitted) and
                 all(recorded.get(key, 0) <= emitted[key] for key in emitted), text)
        by_chunk = sum(chunk["discarded"].get("events", 0) for chunk in self.of_kind("chunk"))
        self.law(by_chunk == discarded, f"what chunks say was discarded ({by_chunk}) is what the session says ({discarded})")
        reached = end["last_snapshot"] or {}
        behind = {key: emitted.get(key, 0) - number for key, number in reached.items()}
        self.law(bool(reached) and not any(behind.values()),
                 f"flight recorder: the last snapshot reaches the last of each of {len(reached)} numbers")
        self.check_live(end)
        failed = sorted(rule for rule, verdict in end["verdicts"].items() if verdict == "FAIL")
        unsure = sorted(rule for rule, verdict in end["verdicts"].items() if verdict == "INCONCLUSIVE")
        self.law(set(failed) <= TIMING and (not unsure or discarded), "the whole: no rule but those about time is violated, none undecided" +
                 (f" (violated: {', '.join(failed)})" if failed else "") + (f" (undecided: {', '.join(unsure)})" if unsure else ""))

    def check_live(self, end):
        ended = sum(number for key, number in end["emitted"].items() if key.startswith("callback_end "))
        told = sum(end["live"].values())
        lost = end["live_lost"]
        is_complete = lost["events"] == 0 and lost["packets"] == 0
        self.law(told == ended if is_complete else told <= ended,
                 f"live: {ended} instances ended, {told} told, lost events {lost['events']}, lost packets {lost['packets']}")


def summarise(folder):
    return Summary(folder).print()
