"""What an example of the contract holds, from other sources than cie."""
import collections
import csv
import os
import re
import subprocess


def output_of(*command, **options):
    return subprocess.run(command, stdin=options.pop("stdin", subprocess.DEVNULL), stdout=subprocess.PIPE, check=True,
                          timeout=200, **options).stdout.decode()


class Truth:
    """What an example trace holds, from babeltrace2's text and the contract's instances.csv."""

    def __init__(self, folder):
        """`folder`: that of the example, with trace/ and instances.csv."""
        with open(os.path.join(folder, "instances.csv"), encoding="utf-8", newline="") as file:
            self.instances = list(csv.DictReader(file))
        self.waits = [row for row in self.instances if row["release_ns"] and row["release_ns"] < row["start_ns"]]
        text = output_of("babeltrace2", "--clock-seconds", os.path.join(folder, "trace"))
        writers = dict(re.findall(r"cie:publisher_init: .*publisher_id = (\d+), .*writer_gid = (\d+)", text))
        published = collections.Counter()
        for publisher, stamp in re.findall(r"cie:publish: .*publisher_id = (\d+), .*realtime_ns = (\d+)", text):
            published[writers[publisher], stamp] += 1
        taken = re.findall(r"cie:callback_start: .*realtime_ns = (\d+), writer_gid = (\d+)", text)
        self.publications = sum(published.values())
        self.flows = sum(1 for stamp, gid in taken if published[gid, stamp])
        self.running = []  # (cpu, tid, duration) of every slice that began and ended in the trace
        on_cpu = {}
        for seconds, ns, cpu, prev, nxt in re.findall(
                r"^\[(\d+)\.(\d+)\].*sched_switch: \{ cpu_id = (\d+) \}.*prev_tid = (\d+).*next_tid = (\d+)", text, re.M):
            time = int(seconds) * 10**9 + int(ns)
            if prev != "0" and on_cpu.get(cpu, ("", 0))[0] == prev and time > on_cpu[cpu][1]:
                self.running.append((int(cpu), int(prev), time - on_cpu[cpu][1]))
            on_cpu[cpu] = (nxt, time)
