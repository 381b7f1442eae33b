#!/usr/bin/env python3
"""Gives bodies to the champions of the thesis's four tasks, and prints what that costs.

    results/bodies.py transfer             evaluates champions of points as points and with bodies
    results/bodies.py report [--update]    prints the table of docs/bodies.md, or writes it into that page

The robots get the size of an e-puck, and the room has the size of the thesis's torus. `transfer` covers all
seeds that results/fetch has brought, and writes results/bodies.csv; it needs swarmctl in the PATH. Needs
Python 3.9.
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from hypotheses import changed
from report import RESULTS, markdown, print_or_update, read_csv

PAGE = RESULTS.parent / "docs" / "bodies.md"
TABLE = RESULTS / "bodies.csv"
TRIALS = 200
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
CONDITIONS = ["points", "bodies", "bodies that block light and radio"]


def conditions(blocked):
    """The changes of each condition."""
    return zip(CONDITIONS, [{}, BODIES, {**BODIES, **blocked}])


def transfer():
    with TABLE.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["task", "seed", "condition", "trials", "fitness", "low", "high"])
        for _, task, blocked in TASKS:
            for champion in sorted((RESULTS / "champions").glob(f"{task}-[0-9]*.json")):
                seed = champion.stem.rsplit("-", 1)[1]
                for condition, changes in conditions(blocked):
                    fitness = evaluate(task, changes, champion)
                    values = [fitness["mean"], *fitness["ci95"]]
                    rows.writerow([task, seed, condition, TRIALS, *(f"{value:.6f}" for value in values)])
                    file.flush()


def evaluate(task, changes, champion):
    experiment = json.loads((RESULTS.parent / "configs" / f"{task}.json").read_text())
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / f"{task}.json"
        config.write_text(json.dumps(changed(experiment, changes)))
        subprocess.run(["swarmctl", "evaluate", "--local", "--workers", "1", "--config", config, "--genotype", champion,
                        "--changed-conditions", "--trials", str(TRIALS), "--to", f"{folder}/to"],
                       check=True, stdout=subprocess.DEVNULL)
        summary = json.loads((Path(folder) / "to" / "summary.json").read_text())
    return summary["conditions"][0]["fitness"]


def cell(rows):
    """The median champion with its interval, then the least and the greatest."""
    rows = sorted(rows, key=lambda row: float(row["fitness"]))
    mean, low, high = (float(rows[(len(rows) - 1) // 2][key]) for key in ("fitness", "low", "high"))
    return f"{mean:.3f} ({low:.3f} to {high:.3f}); {float(rows[0]['fitness']):.3f} to {float(rows[-1]['fitness']):.3f}"


def table():
    rows = read_csv(TABLE)
    return markdown(["", *CONDITIONS], (
        [experiment, *(cell([row for row in rows if (row["task"], row["condition"]) == (task, condition)])
                       for condition in CONDITIONS)]
        for experiment, task, _ in TASKS))


if __name__ == "__main__":
    command = sys.argv.pop(1) if len(sys.argv) > 1 else ""
    if command == "transfer":
        transfer()
    elif command == "report":
        print_or_update(PAGE, "the thesis with bodies", table())
    else:
        sys.exit(__doc__)
