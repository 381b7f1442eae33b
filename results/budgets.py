#!/usr/bin/env python3
"""Evolves A to D with the same number of episodes, spent on trials by different rules.

    results/budgets.py run [EXPERIMENT...] [--rules R...] [--seeds S...] [--program PATH]
    results/budgets.py report [--update]

EXPERIMENT is a name in the table below. `run` appends the judged champion of every run to
results/budgets.csv, and leaves existing rows alone, so you may interrupt it. It needs cargo, or
the compiled program sim-core/examples/budgets.rs, which has the rules. `report` prints the table,
or writes it into docs/notebook/2026-11-algorithms.md. Needs Python 3.9 and nothing else.
"""

import argparse
import csv
import subprocess

from report import RESULTS, markdown, print_or_update, read_csv, spread

PAGE = RESULTS.parent / "docs" / "notebook" / "2026-11-algorithms.md"
TABLE = RESULTS / "budgets.csv"
COLUMNS = ["experiment", "rule", "seed", "champion", "low", "high"]
SEEDS = [0, 1, 2, 3, 4]
NAMES = {
    "A": "leader_selection_snes",
    "B": "borderline_snes",
    "C": "orientation_consensus_snes",
    "D": "light_follower_snes",
}
# For each rule: its name in the program, and the episodes of a run.
RULES = {
    "5 trials": ("five", 12_500),
    "1 trial": ("one", 12_500),
    "1 trial, two thirds of the episodes": ("one", 8_300),
    "1, then 2, then 5 trials": ("growing", 12_500),
    "1 trial, the better half 4 more": ("race", 12_500),
    "UH-CMA-ES's": ("uncertainty", 12_500),
}
PROGRAM = ["cargo", "run", "--quiet", "--release", "-p", "sim-core", "--example", "budgets", "--"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="evolve missing runs")
    run.add_argument("experiments", nargs="*", default=list(NAMES), metavar="EXPERIMENT")
    run.add_argument("--rules", nargs="+", default=list(RULES), choices=list(RULES))
    run.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    run.add_argument("--program", help="the compiled example")
    commands.add_parser("report", help="print existing runs").add_argument("--update", action="store_true")
    args = parser.parse_args()
    if args.command == "report":
        print_or_update(PAGE, "budgets", report())
        return
    for seed in args.seeds:
        for name in args.experiments:
            for rule in args.rules:
                if (name, rule, seed) not in read():
                    append(evolve(name, rule, seed, [args.program] if args.program else PROGRAM))


def evolve(name, rule, seed, program):
    """The judged champion of one run."""
    file = RESULTS.parent / "configs" / f"{NAMES[name]}.json"
    command = [*program, file, RULES[rule][0], seed, RULES[rule][1]]
    done = subprocess.run(list(map(str, command)), check=True, stdout=subprocess.PIPE, text=True)
    champion, low, high = map(float, done.stdout.split(","))
    print(f"{name}, {rule}, seed {seed}: {champion:.3f}", flush=True)
    return {"experiment": name, "rule": rule, "seed": seed, "champion": champion, "low": low, "high": high}


def read():
    """The judged champions, by experiment, rule and seed."""
    if not TABLE.exists():
        return {}
    return {(row["experiment"], row["rule"], int(row["seed"])): float(row["champion"]) for row in read_csv(TABLE)}


def append(row):
    is_new = not TABLE.exists()
    with TABLE.open("a", newline="") as stream:
        rows = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        if is_new:
            rows.writeheader()
        rows.writerow(row)


def report():
    known = read()
    rows = []
    for name in NAMES:
        for rule in RULES:
            champions = [known[name, rule, seed] for seed in SEEDS if (name, rule, seed) in known]
            if champions:
                wins = sum(champion > known.get((name, "5 trials", seed), float("inf"))
                           for seed in SEEDS if (champion := known.get((name, rule, seed))) is not None)
                rows.append([name, rule, len(champions), spread(champions), "" if rule == "5 trials" else f"{wins} of {len(champions)}"])
    return markdown(["", "rule", "seeds", "champion: median, least and greatest", "seeds better than 5 trials"], rows)


if __name__ == "__main__":
    main()
