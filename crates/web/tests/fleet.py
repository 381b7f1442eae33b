"""The fleet within a page, in a real browser, from a server and from a file; called like
`browser.py`. Visitors treat workers badly, and the digest does not move.

Skips if the programs were compiled without the simulator for browsers.
"""

import pathlib
import re
import tempfile
import unittest

from harness import CONFIG, NARROW, BrowserTest, swarmctl, with_simulator

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import staleness_of

FAULTS = ("killed", "hung", "slow", "lying")


class Demo(BrowserTest):
    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        cls.directory = pathlib.Path(directory.name)
        cls.page = cls.directory / "fleet.html"
        assert with_simulator("web", "--demo", cls.page) == str(cls.page)
        data = cls.directory / "data"
        done = swarmctl("run", CONFIG, "--data-dir", data, "--set", "algorithm.generations=3")
        assert done.returncode == 0, done.stderr
        cls.start_fleet()

    def open(self, audits=None):
        self.browser.get(self.page.as_uri())
        self.find(".worker")
        if audits is not None:
            before = self.find(".demo-parts")
            self.script(f"const it = document.querySelector('#audits'); it.value = '{audits}'; it.dispatchEvent(new Event('change'))")
            self.wait(lambda: staleness_of(before)(self.browser), "it does not start over")
            self.assertEqual(self.find("#audits").get_attribute("value"), str(audits))

    def choose(self, health):
        self.find(f".tool:has([value={health}])").click()

    def click(self, *workers):
        buttons = self.browser.find_elements(By.CSS_SELECTOR, ".worker")
        for worker in workers:
            buttons[worker].click()

    def label(self, worker):
        return self.script(f"return document.querySelectorAll('.worker')[{worker}].getAttribute('aria-label')")

    def generations(self):
        return int(self.script("return document.querySelector('.demo-parts').dataset.generations"))

    def wait_for_generations(self, n):
        self.wait(lambda: self.generations() >= n, f"no {n} generations")

    def wait_for_label(self, worker, part):
        self.wait(lambda: part in self.label(worker), f"worker {worker} is never {part!r}")

    def log(self):
        return self.script("return [...document.querySelectorAll('#log li')].map((line) => line.textContent)")

    def digest(self, run):
        return self.script(f"return document.querySelector('#{run} .digest').title")

    def test_no_worker_that_is_killed_hung_slowed_or_lies_moves_a_bit(self):
        self.open()
        for i, health in enumerate(FAULTS):
            self.choose(health)
            self.click(*range(i, 20, 5))
        self.wait_for_label(3, "quarantined")
        self.wait_for_text("#log", "asks the referee")
        self.wait_for_label(1, "given up")
        self.picture("demo-faults")
        # Four workers are healthy, and four are slow.
        self.wait_for_generations(2)
        self.find("#mend").click()
        for worker in range(20):
            self.wait(lambda: not re.search("killed|hung|slow|lies|quarantined", self.label(worker)), f"{self.label(worker)}")
        self.wait_for_generations(4)
        self.wait_for_text("#verdict", "generations, and not a bit differs")
        self.assertEqual(self.script("return document.querySelectorAll('.differs').length"), 0)
        lines = self.log()
        for part in ("You kill worker-01", "You stop worker-02", "You slow worker-03 down", "You make worker-04 lie", "silent for 10 s", "quarantine: it returned"):
            self.assertTrue(any(part in line for line in lines), part)

    def test_each_digest_is_that_of_a_real_run(self):
        self.open()
        self.wait_for_generations(1)
        self.find("#play").click()
        history = swarmctl("history", "1", "--data-dir", self.directory / "data", "--output", "json").stdout
        for run in ("undisturbed", "disturbed"):
            self.wait(lambda: self.digest(run), "no digest")
            self.assertIn(self.digest(run), history)

    def test_without_audits_a_lie_changes_the_digest_and_the_page_says_so(self):
        self.open(audits=0)
        self.choose("lying")
        self.click(*range(20))
        self.wait_for_text("#verdict", "a lie that nobody audited is in the result")
        self.assertIn("≠ Since generation 0", self.text("#verdict"))
        self.assertGreater(self.script("return document.querySelectorAll('.differs').length"), 0)
        self.picture("demo-lie")

    def test_every_button_acts(self):
        self.open()
        self.find("#play").click()
        self.assertIn("go on", self.text("#play"))
        paused = self.text("#log")
        self.choose("killed")
        self.click(0)
        self.wait_for_label(0, "killed")
        self.assertNotEqual(self.text("#log"), paused)
        self.find("#play").click()
        self.find("#chaos").click()
        self.assertEqual(self.find("#chaos").get_attribute("aria-pressed"), "true")
        self.wait(lambda: len({line for line in self.log() if " You " in line}) >= 4, "no chaos")
        self.find("#chaos").click()
        self.script("const it = document.querySelector('#speed'); it.value = 5; it.dispatchEvent(new Event('input'))")
        self.assertEqual(self.text("#pace"), "16×")
        self.wait_for_generations(1)
        self.find("#again").click()
        self.wait(lambda: self.generations() == 0 and "killed" not in self.label(0), "it does not start over")

    def test_the_keyboard_suffices(self):
        self.open()
        self.find("#play").send_keys(Keys.SPACE)
        self.wait_for_text("#play", "go on")
        worker = self.browser.find_elements(By.CSS_SELECTOR, ".worker")[6]
        worker.send_keys("2")
        self.assertIn(": Hang", self.label(6))
        worker.send_keys(Keys.ENTER)
        self.wait_for_label(6, "worker-07, hung")
        self.assertEqual(self.text("#status"), "You stop worker-07. Nobody tells the coordinator.")
        self.find(".tool [value=hung]").send_keys(Keys.ARROW_LEFT)
        self.assertIn(": Kill", self.label(6))

    def test_a_server_offers_the_same_page(self):
        self.browser.get(self.fleet.pages + "/demo")
        self.find(".worker")
        self.assertEqual(self.text("nav [aria-current]"), "Demo")
        self.choose("killed")
        self.click(12)
        self.wait_for_label(12, "worker-13, killed")

    def test_it_fits_on_a_phone_and_on_a_wall(self):
        for width, name in [(NARROW, "narrow"), (1280, "middle"), (2560, "wide")]:
            self.browser.set_window_size(width, 1000)
            if width == NARROW:
                self.narrow()
            self.open()
            self.choose("lying")
            self.click(2, 9)
            self.wait_for_label(2, "quarantined")
            self.assertLessEqual(self.width(), width)
            self.picture(f"demo-{name}")
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def test_nothing_moves_for_people_who_prefer_that(self):
        features = [{"name": "prefers-reduced-motion", "value": "reduce"}]
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        self.open()
        self.script("""
            window.dots = 0;
            const arc = CanvasRenderingContext2D.prototype.arc;
            CanvasRenderingContext2D.prototype.arc = function (x, y, radius, ...rest) {
              if (radius > 4) window.dots++;
              return arc.call(this, x, y, radius, ...rest);
            };
        """)
        self.wait_for_generations(1)
        self.assertEqual(self.script("return window.dots"), 0)


if __name__ == "__main__":
    unittest.main()
