#!/usr/bin/env python3
"""bash completes what the programs accept. Arguments: FOLDER-OF-PROGRAMS SOURCES."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

from programs import OTHERS, STARTED, Programs

LIBRARY = "/usr/share/bash-completion/bash_completion"
PROGRAMS = Programs(sys.argv[1])
SCRIPT = os.path.join(os.path.abspath(sys.argv[2]), "viewer_export", "completions", "cie")

# One bash for many lines: what bash itself sets before it calls the function, then what the function leaves.
DRIVER = f"""
source {LIBRARY} && source "$1" || exit 1
compopt() {{ :; }}  # of a terminal
_quote_readline_by_ref() {{ printf -v "$2" %s "$1"; }}  # without one, bash does not take the quotes off again
while IFS= read -r COMP_LINE; do
  COMP_POINT=${{#COMP_LINE}}
  read -ra COMP_WORDS <<<"$COMP_LINE"
  [[ $COMP_LINE == *' ' ]] && COMP_WORDS+=("")
  COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
  COMPREPLY=()
  function=$(complete -p "${{COMP_WORDS[0]}}" | sed -E 's/.*-F ([^ ]+) .*/\\1/')
  "$function" "${{COMP_WORDS[0]}}" "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD - 1]}}"
  printf '%s\\x1f' "${{COMPREPLY[@]}}"
  printf '\\n'
done
"""


def complete(*lines, folder="/"):
    """What bash offers at the end of each line, sorted; a completion that complains fails."""
    result = subprocess.run(["bash", "--norc", "-c", DRIVER, "driver", SCRIPT], input="".join(line + "\n" for line in lines),
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=200, check=True, cwd=folder,
                            env={**os.environ, "PATH": PROGRAMS.folder + ":" + os.environ["PATH"], "LC_ALL": "C.UTF-8"})
    assert result.stderr == "", result.stderr
    return [sorted(word for word in line.split("\x1f") if word) for line in result.stdout.splitlines()]


def subjects():
    """What is typed, and how the same is asked for its help."""
    yield from ((f"cie {command}", ("cie", command)) for command in PROGRAMS.commands())
    yield from ((program, ("cie", command)) for program, command in STARTED.items())
    yield from ((program, (program,)) for program in OTHERS)


EXAMPLES = ("cie-demo", "cie-autoware-reference")
HELPED = [words for _, words in subjects()] + [("cie-autoware-reference",)]


class Help(unittest.TestCase):
    def test_fits_into_a_terminal_of_80_columns(self):
        for words in (("cie",), *HELPED):
            with self.subTest(words):
                self.assertLessEqual(max(map(len, PROGRAMS.help(*words).splitlines())), 80)

    def test_has_one_blank_line_between_parts(self):
        for words in HELPED:
            with self.subTest(words):
                self.assertNotIn("\n\n\n", PROGRAMS.help(*words))

    def test_keeps_explanations_in_their_column(self):
        for words in HELPED:
            with self.subTest(words):
                parts = PROGRAMS.help(*words).split("\nOptions:\n")[1].split("\n\n")
                self.assertEqual([line for line in parts[0].splitlines() if not re.match(r"  -|  +- |\s{26}\S", line)], [])

    def test_shows_what_stands_for_values_and_no_types(self):
        for words in HELPED:
            with self.subTest(words):
                for option in PROGRAMS.options(*words):
                    self.assertNotRegex(option.declaration, r" (U?INT|FLOAT|TEXT:)|Needs:|Excludes:|REQUIRED|[{}]")


class Errors(unittest.TestCase):
    """Of programs of their own as of cie's: what, where, and the help to ask for."""

    def test_wrong_usage(self):
        for command, arguments, said in (
                ("run", (), "no APP was given: name an application file (YAML)"),
                ("run", ("a.yaml", "b.yaml"), 'one argument too many: "b.yaml"'),
                ("run", ("--exectuor", "multi"), 'unknown option "--exectuor"; did you mean "--executor"?'),
                ("run", ("a.yaml", "--executor", "mutli"),
                 '--executor: does not know "mutli"; did you mean "multi"? available: isolated, single, multi, events, '
                 "isolated-waitset, single-waitset, multi-waitset"),
                ("record", (), "nothing to record: give a command after --, or --attach for what runs already"),
                ("record", ("--attach", "--kernel", "root"), '--kernel: does not know "root"; available: auto, yes, no, bpf, tracefs'),
                ("record", ("--atach",), 'unknown option "--atach"; did you mean "--attach"?; the command to record follows after --'),
                ("collect", (), "no DIR was given: name the directory for the recordings with -o")):
            self.assert_refused(("cie", command), arguments, said)

    def test_of_examples(self):
        for program in EXAMPLES:
            for arguments, said in (
                    (("--executor", "mutli"),
                     '--executor: does not know "mutli"; did you mean "multi"? available: isolated, single, multi, events, '
                     "isolated-waitset, single-waitset, multi-waitset"),
                    (("--spce", "x"), 'unknown option "--spce"; did you mean "--spec"?'),
                    (("car",), 'one argument too many: "car"')):
                self.assert_refused((program,), arguments, said)

    def test_say_what_they_quote_without_control_characters(self):
        for words in (("cie", "report"), ("cie", "run"), ("cie", "record"), ("cie", "collect"), ("cie-demo",)):
            with self.subTest(words):
                for argument in ("--\x1b[31m", "\x1b[31m"):
                    self.assertIn(r"\x1b[31m", PROGRAMS.run(*words, argument).stderr)

    def assert_refused(self, words, arguments, said):
        with self.subTest(words=words, arguments=arguments):
            done = PROGRAMS.run(*words, *arguments)
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (2, "", f"{words[0]}: {said}\nTry: {' '.join(words)} --help\n"))


class Completion(unittest.TestCase):
    def test_commands(self):
        every, some, help_for = complete("cie ", "cie re", "cie help ")
        self.assertEqual(every, sorted([*PROGRAMS.commands(), "help", "--help", "--version"]))
        self.assertEqual(some, ["record", "report"])
        self.assertEqual(help_for, sorted(PROGRAMS.commands()))

    def test_options(self):
        cases = list(subjects())
        for (typed, words), offered in zip(cases, complete(*(f"{typed} --" for typed, _ in cases))):
            told = sorted(name for option in PROGRAMS.options(*words) for name in option.names if name.startswith("--"))
            self.assertEqual(offered, told, typed)
            self.assertIn("--help", offered, typed)

    def test_values_are_those_that_the_program_accepts(self):
        cases = [(f"{typed} {name}", PROGRAMS.values(words, option))
                 for typed, words in subjects() for option in PROGRAMS.options(*words) for name in option.names]
        cases = [(typed, values) for typed, values in cases if values]
        self.assertGreater(len(cases), 20)
        for (typed, values), offered in zip(cases, complete(*(f"{typed} " for typed, _ in cases))):
            self.assertEqual(offered, sorted(values), typed)

    def test_a_value_may_follow_an_equals_sign(self):
        self.assertEqual(complete("cie verify --format=j"), [["json", "junit"]])

    def test_actions(self):
        commands = ("spec", "analyze")
        for command, offered in zip(commands, complete(*(f"cie {command} " for command in commands))):
            self.assertEqual(offered, sorted(PROGRAMS.actions(command)))
            self.assertTrue(offered)

    def test_rules(self):
        listed = re.findall(r"^([A-Z]\d+)\s", PROGRAMS.run("cie", "verify", "--list-rules").stdout, re.M)
        every, one, several = complete("cie verify --only ", "cie verify --explain ", "cie verify --skip M2,S")
        self.assertEqual(every, sorted(listed))
        self.assertEqual(one, sorted(listed))
        self.assertEqual(several, sorted(f"M2,{rule}" for rule in listed if rule.startswith("S")))

    def test_kinds_of_files(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("app.yaml", "other.yml", "report.json", "notes.txt", "with space.yaml"):
                with open(os.path.join(folder, name), "w", encoding="utf-8"):
                    pass
            os.mkdir(os.path.join(folder, "recording"))
            yaml = ["app.yaml", "other.yml", "recording", "with space.yaml"]
            everything = ["app.yaml", "notes.txt", "other.yml", "recording", "report.json", "with space.yaml"]
            expected = {
                "cie report ": ["recording"],
                "cie verify --allow-crash ": ["recording"],
                "cie verify recording --spec ": yaml,
                "cie verify --suppressions ": yaml,
                "cie run ": yaml,
                "cie-run ": yaml,
                "cie-demo --spec ": yaml,
                "cie spec check ": yaml,
                "cie spec template ": ["recording"],
                "cie diff ": ["recording", "report.json"],
                "cie report recording -o ": everything,
                "cie report recording --metadata ": everything,
                "cie record -o ": ["recording"],
                "cie record --output=rec": ["recording"],
                "cie verify --now ": [],
            }
            for (typed, files), offered in zip(expected.items(), complete(*expected, folder=folder)):
                self.assertEqual(offered, files, typed)

    def test_after_two_dashes_comes_a_command_of_any_kind(self):
        command, argument = complete("cie record -o x -- cie-dem", "cie record -- cie verify --form")
        self.assertIn("cie-demo", command)
        self.assertEqual(argument, ["--format"])


if __name__ == "__main__":
    if not os.path.exists(LIBRARY):
        print("SKIPPED: bash-completion is not installed")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=1)
