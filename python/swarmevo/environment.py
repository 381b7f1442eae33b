"""Experiments as environments of PettingZoo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .episodes import Actions, Episodes
from .trials import TrialSet

if TYPE_CHECKING:
    from pettingzoo import ParallelEnv

    from .experiment import Experiment

GENERATIONS_MAX = 10_000_000
"""Trial sets that seeds choose from."""


def parallel_env(experiment: Experiment) -> ParallelEnv[str, NDArray[np.float32], dict[str, Any]]:
    """An experiment as a PettingZoo ``ParallelEnv``: an agent per robot with a network.

    Observations are the stimuli of the robot's controller, ``[I]`` float32. Actions are
    dictionaries with what the robot has: ``wheels`` (right and left, in [-1, 1]), ``led``,
    ``send`` (1 its own message, 0 relay) and ``message`` (in [0, 1], before quantisation). All
    agents get the fitness of the step as reward, 0 where it does not count. Episodes are
    truncated after ``experiment.n_steps``.

    ``reset(seed=s)`` begins with trial 0 of the trial set of generation s, and every further
    ``reset()`` goes on to that of the next; ``options={"generation": g, "trial": t}``, with a
    number or a :class:`TrialSet`, chooses one.
    """
    import gymnasium.spaces as spaces
    from pettingzoo import ParallelEnv

    class SwarmEnv(ParallelEnv[str, NDArray[np.float32], dict[str, Any]]):  # type: ignore[misc]
        metadata = {"name": f"swarmevo_{experiment.name}", "render_modes": []}
        render_mode = None

        def __init__(self) -> None:
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
                agent: spaces.Box(-np.inf, np.inf, (n_inputs,), np.float32)
                for agent in self.possible_agents
            }
            n_colours = _n_colours(config["topology"])
            self.action_spaces = {
                agent: self._action_space(robot["actuators"], n_colours)
                for agent, robot in self._robots.items()
            }

        def _action_space(self, actuators: dict[str, Any], n_colours: int) -> spaces.Dict:
            parts: dict[str, spaces.Space[Any]] = {}
            if actuators.get("wheel_actuator") is not None:
                parts["wheels"] = spaces.Box(-1.0, 1.0, (2,), np.float64)
            if actuators.get("led_actuator") is not None:
                parts["led"] = spaces.Discrete(n_colours)
            if actuators.get("wireless_transmitter") is not None:
                parts["send"] = spaces.Discrete(2)
                parts["message"] = spaces.Box(
                    0.0, 1.0, (self._episodes.message_len,), np.float64
                )
            return spaces.Dict(parts)

        def observation_space(self, agent: str) -> spaces.Space[Any]:
            return self.observation_spaces[agent]

        def action_space(self, agent: str) -> spaces.Space[Any]:
            return self.action_spaces[agent]

        def reset(
            self, seed: int | None = None, options: dict[str, Any] | None = None
        ) -> tuple[dict[str, NDArray[np.float32]], dict[str, dict[str, Any]]]:
            if seed is not None:
                self._next_generation = seed
            options = options or {}
            trial_set = TrialSet.of(
                options.get("generation", self._next_generation % GENERATIONS_MAX)
            )
            trial = options.get("trial", 0)
            self._next_generation += 1
            self._episodes = experiment.episodes(trial_set, trials=range(trial, trial + 1))
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
            told = self._episodes.idle()
            for i, agent in enumerate(self.possible_agents):
                action = actions[agent]
                if "wheels" in action:
                    told.wheels[0, i] = action["wheels"]
                told.leds[0, i] = action.get("led", 0)
                told.sends[0, i] = bool(action.get("send", 1))
                if "message" in action:
                    told.messages[0, i] = action["message"]
            return told

        def render(self) -> None:
            """Nothing; :meth:`Trace.show` plays what a network does."""

        def close(self) -> None:
            self.agents = []

    return SwarmEnv()


def _n_colours(topology: dict[str, Any]) -> int:
    """Colours of LEDs, off included, that the network can choose from."""
    n_colours = 2
    for name, output in topology["outputs"].items():
        chooses = topology["decoding"].get(name, {}).get("scheme") == "SoftmaxDecoding"
        if output["actuator"] == "led_actuator" and chooses:
            n_colours = max(n_colours, topology["ensembles"][output["ensemble"]]["n"])
    return n_colours
