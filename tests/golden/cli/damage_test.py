#!/usr/bin/env python3
"""What a recording lacks, in every output: in text, else on standard error. Arguments: CIE EXAMPLES."""
import os
import pathlib
import shutil
import sys
import unittest

from program import Folder, TRACE, cie, on_terminal

WITHOUT_A_PLACE = (
    ("instances",), ("instances", "-f", "jsonl"), ("report", "-f", "csv"), ("spec", "template"),
    ("analyze", "schedulability", "-f", "json"), ("export", "--to", "dot"), ("export", "--to", "chrome"),
    ("export", "--to", "perfetto"), ("export", "--to", "csv", "--table", "callbacks"), ("export", "--to", "sqlite"),
    ("export", "--to", "parquet", "--partition"))


class Damage(Folder):
    def damaged(self):
        """Its largest stream ends within a packet."""
        trace = self.path("damaged")
        shutil.copytree(TRACE, trace, copy_function=shutil.copyfile)
        streams = [path for path in pathlib.Path(trace, "ust").rglob("*") if path.is_file() and path.name != "metadata"]
        largest = max(streams, key=lambda path: path.stat().st_size)
        os.truncate(largest, largest.stat().st_size * 2 // 3)
        return trace

    def in_report(self, trace):
        """As `cie report` tells it, line by line."""
        lines = cie("report", trace).stdout.decode().splitlines()
        first = next(i for i, line in enumerate(lines) if " x " in line)
        return [line.strip() for line in lines[first:lines.index("")]]

    def test_output_without_a_place_for_it_tells_it_on_standard_error(self):
        trace = self.damaged()
        said = self.in_report(trace)
        for command in WITHOUT_A_PLACE:
            with self.subTest(command=command):
                done = cie(*command, trace, "-o", self.path("_".join(command).replace("-", "")))
                told = [line.removeprefix("cie: ") for line in done.stderr.decode().splitlines()]
                told = [line for line in told if "does not say when it was made" not in line]
                self.assertEqual(len(told), len(said), (told, said))
                for line, screen in zip(told, said):  # the screen has less room
                    self.assertTrue(line.startswith(screen.removesuffix("...")), (line, screen))
                self.assertIn(done.returncode, (0, 1, 3))

    def test_a_verdict_with_room_for_it_names_the_whole_place(self):
        trace = self.damaged()
        _, shown, _ = on_terminal("verify", trace, "--only", "T1", columns=80, environment={"NO_COLOR": "1"})
        text = "".join(shown.decode().split())
        self.assertIn("ust/uid/0/64-bit/channel0_1atbyte", text)
        self.assertLessEqual(len(shown.splitlines()), 23)

    def test_a_whole_recording_says_nothing(self):
        for command in WITHOUT_A_PLACE[:-1]:
            self.assertEqual(cie(*command, TRACE, "-o", self.path("out")).stderr, b"", command)

    def test_a_recording_without_callbacks_says_so(self):
        trace = self.path("empty")
        shutil.copytree(TRACE, trace, copy_function=shutil.copyfile)
        for stream in pathlib.Path(trace, "ust").rglob("channel*"):
            os.truncate(stream, 0)
        report = " ".join(cie("report", trace).stdout.decode().split())
        for command in WITHOUT_A_PLACE:
            done = cie(*command, trace, "-o", self.path("_".join(command).replace("-", "")))
            said = next(line for line in done.stderr.decode().splitlines() if "No callback was seen" in line)
            self.assertIn(said.removeprefix("cie: "), report, command)
            self.assertEqual(done.returncode, 0, command)

    def test_bounds_say_it_in_their_text(self):
        trace = self.damaged()
        done = cie("analyze", "schedulability", trace)
        self.assertEqual(done.stderr, b"")
        head = " ".join(done.stdout.decode().split("\n\n")[0].split())
        for line in self.in_report(trace):
            self.assertIn(line.removesuffix("..."), head)

    def test_a_template_has_it_as_a_comment(self):
        trace = self.damaged()
        target = self.path("spec.yaml")
        self.assertEqual(cie("spec", "template", trace, "-o", target).returncode, 0)
        head = self.read("spec.yaml").decode().partition("callback_groups")[0]
        comment = " ".join(line.removeprefix("# ") for line in head.splitlines())
        for line in self.in_report(trace):
            self.assertIn(line.removesuffix("..."), comment)
        self.assertEqual(cie("spec", "check", target).returncode, 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
