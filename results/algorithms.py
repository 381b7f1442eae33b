#!/usr/bin/env python3
"""Evolves an experiment by every algorithm for a single optimum, each with its default parameters and the same budget.

    results/algorithms.py NAME [--generations G] [--seeds S...] [--algorithms A...] [--workers N]

NAME is a file of configs/. Writes history and champion of each run to
results/algorithms/NAME/ALGORITHM-SEED.csv and .json, for `swarmctl compare`; leaves
existing runs alone, so you may interrupt the command. Needs swarmctl in the PATH, Python 3.9 and
nothing else.
"""

import argparse
import csv
import json
import subprocess
import tempfile
from pathlib import Path

RESULTS = Path(__file__).resolve().parent
ALGORITHMS = ["GA", "SNES", "xNES", "CMA-ES", "sep-CMA-ES", "openaiES", "PGPE"]
COLUMNS = ["generation", "best", "mean", "min", "episodes"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name")
    parser.add_argument("--generations", type=int, default=150)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--algorithms", nargs="+", default=ALGORITHMS, choices=ALGORITHMS)
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    to = RESULTS / "algorithms" / args.name
    to.mkdir(parents=True, exist_ok=True)
    for seed in args.seeds:
        for algorithm in args.algorithms:
            if not (to / f"{algorithm}-{seed}.json").exists():
                evolve_by(args, algorithm, seed, to)


def evolve_by(args, algorithm, seed, to):
    """One run by an algorithm with its default parameters."""
    experiment = json.loads((RESULTS.parent / "configs" / f"{args.name}.json").read_text())
    experiment["algorithm"]["name"] = algorithm
    experiment["algorithm"]["generations"] = args.generations
    for population in experiment["algorithm"]["populations"].values():
        population["params"] = {"encoding": "real"}
    mean = evolve(experiment, seed, to / f"{algorithm}-{seed}", args.workers)
    print(f"{args.name} by {algorithm}, seed {seed}: {mean:.3f}", flush=True)


def evolve(experiment, seed, stem, workers):
    """One run, from experiment to STEM.csv and STEM.json. Returns the mean of the last generation."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        file = folder / "experiment.json"
        file.write_text(json.dumps(experiment))
        command = ["swarmctl", "run", file, "--output", "json", "--data-dir", folder / "data",
                   "--seed", str(seed), "--workers", str(workers)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        *generations, end = map(json.loads, done.stdout.splitlines())
        with Path(f"{stem}.csv").open("w", newline="") as stream:
            rows = csv.DictWriter(stream, COLUMNS, extrasaction="ignore")
            rows.writeheader()
            rows.writerows(generations)
        champion = json.loads(Path(end["champion_file"]).read_text())
        # The network follows from the genotype, and is five times as long.
        del champion["network"]
        champion["digest"] = generations[-1]["digest"]
        # This file comes last, because it marks the run as complete.
        Path(f"{stem}.json").write_text(json.dumps(champion) + "\n")
    return generations[-1]["mean"]


if __name__ == "__main__":
    main()
