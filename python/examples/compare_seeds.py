"""Which of two algorithms is better on the quickstart? Several seeds of each, and a figure.

    python python/examples/compare_seeds.py --seeds 5 --generations 60
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np

import swarmevo

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


def main() -> None:
    parser = argparse.ArgumentParser(description="Compares SNES with a GA.")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--generations", type=int, default=60)
    parser.add_argument("--to", type=Path, default=Path("comparison.png"))
    args = parser.parse_args()

    figure, ax = pyplot.subplots()
    for algorithm in ("SNES", "GA"):
        config = swarmevo.Experiment.quickstart().to_dict()
        config["algorithm"]["name"] = algorithm
        for population in config["algorithm"]["populations"].values():
            population["params"] = {}
        runs = [
            swarmevo.evolve(
                swarmevo.Experiment.from_dict(config, seed=seed), args.generations, progress=False
            )
            for seed in range(args.seeds)
        ]
        means = np.array([[it.mean for it in run.generations] for run in runs])
        judged = np.array([run.champion.fitness for run in runs])
        print(f"{algorithm:5} champions {np.median(judged):.3f} ({judged.min():.3f} to {judged.max():.3f})")
        ax.plot(np.median(means, axis=0), label=f"{algorithm}, median of {args.seeds} runs")
        ax.fill_between(range(args.generations), means.min(axis=0), means.max(axis=0), alpha=0.2)
    ax.set_xlabel("generation")
    ax.set_ylabel("mean fitness of the generation")
    ax.legend()
    figure.savefig(args.to)
    print(f"{args.to}")


if __name__ == "__main__":
    main()
