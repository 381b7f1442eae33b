"""The spread of words: their senders, distances and speeds."""

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
    """The spread of the words of a swarm. A *word* is a message that a robot sends in one step; H are hops,
    from 1."""

    shares: Floats
    """``[H]``: the share of heard messages by number of hops."""
    distances: Floats
    """``[H]``: mean distance between hearers and the original sender, cm; NaN if no message was heard."""
    words: int
    """Number of words that any robot heard."""
    hearers: float
    """Mean number of robots that hear such a word."""
    farthest: int
    """Maximum number of robots that heard one word."""
    longest: int
    """Maximum number of steps between sending and hearing a word."""

    @property
    def speed(self) -> float:
        """Speed of words, cm per step: the slope of distance over hops, each of which takes a step, by least
        squares weighted by the number of heard messages; NaN if all made equally many hops."""
        there = self.shares > 0
        if there.sum() < 2:
            return float("nan")
        hops = np.arange(1, len(self.shares) + 1)[there]
        return float(np.polyfit(hops, self.distances[there], 1, w=np.sqrt(self.shares[there]))[0])

    __repr__ = short


def spread(trace: Trace, first: int = FIRST) -> Spread:
    """The spread of messages heard from step ``first`` on. The originator of a frame of h hops
    sent it h steps before, so frames of one originator and that step carry the same word."""
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
    # A robot that hears a word from two relays counts once.
    hearers = np.unique(np.stack([trial, said, origin, hearer], axis=-1), axis=0)
    words, times = np.unique(hearers[:, :3], axis=0, return_counts=True)
    with np.errstate(invalid="ignore"):
        distances = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    return Spread(
        counts / max(1, counts.sum()), distances, len(words), float(times.mean()) if len(words) else 0.0,
        int(times.max(initial=0)), most,
    )
