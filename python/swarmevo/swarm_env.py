"""The class behind :func:`swarmevo.parallel_env`; it needs PettingZoo, so it is imported on demand."""

from __future__ import annotations

from copy import copy
from typing import Any

import gymnasium.spaces as spaces
import numpy as np
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from . import arguments
from .episodes import Actions, Episodes
from .experiment import Experiment
from .trials import TrialSet

GENERATIONS_MAX = 10_000_000
"""Number of trial sets from which seeds choose."""
CHOOSING = ("SoftmaxDecoding", "FirstToSpike")
"""Decodings that choose one of the neurons: of an LED, each neuron is a colour."""


class SwarmEnv(ParallelEnv[str, NDArray[np.float32], dict[str, Any]]):  # type: ignore[misc]
    """An experiment as an environment; use :func:`swarmevo.parallel_env`. Copies and pickles continue from
    their step, to the same bits."""

    render_mode = None

    def __init__(self, experiment: Experiment) -> None:
        self.metadata = {"name": f"swarmevo_{experiment.name}", "render_modes": [], "is_parallelizable": True}
        self._experiment = experiment
        self._episodes: Episodes = experiment.episodes(trials=1)
        self._next_generation = 0
        config = experiment.to_dict()
        self._robots: dict[str, dict[str, Any]] = {}
        for name, it in config["world"]["objects"].items():
            if it["type"] == "robot" and it["controller"] == "neural_controller":
                self._robots |= {f"{name}_{i}": it for i in range(it["num_instances"])}
        self.possible_agents = list(self._robots)
        self.agents: list[str] = []
        n_inputs = self._episodes.n_inputs
        self.observation_spaces = {
            agent: spaces.Box(-np.inf, np.inf, (n_inputs,), np.float32) for agent in self.possible_agents
        }
        n_colours = _n_colours(config["topology"])
        self.action_spaces = {
            agent: self._action_space(robot["actuators"], n_colours) for agent, robot in self._robots.items()
        }

    def _action_space(self, actuators: dict[str, Any], n_colours: int) -> spaces.Dict:
        parts: dict[str, spaces.Space[Any]] = {}
        if actuators.get("wheel_actuator") is not None:
            parts["wheels"] = spaces.Box(-1.0, 1.0, (2,), np.float64)
        if actuators.get("led_actuator") is not None:
            parts["led"] = spaces.Discrete(n_colours)
        if actuators.get("wireless_transmitter") is not None:
            parts["send"] = spaces.Discrete(2)
            parts["message"] = spaces.Box(0.0, 1.0, (self._episodes.message_len,), np.float64)
        return spaces.Dict(parts)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """``[I]``"""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """A dictionary with the robot's actuators."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[np.float32]], dict[str, dict[str, Any]]]:
        """Begins an episode: see :func:`swarmevo.parallel_env`."""
        options = options or {}
        arguments.misspelt(options, ("generation", "trial"), "option")
        if seed is not None:
            self._next_generation = arguments.whole(seed, "seed")
        trial_set = TrialSet.of(options.get("generation", self._next_generation % GENERATIONS_MAX))
        trial = arguments.whole(options.get("trial", 0), "trial", 0, 999)
        self._next_generation += 1
        self._episodes = self._experiment.episodes(trial_set, trials=range(trial, trial + 1))
        self.agents = list(self.possible_agents)
        return self._observations(), {agent: {} for agent in self.agents}

    def step(
        self, actions: dict[str, dict[str, Any]]
    ) -> tuple[
        dict[str, NDArray[np.float32]],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """One step: see :func:`swarmevo.parallel_env`."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        fitness = self._episodes.step(self._actions(actions))[0]
        reward = 0.0 if np.isnan(fitness) else float(fitness)
        is_over = self._episodes.is_over
        observations = self._observations()
        infos: dict[str, dict[str, Any]] = {agent: {} for agent in self.agents}
        if is_over:
            total = float(self._episodes.fitness[0])
            infos = {agent: {"fitness": total} for agent in self.agents}
        result = (
            observations,
            {agent: reward for agent in self.agents},
            {agent: False for agent in self.agents},
            {agent: is_over for agent in self.agents},
            infos,
        )
        if is_over:
            self.agents = []
        return result

    def _observations(self) -> dict[str, NDArray[np.float32]]:
        return dict(zip(self.possible_agents, self._episodes.stimuli[0]))

    def _actions(self, actions: dict[str, dict[str, Any]]) -> Actions:
        arguments.known(actions, self.possible_agents, "agent")
        told = self._episodes.idle()
        for i, agent in enumerate(self.possible_agents):
            if agent not in actions:
                raise ValueError(f"every agent needs an action in every step, and {agent!r} has none")
            action = actions[agent]
            if not isinstance(action, dict):
                raise ValueError(f"the action of {agent} is a dictionary, not {type(action).__name__}")
            arguments.known(action, self.action_spaces[agent].spaces, f"part of the action of {agent}")
            if "wheels" in action:
                told.wheels[0, i] = arguments.array_of(action["wheels"], f"wheels of {agent}", (2,))
            if "led" in action:
                n_colours = int(self.action_spaces[agent]["led"].n)
                told.leds[0, i] = arguments.whole(_scalar(action["led"]), f"led of {agent}", 0, n_colours - 1)
            if "send" in action:
                told.sends[0, i] = arguments.whole(_scalar(action["send"]), f"send of {agent}", 0, 1)
            if "message" in action:
                shape = (self._episodes.message_len,)
                told.messages[0, i] = arguments.array_of(action["message"], f"message of {agent}", shape)
        return told

    def __copy__(self) -> SwarmEnv:
        copied = object.__new__(type(self))
        copied.__dict__ |= self.__dict__ | {"agents": list(self.agents), "_episodes": copy(self._episodes)}
        return copied

    def render(self) -> None:
        """Does nothing; :meth:`Trace.show` plays the behaviour of a network."""

    def close(self) -> None:
        """Ends the episode."""
        self.agents = []

    def __repr__(self) -> str:
        return f"<SwarmEnv of {self._experiment.name!r}: {len(self.possible_agents)} agents>"


def _scalar(value: Any) -> Any:
    """A whole number that may be a truth value, or wrapped in an array of one element."""
    if isinstance(value, (bool, np.bool_)):
        return int(value)
    return value.reshape(())[()] if isinstance(value, np.ndarray) and value.size == 1 else value


def _n_colours(topology: dict[str, Any]) -> int:
    """Colours of LEDs, off included, that the network can choose from."""
    n_colours = 2
    for name, output in topology["outputs"].items():
        chooses = topology["decoding"].get(name, {}).get("scheme") in CHOOSING
        if output["actuator"] == "led_actuator" and chooses:
            n_colours = max(n_colours, topology["ensembles"][output["ensemble"]]["n"])
    return n_colours
