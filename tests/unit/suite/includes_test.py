#!/usr/bin/env python3
"""Each file of the product includes what it uses of the product. Argument: SOURCES.

Unity builds and precompiled headers hide a missing #include until somebody builds without them. A name counts that exactly one
header declares in a namespace: a type wherever it stands, a function where it is called with its namespace.
"""
import collections
import os
import re
import sys
import tempfile
import unittest

SOURCES = os.path.abspath(sys.argv[1])
FOLDERS = ("tracepoints", "executor", "analysis", "viewer_export")
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)
TYPE = re.compile(r"(?:enum class|enum|struct|class)\s+(?:\[\[\w+\]\]\s*)?([A-Z]\w+)\b(?!(?:\s*:[^;{]*)?;)|using\s+([A-Z]\w+)\s*=")
FUNCTION = re.compile(r"^(?!using\b|return\b|friend\b)(?:[\w:\[\]]+[\w:<>,*& ]*[ *&>\]])([a-z]\w+)\(", re.M)
CALL = re.compile(r"\b(?:analysis|viewer_export|cli|live|ros2|ctf)::([a-z]\w+)\(")


def code(text):
    """Without comments, the contents of strings and directives."""
    text = re.sub(r'R"(\w*)\(.*?\)\1"', '""', text, flags=re.S)
    text = re.sub(r'"(?:[^"\\\n]|\\.)*"', '""', text)
    text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)
    return re.sub(r"^\s*#(?:[^\n]*\\\n)*[^\n]*$", "", text, flags=re.M)


class Tree:
    """The C++ files below the folders, by path from the root."""

    def __init__(self, root, folders):
        self.code, self.included, self.by_end = {}, {}, collections.defaultdict(list)
        for folder in folders:
            for place, _, names in os.walk(os.path.join(root, folder)):
                for name in names:
                    if name.endswith((".hpp", ".cpp", ".h")):
                        self.add(root, os.path.relpath(os.path.join(place, name), root))
        self.types, self.functions = self.declared(TYPE), self.declared(FUNCTION)

    def add(self, root, path):
        with open(os.path.join(root, path), encoding="utf-8") as file:
            text = file.read()
        self.code[path], self.included[path] = code(text), INCLUDE.findall(text)
        parts = path.split(os.sep)
        for at in range(len(parts)):
            self.by_end["/".join(parts[at:])].append(path)

    def declared(self, pattern):
        """name -> the headers that declare it outside of classes, which style indents. A name that a class has, too, is none."""
        found, inner = collections.defaultdict(set), set()
        for path, text in self.code.items():
            for match in pattern.finditer(text):
                name = next(filter(None, match.groups()))
                starts_line = match.start() == 0 or text[match.start() - 1] == "\n"
                if starts_line and path.endswith(".hpp"):
                    found[name].add(path)
                elif pattern is TYPE:
                    inner.add(name)
        return {name: next(iter(paths)) for name, paths in found.items() if len(paths) == 1 and name not in inner}

    def reached(self, path):
        """The files that one includes, itself among them."""
        seen, left = {path}, [path]
        while left:
            at = left.pop()
            for name in self.included[at]:
                beside = os.path.normpath(os.path.join(os.path.dirname(at), name))
                for other in [beside] if beside in self.code else self.by_end.get(name, []):
                    if other not in seen:
                        seen.add(other)
                        left.append(other)
        return seen

    def missing(self):
        """Lines FILE uses NAME of HEADER."""
        lines = []
        for path, text in sorted(self.code.items()):
            reached = self.reached(path)
            forward = set(re.findall(r"\b(?:class|struct|enum class)\s+([A-Z]\w+)(?:\s*:[^;{]*)?;",
                                     "".join(self.code[other] for other in reached)))
            used = [(name, self.types) for name in set(re.findall(r"(?<!::)\b[A-Z]\w+\b|(?<=analysis::)[A-Z]\w+", text)) - forward]
            used += [(name, self.functions) for name in set(CALL.findall(text))]
            for name, declared in sorted(used, key=lambda pair: pair[0]):
                header = declared.get(name, path)
                if header not in reached and (header.split("/")[0] == path.split("/")[0] or "/include/" in header):
                    lines.append(f"{path} uses {name} of {header}")
        return lines


class Includes(unittest.TestCase):
    def test_each_file_includes_what_it_uses(self):
        tree = Tree(SOURCES, FOLDERS)
        self.assertGreater(len(tree.types), 500)
        self.assertGreater(len(tree.functions), 300)
        self.assertEqual([line for line in tree.missing() if not line.startswith("executor/rclcpp/")], [])

    def test_what_is_missing_is_found(self):
        files = {"a/host.hpp": "enum class HostIndex : int {};\nint size_of(int one);\n",
                 "a/uses.hpp": '#include "other.hpp"\nclass Losses {\n  void add(HostIndex host);\n};\n',
                 "a/calls.cpp": "int size() { return analysis::size_of(1); }  // HostIndex\n",
                 "a/right.cpp": '#include "between.hpp"\nHostIndex host = analysis::size_of(1);\n',
                 "a/between.hpp": "#include <a/host.hpp>\n",
                 "a/forward.hpp": "enum class HostIndex : int;\nvoid add(HostIndex host);\n",
                 "a/other.hpp": ""}
        with tempfile.TemporaryDirectory() as root:
            os.mkdir(os.path.join(root, "a"))
            for path, text in files.items():
                with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                    file.write(text)
            self.assertEqual(Tree(root, ["a"]).missing(),
                             ["a/calls.cpp uses size_of of a/host.hpp", "a/uses.hpp uses HostIndex of a/host.hpp"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
