"""Makes the pictures of docs/web.md and docs/gallery.md anew: pages and replays, in docs/figures.

    target/python/bin/python crates/web/tests/screenshots.py target/debug

Call it like `browser.py`. It is no test: it replaces the files.
"""

import json
import pathlib
import subprocess
import tempfile
import unittest

from harness import CONFIG, PROGRAMS, BrowserTest, Fleet

ROOT = CONFIG.parents[1]
FIGURES = ROOT / "docs/figures"
# For the figure of each replay: the published run, and the shown step and robot.
REPLAYS = {
    "leader": ("leader_selection_snes", 60, 3),
    "border": ("borderline_snes", 120, 13),
    "consensus": ("orientation_consensus_snes", 150, 4),
    "light": ("light_follower_snes", 300, 2),
}


# The shown trial of each task of docs/gallery.md.
TASKS = {
    "foraging": 0, "division_of_labour": 0, "flocking": 0, "synchronisation": 0,
    "aggregation": 0, "dispersion": 0, "chain": 0, "predator": 1,
    "transport": 0, "slalom": 0, "gather": 0, "harvest": 0, "maze": 0, "cluster": 0,
}


def champion(name, generation=1000):
    genotype = ROOT / f"results/champions/{name.split('/')[-1]}-0.json"
    return ["--config", ROOT / f"configs/{name}.json", "--genotype", genotype, "--generation", str(generation)]


def replay(*args):
    subprocess.run([PROGRAMS / "swarmctl", "replay", *args, "--force"], check=True, capture_output=True)


class Screenshots(BrowserTest):
    def shoot(self, name, width, height, part="body"):
        """Writes a picture of the page. `part`: the element at its top."""
        self.prefer("light")
        self.browser.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        self.script(f"document.querySelector('{part}').scrollIntoView()")
        # Two frames: the first draws, the second shows the drawing.
        self.browser.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 300)))")
        self.browser.save_screenshot(str(FIGURES / f"{name}.png"))

    def test_replays_of_the_published_runs(self):
        with tempfile.TemporaryDirectory() as directory:
            for name, (run, step, robot) in REPLAYS.items():
                html = pathlib.Path(directory) / f"{name}.html"
                replay(*champion(run), "--to", html)
                self.browser.get(f"{html.as_uri()}#step={step}&robot={robot}")
                self.wait_for_text(".robot-panel h2", f"Robot {robot}")
                self.shoot(f"replay-{name}", 1200, 900, ".episode")
            replay(*champion("light_follower_snes"), "--to", FIGURES / "picture-light.svg", "--at", "300", "--size", "600")

    def test_an_intervention(self):
        """Needs programs with the simulator for browsers."""
        with tempfile.TemporaryDirectory() as directory:
            html = pathlib.Path(directory) / "light.html"
            replay(*champion("light_follower_snes"), "--to", html)
            self.browser.get(f"{html.as_uri()}#step=330&beside=1&interventions=150:robot:4:mute,150:robot:7:mute,150:robot:2:mute")
            self.wait_for_text("#difference", "instead of")
            self.shoot("pages-intervene", 1250, 960)

    def test_last_steps_of_the_tasks(self):
        for name, trial in TASKS.items():
            last = json.loads((ROOT / f"configs/tasks/{name}.json").read_text())["algorithm"]["evaluation_steps"] - 1
            picture = ["--at", str(last), "--size", "780", "--to", FIGURES / f"task-{name}.png"]
            replay(*champion(f"tasks/{name}", 1_000_000), "--trial", str(trial), *picture)

    def test_a_fleet_that_is_treated_badly(self):
        with tempfile.TemporaryDirectory() as directory:
            html = pathlib.Path(directory) / "fleet.html"
            subprocess.run([PROGRAMS / "swarmctl", "web", "--demo", html], check=True, capture_output=True)
            self.browser.get(html.as_uri())
            self.wait(lambda: int(self.script("return document.querySelector('.demo-parts')?.dataset.generations ?? 0")) >= 8, "no generations")
            for health, workers in {"killed": (3, 8), "hung": (6, 13), "slow": (1, 15), "lying": (10, 17)}.items():
                self.script(f"document.querySelector('.tool [value={health}]').click()")
                for worker in workers:
                    self.script(f"document.querySelectorAll('.worker')[{worker}].click()")
            for worker in (10, 17):
                self.wait(lambda: "quarantined" in self.script(f"return document.querySelectorAll('.worker')[{worker}].ariaLabel"), "no quarantine")
            self.shoot("pages-demo", 1250, 690)

    def test_pages_of_a_fleet(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        workers = [fleet.start_worker(f"worker-{i}") for i in range(4)]
        fleet.swarmctl("submit", str(CONFIG), "--watch")
        fleet.swarmctl("submit", str(CONFIG), "--group", "sizes", "--set", "algorithm.population_size=16,48", "--seeds", "0..3")
        fleet.swarmctl("watch", "--quiet", "sizes")
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        self.shoot("pages-experiment", 1250, 885)
        self.browser.get(fleet.pages + "/?by=variant&open=sizes%2520%25C2%25B7%2520algorithm.population_size%253D48")
        self.wait_for_text("tbody", "median worth of 4 champions")
        self.shoot("pages-experiments", 1250, 620)
        self.browser.get(fleet.pages + "/compare?runs=" + ",".join(map(str, range(2, 10))) + "&as=groups")
        self.wait_for_text(".chart figcaption", "4 runs")
        self.find(".differences")
        self.shoot("pages-compare", 1250, 1005)
        self.browser.get(fleet.pages + "/replay/1#step=40&robot=1")
        self.wait_for_text("#result", "judged")
        self.find(".strip")
        self.shoot("pages-trials", 1250, 1425)
        config = json.loads(CONFIG.read_text())
        config.update(name="quickstart with a genetic algorithm")
        config["algorithm"]["name"] = "GA"
        config["algorithm"]["populations"]["network"]["params"].update(crossover_operator="uniform", num_elite=4)
        genetic = pathlib.Path(fleet.directory.name) / "genetic.json"
        genetic.write_text(json.dumps(config))
        fleet.swarmctl("submit", str(genetic), "--set", "algorithm.population_size=64", "--watch")
        self.browser.get(fleet.pages + "/experiment/10")
        self.wait_for_text(".state", "completed")
        self.script("document.querySelector('.families').open = true")
        self.wait_for_text(".families", f"{64 * 59:,} children")
        self.shoot("pages-families", 1100, 640, ".families")
        fleet.swarmctl("submit", str(CONFIG), "--generations", "100000")
        self.browser.get(fleet.pages + "/fleet")
        # Waits until the timeline shows only this experiment.
        done = "return fetch('/api/experiments/11').then((it) => it.json()).then((it) => it.experiment.generations_done)"
        self.wait(lambda: self.script(done) > 70, "it does not go on")
        workers[3].kill()
        self.wait_for_text(".broken", "worker-3: lost with its worker")
        self.wait_for_text("main", " episodes in ")
        self.shoot("pages-fleet", 1400, 620)


if __name__ == "__main__":
    unittest.main(verbosity=2)
