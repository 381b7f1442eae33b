"""Experiments: their simulation, here."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .episodes import Episodes
from .network import Network
from .trace import Trace
from .trials import AnyTrialSet, address

if TYPE_CHECKING:
    from .evolution import Evolution

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Measured:
    """Fitness, and the measures of every step."""

    fitness: Floats
    """``[P, T]``: of each genotype in each trial."""
    measures: dict[str, Floats]
    """By name, ``[P, T, steps]``; NaN where a step has none. ``docs/evaluation.md`` of the
    project has their units."""


class Experiment:
    """An experiment file, read, checked and compiled.

    Genes lie in [0, 1]; larger fitness is better. Every result is a pure function of
    experiment, genotype and trial: the same bits on any machine, with any number of threads.

    >>> exp = Experiment.quickstart()
    >>> exp.n_genes, exp.n_trials, exp.n_steps
    (424, 3, 100)
    >>> exp.evaluate(np.full((2, 424), 0.5)).shape
    (2, 3)
    """

    def __init__(self, text: str, name: str = "", seed: int | None = None) -> None:
        """Reads an experiment file's text. ``name`` names it if the text does not, ``seed``
        replaces its seed. Raises :class:`ExperimentError` with all that is wrong."""
        self._core = _core.Experiment(text, name, seed)
        self._json = self._core.to_json()
        self._config: dict[str, Any] = json.loads(self._json)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], seed: int | None = None) -> Experiment:
        """Reads a file, and the script that it refers to. Without a name of its own it has the file's."""
        path = Path(path)
        text = path.read_text(encoding="utf-8")
        if script := _core.script_path(text):
            place = path.parent / script
            text = _core.inline_script(text, place.name, place.read_text(encoding="utf-8"))
        return cls(text, path.stem, seed)

    @classmethod
    def from_dict(
        cls, config: Mapping[str, Any], name: str = "", seed: int | None = None
    ) -> Experiment:
        """Takes what an experiment file says, such as a changed :meth:`to_dict`."""
        return cls(json.dumps(config), name, seed)

    @classmethod
    def quickstart(cls) -> Experiment:
        """A small experiment to begin with: five robots agree on a leader. It is the file
        ``configs/quickstart.json`` of the project."""
        return cls(_core.QUICKSTART, "quickstart")

    def to_dict(self) -> dict[str, Any]:
        """The file with all defaults filled in: itself a valid experiment."""
        result: dict[str, Any] = json.loads(self._json)
        return result

    def to_json(self) -> str:
        """As :meth:`to_dict`, as text: what workers compute from, and digests hash."""
        return self._json

    def __reduce__(self) -> tuple[type[Experiment], tuple[str]]:
        return (Experiment, (self._json,))

    def __repr__(self) -> str:
        algorithm = self._config["algorithm"]
        return (
            f"<Experiment {self.name!r}: {algorithm['fitness_function']}, {self.n_robots} robots, "
            f"{self.n_genes} genes, {self.n_trials} trials of {self.n_steps} steps, seed {self.seed}>"
        )

    @property
    def name(self) -> str:
        """For display; it influences nothing."""
        return self._core.name

    @property
    def seed(self) -> int:
        """The seed of all randomness."""
        seed: int = self._config["seed"]
        return seed

    @property
    def n_genes(self) -> int:
        """Length d of a genotype."""
        return self._core.n_genes

    @property
    def bounds(self) -> Floats:
        """``[d, 2]``: lower and upper bound of each gene, 0 and 1."""
        return np.tile(np.array([0.0, 1.0]), (self.n_genes, 1))

    @property
    def n_trials(self) -> int:
        """Trials per genotype and generation, T."""
        n_trials: int = self._config["algorithm"]["num_evaluations"]
        return n_trials

    @property
    def n_steps(self) -> int:
        """Environment steps of an episode."""
        return self._core.n_steps

    @property
    def n_robots(self) -> int:
        """Robots of all swarms."""
        objects = self._config["world"]["objects"].values()
        return sum(it["num_instances"] for it in objects if it["type"] == "robot")

    @property
    def population_size(self) -> int:
        """Genotypes per generation that the file asks for."""
        size: int = self._config["algorithm"]["population_size"]
        return size

    @property
    def generations(self) -> int:
        """Generations that the file asks for."""
        generations: int = self._config["algorithm"]["generations"]
        return generations

    @property
    def measure_names(self) -> list[str]:
        """Names of the measures of the task, beside its fitness."""
        return self._core.measure_names

    @property
    def warnings(self) -> list[str]:
        """Keys of the file that were accepted and ignored."""
        return self._core.warnings

    def evaluate(
        self,
        genotypes: ArrayLike,
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = None,
        threads: int | None = None,
    ) -> Floats:
        """Fitness ``[P, T]`` of genotypes ``[P, d]`` (or ``[d]``: then ``[T]``).

        ``generation``: in the trials of which generation, or a :class:`TrialSet`.
        ``trials``: how many, or a range of them; the file's number if absent.
        ``threads``: as many as there are processors if absent; they do not hold the
        interpreter's lock. Ctrl-C stops it.
        """
        genes, is_one = self._genotypes(genotypes)
        where = address(generation, trials, self.n_trials)
        fitness = self._core.evaluate(genes, where, _threads(threads))
        fitness = fitness.reshape(len(genes), where[4] - where[3])
        return fitness[0] if is_one else fitness

    def measure(
        self,
        genotypes: ArrayLike,
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = None,
        threads: int | None = None,
    ) -> Measured:
        """As :meth:`evaluate`, with all measures of all steps."""
        genes, is_one = self._genotypes(genotypes)
        where = address(generation, trials, self.n_trials)
        n_trials = where[4] - where[3]
        values = self._core.measure(genes, where, _threads(threads))
        values = values.reshape(len(genes), n_trials, -1)
        names = self.measure_names
        fitness, steps = values[..., 0], values[..., 1:]
        steps = steps.reshape(len(genes), n_trials, self.n_steps, len(names))
        if is_one:
            fitness, steps = fitness[0], steps[0]
        return Measured(fitness, {name: steps[..., i] for i, name in enumerate(names)})

    def simulate(
        self,
        genotype: ArrayLike,
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = None,
        threads: int | None = None,
    ) -> Trace:
        """Everything that there is to see of a genotype ``[d]`` in T trials."""
        genes = self._genotype(genotype)
        where = address(generation, trials, self.n_trials)
        arrays = self._core.simulate(genes, where, _threads(threads))
        return Trace(self, genes, where, arrays)

    def episodes(
        self, generation: AnyTrialSet = 0, *, trials: int | range | None = None
    ) -> Episodes:
        """T trials side by side, step by step, whose robots do what they are told."""
        where = address(generation, trials, self.n_trials)
        return Episodes(self, where, self._core.episodes(where))

    def network(self, genotype: ArrayLike) -> Network:
        """The network that a genotype ``[d]`` encodes."""
        return Network(json.loads(self._core.network_json(self._genotype(genotype))))

    def evolution(self) -> Evolution:
        """The experiment's evolution before its first generation, the same as a
        coordinator's: the same genotypes for the same fitness, and the same digests."""
        from .evolution import Evolution

        settings = self._config["algorithm"]
        trials = (settings["champion_trials"], settings["judgement_trials"])
        return Evolution._of(self._core.evolution(), trials)

    def fitness(self, genotypes: ArrayLike, trial_set: AnyTrialSet, n_trials: int) -> Floats:
        """:meth:`evaluate`, in the form that :meth:`Evolution.compare` and :meth:`Evolution.judge` take."""
        return self.evaluate(genotypes, trial_set, trials=n_trials)

    def _genotypes(self, genotypes: ArrayLike) -> tuple[Floats, bool]:
        genes = np.ascontiguousarray(genotypes, dtype=np.float64)
        is_one = genes.ndim == 1
        if is_one:
            genes = genes[np.newaxis]
        if genes.ndim != 2 or genes.shape[1] != self.n_genes:
            raise ValueError(
                f"genotypes are an array [P, {self.n_genes}], not {list(np.shape(genotypes))}"
            )
        return genes, is_one

    def _genotype(self, genotype: ArrayLike) -> Floats:
        genes = np.ascontiguousarray(genotype, dtype=np.float64)
        if genes.shape != (self.n_genes,):
            raise ValueError(f"a genotype has {self.n_genes} genes, not {list(genes.shape)}")
        return genes


def _threads(threads: int | None) -> int:
    if threads is None:
        return available_cpus()
    if threads < 1:
        raise ValueError(f"threads are 1 or more, not {threads}")
    return threads


def available_cpus() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
