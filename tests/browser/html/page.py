"""A page of the HTML report in a real Chromium, for the tests of this folder. Their arguments: CIE EXAMPLES."""
import json
import re
import sys
import tempfile
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "browser"), str(TESTS / "support")]
from chromium import Chromium  # noqa: E402  pylint: disable=wrong-import-position
from cie import Cie  # noqa: E402  pylint: disable=wrong-import-position

CIE = Cie(sys.argv[1])
EXAMPLES = Path(sys.argv[2]).resolve()
NAMES = ("isolated_ok", "multi_threaded_fails")

TEXTS = """[...document.querySelectorAll(%s)].map(node => node.textContent)"""


def cie(*arguments, codes=(0,)):
    """What it prints, to the byte; it says nothing beside."""
    done = CIE.run(*arguments, text=False)
    assert done.returncode in codes and done.stderr == b"", (arguments, done.returncode, done.stderr)
    return done.stdout.decode()


DOCUMENT = re.compile(r'(<script type="application/json" id="document">)(.*?)(</script>)', re.S)


def document_of(html):
    """What the page draws."""
    return json.loads(DOCUMENT.search(html)[2])


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.browser = Chromium()
        cls.addClassCleanup(cls.browser.__exit__)

    def page(self, trace, *options):
        path = self.folder / "page.html"
        cie("report", trace, "--format", "html", "-o", path, *options)
        self.browser.events.clear()
        self.browser.open(path.as_uri() + f"?{self.id()}")
        self.assertEqual(self.browser.troubles(), [])
        self.assertEqual(self.browser.requests(), [path.as_uri() + f"?{self.id()}"], "it asked for something")
        return path.read_text(encoding="utf-8")

    def see(self, selector):
        return self.browser.evaluate(TEXTS % json.dumps(selector))

    def do(self, script):
        return self.browser.evaluate(f"void ({script})")

    def shown(self, change, of="report"):
        """The page of an example whose data `change` changed: its report, or the whole document."""
        path = self.folder / "changed.html"
        cie("report", EXAMPLES / "isolated_ok" / "trace", "--format", "html", "-o", path)
        html = path.read_text(encoding="utf-8")
        document = document_of(html)
        self.names = document["names"]["callbacks"]
        change(document[of] if of else document)
        text = json.dumps(document).replace("<", "\\u003c")
        path.write_text(DOCUMENT.sub(lambda found: found[1] + text + found[3], html), encoding="utf-8")
        self.browser.events.clear()
        self.browser.open(path.as_uri() + f"?{self.id()}")
        self.assertEqual(self.browser.troubles(), [])
        return document["report"]

    def rows(self):
        """Of the callbacks' table, by what the first cell's tip says, cells by their headers: [text, exact number]."""
        headers = self.see("#callback-table th")
        rows = self.browser.evaluate("""[...document.querySelectorAll("#callback-table tbody tr")].map(row =>
            [row.querySelector("button").title, [...row.cells].map(cell => [cell.textContent, cell.dataset.ns ?? null])])""")
        found = {name: dict(zip(headers, cells)) for name, cells in rows}
        self.assertEqual(len(found), len(rows), "names that are told apart")
        return found


def main():
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
