"""A champion, and its behaviour under other conditions."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...champion import Champion as Evolved
from ...experiment import Experiment, Measured
from ...trace import Trace
from ...trials import TrialSet
from ..proportions import Proportion
from ..variants import variant

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Champion:
    """The champion of ``results/champions/NAME_snes-SEED.json`` and its experiment, in the trials of
    ``swarmctl evaluate``, which had no part in evolution."""

    name: str
    """Name of the experiment, such as ``leader_selection``."""
    results: Path
    configs: Path
    trials: int
    """Episodes of every statistic."""
    seed: int = 0

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment of its evolution."""
        experiment = Experiment.from_file(self.configs / f"{self.name}_snes.json", self.seed)
        experiment.check(self._evolved)
        return experiment

    @cached_property
    def _evolved(self) -> Evolved:
        return Evolved.from_file(self.results / "champions" / f"{self.name}_snes-{self.seed}.json")

    @cached_property
    def genotype(self) -> Floats:
        """``[d]``"""
        return self._evolved.genotype

    def under(self, **changes: Any) -> Experiment:
        """The experiment with :func:`~swarmevo.analysis.variants.variant`'s changes."""
        return variant(self.experiment, **changes) if changes else self.experiment

    def measure(self, **changes: Any) -> Measured:
        """Measures ``[trials, steps]`` under these changes."""
        return self.under(**changes).measure(self.genotype, TrialSet.evaluation(), trials=self.trials)

    def trace(self, trials: int | range | None = None, **changes: Any) -> Trace:
        """Traces under these changes, of ``trials`` (all if absent)."""
        where = self.trials if trials is None else trials
        return self.under(**changes).simulate(self.genotype, TrialSet.evaluation(), trials=where)

    def history(self, algorithm: str, folder: str = "") -> dict[str, Floats]:
        """Best, mean and worst fitness of every generation of the run of an ``algorithm``."""
        path = self.results / folder / "histories" / f"{self.name}_{algorithm}-{self.seed}.csv"
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {key: np.array([float(row[key] or "nan") for row in rows]) for key in ("best", "mean", "min")}

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the world, cm."""
        world = self.experiment.to_dict()["world"]
        return float(world["width"]), float(world["height"])


def mean_of_trials(values: Floats) -> Proportion:
    """The mean of a share ``[T]`` of each trial, with its standard error over trials."""
    error = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")
    return Proportion(float(values.mean()), error, len(values))


REACH = 100.0
"""Reach of the radio in all experiments, cm."""
