"""The trials in which an experiment is simulated.

A *trial set* is a family of worlds and noise; its trials are numbered from 0. Each generation has
its own set, which selects. Other sets compare champions, and judge them at the end.
"""

from __future__ import annotations

from typing import NamedTuple, Union

from . import arguments

KINDS = ("generation", "held_out", "judgement", "evaluation")


class TrialSet(NamedTuple):
    """Worlds and noise. A generation's number means the set of that generation.

    >>> TrialSet.of(3) == TrialSet.generation_of(3)
    True
    >>> TrialSet.judgement(59)
    TrialSet(kind='judgement', generation=59, block=0)
    """

    kind: str
    """``generation``, ``held_out``, ``judgement`` or ``evaluation``."""
    generation: int = 0
    """The generation that the set belongs to, from 0."""
    block: int = 0
    """Number of the held-out block of the generation, 0 to 255."""

    @classmethod
    def generation_of(cls, generation: int) -> TrialSet:
        """The trials that select in a generation."""
        return cls.of(cls("generation", generation))

    @classmethod
    def held_out(cls, generation: int, block: int = 0) -> TrialSet:
        """The trials that compare candidates for the champion after a generation."""
        return cls.of(cls("held_out", generation, block))

    @classmethod
    def judgement(cls, generation: int) -> TrialSet:
        """The trials that judge the champion after the last generation."""
        return cls.of(cls("judgement", generation))

    @classmethod
    def evaluation(cls) -> TrialSet:
        """The trials of ``swarmctl evaluate``, which no evolution uses."""
        return cls("evaluation")

    @classmethod
    def of(cls, trials: AnyTrialSet) -> TrialSet:
        """``trials`` itself, or the set of the generation of that number."""
        if not isinstance(trials, TrialSet):
            return cls("generation", arguments.whole(trials, "generation"))
        arguments.known([trials.kind], KINDS, "trial set")
        generation = arguments.whole(trials.generation, "generation of a trial set")
        return cls(trials.kind, generation, arguments.whole(trials.block, "block of a trial set", 0, 255))


TRIALS_MAX = 1000
"""Trials of a set."""

AnyTrialSet = Union[int, TrialSet]
"""A trial set, or the number of a generation."""


def address(
    trial_set: AnyTrialSet, trials: int | range | None, default: int
) -> tuple[str, int, int, int, int]:
    """Set and range of trials, in the form for the extension."""
    if trials is None:
        trials = default
    if not isinstance(trials, range):
        trials = range(arguments.whole(trials, "trials: a number, or a range such as range(5, 10); it", 1, TRIALS_MAX))
    if trials.step != 1 or len(trials) == 0 or trials.start < 0 or trials.stop > TRIALS_MAX:
        raise ValueError(
            f"trials are a number from 1 to {TRIALS_MAX} or a range within it such as range(5, 10), not {trials}"
        )
    return (*TrialSet.of(trial_set), trials.start, trials.stop)
