"""Steps a scene of `bodies.rs` in Chipmunk, by pymunk 7: robots that drive at random in a square
room, among discs that stand or a box to push; 4 substeps of 10 iterations, as there.

For each line of input, it prints the processor time per robot and step: of Chipmunk alone, and
with the loop in Python that drives the robots. Arguments: robots, obstacles, boxes, side of the
room in cm, seconds of a measurement.
"""

import math
import random
import sys
import time

del sys.path[0]  # where this file has the library's name

import pymunk  # noqa: E402

SUBSTEPS, ITERATIONS, STEP = 4, 10, 0.33
RADIUS, MASS, PUSH_FORCE, AXLE = 3.5, 0.15, 50.0, 11.0  # cm, kg, kg cm/s^2, cm
SPEED = 10.0


def room(n_robots, n_obstacles, n_boxes, side):
    rng = random.Random(1)
    space = pymunk.Space()
    space.iterations = ITERATIONS
    corners = [(0, 0), (side, 0), (side, side), (0, side)]
    for start, end in zip(corners, corners[1:] + corners[:1]):
        space.add(pymunk.Segment(space.static_body, start, end, 0.0))
    taken = []

    def place(radius, margin):
        while True:
            x, y = (rng.uniform(margin, side - margin) for _ in range(2))
            if all(math.hypot(x - a, y - b) > radius + other for a, b, other in taken):
                taken.append((x, y, radius))
                return x, y

    for _ in range(n_obstacles):
        space.add(pymunk.Circle(space.static_body, 10.0, place(10.0, 30.0)))
    for _ in range(n_boxes):
        box = pymunk.Body(0.1, pymunk.moment_for_box(0.1, (20, 20)))
        box.position = place(15.0, 100.0)
        ground = pymunk.PivotJoint(space.static_body, box, box.position, (0, 0))
        turning = pymunk.GearJoint(space.static_body, box, 0.0, 1.0)
        # Joints that only resist: friction with the ground.
        ground.max_bias = turning.max_bias = 0.0
        ground.max_force = 0.1 * 0.1 * 981.0
        turning.max_force = ground.max_force * 2 / 3 * math.sqrt(400 / math.pi)
        space.add(box, pymunk.Poly.create_box(box, (20, 20)), ground, turning)
    robots = []
    for _ in range(n_robots):
        robot = pymunk.Body(MASS, pymunk.moment_for_circle(MASS, 0, RADIUS))
        robot.position, robot.angle = place(RADIUS, 4.0), rng.uniform(0, math.tau)
        space.add(robot, pymunk.Circle(robot, RADIUS))
        robots.append(robot)
    return space, robots


def drive(robot, speed, turning, dt):
    """Velocity along the heading and turning towards those asked for, as far as forces go."""
    axis = pymunk.Vec2d(math.cos(robot.angle), math.sin(robot.angle))
    now = robot.velocity.dot(axis)
    change = PUSH_FORCE * dt / MASS
    robot.velocity = axis * (now + max(-change, min(change, speed - now)))
    change = 0.5 * PUSH_FORCE * AXLE * dt / robot.moment
    now = robot.angular_velocity
    robot.angular_velocity = now + max(-change, min(change, turning - now))


def main():
    n_robots, n_obstacles, n_boxes = map(int, sys.argv[1:4])
    side, seconds = map(float, sys.argv[4:])
    space, robots = room(n_robots, n_obstacles, n_boxes, side)
    rng, dt, n = random.Random(2), STEP / SUBSTEPS, 0
    asked = [(SPEED, 0.0)] * n_robots
    clock = time.process_time
    for _ in sys.stdin:
        start, alone, n_steps = clock(), 0.0, 0
        while clock() - start < seconds:
            if n % 20 == 0:
                asked = [(rng.uniform(0, SPEED), rng.uniform(-1, 1)) for _ in robots]
            n += 1
            n_steps += 1
            for _ in range(SUBSTEPS):
                for robot, (speed, turning) in zip(robots, asked):
                    drive(robot, speed, turning, dt)
                before = clock()
                space.step(dt)
                alone += clock() - before
        per = 1.0 / (n_steps * n_robots)
        print(alone * per, (clock() - start) * per, flush=True)


if __name__ == "__main__":
    main()
