"""The evolutionary algorithms, as ask and tell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .trials import TrialSet

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Generation:
    """The fitness of a generation in short, over the individuals whose fitness is finite."""

    index: int
    """From 0."""
    best: float
    mean: float
    min: float
    n_non_finite: int
    """Individuals whose fitness is not finite; they rank last."""
    digest: str
    """A link of a hash chain over all genotypes and fitness so far: equal digests, equal
    runs, bit for bit."""


@dataclass(frozen=True, eq=False)
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
    selection: tuple[float, int] | None
    """Mean on the trials by which it was compared with other candidates, which is
    optimistic, and their number; none before the first comparison."""
    judged: tuple[float, float, float, int] | None
    """What it is worth, on trials that selected nothing: mean, the 95 % interval's lower and
    upper end, number of trials; none before the end of a run."""

    @property
    def fitness(self) -> float:
        """The best that is known: judged, else by selection, else in its generation."""
        if self.judged is not None:
            return self.judged[0]
        if self.selection is not None:
            return self.selection[0]
        return float(np.mean(self.trial_fitness))


class Evolution:
    """A population of genotypes, evolved by one of the algorithms.

    Genes lie in [0, 1], larger fitness is better, and a fitness that is not finite ranks
    last. The code is the coordinator's, and so are the bits. Use the class of an algorithm,
    or :meth:`Experiment.evolution`.

    >>> evolution = SNES(10, population_size=20, seed=7)
    >>> for _ in range(200):
    ...     genotypes = evolution.ask()
    ...     _ = evolution.tell(-np.sum((genotypes - 0.3) ** 2, axis=1))
    >>> bool(np.allclose(evolution.champion.genotype, 0.3, atol=1e-3))
    True
    """

    algorithm: ClassVar[str]
    """Its name in experiment files."""

    def __init__(
        self, n_genes: int, *, population_size: int = 20, seed: int = 0, **params: float | str
    ) -> None:
        """``n_genes``: d, at least 1. ``params``: as in experiment files; ``docs/algorithms.md``
        and :func:`algorithms` list them."""
        if type(self) is Evolution:
            raise TypeError("use the class of an algorithm, such as SNES, or Experiment.evolution")
        self._core = _core.Evolution(self.algorithm, n_genes, population_size, seed, params)

    @classmethod
    def _of(cls, core: _core.Evolution) -> Evolution:
        self = cls.__new__(cls)
        self._core = core
        return self

    def ask(self) -> Floats:
        """The next generation's genotypes ``[P, d]``. Asking twice gives the same."""
        return self._core.ask()

    def tell(self, fitness: ArrayLike) -> Generation:
        """Learns from the fitness of the genotypes that :meth:`ask` gave: ``[P]``, or
        ``[P, T]`` for T trials of each, whose mean counts. Raises ValueError if none is
        finite."""
        values = np.ascontiguousarray(fitness, dtype=np.float64)
        if values.ndim == 1:
            values = values[:, np.newaxis]
        if values.ndim != 2:
            raise ValueError(f"fitness is an array [P] or [P, T], not {list(values.shape)}")
        index, best, mean, least, n_non_finite = self._core.tell(values)
        return Generation(index, best, mean, least, n_non_finite, self.digest)

    @property
    def n_generations(self) -> int:
        """Generations told so far; also the index of the next one."""
        return self._core.n_generations

    @property
    def champion(self) -> Champion | None:
        """The best so far; none before the first :meth:`tell`."""
        champion = self._core.champion
        return None if champion is None else Champion(**champion)

    @property
    def mean(self) -> Floats | None:
        """``[d]``: the mean of the distribution; none for an algorithm without one."""
        return self._core.mean

    @property
    def digest(self) -> str:
        """The last link of the generations' hash chain."""
        return self._core.digest

    def to_json(self) -> str:
        """The whole state between two generations."""
        return self._core.to_json()

    @classmethod
    def from_json(cls, text: str) -> Evolution:
        """Goes on from :meth:`to_json`, to the same bits."""
        return cls._of(_core.Evolution.from_json(text))

    def copy(self) -> Evolution:
        """Another one in the same state."""
        return type(self)._of(self._core.copy())

    def __getstate__(self) -> dict[str, Any]:
        return {"json": self.to_json()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._core = _core.Evolution.from_json(state["json"])

    def __repr__(self) -> str:
        return f"<{type(self).__name__} after {self.n_generations} generations>"


class GA(Evolution):
    """Genetic algorithm."""

    algorithm = "GA"


class SNES(Evolution):
    """Separable natural evolution strategy."""

    algorithm = "SNES"


class XNES(Evolution):
    """Exponential natural evolution strategy, at most 1,000 genes."""

    algorithm = "xNES"


class CMAES(Evolution):
    """Covariance matrix adaptation, at most 1,000 genes."""

    algorithm = "CMA-ES"


class SepCMAES(Evolution):
    """Covariance matrix adaptation with a diagonal matrix."""

    algorithm = "sep-CMA-ES"


class OpenAIES(Evolution):
    """OpenAI's evolution strategy."""

    algorithm = "openaiES"


@dataclass(frozen=True)
class Parameter:
    """A parameter of an algorithm."""

    key: str
    domain: str
    """As in "must be ..."."""
    default: str
    """A value, or the formula by which the algorithm computes it."""
    meaning: str


def algorithms() -> dict[str, list[Parameter]]:
    """The parameters of every algorithm, by its name in experiment files.

    >>> [parameter.key for parameter in algorithms()["SNES"]]
    ['eta_mu', 'eta_sigma', 'mu_init', 'sigma_init']
    """
    described = _core.algorithms()
    return {name: [Parameter(*it) for it in parameters] for name, _, parameters in described}


__all__ = [
    "CMAES", "Champion", "Evolution", "GA", "Generation", "OpenAIES", "Parameter", "SNES",
    "SepCMAES", "TrialSet", "XNES", "algorithms",
]
