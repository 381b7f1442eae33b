"""Fitness under other conditions than those of evolution: trials, sizes, densities, ranges, noise, time
steps."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import arguments
from ..errors import ExperimentError
from ..champion import Genes
from ..experiment import Experiment
from ..fleet import Client
from ..trials import TRIALS_MAX, TrialSet
from .variants import Config, evolved_robots, resize, spread_out
from ..representation import short

TRIALS_OF = TrialSet.generation_of(1_000_000)
"""Generation of the trials: no run reaches it, and a fleet can compute it, to the same bits as here."""


@dataclass(frozen=True)
class Condition:
    """The fitness of a genotype under one condition."""

    what: str
    """The changed property, such as ``robots``; empty for the unchanged experiment."""
    value: float
    """Its value; NaN for the unchanged experiment."""
    mean: float
    """Mean fitness over the trials; NaN if there is no such experiment."""
    ci95: tuple[float, float]
    """Mean ± 1.96 standard errors."""
    problem: str = ""
    """The reason why there is no such experiment, for example a swarm that does not fit into its
    world."""

    __repr__ = short


def generalisation(
    experiment: Experiment, genotype: Genes, *, trials: int = 50, client: Client | None = None
) -> list[Condition]:
    """Fitness under every condition that applies to the experiment: unchanged; in other sets of as many
    trials; with half to five times as many robots, in the same world and in one that grows with them; with as
    many robots closer together or farther apart; with other reaches of its sensors and its radio, other noise
    of its light and distance sensors (if they have any), and other steps of its wheels.

    Except for the other sets, all conditions have the same trials, which had no part in evolution.
    ``client``: evaluate on its fleet.
    """
    trials = arguments.whole(trials, "trials", 2, TRIALS_MAX)
    genes = experiment._genotype(genotype)[np.newaxis]
    found = []
    for what, value, config in _conditions(experiment.to_dict()):
        trial_set = TrialSet.generation_of(TRIALS_OF.generation + int(value) - 1) if what == SETS else TRIALS_OF
        try:
            changed = Experiment.from_dict(config)
            run = changed.evaluate if client is None else lambda *it, **of: client.evaluate(changed, *it, **of)
            fitness = run(genes, trial_set, trials=trials)[0]
        except ExperimentError as error:
            found.append(Condition(what, value, np.nan, (np.nan, np.nan), error.problems[0].message))
            continue
        mean, error_of_mean = float(fitness.mean()), float(fitness.std(ddof=1) / np.sqrt(trials))
        found.append(Condition(what, value, mean, (mean - 1.96 * error_of_mean, mean + 1.96 * error_of_mean)))
    return found


SETS = "set of trials"
"""The set of the unchanged experiment has number 1."""


def _conditions(config: Config) -> Iterator[tuple[str, float, Config]]:
    yield "", np.nan, config
    for number in range(2, 6):
        yield SETS, number, config
    robots = evolved_robots(config)
    was = robots["num_instances"]
    for what, grows in (("robots", False), ("robots, as dense as before", True)):
        for factor in (0.5, 1.5, 2, 3, 5):
            n = round(was * factor)
            changed = deepcopy(config)
            resize(evolved_robots(changed), n)
            if grows:
                spread_out(changed, (n / was) ** 0.5)
            yield what, n, changed
    # A random graph sets the distances itself: the reach of the radio, below, determines its
    # density.
    if robots["initializers"]["positions"]["name"] != "random_graph":
        for density in (0.25, 0.5, 2, 4):
            changed = deepcopy(config)
            spread_out(changed, density**-0.5)
            yield "density of as many robots, times", density, changed
    for what, keys in _SCALED.items():
        there = [(key, value) for key in keys if (value := _find(robots, key))]
        for factor in (0.5, 0.75, 1.5, 2) if there else ():
            changed = deepcopy(config)
            for (*path, key), value in there:
                place = evolved_robots(changed)
                for name in path:
                    place = place[name]
                place[key] = value * factor
            yield what, there[0][1] * factor, changed


_SCALED = {
    "reach of the radio, cm": (
        ("sensors", "wireless_receiver", "range"),
        ("actuators", "wireless_transmitter", "range"),
    ),
    "variance of the light sensor's noise": (("sensors", "light_sensor", "noise_variance"),),
    "variance of the distance sensor's noise": (("sensors", "distance_sensor", "noise_variance"),),
    "reach of the light sensor, cm": (("sensors", "light_sensor", "range"),),
    "step of the wheels, s": (("actuators", "wheel_actuator", "step_duration"),),
}


def _find(robots: Config, path: tuple[str, ...]) -> float | None:
    value: Any = robots
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return value if isinstance(value, (int, float)) else None

