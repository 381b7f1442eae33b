#!/usr/bin/env python3
"""Evaluates champions in pseudo-realities, and evolves for them.

    results/realities.py evaluate             champions of the thesis's tasks and of those with bodies, all seeds that
                                              results/fetch has brought: writes realities.csv and realities-ranks.csv
    results/realities.py evolve               quickstart with ranges and without: writes realities-evolved.csv
    results/realities.py report [--update]    prints the tables of docs/robots.md, or writes them into that page

All champions of a task meet the same 30 realities in the same 50 trials. `evaluate` and `evolve` need swarmctl in
the PATH; they take about 20 and 5 minutes of one core. Needs Python 3.9.
"""

import csv
import json
import statistics
import sys
import tempfile
from pathlib import Path

from hypotheses import changed
from report import RESULTS, chance, evaluated, interval, markdown, print_or_update, read_csv, swarmctl

PAGE = RESULTS.parent / "docs" / "robots.md"
TABLE = RESULTS / "realities.csv"
RANKS = RESULTS / "realities-ranks.csv"
EVOLVED = RESULTS / "realities-evolved.csv"
CONFIGS = RESULTS.parent / "configs"
REALITIES, TRIALS = 30, 50
# The name of a file, and what the page calls it.
TASKS = {
    "leader_selection_snes": "A, leader selection",
    "borderline_snes": "B, borderline",
    "orientation_consensus_snes": "C, orientation consensus",
    "light_follower_snes": "D, light follower",
    **{f"tasks/{name}": name for name in ("transport", "slalom", "gather", "harvest", "maze")},
}
# What robots of quickstart meet, the generations of each run, and the seeds of both samples.
RANGES = {"actuation_delay": [0, 2], "radio_range": [0.7, 1.2], "radio_loss": [0, 0.6], "antenna_heading": [0, 0.2]}
GENERATIONS = 300
SEEDS = range(5)


def assess(config, champion, to):
    """What realities cost a champion."""
    options = ["--pseudo-realities", REALITIES, "--every", 1000]
    return evaluated(config, champion, TRIALS, to, *options)["pseudo_realities"]


def rows_of(found):
    """A row for all realities, and one per cause."""
    yield ["", *digits(found["nominal"], found["mean"], found["worst_tenth"]["mean"], found["drop"]["value"],
                       *found["drop"]["ci95"])]
    for cause in found["causes"]:
        drop = cause["drop"]
        yield [cause["key"], *digits(found["nominal"], found["nominal"] - drop["value"]), "",
               *digits(drop["value"], *drop["ci95"])]


def digits(*values):
    return [f"{value:.6f}" for value in values]


COLUMNS = ["key", "nominal", "mean", "worst_tenth", "drop", "low", "high"]


def evaluate():
    with TABLE.open("w", newline="") as table, RANKS.open("w", newline="") as ranks:
        table, ranks = (csv.writer(file, lineterminator="\n") for file in (table, ranks))
        table.writerow(["task", "seed", *COLUMNS])
        ranks.writerow(["task", "champions", "tau", "p"])
        for task in TASKS:
            name = Path(task).name
            with tempfile.TemporaryDirectory() as folder:
                directories = []
                for champion in sorted((RESULTS / "champions").glob(f"{name}-[0-9]*.json")):
                    seed = champion.stem.rsplit("-", 1)[1]
                    directories.append(f"{folder}/{seed}")
                    found = assess(CONFIGS / f"{task}.json", champion, directories[-1])
                    table.writerows([name, seed, *row] for row in rows_of(found))
                kendall = json.loads(swarmctl("compare", *directories, "--output", "json"))["kendall"]
                ranks.writerow([name, len(directories), *(digits(kendall["tau"], kendall["p"]) if kendall else ["", ""])])
            print(task, file=sys.stderr)


def evolve():
    """Champions with ranges in the file and without, all in the same realities."""
    experiment = json.loads((CONFIGS / "quickstart.json").read_text())
    robots = f"world.objects.{experiment['algorithm']['evolvable_object']}."
    reality = {robots + "perturbations": {"pseudo_reality": RANGES}}
    experiment["algorithm"]["generations"] = GENERATIONS
    with EVOLVED.open("w", newline="") as file, tempfile.TemporaryDirectory() as folder:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["evolved", "seed", *COLUMNS])
        judge = Path(folder) / "judge.json"
        judge.write_text(json.dumps(changed(experiment, reality)))
        for evolved, changes in (("nominally", {}), ("with ranges", reality)):
            config = Path(folder) / "quickstart.json"
            config.write_text(json.dumps(changed(experiment, changes)))
            for seed in SEEDS:
                data = Path(folder) / f"{evolved}-{seed}"
                swarmctl("run", config, "--seed", seed, "--workers", 1, "--data-dir", data)
                [champion] = data.glob("*.champion.json")
                found = assess(judge, champion, data / "realities")
                table.writerows([evolved, seed, *row] for row in rows_of(found))
                print(evolved, seed, file=sys.stderr)


def number(row, key):
    return float(row[key])


def drop(row):
    return interval(*(number(row, key) for key in ("drop", "low", "high")))


def of_champions():
    """A row per task: the champion of seed 0, and the drops of all seeds as shares of the nominal fitness."""
    rows = read_csv(TABLE)
    ranks = {row["task"]: row for row in read_csv(RANKS)}
    head = ["champion", "nominal", "realities", "worst tenth", "drop", "what breaks it", "share lost, all seeds", "tau"]
    lines = []
    for task, title in TASKS.items():
        name = Path(task).name
        of_task = [row for row in rows if row["task"] == name]
        whole, *causes = [row for row in of_task if row["seed"] == "0"]
        # Only what certainly costs fitness.
        causes = [f"`{row['key']}` {drop(row)}" for row in causes if number(row, "low") > 0]
        shares = sorted(number(row, "drop") / number(row, "nominal") for row in of_task if row["key"] == "")
        rank = ranks[name]
        tau = f"{float(rank['tau']):.2f} (p = {float(rank['p']):.2f}; {rank['champions']})" if rank["tau"] else ""
        lines.append([title, *(f"{number(whole, key):.3f}" for key in ("nominal", "mean", "worst_tenth")), drop(whole),
                      "; ".join(causes) or "no key for certain", f"{shares[0]:.0%} to {shares[-1]:.0%}", tau])
    return markdown(head, lines)


def of_evolved():
    """A row per champion of quickstart, and how the two samples differ."""
    head, lines = ["evolved", "seed", "nominal", "realities", "worst tenth", "drop"], []
    rows = [row for row in read_csv(EVOLVED) if row["key"] == ""]
    keys = ("nominal", "mean", "worst_tenth")
    for row in rows:
        lines.append([row["evolved"], row["seed"], *(f"{number(row, key):.3f}" for key in keys), drop(row)])
    samples = [[row for row in rows if row["evolved"] == evolved] for evolved in ("nominally", "with ranges")]
    for sample in samples:
        middle = (f"{statistics.median(number(row, key) for row in sample):.3f}" for key in (*keys, "drop"))
        lines.append([sample[0]["evolved"], "median", *middle])
    p = (chance(*([number(row, key) for row in sample] for sample in samples)) for key in (*keys, "drop"))
    lines.append(["", "p of the difference", *(f"{value:.3f}" for value in p)])
    return markdown(head, lines)


if __name__ == "__main__":
    command = sys.argv.pop(1) if len(sys.argv) > 1 else ""
    if command == "evaluate":
        evaluate()
    elif command == "evolve":
        evolve()
    elif command == "report":
        print_or_update(PAGE, "champions in pseudo-realities", of_champions())
        print_or_update(PAGE, "evolved for pseudo-realities", of_evolved())
    else:
        sys.exit(__doc__)
