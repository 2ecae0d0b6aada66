"""What the programs themselves say of their commands, options and values: what pages and completion are held against."""
import os
import re
import subprocess

# What a command wants before it looks at an option's value.
WANTED = {"analyze": ["schedulability"], "export": ["--to", "csv"], "view": ["--port", "0"], "diff": ["/nonexistent"],
          "cie-demo": ["--duration", "0"]}
NOT_THERE = "not available in this version"


class Option:
    """An option as --help lists it: its names, whether a value follows, and the choices that --help names."""

    def __init__(self, line):
        self.declaration = re.split(r"\s{2,}", line.strip())[0]
        names, _, rest = self.declaration.partition(" ")
        self.names = names.split(",")
        self.takes_value = bool(rest)


class Programs:
    def __init__(self, folder):
        self.folder = os.path.abspath(folder)

    def run(self, *words):
        return subprocess.run([os.path.join(self.folder, words[0]), *words[1:]], stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=200, check=False, cwd="/",
                              env={**os.environ, "PATH": self.folder + ":" + os.environ.get("PATH", "")})

    def commands(self):
        """Of cie, that this version has: name and summary."""
        listed = self.run("cie", "--help").stdout.split("Commands:\n")[1].split("\n\n")[0]
        rows = [line.split(None, 1) for line in listed.splitlines()]
        return {name: summary for name, summary in rows if NOT_THERE not in summary}

    def help(self, *words):
        result = self.run(*words, "--help")
        assert result.returncode == 0 and result.stdout, f"{words}: {result.stderr}"
        return result.stdout

    def options(self, *words):
        return [Option(line) for line in self.help(*words).splitlines() if re.match(r"\s{2}-", line)]

    def exit_codes(self, *words):
        text = " ".join(self.help(*words).split())
        found = re.search(r"Exit (?:codes|status): (.*?)\.(?: |$)", text)
        return set(re.findall(r"(?:^|, )(\d) ", found.group(1))) if found else set()

    def values(self, words, option):
        """What the option may be set to, by what a wrong value is answered with; empty: anything."""
        if not option.takes_value or "--output" in option.names:
            return []
        wanted = WANTED.get(words[-1], [])
        before = [word for word in wanted if words[-1] != "export" or "--to" not in option.names]
        return self.available(*words, *before, "/nonexistent", option.names[-1], "?")

    def actions(self, command):
        """What may follow the command as its first word: check, template. Empty: files."""
        return self.available("cie", command, "?") if command in ("spec", "analyze") else []

    def available(self, *words):
        found = re.search(r"available: (.*)", self.run(*words).stderr)
        return found.group(1).split(", ") if found else []


# Programs that are not cie itself, with the command that starts them.
STARTED = {"cie-run": "run", "cie-record": "record", "cie-collect": "collect", "cie-live": "live"}
OTHERS = ["cie-demo"]
