"""Experiments, and their simulation in this process."""

from __future__ import annotations

import json
import os
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments
from .champion import Champion, Genes, Origin
from .episodes import Episodes
from .errors import EvolutionWarning, OtherExperimentError
from .network import Network
from .trace import Trace
from .trials import AnyTrialSet, address
from .representation import short

if TYPE_CHECKING:
    from .evolution import Evolution

Floats = NDArray[np.float64]

THREADS_MAX = 1024
"""Limit of the memory of one computation."""


@dataclass(frozen=True)
class Measured:
    """Fitness, and the measures of every step."""

    fitness: Floats
    """``[P, T]``: fitness of each genotype in each trial."""
    measures: dict[str, Floats]
    """Measures by name, ``[P, T, steps]``; NaN for steps without a value. ``docs/evaluation.md`` of the
    project lists their units."""

    __repr__ = short


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
        """Reads an experiment file's text. ``name``: the name if the text has none; ``seed``
        replaces its seed. Raises :class:`ExperimentError` with all mistakes."""
        arguments.name_of(text, "an experiment file")
        arguments.name_of(name, "name")
        seed = None if seed is None else arguments.whole(seed, "seed")
        self._core = _core.Experiment(text, name, seed)
        self._json = self._core.to_json()
        self._config: dict[str, Any] = json.loads(self._json)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], seed: int | None = None) -> Experiment:
        """Reads a file, and the script that it names. An experiment without a name gets that of the
        file."""
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
        """Reads the content of an experiment file, such as a changed :meth:`to_dict`."""
        return cls(config_text(config), name, seed)

    @classmethod
    def quickstart(cls) -> Experiment:
        """A small first experiment: five robots agree on a leader. It is the file
        ``configs/quickstart.json`` of the project."""
        return cls(_core.QUICKSTART, "quickstart")

    def to_dict(self) -> dict[str, Any]:
        """The file with all defaults filled in: itself a valid experiment."""
        result: dict[str, Any] = json.loads(self._json)
        return result

    def to_json(self) -> str:
        """Like :meth:`to_dict`, as the text that workers read and digests cover."""
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
        """Number of robots of all swarms."""
        objects = self._config["world"]["objects"].values()
        return sum(it["num_instances"] for it in objects if it["type"] == "robot")

    @property
    def population_size(self) -> int:
        """Number of genotypes per generation in the file."""
        size: int = self._config["algorithm"]["population_size"]
        return size

    @property
    def generations(self) -> int:
        """Number of generations in the file."""
        generations: int = self._config["algorithm"]["generations"]
        return generations

    @property
    def measure_names(self) -> list[str]:
        """Names of the measures of the task, beside its fitness."""
        return self._core.measure_names

    @property
    def config_digest(self) -> str:
        """Digest of everything that determines a generation: the file except for its name, ``generations``,
        ``target_fitness`` and ``judgement_trials``; its seed; and the simulation's ``FINGERPRINT``. Champions
        have the digest of their experiment: :attr:`Champion.origin`."""
        return self._core.config_digest

    @property
    def _origin(self) -> Origin:
        return Origin(self.config_digest, self.name, self.seed, _core.FINGERPRINT)

    @property
    def warnings(self) -> list[str]:
        """The warnings of ``swarmctl validate``: keys of the file that have no effect, and a population too
        small to learn from."""
        return self._core.warnings

    def evaluate(
        self,
        genotypes: Genes | Sequence[Champion],
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = None,
        threads: int | None = None,
    ) -> Floats:
        """Fitness ``[P, T]`` of genotypes ``[P, d]`` or of a list of champions; ``[T]`` for one genotype
        ``[d]`` or champion. Compares champions with the experiment: :meth:`check`.

        ``generation``: the generation of the trials, or a :class:`TrialSet`. ``trials``: their number,
        or a range; the file's number if absent. ``threads``: number of threads, that of the processors if
        absent. Threads do not hold the interpreter's lock. Ctrl-C stops the computation.
        """
        genes, is_one = self._genotypes(genotypes)
        where = address(generation, trials, self.n_trials)
        fitness = self._core.evaluate(genes, where, thread_count(threads))
        fitness = fitness.reshape(len(genes), where[4] - where[3])
        return fitness[0] if is_one else fitness

    def measure(
        self,
        genotypes: Genes | Sequence[Champion],
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = None,
        threads: int | None = None,
    ) -> Measured:
        """Like :meth:`evaluate`, with all measures of all steps."""
        genes, is_one = self._genotypes(genotypes)
        where = address(generation, trials, self.n_trials)
        n_trials = where[4] - where[3]
        n_values = len(genes) * n_trials * (1 + self.n_steps * len(self.measure_names))
        _core.ensure_memory(2 * 8 * n_values, f"measures of {len(genes)} genotypes in {n_trials} trials")
        values = self._core.measure(genes, where, thread_count(threads))
        values = values.reshape(len(genes), n_trials, -1)
        names = self.measure_names
        fitness, steps = values[..., 0], values[..., 1:]
        steps = steps.reshape(len(genes), n_trials, self.n_steps, len(names))
        if is_one:
            fitness, steps = fitness[0], steps[0]
        return Measured(fitness, {name: steps[..., i] for i, name in enumerate(names)})

    def simulate(
        self,
        genotype: Genes,
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = None,
        threads: int | None = None,
    ) -> Trace:
        """All recorded values of a genotype ``[d]`` in T trials."""
        genes = self._genotype(genotype)
        where = address(generation, trials, self.n_trials)
        _core.ensure_memory(self._trace_len(where[4] - where[3]), f"a trace of {where[4] - where[3]} trials")
        arrays = self._core.simulate(genes, where, thread_count(threads))
        return Trace(self, genes, where, arrays)

    def episodes(
        self, generation: AnyTrialSet = 0, *, trials: int | range | None = None
    ) -> Episodes:
        """T trials side by side, step by step, whose robots the caller controls."""
        where = address(generation, trials, self.n_trials)
        return Episodes(self, where, self._core.episodes(where))

    def network(self, genotype: Genes) -> Network:
        """The network that a genotype ``[d]`` encodes."""
        genes = self._genotype(genotype)
        network = Network(json.loads(self._core.network_json(genes)))
        network._origin = (self, genes)
        return network

    def _controller_c(
        self, genes: Floats, generation: AnyTrialSet, trials: int | range | None
    ) -> list[tuple[str, bytes]]:
        return self._core.controller_c(genes, address(generation, trials, self.n_trials))

    def _controller_onnx(self, genes: Floats) -> bytes:
        return self._core.controller_onnx(genes)

    def replace(
        self,
        *,
        name: str | None = None,
        seed: int | None = None,
        generations: int | None = None,
        population_size: int | None = None,
        algorithm: str | type[Evolution] | None = None,
        params: Mapping[str, Any] | None = None,
        **settings: Any,
    ) -> Experiment:
        """A copy of the experiment, with these changes.

        ``algorithm``: its class or its name in experiment files, such as ``"CMA-ES"``. A new algorithm drops the
        parameters of the previous one; ``params`` sets parameters that differ from the defaults, for all
        populations. ``params`` without ``algorithm`` changes parameters of the experiment's algorithm.
        ``settings``: any other key of ``algorithm`` in the file, such as ``num_evaluations`` or
        ``evaluation_steps``. Raises :class:`ExperimentError` with all mistakes.

        >>> experiment = Experiment.quickstart().replace(algorithm="CMA-ES", seed=7, params={"sigma_init": 0.1})
        >>> experiment.to_dict()["algorithm"]["name"], experiment.seed
        ('CMA-ES', 7)
        """
        config = self.to_dict()
        of = config["algorithm"]
        algorithm = getattr(algorithm, "algorithm", algorithm)
        arguments.known(settings, [key for key in of if key not in ("name", "populations")] + ["target_fitness"], "setting of `algorithm`")
        for key, value in (("generations", generations), ("population_size", population_size)):
            if value is not None:
                of[key] = arguments.whole(value, key, 1)
        of |= {key: arguments.plain(value) for key, value in settings.items()}
        for population in of["populations"].values():
            old = population["params"]
            if algorithm is not None and algorithm != of["name"]:
                old = {key: value for key, value in old.items() if key not in parameters_of(of["name"])}
            given = {key: arguments.parameter(value, key) for key, value in (params or {}).items()}
            population["params"] = old | given
        of["name"] = of["name"] if algorithm is None else arguments.name_of(algorithm, "algorithm")
        if seed is not None:
            config["seed"] = arguments.whole(seed, "seed")
        if name is not None:
            config["name"] = arguments.name_of(name, "name")
        return Experiment(config_text(config))

    def evolution(self) -> Evolution:
        """The experiment's evolution before its first generation, the same as a
        coordinator's: the same genotypes for the same fitness, and the same digests. Issues
        :attr:`warnings` as ``EvolutionWarning``."""
        self._warn(3)
        return self._evolution()

    def _warn(self, stacklevel: int) -> None:
        for warning in self.warnings:
            warnings.warn(warning, EvolutionWarning, stacklevel=stacklevel)

    def _evolution(self) -> Evolution:
        from .evolution import Evolution

        settings = self._config["algorithm"]
        trials = (settings["champion_trials"], settings["judgement_trials"])
        return Evolution._of(self._core.evolution(), trials, self._origin)

    def fitness(self, genotypes: Genes | Sequence[Champion], trial_set: AnyTrialSet, n_trials: int) -> Floats:
        """:meth:`evaluate`, in the form that :meth:`Evolution.compare` and :meth:`Evolution.judge`
        require."""
        return self.evaluate(genotypes, trial_set, trials=n_trials)

    def _trace_len(self, n_trials: int) -> int:
        """Approximate number of bytes that a trace needs while it is made."""
        topology = self._config["topology"]
        widths = [sum(it["n"] for it in topology[key].values()) for key in ("stimuli", "ensembles")]
        emitters = [
            it["actuators"].get("wireless_transmitter") or {}
            for it in self._config["world"]["objects"].values() if it["type"] == "robot"
        ]
        message_len = max((it.get("msg_length", 0) for it in emitters), default=0)
        of_robot = 74 + 16 * message_len + 4 * widths[0] + 8 * widths[1]
        total: int = 2 * n_trials * self.n_steps * (of_robot * self.n_robots + 8 * (8 + len(self.measure_names)))
        return total

    def check(self, champion: Champion) -> None:
        """Checks that a champion evolved in this experiment, by the digest of the file (except for its name,
        ``generations``, ``target_fitness`` and ``judgement_trials``), seed and simulation. Raises
        :class:`OtherExperimentError` if not. Every function that takes a champion calls it.

        To use a champion under other conditions on purpose, give its ``genotype``, which has no origin.
        """
        if not isinstance(champion, Champion):
            raise ValueError(f"a Champion is compared with an experiment, not {type(champion).__name__}")
        origin = champion.origin
        if origin is None:
            raise OtherExperimentError(
                "the champion does not say in which experiment it evolved", "Give its `genotype` if it evolved in this one"
            )
        if origin.config_digest == self.config_digest:
            return
        raise OtherExperimentError(
            f"the champion evolved in another experiment: {origin.name or 'one without a name'}"
            f"{'' if origin.seed is None else f', seed {origin.seed}'}, configuration {origin.config_digest[:12]}; "
            f"this is {self.name}, seed {self.seed}, configuration {self.config_digest[:12]}",
            self._difference(origin),
        )

    def _difference(self, origin: Origin) -> str:
        if origin.simulation not in (None, _core.FINGERPRINT):
            return (
                f"It evolved by the simulation `{origin.simulation}`, but this is `{_core.FINGERPRINT}`; "
                f"give its `genotype` to use it with this simulation"
            )
        if origin.seed is not None and origin.seed != self.seed and self.replace(seed=origin.seed).config_digest == origin.config_digest:
            return f"Only the seed differs: read this experiment with seed={origin.seed}"
        return "Read the experiment in which it evolved, or give its `genotype` to use it under other conditions"

    def _genotypes(self, genotypes: Genes | Sequence[Champion]) -> tuple[Floats, bool]:
        if isinstance(genotypes, Champion):
            return self._genotype(genotypes)[np.newaxis], True
        if isinstance(genotypes, (list, tuple)) and any(isinstance(it, Champion) for it in genotypes):
            return np.array([self._genotype(it) for it in genotypes]), False
        return arguments.genotypes_of(genotypes, self.n_genes)

    def _genotype(self, genotype: Genes) -> Floats:
        if isinstance(genotype, Champion):
            self.check(genotype)
            genotype = genotype.genotype
        genes = arguments.numbers(genotype, "the genotype")
        if genes.shape != (self.n_genes,):
            raise ValueError(f"a genotype has {self.n_genes} genes, not {list(genes.shape)}")
        return genes


def thread_count(threads: int | None) -> int:
    """Number of threads of a computation: that of the processors if absent."""
    if threads is None:
        return available_cpus()
    return arguments.whole(threads, "threads", 1, THREADS_MAX)


def config_text(config: Mapping[str, Any]) -> str:
    """The content of an experiment file as text; converts arrays and numbers of NumPy to lists and
    numbers."""
    if not isinstance(config, Mapping):
        raise ValueError(f"an experiment is a mapping from keys to values, not {type(config).__name__}")

    try:
        return json.dumps(dict(config), default=arguments.plain)
    except TypeError as error:
        raise ValueError(f"an experiment file has no such keys: {error}") from None


def available_cpus() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def parameters_of(algorithm: str) -> list[str]:
    """Keys of an algorithm's parameters."""
    return [key for name, _, parameters in _core.algorithms() if name == algorithm for key, *_ in parameters]


def as_experiment(given: Experiment | Mapping[str, Any] | str) -> Experiment:
    """An experiment, from any of its forms: itself, a file's text, or its content."""
    if isinstance(given, Experiment):
        return given
    return Experiment(given) if isinstance(given, str) else Experiment.from_dict(given)
