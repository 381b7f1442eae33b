"""The pictures of docs/web.md: pages and replays as they are now, in docs/figures.

    target/python/bin/python web/tests/screenshots.py target/debug

Called as `browser.py` is, and not a test: it writes the files anew.
"""

import pathlib
import subprocess
import tempfile
import unittest

from harness import CONFIG, PROGRAMS, BrowserTest, Fleet

ROOT = CONFIG.parents[1]
FIGURES = ROOT / "docs/figures"
# A replay's figure: its published run, and the step and the robot that are seen.
REPLAYS = {
    "leader": ("leader_selection_snes", 60, 3),
    "border": ("borderline_snes", 120, 13),
    "consensus": ("orientation_consensus_snes", 150, 4),
    "light": ("light_follower_snes", 300, 2),
}


def champion(name):
    genotype = ROOT / f"results/champions/{name}-0.json"
    return ["--config", ROOT / f"configs/{name}.json", "--genotype", genotype, "--generation", "1000"]


def replay(*args):
    subprocess.run([PROGRAMS / "swarmctl", "replay", *args, "--force"], check=True, capture_output=True)


class Screenshots(BrowserTest):
    def shoot(self, name, width, height, theme="light"):
        self.prefer(theme)
        self.browser.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        # Two frames: one that is asked for now, and one that shows what it has drawn.
        self.browser.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 300)))")
        self.browser.save_screenshot(str(FIGURES / f"{name}.png"))

    def test_replays_of_the_published_runs(self):
        with tempfile.TemporaryDirectory() as directory:
            for name, (run, step, robot) in REPLAYS.items():
                html = pathlib.Path(directory) / f"{name}.html"
                replay(*champion(run), "--to", html)
                self.browser.get(f"{html.as_uri()}#step={step}&robot={robot}")
                self.wait_for_text(".robot-panel h2", f"Robot {robot}")
                self.shoot(f"replay-{name}", 1200, 900)
            replay(*champion("light_follower_snes"), "--to", FIGURES / "picture-light.svg", "--at", "300", "--size", "600")

    def test_pages_of_a_fleet(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        workers = [fleet.start_worker(f"worker-{i}") for i in range(4)]
        fleet.swarmctl("submit", str(CONFIG), "--watch")
        fleet.swarmctl("submit", str(CONFIG), "--group", "sizes", "--set", "algorithm.population_size=16,48", "--seeds", "0..3")
        fleet.swarmctl("wait", "sizes")
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text(".chart figcaption", "champion, 95 %")
        self.wait_for_text(".heat-map .scale", "fitness ≤")
        self.shoot("pages-experiment", 1250, 860)
        self.browser.get(fleet.pages + "/?by=variant&open=sizes%2520%25C2%25B7%2520algorithm.population_size%253D48")
        self.wait_for_text("tbody", "median worth of 4 champions")
        self.shoot("pages-experiments", 1250, 620)
        self.browser.get(fleet.pages + "/compare?runs=" + ",".join(map(str, range(2, 10))) + "&as=groups")
        self.wait_for_text(".chart figcaption", "4 runs")
        self.find(".differences")
        self.shoot("pages-compare", 1250, 1250)
        self.browser.get(fleet.pages + "/replay/1#step=40&robot=1")
        self.wait_for_text("#result", "judged")
        self.find(".strip")
        self.shoot("pages-trials", 1250, 1440)
        fleet.swarmctl("submit", str(CONFIG), "--generations", "100000")
        self.browser.get(fleet.pages + "/fleet")
        self.find(".fleet-timeline[data-assignments]")
        workers[3].kill()
        self.wait_for_text(".broken", "worker-3: lost with its worker")
        self.shoot("pages-fleet", 1400, 620)


if __name__ == "__main__":
    unittest.main(verbosity=2)
