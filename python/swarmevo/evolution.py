"""The evolutionary algorithms, as ask and tell."""

from __future__ import annotations

import difflib
import warnings
from dataclasses import dataclass
from typing import Any, Callable, ClassVar, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, arguments
from .champion import Champion, Origin
from .errors import EvolutionWarning
from .generations import Generation
from .trials import TrialSet

Floats = NDArray[np.float64]

Evaluate = Callable[[Floats, TrialSet, int], ArrayLike]
"""Fitness of genotypes ``[P, d]`` in T trials of a set: ``f(genotypes, trial_set, T)`` returns ``[P, T]``, in any
type of array, list or tuple of numbers; or ``[P]`` if trials do not matter, which counts as one trial."""

CHAMPION_TRIALS = 50
JUDGEMENT_TRIALS = 200
"""Defaults of experiment files."""


class Evolution:
    """A population of genotypes, evolved by one of the algorithms.

    Genes lie in [0, 1], larger fitness is better, and a fitness that is not finite ranks
    last. The code and the results are the coordinator's, bit for bit. Use the class of an
    algorithm, or :meth:`Experiment.evolution`.

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
        """``n_genes``: d, at least 1. ``params``: as in experiment files; ``docs/keys.md``
        and :func:`algorithms` list them. Warns (``EvolutionWarning``) of a population too small to learn
        from."""
        self._start(n_genes, population_size, seed, params, [])

    def _start(
        self, n_genes: int, population_size: int, seed: int, params: dict[str, float | str], minimised: list[bool]
    ) -> None:
        if type(self) is Evolution:
            raise TypeError("use the class of an algorithm, such as SNES, or Experiment.evolution")
        n_genes = arguments.whole(n_genes, "n_genes", 0, arguments.SIZE_MAX)
        population_size = arguments.whole(population_size, "population_size", 0, arguments.U32_MAX)
        seed = arguments.whole(seed, "seed")
        given = {key: arguments.parameter(value, key) for key, value in params.items()}
        try:
            self._core = _core.Evolution(self.algorithm, n_genes, population_size, seed, given, minimised)
        except ValueError as error:
            raise ValueError(_with_hints(str(error), self.algorithm, given)) from None
        advice = _core.advice(self.algorithm, population_size)
        if advice is not None:
            warnings.warn(f"population_size: {advice}", EvolutionWarning, stacklevel=3)
        self._trials = (CHAMPION_TRIALS, JUDGEMENT_TRIALS)
        self._origin: Origin | None = None

    @classmethod
    def _of(
        cls,
        core: _core.Evolution,
        trials: tuple[int, int] = (CHAMPION_TRIALS, JUDGEMENT_TRIALS),
        origin: Origin | None = None,
    ) -> Evolution:
        self = cls.__new__(cls)
        self._core = core
        self._trials = trials
        self._origin = origin
        return self

    def ask(self) -> Floats:
        """The next generation's genotypes ``[P, d]``. A second call gives the same."""
        return self._core.ask()

    def tell(self, fitness: ArrayLike, measures: ArrayLike | None = None) -> Generation:
        """Learns from the fitness of the genotypes that :meth:`ask` gave: ``[P]``, or
        ``[P, T]`` for T trials of each, whose mean counts. ``measures``: ``[P, M]``, or ``[P, T, M]`` for
        trials, the values of M aims or descriptors, for algorithms that learn from them, too. Warns (``EvolutionWarning``) of what a
        coordinator reports as notices: fitness that is not finite, or that is the same for all
        individuals in ten generations; a distribution that is a point, or far wider than the range
        of genes. Raises ``EvolutionError``, a ValueError, and stays unchanged where a coordinator's run fails:
        if no fitness is finite, or evolution cannot learn any more."""
        told = self._tell(fitness, measures=measures)
        for notice in told.notices:
            warnings.warn(notice, EvolutionWarning, stacklevel=2)
        return told.generation

    def _tell(
        self, fitness: ArrayLike, experiment: _core.Experiment | None = None, measures: ArrayLike | None = None
    ) -> Told:
        """``experiment``: the experiment of this run."""
        values = arguments.numbers(fitness, "fitness")
        if values.ndim == 1:
            values = values[:, np.newaxis]
        if values.ndim != 2:
            raise ValueError(f"fitness is an array [P] or [P, T], not {list(values.shape)}")
        row, notices, completed = self._core.tell(values, experiment, _rows_of(measures, values.shape[1]))
        index, best, mean, least, deviation, n_non_finite = row
        return Told(Generation(index, best, mean, least, n_non_finite, self.digest, deviation), notices, completed)

    def front(self) -> Front:
        """The elites of a front so far: no individual dominates one of them by the mean of all trials that it
        has met, which is optimistic where trials differ. Only for algorithms with several aims."""
        found = self._core.front()
        if found is None:
            raise ValueError("the algorithm has no front; NSGA2 has one")
        genotypes, values, born = found
        return Front(genotypes, values[:, 0], values[:, 1:], born)

    def compare(self, evaluate: Evaluate, trials: int | None = None) -> Champion:
        """Compares the candidates for the champion on held-out trials, and makes the winner the champion.
        Candidates are the best individual since the last comparison, the mean of the distribution and the
        champion so far.
        :func:`evolve` compares every ``champion_every`` generations.

        ``evaluate``: as for :func:`evolve`, such as :attr:`Experiment.fitness`. ``trials``: number per block;
        the experiment's ``champion_trials`` if absent, 50 without an experiment. Returns the champion.
        Candidates with a fitness that is not finite cannot win; if no candidate can, the champion stays.
        """
        self._compare(evaluate, self._trials[0] if trials is None else arguments.whole(trials, "trials", 1))
        champion = self.champion
        assert champion is not None, "a generation has been told"
        return champion

    def judge(self, evaluate: Evaluate, trials: int | None = None) -> Champion:
        """Judges the champion on trials that selected nothing, as :func:`evolve` does at its end. Compares
        any new candidates first. A judgement does not affect the further evolution.

        ``evaluate``: as for :meth:`compare`. ``trials``: the experiment's ``judgement_trials`` if absent, 200
        without an experiment. ``judged`` of the champion is none if the fitness of a trial is not finite.
        """
        return self._judge(evaluate, self._trials[1] if trials is None else arguments.whole(trials, "trials", 1)).champion

    def _compare(self, evaluate: Evaluate, n_trials: int) -> list[Floats]:
        """Returns the fitness of all blocks."""
        candidates = self._core.reevaluation()
        if candidates is None:
            raise ValueError("there are no candidates before the first `tell`")
        blocks = []
        while (asked := candidates.ask()) is not None:
            genotypes, trial_set = asked
            blocks.append(compute(evaluate, genotypes, TrialSet(*trial_set), n_trials))
            candidates.tell(blocks[-1])
        self._core.set_champion(candidates)
        return blocks

    def _judge(self, evaluate: Evaluate, n_trials: int) -> Judgement:
        ended = self.copy()
        # A longer run does not continue from a comparison that only the end caused.
        blocks = ended._compare(evaluate, self._trials[0]) if self._core.has_challenger else []
        asked = ended._core.judgement()
        if asked is None:
            raise ValueError("there is no champion to judge before the first `tell`")
        genotypes, trial_set = asked
        fitness = compute(evaluate, genotypes, TrialSet(*trial_set), n_trials)
        champion, digest = ended._core.judge(fitness)
        return Judgement(Champion._of(champion, self._origin), digest, blocks, fitness)

    @property
    def n_generations(self) -> int:
        """Generations told so far; also the index of the next one."""
        return self._core.n_generations

    @property
    def champion(self) -> Champion | None:
        """The best genotype so far; none before the first :meth:`tell`."""
        champion = self._core.champion
        return None if champion is None else Champion._of(champion, self._origin)

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
        """Continues from :meth:`to_json`, to the same bits."""
        return cls._of(_core.Evolution.from_json(arguments.name_of(text, "the state of an evolution")))

    def copy(self) -> Evolution:
        """A copy in the same state."""
        return type(self)._of(self._core.copy(), self._trials, self._origin)

    def __getstate__(self) -> dict[str, Any]:
        n_flat = self._core.n_flat
        return {"json": self.to_json(), "n_flat": n_flat, "trials": self._trials, "origin": self._origin}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._core = _core.Evolution.from_json(state["json"], state.get("n_flat", 0))
        self._trials = state.get("trials", (CHAMPION_TRIALS, JUDGEMENT_TRIALS))
        self._origin = state.get("origin")

    def __repr__(self) -> str:
        return f"<{type(self).__name__} after {self.n_generations} generations>"


class Told(NamedTuple):
    """The outcome of a generation."""

    generation: Generation
    notices: list[str]
    """Notices."""
    completed: str | None
    """The reason, if it is the last generation of a run; empty: all are done."""


class Front(NamedTuple):
    """Elites of which none is better than another one in fitness and all aims."""

    genotypes: Floats
    """``[N, d]``"""
    fitness: Floats
    """``[N]``"""
    aims: Floats
    """``[N, M]``"""
    born: list[tuple[int, int]]
    """The generation that first evaluated each, and its index there."""


def _rows_of(measures: ArrayLike | None, n_trials: int) -> Floats | None:
    """``[P, T M]``"""
    if measures is None:
        return None
    values = arguments.numbers(measures, "measures")
    if values.ndim == 2 and n_trials == 1:
        return values
    if values.ndim != 3 or values.shape[1] != n_trials:
        raise ValueError(f"measures is an array [P, M] or [P, T, M], with T of the fitness, not {list(values.shape)}")
    return values.reshape(len(values), -1)


class Judgement(NamedTuple):
    """The outcome of the end of a run."""

    champion: Champion
    digest: str
    blocks: list[Floats]
    """Fitness of the blocks of a comparison that only the end caused."""
    fitness: Floats
    """``[1, T]``: fitness of the champion in its judgement."""


def compute(evaluate: Evaluate, genotypes: Floats, trial_set: TrialSet, n_trials: int) -> Floats:
    """The checked fitness ``[P, T]`` from ``evaluate``."""
    return arguments.fitness_of(evaluate(genotypes, trial_set, n_trials), len(genotypes), n_trials)


def _with_hints(problems: str, algorithm: str, given: dict[str, Any]) -> str:
    """Problems of a setup, with a suggestion for a misspelt parameter."""
    names = [it.key for it in algorithms()[algorithm]]
    lines = problems.splitlines()
    for i, line in enumerate(lines):
        for key in given:
            close = difflib.get_close_matches(key, names, 1)
            if line.endswith(f"has no parameter `{key}`"):
                lines[i] += f"; did you mean `{close[0]}`?" if close else f"; it has {', '.join(names)}"
    return "\n".join(lines)


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


class PGPE(Evolution):
    """Parameter-exploring policy gradients with ClipUp."""

    algorithm = "PGPE"


class NSGA2(Evolution):
    """Fronts of compromises between fitness, of which more is better, and one or two other aims.

    >>> evolution = NSGA2(3, aims=["minimise"], population_size=20, seed=7)
    >>> genotypes = evolution.ask()
    >>> _ = evolution.tell(genotypes[:, 0], measures=genotypes[:, :1] ** 2)
    >>> len(evolution.front().fitness)
    20
    """

    algorithm = "NSGA-II"

    def __init__(
        self,
        n_genes: int,
        *,
        aims: Sequence[str],
        population_size: int = 20,
        seed: int = 0,
        **params: float | str,
    ) -> None:
        """``aims``: for each aim beside fitness ``"maximise"`` or ``"minimise"``. Everything else as for other
        algorithms."""
        if isinstance(aims, str) or not all(isinstance(aim, str) for aim in aims):
            raise ValueError(f'aims is a list of "maximise" and "minimise", not {aims!r}')
        arguments.known(aims, ["maximise", "minimise"], "direction")
        self._start(n_genes, population_size, seed, params, [aim == "minimise" for aim in aims])


@dataclass(frozen=True)
class Parameter:
    """A parameter of an algorithm."""

    key: str
    domain: str
    """The valid values, as in "must be ..."."""
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
    "CMAES", "Champion", "Evolution", "Front", "GA", "Generation", "NSGA2", "OpenAIES", "PGPE", "Parameter", "SNES",
    "SepCMAES", "TrialSet", "XNES", "algorithms",
]
