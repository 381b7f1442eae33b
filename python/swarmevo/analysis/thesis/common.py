"""Common parts of the figures of several experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...trace import Trace
from ..drawing import COLOURS, OFF, ON, canvas, swarm
from .champion import REACH, Champion, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def histories(axis: Axes, runs: Mapping[str, dict[str, Floats]]) -> None:
    """Mean fitness of the population, in the area from the worst to the best individual."""
    for (label, run), colour in zip(runs.items(), COLOURS):
        at = np.arange(len(run["mean"]))
        axis.fill_between(at, run["min"], run["best"], color=colour, alpha=0.2, linewidth=0)
        axis.plot(at, run["mean"], color=colour, label=label, linewidth=1.2)
    axis.set(xlabel="generation", ylabel="fitness")
    axis.margins(x=0)
    axis.legend(loc="upper left")


def evolution(champion: Champion) -> Figure:
    """Fitness by generation of GA and SNES."""
    figure, axis = canvas(6, 2.8)
    histories(axis, {"SNES": champion.history("snes"), "GA": champion.history("ga")})
    return figure


def without_inputs(champion: Champion, *more: str, **changes: Any) -> dict[str, dict[str, Floats]]:
    """Measures with all inputs and without single ones, ``more`` among them."""
    labels = {"message": "msg", "direction": "receiving_direction", **{name: name for name in more}, "mode": "state"}
    lesions = {f"no {label}": {"without": f"wireless_receiver:{name}"} for label, name in labels.items()}
    conditions = {"all inputs": {}, **lesions}
    return {label: champion.measure(**changes, **lesion).measures for label, lesion in conditions.items()}


def snapshots(
    champion: Champion,
    trace: Trace,
    steps: Sequence[int],
    colours: NDArray[np.bool_],
    *,
    show_headings: bool = False,
    arrows: float = 9,
) -> tuple[Figure, Any]:
    """The swarm of the first trial after these steps, in two rows; ``colours`` ``[steps, R]`` selects the
    orange robots. All panels have the same frame, that of all robots in these steps."""
    figure, axes = canvas(7, 4.6, 2, (len(steps) + 1) // 2)
    positions = trace.positions[0]
    shown = positions[list(steps)].reshape(-1, 2)
    low, high = shown.min(axis=0), shown.max(axis=0)
    centre, half = (low + high) / 2, (high - low).max() / 2 + 60
    for axis, step in zip(axes.flat, steps):
        lit = np.where(colours[step], ON, OFF).tolist()
        swarm(
            axis, positions[step], champion.size, reach=REACH, colours=lit, edges=not show_headings,
            headings=trace.headings[0, step] if show_headings else None, arrows=arrows,
        )
        axis.set_title(f"step {step + 1}")
        axis.set_xlim(centre[0] - half, centre[0] + half)
        axis.set_ylim(centre[1] - half, centre[1] + half)
    return figure, axes
