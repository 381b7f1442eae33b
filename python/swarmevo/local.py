"""Whole runs, here: what a coordinator does, to the same bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import arguments
from .champion import Champion
from .evolution import Evaluate, Evolution, Generation, compute
from .experiment import Experiment
from .plotting import plot_history
from .progress import shown
from .trials import TrialSet

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class LocalRun:
    """A run that has ended."""

    experiment: Experiment
    generations: list[Generation]
    """All of them, in order."""
    champion: Champion
    """Judged on trials that selected nothing."""
    digest: str
    """Covers every bit of the run: the one that ``swarmctl run`` prints."""
    evolution: Evolution
    """After the last generation, to go on from."""

    def history(self) -> pandas.DataFrame:
        """A row per generation."""
        import pandas

        rows = [vars(generation) for generation in self.generations]
        return pandas.DataFrame(rows).rename(columns={"index": "generation"})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Best and mean fitness of every generation."""
        indices = [generation.index for generation in self.generations]
        best = [generation.best for generation in self.generations]
        mean = [generation.mean for generation in self.generations]
        return plot_history(ax, self.experiment.name, indices, best, mean)

    def __repr__(self) -> str:
        return (
            f"<LocalRun of {self.experiment.name!r}: {len(self.generations)} generations, "
            f"champion {self.champion.fitness:.6f}>"
        )


def evolve(
    experiment: Experiment,
    generations: int | None = None,
    *,
    threads: int | None = None,
    progress: bool = True,
    evaluate: Evaluate | None = None,
) -> LocalRun:
    """Runs an experiment here, as ``swarmctl run`` does: the same generations, champion and
    digest.

    ``generations``: instead of the file's. ``threads``: as many as there are processors if
    absent. ``progress``: whether tqdm, if it is installed, shows how far it is.
    ``evaluate``: computes fitness instead of the experiment's own :meth:`~Experiment.evaluate`:
    ``f(genotypes, trial_set, n_trials)`` returns an array ``[P, T]`` of T = ``n_trials``, of any type of numbers
    (NumPy, JAX, PyTorch, lists, tuples), or ``[P]`` if trials do not matter, which counts as one trial. Anything
    else is a ValueError at once. A fitness that is not finite ranks last; a generation without a finite one is a
    ValueError. What ``evaluate`` raises ends the run, unchanged.
    """
    settings = experiment.to_dict()["algorithm"]
    n_generations: int = settings["generations"]
    if generations is not None:
        n_generations = arguments.whole(generations, "generations", 1)

    def here(
        genotypes: NDArray[np.float64], trial_set: TrialSet, n_trials: int
    ) -> NDArray[np.float64]:
        return experiment.evaluate(genotypes, trial_set, trials=n_trials, threads=threads)

    fitness_by: Evaluate = here if evaluate is None else evaluate
    evolution = experiment.evolution()
    done: list[Generation] = []
    for index in shown(range(n_generations), experiment.name, progress, n_generations):
        fitness = compute(fitness_by, evolution.ask(), TrialSet.of(index), experiment.n_trials)
        done.append(evolution.tell(fitness))
        if evolution.n_generations % settings["champion_every"] == 0:
            evolution.compare(fitness_by)
    judged = evolution._judge(fitness_by, settings["judgement_trials"])
    return LocalRun(experiment, done, judged.champion, judged.digest, evolution)
