"""Prints the first table of `fronts.rs` for NSGA-II of the package `pymoo`: `python pymoo_fronts.py`.

`pip install pymoo==0.6.2 numpy`
"""

from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.indicators.hv import HV
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize
from pymoo.problems import get_problem

INDIVIDUALS, BUDGETS = 100, [10_000, 25_000]


def run(name, budget, seed):
    """The hypervolume of the front, with the parameters of the paper, as in `fronts.rs`."""
    algorithm = NSGA2(pop_size=INDIVIDUALS, crossover=SBX(eta=20, prob=0.9), mutation=PM(eta=20))
    found = minimize(get_problem(name), algorithm, ("n_gen", budget // INDIVIDUALS), seed=seed + 1)
    return HV(ref_point=[1.1, 1.1])(found.F)


def summary(values):
    values = sorted(values)
    return f"{values[len(values) // 2]:.3f} ({values[0]:.3f} to {values[-1]:.3f})"


for name in ["zdt1", "zdt2", "zdt3"]:
    columns = [summary([run(name, budget, seed) for seed in range(5)]) for budget in BUDGETS]
    print(f"| {name.upper()}: pymoo | {' | '.join(columns)} |", flush=True)
