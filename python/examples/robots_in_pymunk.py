"""Drives robots of another simulator, pymunk, with the exported C controller of a champion.

    pip install ./python pymunk
    python python/examples/robots_in_pymunk.py transport        # or gather

Prints the fitness there beside that of swarmevo. pymunk has its own contacts, with friction, and
wheels that slip: joints to the ground hold with a largest force, in all directions.
"""

import argparse
import ctypes
import math
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pymunk

import swarmevo

ROOT = Path(__file__).resolve().parents[2]
RADIUS, MASS, FORCE, AXLE, SPEED, STEP = 3.5, 0.15, 50.0, 11.0, 10.0, 0.33  # cm, kg, s; force: 0.5 N
GRAVITY, SUBSTEPS = 981.0, 10
ROBOT, OTHER = 1, 2  # categories of shapes


class Actions(ctypes.Structure):
    """`swarm_actions_t` of a network that drives wheels."""

    _fields_ = [("right", ctypes.c_float), ("left", ctypes.c_float)]


class Controller:
    """A compiled controller: stimuli are floats, in the order of `swarm_stimuli_t`."""

    def __init__(self, library):
        self.step = library.swarm_step
        self.state = ctypes.create_string_buffer(library.swarm_size())
        self.actions = Actions()
        library.swarm_init(self.state)

    def decide(self, stimuli):
        self.step(self.state, (ctypes.c_float * len(stimuli))(*stimuli), ctypes.byref(self.actions))
        return self.actions.right, self.actions.left


class Room:
    """Walls around a rectangle, and what is in it."""

    def __init__(self, args, width, height):
        self.args, self.space = args, pymunk.Space()
        self.width, self.height = width, height
        self.robots = []
        corners = [(0, 0), (width, 0), (width, height), (0, height)]
        for ends in zip(corners, corners[1:] + corners[:1]):
            self.wall(*ends)

    def wall(self, start, end):
        self.add(pymunk.Segment(self.space.static_body, start, end, 0))

    def add(self, shape, robot=0):
        shape.friction = self.args.friction
        shape.filter = pymunk.ShapeFilter(group=robot, categories=ROBOT if robot else OTHER)
        self.space.add(shape)

    def hold(self, holder, body, force, torque):
        """The holder brings the body to its own velocity, with these at most."""
        for joint, most in ((pymunk.PivotJoint(holder, body, (0, 0), (0, 0)), force),
                            (pymunk.GearJoint(holder, body, 0, 1), torque)):
            joint.max_force, joint.max_bias = most, 0
            self.space.add(joint)

    def add_robot(self, rng, place, library):
        body = pymunk.Body(MASS, pymunk.moment_for_circle(MASS, 0, RADIUS))
        while True:  # until nothing is there
            body.position = place()
            is_inside = RADIUS < body.position.x < self.width - RADIUS and RADIUS < body.position.y < self.height - RADIUS
            if is_inside and not self.space.point_query(body.position, RADIUS, pymunk.ShapeFilter()):
                break
        body.angle = rng.uniform(0, math.tau)
        body.wheels = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self.space.add(body, body.wheels)
        self.hold(body.wheels, body, FORCE, FORCE * AXLE / 2)
        body.controller = Controller(library)
        self.robots.append(body)
        number = len(self.robots)
        self.add(pymunk.Circle(body, RADIUS), number)
        body.sight = pymunk.ShapeFilter(group=number, mask=ROBOT)  # other robots

    def step(self, sense):
        asked = [robot.controller.decide(sense(robot)) for robot in self.robots]
        for _ in range(SUBSTEPS):
            for robot, (right, left) in zip(self.robots, asked):
                robot.wheels.velocity = robot.rotation_vector * (SPEED * (right + left) / 2)
                robot.wheels.angular_velocity = SPEED * (right - left) / AXLE
                if self.args.wheels_hold:
                    robot.velocity = robot.rotation_vector * robot.velocity.dot(robot.rotation_vector)
            self.space.step(STEP / SUBSTEPS)


def gather(args, rng, library):
    """configs/tasks/gather: whether a robot is straight ahead."""
    room = Room(args, 200, 200)
    for _ in range(10):
        room.add_robot(rng, lambda: tuple(rng.uniform(5, 195, 2)), library)

    def sense(robot):
        end = robot.position + robot.rotation_vector * (RADIUS + 300)
        return [room.space.segment_query_first(robot.position, end, 0, robot.sight) is not None]

    scores = []
    for step in range(900):
        room.step(sense)
        if step >= 600:
            places = np.array([robot.position for robot in room.robots])
            away = np.linalg.norm(places - places.mean(axis=0), axis=1)
            scores.append(np.maximum(1 - away / 80, 0).mean())
    return np.mean(scores)


def transport(args, rng, library):
    """configs/tasks/transport: the way around a box, and where to push it."""
    room, mass, grip = Room(args, 300, 200), 0.3, 0.25
    room.wall((150, 0), (150, 65))
    room.wall((150, 135), (150, 200))
    box = pymunk.Body(mass, pymunk.moment_for_box(mass, (24, 24)))
    box.position, box.angle = (80, 100), rng.uniform(0, math.tau)
    room.space.add(box)
    room.add(pymunk.Poly.create_box(box, (24, 24)))
    hold = grip * mass * GRAVITY
    room.hold(room.space.static_body, box, hold, hold * 2 / 3 * math.sqrt(24 * 24 / math.pi))

    def place():
        angle = rng.uniform(0, math.tau)
        return 50 + 35 * math.cos(angle), 100 + 35 * math.sin(angle)

    for _ in range(4):
        room.add_robot(rng, place, library)
    door, goal = pymunk.Vec2d(150, 100), pymunk.Vec2d(245, 100)

    def sense(robot):
        way = ((goal if box.position.x > 145 else door) - box.position).normalized()
        x, y = robot.position - box.position
        along, aside = x * way.x + y * way.y, y * way.x - x * way.y
        ahead = way
        if along >= -10:
            ahead = box.position - way * 20 + way.perpendicular() * math.copysign(26, aside) - robot.position
            aside = 0
        ahead = ahead.normalized().rotated(-robot.angle)
        return [ahead.x, ahead.y, max(-1, min(aside / 20, 1))]

    def remaining():
        place = box.position
        return (place - goal).length if place.x > 145 else (place - door).length + (goal - door).length

    left = []
    for _ in range(500):
        room.step(sense)
        left.append(remaining())
    return 1 - np.mean(left) / left[0]


def interval(rng, *samples):
    """The mean of the first sample, less that of the second, with its 95 % bootstrap interval."""
    def means(them):
        return rng.choice(them, (10_000, len(them))).mean(axis=1)

    low, high = np.quantile(sum(sign * means(them) for sign, them in zip((1, -1), samples)), [0.025, 0.975])
    mean = samples[0].mean() - (samples[1].mean() if len(samples) > 1 else 0)
    return f"{mean:6.3f} ({low:.3f} to {high:.3f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    tasks = {"gather": gather, "transport": transport}
    parser.add_argument("task", choices=tasks)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--friction", type=float, default=0.3, help="of contacts")
    parser.add_argument("--wheels-hold", action="store_true", help="wheels never slip sideways, as in swarmevo")
    args = parser.parse_args()

    champion = swarmevo.Champion.from_file(ROOT / f"results/champions/{args.task}-0.json")
    experiment = swarmevo.Experiment.from_file(ROOT / f"configs/tasks/{args.task}.json", seed=champion.origin.seed)
    here = experiment.evaluate(champion, swarmevo.TrialSet.evaluation(), trials=args.trials)
    with tempfile.TemporaryDirectory() as directory:
        experiment.network(champion).to_c(directory)
        subprocess.run(["make", "--silent", "-C", directory, "shared"], check=True)
        library = ctypes.CDLL(f"{directory}/controller.so")
        rngs = np.random.default_rng(1).spawn(args.trials + 1)
        there = np.array([tasks[args.task](args, rng, library) for rng in rngs[1:]])
    for name, samples in (("swarmevo", [here]), ("pymunk", [there]), ("difference", [there, here])):
        print(f"{name:12}{interval(rngs[0], *samples)}")


if __name__ == "__main__":
    main()
