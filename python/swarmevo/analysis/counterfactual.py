"""Counterfactuals: what would have happened if one robot had sent another message?

Every draw of noise has an address, so an episode with one replaced message shares all draws with the
original episode: that message caused every later difference, exactly and without estimates. This is the
causal influence of communication of Lowe et al. (2019), for a single message. The readings of a single
robot can be replaced likewise.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..episodes import Actions, Episodes
from .. import arguments
from ..champion import Genes
from ..experiment import Experiment
from ..trials import TRIALS_MAX, AnyTrialSet, TrialSet
from ..representation import short

Replacement = Union[Literal["freeze", "permute", "silence"], ArrayLike]


@dataclass(frozen=True)
class Influence:
    """The effects of single messages. Axes: T trials, K steps, A agents that sent them."""

    steps: list[int]
    """``[K]``: the steps in which messages were replaced."""
    agents: list[int]
    """``[A]``: the robots that sent them, by their numbers among all robots."""
    said: NDArray[np.bool_]
    """``[T, K, A]``: whether a message was replaced: the robot sent its own, and the replacement differs
    (before both are quantised to symbols). With ``"silence"``, always true."""
    reached: NDArray[np.int64]
    """``[T, K, A]``: number of other agents whose actions differ, by at least a bit, within the
    window."""
    leds: NDArray[np.int64]
    """``[T, K, A]``: number of agents and steps of the window in which another agent's LED differs."""
    fitness: NDArray[np.float64]
    """``[T, K, A]``: change of the mean fitness of the window's steps; 0 if no step counts."""

    __repr__ = short


def influence(
    experiment: Experiment,
    genotype: Genes,
    steps: Iterable[int],
    *,
    replace: Replacement = 0.0,
    lasting: int = 1,
    agents: Iterable[int] | None = None,
    trials: int = 20,
    trial_set: AnyTrialSet | None = None,
    window: int = 10,
) -> Influence:
    """Replaces the message of one agent in one step, once for each of ``steps`` and of ``agents`` (indices
    among the agents; all if absent), and measures the ``window`` steps after it.

    ``replace``: the new message, ``[M]`` or one number for all its values; ``"freeze"``, the agent's message
    of the previous step; ``"permute"``, the message of the next agent; ``"silence"``, no frame, not even a
    relayed one, so that receivers hear the next strongest emitter. ``lasting``: the number of
    steps that the replacement lasts, within the window.
    """
    case = _Case(experiment, genotype, steps, agents, trials, trial_set, window, lasting)
    if case.message_len == 0:
        raise ValueError("agents without radio have no messages")
    said, reached, leds = (np.zeros(case.shape, kind) for kind in (bool, int, int))
    fitness = np.zeros(case.shape)
    for place, step, agent in case.places():
        course = case.run(_Said(step, agent, replace, lasting))
        said[place] = course.changed
        after = slice(step + 1, course.end)
        others = case.others(agent)
        reached[place] = course.differs(case.real, after)[:, :, others].any(axis=0).sum(axis=-1)
        leds[place] = course.other_leds(case.real, after)[:, :, others].sum(axis=(0, 2))
        fitness[place] = course.worth(after) - case.real.worth(after)
    return Influence(case.steps, case.robots, said, reached, leds, fitness)


@dataclass(frozen=True)
class Attention:
    """The effects of single readings. Axes: T trials, K steps, A agents that sensed them."""

    steps: list[int]
    """``[K]``: the first steps in which readings were replaced."""
    agents: list[int]
    """``[A]``: the robots that sensed them, by their numbers among all robots."""
    sensed: NDArray[np.bool_]
    """``[T, K, A]``: whether the replacement differs from the reading."""
    heeded: NDArray[np.bool_]
    """``[T, K, A]``: whether the robot's own actions differ, by at least a bit, from that step on."""
    leds: NDArray[np.int64]
    """``[T, K, A]``: number of steps in which its own LED differs."""
    reached: NDArray[np.int64]
    """``[T, K, A]``: number of other agents whose actions differ."""
    fitness: NDArray[np.float64]
    """``[T, K, A]``: change of the mean fitness of these steps; 0 if no step counts."""

    __repr__ = short


def attention(
    experiment: Experiment,
    genotype: Genes,
    steps: Iterable[int],
    *,
    sensor: str = "wireless_receiver",
    replace: Replacement = 0.0,
    lasting: int = 1,
    agents: Iterable[int] | None = None,
    trials: int = 20,
    trial_set: AnyTrialSet | None = None,
    window: int = 10,
) -> Attention:
    """Replaces a reading of one agent, once for each of ``steps`` and of ``agents`` (indices among the
    agents; all if absent), and measures that step and the ``window`` after it: the hearer's side of
    :func:`influence`. Its radio still relays the received message; inhibited inputs stay inhibited.

    ``sensor``: ``wireless_receiver`` for all inputs from the radio, ``wireless_receiver:msg`` for one of them,
    another sensor of the network, or ``all``. ``replace``: a number, or the values ``[C]`` of these C inputs;
    ``"freeze"``, their values of the previous step; ``"permute"``, the readings of the next agent.
    ``lasting``: the number of steps that the replacement lasts, within the window.
    """
    case = _Case(experiment, genotype, steps, agents, trials, trial_set, window, lasting)
    columns = input_columns(experiment, sensor)
    sensed, heeded = np.zeros(case.shape, bool), np.zeros(case.shape, bool)
    leds, reached = np.zeros(case.shape, int), np.zeros(case.shape, int)
    fitness = np.zeros(case.shape)
    for place, step, agent in case.places():
        course = case.run(_Sensed(step, agent, columns, replace, lasting))
        sensed[place] = course.changed
        since = slice(step, course.end)
        otherwise = np.asarray(course.differs(case.real, since).any(axis=0))
        heeded[place] = otherwise[:, agent]
        leds[place] = course.other_leds(case.real, since)[:, :, agent].sum(axis=0)
        reached[place] = otherwise[:, case.others(agent)].sum(axis=-1)
        fitness[place] = course.worth(since) - case.real.worth(since)
    return Attention(case.steps, case.robots, sensed, heeded, leds, reached, fitness)


def input_columns(experiment: Experiment, sensor: str) -> list[int]:
    """The inputs of a network that a sensor, or one of its readings, feeds; all inputs for ``all``."""
    stimuli = [it for it in experiment.to_dict()["topology"]["stimuli"].values() for _ in range(it["n"])]
    names = [it["sensor"] for it in stimuli]
    found = [i for i, name in enumerate(names) if sensor in ("all", name) or name.startswith(f"{sensor}:")]
    if not found:
        raise ValueError(f"no input comes from {sensor!r}; there are {', '.join(dict.fromkeys(names))}")
    return found


class _Case:
    """The requested counterfactuals, and the original episodes."""

    def __init__(
        self, experiment: Experiment, genotype: Genes, steps: Iterable[int], agents: Iterable[int] | None,
        trials: int, trial_set: AnyTrialSet | None, window: int, lasting: int,
    ) -> None:
        window = arguments.whole(window, "window", 0)
        trials = arguments.whole(trials, "trials", 1, TRIALS_MAX)
        if not 1 <= arguments.whole(lasting, "lasting") <= window + 1:
            raise ValueError(f"lasting is from 1 to {window + 1}, the step and its window, not {lasting}")
        self._experiment, self._genotype = experiment, experiment._genotype(genotype)
        self._trials, self._window = trials, window
        self._where = TrialSet.evaluation() if trial_set is None else trial_set
        episodes = self._episodes()
        self.message_len = episodes.message_len
        self.steps = [arguments.whole(step, "a step") for step in steps]
        self._n_agents = len(episodes.agents)
        self._chosen = list(range(self._n_agents)) if agents is None else [arguments.whole(it, "an agent", -arguments.SIZE_MAX) for it in agents]
        if not self.steps or min(self.steps) < 0 or max(self.steps) + 1 >= experiment.n_steps:
            raise ValueError(f"steps are numbered from 0 to {experiment.n_steps - 2}, the last but one, not {self.steps}")
        wrong = [agent for agent in self._chosen if not 0 <= agent < self._n_agents]
        if wrong:
            raise ValueError(f"agents are numbered from 0 to {self._n_agents - 1}, not {', '.join(map(str, wrong))}")
        self.robots = [episodes.agents[agent] for agent in self._chosen]
        self.shape = (trials, len(self.steps), len(self._chosen))
        self.real = _Course(experiment.n_steps)
        self.real.run(episodes, self._genotype)

    def places(self) -> Iterator[tuple[tuple[slice, int, int], int, int]]:
        """The place of the results of a step and an agent."""
        for k, step in enumerate(self.steps):
            for a, agent in enumerate(self._chosen):
                yield (slice(None), k, a), step, agent

    def run(self, change: _Said | _Sensed) -> _Course:
        course = _Course(min(self._experiment.n_steps, change.step + 1 + self._window))
        course.run(self._episodes(), self._genotype, change)
        return course

    def others(self, agent: int) -> list[int]:
        return [i for i in range(self._n_agents) if i != agent]

    def _episodes(self) -> Episodes:
        return self._experiment.episodes(self._where, trials=self._trials)


class _Course:
    """The actions of an episode up to some step, in all its trials."""

    def __init__(self, end: int) -> None:
        self.end = end
        self._actions: list[Actions] = []
        self._fitness: list[NDArray[np.float64]] = []

    def run(self, episodes: Episodes, genotype: ArrayLike, change: _Said | _Sensed | None = None) -> None:
        """Runs the episodes. ``changed`` ``[T]`` tells whether ``change`` had an effect in each trial."""
        episodes.load(genotype)
        self.changed = np.zeros(episodes.n_trials, bool)
        for step in range(self.end):
            if isinstance(change, _Sensed):
                self.changed |= change.stimulate(episodes, step)
            actions = episodes.decide()
            self._actions.append(actions)
            if isinstance(change, _Said):
                fitness, changed = change.step_with(episodes, step, actions)
                self.changed |= changed
            else:
                fitness = episodes.step(actions)
            self._fitness.append(fitness)
        self.leds = np.stack([it.leds for it in self._actions])

    def differs(self, other: _Course, steps: slice) -> NDArray[np.bool_]:
        """``[steps, T, A]``: whether an agent's actions differ."""
        pairs = zip(self._actions[steps], other._actions[steps])
        return np.stack([
            (mine.wheels != its.wheels).any(axis=-1)
            | (mine.leds != its.leds)
            | (mine.sends != its.sends)
            | (mine.messages != its.messages).any(axis=-1)
            for mine, its in pairs
        ])

    def other_leds(self, other: _Course, steps: slice) -> NDArray[np.bool_]:
        """``[steps, T, A]``: whether an agent's LED differs."""
        return np.asarray(self.leds[steps] != other.leds[steps])

    def worth(self, steps: slice) -> NDArray[np.float64]:
        values = np.stack(self._fitness[steps])
        counts = ~np.isnan(values)
        return np.asarray(np.where(counts, values, 0).sum(axis=0) / np.maximum(counts.sum(axis=0), 1))


class _Said:
    """Another message of one agent, or none, from one step on."""

    def __init__(self, step: int, agent: int, replacement: Replacement, lasting: int) -> None:
        self.step = step
        self._agent, self._replacement, self._lasting = agent, replacement, lasting
        self._is_silence = isinstance(replacement, str) and replacement == "silence"
        self._before: NDArray[np.float64] | None = None

    def step_with(self, episodes: Episodes, step: int, actions: Actions) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Takes a step, with the new message if it is due. Returns its fitness, and the trials in which the
        emissions differ."""
        said = actions.messages
        if self._before is None and step >= self.step - 1:
            self._before = said
        if self._before is None or not self.step <= step < self.step + self._lasting:
            return episodes.step(actions), np.zeros(episodes.n_trials, bool)
        if self._is_silence:
            silent = np.zeros_like(actions.sends)
            silent[:, self._agent] = True
            episodes.silence(silent)
            return episodes.step(actions), np.ones(episodes.n_trials, bool)
        messages = said.copy()
        messages[:, self._agent] = _instead(self._replacement, self._agent, said, self._before)
        fitness = episodes.step(Actions(actions.wheels, actions.leds, actions.sends, messages))
        return fitness, episodes.sent[:, self._agent] & (messages != said).any(axis=(1, 2))


class _Sensed:
    """Other inputs of one agent, from one step on."""

    def __init__(self, step: int, agent: int, columns: list[int], replacement: Replacement, lasting: int) -> None:
        self.step = step
        self._agent, self._columns, self._replacement, self._lasting = agent, columns, replacement, lasting
        self._before: NDArray[np.float64] | None = None

    def stimulate(self, episodes: Episodes, step: int) -> NDArray[np.bool_]:
        """Replaces the agent's inputs if due; returns the trials in which they differ."""
        if not self.step - 1 <= step < self.step + self._lasting:
            return np.zeros(episodes.n_trials, bool)
        stimuli = episodes.stimuli
        values = stimuli[..., self._columns].astype(np.float64)
        if self._before is None:
            self._before = values
        if step < self.step:
            return np.zeros(episodes.n_trials, bool)
        changed = stimuli.copy()
        changed[:, self._agent, self._columns] = _instead(self._replacement, self._agent, values, self._before)
        episodes.stimuli = changed
        # Read again, because inhibited inputs keep their values.
        return np.asarray((episodes.stimuli != stimuli)[:, self._agent, self._columns].any(axis=-1))


def _instead(
    replacement: Replacement, agent: int, values: NDArray[np.float64], before: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The replacement of an agent's ``values`` ``[T, A, C]``, as ``[T, C]``; ``before``: the values of the
    previous step."""
    if isinstance(replacement, str):
        if replacement == "freeze":
            return before[:, agent]
        if replacement == "permute":
            return values[:, (agent + 1) % values.shape[1]]
        raise ValueError(f'replace is a number, values, "freeze", "permute" or, of messages, "silence", not {replacement!r}')
    return np.broadcast_to(np.asarray(replacement, dtype=np.float64), values[:, agent].shape)
