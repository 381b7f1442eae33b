"""What would have happened, had one robot said something else.

Every draw of noise has an address, so that an episode in which one message is another one shares all
draws with the episode as it was: what differs afterwards was caused by that message, exactly, without
estimates. It is the causal influence of communication of Lowe et al. (2019), for a single message; the same
is asked of what a single robot senses.
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
    """What single messages did. Axes: T trials, K steps, A agents that said them."""

    steps: list[int]
    """``[K]``: the steps in which messages were replaced."""
    agents: list[int]
    """``[A]``: the robots that said them, by their numbers among all robots."""
    said: NDArray[np.bool_]
    """``[T, K, A]``: whether there was a message to replace: the robot sent its own, and the
    replacement is another one (before both are quantised to symbols). With ``"silence"``, everywhere."""
    reached: NDArray[np.int64]
    """``[T, K, A]``: how many other agents did anything otherwise, by a bit, within the window."""
    leds: NDArray[np.int64]
    """``[T, K, A]``: over how many agents and steps of the window another agent's LED was otherwise."""
    fitness: NDArray[np.float64]
    """``[T, K, A]``: mean fitness of the window's steps minus what it was; 0 where no step counts."""

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
    among the agents; all if absent), and looks at the ``window`` steps after it.

    ``replace``: the message instead, ``[M]`` or one number for all its values; ``"freeze"``, what the
    agent would have said in the step before; ``"permute"``, what the next agent says; ``"silence"``, nothing: the
    agent emits no frame, not even one that it relays, so that others are heard where it was the loudest.
    ``lasting``: for how many steps, within the window.
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
    """What single things that were sensed did. Axes: T trials, K steps, A agents that sensed them."""

    steps: list[int]
    """``[K]``: the steps from which on they were replaced."""
    agents: list[int]
    """``[A]``: the robots that sensed them, by their numbers among all robots."""
    sensed: NDArray[np.bool_]
    """``[T, K, A]``: whether there was anything to replace: the replacement is something else."""
    heeded: NDArray[np.bool_]
    """``[T, K, A]``: whether the robot itself did anything otherwise, by a bit, from that step on."""
    leds: NDArray[np.int64]
    """``[T, K, A]``: in how many steps its own LED was otherwise."""
    reached: NDArray[np.int64]
    """``[T, K, A]``: how many other agents did anything otherwise."""
    fitness: NDArray[np.float64]
    """``[T, K, A]``: mean fitness of these steps minus what it was; 0 where no step counts."""

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
    """Replaces what one agent senses, once for each of ``steps`` and of ``agents`` (indices among the
    agents; all if absent), and looks at that step and the ``window`` after it: the hearer's side of
    :func:`influence`. Its radio still relays what it heard; what is inhibited stays so.

    ``sensor``: ``wireless_receiver`` for all inputs from the radio, ``wireless_receiver:msg`` for one of them,
    another sensor of the network, or ``all``. ``replace``: a number, or the values ``[C]`` of these C inputs;
    ``"freeze"``, what they were in the step before; ``"permute"``, what the next agent senses.
    ``lasting``: for how many steps, within the window.
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
    """The inputs of a network that a sensor, or one of its readings, feeds; those of ``all``."""
    stimuli = [it for it in experiment.to_dict()["topology"]["stimuli"].values() for _ in range(it["n"])]
    names = [it["sensor"] for it in stimuli]
    found = [i for i, name in enumerate(names) if sensor in ("all", name) or name.startswith(f"{sensor}:")]
    if not found:
        raise ValueError(f"no input comes from {sensor!r}; there are {', '.join(dict.fromkeys(names))}")
    return found


class _Case:
    """Which counterfactuals are asked for, and the episodes as they were."""

    def __init__(
        self, experiment: Experiment, genotype: Genes, steps: Iterable[int], agents: Iterable[int] | None,
        trials: int, trial_set: AnyTrialSet | None, window: int, lasting: int,
    ) -> None:
        window = arguments.whole(window, "window", 0)
        trials = arguments.whole(trials, "trials", 1, TRIALS_MAX)
        if not 1 <= arguments.whole(lasting, "lasting") <= window + 1:
            raise ValueError(f"lasting from 1 to {window + 1}, the step and its window, not {lasting}")
        self._experiment, self._genotype = experiment, experiment._genotype(genotype)
        self._trials, self._window = trials, window
        self._where = TrialSet.evaluation() if trial_set is None else trial_set
        episodes = self._episodes()
        self.message_len = episodes.message_len
        self.steps = [arguments.whole(step, "a step") for step in steps]
        self._n_agents = len(episodes.agents)
        self._chosen = list(range(self._n_agents)) if agents is None else [arguments.whole(it, "an agent", -arguments.SIZE_MAX) for it in agents]
        if not self.steps or min(self.steps) < 0 or max(self.steps) + 1 >= experiment.n_steps:
            raise ValueError(f"steps from 0 to {experiment.n_steps - 2}, which have a step after them: {self.steps}")
        wrong = [agent for agent in self._chosen if not 0 <= agent < self._n_agents]
        if wrong:
            raise ValueError(f"agents are numbered from 0 to {self._n_agents - 1}, not {', '.join(map(str, wrong))}")
        self.robots = [episodes.agents[agent] for agent in self._chosen]
        self.shape = (trials, len(self.steps), len(self._chosen))
        self.real = _Course(experiment.n_steps)
        self.real.run(episodes, self._genotype)

    def places(self) -> Iterator[tuple[tuple[slice, int, int], int, int]]:
        """Where the results of a step and an agent belong."""
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
        """Runs them. ``changed`` is then in which trials ``change`` changed anything, ``[T]``."""
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
        """``[steps, T, A]``: who does anything otherwise."""
        pairs = zip(self._actions[steps], other._actions[steps])
        return np.stack([
            (mine.wheels != its.wheels).any(axis=-1)
            | (mine.leds != its.leds)
            | (mine.sends != its.sends)
            | (mine.messages != its.messages).any(axis=-1)
            for mine, its in pairs
        ])

    def other_leds(self, other: _Course, steps: slice) -> NDArray[np.bool_]:
        """``[steps, T, A]``: whose LED is otherwise."""
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
        """A step with it, if it is time. Its fitness, and in which trials something else was on the air."""
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
        """Has the agent sense it, if it is time; returns in which trials it is something else."""
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
        # Read again: what is inhibited is as it was.
        return np.asarray((episodes.stimuli != stimuli)[:, self._agent, self._columns].any(axis=-1))


def _instead(
    replacement: Replacement, agent: int, values: NDArray[np.float64], before: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What an agent has instead of its ``values`` ``[T, A, C]``, ``[T, C]``; ``before``: a step before."""
    if isinstance(replacement, str):
        if replacement == "freeze":
            return before[:, agent]
        if replacement == "permute":
            return values[:, (agent + 1) % values.shape[1]]
        raise ValueError(f'replace is a number, values, "freeze", "permute" or, of messages, "silence", not {replacement!r}')
    return np.broadcast_to(np.asarray(replacement, dtype=np.float64), values[:, agent].shape)
