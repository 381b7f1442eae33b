#!/usr/bin/env python3
"""Gives bodies to the champions of the thesis's four tasks, and prints what that costs.

    results/bodies.py transfer             evaluates champions of points as points and with bodies
    results/bodies.py evolve SEED          evolves D with bodies that block light and radio, and evaluates
                                           the champion
    results/bodies.py time                 prints the processor time of four generations of D in each condition
    results/bodies.py report [--update]    prints the tables of docs/bodies.md, or writes them into that page

The robots get the size of an e-puck, and the room has the size of the thesis's torus. `transfer` covers all
seeds that results/fetch has brought, and writes results/bodies.csv. `evolve` takes D, because robots of A, B
and C stay in their places; it writes history and champion to results/bodies/D-SEED.csv and .json, and adds
rows to results/bodies.csv. All but `report` need swarmctl in the PATH. Needs Python 3.9.
"""

import csv
import json
import resource
import statistics
import sys
import tempfile
from pathlib import Path

import algorithms
from hypotheses import changed
from report import LAST, RESULTS, evaluated, markdown, middle, print_or_update, read_csv

PAGE = RESULTS.parent / "docs" / "bodies.md"
TABLE = RESULTS / "bodies.csv"
EVOLVED = RESULTS / "bodies"
TRIALS = 200
GENERATIONS = 200
ROBOT = "world.objects.robotA."
BODIES = {"world.boundary": "walls", "world.bodies": {}, ROBOT + "body": {"radius": 3.5}}
BLOCKED = {ROBOT + "sensors.wireless_receiver.blocked_by": "bodies"}
BLOCKED_LIGHT = {ROBOT + "sensors.light_sensor.blocked_by": "bodies"}
# Experiment, name of its file, and what bodies block.
TASKS = [
    ("A", "leader_selection_snes", BLOCKED),
    ("B", "borderline_snes", BLOCKED),
    ("C", "orientation_consensus_snes", BLOCKED),
    ("D", "light_follower_snes", {**BLOCKED, **BLOCKED_LIGHT}),
]
D = TASKS[-1][1:]
COLUMNS = ["task", "evolved_as", "seed", "condition", "trials", "fitness", "low", "high"]
CONDITIONS = ["points", "bodies", "bodies that block light and radio"]


def conditions(blocked):
    """The changes of each condition."""
    return zip(CONDITIONS, [{}, BODIES, {**BODIES, **blocked}])


def transfer():
    with TABLE.open("w", newline="") as file:
        write_row(file, COLUMNS)
        for _, task, blocked in TASKS:
            for champion in sorted((RESULTS / "champions").glob(f"{task}-[0-9]*.json")):
                judge(file, task, blocked, "points", champion)
        for champion in sorted(EVOLVED.glob("D-[0-9]*.json")):
            judge(file, *D, "bodies", champion)


def evolve(seed):
    task, blocked = D
    stem = EVOLVED / f"D-{seed}"
    champion = Path(f"{stem}.json")
    EVOLVED.mkdir(exist_ok=True)
    if champion.exists():
        return
    experiment = json.loads((RESULTS.parent / "configs" / f"{task}.json").read_text())
    budget = {"algorithm.generations": GENERATIONS}
    algorithms.evolve(changed(experiment, {**BODIES, **blocked, **budget}), seed, stem, workers=1)
    with TABLE.open("a", newline="") as file:
        judge(file, task, blocked, "bodies", champion)


def measure():
    """Prints the median of three runs per condition, in turns, as multiples of the time of points."""
    task, blocked = D
    experiment = json.loads((RESULTS.parent / "configs" / f"{task}.json").read_text())
    seconds = {condition: [] for condition in CONDITIONS}
    for _ in range(3):
        for condition, changes in conditions(blocked):
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            with tempfile.TemporaryDirectory() as folder:
                algorithms.evolve(changed(experiment, {**changes, "algorithm.generations": 4}), 0, f"{folder}/run", 1)
            seconds[condition].append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    points = statistics.median(seconds["points"])
    for condition, values in seconds.items():
        print(f"{condition}: {statistics.median(values):.1f} s, {statistics.median(values) / points:.2f} times points")


def judge(file, task, blocked, evolved_as, champion):
    """Writes a champion's fitness under each condition."""
    seed = champion.stem.rsplit("-", 1)[1]
    for condition, changes in conditions(blocked):
        fitness = evaluate(task, changes, champion)
        values = [fitness["mean"], *fitness["ci95"]]
        write_row(file, [task, evolved_as, seed, condition, TRIALS, *(f"{value:.6f}" for value in values)])


def write_row(file, values):
    csv.writer(file, lineterminator="\n").writerow(values)
    file.flush()


def evaluate(task, changes, champion):
    experiment = json.loads((RESULTS.parent / "configs" / f"{task}.json").read_text())
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / f"{task}.json"
        config.write_text(json.dumps(changed(experiment, changes)))
        return evaluated(config, champion, TRIALS, f"{folder}/to")["conditions"][0]["fitness"]


def table():
    rows = read_csv(TABLE)
    kinds = [(name, task, "points") for name, task, _ in TASKS] + [("D, evolved with bodies", D[0], "bodies")]
    return markdown(["", *CONDITIONS], (
        [name, *(middle([[float(row[key]) for key in ("fitness", "low", "high")] for row in rows
                         if (row["task"], row["evolved_as"], row["condition"]) == (task, evolved_as, condition)])
                 for condition in CONDITIONS)]
        for name, task, evolved_as in kinds))


def mean_fitness(history, last):
    """The mean fitness of a population in the 50 generations before `last`."""
    means = [float(row["mean"]) for row in read_csv(history)]
    return statistics.mean(means[last - LAST:last])


def learning():
    """How far populations of D got, as points and with bodies."""
    ends = [100, 150, GENERATIONS]
    folders = [("points", RESULTS / "histories", D[0]), ("bodies that block light and radio", EVOLVED, "D")]
    return markdown(["mean of the 50 generations before", *ends], (
        [name, *("; ".join(f"{mean_fitness(history, end):.3f}" for history in sorted(folder.glob(f"{stem}-[0-9].csv")))
                 for end in ends)]
        for name, folder, stem in folders))


if __name__ == "__main__":
    command = sys.argv.pop(1) if len(sys.argv) > 1 else ""
    if command == "transfer":
        transfer()
    elif command == "evolve" and len(sys.argv) == 2:
        evolve(int(sys.argv[1]))
    elif command == "time":
        measure()
    elif command == "report":
        print_or_update(PAGE, "the thesis with bodies", table())
        print_or_update(PAGE, "evolving with bodies", learning())
    else:
        sys.exit(__doc__)
