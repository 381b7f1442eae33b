#!/usr/bin/env python3
"""Compares champions of configs/tasks with controllers written by hand, on the same trials.

    results/by-hand.py [--trials N] [--record] [TASK...]
    results/by-hand.py [--trials N] --tune NAME=VALUE,VALUE... TASK

For every TASK, by default those of configs/tasks/by_hand with champions, evaluates results/champions/TASK-*.json, and the
controller of configs/tasks/by_hand/TASK.star, on trials that no evolution uses. Prints means with
their 95 % intervals: the fitness, and the share of the last third of an episode in which the task is solved,
as its script defines it. For the tasks in FITNESS, the second number is the share of trials that reach this fitness.

`--record` also writes the means into results/by-hand.csv, from which results/gallery.py makes a table.
`--tune` tries every combination of values of the constants of a hand-written controller, on other trials,
and prints the best ones. Needs swarmctl in the PATH, Python 3.9 and nothing else.
"""

import argparse
import csv
import itertools
import json
import math
import re
import sys
import tempfile
from pathlib import Path

from report import RESULTS, evaluated, interval, read_csv

TASKS = RESULTS.parent / "configs" / "tasks"
TABLE = RESULTS / "by-hand.csv"
COLUMNS = ["task", "controller", "trials", "fitness", "fitness_low", "fitness_high", "solved", "solved_low", "solved_high"]
BY_HAND = "by hand"
# Tasks whose scripts have no measure `solved`, and the fitness with which an episode counts as solved.
FITNESS = {"dispersion": 0.75}


def evaluation(task, config, champion, trials, options=()):
    """Fitness and share of solved steps or trials, each a mean with its interval."""
    with tempfile.TemporaryDirectory() as folder:
        condition = evaluated(config, champion, trials, folder, "--force", *options)["conditions"][0]
        fitness = [float(row["time_mean"]) for row in read_csv(Path(folder) / "trials.csv") if row["metric"] == "fitness"]
    means = [condition["fitness"]["mean"], *condition["fitness"]["ci95"]]
    if task in FITNESS:
        share = sum(value >= FITNESS[task] for value in fitness) / trials
        error = 1.96 * math.sqrt(share * (1 - share) / trials)
        return [*means, share, share - error, share + error]
    solved = condition["metrics"]["solved"]["time_mean"]
    return [*means, solved["mean"], *solved["ci95"]]


def by_hand(task, folder, constants=()):
    """The experiment file of a task whose robots are controlled by the hand-written script."""
    config = json.loads((TASKS / f"{task}.json").read_text())
    text = (TASKS / "by_hand" / f"{task}.star").read_text()
    for name, value in constants:
        text, found = re.subn(rf"^{name} = .*$", f"{name} = {value}", text, flags=re.MULTILINE)
        if found != 1:
            sys.exit(f"by_hand/{task}.star has no constant {name}")
    text = (TASKS / f"{task}.star").read_text() + "\n" + text
    config["task"]["script"] = {"name": f"{task}_by_hand.star", "text": text}
    evolvable = config["algorithm"]["evolvable_object"]
    config["world"]["objects"][evolvable]["controller"] = "script_controller"
    path = Path(folder) / f"{task}.json"
    path.write_text(json.dumps(config))
    return path


def champions(task):
    return sorted((RESULTS / "champions").glob(f"{task}-[0-9]*.json"))


def compared(task, trials):
    """A row for each champion of a task, and one for the controller written by hand."""
    for champion in champions(task):
        yield f"seed {champion.stem.rsplit('-', 1)[1]}", evaluation(task, TASKS / f"{task}.json", champion, trials)
    with tempfile.TemporaryDirectory() as folder:
        yield BY_HAND, evaluation(task, by_hand(task, folder), champions(task)[0], trials)


def record(task, rows, trials):
    """Replaces the rows of a task in the file."""
    kept = []
    if TABLE.exists():
        with TABLE.open(newline="") as file:
            kept = [row for row in csv.reader(file)][1:]
    kept = [row for row in kept if row[0] != task]
    kept += [[task, controller, trials, *(f"{value:.6f}" for value in values)] for controller, values in rows]
    with TABLE.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *sorted(kept, key=lambda row: row[0])])


def tune(task, trials, grid):
    """Prints the combinations of constants with the best fitness, on trials of another seed."""
    names, values = zip(*(constant.split("=") for constant in grid))
    tried = []
    for combination in itertools.product(*(of.split(",") for of in values)):
        constants = list(zip(names, combination))
        with tempfile.TemporaryDirectory() as folder:
            config = by_hand(task, folder, constants)
            tried.append((evaluation(task, config, champions(task)[0], trials, ["--base", "seed=1000"]), constants))
    print("| fitness | solved | constants |\n|---|---|---|")
    for values, constants in sorted(tried, reverse=True)[:5]:
        print(f"| {interval(*values[:3], 2)} | {interval(*values[3:], 2)} | {', '.join(map(' = '.join, constants))} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--record", action="store_true", help="write into results/by-hand.csv")
    parser.add_argument("--tune", action="append", metavar="NAME=VALUE,VALUE", help="values of a constant")
    parser.add_argument("tasks", nargs="*", metavar="TASK")
    args = parser.parse_args()
    written = sorted(path.stem for path in (TASKS / "by_hand").glob("*.star"))
    tasks = args.tasks or [task for task in written if champions(task)]
    if args.tune:
        return tune(tasks[0], args.trials, args.tune)
    print("| task | controller | fitness | solved |\n|---|---|---|---|")
    for task in tasks:
        rows = []
        for controller, values in compared(task, args.trials):
            rows.append((controller, values))
            print(f"| {task} | {controller} | {interval(*values[:3], 2)} | {interval(*values[3:], 2)} |", flush=True)
        if args.record:
            record(task, rows, args.trials)


if __name__ == "__main__":
    main()
