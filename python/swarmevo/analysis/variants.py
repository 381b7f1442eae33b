"""Variants of an experiment."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import arguments
from ..experiment import Experiment

Config = dict[str, Any]


def variant(
    experiment: Experiment,
    *,
    robots: int | None = None,
    steps: int | None = None,
    without: str | None = None,
    perturbations: Config | None = None,
) -> Experiment:
    """The experiment with changes: another number of ``robots`` (and the same share of affected ones),
    another number of ``steps``, an input of 0 (``without``: a sensor, such as ``wireless_receiver:msg``),
    other ``perturbations`` than those of the file. Absent arguments change nothing.

    Conditions with the same number of robots have the same worlds and the same noise.
    """
    config = experiment.to_dict()
    evolved = evolved_robots(config)
    if robots is not None:
        resize(evolved, arguments.whole(robots, "robots", 1))
    if steps is not None:
        config["algorithm"]["evaluation_steps"] = arguments.whole(steps, "steps", 1)
    if perturbations is not None:
        evolved["perturbations"] = perturbations
    if without is not None:
        for name in _with_a_network(config):
            inhibit(config["world"]["objects"][name], without)
    return Experiment.from_dict(config, experiment.name)


def evolved_robots(config: Config) -> Config:
    """The object of the file whose genotypes evolve."""
    robots: Config = config["world"]["objects"][config["algorithm"]["evolvable_object"]]
    return robots


def resize(robots: Config, n: int) -> None:
    """Another number of robots, with the same share of affected ones."""
    was, robots["num_instances"] = robots["num_instances"], n
    for perturbation in robots.get("perturbations", {}).values():
        for it in perturbation if isinstance(perturbation, list) else [perturbation]:
            if isinstance(it.get("affected_robots"), int):
                it["affected_robots"] = (2 * it["affected_robots"] * n + was) // (2 * was)


def spread_out(config: Config, factor: float) -> None:
    """Makes the world and all starting places ``factor`` times as long and as wide. Reaches, speeds, the
    paths of lights and the distances within a random graph do not change."""
    world = config["world"]
    world["width"], world["height"] = factor * world["width"], factor * world["height"]
    for it in world["objects"].values():
        params = it["initializers"]["positions"]["params"]
        for key in params.keys() - {"size"}:
            params[key] = (factor * np.array(params[key])).tolist()


def inhibit(robots: Config, sensor: str) -> None:
    """Sets one more input of these robots to 0."""
    perturbations = robots.setdefault("perturbations", {})
    before = perturbations.get("stimuli_inhibition", [])
    before = before if isinstance(before, list) else [before]
    perturbations["stimuli_inhibition"] = [*before, {"stimuli": sensor, "affected_robots": "all"}]


def _with_a_network(config: Config) -> list[str]:
    objects = config["world"]["objects"].items()
    return [name for name, it in objects if it["type"] == "robot" and it.get("controller") == "neural_controller"]
