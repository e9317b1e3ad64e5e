#!/usr/bin/env python3
"""Pages of reports in a browser: what they show, and that they ask for nothing. Usage: page_test.py PROGRAM

Exits with 77 where there is no Chromium.
"""
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import browser

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
HIGHLIGHT = (214, 0, 190)
PICTURE_SECONDS = 10  # three on a machine that does nothing else


def scan(folder):
    """Points of a trunk with a branch."""
    path = os.path.join(folder, "tree.xyz")
    with open(path, "w", encoding="ascii") as file:
        for k in range(3000):
            z, a = 2 * k / 3000, 2.4 * k
            file.write(f"{0.1 * math.cos(a)} {0.1 * math.sin(a)} {z}\n")
            if k % 3 == 0:
                s = z / 2
                file.write(f"{0.1 + s + 0.04 * math.cos(a)} {0.04 * math.sin(a)} {1 + 0.7 * s}\n")
    return path


def cube(folder):
    path = os.path.join(folder, "cube.off")
    with open(path, "w", encoding="ascii") as file:
        file.write("OFF\n8 6 0\n" + "".join(f"{k & 1} {k >> 1 & 1} {k >> 2}\n" for k in range(8)))
        file.write("4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n")
    return path


class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = cls.temporary.name
        cls.browser = browser.Browser(browser.find_program())
        smooth, part, box = str(EXAMPLES / "smooth.off"), str(EXAMPLES / "part.off"), cube(cls.folder)
        cls.remesh = cls.page("remesh", smooth, "-o", cls.at("smooth.obj"), "-n", "1500", "--iterations", "20")
        cls.features = cls.page("remesh", box, "-o", cls.at("cube.ply"), "-n", "400", "--features", "30")
        cls.tet = cls.page("tet", box, "-o", cls.at("cube.mesh"), "-n", "400", "--iterations", "20")
        cls.segment = cls.page("segment", part, "-o", cls.at("regions.ply"), "--error", "0.05")
        cls.rvd = cls.page("rvd", smooth, "-n", "100")
        cls.quality = cls.page("quality", cls.at("cube.mesh"))
        cls.tree = cls.page("tree", scan(cls.folder), "-o", cls.at("tree.obj"))
        cls.devices = cls.page("devices")

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.temporary.cleanup()

    @classmethod
    def at(cls, name):
        return os.path.join(cls.folder, name)

    @classmethod
    def page(cls, *words):
        path = cls.at(f"{len(os.listdir(cls.folder))}-{words[0]}.HTML")
        subprocess.run([PROGRAM, *words, "--report", path], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
        return path

    def open(self, path, **how):
        seconds = self.browser.open(path, **how)
        self.assertEqual(self.browser.evaluate("document.documentElement.dataset.state"), "ready")
        return seconds

    def tearDown(self):
        self.assertEqual(self.browser.problems(), [])

    def text(self, selector):
        return self.browser.evaluate(f"document.querySelector({json.dumps(selector)}).textContent")

    def choose(self, selector, value):
        self.browser.evaluate(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.value = "
                              f"{json.dumps(value)}; e.dispatchEvent(new Event('input')); "
                              "e.dispatchEvent(new Event('change')); })()")
        self.browser.settle()

    def shot(self, number):
        self.browser.evaluate("scrollTo(0, 0)")
        return self.browser.screenshot(f".view:nth-of-type({number})")

    def view(self, number):
        return browser.Picture(self.shot(number))

    def drawn(self, number):
        """The share of a view's pixels that differ from its background."""
        picture = self.view(number)
        back = picture.rows[picture.height - 8][30:33]
        return sum(p != tuple(back) for p in picture.pixels()) / (picture.width * picture.height)

    def test_every_command_has_a_page_with_something_to_see(self):
        for path, views in ((self.remesh, 2), (self.features, 2), (self.tet, 2), (self.segment, 2), (self.rvd, 2),
                            (self.quality, 1), (self.tree, 2)):
            with self.subTest(path):
                self.assertLess(self.open(path), PICTURE_SECONDS)
                self.assertEqual(self.browser.evaluate("document.querySelectorAll('.view').length"), views)
                for k in range(views):
                    self.assertGreater(self.drawn(k + 1), 0.03)
                self.assertEqual(self.browser.problems(), [])
        self.open(self.devices)
        self.assertIn("cpu", self.text("#tables"))

    def test_says_in_words_what_the_report_says(self):
        self.open(self.remesh)
        self.browser.evaluate("document.querySelector('#json').closest('details').open = true")
        self.browser.wait("document.querySelector('#json').textContent !== ''")
        report = json.loads(self.text("#json"))
        self.assertEqual(report["command"], "remesh")
        self.assertIn(f"{report['output']['vertices']:,} vertices", self.text("#words"))
        self.assertIn("CPU", self.text("#words"))
        self.assertIn("clip", self.text("#time"))
        self.assertEqual(self.browser.evaluate("document.querySelector('#download').download"), "remesh.json")
        self.assertTrue(self.browser.evaluate("document.querySelector('#download').href").startswith("blob:"))

    def test_colours_follow_the_mode(self):
        self.open(self.remesh)
        seen = set()
        for mode in ("theta_min", "q", "valence", "distance", ""):
            self.choose("#colour", mode)
            seen.add(self.shot(1))
        self.assertEqual(len(seen), 5)

    def test_a_histogram_filters_both_views(self):
        self.open(self.remesh)
        total = int(self.browser.evaluate("document.querySelector('#views').dataset.shown").split()[1])
        before = self.shot(2)
        x, y, width, height = self.browser.box("[data-measure=theta_min] svg")
        self.browser.evaluate(f"scrollTo(0, {y - 200})")
        top = self.browser.evaluate("document.querySelector('[data-measure=theta_min] svg').getBoundingClientRect().y")
        self.browser.mouse(("mousePressed", x + 2, top + 20), ("mouseMoved", x + width * 0.88, top + 20),
                           ("mouseReleased", x + width * 0.88, top + 20))
        self.browser.settle()
        said = self.text("[data-measure=theta_min] output")
        some = int(self.browser.evaluate("document.querySelector('#views').dataset.shown").split()[1])
        self.assertTrue(0 < some < total)
        self.assertTrue(said.startswith(f"{some:,} of {total:,} triangles from 0 to 5"), said)
        self.assertNotEqual(self.shot(2), before)
        self.browser.evaluate("document.querySelector('#clear').click()")
        self.browser.settle()
        self.assertEqual(self.browser.evaluate("document.querySelector('#views').dataset.shown").split()[1], str(total))

    def test_a_histogram_obeys_the_keyboard(self):
        self.open(self.remesh)
        self.browser.evaluate("document.querySelector('[data-measure=q] input').focus()")
        self.browser.press("End", "End")
        self.browser.settle()
        self.assertIn(" of ", self.text("[data-measure=q] output"))

    def test_flies_to_the_worst(self):
        for path in (self.remesh, self.tet):
            with self.subTest(path):
                self.open(path)
                before = self.shot(1)
                self.browser.evaluate("document.querySelector('#worst-list button').click()")
                self.browser.evaluate("new Promise(done => setTimeout(done, 1000))")
                self.browser.settle()
                self.assertNotEqual(self.shot(1), before)  # the views are linked
                picture = self.view(2)
                outlined = [(x, y) for y, row in enumerate(picture.rows) for x in range(picture.width)
                            if max(abs(row[3 * x + c] - HIGHLIGHT[c]) for c in range(3)) < 12]
                self.assertGreater(len(outlined), 50)
                middle = [sum(p[c] for p in outlined) / len(outlined) for c in (0, 1)]
                self.assertLess(abs(middle[0] - picture.width / 2), picture.width / 8)
                self.assertLess(abs(middle[1] - picture.height / 2), picture.height / 8)
                self.assertIn("Result", self.text("#status"))

    def test_the_cut_keeps_whole_tetrahedra(self):
        self.open(self.tet)
        whole = int(self.browser.evaluate("document.querySelector('#views').dataset.shown").split()[1])
        self.choose("#cut", "0")
        counts = []
        for place in (-100, -30, 0, 30, 100):
            self.choose("#cut-at", place)
            counts.append(int(self.browser.evaluate("document.querySelector('#views').dataset.shown").split()[1]))
        # Facets of whole tetrahedra close a surface, so their number is even.
        self.assertTrue(all(n % 2 == 0 for n in counts), counts)
        self.assertEqual((counts[0], counts[-1]), (0, whole))
        self.assertNotEqual(counts[2], whole)

    def test_regions_are_shown_alone(self):
        self.open(self.segment)
        self.browser.evaluate("document.querySelector('[data-measure=region] button').click()")
        self.browser.settle()
        count = self.text("[data-measure=region] button small")
        self.assertEqual(self.browser.evaluate("document.querySelector('#views').dataset.shown").split()[1], count)

    def test_features_can_be_left_out(self):
        self.open(self.features)
        before = self.shot(2)
        self.browser.evaluate("document.querySelector('#features').click()")
        self.browser.settle()
        self.assertNotEqual(self.shot(2), before)

    def test_turns_by_pointer_and_keys_and_back(self):
        self.open(self.quality)
        first = self.view(1)
        self.browser.mouse(("mousePressed", 400, 300), ("mouseMoved", 520, 330), ("mouseReleased", 520, 330))
        self.browser.settle()
        turned = self.shot(1)
        self.assertNotEqual(browser.Picture(turned).rows, first.rows)
        self.browser.press("ArrowLeft", "ArrowLeft")
        self.browser.settle()
        self.assertNotEqual(self.shot(1), turned)
        self.browser.press("0", "Digit0")
        self.browser.evaluate("new Promise(done => setTimeout(done, 1000))")
        self.browser.evaluate("document.activeElement.blur()")
        self.browser.settle()
        again = self.view(1)
        self.assertLess(sum(a != b for a, b in zip(first.pixels(), again.pixels())), 0.001 * first.width * first.height)

    def test_a_click_reads_a_place(self):
        self.open(self.remesh)
        x, y, width, height = self.browser.box(".view:nth-of-type(2)")
        at = (x + width / 2, y + height / 2)
        self.browser.mouse(("mousePressed", *at), ("mouseReleased", *at))
        self.browser.settle()
        self.assertRegex(self.text("#status"), r"Result: triangle \d+, smallest angle [\d.]+°, q [\d.]+")

    def test_dark_and_narrow(self):
        self.open(self.remesh, dark=True)
        self.assertLess(sum(self.view(2).rows[-8][30:33]), 150)
        self.assertGreater(self.drawn(2), 0.03)
        self.open(self.remesh, width=420, height=800)
        self.assertLessEqual(self.browser.evaluate("document.documentElement.scrollWidth"), 420)

    def test_everything_has_a_name_for_those_who_cannot_see_it(self):
        for path in (self.remesh, self.segment):
            self.open(path)
            nodes = self.browser.call("Accessibility.getFullAXTree")["nodes"]
            nameless = [node["role"]["value"] for node in nodes if not node.get("ignored")
                        and node["role"]["value"] in ("button", "slider", "combobox", "checkbox", "link", "image")
                        and not node.get("name", {}).get("value")]
            self.assertEqual(nameless, [])


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    if not browser.find_program():
        print("page_test: skipped, for there is no Chromium; apt-get install chromium", file=sys.stderr)
        sys.exit(77)
    unittest.main()
