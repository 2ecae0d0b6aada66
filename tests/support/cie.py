"""The program cie, as tests run it, and what it answers in JSON."""
import json
import os
import subprocess

ANSWERED = (0, 1, 3)  # exit codes; 1 and 3 are verdicts


class Cie:
    """A program of the build tree that is given nothing to read. `options` are those of subprocess.run()."""

    def __init__(self, program, **options):
        self.program = os.path.abspath(program)
        self.options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True,
                        "timeout": 200, "check": False} | options

    def run(self, *arguments, **options):
        """It, when it has ended, however it did."""
        return subprocess.run([self.program, *map(str, arguments)], **self.options | options)

    def text(self, *arguments, codes=(0,)):
        """What it prints, to the byte, where it ends with one of these codes."""
        return self._ended(arguments, codes).stdout.decode()

    def refusal(self, *arguments, code):
        """What it says of what it does not do."""
        return self._ended(arguments, (code,)).stderr.decode()

    def json(self, *arguments):
        """What a command says in JSON."""
        return json.loads(self._ended((*arguments, "-f", "json"), ANSWERED).stdout)

    def verdicts(self, *arguments):
        """Of `cie verify`, by rule."""
        return verdicts_of(self.json("verify", *arguments))

    def _ended(self, arguments, codes):
        done = self.run(*arguments, text=False)
        assert done.returncode in codes, (arguments, done.returncode, done.stderr)
        return done


def rules_of(judged):
    """What `cie verify` says in JSON, by rule."""
    return {rule["id"]: rule for rule in judged["rules"]}


def verdicts_of(judged):
    return {name: rule["verdict"] for name, rule in rules_of(judged).items()}
