"""What would have happened, had one robot said something else.

Every draw of noise has an address, so that an episode in which one message is another one shares all
draws with the episode as it was: what differs afterwards was caused by that message, exactly, without
estimates. It is the causal influence of communication of Lowe et al. (2019), for a single message.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..episodes import Actions, Episodes
from ..experiment import Experiment
from ..trials import AnyTrialSet, TrialSet

Replacement = Union[Literal["freeze", "permute"], ArrayLike]


@dataclass(frozen=True)
class Influence:
    """What single messages did. Axes: T trials, K steps, A agents that said them."""

    steps: list[int]
    """``[K]``: the steps in which messages were replaced."""
    agents: list[int]
    """``[A]``: the robots that said them, by their numbers among all robots."""
    said: NDArray[np.bool_]
    """``[T, K, A]``: whether there was a message to replace: the robot sent its own, and the
    replacement is another one (before both are quantised to symbols)."""
    reached: NDArray[np.int64]
    """``[T, K, A]``: how many other agents did anything otherwise, by a bit, within the window."""
    leds: NDArray[np.int64]
    """``[T, K, A]``: over how many agents and steps of the window another agent's LED was otherwise."""
    fitness: NDArray[np.float64]
    """``[T, K, A]``: mean fitness of the window's steps minus what it was; 0 where no step counts."""


def influence(
    experiment: Experiment,
    genotype: ArrayLike,
    steps: Iterable[int],
    *,
    replace: Replacement = 0.0,
    agents: Iterable[int] | None = None,
    trials: int = 20,
    trial_set: AnyTrialSet | None = None,
    window: int = 10,
) -> Influence:
    """Replaces the message of one agent in one step, once for each of ``steps`` and of ``agents`` (indices
    among the agents; all if absent), and looks at the ``window`` steps after it.

    ``replace``: the message instead, ``[M]`` or one number for all its values; ``"freeze"``, what the
    agent would have said in the step before; ``"permute"``, what the next agent says.
    """
    where = TrialSet.evaluation() if trial_set is None else trial_set
    episodes = experiment.episodes(where, trials=trials)
    chosen = list(range(len(episodes.agents))) if agents is None else list(agents)
    times = list(steps)
    if not times or min(times) < 0 or max(times) + 1 >= experiment.n_steps:
        raise ValueError(f"steps from 0 to {experiment.n_steps - 2}, which have a step after them: {times}")
    if episodes.message_len == 0:
        raise ValueError("agents without radio have no messages")
    shape = (trials, len(times), len(chosen))
    said, reached, leds = np.zeros(shape, bool), np.zeros(shape, int), np.zeros(shape, int)
    fitness = np.zeros(shape)
    real = _Course(experiment.n_steps)
    real.run(episodes, genotype)
    for k, step in enumerate(times):
        for a, agent in enumerate(chosen):
            if not 0 <= agent < len(episodes.agents):
                raise ValueError(f"agents are numbered from 0 to {len(episodes.agents) - 1}, not {agent}")
            course = _Course(min(experiment.n_steps, step + 1 + window))
            said[:, k, a] = course.run(experiment.episodes(where, trials=trials), genotype, (step, agent, replace))
            others = [i for i in range(len(episodes.agents)) if i != agent]
            after = slice(step + 1, course.end)
            otherwise = course.differs(real, after)[:, :, others]
            reached[:, k, a] = otherwise.any(axis=0).sum(axis=-1)
            leds[:, k, a] = (course.leds[after] != real.leds[after])[:, :, others].sum(axis=(0, 2))
            fitness[:, k, a] = course.worth(after) - real.worth(after)
    return Influence(times, [episodes.agents[agent] for agent in chosen], said, reached, leds, fitness)


class _Course:
    """The actions of an episode up to some step, in all its trials."""

    def __init__(self, end: int) -> None:
        self.end = end
        self._actions: list[Actions] = []
        self._fitness: list[NDArray[np.float64]] = []

    def run(
        self, episodes: Episodes, genotype: ArrayLike, change: tuple[int, int, Replacement] | None = None
    ) -> NDArray[np.bool_]:
        """Runs them; returns in which trials ``change`` (step, agent, message) changed anything."""
        episodes.load(genotype)
        changed = np.zeros(episodes.n_trials, bool)
        for step in range(self.end):
            actions = episodes.decide()
            self._actions.append(actions)
            if change is not None and change[0] == step:
                _, agent, replacement = change
                messages = actions.messages.copy()
                messages[:, agent] = self._instead(messages, agent, replacement)
                changed = actions.sends[:, agent] & (messages[:, agent] != actions.messages[:, agent]).any(axis=-1)
                actions = Actions(actions.wheels, actions.leds, actions.sends, messages)
            self._fitness.append(episodes.step(actions))
        self.leds = np.stack([it.leds for it in self._actions])
        return changed

    def _instead(self, messages: NDArray[np.float64], agent: int, replacement: Replacement) -> NDArray[np.float64]:
        if isinstance(replacement, str):
            if replacement == "freeze":
                return self._actions[max(0, len(self._actions) - 2)].messages[:, agent]
            if replacement == "permute":
                return messages[:, (agent + 1) % messages.shape[1]]
            raise ValueError(f'replace is a message, "freeze" or "permute", not {replacement!r}')
        return np.broadcast_to(np.asarray(replacement, dtype=np.float64), messages[:, agent].shape)

    def differs(self, other: _Course, steps: slice) -> NDArray[np.bool_]:
        """``[steps, T, A]``: who does anything otherwise."""
        pairs = zip(self._actions[steps], other._actions[steps])
        return np.stack([
            (mine.wheels != its.wheels).any(axis=-1)
            | (mine.leds != its.leds)
            | (mine.sends != its.sends)
            | (mine.messages != its.messages).any(axis=-1)
            for mine, its in pairs
        ])

    def worth(self, steps: slice) -> NDArray[np.float64]:
        values = np.stack(self._fitness[steps])
        counts = ~np.isnan(values)
        return np.asarray(np.where(counts, values, 0).sum(axis=0) / np.maximum(counts.sum(axis=0), 1))
