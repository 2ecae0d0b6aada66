#!/usr/bin/env python3
"""Property tests, model-checked: every interleaving of the protocols between the executor's threads.

    models_test.py DIRECTORY

A model (NAME.pml) lies beside what it models and says what it shows. Spin explores all of its states: the
model as it is has no error, and with each deliberate mistake that the model names (-DBUG, -DBUG_NAME), Spin
finds one, so that the check is known to be able to fail. Takes a minute on one core.
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

MODELS = sorted(Path(sys.argv.pop(1)).rglob("*.pml"))


def explore(model, *defines):
    """What Spin's verifier prints of all states of a model."""
    with tempfile.TemporaryDirectory() as folder:
        for command in (["spin", *defines, "-a", model.resolve()],
                        ["gcc", "-O0", "-DSAFETY", "-DCOLLAPSE", "-o", "pan", "pan.c"]):
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise AssertionError(f"{command[0]} of {model.name}: {done.stdout}{done.stderr}")
        return subprocess.run(["./pan", "-m2000000"], cwd=folder, capture_output=True, text=True, check=False).stdout


def errors(printed):
    found = re.search(r"errors: (\d+)", printed)
    assert found, printed
    return int(found.group(1))


class Models(unittest.TestCase):
    def test_there_is_one_of_each_protocol(self):
        self.assertEqual({model.stem for model in MODELS},
                         {"admission", "arrival_log", "arrival_queue", "callback", "cancel", "events_loop",
                          "executor_core", "pool_loop", "queue_count", "service_clients", "team", "wakeup"})

    def test_nothing_goes_wrong_in_any_interleaving(self):
        for model in MODELS:
            with self.subTest(model.stem):
                printed = explore(model)
                self.assertEqual(errors(printed), 0, printed)
                # What was cut short has shown nothing.
                self.assertNotIn("max search depth too small", printed)
                self.assertNotIn("Search not completed", printed)

    def test_a_deliberate_mistake_is_found(self):
        for model in MODELS:
            mistakes = re.findall(r"^ \* (-DBUG\w*): ", model.read_text("utf-8"), re.MULTILINE)
            self.assertTrue(mistakes, model.stem)
            for mistake in mistakes:
                with self.subTest(model.stem, mistake=mistake):
                    self.assertGreater(errors(explore(model, mistake)), 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
