#!/usr/bin/env python3
"""How the HTML report is used, and how it looks, in a real Chromium. Arguments: CIE EXAMPLES."""
import json
import shutil

from page import EXAMPLES, NAMES, Page, main

SIZES = ((1280, 900), (390, 844))

# Contrast of text on the page's ground, by WCAG 2.1 (relative luminance, section 1.4.3).
CONTRAST = """(() => {
  const rgb = colour => { const g = document.createElement("canvas").getContext("2d"); g.fillStyle = colour; g.fillRect(0, 0, 1, 1); return [...g.getImageData(0, 0, 1, 1).data]; };
  const luminance = colour => { const [r, g, b] = rgb(colour).map(v => { v /= 255; return v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4; }); return .2126 * r + .7152 * g + .0722 * b; };
  const ground = node => { for (; node; node = node.parentElement) { const c = getComputedStyle(node).backgroundColor; if (rgb(c)[3] === 255) return c; } return "#fff"; };
  const found = {};
  for (const node of document.querySelectorAll("h1, h2, h3, p, li, td, th, a, button, code, summary, caption, .verdict, .sign, .key span")) {
    const a = luminance(getComputedStyle(node).color), b = luminance(ground(node));
    found[node.tagName + "." + node.className] = (Math.max(a, b) + .05) / (Math.min(a, b) + .05);
  }
  return found;
})()"""
# Of what is drawn, section 1.4.11.
SHAPES = """(() => {
  const style = getComputedStyle(document.documentElement), g = document.createElement("canvas").getContext("2d");
  const luminance = name => { g.fillStyle = style.getPropertyValue("--" + name).trim(); g.fillRect(0, 0, 1, 1);
    const [r, g2, b] = [...g.getImageData(0, 0, 1, 1).data].map(v => { v /= 255; return v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4; });
    return .2126 * r + .7152 * g2 + .0722 * b; };
  const ground = luminance("paper");
  return Object.fromEntries(["run", "wait", "preempted", "blocked", "wake", "mark", "fail", "soft"].map(name => {
    const own = luminance(name); return [name, (Math.max(own, ground) + .05) / (Math.min(own, ground) + .05)]; }));
})()"""
# What an assistive program needs: pictures and fields with names, tables with headers.
NAMELESS = """[...document.querySelectorAll("svg[role=img], canvas, input, button, [role=region], .scroll")].filter(node =>
  !(node.getAttribute("aria-label") || node.getAttribute("aria-labelledby") && document.getElementById(node.getAttribute("aria-labelledby")) || node.textContent.trim()))
  .map(node => node.outerHTML.slice(0, 80))
  .concat([...document.querySelectorAll("table")].filter(t => !t.querySelector("th[scope=col]")).map(t => t.id))"""


class Use(Page):
    def setUp(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")

    def order(self):
        return self.see("#callback-table tbody td:first-child")

    def test_sorting_by_any_column_both_ways(self):
        count = self.browser.evaluate("document.querySelectorAll('#callback-table th button').length")
        for at in range(count):
            button = f"document.querySelectorAll('#callback-table th button')[{at}]"
            self.do(f"{button}.click()")
            one = self.order()
            direction = self.browser.evaluate(f"{button}.parentNode.getAttribute('aria-sort')")
            self.do(f"{button}.click()")
            self.assertNotEqual(self.browser.evaluate(f"{button}.parentNode.getAttribute('aria-sort')"), direction)
            self.assertEqual(sorted(one), sorted(self.order()))
        self.do("document.querySelector('#callback-table th button').click()")
        self.do("document.querySelector('#callback-table th button').click()")
        self.assertIn(self.order(), (sorted(self.order()), sorted(self.order(), reverse=True)))

    def test_filtering_leaves_what_has_all_words(self):
        rows = self.rows()
        full_name, cells = list(rows.items())[-1]
        for word in (cells["callback"][0].split()[0], full_name.split("(")[0]):  # short names and ids
            self.do(f"""(input => {{ input.value = {json.dumps(word.upper())}; input.dispatchEvent(new Event("input")) }})
                (document.querySelector("#callbacks ~ .bar input"))""")
            self.assertEqual(self.order(), [cells["callback"][0] for name, cells in rows.items()
                                            if word in name or word in cells["callback"][0]])
            self.assertIn(cells["callback"][0], self.order())
            self.assertLess(len(self.order()), len(rows))

    def test_a_callback_shows_its_histogram_and_its_slowest_runs(self):
        for at, name in enumerate(self.order()):
            self.do(f"document.querySelectorAll('#callback-table td button')[{at}].click()")
            self.assertEqual(self.see(".detail h3"), [name])
            slowest = self.see(".detail tbody td:nth-child(2)")
            self.assertTrue(slowest)
        self.assertEqual(self.browser.troubles(), [])

    def test_the_timeline_moves_by_keys_and_shows_a_run(self):
        picture = "document.querySelector('canvas').toDataURL()"
        seen = {self.browser.evaluate(picture)}
        for key in ("+", "+", "ArrowRight", "ArrowLeft", "-", "0"):
            self.do(f"document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}))")
            self.browser.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
            seen.add(self.browser.evaluate(picture))
        self.assertGreaterEqual(len(seen), 4, "everything, twice nearer, and to the right")
        self.do("document.querySelector('.detail tbody button').click()")
        self.assertIn("instance #", self.see(".tip")[0])
        self.assertEqual(self.browser.evaluate("document.activeElement.tagName"), "CANVAS")

    def test_prints(self):
        pdf = self.browser.pdf()
        self.assertTrue(pdf.startswith(b"%PDF"))
        self.assertGreater(len(pdf), 20_000)


class Looks(Page):
    def test_nothing_is_cut_off_at_any_width(self):
        for name in NAMES:
            for width, height in SIZES:
                self.browser.resize(width, height)
                self.page(EXAMPLES / name / "trace")
                self.assertLessEqual(self.browser.evaluate("document.scrollingElement.scrollWidth"), width)
                edges = self.browser.evaluate("""[...document.querySelectorAll("#callback-table tbody tr:first-child td[data-ns]")].slice(0, 3)
                    .map(cell => cell.getBoundingClientRect().right)""")
                self.assertEqual(len(edges), 3)
                self.assertLessEqual(max(edges), width, "response times are in sight")
        self.browser.resize(*SIZES[0])

    def test_all_columns_fit_an_ordinary_screen(self):
        spec = self.folder / "wide.yaml"
        spec.write_text("callback_groups:\n  - id: /a/plan@Timer(20000000)\n    response_deadline: 1\n", encoding="utf-8")
        self.page(EXAMPLES / "isolated_ok" / "trace", "--spec", spec)
        self.assertIn("deadline", self.see("#callback-table th"))
        wide = self.browser.evaluate("""[...document.querySelectorAll(".scroll")].filter(part => part.scrollWidth > part.clientWidth)
            .map(part => part.firstElementChild.id || part.firstElementChild.tagName)""")
        self.assertEqual(wide, [])

    def test_all_columns_fit_beside_the_bar_of_a_long_table(self):
        def change(report):
            for callback in report["callbacks"]:
                callback["missed_releases"] = 12
                for quantity in ("execution_time_ns", "preempted_ns"):
                    callback[quantity] = dict(callback["response_time_ns"])
            report["callbacks"] *= 30

        self.browser.resize(1280, 900)
        self.shown(change)
        self.assertIn("missed", self.see("#callback-table th"))
        self.assertEqual(self.browser.evaluate("""(part => [part.scrollHeight > part.clientHeight, part.scrollWidth - part.clientWidth])
            (document.querySelector(".scroll.tall"))"""), [True, 0])
        self.browser.resize(*SIZES[0])

    def test_light_and_dark_can_be_read(self):
        grounds = set()
        for scheme in ("light", "dark"):
            self.browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            self.page(EXAMPLES / "multi_threaded_fails" / "trace")
            grounds.add(self.browser.evaluate("getComputedStyle(document.body).backgroundColor"))
            contrast = self.browser.evaluate(CONTRAST)
            self.assertEqual({where: ratio for where, ratio in contrast.items() if ratio < 4.5}, {}, scheme)
            shapes = self.browser.evaluate(SHAPES)
            self.assertEqual({name: ratio for name, ratio in shapes.items() if not ratio >= 3}, {}, scheme)
        self.assertEqual(len(grounds), 2)

    def test_everything_has_a_name(self):
        self.page(EXAMPLES / "multi_threaded_fails" / "trace")
        self.assertEqual(self.browser.evaluate(NAMELESS), [])


    def test_keys_reach_everything_and_show_where_they_are(self):
        self.page(EXAMPLES / "multi_threaded_fails" / "trace")
        wanted = self.browser.evaluate("""[...document.querySelectorAll("button, input, canvas, summary, a, .scroll")]
            .filter(node => node.checkVisibility() && !node.closest("details:not([open]) > :not(summary)")).length""")
        reached = []
        for _ in range(wanted):
            for kind in ("keyDown", "keyUp"):
                self.browser.call("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
            reached.append(self.browser.evaluate("""(() => { const node = document.activeElement, style = getComputedStyle(node);
                node.dataset.reached = "yes";
                return [node.tagName, node.textContent.slice(0, 20), style.outlineStyle, parseFloat(style.outlineWidth)]; })()"""))
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('[data-reached]').length"), wanted)
        self.assertEqual([node for node in reached if node[2] == "none" or node[3] < 2], [])

    def test_the_timeline_goes_from_run_to_run_by_keys(self):
        self.page(EXAMPLES / "isolated_ok" / "trace")
        first = self.browser.evaluate("cie.timeline.marked.i")
        key = "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: '%s'}))"
        self.do(key % "n")
        self.assertEqual(self.browser.evaluate("cie.timeline.marked.i"), first + 1)
        self.assertIn("instance #", self.see(".tip")[0])
        self.do(key % "p")
        self.assertEqual(self.browser.evaluate("cie.timeline.marked.i"), first)


class Hostile(Page):
    """Names that try to become markup, written over those of an example with as many bytes."""
    GOOD = b"/a/plan@Timer(20000000)"
    EVIL = (b"</script><svg/onload=x>", b"<img src=//a onerror=x>", b'"><b onclick=x>&lt;\xff\x1b&#', b"<!--<script>\xe2\x80\xa8]]>'}-->")

    def test_names_stay_text(self):
        for evil in self.EVIL:
            with self.subTest(evil):
                self.assertEqual(len(evil), len(self.GOOD))
                trace = self.folder / "trace"
                shutil.rmtree(trace, ignore_errors=True)
                shutil.copytree(EXAMPLES / "multi_threaded_fails" / "trace", trace)
                for file in trace.rglob("*"):
                    if file.is_file():
                        file.chmod(0o644)
                        file.write_bytes(file.read_bytes().replace(self.GOOD, evil))
                self.page(trace)
                self.assertIn(evil.decode(errors="replace"), [name.split(" (pid")[0] for name in self.rows()])
                self.assertEqual(self.browser.evaluate("document.querySelectorAll('img, b, [onload], [onclick], [onerror]').length"), 0)


if __name__ == "__main__":
    main()
