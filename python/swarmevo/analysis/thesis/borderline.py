"""Experiment B: Fig. 5.2 and Fig. 6.11 to 6.19."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...trace import Trace
from ..border import ALPHA, alpha_shape, border, components
from ..channel import FIRST, sectors_heard
from ..drawing import COLOURS, OFF, ON, bands, bars, canvas, in_one_piece, raster, swarm
from ..proportions import Proportion, conditional
from .champion import REACH, Champion, Floats
from .common import evolution, snapshots, without_inputs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZES = (10, 20, 30, 50)
SWITCH = {"topology_switch": {"every": 200}}
STEPS = 600


def fig_5_2(champion: Champion) -> Figure:
    """Alpha shapes of 100 random points, by alpha."""
    figure, axes = canvas(7, 4.8, 2, 3)
    points = np.random.default_rng(2).random((100, 2))
    for axis, alpha in zip(axes.flat, (0, 2, 5, 7, 10, ALPHA)):
        inside, edges = alpha_shape(points, 1 / alpha if alpha else np.inf)
        axis.scatter(*points.T, s=7, color=OFF)
        for edge in edges:
            axis.plot(*points[edge].T, color="#7b3fa0", linewidth=1.2)
        axis.scatter(*points[inside].T, s=9, color=ON, zorder=3)
        axis.set(title=f"alpha {alpha:g}: {len(inside)} of 100 on it", xticks=[], yticks=[], aspect="equal")
    return figure


def fig_11(champion: Champion) -> Figure:
    """Fitness by generation, GA and SNES."""
    return evolution(champion)


def fig_12(champion: Champion) -> Figure:
    """30 robots: border, errors, targets and LEDs."""
    trace = champion.trace(1, robots=30, steps=STEPS)
    at = 479
    target, lit = trace.targets[0] > 0, trace.leds[0] > 0
    place = in_one_piece(trace.positions[0, at], champion.size, REACH)
    figure, axes = canvas(7.5, 6, 2, 2, height_ratios=(1.2, 1))
    swarm(axes[0, 0], place, champion.size, reach=REACH, colours=np.where(target[at], ON, OFF).tolist(), labels=True)
    axes[0, 0].set_title("(a) orange: on the alpha shape")
    right = np.where(target[at] == lit[at], COLOURS[2], "#c92a2a").tolist()
    swarm(axes[0, 1], place, champion.size, reach=REACH, colours=right, labels=True)
    axes[0, 1].set_title(f"(b) step {at + 1}; green: right, red: wrong")
    raster(axes[1, 0], target, "(c) black: should be on")
    raster(axes[1, 1], lit, "(d) black: is on")
    return figure


def fig_13(champion: Champion) -> Figure:
    """True positive and negative rates of 30 robots."""
    found = champion.measure(robots=30, steps=STEPS).measures
    figure, axis = canvas(6, 2.8)
    bands(axis, {"TPR": found["true_positive_rate"], "TNR": found["true_negative_rate"]})
    axis.set(ylabel="rate, median and quartiles", ylim=(0, 1.02))
    axis.legend(loc="lower right")
    return figure


def fig_14(champion: Champion) -> Figure:
    """Snapshots, and the alpha shape."""
    trace = champion.trace(1, robots=30)
    figure, axes = snapshots(champion, trace, (0, 4, 9, 19, 49, 49), trace.leds[0] > 0)
    axis = axes.flat[-1]
    axis.clear()
    _outline(axis, trace, champion)
    axis.set_xlim(axes.flat[0].get_xlim())
    axis.set_ylim(axes.flat[0].get_ylim())
    axis.set_title("the alpha shape")
    figure.suptitle("Orange: the LED is on", fontsize=9)
    return figure


def fig_15(champion: Champion) -> Figure:
    """Accuracy by the size of the swarm."""
    return _accuracy({f"{n} robots": champion.measure(robots=n).measures["accuracy"] for n in SIZES})


def fig_16(champion: Champion) -> Figure:
    """Targets and LEDs of a swarm that gets new places every 200 steps."""
    trace = champion.trace(1, steps=STEPS, perturbations=SWITCH)
    figure, axes = canvas(8, 2.9, 1, 2)
    raster(axes[0], trace.targets[0] > 0, "black: should be on")
    raster(axes[1], trace.leds[0] > 0, "black: is on")
    return figure


def fig_17(champion: Champion) -> Figure:
    """Like Fig. 6.15, with new places every 200 steps."""
    changes = {"steps": STEPS, "perturbations": SWITCH}
    return _accuracy({f"{n} robots": champion.measure(robots=n, **changes).measures["accuracy"] for n in SIZES})


def fig_18(champion: Champion) -> Figure:
    """Accuracy without single inputs."""
    return _accuracy({label: found["accuracy"] for label, found in without_inputs(champion).items()})


def fig_19(champion: Champion) -> Figure:
    """LED on, by the number of directions from which a robot heard frames within ten steps."""
    trace = champion.trace()
    found = conditional(trace.leds[:, FIRST:] > 0, sectors_heard(trace)[:, FIRST:])
    figure, axis = canvas(4.6, 2.9)
    numbers = range(1, trace_sectors(champion) + 1)
    nothing = Proportion(float("nan"), float("nan"), 0)
    bars(axis, [str(n) for n in numbers], [found.get(n, nothing) for n in numbers])
    axis.set(xlabel="directions from which it heard frames", ylabel="% with the LED on")
    return figure


def trace_sectors(champion: Champion) -> int:
    """Sectors of the receiver."""
    robots = champion.experiment.to_dict()["world"]["objects"]["robotA"]
    return int(robots["sensors"]["wireless_receiver"]["n_sectors"])


def _accuracy(curves: dict[str, Floats]) -> Figure:
    figure, axis = canvas(6, 2.8)
    bands(axis, {label: 100 * values for label, values in curves.items()})
    axis.set(ylabel="accuracy, %, median and quartiles", ylim=(20, 102))
    axis.legend(loc="lower right", ncols=2)
    return figure


def _outline(axis: Axes, trace: Trace, champion: Champion) -> None:
    positions = trace.positions[0, 0]
    on = border(positions, champion.size, REACH)
    swarm(
        axis, in_one_piece(positions, champion.size, REACH), champion.size, reach=REACH,
        colours=np.where(on, ON, OFF).tolist(), edges=False,
    )
    for _, points in components(positions, champion.size, REACH):
        for edge in alpha_shape(points, champion.size[0] / ALPHA)[1]:
            axis.plot(*points[edge].T, color="#7b3fa0", linewidth=1.6)


FIGURES = {
    "5.2": fig_5_2, "6.11": fig_11, "6.12": fig_12, "6.13": fig_13, "6.14": fig_14, "6.15": fig_15,
    "6.16": fig_16, "6.17": fig_17, "6.18": fig_18, "6.19": fig_19,
}
