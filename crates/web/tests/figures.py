"""Curves and maps in a real browser: keys, linked zoom, export, and distinct colours; called like
`browser.py`."""

import csv
import io
import itertools
import json
import pathlib
import re
import statistics
import unittest
import xml.etree.ElementTree

from harness import CONFIG, NARROW, BrowserTest, Fleet

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

N_GENERATIONS, N_INDIVIDUALS = 12, 32


class Figures(BrowserTest):
    @classmethod
    def setUpClass(cls):
        cls.start_fleet(generations=N_GENERATIONS)

    def open(self, path):
        self.browser.get(self.fleet.pages + path)

    def press(self, selector, *keys):
        self.script(f"document.querySelector('{selector}').focus()")
        webdriver.ActionChains(self.browser).send_keys(*keys).perform()

    def test_keys_go_through_a_curve_and_zoom_it(self):
        self.open("/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        self.press(".chart > svg", Keys.HOME)
        self.assertIn("generation 0: best", self.text(".chart .readout"))
        self.press(".chart > svg", Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
        self.assertIn("generation 2: best", self.text(".chart .readout"))
        self.press(".chart > svg", Keys.END)
        self.assertIn(f"generation {N_GENERATIONS - 1}: best", self.text(".chart .readout"))
        labels = lambda: self.script("return document.querySelector('.chart > svg').textContent")
        whole = labels()
        self.press(".chart > svg", "+")
        self.assertNotEqual(labels(), whole)
        self.press(".chart > svg", Keys.ESCAPE)
        self.assertEqual(labels(), whole)

    def test_keys_go_through_the_map_and_enter_plays(self):
        self.open("/experiment/1")
        readout = ".heat-map .readout"
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        self.press(".cells", Keys.ARROW_DOWN)
        self.wait_for_text(readout, "generation 0, individual 0:")
        self.press(".cells", Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_DOWN, Keys.ARROW_DOWN, Keys.ARROW_UP)
        self.wait_for_text(readout, "generation 2, individual 1:")
        axes = self.text(".cells svg")
        self.assertIn("generation", axes)
        self.assertIn("individual", axes)
        self.press(".cells", Keys.ENTER)
        self.wait(lambda: "/replay/1@2/1" in self.browser.current_url, "it does not play")

    def test_curve_and_map_show_the_same_generations(self):
        self.open("/experiment/1")
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        ticks = lambda selector: self.script(f"return [...document.querySelector('{selector}').querySelectorAll('text[text-anchor=middle]')].map((it) => it.textContent).filter((it) => /^[0-9]+$/.test(it)).map(Number)")
        self.assertEqual(max(ticks(".cells svg")), max(ticks(".chart > svg")))
        self.press(".chart > svg", Keys.HOME, "+", "+")
        self.wait(lambda: max(ticks(".cells svg")) < 6, "the map does not follow the curve")
        self.press(".cells", Keys.ESCAPE)
        self.wait(lambda: max(ticks(".chart > svg")) >= 10, "the curve does not follow the map")
        cells = self.find(".cells canvas")
        drag = webdriver.ActionChains(self.browser).move_to_element_with_offset(cells, -100, 0)
        drag.click_and_hold().move_by_offset(200, 0).release().perform()
        self.wait(lambda: min(ticks(".chart > svg")) > 0, "dragging in the map does not zoom the curve")
        self.assertIn("/experiment/1", self.browser.current_url)

    def test_figures_are_saved_as_svg_and_csv(self):
        self.open("/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        rows = list(csv.reader(io.StringIO(self.saved(".chart .save:last-child"))))
        self.assertEqual(rows[0], ["generation", "best", "mean", "band low", "band high"])
        self.assertEqual([int(it[0]) for it in rows[1:]], list(range(N_GENERATIONS)))
        answer = self.script("return fetch('/api/experiments/1/generations').then((it) => it.json())")
        self.assertEqual([float(it[1]) for it in rows[1:]], [it[1] for it in answer["generations"]])
        self.open("/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        svg = self.saved(".chart .save")
        lines = [it for it in xml.etree.ElementTree.fromstring(svg).iter() if it.get("data-name") == "mean"]
        self.assertEqual(len(lines), 1)
        self.assertRegex(lines[0].get("stroke"), r"^rgb|^#")
        self.open("/experiment/1")
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        cells = list(csv.reader(io.StringIO(self.saved(".heat-map .save:last-child"))))
        self.assertEqual(len(cells), 1 + N_GENERATIONS * N_INDIVIDUALS)
        self.open("/experiment/1")
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        self.assertIn("data:image/png", self.saved(".heat-map .save"))

    def genetic(self, n_generations):
        """The number of a run whose individuals have parents."""
        config = json.loads(CONFIG.read_text())
        config["algorithm"]["name"] = "GA"
        config["algorithm"]["populations"]["network"]["params"].update(crossover_operator="uniform", num_elite=2)
        file = pathlib.Path(self.fleet.directory.name) / "genetic.json"
        file.write_text(json.dumps(config))
        self.fleet.swarmctl("submit", str(file), "--generations", str(n_generations), "--watch")
        return max(it["id"] for it in json.loads(self.fleet.swarmctl("list")))

    def test_children_are_seen_beside_their_parents(self):
        n_generations = 8
        run = self.genetic(n_generations)
        n_children = (n_generations - 1) * N_INDIVIDUALS
        self.open(f"/experiment/{run}")
        panel = self.find("details.families")
        self.wait(panel.is_displayed, "there is no panel")
        panel.find_element(By.TAG_NAME, "summary").click()
        self.wait(lambda: panel.get_attribute("data-children") == str(n_children), "children are missing")
        for label in ["mean fitness of the parents", "fitness of the child"]:
            self.assertIn(label, self.text(".families .cells svg"))
        self.find(".families .diagonal")
        self.assertIn(f"elite: {2 * (n_generations - 1)}, ", self.text(".families .keys"))
        self.script("document.querySelector('.families').scrollIntoView()")
        self.picture("families")
        # The page has the same births as `swarmctl lineage`.
        told = json.loads(self.fleet.swarmctl("lineage", f"{run}@5/9", "--depth", "1"))["populations"][0]["ancestors"]
        rows = list(csv.DictReader(io.StringIO(self.saved(".families .save:last-child"))))
        self.assertEqual(len(rows), n_children)
        row = next(it for it in rows if (it["generation"], it["individual"]) == ("5", "9"))
        self.assertEqual((row["operator"], float(row["fitness"])), (told[0]["operator"], told[0]["fitness"]))
        parents = {int(row[name]): float(row[f"fitness of {name}"]) for name in ["parent", "other parent"] if row[name]}
        self.assertEqual(parents, {it["individual"]: it["fitness"] for it in told[1:]})
        svg = xml.etree.ElementTree.fromstring(self.saved(".families .save"))
        points = [it.get("d").count("M") for it in svg.iter() if it.get("stroke-linecap") == "round"]
        self.assertEqual(sum(points), n_children)
        # A zoom of the curve chooses generations.
        self.press(".chart > svg", Keys.HOME, "+", "+")
        self.wait(lambda: 0 < int(panel.get_attribute("data-children")) < n_children / 2, "it does not follow the curve")
        self.press(".chart > svg", Keys.ESCAPE)
        self.narrow()
        self.assertLessEqual(self.width(), NARROW)
        self.script("document.querySelector('.families').scrollIntoView()")
        self.picture("narrow-families")
        self.press(".families .cells", Keys.HOME, Keys.ARROW_DOWN, Keys.ARROW_RIGHT)
        self.wait_for_text(".families .readout", "generation 2, individual 1:")
        self.press(".families .cells", Keys.ENTER)
        self.wait(lambda: f"/replay/{run}@2/1" in self.browser.current_url, "it does not play")

    def test_cells_of_a_repertoire_are_judged_and_play(self):
        config = json.loads(CONFIG.read_text())
        config["algorithm"] |= {"name": "MAP-Elites", "judgement_trials": 3, "descriptors": [
            {"measure": "leaders", "range": [0, 5], "cells": 8},
            {"measure": "one_leader", "of": "end", "range": [0, 1], "cells": 4},
        ]}
        config["algorithm"]["populations"]["network"]["params"] = {}
        file = pathlib.Path(self.fleet.directory.name) / "repertoire.json"
        file.write_text(json.dumps(config))
        self.fleet.swarmctl("submit", str(file), "--generations", "6", "--watch")
        run = max(it["id"] for it in json.loads(self.fleet.swarmctl("list")))
        told = json.loads(self.fleet.swarmctl("repertoire", str(run)))
        shown = [it for it in told["elites"] if it["shown"]]
        self.open(f"/experiment/{run}")
        panel = self.find("details.repertoire")
        self.wait(lambda: panel.get_attribute("data-cells") == str(len(shown)), "cells are missing")
        self.wait_for_text(".repertoire p.muted", f"QD score {told['corrected']['qd_score']:.3f}")
        for label in ["leaders (mean)", "one_leader (end)"]:
            self.assertIn(label, self.text(".repertoire .cells svg"))
        rows = list(csv.DictReader(io.StringIO(self.saved(".repertoire .save:last-child"))))
        self.assertEqual({it["address"]: float(it["fitness"]) for it in rows}, {it["address"]: it["judged"]["fitness"] for it in shown})
        self.script("document.querySelector('.repertoire').scrollIntoView()")
        self.picture("repertoire")
        elite = shown[0]
        across, up = elite["judged"]["cell"]
        self.press(".repertoire .cells", Keys.HOME, Keys.PAGE_DOWN, *[Keys.ARROW_RIGHT] * across, *[Keys.ARROW_UP] * up)
        _, place = elite["address"].split("@")
        generation, individual = place.split("/")
        self.wait_for_text(".repertoire .readout", f"cell {across}, {up}: ")
        self.assertIn(f"individual {individual} of generation {generation}", self.text(".repertoire .readout"))
        self.press(".repertoire .cells", Keys.ENTER)
        self.wait(lambda: f"/replay/{run}@{place}" in self.browser.current_url, "it does not play")
        for narrow in [False, True]:
            if narrow:
                self.narrow()
                self.prefer("dark")
            self.open(f"/experiment/{run}")
            self.find(f"details.repertoire[data-cells='{len(shown)}']")
            self.assert_accessible(f"a repertoire{', narrow' if narrow else ''}")
            if narrow:
                self.assertLessEqual(self.width(), NARROW, "it is too wide")

    def front_file(self):
        """A file that evolves a front."""
        config = json.loads(CONFIG.read_text())
        config["algorithm"] |= {"name": "NSGA-II", "judgement_trials": 3, "aims": [
            {"measure": "leaders", "direction": "minimise"},
        ]}
        config["algorithm"]["populations"]["network"]["params"] = {}
        file = pathlib.Path(self.fleet.directory.name) / "front.json"
        file.write_text(json.dumps(config))
        return str(file)

    def test_a_late_answer_about_a_front_is_followed_by_that_of_the_end(self):
        self.complete_before_an_answer("/front", self.front_file())
        self.wait_for_text(".front", "judged on new trials")

    def test_points_of_a_front_are_judged_and_play(self):
        self.fleet.swarmctl("submit", self.front_file(), "--generations", "6", "--watch")
        run = max(it["id"] for it in json.loads(self.fleet.swarmctl("list")))
        told = json.loads(self.fleet.swarmctl("front", str(run)))
        shown = sorted((it for it in told["elites"] if it["shown"]), key=lambda it: it["judged"]["aims"]["leaders_mean"])
        self.open(f"/experiment/{run}")
        panel = self.find("details.front")
        self.wait(lambda: panel.get_attribute("data-points") == str(len(shown)), "points are missing")
        self.wait_for_text(".front p:nth-of-type(2)", f"hypervolume {told['figures']['hypervolume']:.4f}".replace("-", "−"))
        for label in ["leaders (mean), minimise", "fitness"]:
            self.assertIn(label, self.text(".front .cells svg"))
        rows = list(csv.DictReader(io.StringIO(self.saved(".front .save:last-child"))))
        self.assertEqual({it["address"]: float(it["fitness"]) for it in rows}, {it["address"]: it["judged"]["fitness"] for it in shown})
        self.script("document.querySelector('.front').scrollIntoView()")
        self.picture("front")
        for width in [390, 2560]:
            self.browser.set_window_size(width, 900)
            self.wait(lambda: self.width() <= self.script("return innerWidth"), "the page is wider than the window")
            self.press(".front .cells", Keys.END)
            self.script("document.querySelector('.front').scrollIntoView()")
            self.picture(f"front-{width}")
        self.press(".front .cells", Keys.HOME)
        _, place = shown[0]["address"].split("@")
        generation, individual = place.split("/")
        self.wait_for_text(".front .readout", f"individual {individual} of generation {generation}")
        self.press(".front .cells", Keys.ENTER)
        self.wait(lambda: f"/replay/{run}@{place}" in self.browser.current_url, "it does not play")

    def test_a_click_on_a_child_plays_it(self):
        run = self.genetic(3)
        self.open(f"/experiment/{run}")
        self.wait_for_text(".state", "completed")
        self.script("document.querySelector('.families').open = true")
        self.find(".families[data-children='64']")
        self.press(".families .cells", Keys.END)
        said = self.text(".families .readout")
        # The pointer moves to the highest point of its row of pixels.
        canvas = self.find(".families canvas")
        self.script("document.querySelector('.families').scrollIntoView()")
        at = self.script("""
            const canvas = document.querySelector('.families canvas');
            const { left, top, width, height } = canvas.getBoundingClientRect();
            for (let y = 0; y < height; y++) for (let x = 0; x < width; x += 2) {
                canvas.dispatchEvent(new PointerEvent('pointermove', { clientX: left + x, clientY: top + y }));
                if (document.querySelector('.families .readout').textContent) return [x - width / 2, y - height / 2 + 8];
            }
        """)
        self.assertIn("generation 2, individual 31", said)
        webdriver.ActionChains(self.browser).move_to_element_with_offset(canvas, *map(int, at)).perform()
        generation, individual = re.match(r"generation (\d+), individual (\d+)", self.text(".families .readout")).groups()
        webdriver.ActionChains(self.browser).click().perform()
        self.wait(lambda: f"/replay/{run}@{generation}/{individual}" in self.browser.current_url, "it does not play")

    def test_a_distribution_has_no_parents(self):
        self.expected_complaints = ["400 (Bad Request)"]
        self.open("/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        self.assertFalse(self.find(".families").is_displayed())
        status, said = self.script("return fetch('/api/experiments/1/families').then(async (it) => [it.status, await it.text()])")
        self.assertEqual(status, 400)
        self.assertIn("individuals have no parents", said)

    def test_thirty_runs_have_thirty_looks(self):
        self.open("/compare")
        self.find(".chart")
        for n in [1, 5, 10, 11, 30, 90]:
            looks = self.browser.execute_async_script("""
                const [n, done] = arguments;
                import('swarm/scales.js').then(({ seriesStyle }) => done(Array.from({ length: n }, (_, i) => Object.values(seriesStyle(i, n)).join())));
            """, n)
            self.assertEqual(len(set(looks)), n)

    def test_groups_are_compared_as_by_the_client_and_files_by_their_keys(self):
        first = 1 + len(json.loads(self.fleet.swarmctl("list")))
        self.fleet.swarmctl("submit", str(CONFIG), "--generations", "2", "--group", "sizes", "--set", "algorithm.population_size=8,16", "--seeds", "0..2")
        self.fleet.swarmctl("watch", "--quiet", "sizes")
        runs = [",".join(str(first + i) for i in part) for part in (range(3), range(3, 6))]
        self.open(f"/compare?runs={','.join(runs)}&as=groups")
        self.wait_for_text(".differences", "algorithm.population_size")
        self.wait_for_text(".chart figcaption", "3 runs, median and quartiles")
        answer = self.script(f"return fetch('/api/compare?samples={';'.join(runs)}').then((it) => it.json())")
        ours = answer["quantities"][0]
        told = json.loads(self.fleet.swarmctl("compare", "sizes"))["quantities"][0]
        self.assertEqual([it["median"] for it in ours["samples"]], [it["median"] for it in told["samples"]])
        self.assertEqual([it["iqm"] for it in ours["samples"]], [it["iqm"] for it in told["samples"]])
        pair = told["pairs"][0]
        self.assertEqual((ours["pairs"][0]["probability"], ours["pairs"][0]["p"]), (pair["probability_of_improvement"], pair["p"]))
        rows = self.script("return [...document.querySelectorAll('.differences tbody tr')].map((it) => it.lastElementChild.textContent)")
        self.assertEqual(rows, ["8"] * 3 + ["16"] * 3)
        self.picture("compare-groups")

    def pair(self, group):
        """The numbers of two new runs."""
        first = 1 + len(json.loads(self.fleet.swarmctl("list")))
        self.fleet.swarmctl("submit", str(CONFIG), "--generations", "2", "--group", group, "--seeds", "0..1")
        self.fleet.swarmctl("watch", "--quiet", group)
        return first, first + 1

    def tick(self, run):
        """Chooses a run, or no longer."""
        self.browser.execute_script("""
            const of = (it) => it.textContent.startsWith(`${arguments[0]} `);
            [...document.querySelectorAll('.choices label')].find(of).querySelector('input').click();
        """, run)

    def test_a_late_answer_about_other_runs_is_not_shown(self):
        kept, late = self.pair("late")
        self.open(f"/compare?runs={kept}")
        shown = lambda: [self.texts(".chart .keys .key"), self.texts(".statistics td:first-child"), self.texts(".differences td:first-child")]
        self.find(".differences")
        before = shown()
        self.assertEqual(len(before[0]), 1, before)
        self.hold(f"/api/experiments/{late}/generations")
        self.tick(late)
        self.tick(late)
        self.release()
        self.assertEqual(shown(), before)
        # Nothing waits for its answer.
        self.tick(late)
        self.wait(lambda: [len(it) for it in shown()[::2]] == [2, 2], "the run is never shown")

    def test_a_refused_comparison_is_named_until_another_one_succeeds(self):
        first, second = self.pair("refused")
        self.open(f"/compare?runs={first}")
        self.find(".statistics")
        self.refuse("/api/compare", "too much at once")
        self.tick(second)
        self.wait_for_text("#problem", "too much at once")
        self.assertEqual(self.texts(".statistics, .differences, .loading"), [], "they are about other runs")
        self.find("#problem button").click()
        choose = lambda value: self.script(f"const it = document.querySelector('#along'); it.value = '{value}'; it.dispatchEvent(new Event('change'))")
        choose("episodes")
        self.wait_for_text("#problem", "too much at once")
        self.refuse("/api/nothing", "")
        choose("time")
        self.find(".statistics")
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, "#problem"), [])

    def test_swept_values_are_shown_beside_the_worth_of_champions(self):
        before = len(json.loads(self.fleet.swarmctl("list")))
        self.fleet.swarmctl("submit", str(CONFIG), "--generations", "2", "--group", "swept", "--set", "algorithm.population_size=8,16", "--seeds", "0..2")
        self.fleet.swarmctl("watch", "--quiet", "swept")
        ids = [before + 1 + i for i in range(6)]
        compare = lambda ids: "/compare?runs=" + ",".join(map(str, ids))
        self.open(compare(ids))
        self.find(".parallel .line")
        its = self.script("return fetch('/api/experiments').then((it) => it.json())")["experiments"]
        worth = {it["id"]: it["champion"] for it in its if it["id"] in ids}
        rows = list(csv.DictReader(io.StringIO(self.saved(".parallel .save:last-child"))))
        self.assertEqual({int(it["id"]): float(it["champion"]) for it in rows}, worth)
        self.assertEqual([it["algorithm.population_size"] for it in sorted(rows, key=lambda it: int(it["id"]))], ["8"] * 3 + ["16"] * 3)
        self.open(compare(ids))
        self.find(".parallel .line")
        told = list(csv.DictReader(io.StringIO(self.saved(".importance .save:last-child"))))
        groups = [[worth[it] for it in part] for part in (ids[:3], ids[3:])]
        middle = statistics.fmean(worth.values())
        between = sum(3 * (statistics.fmean(it) - middle) ** 2 for it in groups)
        total = sum((it - middle) ** 2 for it in worth.values())
        self.assertEqual([it["key"] for it in told], ["algorithm.population_size"])
        self.assertAlmostEqual(float(told[0]["eta squared"]), between / total, places=12)
        self.assertEqual(float(told[0]["eta squared by chance"]), 1 / 5)
        self.assertIn("one-way η²", self.text(".importance svg"))
        best = int(rows[-1]["id"])
        self.assertEqual(worth[best], max(worth.values()))
        self.press(".parallel svg", Keys.END)
        self.wait(lambda: self.text(".parallel .readout").startswith(f"{best} quickstart"), f"it says {self.text('.parallel .readout')}")
        self.script("document.querySelector('.swept').scrollIntoView()")
        self.picture("swept")
        self.narrow()
        self.assertLessEqual(self.width(), NARROW)
        self.script("document.querySelector('.swept').scrollIntoView()")
        self.picture("narrow-swept")
        self.press(".parallel svg", Keys.ENTER)
        self.wait(lambda: self.browser.current_url.endswith(f"/experiment/{best}"), "Enter opens nothing")
        self.open(compare(ids[:5]))
        self.find(".differences")
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, ".swept"), [], "five runs say nothing")

    def test_keys_go_through_the_timeline_and_a_button_saves_it(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        for name in ["left", "right"]:
            fleet.start_worker(name)
        fleet.swarmctl("submit", str(CONFIG), "--generations", "100000")
        picture, readout = ".fleet-timeline > svg", ".fleet-timeline .readout"
        self.browser.get(fleet.pages + "/fleet")
        names = lambda: self.script(f"return [...document.querySelectorAll('{picture} .name')].map((it) => it.textContent)")
        self.wait(lambda: sorted(names()) == ["left", "right"], "not both have a row")
        first, second = names()
        self.press(picture, Keys.HOME)
        said = [self.text(readout)]
        self.assertRegex(said[0], rf"^{first}: experiment 1, generation \d+, individual \d+, trials 0 to \d+; ")
        self.press(picture, Keys.ARROW_RIGHT)
        said.append(self.text(readout))
        self.assertNotEqual(said[1], said[0])
        self.press(picture, Keys.ARROW_LEFT)
        self.assertEqual(self.text(readout), said[0])
        self.press(picture, Keys.ARROW_DOWN)
        self.assertTrue(self.text(readout).startswith(f"{second}: "), self.text(readout))
        self.assertEqual(self.script(f"return document.querySelectorAll('{picture} .cursor rect').length"), 1)
        self.picture("timeline-keys")
        n_bars = self.script(f"return document.querySelectorAll('{picture} > g:not(.cursor) rect').length")
        # The picture stays while the user goes through it.
        rows = list(csv.DictReader(io.StringIO(self.saved(".fleet-timeline .save:last-child"))))
        self.assertEqual(len(rows), n_bars)
        self.assertEqual({it["worker"] for it in rows}, {"left", "right"})
        svg = self.saved(".fleet-timeline .save")
        filled = [it.get("fill") for it in xml.etree.ElementTree.fromstring(svg).iter() if it.tag.endswith("rect")]
        self.assertGreater(len(filled), n_bars)
        self.assertTrue(all(re.match("rgb|#|none", it) for it in filled), set(filled))
        self.press(picture, Keys.ESCAPE)
        self.assertEqual(self.text(readout).strip(), "")
        self.narrow()
        self.assertLessEqual(self.width(), NARROW)
        self.picture("narrow-timeline-keys")

    def test_borders_of_controls_and_trails_are_seen(self):
        self.open("/")
        for scheme in ["light", "dark"]:
            self.prefer(scheme)
            color = lambda name: self.script(f"return getComputedStyle(document.documentElement).getPropertyValue('--{name}').trim()")
            for mark, grounds in [("control", ["panel", "page"]), ("trail", ["ground"]), ("robot", ["ground"]), ("line", ["panel"]), ("relay", ["panel"])]:
                for ground in grounds:
                    ratio = contrast(color(mark), color(ground))
                    self.assertGreaterEqual(ratio, 3, f"{mark} on {ground}, {scheme}")
            for text, ground in itertools.product(["ink", "muted", "accent", "good", "bad"], ["panel", "page"]):
                self.assertGreaterEqual(contrast(color(text), color(ground)), 4.5, f"{text} on {ground}, {scheme}")
        border = self.script("return getComputedStyle(document.querySelector('input[type=search]')).borderTopColor")
        self.assertEqual([int(it) for it in re.findall(r"\d+", border)], [int(color("control")[i : i + 2], 16) for i in (1, 3, 5)])


def contrast(a, b):
    """The contrast ratio of WCAG 2."""

    def luminance(color):
        parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        red, green, blue = (it / 12.92 if it <= 0.03928 else ((it + 0.055) / 1.055) ** 2.4 for it in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    low, high = sorted([luminance(a), luminance(b)])
    return (high + 0.05) / (low + 0.05)


if __name__ == "__main__":
    unittest.main(verbosity=2)
