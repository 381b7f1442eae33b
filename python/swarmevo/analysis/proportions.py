"""Proportions of rows, with errors over trials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..representation import short


@dataclass(frozen=True)
class Proportion:
    """A share of rows."""

    share: float
    """The share; NaN if no row counts."""
    error: float
    """Standard error of the share over trials; NaN for fewer than two trials."""
    rows: int
    """Number of counted rows."""

    @property
    def ci95(self) -> tuple[float, float]:
        """The share ± 1.96 standard errors, within [0, 1]."""
        return max(0.0, self.share - 1.96 * self.error), min(1.0, self.share + 1.96 * self.error)

    __repr__ = short


def proportion(event: ArrayLike, where: ArrayLike | None = None) -> Proportion:
    """Share of true values of an array ``[T, ...]``, among the places where ``where`` is true.

    Its standard error is that of a ratio over trials (Cochran, Sampling Techniques 1977, eq.
    2.39), which are independent. The thesis's Eq. 6.1 treats every row of a trial as independent,
    so its interval is too narrow.
    """
    events = np.asarray(event, dtype=bool)
    counts = np.ones(events.shape, bool) if where is None else np.asarray(where, dtype=bool)
    axes = tuple(range(1, events.ndim))
    hits, rows = (events & counts).sum(axis=axes), counts.sum(axis=axes)
    total = int(rows.sum())
    if total == 0:
        return Proportion(float("nan"), float("nan"), 0)
    share = hits.sum() / total
    used = rows > 0
    n = int(used.sum())
    residuals = (hits - share * rows)[used]
    spread = (residuals**2).sum() / (n - 1) / n if n > 1 else np.nan
    return Proportion(float(share), float(np.sqrt(spread) / rows[used].mean()), total)


def conditional(event: ArrayLike, given: ArrayLike) -> dict[Any, Proportion]:
    """P(event | given = value) for every value of ``given``, in ascending order; both ``[T, ...]``.
    Negative values are missing."""
    given = np.asarray(given)
    values = [value for value in np.unique(given).tolist() if value >= 0]
    return {value: proportion(event, given == value) for value in values}
