#!/usr/bin/env python3
"""An absent field is unknown, never 0 (contract): of a flawless recording, one field of one class of events is left out at
a time. No rule may FAIL then, and no time that `cie report` measured may become another one.

Usage: absent_fields.py CIE"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "oracle"))
from oracle.ctf_writer import KERNEL_EVENTS, USER_EVENTS, Layout, Writer  # noqa: E402
from oracle.scenario import Scenario  # noqa: E402
from oracle.spec_writer import spec_text  # noqa: E402

# What the kernel does to an instance: nothing bounds these from another source.
PARTS = ("execution_time_ns", "preempted_ns", "blocked_ns", "wake_delay_ns")
# Without one of them the other tells of wake-ups, and the report says which (definitions, W).
WAKINGS = ("sched_waking", "sched_wakeup")


def simulated():
    scenario = Scenario("absent_fields", 1, 2, 100)
    scenario.kernel = True
    scenario.standard()
    scenario.run()
    return scenario


def write(scenario, trace, event=None, field=None):
    machine = scenario.machine
    for kind, folder, records in (("ust", "ust/uid/0/64-bit", machine.user), ("kernel", "kernel", machine.kernel)):
        writer = Writer(Layout(kind))
        if event in writer.classes:
            writer.classes[event] = [each for each in writer.classes[event] if each[0] != field]
        writer.write(trace / folder, records, scenario.cpus, scenario.begin, scenario.end)


def told(cie, command, trace):
    result = subprocess.run([cie, *command, str(trace), "--format", "json"], capture_output=True, check=False, timeout=60)
    return json.loads(result.stdout), result.stderr.decode()


def failures(cie, trace, spec):
    rules = told(cie, ["verify", "--spec", str(spec)], trace)[0]["rules"]
    return [f"{rule['id']} {subject['subject']}: {subject['evidence'][0]['note']}"
            for rule in rules for subject in rule["subjects"] if subject["verdict"] == "FAIL"]


def parts(cie, trace):
    callbacks = told(cie, ["report"], trace)[0]["callbacks"]
    return {(each["logical_id"], part): each[part]["sum"]
            for each in callbacks for part in PARTS if each[part] is not None}


def main():
    cie = sys.argv[1]
    scenario = simulated()
    wrong = []
    with tempfile.TemporaryDirectory(prefix="cie-absent-") as scratch:
        spec = Path(scratch) / "spec.yaml"
        spec.write_text(spec_text(scenario))
        write(scenario, Path(scratch) / "whole")
        assert not failures(cie, Path(scratch) / "whole", spec), "the recording is not flawless"
        whole = parts(cie, Path(scratch) / "whole")
        assert whole, "nothing was measured"
        for event, fields in (USER_EVENTS | KERNEL_EVENTS).items():
            for field, _ in fields:
                trace = Path(scratch) / f"{event}.{field}"
                write(scenario, trace, event, field)
                wrong += [f"{event} without {field}: FAIL of {each}" for each in failures(cie, trace, spec)]
                wrong += [f"{event} without {field}: {part} of {callback} is {value}, not {whole[callback, part]}"
                          for (callback, part), value in parts(cie, trace).items()
                          if event not in WAKINGS and whole.get((callback, part)) not in (None, value)]
    print("\n".join(wrong[:40]), f"\n{len(wrong)} wrong" if wrong else "nothing wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
