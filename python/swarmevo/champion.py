"""Champions, their fitness and their origin."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Selection(NamedTuple):
    """Fitness on the trials that selected a champion among the candidates: optimistic."""

    mean: float
    n_trials: int


class Judged(NamedTuple):
    """Fitness on trials that selected nothing."""

    mean: float
    low: float
    """Lower end of the mean's 95 % confidence interval."""
    high: float
    """Upper end of it."""
    n_trials: int


class Origin(NamedTuple):
    """The experiment in which a champion evolved."""

    config_digest: str
    """Digest of the experiment file with its seed, and of the simulation: see
    :attr:`Experiment.config_digest`."""
    name: str
    """Name of the experiment; it influences nothing."""
    seed: int | None
    simulation: str | None
    """The simulation's ``FINGERPRINT``."""


@dataclass(frozen=True, eq=False, repr=False)
class Champion:
    """The best genotype of a run, its fitness and its origin."""

    genotype: Floats
    """``[d]``"""
    generation: int
    """Generation after which the champion was found."""
    individual: int | None
    """Index of the individual in that generation; none for the mean of the distribution."""
    trial_fitness: Floats
    """``[T]``: the fitness that made it a candidate; empty for a mean."""
    selection: Selection | None
    """Mean on the trials that selected it among the candidates, which is optimistic, and the number
    of these trials; none before the first comparison."""
    judged: Judged | None
    """Fitness on trials that selected nothing: mean, the 95 % interval's lower and upper end, number of
    trials; none before the end of a run, and if a trial's fitness is not finite."""

    origin: Origin | None = None
    """The experiment in which it evolved, if any. Functions that take a champion and an experiment, such as
    ``experiment.simulate(champion)``, compare the two: :meth:`Experiment.check`."""

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Champion:
        """Reads a champion file, as written by ``swarmctl run`` and printed by ``swarmctl champion --output
        json``."""
        path = Path(path)
        try:
            found = json.loads(path.read_text(encoding="utf-8-sig"))
            champion = _of_document(found)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"{path} is no champion file: {type(error).__name__}: {error}") from None
        if champion.genotype.ndim != 1 or not len(champion.genotype):
            raise ValueError(f"{path} is no champion file: its genotype is no list of numbers")
        return champion

    @classmethod
    def _of(cls, found: Mapping[str, Any], origin: Origin | None = None) -> Champion:
        """A champion from the extension's values."""
        selection, judged = found["selection"], found["judged"]
        return cls(
            **{
                **found,
                "selection": None if selection is None else Selection(*selection),
                "judged": None if judged is None else Judged(*judged),
                "origin": origin,
            }
        )

    def _from(self, origin: Origin | None) -> Champion:
        return replace(self, origin=origin)

    @property
    def fitness(self) -> float:
        """The best known fitness: judged, else of the selection, else in its generation."""
        if self.judged is not None:
            return self.judged.mean
        if self.selection is not None:
            return self.selection.mean
        return float(np.mean(self.trial_fitness))

    def __repr__(self) -> str:
        who = "mean" if self.individual is None else f"individual {self.individual}"
        known = "judged" if self.judged else "by selection, optimistic" if self.selection else "in its generation, optimistic"
        fitness = "" if self.judged is None and self.selection is None and not len(self.trial_fitness) else f", fitness {self.fitness:.6f} {known}"
        return f"<Champion: {who} of generation {self.generation}, {len(self.genotype)} genes{fitness}>"


Genes = Union[ArrayLike, Champion]
"""A genotype ``[d]``, or a champion, whose origin is compared with the experiment."""


def _of_document(found: Mapping[str, Any]) -> Champion:
    selection, judged = found.get("selection"), found.get("judged")
    digest = found.get("config_digest")
    return Champion(
        genotype=np.array(found["genotype"], dtype=np.float64),
        generation=int(found["generation"]),
        individual=None if found.get("individual") is None else int(found["individual"]),
        trial_fitness=np.array(found.get("trial_fitness") or [], dtype=np.float64),
        selection=None if selection is None else Selection(float(selection["mean"]), int(selection["trials"])),
        judged=None if judged is None else Judged(
            float(judged["mean"]), float(judged["ci95"][0]), float(judged["ci95"][1]), int(judged["trials"])
        ),
        origin=None if digest is None else Origin(
            str(digest), str(found.get("name", "")), None if found.get("seed") is None else int(found["seed"]), found.get("simulation")
        ),
    )
