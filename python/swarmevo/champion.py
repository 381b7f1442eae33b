"""Champions, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Selection(NamedTuple):
    """Fitness on the trials by which a champion was compared with other candidates: optimistic."""

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


@dataclass(frozen=True, eq=False, repr=False)
class Champion:
    """A genotype worth keeping, and what is known of it."""

    genotype: Floats
    """``[d]``"""
    generation: int
    """Generation after which it was found."""
    individual: int | None
    """Its index there; none if it is the mean of the distribution."""
    trial_fitness: Floats
    """``[T]``: by which it became a candidate; empty for a mean."""
    selection: Selection | None
    """Mean on the trials by which it was compared with other candidates, which is
    optimistic, and their number; none before the first comparison."""
    judged: Judged | None
    """What it is worth, on trials that selected nothing: mean, the 95 % interval's lower and
    upper end, number of trials; none before the end of a run, and if a trial's fitness is not finite."""

    @classmethod
    def _of(cls, found: Mapping[str, Any]) -> Champion:
        """What the extension knows of it."""
        selection, judged = found["selection"], found["judged"]
        return cls(
            **{
                **found,
                "selection": None if selection is None else Selection(*selection),
                "judged": None if judged is None else Judged(*judged),
            }
        )

    @property
    def fitness(self) -> float:
        """The best that is known: judged, else by selection, else in its generation."""
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
