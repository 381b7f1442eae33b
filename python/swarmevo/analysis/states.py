"""The states that networks go through in episodes."""

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
class Components:
    """Principal components of the activities of N neurons."""

    shares: Floats
    """``[N]``: shares of the variance, largest first."""
    axes: Floats
    """``[N, N]``: a component per row, of length 1; its largest entry is positive."""
    scores: Floats
    """``[T, steps, R, N]``: projection of the state on each component; NaN for robots without a
    network."""

    @property
    def dimension(self) -> float:
        """Effective number of components: (sum of variances)² / sum of their squares (the participation
        ratio, Gao et al. 2017), from 1 to N; 0 for constant states."""
        squares = float((self.shares**2).sum())
        return 1 / squares if squares > 0 else 0.0

    __repr__ = short


def components_of_states(trace: Trace, first: int = FIRST) -> Components:
    """The states of all robots with a network, in all trials, from step ``first`` on."""
    first = arguments.whole(first, "first", 0)
    states = np.asarray(trace.activities[:, first:], np.float64)
    active = ~np.isnan(states).any(axis=-1)
    known = states[active]
    centre = known.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov((known - centre).T))
    variances, axes = np.maximum(values[::-1], 0), vectors[:, ::-1].T
    largest = axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)]
    axes = axes * np.sign(largest)[:, np.newaxis]
    total = variances.sum()
    shares = variances / total if total > 0 else variances
    return Components(shares, axes, np.asarray((states - centre) @ axes.T))
