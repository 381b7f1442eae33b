"""Information between discrete variables, and the amount that chance alone gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import arguments
from ..representation import short

Codes = NDArray[np.int64]


def codes(*columns: ArrayLike) -> Codes:
    """One code per distinct combination of values: arrays of one shape to integers from 0."""
    arrays = np.broadcast_arrays(*(np.asarray(column) for column in columns))
    rows = np.stack([np.unique(array, return_inverse=True)[1].reshape(-1) for array in arrays], axis=-1)
    inverse = np.unique(rows, axis=0, return_inverse=True)[1]
    return inverse.reshape(arrays[0].shape).astype(np.int64)


def discretise(values: ArrayLike, n_bins: int = 4) -> Codes:
    """Maps real values to ``n_bins`` bins of about equal counts, and NaN to -1.

    If there are fewer than ``n_bins`` different values, each gets its own bin.
    """
    n_bins = arguments.whole(n_bins, "n_bins", 1)
    array = np.asarray(values, dtype=np.float64)
    known = array[~np.isnan(array)]
    distinct = np.unique(known)
    if len(distinct) <= n_bins:
        found = np.searchsorted(distinct, array)
    else:
        edges = np.quantile(known, np.arange(1, n_bins) / n_bins)
        found = np.searchsorted(edges, array, side="right")
    return np.where(np.isnan(array), -1, found).astype(np.int64)


def entropy(values: ArrayLike) -> float:
    """Shannon's entropy of the values' frequencies, in bits."""
    counts = np.unique(np.asarray(values), return_counts=True)[1]
    shares = counts / counts.sum()
    return float(-(shares * np.log2(shares)).sum()) if len(shares) > 1 else 0.0


def mutual_information(x: ArrayLike, y: ArrayLike) -> float:
    """Mutual information of two arrays of one shape, in bits, from their frequencies.

    With few values, the result is too large by about (A - 1)(B - 1) / (2 N ln 2) (Miller 1955), where A and
    B are the numbers of different values: :func:`dependence` adds the level of chance.
    """
    a, b = codes(x).reshape(-1), codes(y).reshape(-1)
    return _information(a, b, int(b.max(initial=0)) + 1)


def _information(a: Codes, b: Codes, n_b: int) -> float:
    """Mutual information of two lists of codes from 0, those of ``b`` below ``n_b``."""
    if a.size == 0:
        return 0.0
    counts = np.bincount(a * n_b + b)
    table = np.pad(counts, (0, -len(counts) % n_b)).reshape(-1, n_b)
    joint = table / table.sum()
    product = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    there = joint > 0
    return float(max(0.0, (joint[there] * np.log2(joint[there] / product[there])).sum()))


@dataclass(frozen=True)
class Dependence:
    """The information between two variables."""

    bits: float
    """Measured mutual information."""
    chance: float
    """Mean mutual information if only chance relates the variables."""
    chance95: float
    """The value that chance alone exceeds with a probability of 2.5 %."""
    p: float
    """Share of shuffles with at least as much information, at least 1 / (shuffles + 1)."""

    @property
    def excess(self) -> float:
        """Bits beyond chance."""
        return self.bits - self.chance

    __repr__ = short


def dependence(x: ArrayLike, y: ArrayLike, *, shuffles: int = 200, seed: int = 0) -> Dependence:
    """Mutual information of two arrays ``[T, ...]`` of one shape, against chance.

    Negative codes are missing values; positions with either missing do not count. For chance, the
    trials of ``y`` are shuffled, so that both variables keep their course in time: shuffled single
    values would suggest dependence in all slow variables.
    """
    shuffles = arguments.whole(shuffles, "shuffles", 0)
    seed = arguments.whole(seed, "seed", 0)
    first, second = np.asarray(x, dtype=np.int64), np.asarray(y, dtype=np.int64)
    if first.shape != second.shape or first.ndim < 1 or first.shape[0] < 2:
        raise ValueError(f"two arrays of one shape, of 2 trials and more: {first.shape}, {second.shape}")
    a, b = (np.where(it >= 0, codes(it), -1).reshape(len(it), -1) for it in (first, second))
    n_b = int(b.max(initial=0)) + 1

    def of(b: Codes) -> float:
        there = (a >= 0) & (b >= 0)
        return _information(a[there], b[there], n_b)

    rng = np.random.default_rng(seed)
    shuffled = np.array([of(b[_moved(rng, len(b))]) for _ in range(shuffles)])
    bits = of(b)
    return Dependence(
        bits,
        float(shuffled.mean()),
        float(np.quantile(shuffled, 0.975)),
        float((1 + (shuffled >= bits).sum()) / (shuffles + 1)),
    )


def _moved(rng: np.random.Generator, n: int) -> NDArray[np.intp]:
    """A random order in which no element keeps its place: Sattolo's cycle."""
    order = np.arange(n)
    for i in range(n - 1, 0, -1):
        j = rng.integers(i)
        order[i], order[j] = order[j], order[i]
    return order
