"""The player in a real browser, in all its forms; called like `browser.py`."""

import base64
import csv
import io
import json
import pathlib
import re
import subprocess
import tempfile
import unittest
import urllib.request
import xml.etree.ElementTree
import zipfile

from harness import CONFIG, NARROW, PROGRAMS, BrowserTest

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys


class Replays(BrowserTest):
    """Individuals that a server simulates."""

    @classmethod
    def setUpClass(cls):
        cls.start_fleet(generations=6)

    def open(self, path):
        self.browser.get(self.fleet.pages + path)
        # A hanging page fails its test soon, before the deadline of the driver.
        self.browser.set_script_timeout(20)

    def test_the_page_answers_after_every_kind_of_new_simulation(self):
        def press(selector):
            self.find(selector).click()

        def enter():
            self.find("#what-if-robots").send_keys(Keys.ENTER)

        for expected, act in [
            ("7 robots", lambda: (self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "7"), press("#again"))),
            ("6 robots", lambda: (self.find("#what-if-robots").clear(), self.find("#what-if-robots").send_keys("6"), enter())),
            ("6 robots", lambda: press("#beside")),
            ("8 robots", lambda: (self.find("#what-if-robots").clear(), self.find("#what-if-robots").send_keys("8"), press("#beside"))),
            ("9 robots", lambda: (self.find("#what-if-robots").clear(), self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "9"), press("#again"), press("#again"))),
        ]:
            if expected == "7 robots":
                self.open("/replay/1")
                self.find(".player")
            act()
            self.wait(lambda: any(expected in it for it in self.texts(".episode")), f"no {expected}")
            self.wait(lambda: not self.script("return document.querySelector('[aria-busy]')"), "it stays busy")
            self.script("document.querySelector('#play').click()")
            before = self.texts(".step")
            self.wait(lambda: self.texts(".step") != before, "it does not play")

    def test_a_champion_plays_the_median_of_its_trials_and_others_are_a_click_away(self):
        self.open("/replay/1")
        self.wait_for_text("#result", "judged")
        known = self.script("return fetch('/api/trials/1').then((it) => it.json())")
        fitness, median, worst = known["fitness"], known["median"], known["worst"]
        self.assertEqual((len(fitness), sorted(fitness)[99], min(fitness)), (200, fitness[median], fitness[worst]))
        self.wait_for_text(".episode", f"trial {median} of its judgement")
        low, high = (f"{it:.4f}" for it in known["interval"])
        self.assertIn(f"this trial {fitness[median]:.4f}, judged {known['mean']:.4f} ({low} to {high}, 200 trials)", self.text("#result"))
        self.assertEqual(len(self.browser.find_elements(By.CSS_SELECTOR, ".strip .bar")), 200)
        self.find("#trial-worst").click()
        self.wait_for_text(".episode", f"trial {worst} of its judgement")
        self.assertIn(f"this trial {fitness[worst]:.4f}", self.text("#result"))
        self.assertIn(f"judged={worst}", self.browser.current_url)
        self.browser.refresh()
        self.wait_for_text(".episode", f"trial {worst} of its judgement")
        # The strip goes from the worst to the best.
        second = sorted(range(200), key=lambda it: (fitness[it], it))[1]
        self.script("document.querySelector('.strip').focus()")
        webdriver.ActionChains(self.browser).send_keys(Keys.ARROW_RIGHT, Keys.ENTER).perform()
        self.wait_for_text(".episode", f"trial {second} of its judgement")
        # The simulated episode has the fitness of that trial.
        self.assertIn(f"this trial {fitness[second]:.4f}", self.text("#result"))

    def test_trials_and_steps_are_saved(self):
        self.open("/replay/1#step=5")
        self.find(".strip")
        known = self.script("return fetch('/api/trials/1').then((it) => it.json())")["fitness"]
        rows = list(csv.DictReader(io.StringIO(self.saved(".trials .save:last-child"))))
        self.assertEqual({int(it["trial"]): float(it["fitness"]) for it in rows}, dict(enumerate(known)))
        self.assertEqual([float(it["fitness"]) for it in rows], sorted(known))
        svg = xml.etree.ElementTree.fromstring(self.saved(".trials .save"))
        # Bars, the interval, and the ground.
        self.assertEqual(len([it for it in svg if it.tag.endswith("rect")]), len(known) + 2)
        rows = list(csv.DictReader(io.StringIO(self.saved(".timeline .save"))))
        self.assertEqual([int(it["step"]) for it in rows], list(range(100)))
        self.assertEqual(f"{float(rows[5]['fitness']):.3f}".replace("-", "−"), self.script("return [...document.querySelectorAll('.timeline .value')][1].textContent"))
        self.assertIn("LEDs on", rows[0])

    def test_a_hundred_steps_are_recorded_in_less_than_a_megabyte(self):
        self.open("/replay/1#step=0")
        self.find("#play")
        self.script("""
            window.saved = null;
            const make = URL.createObjectURL;
            URL.createObjectURL = (blob) => (blob.arrayBuffer().then((it) => (saved = it)), make(blob));
            HTMLAnchorElement.prototype.click = () => {};
        """)
        self.find("#record").click()
        self.wait(lambda: self.text("#record") == "■ save", "it does not record")
        self.wait_for_text("#step", "step 99 of 99")
        self.wait(lambda: self.script("return saved?.byteLength ?? 0"), "nothing is saved")
        self.assertLess(self.script("return saved.byteLength"), 1_000_000)
        self.assertGreater(self.script("return saved.byteLength"), 10_000)
        # The first bytes of Matroska files, which include WebM files.
        self.assertEqual(self.script("return [...new Uint8Array(saved, 0, 4)]"), [0x1A, 0x45, 0xDF, 0xA3])
        self.assertEqual(self.text("#record"), "● video")

    def saved_controller(self, path):
        """Presses the button; the names in the archive, and what the test among them says."""
        self.open(path)
        self.find(".controller")
        packed = self.browser.execute_async_script("""
            const done = arguments[0];
            const make = URL.createObjectURL;
            URL.createObjectURL = (blob) => {
                const reader = new FileReader();
                reader.onload = () => done(reader.result.split(",")[1]);
                reader.readAsDataURL(blob);
                return make(blob);
            };
            HTMLAnchorElement.prototype.click = function () { window.savedAs = this.download; };
            document.querySelector(".controller").click();
        """)
        with tempfile.TemporaryDirectory() as directory, zipfile.ZipFile(io.BytesIO(base64.b64decode(packed))) as archive:
            archive.extractall(directory)
            folder = pathlib.Path(directory) / self.script("return savedAs").removesuffix(".zip")
            made = subprocess.run(["make", "-s", "-C", folder, "test"], text=True, capture_output=True)
            return sorted(it.name for it in folder.iterdir() if it.suffix in (".c", ".h")), made.stdout

    def test_a_controller_that_is_saved_computes_the_same_bits(self):
        files = ["controller.c", "controller.h", "swarm_radio.c", "swarm_radio.h", "test.c"]
        for name, path in [("champion", "/experiment/1"), ("individual", "/replay/1@2/3#step=0")]:
            self.assertEqual(self.saved_controller(path), (files, "500 robot-steps, 0 bits differ\n"))
            self.assertTrue(self.script("return !document.querySelector('.controller').disabled && !document.querySelector('#problem')"))
            # On a phone, a usual screen and a wide one.
            for width in (NARROW, 1280, 2560):
                size = {"width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": width == NARROW}
                self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
                self.assertLessEqual(self.width(), width)
                self.script("document.querySelector('.controller').scrollIntoView({ block: 'center' })")
                self.picture(f"controller-{name}-{width}")
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def test_pages_of_a_data_directory_save_controllers_and_say_why_not(self):
        script = "def control(robot):\n    robot.led = True\n\ndef fitness(world):\n    return 1\n"
        config = json.loads(CONFIG.read_text())
        config["world"]["objects"]["robot"]["controller"] = "script_controller"
        config["task"] = {"script": {"name": "control.star", "text": script}}
        del config["algorithm"]["fitness_function"]
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        file, data = (pathlib.Path(directory.name) / name for name in ("scripted.json", "data"))
        file.write_text(json.dumps(config))
        for it in (CONFIG, file):
            command = [PROGRAMS / "swarmctl", "run", it, "--generations", "1", "--data-dir", data]
            subprocess.run(command, check=True, capture_output=True)
        pages = subprocess.Popen([PROGRAMS / "swarmctl", "web", "--data-dir", data], stdout=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (pages.kill(), pages.wait(), pages.stdout.close()))
        self.browser.get(pages.stdout.readline().strip())
        self.find("tr[data-id='2'] a").click()
        self.find(".controller").click()
        self.wait_for_text("#problem", "its robots have no network")
        asked = "return fetch('/api/controller/1').then((it) => [it.status, it.headers.get('content-disposition')])"
        self.assertEqual(self.script(asked), [200, 'attachment; filename="controller-1.zip"'])
        self.expected_complaints = ("/api/controller/2",)

    def test_only_existing_neighbours_have_links(self):
        self.open("/replay/1@0/0#step=1")
        self.wait(lambda: self.texts("main > p a") == ["experiment 1", "individual ›", "generation ›", "champion"], "before the first one")
        self.open("/replay/1@5/31#step=1")
        self.wait(lambda: self.texts("main > p a") == ["experiment 1", "‹ individual", "‹ generation", "champion"], "after the last one")

    def test_the_file_of_a_champion_names_its_trial_and_its_worth(self):
        html = pathlib.Path(self.fleet.directory.name) / "champion.html"
        self.fleet.swarmctl("replay", "1", "--to", str(html))
        self.browser.get(html.as_uri())
        known = json.loads(urllib.request.urlopen(self.fleet.pages + "/api/trials/1").read())
        self.wait_for_text(".episode", f"trial {known['median']} of its judgement")
        self.assertIn(f"judged {known['mean']:.4f}", self.text("#result"))

    def test_lamps_and_areas_have_a_legend_and_end_where_the_next_image_is_nearer(self):
        config = json.loads((CONFIG.parent / "light_follower_snes.json").read_text())
        config["world"]["objects"]["light_red"]["params"]["range"] = 5000
        with tempfile.TemporaryDirectory() as directory:
            file, genotype, html = (pathlib.Path(directory) / name for name in ("far.json", "genes.json", "far.html"))
            file.write_text(json.dumps(config))
            n_genes = int(re.search(r"([0-9]+) genes", subprocess.run([PROGRAMS / "swarmctl", "validate", file], check=True, capture_output=True, text=True).stdout)[1])
            genotype.write_text(json.dumps([0.5] * n_genes))
            command = ["replay", "--config", file, "--genotype", genotype, "--steps", "50", "--to", html]
            subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
            self.browser.get(html.as_uri() + "#step=0")
            self.wait_for_text(".legend .place", "light_red")
            self.find(".camera").click()
            # Several images of a glow do not add up: no place is brighter than the one beside the
            # lamp.
            shades = self.script("""
                const it = document.querySelector('.world');
                const { data } = it.getContext('2d').getImageData(0, 0, it.width, it.height);
                const greens = [];
                for (let i = 0; i < data.length; i += 4) if (data[i] > 200) greens.push(data[i + 1]);
                // But for the lamp itself.
                return greens.sort((a, b) => a - b)[Math.floor(greens.length / 100)];
            """)
            self.assertGreater(shades, 100, "images of a lamp add up")

    def test_the_form_has_the_present_values_and_marks_changes(self):
        self.open("/replay/1#step=5")
        value = lambda name: self.find(f"#what-if-{name}").get_attribute("value")
        self.wait_for_text(".what-if", "robots")
        self.assertEqual([value(name) for name in ["robots", "steps"]], ["5", "100"])
        self.assertFalse(self.texts(".changed"))
        offered = self.texts("#what-if-inhibit option")
        self.assertEqual(offered, ["nothing", "direction", "message", "mode"])
        self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "8")
        self.assertEqual(self.script("return document.querySelector('.changed input').id"), "what-if-robots")
        self.script("document.querySelector('#what-if-inhibit').value = 'wireless_receiver:msg'; document.querySelector('#what-if-inhibit').dispatchEvent(new Event('input', { bubbles: true }))")
        self.find("#again").click()
        self.wait_for_text("h1", "8 robotsno robot gets message")
        words = self.browser.current_url
        self.assertIn("robots=8", words)
        self.assertNotIn("steps=", words)
        self.find("#reset").click()
        self.wait(lambda: "8 robots" not in self.text("h1"), "it stays changed")
        self.assertNotIn("robots=", self.browser.current_url)

    def test_a_world_without_a_size_is_not_drawn_and_comes_back(self):
        self.open("/replay/1#step=3")
        self.find(".world")
        drawn = "return document.querySelector('.world').toDataURL().length / 1000"
        self.wait(lambda: self.script(drawn) > 8, "nothing is drawn")
        for style in ["display: none", "width: 0", "height: 0; min-height: 0", "width: 0; height: 0; min-height: 0"]:
            self.script(f"document.querySelector('.world').style.cssText = '{style}'")
            self.find("#play").click()
            before = self.text(".step")
            self.wait(lambda: self.text(".step") != before, style)
            self.find("#play").click()
            self.script("document.querySelector('.world').style.cssText = ''")
            self.wait(lambda: self.script(drawn) > 8, f"nothing is drawn after {style}")
            self.find(".player").send_keys(Keys.HOME)

    def test_a_robot_heard_by_the_whole_world_and_a_light_beyond_it_are_drawn_at_once(self):
        self.open("/replay/1#step=3")
        self.find(".player")
        drawn = self.browser.execute_async_script("""
            const done = arguments[0];
            import('swarm/camera.js').then(({ Camera }) => {
                const numbers = [1e-300, 1e-9, 1, 1e9, 1e300, Infinity];
                let images = 0;
                for (const world of numbers.slice(0, 5)) for (const radius of numbers) for (const size of [0, 1, 1000, 1e9]) {
                    const episode = { width: world, height: world, periodX: world, periodY: world, n_robots: 0, steps: 0, lights: [], areas: [], at: () => 0 };
                    const camera = new Camera(episode);
                    camera.resize(size, size);
                    let n = 0;
                    camera.eachImage(0, 0, radius, () => n++);
                    images = Math.max(images, n);
                }
                done(images);
            });
        """)
        self.assertLessEqual(drawn, 49)
        self.assertGreaterEqual(drawn, 9)

    def test_two_players_side_by_side_stay_in_step(self):
        self.open("/replay/1#step=50")
        self.wait_for_text(".episode", "5 robots")
        self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "9")
        self.find("#beside").click()
        self.wait(lambda: len(self.texts(".player")) == 2, "one player")
        ids = "return [...document.querySelectorAll('[id]')].map((it) => it.id)"
        self.assertEqual(sorted(set(self.script(ids))), sorted(self.script(ids)), "an id is there twice")
        second = self.browser.find_elements(By.CSS_SELECTOR, ".player")[1]
        for act in [
            lambda: self.find("#forward").click(),
            lambda: self.find("#forward-beside").click(),
            lambda: second.send_keys(Keys.ARROW_LEFT),
            lambda: second.send_keys(Keys.HOME),
            lambda: self.find("#play-beside").click(),
            lambda: self.find("#play").click(),
            lambda: second.send_keys(Keys.END),
        ]:
            act()
            first, beside = self.texts(".step")
            self.assertEqual(first, beside)
        self.assertEqual(self.texts(".step"), ["step 99 of 99"] * 2)
        self.browser.refresh()
        self.wait(lambda: len(self.texts(".player")) == 2, "one player after loading again")
        self.assertIn("9 robots", self.texts(".episode")[1])
        self.assertEqual(self.texts(".step"), ["step 99 of 99"] * 2)

    def test_on_a_phone_two_fingers_zoom_and_one_scrolls(self):
        self.narrow()
        self.browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
        self.open("/replay/1#step=3")
        self.find(".world")
        look = "return document.querySelector('.world').toDataURL().length"
        self.wait(lambda: self.script(look) > 8000, "nothing is drawn")
        x, y = self.script("const it = document.querySelector('.world').getBoundingClientRect(); return [it.x + it.width / 2, it.y + it.height / 2]")

        def touch(kind, *apart):
            points = [{"x": x, "y": y + sign * it, "id": i} for it in apart for i, sign in enumerate([-1, 1])]
            self.browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        before = self.script("return document.querySelector('.world').toDataURL()")
        touch("touchStart", 20)
        for apart in range(25, 120, 5):
            touch("touchMove", apart)
        touch("touchEnd")
        self.assertNotEqual(self.script("return document.querySelector('.world').toDataURL()"), before, "nothing is zoomed")
        self.assertEqual(self.script("return window.visualViewport.scale"), 1, "the page is zoomed instead")
        finger = lambda kind, *ys: self.browser.execute_cdp_cmd(
            "Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": it} for it in ys]}
        )
        finger("touchStart", y)
        for by in range(10, 200, 10):
            finger("touchMove", y - by)
        finger("touchEnd")
        self.wait(lambda: self.script("return window.scrollY") > 50, "the world blocks scrolling")
        self.assertLessEqual(self.width(), NARROW)

    def test_an_address_that_is_pasted_leads_to_its_step(self):
        self.open("/replay/1#step=5")
        self.wait_for_text(".step", "step 5 of 99")
        self.script("location.hash = '#step=42&robot=2'")
        self.wait_for_text(".step", "step 42 of 99")
        self.wait_for_text(".robot-panel h2", "Robot 2")

    def test_keys_work_wherever_the_last_click_was(self):
        self.open("/replay/1#step=5")
        self.wait_for_text(".step", "step 5 of 99")
        webdriver.ActionChains(self.browser).move_by_offset(3, 3).click().send_keys(Keys.ARROW_RIGHT).perform()
        self.wait_for_text(".step", "step 6 of 99")
        self.find(".episode").click()
        webdriver.ActionChains(self.browser).send_keys(Keys.ARROW_RIGHT).perform()
        self.wait_for_text(".step", "step 7 of 99")
        # Keys typed into a field belong to the field.
        self.find("#what-if-seed").send_keys("3", Keys.ARROW_LEFT, Keys.HOME)
        self.assertEqual(self.text(".step"), "step 7 of 99")

    def test_a_screen_reader_hears_the_play_button_and_not_each_step(self):
        self.open("/replay/1#step=5")
        play = self.find("#play")
        self.assertEqual(play.get_attribute("aria-label"), "play (Space)")
        play.click()
        self.wait(lambda: play.get_attribute("aria-label") == "pause (Space)", "it stays play")
        live = "return [...document.querySelectorAll('output, [aria-live], [role=status]')].filter((it) => it.closest('.player')).length"
        self.assertEqual(self.script(live), 0)


class Files(BrowserTest):
    """A replay in a file."""

    def test_a_file_that_is_sent_says_nothing_of_the_machine(self):
        with tempfile.TemporaryDirectory() as directory:
            genotype, html = (pathlib.Path(directory) / name for name in ("genes.json", "swarm.html"))
            genotype.write_text(json.dumps([0.6] * 424))
            command = ["replay", "--config", CONFIG, "--genotype", genotype, "--to", html]
            subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
            self.browser.get(html.as_uri())
            self.wait_for_text("h1", "genotype in genes.json")
            self.assertEqual(self.text("h1"), "genotype in genes.json")
            self.assertNotIn(directory, self.script("return document.body.innerText + document.title"))

    def test_a_hidden_frame_does_not_stop_the_page_around_it(self):
        with tempfile.TemporaryDirectory() as directory:
            genotype, html, slides = (pathlib.Path(directory) / name for name in ("genes.json", "swarm.html", "slides.html"))
            genotype.write_text(json.dumps([0.6] * 424))
            command = ["replay", "--config", CONFIG, "--genotype", genotype, "--to", html]
            subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
            frames = "".join(f'<iframe src="swarm.html" style="{it}"></iframe>' for it in ["display: none", "width: 0; height: 0", "visibility: hidden"])
            slides.write_text(f"<!doctype html><title>slides</title><p>0</p>{frames}")
            self.browser.set_script_timeout(20)
            self.browser.set_page_load_timeout(60)
            self.browser.get(slides.as_uri())
            count = "const it = document.querySelector('p'); it.textContent = Number(it.textContent) + 1; return it.textContent"
            self.assertEqual(self.script(count), "1")
            # A slide that is shown plays.
            self.script("document.querySelector('iframe').style.cssText = 'width: 900px; height: 700px'")
            self.browser.switch_to.frame(0)
            self.wait_for_text(".step", "step 0 of 99")
            self.wait(lambda: self.script("return document.querySelector('.world').width") > 300, "the world has no size")


if __name__ == "__main__":
    unittest.main(verbosity=2)
