"""Experiment A: Fig. 6.1 to 6.10."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...extras import needs
from ...trace import Trace
from ..channel import FIRST, symbols
from ..drawing import COLOURS, ON, bars, boxes, canvas, in_one_piece, raster, swarm
from ..proportions import Proportion, conditional
from .champion import REACH, Champion, mean_of_trials
from .common import evolution, snapshots, without_inputs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZES = (5, 10, 20, 30, 50)
FAILURE: dict[str, Any] = {"leader_failure": {}}
SYMBOLS = ("#d9480f", "#1f6fb4", "#2b8a3e", "#b08900", "#7b3fa0", "#9aa5b1")


def fig_1(champion: Champion) -> Figure:
    """Fitness by generation, GA and SNES."""
    return evolution(champion)


def fig_2(champion: Champion) -> Figure:
    """LEDs of 20 robots."""
    return _leds(champion.trace(1, robots=20, perturbations={}), "20 robots, without faults")


def fig_3(champion: Champion) -> Figure:
    """Snapshots of the negotiation."""
    trace = champion.trace(1, robots=20, perturbations={})
    figure, _ = snapshots(champion, trace, (0, 1, 3, 7, 14, 29), trace.leds[0] > 0)
    figure.suptitle("Orange: the LED is on", fontsize=9)
    return figure


def fig_4(champion: Champion) -> Figure:
    """Share of time with one leader, by the size of the swarm."""
    figure, axis = canvas(5, 2.9)
    _by_size(axis, champion, False)
    return figure


def fig_5(champion: Champion) -> Figure:
    """LEDs of 20 robots whose leaders fail."""
    return _leds(champion.trace(1, robots=20, perturbations=FAILURE), "20 robots; a robot that has led alone for 50 steps fails")


def fig_6(champion: Champion) -> Figure:
    """Like Fig. 6.4, with faults."""
    figure, axis = canvas(5, 2.9)
    _by_size(axis, champion, True)
    return figure


def fig_7(champion: Champion) -> Figure:
    """LEDs that are on, in one episode."""
    figure, axes = canvas(6.5, 3.4, 2, sharex=True, sharey=True)
    for axis, (title, perturbations) in zip(axes, {"without faults": {}, "leaders fail": FAILURE}.items()):
        trace = champion.trace(1, perturbations=perturbations)
        axis.plot((trace.leds[0] > 0).sum(axis=1), color=COLOURS[0], linewidth=1)
        axis.axhline(1, color="#9aa5b1", linewidth=0.7, linestyle="--")
        axis.set(title=title, ylabel="LEDs on", yticks=range(0, 11, 2))
        axis.margins(x=0)
    axes[-1].set_xlabel("step")
    return figure


def fig_8(champion: Champion) -> Figure:
    """Share of time with one leader, without single inputs."""
    figure, axis = canvas(5, 2.9)
    found = without_inputs(champion, perturbations={})
    bars(axis, list(found), [mean_of_trials(it["one_leader"].mean(axis=1)) for it in found.values()])
    axis.set_ylabel("% of the time with one leader")
    return figure


def fig_9(champion: Champion) -> Figure:
    """The swarm, its senders, and their messages."""
    trace = champion.trace(1, robots=20, perturbations={})
    figure, axes = canvas(8, 5.2, 2, 2, width_ratios=(1, 1.5))
    leader = np.argmax((trace.leds[0] > 0).sum(axis=0))
    colours = [ON if robot == leader else "#4c78a8" for robot in range(trace.n_robots)]
    place = in_one_piece(trace.positions[0, 0], champion.size, REACH)
    swarm(axes[0, 0], place, champion.size, reach=REACH, colours=colours, labels=True)
    axes[0, 0].set_title("(a) the swarm; orange: led longest")
    raster(axes[0, 1], trace.sends[0], "(b) black: sends its own message")
    _what_is_sent(axes[1, 1], trace)
    axes[1, 1].set_title("(c) sent or relayed message")
    handles, labels = axes[1, 1].get_legend_handles_labels()
    axes[1, 0].axis("off")
    axes[1, 0].legend(handles, labels, loc="center", title="symbol")
    return figure


def fig_10(champion: Champion) -> Figure:
    """The LED by mode and by symbol, and the symbols that are sent."""
    trace = champion.trace()
    found = symbols(trace)
    sends, lit = trace.sends[:, FIRST:], trace.leds[:, FIRST:] > 0
    by_mode = conditional(lit, sends.astype(int))
    by_symbol = conditional(lit, np.where(sends, found.own, -1))
    counts = np.bincount(found.own[sends], minlength=len(found.legend))
    order = np.argsort(-counts, kind="stable")[:4]
    names = [symbol_name(found.legend[code]) for code in order]
    figure, axes = canvas(9, 2.9, 1, 3)
    nothing = Proportion(float("nan"), float("nan"), 0)
    bars(axes[0], ["relay", "send"], [by_mode.get(mode, nothing) for mode in (0, 1)])
    axes[0].set(title="(a) LED on, by mode", ylabel="% of robots and steps")
    rest = counts.sum() - counts[order].sum()
    axes[1].bar(range(len(order) + 1), [*counts[order], rest], width=0.6, color=COLOURS[0])
    axes[1].set_xticks(range(len(order) + 1), [*names, "others"])
    axes[1].set(title="(b) symbols sent", ylabel="times")
    others = np.isin(found.own, order, invert=True) & sends
    shares = [by_symbol.get(int(code), nothing) for code in order]
    bars(axes[2], [*names, "others"], [*shares, conditional(lit, np.where(others, 1, -1)).get(1, nothing)])
    axes[2].set(title="(c) LED on, by symbol sent", ylabel="% of robots and steps")
    for axis in axes[1:]:
        axis.tick_params(axis="x", labelrotation=25)
    return figure


def _leds(trace: Trace, title: str) -> Figure:
    figure, axis = canvas(7, 2.8)
    raster(axis, trace.leds[0] > 0, f"LED on: {title}")
    return figure


def _by_size(axis: Axes, champion: Champion, with_faults: bool) -> None:
    faults = FAILURE if with_faults else {}
    measured = [champion.measure(robots=n, perturbations=faults).measures["one_leader"] for n in SIZES]
    boxes(axis, [100 * it.mean(axis=1) for it in measured], [str(n) for n in SIZES])
    axis.set(xlabel="robots", ylabel="% of the time with one leader", ylim=(-3, 103))


def _what_is_sent(axis: Axes, trace: Trace) -> None:
    """Own messages of senders, heard messages of relays; blank without one."""
    with needs("plot"):
        from matplotlib.colors import ListedColormap

    found = symbols(trace, 0)
    code = np.where(trace.sends[0], found.own[0], found.heard[0])
    used = np.bincount(code[code >= 0], minlength=len(found.legend))
    order = np.argsort(-used, kind="stable")[: len(SYMBOLS) - 1]
    shown = np.full(code.shape, np.nan)
    shown[code >= 0] = len(SYMBOLS) - 1
    for rank, symbol in enumerate(order):
        shown[code == symbol] = rank
    axis.imshow(
        shown.T, aspect="auto", interpolation="nearest", cmap=ListedColormap(SYMBOLS), vmin=-0.5, vmax=len(SYMBOLS) - 0.5
    )
    axis.set(xlabel="step", ylabel="robot")
    axis.set_yticks(range(0, trace.n_robots, 5))
    for rank, symbol in enumerate(order):
        if used[symbol]:
            axis.scatter([], [], marker="s", color=SYMBOLS[rank], label=symbol_name(found.legend[symbol]))
    if used.sum() > used[order].sum():
        axis.scatter([], [], marker="s", color=SYMBOLS[-1], label="others")


def symbol_name(message: tuple[float, ...]) -> str:
    """The values of a message, as thirds where they are thirds."""
    return "(" + ", ".join({0: "0", 33: "⅓", 67: "⅔", 100: "1"}.get(round(100 * it), f"{it:.2g}") for it in message) + ")"


FIGURES = {
    "6.1": fig_1, "6.2": fig_2, "6.3": fig_3, "6.4": fig_4, "6.5": fig_5,
    "6.6": fig_6, "6.7": fig_7, "6.8": fig_8, "6.9": fig_9, "6.10": fig_10,
}
