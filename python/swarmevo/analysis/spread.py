"""How words spread: from whom, how far, how fast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import arguments
from ..trace import Trace
from .channel import FIRST
from ..representation import short

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Spread:
    """What became of the words of a swarm. A *word* is what a robot says in one step; H are hops, from 1."""

    shares: Floats
    """``[H]``: of what is heard, the share that has made so many hops."""
    distances: Floats
    """``[H]``: mean distance of hearers from the robot that said it first, cm; NaN where nothing was heard."""
    words: int
    """How many words were heard by anybody."""
    hearers: float
    """Robots that hear a word, on average over these words."""
    farthest: int
    """The most robots that heard one word."""
    longest: int
    """The most steps that a word was heard after it had been said."""

    @property
    def speed(self) -> float:
        """How fast words spread, cm per step: the slope of the distance over hops, one of which takes a step,
        by least squares weighted by what was heard; NaN if all made equally many."""
        there = self.shares > 0
        if there.sum() < 2:
            return float("nan")
        hops = np.arange(1, len(self.shares) + 1)[there]
        return float(np.polyfit(hops, self.distances[there], 1, w=np.sqrt(self.shares[there]))[0])

    __repr__ = short


def spread(trace: Trace, first: int = FIRST) -> Spread:
    """Of what was heard from step ``first`` on. A frame of h hops was said h steps before by its
    originator, so that frames of one originator and that step carry the same word."""
    first = arguments.whole(first, "first", 0)
    world = trace.experiment.to_dict()["world"]
    size = np.array([world["width"], world["height"]], np.float64)
    trial, step, hearer = np.nonzero(trace.frame_originators[:, first:] >= 0)
    step = step + first
    origin = trace.frame_originators[trial, step, hearer]
    hops = trace.frame_hops[trial, step, hearer].astype(np.int64)
    way = trace.positions[trial, step, hearer] - trace.positions[trial, step, origin]
    way -= size * np.round(way / size)
    distance = np.hypot(way[:, 0], way[:, 1])
    most = int(hops.max(initial=0))
    counts = np.bincount(hops, minlength=most + 1)[1:]
    sums = np.bincount(hops, weights=distance, minlength=most + 1)[1:]
    said = step - hops
    # Who hears a word twice, from two that relay it, is one hearer.
    hearers = np.unique(np.stack([trial, said, origin, hearer], axis=-1), axis=0)
    words, times = np.unique(hearers[:, :3], axis=0, return_counts=True)
    with np.errstate(invalid="ignore"):
        distances = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    return Spread(
        counts / max(1, counts.sum()), distances, len(words), float(times.mean()) if len(words) else 0.0,
        int(times.max(initial=0)), most,
    )
