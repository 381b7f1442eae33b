"""Pages in a real browser: headless Chromium, driven by selenium.

    python crates/web/tests/browser.py target/debug

The argument is the folder with coordinator, worker and swarmctl; `harness.py` describes its other
options. Without Chromium and its driver it prints a line, and skips the tests.
"""

import csv
import http.client
import json
import pathlib
import re
import signal
import subprocess
import tempfile
import threading
import unittest
import urllib.request

from harness import CLIENT_TOKEN, CONFIG, DEADLINE, NARROW, PROGRAMS, WORKER_TOKEN, BrowserTest, Fleet

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support import expected_conditions
from selenium.webdriver.support.wait import WebDriverWait


class Pages(BrowserTest):
    """Pages of a fleet that has computed an experiment."""

    @classmethod
    def setUpClass(cls):
        cls.start_fleet(generations=12)

    def open(self, path):
        self.browser.get(self.fleet.pages + path)

    def test_the_list_is_searched(self):
        self.open("/")
        self.wait_for_text("tr[data-id='1']", "quickstart")
        self.wait_for_text("tr[data-id='1']", "completed")
        self.picture("experiments")
        search = self.find("input[type=search]")
        search.send_keys("nothing of the kind")
        self.wait_for_text("tbody", "No experiment matches.")
        search.clear()
        search.send_keys("SNES seed=1")
        self.wait_for_text("tbody", "quickstart")

    def test_a_cell_of_the_map_plays(self):
        self.open("/experiment/1")
        self.wait_for_text("h1", "quickstart")
        canvas = self.find(".heat-map canvas")
        self.wait(lambda: canvas.size["height"] > 100, "the map is empty")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        self.picture("experiment")
        self.script("document.querySelector('.heat-map').scrollIntoView()")
        webdriver.ActionChains(self.browser).move_to_element_with_offset(
            canvas, 5 - canvas.size["width"] // 2, 5 - canvas.size["height"] // 2
        ).click().perform()
        self.wait(lambda: self.browser.current_url.split("#")[0].endswith("/replay/1@0/0"), "no replay")
        self.wait_for_text("h1", "Individual 0 of generation 0 of experiment 1")
        # The episode plays by itself.
        self.wait_for_text("#step", "step 99 of 99")

    def test_a_chart_zooms(self):
        self.open("/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        chart = self.find(".chart svg")
        labels = lambda: self.script("return document.querySelector('.chart svg').textContent")
        whole = labels()
        drag = webdriver.ActionChains(self.browser).move_to_element_with_offset(chart, -100, 0)
        drag.click_and_hold().move_by_offset(150, 0).release().perform()
        self.wait(lambda: labels() != whole, "nothing is seen of dragging")
        webdriver.ActionChains(self.browser).double_click(chart).perform()
        self.wait(lambda: labels() == whole, "a double click does not show all")

    def test_the_best_individuals_are_on_top_on_request(self):
        self.open("/experiment/1")
        canvas = self.find(".heat-map canvas")
        self.wait(lambda: canvas.size["height"] > 100, "the map is empty")
        self.script("document.querySelector('.heat-map').scrollIntoView()")

        def fitness_down_the_first_column():
            """The readouts of cells, one by one."""
            found = []
            n_individuals = 32
            for place in range(n_individuals):
                y = (place + 0.5) * canvas.size["height"] / n_individuals
                self.script(f"""
                    const canvas = document.querySelector('.heat-map canvas');
                    const {{ left, top }} = canvas.getBoundingClientRect();
                    canvas.dispatchEvent(new PointerEvent('pointermove', {{ clientX: left + 5, clientY: top + {y} }}));
                """)
                text = self.script("return document.querySelector('.heat-map .readout').textContent")
                found.append(tuple(map(float, re.match(r"generation 0, individual (\d+): (.*)", text).groups())))
            return found

        as_numbered = fitness_down_the_first_column()
        self.assertEqual([individual for individual, _ in as_numbered], list(range(32)))
        self.find("#sort-individuals").click()
        best_first = fitness_down_the_first_column()
        self.assertEqual([fitness for _, fitness in best_first], sorted((it[1] for it in as_numbered), reverse=True))
        self.assertEqual(set(best_first), set(as_numbered))

    def test_the_distribution_is_shown_on_request(self):
        csv_text = self.fleet.swarmctl("history", "1", "--dynamics")
        last = json.loads(csv_text)[-1]
        self.open("/experiment/1")
        panel = self.find("details.dynamics")
        self.script("document.querySelector('.dynamics summary').scrollIntoView()")
        panel.find_element(By.TAG_NAME, "summary").click()
        self.wait(lambda: panel.get_attribute("data-generations") == "12", "generations are missing")
        answer = self.script("return fetch('/api/experiments/1/dynamics?from=11').then((it) => it.json())")
        [[generation, step, deviations, _]] = answer["generations"]
        self.assertEqual((generation, step), (11, last["mean_step"]))
        self.assertEqual(deviations[2], last["deviation_median"])
        self.picture("dynamics")

    def test_positions_are_those_of_the_trace(self):
        trace = pathlib.Path(self.fleet.directory.name) / "trace.csv"
        args = ["simulate", "1@5/3", "--trials", "1", "--trace", str(trace)]
        self.fleet.swarmctl(*args, "--trace-columns", "frames")
        with trace.open() as file:
            rows = {(int(row["step"]), int(row["robot"])): row for row in csv.DictReader(file)}
        self.open("/replay/1@5/3#step=7&robot=2")
        for step in [7, 8, 9, 10]:
            self.wait_for_text("#step", f"step {step} of 99")
            row = rows[step, 2]
            expected = f"{float(row['x_cm']):.2f}, {float(row['y_cm']):.2f} cm"
            self.assertEqual(self.text("#position"), expected)
            hears = f"robot {row['frame_emitter']}" if row["frame_emitter"] else "nobody"
            self.assertIn(hears, self.text("#hears"))
            self.assertIn("on" if row["led"] != "0" else "off", self.text("#led"))
            self.find(".player").send_keys(Keys.ARROW_RIGHT)
        self.picture("replay")
        self.find(".player").send_keys(Keys.END)
        self.wait_for_text("#step", "step 99 of 99")
        self.find(".player").send_keys("]")
        self.wait_for_text(".robot-panel h2", "Robot 3")
        self.assertIn("#step=99&robot=3", self.browser.current_url)

    def test_what_if_there_were_more_robots(self):
        self.open("/replay/1#step=50")
        self.wait_for_text(".episode", "5 robots")
        self.find("#what-if-robots").send_keys(Keys.BACKSPACE, "9")
        self.find("#beside").click()
        self.wait(lambda: len(self.browser.find_elements(By.CSS_SELECTOR, ".player")) == 2, "one player")
        headings = [it.text for it in self.browser.find_elements(By.CSS_SELECTOR, ".episode")]
        self.assertIn("5 robots", headings[0])
        self.assertIn("9 robots", headings[1])
        self.find("#forward").click()
        steps = [it.text for it in self.browser.find_elements(By.CSS_SELECTOR, ".step")]
        self.assertEqual(steps, ["step 51 of 99"] * 2)
        self.picture("what-if")

    def test_runs_are_compared_along_episodes(self):
        self.open("/compare?runs=1&along=episodes&value=best")
        self.wait_for_text(".chart svg", "episodes")
        self.wait_for_text(".chart figcaption", "quickstart seed 1")
        self.picture("compare")

    def test_the_fleet_is_seen(self):
        self.open("/fleet")
        self.wait_for_text("tbody", "w")
        self.wait_for_text("main", "1 worker with 1 slot")
        self.picture("fleet")

    def test_pages_keep_the_rules_of_accessibility(self):
        for narrow in [False, True]:
            if narrow:
                self.narrow()
                self.prefer("dark")
            for path, ready in [("/", "tr[data-id='1']"), ("/experiment/1", ".heat-map .ramp"), ("/compare?as=groups", ".differences"), ("/fleet", "tr[data-id]"), ("/replay/1#step=5&robot=1", ".strip"), ("/login", "#token")]:
                self.open(path)
                self.find(ready)
                self.assert_accessible(f"{path}{', narrow' if narrow else ''}")

    def test_a_narrow_screen_has_room_and_both_themes_differ(self):
        self.narrow()
        for path, ready in [("/", "tr[data-id='1']"), ("/experiment/1", ".state"), ("/replay/1", ".player"), ("/fleet", "tr[data-id]"), ("/compare", ".chart path")]:
            self.open(path)
            self.find(ready)
            self.assertLessEqual(self.width(), NARROW, f"{path} is too wide")
            self.picture(f"narrow{path.replace('/', '-')}")
        grounds = []
        for scheme in ["light", "dark"]:
            self.prefer(scheme)
            grounds.append(self.script("return getComputedStyle(document.body).backgroundColor"))
        self.assertNotEqual(*grounds)


class Live(BrowserTest):
    """Pages while something happens."""

    def test_a_page_follows_through_a_kill_of_the_coordinator_without_a_gap(self):
        self.expected_complaints = ["ERR_CONNECTION_REFUSED", "ERR_INCOMPLETE_CHUNKED", "Failed to fetch", "ERR_CONNECTION_RESET", "ERR_SOCKET_NOT_CONNECTED"]
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.start_worker()
        fleet.swarmctl("submit", str(CONFIG), "--generations", "40")
        self.browser.get(fleet.pages + "/experiment/1")
        n_generations = lambda: int(self.script("return document.querySelector('.chart')?.dataset.generations ?? 0"))
        self.wait(lambda: n_generations() >= 3, "no generation is seen")
        fleet.coordinator.kill()
        fleet.coordinator.wait()
        self.wait_for_text("#connection", "connecting again")
        seen = n_generations()
        self.assertLess(seen, 40, "the run was over before the kill")
        fleet.start_coordinator()
        self.wait_for_text("#connection", "live")
        self.wait(lambda: n_generations() == 40, "generations are missing")
        self.wait_for_text(".state", "completed")

    def test_generations_that_are_complete_before_an_answer_are_shown_after_it(self):
        self.complete_before_an_answer("/dynamics", prepare=lambda: self.script("document.querySelector('.dynamics').open = true"))
        self.find(".dynamics[data-generations='40']")

    def test_the_timeline_shows_computed_and_lost_assignments(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        workers = [fleet.start_worker(name) for name in ["left", "right"]]
        fleet.swarmctl("submit", str(CONFIG), "--generations", "100000")
        self.browser.get(fleet.pages + "/fleet")
        computed = """return fetch('/api/timeline').then((it) => it.json()).then(({ workers, assignments }) =>
            Object.groupBy(assignments.filter((it) => it[8] === 'computed'), (it) => workers[it[0]][1]))"""
        self.wait(lambda: set(self.script(computed)) == {"left", "right"}, "not both compute")
        self.wait_for_text("main", "1 quickstart")
        self.find(".fleet-timeline[data-assignments]")
        self.picture("timeline")
        left, right = workers
        left.terminate()
        left.wait()
        # The stopped worker is alone: no other worker computes its items.
        right.send_signal(signal.SIGSTOP)
        held = """return fetch('/api/timeline').then((it) => it.json()).then(({ workers, assignments }) =>
            assignments.filter((it) => it[8] === 'unanswered' && workers[it[0]][1] === 'right').map((it) => it.slice(2, 5)))"""
        looks = [[], []]

        def holds_the_same_at_two_looks():
            looks.append(self.script(held))
            return looks[-1] and looks[-1] == looks[-2]

        self.wait(holds_the_same_at_two_looks, "the last worker holds nothing")
        right.kill()
        self.wait_for_text(".broken", "right: lost with its worker, experiment 1, generation")
        self.picture("timeline-lost")
        self.narrow()
        self.assertLessEqual(self.width(), NARROW)
        self.picture("narrow-timeline")

    def test_pages_use_the_encryption_of_the_coordinator(self):
        """The certificate is self-signed, so the test tells the browser to accept it."""
        self.browser.execute_cdp_cmd("Security.setIgnoreCertificateErrors", {"ignore": True})
        self.expected_complaints = ["401 (Unauthorized)"]
        with tempfile.TemporaryDirectory() as directory:
            certificate, key = (str(pathlib.Path(directory) / name) for name in ("cert.pem", "key.pem"))
            command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]
            subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-days", "2"]
            subprocess.run([*command, *subject, "-keyout", key, "-out", certificate], check=True, capture_output=True)
            tokens = {"SWARM_CLIENT_TOKEN": CLIENT_TOKEN, "SWARM_WORKER_TOKEN": WORKER_TOKEN}
            fleet = Fleet("--tls-cert", certificate, "--tls-key", key, environment=tokens)
            self.addCleanup(fleet.stop)
            address = fleet.pages.replace("http:", "https:")
            self.browser.get(address + "/fleet")
            self.find("#token").send_keys(CLIENT_TOKEN, Keys.ENTER)
            self.wait_for_text("h1", "Fleet")
            self.browser.get(address)
            self.wait_for_text("#connection", "live")
            [cookie] = self.browser.get_cookies()
            self.assertTrue(cookie["secure"] and cookie["httpOnly"], cookie)
            with self.assertRaises((OSError, http.client.HTTPException), msg="it answers without TLS"):
                urllib.request.urlopen(fleet.pages, timeout=DEADLINE)

    def test_an_experiment_is_paused_and_resumed(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.swarmctl("submit", str(CONFIG))
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text("main", "No worker is connected")
        self.find("#do-pause").click()
        self.browser.switch_to.alert.accept()
        self.wait_for_text(".state", "paused")
        self.find("#do-resume").click()
        self.wait_for_text(".state", "running")

    def test_an_experiment_is_weighted_forked_and_cancelled_after_confirmation(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.start_worker()
        fleet.swarmctl("submit", str(CONFIG), "--generations", "100000")
        self.browser.get(fleet.pages + "/experiment/1")
        kept = lambda: json.loads(urllib.request.urlopen(fleet.pages + "/api/experiments/1", timeout=DEADLINE).read())["experiment"]

        def answer(button, text=None):
            self.find(f"#do-{button}")
            # The page replaces buttons as the run advances.
            self.wait(lambda: self.script(f"const it = document.querySelector('#do-{button}'); if (it) setTimeout(() => it.click()); return !!it"), button)
            alert = WebDriverWait(self.browser, DEADLINE, 0.05).until(expected_conditions.alert_is_present())
            if text is None:
                alert.dismiss()
                return
            if text:
                alert.send_keys(text)
            alert.accept()

        answer("priority")
        answer("priority", "7")
        self.wait(lambda: kept()["priority"] == 7, "it has no other weight")
        answer("cancel")
        self.assertEqual(kept()["state"], "running")
        answer("cancel", "")
        self.wait_for_text(".state", "cancelled")
        answer("fork")
        answer("fork", "1")
        self.wait(lambda: self.browser.current_url.endswith("/experiment/2"), "no fork is shown")
        self.wait_for_text("main", "quickstart")

    def test_a_newcomer_sees_the_first_and_the_last_swarm(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        command = [PROGRAMS / "swarmctl", "run", CONFIG, "--web", "--data-dir", directory.name]
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (run.kill(), run.wait()))
        address = next(line for line in run.stderr if "open in a browser: " in line).split()[-1]
        threading.Thread(target=run.stderr.read, daemon=True).start()
        self.browser.get(address)
        self.find("tr[data-id='1'] a").click()
        n_generations = lambda: int(self.script("return document.querySelector('.chart')?.dataset.generations ?? 0"))
        self.wait(lambda: 0 < n_generations() < 60, "no curve rises")
        self.wait_for_text(".state", "completed")
        self.wait(lambda: n_generations() == 60, "generations are missing")
        experiment = self.browser.current_url
        seen = []
        for generation in [0, 59]:
            self.browser.get(experiment)
            canvas = self.find(".heat-map canvas")
            self.wait(lambda: canvas.size["height"] > 100, "the map is empty")
            self.script("document.querySelector('.heat-map').scrollIntoView()")
            wide = canvas.size["width"] / 60
            x, y = int((generation + 0.5) * wide), 5
            webdriver.ActionChains(self.browser).move_to_element_with_offset(
                canvas, x - canvas.size["width"] // 2, y - canvas.size["height"] // 2
            ).click().perform()
            self.wait_for_text("h1", f"Individual 0 of generation {generation} of experiment 1")
            self.wait_for_text("#step", "step 99 of 99")
            seen.append(self.text("#result b"))
        self.assertNotEqual(*seen)

    def test_the_token_is_asked_for_once(self):
        self.expected_complaints = ["401 (Unauthorized)"]
        tokens = {"SWARM_CLIENT_TOKEN": CLIENT_TOKEN, "SWARM_WORKER_TOKEN": WORKER_TOKEN}
        fleet = Fleet(environment=tokens)
        self.addCleanup(fleet.stop)
        self.browser.get(fleet.pages + "/fleet")
        self.wait_for_text("form", "client token")
        for token in [WORKER_TOKEN, CLIENT_TOKEN]:
            field = self.find("#token")
            field.clear()
            field.send_keys(token, Keys.ENTER)
            if token == WORKER_TOKEN:
                self.wait_for_text("#problem", "this is not the client token")
        # The login leads to the address that was opened.
        self.wait_for_text("main", "No worker is connected")
        self.assertEqual(self.browser.current_url, fleet.pages + "/fleet")
        self.assertEqual(self.script("return document.cookie"), "", "a script can read the cookie")


class File(BrowserTest):
    """A replay in a file of its own."""

    is_dark = True

    def test_a_file_plays_without_a_server(self):
        with tempfile.TemporaryDirectory() as directory:
            genotype, html = (pathlib.Path(directory) / name for name in ("genes.json", "swarm.html"))
            genotype.write_text(json.dumps([0.6] * 424))
            command = ["replay", "--config", CONFIG, "--genotype", genotype, "--to", html]
            subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
            self.browser.get(f"{html.as_uri()}#step=30&robot=1")
            self.wait_for_text("#step", "step 30 of 99")
            self.assertEqual(self.text(".robot-panel h2"), "Robot 1")
            self.picture("file")
            self.find("#play").click()
            self.wait_for_text("#step", "step 99 of 99")


if __name__ == "__main__":
    unittest.main(verbosity=2)
