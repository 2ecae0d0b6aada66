"""What tests of the component container share: files to run, containers that run, orders to them."""

import argparse
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "support")]
import isolated_main  # noqa: E402  pylint: disable=wrong-import-position
from isolated_main import wait_for  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position

options: argparse.Namespace
scratch: Path
ENDED_WELL, UNUSABLE, FAILED = 0, 2, 4


def component(name, of="Good", library="libodd.so", more=""):
    return (f"  - library: {options.libraries / library}\n    class: odd::{of}\n    name: {name}\n"
            + "".join(f"    {line}\n" for line in more.splitlines()))


def app_file(*components, head=""):
    file = scratch / f"app{len(list(scratch.iterdir()))}.yaml"
    file.write_text(f"loopback: true\n\n{head}components:\n" + "".join(components))
    return file


class Running:
    """cie-run, once it says that it runs (or has ended); without `runs` at once."""

    def __init__(self, file, *arguments, runs=True):
        self.log = scratch / f"log{len(list(scratch.iterdir()))}"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [options.programs / "cie-run", file, *arguments], stdout=subprocess.PIPE,
                stderr=log, text=True)
        if not runs:
            return
        try:
            wait_for(lambda: "under the executor" in self.text() or self.process.poll() is not None, "it runs")
        except AssertionError:
            self.__exit__()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def end(self, signal_number=signal.SIGTERM):
        self.process.send_signal(signal_number)
        out, _ = self.process.communicate(timeout=200)
        return self.process.returncode, out

    def text(self):
        return self.log.read_text()


def run_and_end(file, *arguments, seconds=0.3):
    with Running(file, *arguments) as running:
        time.sleep(seconds)
        code, out = running.end()
        return code, out, running.text()


def run_to_its_end(file, *arguments):
    done = subprocess.run([options.programs / "cie-run", file, *arguments], capture_output=True,
                          text=True, timeout=200, check=False)
    return done.returncode, done.stderr


def order(*words, pid=None):
    """Exit code, standard output and error of `cie-run --control WORDS`."""
    choice = ["--pid", str(pid)] if pid else []
    done = subprocess.run([options.programs / "cie-run", *choice, "--control", *words],
                          capture_output=True, text=True, timeout=200, check=False)
    return done.returncode, done.stdout, done.stderr


def begin(directory):
    global scratch  # pylint: disable=global-statement
    scratch = directory
    os.environ["XDG_RUNTIME_DIR"] = str(scratch / "home")  # orders reach this test's containers only
    os.environ["CIE_LOOPBACK"] = "1"
    os.environ["CIE_DISCOVERY_TAG"] = f"container{os.getpid()}"


def main(description):
    global options  # pylint: disable=global-statement
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--libraries", type=Path, required=True)
    parser.add_argument("--record", action="store_true")
    options, rest = parser.parse_known_args()
    options.programs = options.programs.resolve()
    options.cie = Cie(options.programs / "cie")
    options.libraries = options.libraries.resolve()
    isolated_main.main("container", rest, begin, records=options.record)
