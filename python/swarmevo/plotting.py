"""Curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Sequence

from .extras import needs

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_history(
    ax: Axes | None,
    name: str,
    generations: Sequence[int],
    best: Sequence[float],
    mean: Sequence[float],
) -> Axes:
    """Best and mean fitness of every generation."""
    if ax is None:
        with needs("plot"):
            from matplotlib import pyplot

        _, ax = pyplot.subplots()
    ax.plot(generations, best, linewidth=0.8, label="best of the generation")
    ax.plot(generations, mean, label="mean of the generation")
    ax.set_xlabel("generation")
    ax.set_ylabel("fitness")
    ax.set_title(name)
    ax.legend()
    return ax
