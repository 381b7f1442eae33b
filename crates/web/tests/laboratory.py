"""Interventions in a real browser, simulated by a server and by files; called like `browser.py`.

The tests of files skip if the programs were compiled without the simulator for browsers.
"""

import pathlib
import subprocess
import tempfile
import unittest

from harness import NARROW, PROGRAMS, BrowserTest

from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select

ROOT = pathlib.Path(__file__).parents[3]
TASKS = ROOT / "configs/tasks"
CHAMPIONS = ROOT / "results/champions"
# All values of an episode's robots, as a number.
DIGEST = """
    const digest = (episode) => {
        let hash = 0x811c9dc5;
        for (const { values } of Object.values(episode.columns)) {
            for (const byte of new Uint8Array(values.buffer, values.byteOffset, values.byteLength)) hash = Math.imul(hash ^ byte, 0x01000193) >>> 0;
        }
        return `${episode.fitness} ${hash}`;
    };
"""


class Laboratory(BrowserTest):
    def wait_for_players(self, n):
        self.wait(lambda: len(self.texts(".player")) == n and not self.script("return document.querySelector('[aria-busy]')"), f"not {n} players")

    def intervene(self, *acts):
        for act in acts:
            n = len(self.texts("#interventions li"))
            self.find(f"#act-{act}").click()
            self.wait(lambda: len(self.texts("#interventions li")) == n + 1, f"{act} does nothing")
            self.wait_for_players(2)


class Server(Laboratory):
    expected_complaints = ("status of 400",)

    @classmethod
    def setUpClass(cls):
        cls.start_fleet(generations=6)

    def open(self, path):
        self.browser.get(self.fleet.pages + path)
        self.browser.set_script_timeout(20)
        self.find("#acts button")

    def test_the_past_stays_and_the_words_say_what_changed(self):
        self.open("/replay/1#step=20&robot=2")
        self.wait_for_text("#intervene-step", "20")
        self.assertEqual(self.texts("#acts button"), ["Remove", "Freeze", "Mute", "Deafen"])
        self.assertEqual(Select(self.find("#thing")).first_selected_option.text, "robot 2")
        self.intervene("mute")
        self.assertIn("robot 2 is mute from step 20 on", self.texts("h1")[1])
        self.wait_for_text("#difference", "Robot 2 is mute from step 20 on.")
        first = int(self.script("return document.querySelector('#difference').textContent.match(/in step (\\d+)\\./)[1]"))
        self.assertGreaterEqual(first, 20)
        self.assertEqual(self.texts(".step"), ["step 20 of 99"] * 2, "the swarm goes on from this step")
        self.assertIn("interventions=20%3Arobot%3A2%3Amute", self.browser.current_url)
        self.assertTrue(self.find("#act-mute").get_property("disabled"))
        # The browser simulates if it can.
        has_simulator, has_asked = self.script("""
            const asked = performance.getEntriesByType('resource').map((it) => it.name);
            return [document.querySelector('link[rel=simulator]') !== null, asked.some((it) => it.includes('/api/replay/1?interventions'))];
        """)
        self.assertNotEqual(has_simulator, has_asked)
        # The address leads here again.
        words = self.text("#difference")
        self.browser.refresh()
        self.wait_for_players(2)
        self.wait(lambda: self.text("#difference") == words, "other words")
        self.intervene("freeze")
        self.browser.find_elements(By.CSS_SELECTOR, "#interventions button")[0].click()
        self.wait(lambda: len(self.texts("#interventions li")) == 1, "nothing is undone")
        self.find("#interventions button").click()
        self.wait_for_players(1)
        self.assertNotIn("interventions", self.browser.current_url)
        self.assertFalse(self.texts("#difference"))

    def test_all_changes_go_together(self):
        self.open("/replay/1#step=10")
        self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "7", Keys.ENTER)
        self.wait_for_text("h1", "7 robots")
        Select(self.find("#thing")).select_by_visible_text("robot 4")
        self.intervene("remove")
        self.wait_for_text(".two", "robot 4 is gone from step 10 on")
        self.assertIn("7 robots", self.texts("h1")[1])
        # The original stays beside the intervention in every world.
        for button in ("#reset", "#trial-worst"):
            self.find(button).click()
            self.wait_for_players(2)
            self.assertIn("robot 4 is gone from step 10 on", self.texts("h1")[1])

    def test_robots_are_dragged_and_put(self):
        self.open("/replay/1#step=5")
        self.find("#move").click()
        # The pointer says where there is something to drag.
        x, y = self.script("""
            const it = document.querySelector('.world');
            it.scrollIntoView({ block: 'center' });
            const box = it.getBoundingClientRect();
            for (let y = 10; y < box.height; y += 8) for (let x = 10; x < box.width; x += 8) {
                it.dispatchEvent(new PointerEvent('pointermove', { clientX: box.x + x, clientY: box.y + y, pointerId: 1 }));
                if (it.style.cursor === 'grab') return [Math.round(box.x + x), Math.round(box.y + y)];
            }
        """)
        hand = ActionBuilder(self.browser, duration=50)
        hand.pointer_action.move_to_location(x + 4, y + 4).pointer_down().move_to_location(x + 60, y + 40)
        hand.perform()
        self.picture("laboratory-dragging")
        hand = ActionBuilder(self.browser, duration=50)
        hand.pointer_action.pointer_up()
        hand.perform()
        self.wait_for_players(2)
        self.wait_for_text("#interventions", " is put at (")
        # Without a mouse.
        Select(self.find("#thing")).select_by_visible_text("robot 3")
        for axis, value in (("x", "12.5"), ("y", "990")):
            self.find(f"#put-{axis}").clear()
            self.find(f"#put-{axis}").send_keys(value)
        self.find("#put button").click()
        self.wait_for_text("#interventions", "robot 3 is put at (13, 990) in step 5")

    def test_wrong_interventions_in_an_address_are_named(self):
        for text, error in [("99:robot:77:mute", "the world has the numbers 0 to 4"), ("5:robot:1:dance", "is no intervention"), ("100:robot:1:mute", "the episode has the steps 0 to 99")]:
            self.browser.get(f"{self.fleet.pages}/replay/1?interventions={text}")
            self.wait_for_text("#problem", error)

    def test_a_late_answer_hides_no_error_of_a_later_request(self):
        self.open("/replay/1")
        self.wait_for_players(1)
        address = self.browser.current_url
        self.hold("/api/replay/1?judged=")
        self.find("#trial-worst").click()
        self.wait(lambda: self.browser.current_url != address, "the trial is not chosen")
        self.refuse("/api/replay/", "not today")
        self.find("#trial-best").click()
        self.wait_for_text("#problem", "not today")
        self.release()
        self.assertIn("not today", self.text("#problem"))

    def test_an_intervention_stays_when_a_later_change_replaces_its_request(self):
        self.open("/replay/1#step=20&robot=2")
        # The server simulates, whose answers a test can hold back.
        self.script("document.querySelector('link[rel=simulator]')?.remove()")
        self.refuse("/api/replay/1?interventions", "too late")
        self.hold("/api/replay/1?interventions")
        self.find("#act-mute").click()
        self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "7", Keys.ENTER)
        self.wait_for_text(".two", "7 robots")
        self.release()
        self.wait_for_text("#interventions", "robot 2 is mute from step 20 on")
        self.assertIn("interventions=20%3Arobot%3A2%3Amute", self.browser.current_url)

    def test_the_page_is_for_everybody(self):
        for width, name in [(NARROW, "narrow"), (1280, "middle"), (2560, "wide")]:
            self.browser.set_window_size(width, 1400)
            if width == NARROW:
                self.narrow()
            for scheme in ("light", "dark"):
                self.prefer(scheme)
                self.open("/replay/1?beside=1&interventions=20:robot:2:mute,30:robot:1:remove#step=60&robot=2")
                self.wait_for_players(2)
                self.picture(f"laboratory-{name}-{scheme}")
                self.assert_accessible(f"{name}, {scheme}")
            if width == NARROW:
                self.assertLessEqual(self.width(), NARROW)
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


class Files(Laboratory):
    """Replays that simulate in the browser."""

    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        cls.directory = pathlib.Path(directory.name)
        cls.start_fleet(generations=6)
        cls.file = cls.directory / "quickstart.html"
        cls.fleet.swarmctl("replay", "1", "--to", str(cls.file))
        if 'id="simulator"' not in cls.file.read_text():
            raise unittest.SkipTest("the programs have no simulator for browsers; dist/build simulator makes it")

    def open(self, path, words=""):
        self.browser.get("about:blank")
        self.browser.get(f"{path.as_uri()}#{words}")
        self.browser.set_script_timeout(60)
        self.find("#acts button")

    def simulate(self, body):
        """What a script makes of the digest."""
        return self.browser.execute_async_script(f"{DIGEST} const done = arguments[0]; (async () => {{ {body} }})().then(done, (error) => done(error.message));")

    def test_a_file_computes_the_bits_of_the_server(self):
        changes = ["", "interventions=20:robot:2:mute,40:robot:1:remove", "robots=9&interventions=20:robot:8:place:480:500", "seed=5&steps=60", "trial=3&interventions=7:robot:0:deafen"]
        local = """
            const { localSimulation, playedInFile } = await import('swarm/local-simulation.js');
            const { played, genes } = playedInFile();
            const { simulate } = await localSimulation(played, genes);
            return digest(await simulate('%s'));
        """
        remote = """
            const { unpack } = await import('swarm/episode.js');
            return digest(await unpack(await (await fetch('/api/replay/1?%s')).arrayBuffer()));
        """
        self.open(self.file)
        here = [self.simulate(local % words) for words in changes]
        self.browser.get(self.fleet.pages + "/replay/1")
        there = [self.simulate(remote % words) for words in changes]
        self.assertEqual(here, there)
        self.assertEqual(len(set(here)), len(changes), here)

    def test_a_file_is_small_and_its_address_leads_to_the_same_intervention(self):
        self.assertLess(self.file.stat().st_size, 3_000_000)
        self.open(self.file, "step=20&robot=2")
        self.intervene("mute", "freeze")
        words = self.text("#difference")
        self.assertIn("Robot 2 is mute from step 20 on", words)
        address = self.browser.current_url
        self.assertIn("step=20", address)
        self.browser.get("about:blank")
        self.browser.get(address)
        self.wait_for_players(2)
        self.assertEqual(self.text("#difference"), words)
        self.browser.get("about:blank")
        self.open(self.file, "interventions=20:robot:77:mute")
        self.wait_for_text("[role=alert]", "the world has the numbers 0 to 4")

    def test_an_impossible_intervention_is_named_and_forgotten(self):
        file = self.directory / "transport.html"
        command = ["replay", "--config", TASKS / "transport.json", "--genotype", CHAMPIONS / "transport-0.json", "--to", file, "--force"]
        subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
        self.open(file, "step=10")
        Select(self.find("#thing")).select_by_visible_text("movable 0")
        self.find("#move").click()
        for axis in ("x", "y"):
            self.find(f"#put-{axis}").clear()
            self.find(f"#put-{axis}").send_keys("0")
        self.find("#put button").click()
        self.wait_for_text("[role=alert]", "movable 0 has no room at (0, 0) in step 10")
        self.assertNotIn("interventions", self.browser.current_url)
        Select(self.find("#thing")).select_by_visible_text("robot 0")
        self.intervene("freeze")
        self.assertEqual(self.text("[role=alert]"), "")

    def test_every_task_lives_in_a_file(self):
        for config in sorted(TASKS.glob("*.json")):
            champion = CHAMPIONS / f"{config.stem}-0.json"
            if not champion.exists():
                continue
            with self.subTest(config.stem):
                file = self.directory / f"{config.stem}.html"
                command = ["replay", "--config", config, "--genotype", champion, "--to", file, "--force"]
                subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
                self.open(file, "step=30")
                self.intervene("remove")
                self.assertIn("Robot 0 is gone from step 30 on", self.text("#difference"))
                last = Select(self.find("#thing")).options[-1].text
                if last.startswith(("light", "area", "movable")):
                    Select(self.find("#thing")).select_by_visible_text(last)
                    self.find("#move").click()
                    self.find("#put button").click()
                    self.wait(lambda: len(self.texts("#interventions li")) == 2 or self.text("[role=alert]"), "nothing happens")
                self.picture(f"laboratory-{config.stem}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
