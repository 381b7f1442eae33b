#!/usr/bin/env python3
"""Prints the table of docs/gallery.md: how well champions and hand-written controllers solve each task.

    results/gallery.py              from results/by-hand.csv, which by-hand.py --record writes
    results/gallery.py --update     writes it into that page

A task is solved by a seed if its champion is in a solved state, which the task's script defines, in 80 % of
the last third of the episodes, on average over all trials. Needs Python 3.9 and nothing else.
"""

import statistics

from report import RESULTS, interval, markdown, middle, print_or_update, read_csv

PAGE = RESULTS.parent / "docs" / "gallery.md"
ORDER = [
    "aggregation", "chain", "flocking", "synchronisation", "division_of_labour", "foraging", "dispersion", "predator",
    "transport", "slalom", "gather", "harvest", "maze", "cluster",
]
ENOUGH = 0.8
KEYS = ("solved", "fitness")
HEAD = ["task", "seeds that solve it", "share solved", "fitness", "minutes", "share solved by hand", "fitness by hand"]


def estimate(row, key):
    return [float(row[column]) for column in (key, f"{key}_low", f"{key}_high")]


def minutes(task, seed):
    history = read_csv(RESULTS / "histories" / f"{task}-{seed}.csv")
    return sum(int(row["duration_ms"]) for row in history) / 60_000


def line(task, rows):
    hand = next(row for row in rows if row["controller"] == "by hand")
    evolved = [row for row in rows if row is not hand]
    solving = [row for row in evolved if float(row["solved"]) >= ENOUGH]
    times = [minutes(task, row["controller"].split()[1]) for row in evolved]
    return [task, f"{len(solving)} of {len(evolved)}", *(middle([estimate(row, key) for row in evolved]) for key in KEYS),
            f"{statistics.median(times):.1f}", *(interval(*estimate(hand, key)) for key in KEYS)]


def table():
    rows = read_csv(RESULTS / "by-hand.csv")
    return markdown(HEAD, (line(task, [row for row in rows if row["task"] == task]) for task in ORDER))


if __name__ == "__main__":
    print_or_update(PAGE, "gallery", table())
