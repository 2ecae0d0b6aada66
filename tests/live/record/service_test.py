#!/usr/bin/env python3
"""cie-record with the rights that cie-record.service leaves it, and no others, records what root runs."""

import argparse
import grp
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
NOBODY = 65534


def setting(name):
    """What the unit sets, which is once."""
    return re.search(rf"^{name}=(.*)$", options.unit.read_text(), re.M).group(1)


class Service(unittest.TestCase):
    def setUp(self):
        if os.geteuid() != 0:
            self.skipTest("not possible here: needs root's session daemon, as the service does")
        if not any(entry.gr_name == setting("SupplementaryGroups") for entry in grp.getgrall()):
            self.skipTest("not possible here: lttng-tools made no group for those who may trace")
        if any(folder.stat().st_mode & 0o5 != 0o5 for folder in options.programs.resolve().parents):
            self.skipTest("not possible here: other users may not read the folders that the programs are in")
        # As lttng-sessiond.service does; ended by its own id.
        isolated_main.session_daemon(self)

    def least_instances(self, state):
        """Of the two callbacks, in the only recording; 0 while there is none."""
        done = subprocess.run([options.programs / "cie", "report", *state.iterdir(), "-f", "json"], capture_output=True,
                              text=True, timeout=200, check=False)
        callbacks = json.loads(done.stdout)["callbacks"] if done.returncode == 0 else []
        return min(callback["instances"] for callback in callbacks) if len(callbacks) == 2 else 0

    def test_a_user_without_capabilities_in_the_group_tracing_is_enough(self):
        self.assertEqual(setting("CapabilityBoundingSet"), "")
        ready = scratch / "ready"
        with subprocess.Popen([options.application, "--until-signal", "--period-us", "2000", "--ready", ready],
                              stdout=subprocess.PIPE, text=True,
                              env={**os.environ, "LTTNG_UST_REGISTER_TIMEOUT": "-1"}) as application:
            self.addCleanup(application.kill)
            wait_for(ready.exists, "the application runs")
            state = scratch / "state"
            state.mkdir()
            os.chown(state, NOBODY, NOBODY)
            scratch.chmod(0o711)
            command = [word.replace("/usr/bin", str(options.programs.resolve()))
                       for word in shlex.split(setting("ExecStart")) if not word.startswith("$")]
            recorder = subprocess.Popen(
                ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}",
                 f"--groups={grp.getgrnam(setting('SupplementaryGroups')).gr_gid}", "--no-new-privs",
                 "--inh-caps=-all", "--bounding-set=-all", *command, "--rotate", "1", "--kernel=no"],
                cwd=state, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                env={"PATH": os.environ["PATH"], "HOME": setting("WorkingDirectory")})
            self.addCleanup(recorder.kill)
            wait_for(lambda: recorder.poll() is not None or self.least_instances(state) > 20,
                     "instances of both callbacks")
            recorder.send_signal(signal.SIGINT)
            said = recorder.communicate(timeout=200)
            application.send_signal(signal.SIGTERM)
            application.communicate(timeout=200)
        self.assertEqual(recorder.returncode, 0, said)
        recording, = state.iterdir()
        done = subprocess.run([options.programs / "cie", "verify", recording, "-f", "json", "--only",
                               "T1,T2,T3,T5"], capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(json.loads(done.stdout)["verdict"], "PASS", done.stdout)
        self.assertGreater(self.least_instances(state), 20)


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for argument in ("programs", "application", "unit"):
        parser.add_argument(f"--{argument}", type=Path, required=True)
    options, rest = parser.parse_known_args()
    isolated_main.main("service", rest, begin)
