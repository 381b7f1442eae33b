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
    """The actions of A agents in one step of T trials."""

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
    """T trials side by side, in which the caller controls the A *agents*, the robots with a
    network. Other controllers still control their robots. Use
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
        """The simulated experiment."""
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
        """The simulation, on its own thread; in a forked process, a new one with the same past."""
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
        """``[T, A, I]``: the inputs of the agents in this step; after the end, in the last one."""
        stimuli = self._core.stimuli()
        return stimuli.reshape(self.n_trials, len(self.agents), self.n_inputs)

    @stimuli.setter
    def stimuli(self, stimuli: ArrayLike) -> None:
        """Replaces the agents' inputs in this step, for :meth:`decide`. Radios still relay the messages that
        they heard. Values for inputs that an agent lacks are ignored, and inhibited inputs stay 0."""
        shape = (self.n_trials, len(self.agents), self.n_inputs)
        # Inputs that an agent lacks are NaN.
        values = arguments.array_of(stimuli, "stimuli", shape, np.float32).reshape(-1)
        self._core.set_stimuli(values)
        self._past.add("set_stimuli", values)

    @property
    def sent(self) -> NDArray[np.bool_]:
        """``[T, A]``: whether agents sent their own message in the previous step. This follows their actions,
        except in the first steps, in which all send, and for robots that fail."""
        return self._core.sent().reshape(self.n_trials, len(self.agents))

    def silence(self, silent: ArrayLike) -> None:
        """``[T, A]``: silences agents in this step, so that they emit neither their own message nor a relayed
        one. Hearers get the next strongest frame."""
        shape = (self.n_trials, len(self.agents))
        values = arguments.array_of(silent, "who is silent", shape, np.bool_).reshape(-1)
        self._core.silence(values)
        self._past.add("silence", values)

    def idle(self) -> Actions:
        """Actions of agents that stand still with the LED off, and send zeros."""
        shape = (self.n_trials, len(self.agents))
        return Actions(
            np.zeros((*shape, 2)),
            np.zeros(shape, np.uint32),
            np.ones(shape, np.bool_),
            np.zeros((*shape, self.message_len)),
        )

    def step(self, actions: Actions) -> Floats:
        """Takes one step. Returns its fitness ``[T]``, NaN if the step does not count."""
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
        """Loads the network of a genotype ``[d]``, or of a champion, for :meth:`decide`, at rest."""
        genes = self.experiment._genotype(genotype)
        self._core.load(genes)
        self._past.add("load", genes)

    def decide(self) -> Actions:
        """The actions that the loaded network decides. Called once in each step, it gives the bits
        of :meth:`Experiment.simulate`."""
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
        """``[T]``: fitness of each trial so far, the mean over the steps that count."""
        return self._core.fitness()


def _begin(experiment: Experiment, where: tuple[str, int, int, int, int]) -> Episodes:
    return Episodes(experiment, where, experiment._core.episodes(where))


class Past:
    """The history of calls on episodes, which recreates them in a copy, a pickle or a forked process.

    A step with the network's own decision takes no memory, because the network decides it again.
    """

    def __init__(self) -> None:
        self._done: list[tuple[str, tuple[NDArray[Any], ...]]] = []
        self._decided: tuple[NDArray[Any], ...] | None = None

    def add(self, method: str, *arrays: NDArray[Any]) -> None:
        """A call of the extension."""
        self._done.append((method, tuple(array.copy() for array in arrays)))

    def decide(self, decided: tuple[NDArray[Any], ...]) -> None:
        """Records a decision of the network."""
        self._done.append(("decide", ()))
        self._decided = decided

    def step(self, told: tuple[NDArray[Any], ...]) -> None:
        """Records a step, with the network's latest decision or with other actions; owns the arrays."""
        decided, self._decided = self._decided, None
        is_decided = decided is not None and all(mine.tobytes() == its.tobytes() for mine, its in zip(decided, told))
        if is_decided and self._done[-1][0] == "decide":
            self._done[-1] = ("decide and step", ())
        else:
            self._done.append(("step", told))

    def again(self, core: _core.Episodes) -> _core.Episodes:
        """Repeats all calls on new episodes."""
        for method, arrays in self._done:
            if method == "decide and step":
                core.step(*core.decide())
            else:
                getattr(core, method)(*arrays)
        return core

    def copy(self) -> Past:
        """An independent copy."""
        copied = Past()
        copied._done, copied._decided = list(self._done), self._decided
        return copied
