#!/usr/bin/env python3
"""Manual pages say what the programs say, and are well formed. Arguments: FOLDER-OF-PROGRAMS SOURCES."""
import glob
import os
import re
import shutil
import subprocess
import sys
import unittest

from programs import NOT_THERE, OTHERS, Programs

PROGRAMS = Programs(sys.argv[1])
SOURCES = os.path.abspath(sys.argv[2])
BUILT = os.path.join(os.path.dirname(os.path.abspath(sys.argv[1])), "man")


class Page:
    def __init__(self, path):
        self.path = path
        self.name = os.path.basename(path).rsplit(".", 1)[0]
        with open(path, encoding="utf-8") as file:
            self.text = file.read().replace("\\-", "-").replace("\\fR", "\\fP")

    def section(self, title):
        found = re.search(rf"^\.SH \"?{title}\"?\n(.*?)(?=^\.SH |\Z)", self.text, re.M | re.S)
        return found.group(1) if found else ""

    def tags(self, title):
        """The first lines of the section's items."""
        return re.findall(r"^\.TP\n(.*)", self.section(title), re.M)

    def options(self):
        return {name for tag in self.tags("OPTIONS") for name in re.findall(r"\\fB(-[\w-]+)", tag)}

    def about(self, option):
        """The item of this option, and what follows its tag."""
        for item in self.section("OPTIONS").split(".TP\n"):
            tag = item.split("\n", 1)[0]
            if re.search(rf"\\fB{re.escape(option)}\\fP", tag):
                return item
        return ""


PAGES = {page.name: page for page in map(Page, glob.glob(os.path.join(BUILT, "*.1")))}


def subjects():
    """Page name and how to call what it is about."""
    yield from ((f"cie-{command}", ("cie", command)) for command in PROGRAMS.commands())
    yield from ((program, (program,)) for program in OTHERS)


class ManualPages(unittest.TestCase):
    def test_every_command_has_a_page_and_every_page_a_command(self):
        self.assertEqual(set(PAGES), {"cie"} | {name for name, _ in subjects()})

    def test_the_overview_lists_the_commands(self):
        listed = {tag.split()[0] for tag in PAGES["cie"].tags("COMMANDS")}
        self.assertEqual(listed, set(PROGRAMS.commands()) | {"help"})
        for command in PROGRAMS.commands():
            self.assertIn(rf"\fBcie-{command}\fP(1)", PAGES["cie"].text)

    def test_the_overview_says_which_commands_exit_with_1_and_3(self):
        for status in ("1", "3"):
            item = next(item for item in PAGES["cie"].section("EXIT STATUS").split(".TP\n") if item.startswith(status + "\n"))
            named = set(re.findall(r"\\fBcie (\w+)\\fP", item))
            have = {command for command in PROGRAMS.commands() if status in PAGES[f"cie-{command}"].tags("EXIT STATUS")}
            self.assertEqual(named, have - {"run", "record", "collect"}, status)

    def test_options_are_those_of_the_help(self):
        for name, words in subjects():
            with self.subTest(name):
                told = {option_name for option in PROGRAMS.options(*words) for option_name in option.names}
                self.assertTrue(told)
                self.assertEqual(PAGES[name].options(), told)

    def test_values_that_can_be_chosen_are_named(self):
        found = 0
        for name, words in subjects():
            for option in PROGRAMS.options(*words):
                for value in PROGRAMS.values(words, option):
                    found += 1
                    with self.subTest(f"{name} {option.names[-1]} {value}"):
                        # "forms as in cie-verify(1)"
                        about = PAGES[name].about(option.names[-1])
                        where = PAGES["cie-verify"].about(option.names[-1]) if "As in" in about else about
                        self.assertRegex(where, rf"\\fB{re.escape(value)}\\fP|\b{re.escape(value)}\b")
        self.assertGreater(found, 30)

    def test_exit_codes_are_those_of_the_help(self):
        for name, words in subjects():
            codes = PROGRAMS.exit_codes(*words)
            with self.subTest(name):
                self.assertTrue(codes, "the help tells no exit codes")
                self.assertEqual(set(PAGES[name].tags("EXIT STATUS")), codes)

    def test_what_is_not_there_is_called_so(self):
        for name, words in subjects():
            for line in PROGRAMS.help(*words).splitlines():
                option = re.match(r"\s+(?:-\w,)?(--[\w-]+).*Not available", line)
                if option:
                    self.assertIn(NOT_THERE, PAGES[name].about(option.group(1)).lower(), (name, option.group(1)))

    def test_references_lead_somewhere(self):
        for page in PAGES.values():
            for name in re.findall(r"\\fB(cie(?:-\w+)?)\\fP\(1\)", page.text):
                self.assertIn(name, PAGES, page.name)

    def test_no_tool_finds_fault(self):
        for path in [page.path for page in PAGES.values()] + glob.glob(os.path.join(SOURCES, "*", "*", "man", "*.7")):
            with self.subTest(os.path.basename(path)):
                lint = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", path], stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True, check=False).stdout
                # A date that nobody keeps would be wrong soon.
                self.assertEqual([line for line in lint.splitlines() if "missing date" not in line], [])
                groff = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z", path], stdout=subprocess.PIPE,
                                       stderr=subprocess.STDOUT, text=True, check=False).stdout
                self.assertEqual(groff, "")


if __name__ == "__main__":
    for tool in ("mandoc", "groff", "help2man"):
        if shutil.which(tool) is None:
            print(f"SKIPPED: {tool} is not installed")
            sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=1)
