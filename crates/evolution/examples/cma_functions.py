"""Prints the table of `functions.rs` for the package `cma`: `python cma_functions.py [INDIVIDUALS] [EVALUATIONS] [GENES]`.

`pip install cma==4.5.0 numpy`
"""

import sys

import cma
import numpy as np

INDIVIDUALS, EVALUATIONS, D = [*map(int, sys.argv[1:]), *[20, 20_000, 20][len(sys.argv) - 1 :]]
WEIGHTS = 1e6 ** (np.arange(D) / (D - 1))


def sphere(x):
    return np.sum((x - 1.5) ** 2)


FUNCTIONS = {
    "sphere": sphere,
    "ellipsoid": lambda x: np.sum(WEIGHTS * (x - 1.5) ** 2),
    "Rosenbrock": lambda x: np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2),
    "Rastrigin": lambda x: np.sum((x - 1.5) ** 2 - 10 * np.cos(2 * np.pi * (x - 1.5)) + 10),
    "noisy sphere": sphere,
}
RESTARTS = {"": {}, "ipop": {"restarts": 9}, "bipop": {"restarts": 9, "bipop": True}}


def run(name, restarts, seed):
    """Distances from the minimum of the best individual and of the last mean."""
    options = {
        "bounds": [-5, 5], "popsize": INDIVIDUALS, "maxfevals": EVALUATIONS, "seed": seed + 1, "verbose": -9,
        "ftarget": -np.inf if name == "noisy sphere" else 1e-14,
    }
    noise, function = np.random.default_rng(seed), FUNCTIONS[name]
    best = [np.inf, np.inf]

    def value(x):
        true = function(np.asarray(x))
        told = true + noise.standard_normal() if name == "noisy sphere" else true
        best[:] = min(best, [told, true])
        return told

    # The first run starts in the middle, as here; restarts anywhere.
    starts = iter([np.zeros(D)])
    uniform = np.random.default_rng(seed + 100)
    es = cma.fmin2(value, lambda: next(starts, uniform.uniform(-5, 5, D)), 2.0, options, **RESTARTS[restarts])[1]
    return best[1], function(np.asarray(es.result.xfavorite))


def summary(values):
    values = sorted(values)
    return f"{values[len(values) // 2]:.1e} ({values[0]:.1e} to {values[-1]:.1e})"


for name in FUNCTIONS:
    for restarts in RESTARTS:
        runs = [run(name, restarts, seed) for seed in range(5)]
        champion, mean = map(summary, zip(*runs))
        print(f"| {name}: cma {restarts} | {champion} | {mean} |", flush=True)
