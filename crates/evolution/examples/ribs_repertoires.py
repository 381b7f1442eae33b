"""Prints the table of `repertoires.rs` for the package `ribs`: `python ribs_repertoires.py [INDIVIDUALS] [EVALUATIONS] [GENES]`.

`pip install ribs==0.12.0`
"""

import sys
import warnings

import numpy as np
from ribs.archives import DNSArchive, GridArchive, ProximityArchive
from ribs.emitters import EvolutionStrategyEmitter, IsoLineEmitter
from ribs.schedulers import Scheduler

warnings.simplefilter("ignore")
INDIVIDUALS, EVALUATIONS, D = [*map(int, sys.argv[1:]), *[100, 100_000, 20][len(sys.argv) - 1 :]]
CELLS = 64
GRID = {"solution_dim": D, "dims": [CELLS] * 2, "ranges": [(0, 1)] * 2}
SEVERAL = 5


def projected(genes, f):
    optimum = 0.4 * 5.12
    sums = f(10.24 * genes - 5.12 - optimum).sum(axis=1)
    worst = D * f(np.float64(-5.12 - optimum))
    halves = np.stack([genes[:, : D // 2].mean(axis=1), genes[:, D // 2 :].mean(axis=1)], axis=1)
    return 100 * (1 - sums / worst), halves


def arm(genes):
    angles = np.cumsum(2 * np.pi * genes - np.pi, axis=1)
    end = np.stack([np.cos(angles).mean(axis=1), np.sin(angles).mean(axis=1)], axis=1)
    return 100 * (1 - 4 * genes.var(axis=1)), 0.5 + end / 2


FUNCTIONS = {
    "sphere, linear projection": lambda genes: projected(genes, np.square),
    "Rastrigin, linear projection": lambda genes: projected(genes, lambda x: x**2 + 10 - 10 * np.cos(2 * np.pi * x)),
    "arm": arm,
}


def lines(archive, seed):
    initial = np.random.default_rng(seed).uniform(0, 1, (INDIVIDUALS, D))
    return [
        IsoLineEmitter(
            archive, iso_sigma=0.01, line_sigma=0.2, initial_solutions=initial, bounds=[(0, 1)] * D,
            batch_size=INDIVIDUALS, seed=seed,
        )
    ]


def strategies(es):
    def emitters(archive, seed):
        return [
            EvolutionStrategyEmitter(
                archive, x0=[0.5] * D, sigma0=0.2, ranker="imp", es=es, selection_rule="mu", restart_rule="basic",
                bounds=[(0, 1)] * D, batch_size=INDIVIDUALS // SEVERAL, seed=[seed, nth],
            )
            for nth in range(SEVERAL)
        ]

    return emitters


def annealed(seed):
    return GridArchive(**GRID, learning_rate=0.01, threshold_min=0.0, seed=seed)


def proximity(seed):
    return ProximityArchive(solution_dim=D, measure_dim=2, k_neighbors=15, novelty_threshold=0.02, seed=seed)


VARIANTS = {
    "MAP-Elites": (lambda seed: GridArchive(**GRID, seed=seed), lines),
    "novelty, threshold 0.02": (proximity, lines),
    "CMA-MAE": (annealed, strategies("cma_es")),
    "sep-CMA-MAE": (annealed, strategies("sep_cma_es")),
    "DNS": (lambda seed: DNSArchive(solution_dim=D, measure_dim=2, capacity=CELLS**2, k_neighbors=3, seed=seed), lines),
}


def run(function, archive, emitters, seed):
    """Mean fitness of all cells, and the share that is not empty, of the best individual ever of every cell."""
    kept = archive(seed)
    grid = GridArchive(**GRID, qd_score_offset=0.0)
    scheduler = Scheduler(kept, emitters(kept, seed))
    for _ in range(EVALUATIONS // INDIVIDUALS):
        genes = scheduler.ask()
        fitness, descriptors = function(genes)
        grid.add(genes, fitness, descriptors)
        scheduler.tell(fitness, descriptors)
    if not isinstance(kept, GridArchive):
        # What the archive still has, and no more.
        grid = GridArchive(**GRID, qd_score_offset=0.0)
        grid.add(*kept.data(("solution", "objective", "measures"), return_type="tuple"))
    return grid.stats.norm_qd_score, 100 * grid.stats.coverage


def summary(values):
    values = sorted(values)
    return f"{values[len(values) // 2]:.1f} ({values[0]:.1f} to {values[-1]:.1f})"


# DNS last: this archive compares all with all in Python.
for variant, parts in VARIANTS.items():
    for name, function in FUNCTIONS.items():
        score, coverage = map(summary, zip(*(run(function, *parts, seed) for seed in range(5))))
        print(f"| {name}: {variant} by ribs | {score} | {coverage} |", flush=True)
