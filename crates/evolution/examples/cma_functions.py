"""Prints the table of `functions.rs` for the package `cma`: `python cma_functions.py [INDIVIDUALS] [EVALUATIONS]`.

`pip install cma==4.5.0 numpy`
"""

import sys

import cma
import numpy as np

D = 20
INDIVIDUALS = int(sys.argv[1]) if len(sys.argv) > 1 else 20
EVALUATIONS = int(sys.argv[2]) if len(sys.argv) > 2 else 20_000
WEIGHTS = 1e6 ** (np.arange(D) / (D - 1))

FUNCTIONS = {
    "sphere": lambda x: np.sum((x - 1.5) ** 2),
    "ellipsoid": lambda x: np.sum(WEIGHTS * (x - 1.5) ** 2),
    "Rosenbrock": lambda x: np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2),
    "Rastrigin": lambda x: np.sum((x - 1.5) ** 2 - 10 * np.cos(2 * np.pi * (x - 1.5)) + 10),
}


def run(function, seed):
    options = {
        "bounds": [-5, 5], "popsize": INDIVIDUALS, "maxfevals": EVALUATIONS, "seed": seed + 1, "verbose": -9,
        "ftarget": 1e-14,
    }
    return cma.CMAEvolutionStrategy(np.zeros(D), 2.0, options).optimize(function).result.fbest


for name, function in FUNCTIONS.items():
    found = sorted(run(lambda x, of=function: of(np.asarray(x)), seed) for seed in range(5))
    print(f"| {name} | {found[2]:.1e} ({found[0]:.1e} to {found[-1]:.1e}) |")
