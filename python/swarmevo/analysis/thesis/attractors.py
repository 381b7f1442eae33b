"""Fig. 2.2 and 2.3: the effect of inputs on the attractors of two neurons."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ...extras import needs
from ..continuation import continuation
from ..ctrnn import CTRNN
from ..drawing import COLOURS, canvas
from .champion import Champion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BIAS = (-2.75, -1.75)
NETWORKS = {
    "a": CTRNN([[5, 3], [-3, 5]], bias=BIAS, input_weights=[[1, 1], [1, 1]]),
    "b": CTRNN([[4.5, 1], [-1, 4.5]], bias=BIAS, input_weights=[[-0.2, 0], [-0.1, 0.1]]),
    "c": CTRNN([[4.5, 1], [-1, 4.5]], bias=BIAS, input_weights=[[1, -2], [-1, 1]]),
}
"""The networks of section 2.1.3. The unit of time is the time constant of both neurons, 20 dt."""
PATTERNS = ((0, 0), (0, 1), (1, 0), (1, 1))
DT = 1 / 20
HELD = 100
"""Duration of each pattern, in time constants: more than three periods of the cycles."""
WAYS = {"a": ((0, 1), (1, 1), "a"), "b": ((1, 1), (0, 0), "c")}
"""Fig. 2.3: first and last inputs, and a network of Fig. 2.2, because the thesis does not give the networks of
Fig. 2.3."""
START = (0.1, 0.0)


def fig_2(_: Champion) -> Figure:
    """Three networks under four patterns, one after another."""
    figure, axes = canvas(7.4, 7.2, 6, 2, width_ratios=(1.35, 1))
    steps = round(HELD / DT)
    inputs = np.repeat(np.array(PATTERNS, float), steps, axis=0)
    time = np.arange(len(inputs)) * DT
    for row, (name, network) in enumerate(NETWORKS.items()):
        rates = network.rates(network.trajectory(inputs, dt=DT, start=START))[:-1]
        above, below = axes[2 * row, 0], axes[2 * row + 1, 0]
        grid = axes[2 * row, 1].get_gridspec()
        for axis in axes[2 * row : 2 * row + 2, 1]:
            axis.remove()
        plane = figure.add_subplot(grid[2 * row : 2 * row + 2, 1])
        for i, colour in ((0, "black"), (1, "#868e96")):
            above.plot(time, inputs[:, i] + 1.4 * (1 - i), color=colour, linewidth=1)
            below.plot(time, rates[:, i], color=colour, linewidth=1, label=f"u{i + 1}")
        above.set_yticks([0, 1.4], ["φ2", "φ1"])
        above.set_title(f"({name})", loc="left")
        above.set_xticklabels([])
        below.set(ylabel="rates", xlabel="time, τ", ylim=(0, 1.02))
        if row == 0:
            below.legend(loc="center right", ncols=2)
        for axis in (above, below):
            axis.margins(x=0)
        for k, pattern in enumerate(PATTERNS):
            here = slice(k * steps, (k + 1) * steps)
            plane.plot(*rates[here].T, color=COLOURS[k + 1 if k else 0], linewidth=1, label=f"φ = {pattern}")
            plane.plot(*rates[(k + 1) * steps - 1], "o", color=COLOURS[k + 1 if k else 0], markersize=4)
        plane.set(xlabel="u1", ylabel="u2", xlim=(0, 1), ylim=(0, 1))
        plane.legend(loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def fig_3(_: Champion) -> Figure:
    """Attractors along one input, with the equilibria and the Hopf point that continuation finds."""
    with needs("plot"):
        import matplotlib

    figure, axes = canvas(8, 3.3, 1, 2)
    colours = matplotlib.colormaps["viridis"]
    for axis, (name, (first, last, which)) in zip(axes, WAYS.items()):
        network = NETWORKS[which]
        begin, change = np.array(first, float), np.subtract(last, first)
        for share in np.arange(0, 1.0001, 0.1 if name == "a" else 0.05):
            held = np.tile(begin + share * change, (round(4 * HELD / DT), 1))
            rates = network.rates(network.trajectory(held, dt=DT, start=START))
            axis.plot(*rates.T, color=colours(share), linewidth=0.7)
        for branch in continuation(network, first, last):
            stable = branch.stable
            axis.plot(*np.where(stable, branch.rates.T, np.nan), color="#c92a2a", linewidth=2, label="equilibria that attract")
            if not stable.all():
                axis.plot(*np.where(stable, np.nan, branch.rates.T), color="#c92a2a", linewidth=1, linestyle=":", label="that do not")
            for it in branch.bifurcations:
                axis.plot(*it.equilibrium.rates, "k*", markersize=9, label=f"Hopf point, φ = {it.share:.3f}")
        axis.set(xlabel="u1", ylabel="u2", xlim=(0, 1.02), ylim=(0, 1.02), title=f"({name}) network of Fig. 2.2{which}")
        axis.legend(loc="upper left" if name == "a" else "lower right", fontsize=7, labelspacing=0.2)
    shown = matplotlib.cm.ScalarMappable(cmap=colours)
    figure.colorbar(shown, ax=axes, label="φ")
    return figure


FIGURES: dict[str, Callable[[Champion], Figure]] = {"2.2": fig_2, "2.3": fig_3}
