"""Episodes step by step: stimuli out, actions in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core

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
        self._core = core
        self.agents: list[int] = core.agents
        """The numbers of the A agents among all robots."""
        self.n_inputs: int = core.n_inputs
        """I"""
        self.message_len: int = core.message_len
        """M; 0 without radio."""
        self.n_steps_done = 0
        """Environment steps taken."""

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
        values = np.ascontiguousarray(stimuli, dtype=np.float32)
        shape = (self.n_trials, len(self.agents), self.n_inputs)
        if values.shape != shape:
            raise ValueError(f"stimuli are an array {list(shape)}, not {list(values.shape)}")
        self._core.set_stimuli(values.reshape(-1))

    @property
    def sent(self) -> NDArray[np.bool_]:
        """``[T, A]``: which agents sent their own message in the step before. That is what their actions said,
        but for the first steps, in which all send, and for robots that fail."""
        return self._core.sent().reshape(self.n_trials, len(self.agents))

    def silence(self, silent: ArrayLike) -> None:
        """``[T, A]``: has these agents emit nothing in this step, neither their own message nor one that they
        relay. Hearers get the next strongest frame."""
        values = np.ascontiguousarray(silent, dtype=np.bool_)
        shape = (self.n_trials, len(self.agents))
        if values.shape != shape:
            raise ValueError(f"who is silent is an array {list(shape)}, not {list(values.shape)}")
        self._core.silence(values.reshape(-1))

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
        shape = (self.n_trials, len(self.agents))

        def flat(name: str, array: ArrayLike, dtype: type, *width: int) -> NDArray[Any]:
            values: NDArray[Any] = np.ascontiguousarray(array, dtype=dtype)
            if values.shape != (*shape, *width):
                raise ValueError(
                    f"{name} are an array {[*shape, *width]}, not {list(values.shape)}"
                )
            return values.reshape(-1)

        fitness = self._core.step(
            flat("wheels", actions.wheels, np.float64, 2),
            flat("leds", actions.leds, np.uint32),
            flat("sends", actions.sends, np.bool_),
            flat("messages", actions.messages, np.float64, self.message_len),
        )
        self.n_steps_done += 1
        return fitness

    def load(self, genotype: ArrayLike) -> None:
        """Makes the network of a genotype ``[d]`` ready for :meth:`decide`, at rest."""
        self._core.load(self.experiment._genotype(genotype))

    def decide(self) -> Actions:
        """What the loaded network has the agents do. Asked once in each step, it gives the
        bits of :meth:`Experiment.simulate`."""
        wheels, leds, sends, messages = self._core.decide()
        shape = (self.n_trials, len(self.agents))
        return Actions(
            wheels.reshape(*shape, 2),
            leds.reshape(shape),
            sends.reshape(shape),
            messages.reshape(*shape, self.message_len),
        )

    @property
    def fitness(self) -> Floats:
        """``[T]``: of each trial so far, the mean over the steps that count."""
        return self._core.fitness()
