"""Experiments of a coordinator or of its database: histories, champions, individuals."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from . import arguments, protocol
from .archives import elite_address, to_ribs
from .champion import Champion, Judged, Origin, Selection
from .experiment import Experiment, config_text
from .extras import needs
from .generations import Generation, Generations, of_message, table
from .plotting import plot_history
from .representation import short

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Individuals:
    """A generation, with the fitness that evolution used."""

    genotypes: Floats
    """``[P, d]``"""
    fitness: Floats
    """``[P, T]``: of each individual in each trial."""

    __repr__ = short


class Records(ABC):
    """A source of experiments."""

    @abstractmethod
    def _call(self, name: str, **request: Any) -> Any:
        """A call of ``ExperimentService``."""

    def _fitness(self, experiment: int, generations: Sequence[int]) -> list[Floats]:
        """The fitness ``[P, T]`` of each of these generations."""
        return [self._run(experiment)._individuals(it, fitness_only=True).fitness for it in generations]

    def experiments(self) -> pandas.DataFrame:
        """A row per experiment: number, name, state, generations, fitness of the champion."""
        with needs("data"):
            import pandas

        return pandas.DataFrame([run.summary() for run in self.runs()])

    def runs(self) -> list[RecordedRun]:
        """All experiments, the newest last."""
        found = self._call("ListExperiments").experiments
        return [self._run(it.id) for it in sorted(found, key=lambda it: it.id)]

    def run(self, experiment: int | str) -> RecordedRun:
        """The experiment with a number or a name. KeyError if it does not exist, or the name is
        ambiguous."""
        if not isinstance(experiment, str):
            run = self._run(arguments.whole(experiment, "an experiment is a name, or a number: it", 1))
            run.refresh()
            return run
        named = self._call("ListExperiments", named=experiment).experiments
        found = [it.id for it in named if it.name == experiment]
        if len(found) != 1:
            which = "no experiment is" if not found else f"experiments {found} are"
            raise KeyError(f"{which} named {experiment!r}; name one by its number")
        return self._run(found[0])

    def individual(self, address: str | int) -> Champion:
        """The genotype at an address, bit for bit: ``3`` is the champion of experiment 3,
        ``3@5/7`` individual 7 of its generation 5, ``3@5/mean`` the mean of the distribution
        after that, ``3@5/cell(2,9)`` the elite of a cell of the repertoire after it."""
        if not isinstance(address, str):
            address = str(arguments.whole(address, "an address is a text such as 3@5/7, or a number: it", 1))
        if "@" in address and "/" not in address:
            raise ValueError(f"`{address}` is a generation; name one individual, such as {address}/0")
        found = self._call("GetIndividuals", address=address).individuals
        # The elite of a cell of a fork may have been born in the parent.
        of = self._call("GetExperiment", experiment_id=found[0].experiment_id).experiment
        return champion_of(found[0])._from(Origin(of.config_digest, of.name, of.seed, of.simulation))

    @abstractmethod
    def _run(self, experiment_id: int) -> RecordedRun: ...


class RecordedRun:
    """An experiment of a coordinator or of its database."""

    def __init__(self, records: Records, experiment_id: int) -> None:
        self._records = records
        self.id: int = experiment_id
        """Its number."""
        self._latest: Any = None
        self._experiment: Experiment | None = None

    def __getstate__(self) -> dict[str, Any]:
        # Messages are not copied but read again.
        return self.__dict__ | {"_latest": None}

    def refresh(self) -> None:
        """Reads its present state."""
        self._latest = self._records._call("GetExperiment", experiment_id=self.id)

    @property
    def message(self) -> Any:
        """The message ``Experiment`` of the protocol, as last read."""
        if self._latest is None:
            self.refresh()
        return self._latest.experiment

    @property
    def name(self) -> str:
        """The file's name, or the one under which it was submitted."""
        name: str = self.message.name
        return name

    @property
    def state(self) -> str:
        """Its present state: ``running``, ``completed``, ``failed``, ``cancelled`` or
        ``paused``."""
        self.refresh()
        return protocol.states()[self.message.state]

    @property
    def digest(self) -> str:
        """Digest of every bit so far; requests the latest one."""
        self.refresh()
        digest: str = self.message.digest
        return digest

    @property
    def experiment(self) -> Experiment:
        """The simulated experiment, with its seed."""
        if self._experiment is None:
            message = self.message
            self._experiment = Experiment(self._latest.config_json, message.name, message.seed)
        return self._experiment

    def summary(self) -> dict[str, Any]:
        """A short summary of its state."""
        self.refresh()
        it = self.message
        return {
            "id": it.id,
            "name": it.name,
            "group": it.group,
            "state": protocol.states()[it.state],
            "algorithm": it.algorithm,
            "seed": it.seed,
            "generations_done": it.generations_done,
            "generations": it.generations,
            "champion_fitness": it.champion_fitness if it.HasField("champion_fitness") else np.nan,
            "digest": it.digest,
        }

    @property
    def generations(self) -> list[Generation]:
        """All complete generations, in order; requests the latest ones."""
        done = [of_message(it.summary, it.completed_at_ms) for it in self._completed()]
        return Generations(done, self._completed)

    def _completed(self) -> Iterator[Any]:
        """The messages ``CompletedGeneration`` of all generations."""
        next_generation: int | None = 0
        while next_generation is not None:
            page = self._records._call(
                "ListGenerations", experiment_id=self.id, from_generation=next_generation
            )
            yield from page.generations
            is_last = not page.HasField("next_generation")
            next_generation = None if is_last else page.next_generation

    def history(self) -> pandas.DataFrame:
        """A row per generation: best, mean, min, standard deviation, digest, times."""
        return table(self.generations)

    @property
    def champion(self) -> Champion:
        """The champion so far."""
        return self._records.individual(str(self.id))

    def individual(self, generation: int, index: int) -> Champion:
        """An individual of any generation."""
        generation, index = arguments.whole(generation, "generation"), arguments.whole(index, "index", 0, arguments.U32_MAX)
        return self._records.individual(f"{self.id}@{generation}/{index}")

    def mean(self, generation: int) -> Floats:
        """``[d]``: the mean of the distribution after a generation."""
        generation = arguments.whole(generation, "generation")
        return self._records.individual(f"{self.id}@{generation}/mean").genotype

    def individuals(self, generation: int) -> Individuals:
        """All individuals of a generation, with the fitness that evolution used."""
        return self._individuals(arguments.whole(generation, "generation"), fitness_only=False)

    def _individuals(self, generation: int, *, fitness_only: bool) -> Individuals:
        genotypes: list[Any] = []
        fitness: list[Any] = []
        next_individual: int | None = 0
        while next_individual is not None:
            page = self._records._call(
                "GetIndividuals",
                address=f"{self.id}@{generation}",
                from_individual=next_individual,
                fitness_only=fitness_only,
            )
            genotypes.extend(it.genotype for it in page.individuals)
            fitness.extend(it.trial_fitness for it in page.individuals)
            is_last = not page.HasField("next_individual")
            next_individual = None if is_last else page.next_individual
        return Individuals(np.array(genotypes), np.array(fitness))

    def repertoire(self, generation: int | None = None) -> pandas.DataFrame:
        """A row per elite of the repertoire after a generation, by default the latest
        one. ``shown`` marks the fittest of every cell. Means over the trials of its life are
        optimistic; those that begin with ``judged_`` are missing before the end of a run. ``attrs``
        has the axes of the grid, and the corrected figures."""
        found = self._repertoire(generation)
        names = [f"{axis.measure}_{axis.of}" for axis in found.axes]
        elites = self._elites(found, names, has_cells=True)
        elites.attrs["axes"] = {
            name: {"range": (axis.low, axis.high), "cells": axis.cells} for name, axis in zip(names, found.axes)
        }
        if found.HasField("corrected"):
            of = found.corrected
            elites.attrs["corrected"] = {"qd_score": of.qd_score, "coverage": of.coverage, "stay": of.stay}
        return elites

    def to_ribs(self, generation: int | None = None) -> Any:
        """The elites that `repertoire` marks as ``shown``, as a ``GridArchive`` of the package
        ``ribs``, which draws it and continues with it. Objectives and measures are judged ones at the
        end of a run, and before it those of the evidence. The field ``address`` leads back to the
        individual."""
        return to_ribs(self, lambda: self._repertoire(generation))

    def _repertoire(self, generation: int | None) -> Any:
        """The message ``GetRepertoireResponse``."""
        chosen = {} if generation is None else {"generation": arguments.whole(generation, "generation")}
        return self._records._call("GetRepertoire", experiment_id=self.id, **chosen)

    def front(
        self, generation: int | None = None, reference: Iterable[float] | None = None
    ) -> pandas.DataFrame:
        """A row per elite of the front that NSGA-II keeps after a generation, by default the latest
        one. ``shown`` marks those that no other one dominates by judged values. Means over the trials
        of a life are optimistic; those that begin with ``judged_`` are missing before the end of a run.
        ``reference``: the point up to which the hypervolume counts, fitness and then each aim; by default the
        worst of all elites, which differs from run to run. ``attrs`` has the directions of the aims, and
        hypervolume, reference point and share of elites that stay on the front."""
        chosen: dict[str, Any] = {}
        if generation is not None:
            chosen["generation"] = arguments.whole(generation, "generation")
        if reference is not None:
            chosen["reference"] = [float(it) for it in arguments.numbers(list(reference), "reference").ravel()]
        found = self._records._call("GetFront", experiment_id=self.id, **chosen)
        names = [f"{aim.measure}_{aim.of}" for aim in found.aims]
        elites = self._elites(found, names, has_cells=False)
        elites.attrs["aims"] = {name: aim.direction for name, aim in zip(names, found.aims)}
        if found.HasField("figures"):
            of = found.figures
            elites.attrs["hypervolume"] = of.hypervolume
            elites.attrs["reference"] = tuple(of.reference)
            elites.attrs["stay"] = of.stay if of.HasField("stay") else None
        return elites

    def _elites(self, found: Any, names: list[str], *, has_cells: bool) -> pandas.DataFrame:
        """A row per elite of a response; ``names``: of its descriptors or aims."""
        with needs("data"):
            import pandas

        shown = set(found.shown)

        def row(place: int, elite: Any) -> dict[str, Any]:
            judged = elite.judged if elite.HasField("judged") else None
            return {
                "address": elite_address(elite),
                "shown": place in shown,
                "trials": elite.trials,
                "fitness": elite.fitness,
                **({"cell": tuple(elite.cell)} if has_cells else {}),
                **dict(zip(names, elite.descriptors)),
                "judged_fitness": judged.fitness if judged else np.nan,
                **({"judged_cell": tuple(judged.cell) if judged else None} if has_cells else {}),
                **{f"judged_{name}": judged.descriptors[i] if judged else np.nan for i, name in enumerate(names)},
            }

        return pandas.DataFrame([row(*it) for it in enumerate(found.elites)])

    def fitness(self, generation: int) -> Floats:
        """``[P, T]``: the fitness of a generation that evolution used, without its genotypes."""
        generation = arguments.whole(generation, "generation")
        return self._records._fitness(self.id, [generation])[0]

    def fitness_log(self, generations: range | Iterable[int] | None = None) -> pandas.DataFrame:
        """The fitness that evolution used: a row per generation, individual and trial. All
        complete generations, unless some are named."""
        with needs("data"):
            import pandas

        if generations is None:
            self.refresh()
            chosen = list(range(self.message.generations_done))
        else:
            if not isinstance(generations, Iterable):
                raise ValueError(f"generations are a range or a list of numbers, not {generations!r}")
            chosen = [arguments.whole(it, "a generation") for it in generations]
        columns: dict[str, list[NDArray[Any]]] = {name: [] for name in ("generation", "individual", "trial", "fitness")}
        for generation, fitness in zip(chosen, self._records._fitness(self.id, chosen)):
            individual, trial = np.indices(fitness.shape)
            columns["generation"].append(np.full(fitness.size, generation))
            columns["individual"].append(individual.reshape(-1))
            columns["trial"].append(trial.reshape(-1))
            columns["fitness"].append(fitness.reshape(-1))
        return pandas.DataFrame({name: np.concatenate(parts) if parts else [] for name, parts in columns.items()})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Best and mean fitness of every generation."""
        done = self.generations
        best, mean = [it.best for it in done], [it.mean for it in done]
        return plot_history(ax, self.name, [it.index for it in done], best, mean)

    def __repr__(self) -> str:
        it = self.message
        return (
            f"<{type(self).__name__} {it.id} ({it.name}): {protocol.states()[it.state]}, "
            f"{it.generations_done} of {it.generations} generations>"
        )


def champion_of(message: Any) -> Champion:
    """A genotype from a message."""
    judged = message.judged if message.HasField("judged") else None
    held_out = message.held_out if message.HasField("held_out") else None
    return Champion(
        genotype=np.array(message.genotype),
        generation=message.generation,
        individual=message.individual if message.HasField("individual") else None,
        trial_fitness=np.array(message.trial_fitness),
        selection=None if held_out is None else Selection(held_out.mean, held_out.trials),
        judged=None
        if judged is None
        else Judged(judged.mean, judged.low, judged.high, judged.trials),
    )


def problems_of(text: str) -> list[tuple[str, int | None, str]]:
    """The problems of an experiment file in a coordinator's words."""
    return [("", None, line) for line in text.splitlines() if line]


def config_json(config: Experiment | str | Mapping[str, Any]) -> str:
    """An experiment file as text."""
    if isinstance(config, Experiment):
        return config.to_json()
    return config if isinstance(config, str) else config_text(config)
