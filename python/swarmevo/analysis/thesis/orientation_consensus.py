"""Experiment C: Fig. 6.20 to 6.28."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...trace import Trace
from ..channel import FIRST, symbols
from ..drawing import COLOURS, bands, bars, canvas, unwrapped
from ..proportions import conditional
from .champion import Champion, Floats
from .common import histories, snapshots
from .leader_selection import symbol_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZES = (5, 10, 20, 30, 50)
STEPS = 1000
MESSAGE = "wireless_receiver:msg"
ANGLES = (0, 90, 180, 270)


def fig_20(champion: Champion) -> Figure:
    """Fitness by generation: with Eq. 5.5, and with the original's function."""
    figure, axes = canvas(8, 2.8, 1, 2)
    histories(axes[0], {"SNES": champion.history("snes"), "GA": champion.history("ga")})
    axes[0].legend(loc="lower right")
    axes[0].set_title("Eq. 5.5")
    other = replace(champion, name="orientation_consensus_alignment")
    histories(axes[1], {"SNES": other.history("snes"), "GA": other.history("ga")})
    axes[1].set_title("the original's function")
    return figure


def fig_21(champion: Champion) -> Figure:
    """Headings of 20 robots."""
    trace = champion.trace(1, robots=20, steps=STEPS)
    figure, axis = canvas(6, 3)
    _headings(axis, unwrapped(trace.headings[0]), "#1a1a1a")
    return figure


def fig_22(champion: Champion) -> Figure:
    """Snapshots of 20 robots and their headings."""
    trace = champion.trace(1, robots=20, steps=STEPS)
    nobody = np.zeros(trace.leds[0].shape, bool)
    figure, _ = snapshots(champion, trace, (0, 49, 99, 199, 399, 999), nobody, show_headings=True)
    return figure


def fig_23(champion: Champion) -> Figure:
    """Misalignment by the size of the swarm."""
    return _misalignment({f"{n} robots": champion.measure(robots=n, steps=STEPS).measures["misalignment"] for n in SIZES})


def fig_24(champion: Champion) -> Figure:
    """Robots that hold a heading from step 200 on, and another from step 600 on."""
    figure, axes = canvas(9, 3.2, 1, 2)
    trace = champion.trace(1, steps=STEPS, perturbations=_rotation(4))
    held = (trace.wheels[0, 300:600] == 0).all(axis=(0, 2))
    headings = unwrapped(trace.headings[0])
    _headings(axes[0], headings[:, ~held], "#1a1a1a", "of the network")
    _headings(axes[0], headings[:, held], "#d9480f", "held from step 200")
    axes[0].set_title("(a) 10 robots, four of them held")
    axes[0].legend()
    found = {f"{n} held": champion.measure(steps=STEPS, perturbations=_rotation(n)) for n in (0, 2, 4)}
    bands(axes[1], {label: it.measures["misalignment"] for label, it in found.items()})
    axes[1].set(title="(b) 50 episodes", ylabel="misalignment, rad")
    axes[1].set_ylim(bottom=0)
    return figure


def fig_25(champion: Champion) -> Figure:
    """Misalignment without single inputs."""
    inputs = {
        "all inputs": None,
        "no message": MESSAGE,
        "no receiving direction": "wireless_receiver:receiving_direction",
        "no sending direction": "wireless_receiver:sending_direction",
        "no mode": "wireless_receiver:state",
    }
    return _misalignment(
        {
            label: champion.measure(**({} if sensor is None else {"without": sensor})).measures["misalignment"]
            for label, sensor in inputs.items()
        }
    )


def fig_26(champion: Champion) -> Figure:
    """Headings with and without the message, in the same world."""
    figure, axis = canvas(6, 3)
    _headings(axis, unwrapped(champion.trace(1).headings[0]), "#1a1a1a", "all inputs")
    _headings(axis, unwrapped(champion.trace(1, without=MESSAGE).headings[0]), "#d9480f", "no message")
    axis.legend()
    return figure


def fig_27(champion: Champion) -> Figure:
    """The wheel, by the directions of sending and receiving."""
    trace = champion.trace()
    receiving, sending = directions(trace)
    wheel = trace.wheels[:, FIRST:, :, 0]
    figure, axis = canvas(8, 3.2)
    rng = np.random.default_rng(0)
    for i, tx in enumerate(ANGLES):
        for j, rx in enumerate(ANGLES):
            values = wheel[(sending == tx) & (receiving == rx)]
            if len(values) < 20:
                continue
            values = rng.choice(values, min(len(values), 4000), replace=False)
            parts = axis.violinplot(values, [5 * i + j], widths=0.9, showextrema=False, showmedians=True)
            aligned = (tx - rx) % 360 == 180
            for body in parts["bodies"]:
                body.set(facecolor=COLOURS[j], alpha=0.75 if aligned else 0.35, edgecolor="black" if aligned else COLOURS[j])
            parts["cmedians"].set(color="black", linewidth=1)
    axis.axhline(0, color="#9aa5b1", linewidth=0.7)
    axis.set_xticks([5 * i + 1.5 for i in range(4)], [f"sent to {tx}°" for tx in ANGLES])
    for j, rx in enumerate(ANGLES):
        axis.fill_between([], [], color=COLOURS[j], alpha=0.5, label=f"heard from {rx}°")
    axis.legend(ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    axis.set(ylabel="right wheel", ylim=(-1, 1))
    return figure


def fig_28(champion: Champion) -> Figure:
    """Sent symbols, by the alignment of sender and hearer."""
    trace = champion.trace()
    found = symbols(trace)
    receiving, sending = directions(trace)
    aligned = np.where(receiving < 0, -1, ((sending - receiving) % 360 == 180).astype(int))
    figure, axes = canvas(6, 2.9, 1, 2, sharey=True)
    for axis, (title, value) in zip(axes, {"aligned": 1, "not aligned": 0}.items()):
        shares = [conditional(found.own == code, aligned)[value] for code in range(min(4, len(found.legend)))]
        bars(axis, [symbol_name(it) for it in found.legend[:4]], shares)
        axis.set(title=title, xlabel="symbol")
    axes[0].set_ylabel("% of sent messages")
    return figure


def directions(trace: Trace) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """``[T, steps, R]`` from step ``FIRST`` on, in degrees from the heading: the sector that heard the
    frame, and the sector of its emitter that faced the hearer; -1 without a frame."""
    stimuli = trace.experiment.to_dict()["topology"]["stimuli"]
    of = {it["sensor"].rpartition(":")[2]: name for name, it in stimuli.items()}
    there = trace.frame_sectors[:, FIRST:] >= 0

    def angle(sensor: str) -> NDArray[np.int64]:
        x, y = (trace.stimuli[:, FIRST:, :, trace.stimulus_names.index(f"{of[sensor]}_{i}")] for i in (0, 1))
        return np.where(there, np.round(np.degrees(np.arctan2(y, x))).astype(np.int64) % 360, -1)

    return angle("receiving_direction"), angle("sending_direction")


def _rotation(n: int) -> dict[str, object]:
    return {"uncontrollable_rotation": {"affected_robots": n}} if n else {}


def _headings(axis: Axes, headings: Floats, colour: str, label: str | None = None) -> None:
    lines = axis.plot(headings, color=colour, linewidth=0.7, alpha=0.8)
    if label is not None:
        lines[0].set_label(label)
    axis.set(xlabel="step", ylabel="heading, rad (2π apart: the same)")
    axis.margins(x=0)


def _misalignment(curves: dict[str, Floats]) -> Figure:
    figure, axis = canvas(6, 3)
    bands(axis, curves)
    axis.set(ylabel="misalignment, rad, median and quartiles")
    axis.set_ylim(bottom=0)
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=3)
    return figure


FIGURES = {
    "6.20": fig_20, "6.21": fig_21, "6.22": fig_22, "6.23": fig_23, "6.24": fig_24,
    "6.25": fig_25, "6.26": fig_26, "6.27": fig_27, "6.28": fig_28,
}
