#!/usr/bin/env python3
"""The documentation says what is so: its commands run, its references hold. Arguments: FOLDER-OF-PROGRAMS SOURCES."""
import ast
import glob
import json
import operator
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from programs import Programs

PROGRAMS = Programs(sys.argv[1])
SOURCES = os.path.abspath(sys.argv[2])
DOCS = os.path.join(SOURCES, "viewer_export", "docs")
ANYTHING = "…"

EXAMPLES = os.path.join(SOURCES, "tests", "golden", "contract", "examples")
BEFORE = os.path.join(EXAMPLES, "multi_threaded_fails", "trace")
AFTER = os.path.join(EXAMPLES, "isolated_ok", "trace")
SPEC = os.path.join(EXAMPLES, "isolated_ok", "spec.yaml")
# Recordings of others, below the folder that CIE_TRACES names: what the pages call one, and its path there.
OTHERS = {"autoware": os.path.join("tum_aw_carla", "trace")}


def read(*names):
    with open(os.path.join(SOURCES, *names), encoding="utf-8") as file:
        return file.read()


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def others():
    """Those of OTHERS that are here, by name."""
    found = {}
    for name, path in OTHERS.items():
        candidates = glob.glob(os.path.join(os.environ.get("CIE_TRACES", ""), "**", path), recursive=True)
        if os.environ.get("CIE_TRACES") and candidates:
            found[name] = candidates[0]
    return found


def steps(block):
    """Each command with the lines that the page shows of its output."""
    found = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        else:
            found[-1][1].append(line.rstrip())
    return found


def matches(shown, output):
    """Line by line; `…` alone stands for any lines, and in a line for any text."""
    at = 0
    is_any = False
    for line in shown:
        if line == ANYTHING:
            is_any = True
            continue
        pattern = re.compile(".*".join(map(re.escape, line.split(ANYTHING))))
        while at < len(output) and is_any and not pattern.fullmatch(output[at]):
            at += 1
        if at == len(output) or not pattern.fullmatch(output[at]):
            return f"the page shows: {line}"
        at += 1
        is_any = False
    return "" if is_any or at == len(output) else f"there is more: {output[at]}"


class Commands(unittest.TestCase):
    def test_they_print_what_the_pages_show(self):
        self.assertGreater(self.run_all({}, lambda command: not self.is_of_others(command)), 20)

    def test_they_print_what_the_pages_show_of_recordings_of_others(self):
        here = others()
        if len(here) < len(OTHERS):
            self.skipTest("not possible here: CIE_TRACES names no folder with " + ", ".join(set(OTHERS) - set(here)))
        self.assertGreater(self.run_all(here, self.is_of_others), 1)

    @staticmethod
    def is_of_others(command):
        return any(name in command.split() for name in OTHERS)

    def run_all(self, linked, is_wanted):
        environment = {**os.environ, "PATH": PROGRAMS.folder + ":" + os.environ["PATH"], "LC_ALL": "C.UTF-8", "CIE": SOURCES}
        count = 0
        for page in sorted(glob.glob(os.path.join(DOCS, "*.md"))):
            with tempfile.TemporaryDirectory() as folder:
                for name, target in linked.items():
                    os.symlink(target, os.path.join(folder, name))
                for block in blocks(read(page), "console"):
                    for command, shown in steps(block):
                        if not is_wanted(command):
                            continue
                        with self.subTest(f"{os.path.basename(page)}: {command}"):
                            count += 1
                            done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, text=True, timeout=200,
                                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
                            difference = matches(shown, [line.rstrip() for line in done.stdout.splitlines()])
                            self.assertEqual(difference, "", done.stdout)
        return count

    def test_options_in_what_needs_another_machine_exist(self):
        for page in glob.glob(os.path.join(DOCS, "*.md")):
            for block in blocks(read(page), "sh"):
                for command in re.findall(r"^cie (\w+)(.*)$", block, re.M):
                    own = command[1].split(" -- ")[0]
                    known = {name for option in PROGRAMS.options("cie", command[0]) for name in option.names}
                    for option in re.findall(r"(?:^| )(--?[a-z][\w-]*)", own):
                        self.assertIn(option, known, os.path.basename(page))


class Arithmetic(unittest.TestCase):
    """Rows `| name = formula | value unit | … |`: a formula of numbers and of names above gives the value."""

    def test_every_number_follows_from_those_above_it(self):
        page = read("viewer_export", "docs", "fleet.md")
        known = {}
        derived = 0
        for name, formula, value in re.findall(r"^\| `(\w+)(?: = ([^`]+))?` \| ([\d. ]+?)(?: [^\d|][^|]*)?\|",
                                               page, re.M):
            told = value.replace(" ", "")
            if formula:
                derived += 1
                exact = self.value_of(formula, known)
                self.assertEqual(f"{exact:.{len(told.partition('.')[2])}f}", told, name)
                known[name] = exact
            else:
                known[name] = float(told)
        self.assertEqual(derived, len(re.findall(r"^\| `\w+ = ", page, re.M)))
        self.assertGreater(derived, 20)

    def value_of(self, formula, known):
        operators = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}

        def value(node):
            if isinstance(node, ast.BinOp):
                return operators[type(node.op)](value(node.left), value(node.right))
            return known[node.id] if isinstance(node, ast.Name) else node.value

        return value(ast.parse(formula, mode="eval").body)


class References(unittest.TestCase):
    def test_events_are_those_of_the_provider(self):
        provider = read("tracepoints", "provider", "provider.h")
        emitted = {}
        for name, body in re.findall(r"LTTNG_UST_TRACEPOINT_EVENT\(cie, (\w+),(.*?)\n\)\n", provider, re.S):
            fields = re.findall(r"lttng_ust_field_(\w+)\((.*)", body)
            emitted[name] = [self.field_name(kind, rest) for kind, rest in fields]
        told = {}
        contract = read("tracepoints", "README.md").split("## The contract")[1].split("### What a reader may rely on")[0]
        for name, text in re.findall(r"^- `(\w+)`: (.*?)(?=^- |^$)", contract, re.M | re.S):
            text = re.sub(r"\([^()]*\)", "", " ".join(text.split()).split(". Emitted ")[0])
            told[name] = re.findall(r"(?:^|, )\s*(\w+) (?:[ui]\d+|str|enum|seq of)", text.strip().split(" All *")[0])
        self.assertEqual(set(told), set(emitted))
        for name, fields in emitted.items():
            self.assertEqual(told[name], fields, name)

    @staticmethod
    def field_name(kind, rest):
        words = [word.strip() for word in rest.split(",")]
        return {"string": words[0].rstrip(")"), "enum": words[3] if len(words) > 3 else ""}.get(kind, words[1])

    def test_the_page_of_rules_is_what_the_program_says(self):
        self.assertEqual(read("viewer_export", "docs", "rules.md"), rules_page())

    def test_keys_of_a_spec_are_in_its_manual(self):
        manual = set(re.findall(r"\\fB([a-z_]+)\\fR", read("viewer_export", "man", "cie-spec.h2m")))
        arrays = re.findall(r"k(?:Parameter|Bound|ThreadBound|Chain)Keys\{(.*?)\}|kSections\{(.*?)\}",
                            read("tracepoints", "schema", "spec_reader.cpp"), re.S)
        keys_read = {key for array in arrays for text in array for key in re.findall(r'"(\w+)"', text)}
        self.assertGreater(len(keys_read), 25)
        self.assertEqual(keys_read - manual, set())

    def test_the_synopsis_has_every_option(self):
        synopsis = read("viewer_export", "docs", "commands.md").partition("```\ncie run")[2].partition("```")[0]
        synopsis = re.sub(r"\n +", " ", synopsis)  # what goes on in the next line
        everywhere = {"-h", "--help", "-q", "--quiet", "--metadata"}
        for command in ("report", "instances", "events", "diff", "verify", "analyze", "export", "view", "live", "doctor"):
            lines = " ".join(re.findall(rf"^cie {command} .*", synopsis, re.M))
            for option in PROGRAMS.options("cie", command):
                if not everywhere.intersection(option.names):
                    self.assertTrue(any(name in re.split(r"[^\w-]+", lines) for name in option.names),
                                    (command, option.names))

    def test_every_key_of_a_live_line_is_told(self):
        written = re.findall(r'\b(?:visit(?:\.\w+)?|window|total|source|open)\("(\w+)"',
                             read("viewer_export", "live", "snapshot_fields.hpp"))
        block = re.search(r'```\n(\{ "schema": "cie.live/1".*?)```', read("viewer_export", "live", "README.md"), re.S)[1]
        told = re.findall(r'"(\w+)":', block)
        self.assertGreater(len(told), 50)
        self.assertEqual(sorted([*written, "schema"]), sorted(told), "each as often as objects have it")

    def test_every_key_of_a_manifest_is_told(self):
        written = re.findall(r'\b(?:visit|tool|kernel)(?:\.\w+)?\("(\w+)"',
                             read("tracepoints", "schema", "recording_manifest.cpp"))
        block, = blocks(read("viewer_export", "docs", "reference.md"), "json keys of recording")
        self.assertGreater(len(written), 40)
        self.assertEqual(sorted(written), sorted(re.findall(r'"(\w+)":', block)), "each as often as objects have it")

    def test_nodes_of_orders_are_the_examples(self):
        app = read("executor", "examples", "components", "app.yaml")
        nodes = {f"{space}/{name}" for name, space in re.findall(r"name: (\w+)\n +namespace: (\S+)", app)}
        for text in (read("executor", "docs", "components.md"), PROGRAMS.run("cie-run", "--help").stdout):
            named = re.findall(r"(?:param get|-p) (/\w+/\w+)", text)
            self.assertTrue(named)
            self.assertEqual(set(named) - nodes, set())

    def test_every_key_of_json_is_told(self):
        page = read("viewer_export", "docs", "reference.md")
        spec = ("--spec", SPEC)
        for name, words in {"report": ("report", BEFORE, *spec), "verify": ("verify", BEFORE, *spec),
                            "diff": ("diff", BEFORE, AFTER, *spec),
                            "schedulability": ("analyze", "schedulability", AFTER, *spec),
                            "doctor": ("doctor", "--root", EXAMPLES)}.items():
            block, = blocks(page, f"json keys of {name}")
            told = keys(json.loads(block))
            given = keys(json.loads(PROGRAMS.run("cie", *words, "-f", "json").stdout))
            # Each code of evidence has arguments of its own.
            given = {key for key in given if ".arguments." not in key}
            # A statistic stands in the page as "S", and what is empty in these recordings has no keys.
            given = {key for key in given if not re.search(r"_ns\.(count|min|max|sum|mean|p\d+(_9)?)$", key)}
            self.assertEqual(given - told, set(), name)
            self.assertEqual({key for key in told - given if not key.startswith(("defects[].", "record_before.losses[]."))}, set(), name)

    def test_who_has_an_antecedent(self):
        """"for who builds" is no English: whoever, those who."""
        texts = [path for pattern in ("*/**/*.md", "*/include/**/*.hpp", "README.md")
                 for path in glob.glob(os.path.join(SOURCES, pattern), recursive=True) if "/build/" not in path]
        self.assertGreater(len(texts), 100)
        for path in texts:
            self.assertEqual(re.findall(r"\b(?:for|to|from|than) who [a-z]\w*", read(path)), [], path)

    def test_tables_of_the_analysis_are_readable_as_text(self):
        """What a cell has no room for stands in a sentence below."""
        pages = glob.glob(os.path.join(SOURCES, "analysis", "**", "README.md"), recursive=True)
        self.assertGreater(len(pages), 3)
        for page in pages:
            self.assertEqual([line for line in read(page).splitlines() if len(line) > 160], [], page)

    def test_links_lead_somewhere(self):
        pages = [page for folder in ((), ("*",), ("*", "docs")) for page in glob.glob(os.path.join(SOURCES, *folder, "*.md"))]
        for page in pages:
            for target in re.findall(r"\]\(([^)#\s]+)\)", read(page)):
                if not re.match(r"https?:", target):
                    self.assertTrue(os.path.exists(os.path.join(os.path.dirname(page), target)), (page, target))


def keys(value, prefix=""):
    if isinstance(value, dict):
        return {prefix + key for key in value}.union(*(keys(item, f"{prefix}{key}.") for key, item in value.items()))
    if isinstance(value, list):
        return set().union(*(keys(item, f"{prefix[:-1]}[].") for item in value))
    return set()


def rules_page():
    text = "# Rules\n\nWhat `cie verify` judges by; `cie verify --explain ID` prints the same.\n"
    for line in PROGRAMS.run("cie", "verify", "--list-rules").stdout.splitlines():
        head, _, body = PROGRAMS.run("cie", "verify", "--explain", line.split()[0]).stdout.partition("\n")
        text += f"\n## {head}\n{body.rstrip()}\n"
    return text


if __name__ == "__main__":
    if shutil.which("sqlite3") is None:
        print("SKIPPED: sqlite3 is not installed")
        sys.exit(77)
    if "--update" in sys.argv:
        with open(os.path.join(DOCS, "rules.md"), "w", encoding="utf-8") as rules:
            rules.write(rules_page())
        sys.exit(0)
    unittest.main(argv=sys.argv[:1], verbosity=1)
