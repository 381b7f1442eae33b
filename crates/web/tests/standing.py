"""Pages of missing or stopped experiments in a real browser; called like `browser.py`."""

import json
import pathlib
import unittest

from harness import CLIENT_TOKEN, CONFIG, WORKER_TOKEN, BrowserTest, Fleet

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys


class Standing(BrowserTest):
    def test_logging_in_keeps_the_link_and_another_token_asks_again(self):
        self.expected_complaints = ["401 (Unauthorized)", "ERR_CONNECTION_REFUSED", "ERR_INCOMPLETE_CHUNKED", "ERR_CONNECTION_RESET", "Failed to fetch"]
        tokens = {"SWARM_CLIENT_TOKEN": CLIENT_TOKEN, "SWARM_WORKER_TOKEN": WORKER_TOKEN}
        fleet = Fleet(environment=tokens)
        self.addCleanup(fleet.stop)
        link = fleet.pages + "/compare?runs=3&along=time#step=7"
        self.browser.get(link)
        self.find("#token").send_keys(CLIENT_TOKEN, Keys.ENTER)
        self.wait_for_text("h1", "Compare")
        self.assertIn("along=time", self.browser.current_url)
        self.browser.get(fleet.pages + "/")
        self.wait_for_text("#connection", "live")
        fleet.coordinator.kill()
        fleet.coordinator.wait()
        fleet.environment["SWARM_CLIENT_TOKEN"] = "another-" + CLIENT_TOKEN
        fleet.start_coordinator()
        self.find("#token").send_keys("another-" + CLIENT_TOKEN, Keys.ENTER)
        self.wait_for_text("h1", "Experiments")
        self.wait_for_text("#connection", "live")

    def test_an_unknown_or_deleted_experiment_is_reported_with_a_link(self):
        self.expected_complaints = ["404 (Not Found)", "400 (Bad Request)", "ERR_INCOMPLETE_CHUNKED"]
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        for path in ["/experiment/7", "/experiment/x"]:
            self.browser.get(fleet.pages + path)
            self.wait_for_text("main h1", "There is no experiment")
            self.assertEqual(self.find(".end a").text, "All experiments")
        self.browser.get(fleet.pages + "/no/such/page")
        self.wait_for_text("main h1", "There is nothing at this address")
        fleet.swarmctl("submit", str(CONFIG))
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text(".state", "running")
        fleet.swarmctl("cancel", "1")
        self.wait_for_text(".state", "cancelled")
        fleet.swarmctl("delete", "1")
        self.browser.refresh()
        self.wait_for_text("main h1", "There is no experiment 1")

    def test_before_the_first_generation_the_page_shows_the_progress(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.swarmctl("submit", str(CONFIG))
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text(".standing", "The first generation is being computed")
        self.wait_for_text("main", "No worker is connected: start one")
        shown = [it.text for it in self.browser.find_elements(By.CSS_SELECTOR, ".panel h2") if it.is_displayed()]
        self.assertEqual(shown, ["Before the first generation", "Now", "Events"])
        fleet.swarmctl("pause", "1", "--reason", "the lab moves")
        self.wait_for_text(".standing", "the lab moves")
        fleet.swarmctl("cancel", "1")
        self.wait_for_text(".standing", "before a generation was complete")

    def test_a_failed_experiment_says_why_and_has_no_blank_panels(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        config = json.loads(CONFIG.read_text())
        del config["algorithm"]["fitness_function"]
        config["task"] = {"script": "task.star"}
        directory = pathlib.Path(fleet.directory.name)
        (directory / "task.star").write_text("def fitness(world):\n    return 1.0 / (world.step - 95)\n")
        (directory / "fails.json").write_text(json.dumps(config))
        fleet.start_worker()
        fleet.swarmctl("submit", str(directory / "fails.json"))
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text(".state", "failed")
        self.wait_for_text(".standing", "swarmctl resume 1")
        self.wait_for_text(".standing .bad", "division")
        shown = [it.text for it in self.browser.find_elements(By.CSS_SELECTOR, ".panel") if it.is_displayed()]
        self.assertEqual([it for it in shown if not it or "no generation is complete yet" in it], [])
        headings = [it.text for it in self.browser.find_elements(By.CSS_SELECTOR, ".panel h2") if it.is_displayed()]
        self.assertEqual(headings, ["Failed", "Events"])

    def test_an_event_that_happens_before_an_answer_is_shown_after_it(self):
        self.complete_before_an_answer("/api/experiments/1/events")
        self.wait_for_text(".events", "completed")

    def test_a_refusal_stays_until_somebody_has_read_it(self):
        self.expected_complaints = ["400 (Bad Request)"]
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.swarmctl("submit", str(CONFIG))
        self.browser.get(fleet.pages + "/experiment/1")
        self.find("#do-priority").click()
        alert = self.browser.switch_to.alert
        alert.send_keys("5000")
        alert.accept()
        self.wait_for_text("#problem", "1000")
        looks = "return performance.getEntriesByType('resource').filter((it) => it.name.endsWith('/explain')).length"
        before = self.script(looks)
        self.wait(lambda: self.script(looks) >= before + 2, "the page does not look again")
        self.wait_for_text("#problem", "1000")
        self.find("#problem button").click()
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, "#problem"), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
