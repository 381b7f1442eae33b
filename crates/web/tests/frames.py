"""Measures the frames per second of a replay in headless Chromium, and where the time goes.

    target/python/bin/python crates/web/tests/frames.py target/debug [--profile]

The argument is the folder with swarmctl. The script plays 50 and 500 robots with trails and received
messages, and once more with the reach of all radios. --profile also prints the functions that took
most time. Without a graphics card, the processor draws everything. SWARM_SCREENSHOTS=DIR writes a
picture of step 60 there.
"""

import collections
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import unittest

IS_PROFILED = "--profile" in sys.argv and not sys.argv.remove("--profile")

from harness import CONFIG, PROGRAMS, BrowserTest

ROOT = CONFIG.parents[1]
N_ROBOTS = [50, 500]
SECONDS = 6
STEPS = 200

# The time of every frame, and the share of scripts in it, ms.
COUNTER = """
    const ask = requestAnimationFrame.bind(window);
    window.frames_drawn = [];
    window.requestAnimationFrame = (call) => ask((now) => {
        const begin = performance.now();
        call(now);
        window.frames_drawn.push([now, performance.now() - begin]);
    });
"""


class Frames(BrowserTest):
    def swarm(self, directory, n_robots):
        """A replay file of robots that drive through their whole world and hear each other."""
        config = json.loads((ROOT / "configs/light_follower_snes.json").read_text())
        robots = config["world"]["objects"]["robotA"]
        robots["num_instances"] = n_robots
        robots["initializers"]["positions"]["params"].update(low=0, high=1000)
        file, html = (directory / f"{n_robots}.{end}" for end in ("json", "html"))
        file.write_text(json.dumps(config))
        command = ["replay", "--config", file, "--genotype", ROOT / "results/champions/light_follower_snes-0.json", "--changed-conditions"]
        subprocess.run([PROGRAMS / "swarmctl", *command, "--steps", str(STEPS), "--to", html], check=True, capture_output=True)
        return html

    def play(self, n_robots, html, has_reach):
        self.browser.get(f"{html.as_uri()}#step=60")
        self.wait_for_text(".episode", f"{n_robots} robots")
        self.picture(f"frames-{n_robots}")
        self.browser.get("about:blank")
        self.browser.get(f"{html.as_uri()}#step=0")
        if has_reach:
            self.find("#show-reach").click()
        # Slow enough that the replay lasts longer than the measurement.
        self.assertLess(SECONDS * 20, STEPS)
        self.browser.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
        before = self.main_thread()
        if IS_PROFILED:
            self.browser.execute_cdp_cmd("Profiler.enable", {})
            self.browser.execute_cdp_cmd("Profiler.start", {})
        self.find("#play").click()
        elapsed = "(frames_drawn.length && frames_drawn.at(-1)[0] - frames_drawn[0][0])"
        self.wait(lambda: self.script(f"return {elapsed} > {1000 * SECONDS}"), "it does not play")
        frames = self.script("return frames_drawn")
        thread = 1000 * (self.main_thread() - before) / len(frames)
        if IS_PROFILED:
            self.print_profile(self.browser.execute_cdp_cmd("Profiler.stop", {})["profile"])
        intervals = [after[0] - before[0] for before, after in zip(frames, frames[1:])]
        late = statistics.quantiles(intervals, n=20)[-1]
        drawing = statistics.mean(took for _, took in frames)
        print(
            f"{n_robots:4} robots{', reach' if has_reach else ''}  {1000 / statistics.mean(intervals):5.1f} frames/s, 95 % of frames within "
            f"{late:.1f} ms, scripts take {drawing:.1f} ms of a frame, the main thread {thread:.1f} ms of a processor"
        )

    def main_thread(self):
        """Processor seconds that the browser has used."""
        metrics = self.browser.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return next(it["value"] for it in metrics if it["name"] == "TaskDuration")

    def print_profile(self, profile):
        """Functions by their own time."""
        names = {}
        for node in profile["nodes"]:
            frame = node["callFrame"]
            names[node["id"]] = f"{frame['functionName'] or '(anonymous)'}:{frame['lineNumber'] + 1}"
        times = collections.Counter()
        for node, took in zip(profile["samples"], profile["timeDeltas"]):
            times[names[node]] += took
        for name, took in times.most_common(16):
            print(f"      {took / sum(times.values()):6.1%}  {name}")

    def runTest(self):
        self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": COUNTER})
        with tempfile.TemporaryDirectory() as directory:
            for n_robots in N_ROBOTS:
                html = self.swarm(pathlib.Path(directory), n_robots)
                for has_reach in [False, True]:
                    self.play(n_robots, html, has_reach)


if __name__ == "__main__":
    unittest.main()
