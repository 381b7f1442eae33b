"""Measures the speed of pages in headless Chromium: first paint, zooming the map. Replays:
`frames.py`.

    target/python/bin/python crates/web/tests/speed.py target/release

The argument is the folder with coordinator, worker and swarmctl. Without a graphics card, the
processor draws everything.
"""

import json
import pathlib
import statistics
import unittest

from harness import CONFIG, BrowserTest, Fleet

# More than 10,000 cells.
GENERATIONS, POPULATION_SIZE = 160, 64
FRAMES = 300

# Milliseconds between frames while each frame has work.
INTERVALS = """
    const done = arguments[0];
    const times = [];
    const next = (now) => {
        const frame = times.push(now);
        %s;
        if (frame <= %d) requestAnimationFrame(next);
        else done(times.slice(1).map((time, i) => time - times[i]));
    };
    requestAnimationFrame(next);
"""


class Speed(BrowserTest):
    def intervals(self, per_frame=""):
        self.browser.set_script_timeout(300)
        return self.browser.execute_async_script(INTERVALS % (per_frame, FRAMES))

    def line(self, what, intervals):
        late = statistics.quantiles(intervals, n=20)[-1]
        print(f"{what:44} {1000 / statistics.mean(intervals):5.0f} frames/s, 95 % of frames within {late:.1f} ms")

    def runTest(self):
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.start_worker()
        config = json.loads(CONFIG.read_text())
        config["algorithm"].update(population_size=POPULATION_SIZE, num_evaluations=1, champion_every=GENERATIONS)
        file = pathlib.Path(fleet.directory.name) / "large.json"
        file.write_text(json.dumps(config))
        fleet.swarmctl("submit", str(file), "--generations", str(GENERATIONS), "--watch")
        for name, path in [("experiments", "/"), ("an experiment", "/experiment/1"), ("fleet", "/fleet")]:
            self.browser.get(fleet.pages + path)
            self.wait(lambda: self.script("return performance.getEntriesByName('first-contentful-paint').length"), "nothing is painted")
            paint = self.script("return performance.getEntriesByName('first-contentful-paint')[0].startTime")
            print(f"{'first paint: ' + name:44} {paint:5.0f} ms")
        self.browser.get(fleet.pages + "/experiment/1")
        canvas = self.find(".heat-map canvas")
        self.wait(lambda: canvas.size["height"] > 100, "the map is empty")
        self.script("document.querySelector('.heat-map').scrollIntoView()")
        self.line("nothing happens", self.intervals())
        key = "frame % 2 ? '-' : '+'"
        zoomed = f"document.querySelector('.heat-map .cells').dispatchEvent(new KeyboardEvent('keydown', {{ key: {key}, bubbles: true }}))"
        self.line("the map zooms, 10,240 individuals", self.intervals(zoomed))


if __name__ == "__main__":
    unittest.main()
