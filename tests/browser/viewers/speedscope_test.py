#!/usr/bin/env python3
"""The speedscope file, held to the format's schema and opened by speedscope itself in a browser.

Arguments: CIE MAKE_EXPORT EXAMPLES.
"""
import base64
import collections
import json
import os
import sys
import time
import unittest  # noqa: F401

import jsonschema

from viewer_case import DRIVE, NAMES, TIMER, TRACK, ViewerCase, main, truth_of  # isort: skip
import chromium  # noqa: E402
import npm_package  # noqa: E402


def release():
    """The web application; it is not changed and asks for nothing but its own files."""
    package = npm_package.assets("speedscope@1.22.2", "094d7b66e53678a8340199cf0e98d768cd7020eb2ffc9860daf45286bfd97392")
    return package / "dist" / "release"


def requirement():
    release()
    chromium.Chromium().__exit__()


def spans_of(profile, frames):
    """(name, start, end) in order of start. Opens and closes must nest and follow one another."""
    spans, stack, last = [], [], profile["startValue"]
    for event in profile["events"]:
        assert event["at"] >= last, "events are in order of time"
        last = event["at"]
        if event["type"] == "O":
            stack.append((event["frame"], event["at"], len(spans)))
            spans.append(None)
        else:
            frame, start, place = stack.pop()
            assert frame == event["frame"], "what opened last closes first"
            spans[place] = (frames[frame]["name"], start, event["at"])
    assert not stack and last <= profile["endValue"]
    return spans


class Speedscope(ViewerCase):
    format = "speedscope"

    def read(self, path):
        with open(path, encoding="utf-8") as file:
            document = json.load(file)
        with open(release() / "file-format-schema.json", encoding="utf-8") as file:
            jsonschema.validate(document, json.load(file))
        frames = document["shared"]["frames"]
        return {profile["name"]: spans_of(profile, frames) for profile in document["profiles"]}

    def test_an_application_of_which_everything_is_known(self):
        path, counts = self.made()
        name = "plan thread of more than 15 letters, pid 4001 tid 11"
        self.assertEqual(self.read(path), {
            # Times since the first start at 1100. What never ended is closed with the recording, at 10000.
            name: [(TIMER, 0, 300), (TIMER, 1000, 1200), (TIMER + " (never ended)", 4900, 8900)],
            'track "quoted" \x1b[31m, pid 4001 tid 12': [(TRACK, 400, 1500), (TRACK, 1500, 1800), (TRACK, 2000, 2100),
                                                         (TRACK, 2250, 2260)],
            "drive, pid 4001 tid 13": [(DRIVE, 500, 1600)],
            "pool, pid 4001 tid 14": [(DRIVE, 1900, 2300)]})
        self.assertEqual((counts["instances"], counts["skipped"]), (9, 2), "one overlaps, one ends before its start")

    def test_the_examples(self):
        for name in NAMES:
            truth = truth_of(name)
            path = self.exported(name)
            begin = min(int(row["start_ns"]) for row in truth.instances)
            expected = collections.defaultdict(list)
            for row in truth.instances:
                expected[row["tid"]].append((row["logical_id"], int(row["start_ns"]) - begin, int(row["end_ns"]) - begin))
            drawn = {profile.split()[-1]: spans for profile, spans in self.read(path).items()}
            self.assertEqual(drawn, expected)
            self.check_in_browser(path, truth)

    def check_in_browser(self, path, truth):
        """Speedscope's own table of a thread's functions names its callbacks with their shares."""
        with open(path, "rb") as file:
            data = base64.b64encode(file.read()).decode()
        script = os.path.join(self.folder.name, "profile.js")
        with open(script, "w", encoding="utf-8") as file:
            file.write(f"speedscope.loadFileFromBase64('recording.json', '{data}')")
        with chromium.Chromium() as browser:
            browser.call("Page.navigate", url=f"file://{release()}/index.html#localProfilePath={script}")
            text = self.text_of(browser, "/")
            first = min((row["tid"] for row in truth.instances), key=int)
            self.assertIn(f"tid {first} (1/", text)
            browser.evaluate("[...document.querySelectorAll('div')].filter(e => /Sandwich$/.test(e.innerText)).pop().click()")
            mine = {row["logical_id"] for row in truth.instances if row["tid"] == first}
            text = self.text_of(browser, *sorted(mine))
            # The viewer chats on its console, and Chromium on WebGL; what it cannot read is an error there.
            errors = [event for event in browser.events if event.get("method") == "Runtime.exceptionThrown"
                      or event.get("method") == "Runtime.consoleAPICalled" and event["params"]["type"] == "error"]
            self.assertEqual(errors, [])
        for callback in mine:
            self.assertIn(callback, text)

    @staticmethod
    def text_of(browser, *needed):
        for _ in range(300):
            text = browser.evaluate("document.body ? document.body.innerText : ''")
            if all(part in text for part in needed) and "tid" in text:
                return text
            time.sleep(0.05)
        raise AssertionError(f"the page does not show {needed}: {text!r}")


if __name__ == "__main__":
    main(Speedscope, requirement)
