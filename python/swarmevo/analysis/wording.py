"""The notation of numbers in a report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .continuation import Branch
from .ctrnn import Equilibrium, LimitCycle
from .proportions import Proportion


def mean(values: NDArray[np.float64]) -> str:
    """Mean over trials ``[T]`` and half of its 95 % interval."""
    return f"{values.mean():.3f} ± {half_width(values):.3f}"


def half_width(values: NDArray[np.float64]) -> float:
    """1.96 standard errors of the mean of ``[T]``; NaN of one trial."""
    return 1.96 * float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")


def message(values: Sequence[float]) -> str:
    """The values of a message, with two digits: ``(1, 0.33)``."""
    return "(" + ", ".join(f"{value + 0.0:.2g}" for value in values) + ")"


def percent(it: Proportion | None) -> str:
    """A share with its standard error, if more than one trial has rows; empty without rows."""
    if it is None or it.rows == 0:
        return ""
    error = "" if np.isnan(it.error) else f" ± {100 * it.error:.1f}"
    return f"{100 * it.share:.1f}{error} %"


def share(value: float) -> str:
    """A share in percent: without decimals from 0.1 to 0.9 and for 1."""
    digits = 0 if 0.1 <= value <= 0.9 or value in (0.0, 1.0) else 1 if 0.001 <= value <= 0.999 else 2
    return f"{100 * value:.{digits}f} %"


def attractor(it: Equilibrium | LimitCycle | None) -> str:
    """The attractor of a state."""
    if isinstance(it, Equilibrium):
        return "to a point"
    return f"round in {it.period:.1f}" if isinstance(it, LimitCycle) else "neither rest nor cycle within the followed time"


def bifurcations(branches: Sequence[Branch]) -> str:
    """The bifurcations along a way, in its order."""
    found = sorted((it for branch in branches for it in branch.bifurcations), key=lambda it: it.share)
    return ", ".join(f"{'Hopf' if it.kind == 'hopf' else 'fold'} at {it.share:.2f}" for it in found) or "none"


def listed(words: Sequence[str]) -> str:
    """``a, b and c``."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
