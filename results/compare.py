#!/usr/bin/env python3
"""Prints a table of GA and SNES on every task, with the numbers of `swarmctl compare`.

    results/compare.py

Each value is the median over the runs in results/, in brackets the least and the greatest. To have
all seeds, run results/fetch before. Needs swarmctl in the PATH, Python 3.9 and nothing else.
"""

import json

from report import RESULTS, spread, swarmctl, table

TASKS = {
    "A": "leader_selection",
    "B": "borderline",
    "C": "orientation_consensus",
    "C, SpikeSwarmSim's function": "orientation_consensus_alignment",
    "D": "light_follower",
}
QUANTITIES = {"judged": "champion", "mean": "mean, last 50", "best": "best, last 50"}


def compared(task):
    """The output of `swarmctl compare` for a task; an empty list without runs by both algorithms."""
    files = [sorted((RESULTS / folder).glob(f"{task}_{algorithm}-*"))
             for algorithm in ("ga", "snes") for folder in ("histories", "champions")]
    if not all(files):
        return []
    found = json.loads(swarmctl("compare", "--output", "json", *sum(files, [])))
    return [it for it in found["quantities"] if it["name"] in QUANTITIES]


def main():
    rows = []
    for task, name in TASKS.items():
        for quantity in compared(name):
            ga, snes = quantity["samples"]
            pair = quantity["pairs"][0]
            rows.append([task, f"{len(ga['values'])}, {len(snes['values'])}", QUANTITIES[quantity["name"]], spread(ga["values"]), spread(snes["values"]),
                         f"{pair['probability_of_improvement']['value']:.2f}", f"{pair['p']:.2f}"])
    table(["task", "runs", "of fitness", "GA", "SNES", "GA's is better", "p"], rows)


if __name__ == "__main__":
    main()
