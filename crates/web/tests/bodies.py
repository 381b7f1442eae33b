"""The drawing of worlds with bodies in a real browser; called like `browser.py`."""

import csv
import json
import pathlib
import subprocess
import tempfile
import unittest

from harness import NARROW, PROGRAMS, BrowserTest

WIDTH, HEIGHT, STEPS = 200, 100, 20
SCRIPT = """
def control(robot):
    robot.left = 1
    robot.right = 1

def fitness(world):
    return world.movables[0].x
"""


def at(values, heading=0):
    return {
        "positions": {"name": "fixed", "params": {"values": values}},
        "orientations": {"name": "fixed", "params": {"values": [[heading]]}},
    }


def robots(values, radius):
    return {
        "type": "robot", "num_instances": len(values), "controller": "script_controller",
        "body": {"radius": radius}, "sensors": {"proximity_sensor": {}}, "actuators": {"wheel_actuator": {}},
        "initializers": at(values),
    }


# Two small robots push a box, a large one drives beside them.
CONFIG = {
    "task": {"script": {"name": "push.star", "text": SCRIPT}},
    "algorithm": {
        "name": "SNES", "evolvable_object": "small", "population_size": 10, "generations": 1,
        "evaluation_steps": STEPS, "num_evaluations": 1,
        "populations": {"all": {"objects": ["synapses:weights:all"], "min_vals": -1, "max_vals": 1}},
    },
    "topology": {
        "stimuli": {"I": {"n": 8, "sensor": "proximity_sensor"}}, "ensembles": {"O": {"n": 2}},
        "synapses": {"s": {"pre": "I", "post": "O"}}, "outputs": {"w": {"ensemble": "O", "actuator": "wheel_actuator"}},
        "decoding": {"w": {"scheme": "IdentityDecoding"}},
    },
    "world": {
        "width": WIDTH, "height": HEIGHT, "boundary": "walls", "bodies": {},
        "objects": {
            "small": robots([[30, 46], [30, 54]], 3.5),
            "large": robots([[30, 20]], 7),
            "box": {
                "type": "movable", "num_instances": 1, "initializers": at([[60, 50]]),
                "params": {"corners": [[-10, -10], [10, -10], [10, 10], [-10, 10]], "mass": 0.2},
            },
            "pillar": {"type": "obstacle", "num_instances": 1, "params": {"radius": 8}, "initializers": at([[160, 20]])},
            "wall": {"type": "wall", "corners": [[120, 70], [120, 90], [140, 90]]},
        },
    },
}
# A place with nothing but the ground.
EMPTY = (85, 85)
# The shades of places of the world, and of the colour that marks contacts. A place may be some
# pixels aside.
SHADES = """
    const [places, width, height] = arguments;
    const it = document.querySelector('.world');
    const box = it.getBoundingClientRect();
    const scale = Math.min(box.width / (1.04 * width), box.height / (1.04 * height));
    const ratio = it.width / box.width;
    const context = new OffscreenCanvas(it.width, it.height).getContext('2d', { willReadFrequently: true });
    context.drawImage(it, 0, 0);
    const shades = places.map(([x, y, right = 0, down = 0]) => {
        const at = [box.width / 2 + (x - width / 2) * scale + right, box.height / 2 - (y - height / 2) * scale + down];
        return [...context.getImageData(...at.map((it) => Math.floor(it * ratio)), 1, 1).data];
    });
    const swatch = new OffscreenCanvas(1, 1).getContext('2d');
    swatch.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--accent');
    swatch.fillRect(0, 0, 1, 1);
    return [...shades, [...swatch.getImageData(0, 0, 1, 1).data]];
"""


def apart(shade, other):
    return max(abs(a - b) for a, b in zip(shade, other))


class Bodies(BrowserTest):
    """A replay in a file."""

    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        config, genotype, trace, cls.html = (
            pathlib.Path(directory.name) / name for name in ("push.json", "genes.json", "trace.csv", "push.html")
        )
        config.write_text(json.dumps(CONFIG))
        genotype.write_text(json.dumps([0.5] * 16))
        for command in (
            ["replay", "--config", config, "--genotype", genotype, "--to", cls.html],
            ["simulate", config, "--genotype", genotype, "--generation", "0", "--trace", trace],
        ):
            subprocess.run([PROGRAMS / "swarmctl", *command], check=True, capture_output=True)
        with trace.open() as lines:
            cls.rows = list(csv.DictReader(lines))

    def of(self, step, robot):
        return next(it for it in self.rows if (it["step"], it["robot"]) == (str(step), str(robot)))

    def open(self, step):
        self.browser.get(self.html.as_uri() + f"#step={step}")
        self.wait_for_text(".step", f"step {step} of {STEPS - 1}")
        shown = "return document.querySelector('.world').width"
        self.wait(lambda: self.script(shown) > 300, "the world has no size")
        self.wait(lambda: apart(*self.browser.execute_script(SHADES, [EMPTY, (120, 80)], WIDTH, HEIGHT)[:2]) > 60, "no wall is drawn")

    def shades(self, places):
        """The shade of the ground, of each place, and of contacts."""
        ground, *shades, contact = self.browser.execute_script(SHADES, [EMPTY, *places.values()], WIDTH, HEIGHT)
        return ground, dict(zip(places, shades)), contact

    def check(self, things, free):
        ground, shades, _ = self.shades({**things, **free})
        for name in things:
            self.assertGreater(apart(shades[name], ground), 20, f"{name} is not drawn")
        for name in free:
            self.assertLess(apart(shades[name], ground), 5, f"something is drawn at {name}")

    def check_all(self):
        self.open(0)
        edges = {"left": (0, 60), "right": (WIDTH, 60), "bottom": (60, 0), "top": (60, HEIGHT)}
        self.check(
            {**edges, "wall": (120, 80), "corner": (120, 90), "end": (139, 90), "pillar": (160, 20), "its rim": (160, 28)},
            {"beyond the wall": (143, 90), "below the wall": (120, 66), "beside the pillar": (171, 20), "outside": (WIDTH + 3, 60)},
        )
        self.check(
            {"box": (60, 50), "its corner": (69, 59)},
            {"beside it": (73, 50), "its other side": (60, 63)},
        )

        def rims(step):
            """Places within and beyond the rims of the robots, below their centres."""
            within, beyond = {}, {}
            for robot, radius in enumerate([3.5, 3.5, 7]):
                if robot == 1 or self.of(step, robot)["touches"] == "1":
                    continue  # Beside it is another robot, or a ring around it.
                x, y = (float(self.of(step, robot)[axis]) for axis in ("x_cm", "y_cm"))
                within[f"robot {robot} at step {step}"] = (x, y - 0.75 * radius)
                beyond[f"rim of robot {robot} at step {step}"] = (x, y - radius, 0, 3)
            return within, beyond

        self.check(*rims(0))
        self.assertEqual([self.of(0, robot)["touches"] for robot in range(3)], ["0"] * 3)
        touched = {"robot 0": self.ring(0, 0, 3.5), "robot 2": self.ring(0, 2, 7)}
        _, shades, contact = self.shades(touched)
        for name, shade in shades.items():
            self.assertGreater(apart(shade, contact), 60, f"{name} has a ring")

        last = STEPS - 1
        self.open(last)
        self.check(*rims(last))
        x, y = (float(self.of(last, 0)[f"movable_0_{axis}_cm"]) for axis in ("x", "y"))
        self.assertGreater(x, 65, "nobody pushes the box")
        self.check({"box": (x, y), "its side": (x + 8, y)}, {"beside it": (x + 13, y)})
        self.assertEqual([self.of(last, robot)["touches"] for robot in range(3)], ["1", "1", "0"])
        _, shades, contact = self.shades({0: self.ring(last, 0, 3.5), 2: self.ring(last, 2, 7)})
        self.assertLess(apart(shades[0], contact), 60, "who touches the box has no ring")
        self.assertGreater(apart(shades[2], contact), 60, "who touches nothing has a ring")

    def ring(self, step, robot, radius):
        """A place of the ring around a robot that touches something, below it."""
        x, y = (float(self.of(step, robot)[axis]) for axis in ("x_cm", "y_cm"))
        return x, y - radius, 0, 1

    def test_walls_and_bodies_are_drawn_where_they_are_and_to_scale(self):
        self.check_all()
        self.picture("bodies")

    def test_so_they_are_on_a_phone(self):
        self.narrow()
        self.check_all()
        self.assertLessEqual(self.width(), NARROW)
        self.picture("bodies-narrow")


if __name__ == "__main__":
    unittest.main(verbosity=2)
