"""Episodes step by step: stimuli out, actions in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, arguments
from .champion import Genes
from .representation import short

if TYPE_CHECKING:
    from .experiment import Experiment

Floats = NDArray[np.float64]


@dataclass
class Actions:
    """What A agents do in one step of T trials."""

    wheels: Floats
    """``[T, A, 2]``: right and left wheel, in [-1, 1]."""
    leds: NDArray[np.uint32]
    """``[T, A]``: colour of the LED, 0 off."""
    sends: NDArray[np.bool_]
    """``[T, A]``: whether it sends its own message; else it relays."""
    messages: Floats
    """``[T, A, M]``: the message before quantisation, in [0, 1]."""

    __repr__ = short


class Episodes:
    """T trials side by side, whose robots with a network, the A *agents*, do what they are
    told. Robots with another controller decide for themselves. Use
    :meth:`Experiment.episodes`.

    >>> from swarmevo import Experiment
    >>> exp = Experiment.quickstart()
    >>> genotype = np.full(exp.n_genes, 0.5)
    >>> episodes = exp.episodes(generation=3)
    >>> episodes.load(genotype)
    >>> while not episodes.is_over:
    ...     step_fitness = episodes.step(episodes.decide())
    >>> bool(np.array_equal(episodes.fitness, exp.evaluate(genotype, 3)))
    True
    """

    def __init__(
        self,
        experiment: Experiment,
        where: tuple[str, int, int, int, int],
        core: _core.Episodes,
    ) -> None:
        self.experiment = experiment
        """What is simulated."""
        self.n_trials: int = where[4] - where[3]
        """T"""
        self._where = where
        self._thread = core
        self._past = Past()
        self.agents: list[int] = core.agents
        """The numbers of the A agents among all robots."""
        self.n_inputs: int = core.n_inputs
        """I"""
        self.message_len: int = core.message_len
        """M; 0 without radio."""
        self.n_steps_done = 0
        """Environment steps taken."""

    @property
    def _core(self) -> _core.Episodes:
        """The simulation, on a thread of its own; in a process that was forked, a new one of the same past."""
        if self._thread.is_left:
            self._thread = self._past.again(self.experiment._core.episodes(self._where))
        return self._thread

    def __reduce__(self) -> tuple[Any, ...]:
        return (_begin, (self.experiment, self._where), (self._past, self.n_steps_done))

    def __setstate__(self, state: tuple[Past, int]) -> None:
        past, self.n_steps_done = state
        self._past = past.copy()
        self._thread = past.again(self._thread)

    def __deepcopy__(self, _: dict[int, Any]) -> Episodes:
        return self.__copy__()

    def __copy__(self) -> Episodes:
        copied = _begin(self.experiment, self._where)
        copied.__setstate__((self._past, self.n_steps_done))
        return copied

    def __repr__(self) -> str:
        return (
            f"<Episodes of {self.experiment.name!r}: {self.n_trials} trials, {len(self.agents)} agents, "
            f"{self.n_steps_done} of {self.experiment.n_steps} steps done>"
        )

    @property
    def is_over(self) -> bool:
        """Whether all steps are taken."""
        return self.n_steps_done == self.experiment.n_steps

    @property
    def stimuli(self) -> NDArray[np.float32]:
        """``[T, A, I]``: what the agents get in this step; after the end, in the last one."""
        stimuli = self._core.stimuli()
        return stimuli.reshape(self.n_trials, len(self.agents), self.n_inputs)

    @stimuli.setter
    def stimuli(self, stimuli: ArrayLike) -> None:
        """Has the agents get this instead in this step: what :meth:`decide` sees. Radios still relay what
        they heard; what is set for inputs that an agent has not does not matter, and what is inhibited stays 0."""
        shape = (self.n_trials, len(self.agents), self.n_inputs)
        # NaN is what inputs have that an agent has not.
        values = arguments.array_of(stimuli, "stimuli", shape, np.float32).reshape(-1)
        self._core.set_stimuli(values)
        self._past.add("set_stimuli", values)

    @property
    def sent(self) -> NDArray[np.bool_]:
        """``[T, A]``: which agents sent their own message in the step before. That is what their actions said,
        but for the first steps, in which all send, and for robots that fail."""
        return self._core.sent().reshape(self.n_trials, len(self.agents))

    def silence(self, silent: ArrayLike) -> None:
        """``[T, A]``: has these agents emit nothing in this step, neither their own message nor one that they
        relay. Hearers get the next strongest frame."""
        shape = (self.n_trials, len(self.agents))
        values = arguments.array_of(silent, "who is silent", shape, np.bool_).reshape(-1)
        self._core.silence(values)
        self._past.add("silence", values)

    def idle(self) -> Actions:
        """Actions of agents that stand, with the LED off, and send zeros."""
        shape = (self.n_trials, len(self.agents))
        return Actions(
            np.zeros((*shape, 2)),
            np.zeros(shape, np.uint32),
            np.ones(shape, np.bool_),
            np.zeros((*shape, self.message_len)),
        )

    def step(self, actions: Actions) -> Floats:
        """One step. Returns its fitness ``[T]``, NaN where it does not count."""
        if not isinstance(actions, Actions):
            raise ValueError(f"a step takes Actions, such as decide() and idle() give, not {type(actions).__name__}")
        shape = (self.n_trials, len(self.agents))
        told = (
            arguments.array_of(actions.wheels, "wheels", (*shape, 2)).reshape(-1),
            arguments.array_of(actions.leds, "leds", shape, np.uint32).reshape(-1),
            arguments.array_of(actions.sends, "sends", shape, np.bool_).reshape(-1),
            arguments.array_of(actions.messages, "messages", (*shape, self.message_len)).reshape(-1),
        )
        fitness = self._core.step(*told)
        self._past.step(told)
        self.n_steps_done += 1
        return fitness

    def load(self, genotype: Genes) -> None:
        """Makes the network of a genotype ``[d]``, or of a champion, ready for :meth:`decide`, at rest."""
        genes = self.experiment._genotype(genotype)
        self._core.load(genes)
        self._past.add("load", genes)

    def decide(self) -> Actions:
        """What the loaded network has the agents do. Asked once in each step, it gives the
        bits of :meth:`Experiment.simulate`."""
        decided = self._core.decide()
        self._past.decide(decided)
        wheels, leds, sends, messages = decided
        shape = (self.n_trials, len(self.agents))
        return Actions(
            wheels.reshape(*shape, 2).copy(),
            leds.reshape(shape).copy(),
            sends.reshape(shape).copy(),
            messages.reshape(*shape, self.message_len).copy(),
        )

    @property
    def fitness(self) -> Floats:
        """``[T]``: of each trial so far, the mean over the steps that count."""
        return self._core.fitness()


def _begin(experiment: Experiment, where: tuple[str, int, int, int, int]) -> Episodes:
    return Episodes(experiment, where, experiment._core.episodes(where))


class Past:
    """What has been done to episodes, from which they come again: in a copy, a pickle, a forked process.

    A step by what the network decided takes no room, since the network decides it again.
    """

    def __init__(self) -> None:
        self._done: list[tuple[str, tuple[NDArray[Any], ...]]] = []
        self._decided: tuple[NDArray[Any], ...] | None = None

    def add(self, method: str, *arrays: NDArray[Any]) -> None:
        """A call of the extension."""
        self._done.append((method, tuple(array.copy() for array in arrays)))

    def decide(self, decided: tuple[NDArray[Any], ...]) -> None:
        """The network has decided this."""
        self._done.append(("decide", ()))
        self._decided = decided

    def step(self, told: tuple[NDArray[Any], ...]) -> None:
        """A step by what the network has just decided, or by something else; the arrays are nobody else's."""
        decided, self._decided = self._decided, None
        is_decided = decided is not None and all(mine.tobytes() == its.tobytes() for mine, its in zip(decided, told))
        if is_decided and self._done[-1][0] == "decide":
            self._done[-1] = ("decide and step", ())
        else:
            self._done.append(("step", told))

    def again(self, core: _core.Episodes) -> _core.Episodes:
        """Does all of it to episodes that have just begun."""
        for method, arrays in self._done:
            if method == "decide and step":
                core.step(*core.decide())
            else:
                getattr(core, method)(*arrays)
        return core

    def copy(self) -> Past:
        """Another one, which goes its own way."""
        copied = Past()
        copied._done, copied._decided = list(self._done), self._decided
        return copied
