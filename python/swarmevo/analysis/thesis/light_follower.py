"""Experiment D: Fig. 6.29 to 6.37."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...extras import needs
from ...experiment import Experiment
from ...trace import Trace
from ...trials import TrialSet
from ..channel import FIRST
from ..drawing import COLOURS, ON, bands, boxes, canvas
from .champion import Champion, Floats
from .common import histories, snapshots, without_inputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZES = (5, 10, 15, 20)
RANGE = 80.0
"""Distance within which robots see the light, cm."""
PLACES = {0: "from the front", 1: "from the left", 2: "from behind", 3: "from the right"}


def fig_29(champion: Champion) -> Figure:
    """Fitness by generation."""
    figure, axis = canvas(6, 2.8)
    runs = {"SNES": champion.history("snes"), "SNES (format 2)": champion.history("snes", "format-2")}
    histories(axis, {**runs, "GA": champion.history("ga")})
    return figure


def fig_30(champion: Champion) -> Figure:
    """Distances to the light and to the centre of the swarm, of each robot."""
    trace = _seeing(champion)
    sees = photosensitive(trace)[0]
    figure, axes = canvas(8, 2.9, 1, 2)
    extent = np.array(champion.size)
    light = trace.lights[0, :, :1]
    for axis, target, title in zip(axes, (light, _centre(trace.positions[0], extent)), ("the light", "the swarm's centre")):
        away = _distance(trace.positions[0], target, extent)
        every = np.arange(0, len(away), 10)
        for of, colour, label in ((~sees, "#1a1a1a", "does not see the light"), (sees, ON, "sees the light")):
            lines = axis.plot(every, away[every][:, of], color=colour, linewidth=0.6)
            lines[0].set_label(label)
        axis.set(title=f"distance to {title}", xlabel="step", ylabel="cm")
        axis.set_ylim(bottom=0)
        axis.margins(x=0)
    axes[0].legend()
    return figure


def fig_31(champion: Champion) -> Figure:
    """Snapshots of the swarm and the light."""
    with needs("plot"):
        from matplotlib.patches import Circle

    trace = _seeing(champion)
    sees = photosensitive(trace)[0]
    steps = (0, 49, 199, 399, 599, 799)
    everybody = np.broadcast_to(sees, trace.headings[0].shape)
    figure, axes = snapshots(champion, trace, steps, everybody, show_headings=True, arrows=16)
    for axis, step in zip(axes.flat, steps):
        x, y = trace.lights[0, step, 0]
        axis.scatter([x], [y], s=40, marker="*", color="#e8b004", edgecolors="black", linewidths=0.4, zorder=5)
        axis.add_patch(Circle((x, y), RANGE, fill=False, color="#e8b004", linewidth=1))
    figure.suptitle("Orange: sees the light, within the circle", fontsize=9)
    return figure


def fig_32(champion: Champion) -> Figure:
    """Distances over all episodes."""
    found = champion.measure().measures
    figure, axes = canvas(8, 2.9, 1, 2)
    for axis, of, title in zip(axes, ("light_distance", "center_distance"), ("the light", "the swarm's centre")):
        bands(axis, {"do not see the light": found[f"{of}_others"], "see the light": found[f"{of}_photosensitive"]})
        axis.set(title=f"distance to {title}", ylabel="cm")
        axis.set_ylim(bottom=0)
    return figure


def fig_33(champion: Champion) -> Figure:
    """Distances to the light by the size of the swarm."""
    return _both({f"{n} robots": champion.measure(robots=n).measures for n in SIZES})


def fig_34(champion: Champion) -> Figure:
    """A path of the light that evolution did not use."""
    trace = other_way(champion).simulate(champion.genotype, TrialSet.evaluation(), trials=1)
    way = trace.lights[0, :, 0]
    figure, axis = canvas(3.6, 3.6)
    axis.plot(*way.T, color="#c92a2a", linewidth=0.8)
    axis.scatter(*way[49::50].T, s=14, color="black", zorder=3)
    axis.set(aspect="equal", xlabel="cm", ylabel="cm", title="dots: every 50 steps, before a new target")
    return figure


def fig_35(champion: Champion) -> Figure:
    """Distances to the light on the orbit and on that path."""
    other = other_way(champion).measure(champion.genotype, TrialSet.evaluation(), trials=champion.trials)
    return _both({"orbit, as evolved": champion.measure().measures, "random targets": other.measures})


def fig_36(champion: Champion) -> Figure:
    """Distances to the light without single inputs."""
    return _both(without_inputs(champion, "signal"))


def fig_37(champion: Champion) -> Figure:
    """Turns of robots, by the direction of the light and of a frame."""
    trace = champion.trace()
    turns = (trace.wheels[..., 1] - trace.wheels[..., 0])[:, FIRST:]
    light = light_sectors(trace)[:, FIRST:]
    brightest = np.where(light.max(axis=-1) > 0, light.argmax(axis=-1), -1)
    figure = _parts(8.6, 3.4)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1, 1.15))
    left, right = parts
    axis = left.subplots()
    n = light.shape[-1]
    groups = [turns[brightest == sector] for sector in range(n)]
    there = [i for i, group in enumerate(groups) if len(group) >= 20]
    boxes(axis, [_thinned(groups[i]) for i in there], [f"{360 * i // n}°" for i in there])
    axis.set(xlabel="strongest light from", ylabel="left wheel minus right: positive turns right", title="(a) robots that see the light")
    _densities(right, trace, turns, brightest < 0)
    return figure


def other_way(champion: Champion) -> Experiment:
    """The experiment with a light that moves to random targets (6.4)."""
    config = champion.experiment.to_dict()
    light = config["world"]["objects"]["light_red"]
    config["world"]["objects"]["light_red"] = {**_without_params(light), "controller": "light_rnd_pos_controller"}
    return Experiment.from_dict(config, champion.name)


def light_sectors(trace: Trace) -> Floats:
    """``[T, steps, R, S]``: readings of the light sensor."""
    stimuli = trace.experiment.to_dict()["topology"]["stimuli"].items()
    name, n = next((name, it["n"]) for name, it in stimuli if it["sensor"] == "light_sensor")
    first = trace.stimulus_names.index(f"{name}_0")
    return np.asarray(trace.stimuli[..., first : first + n], np.float64)


def photosensitive(trace: Trace) -> NDArray[np.bool_]:
    """``[T, R]``: whether a robot has ever seen the light."""
    return np.asarray((light_sectors(trace) > 0).any(axis=(1, 3)))


def _seeing(champion: Champion) -> Trace:
    """The first trial in which both robots that can see the light do so."""
    trials = range(champion.trials)
    return next(it for trial in trials if photosensitive(it := champion.trace(range(trial, trial + 1)))[0].sum() == 2)


def _both(conditions: dict[str, dict[str, Floats]]) -> Figure:
    figure, axes = canvas(8.6, 3, 1, 2, sharey=True)
    for axis, of, title in zip(axes, ("others", "photosensitive"), ("(a) do not see the light", "(b) see the light")):
        bands(axis, {label: found[f"light_distance_{of}"] for label, found in conditions.items()})
        axis.set_title(title)
    axes[0].set_ylabel("distance to the light, cm")
    axes[0].set_ylim(bottom=0)
    axes[0].get_legend().remove()
    return figure


def _densities(figure: Any, trace: Trace, turns: Floats, is_dark: NDArray[np.bool_]) -> None:
    """Kernel density estimates of signal and turn, by the sector of the frame, with both margins."""
    with needs("analysis"):
        from scipy.stats import gaussian_kde

    grid = figure.add_gridspec(2, 2, width_ratios=(4, 1), height_ratios=(1, 4))
    axis = figure.add_subplot(grid[1, 0])
    above = figure.add_subplot(grid[0, 0], sharex=axis)
    beside = figure.add_subplot(grid[1, 1], sharey=axis)
    signals, sectors = trace.frame_signals[:, FIRST:], trace.frame_sectors[:, FIRST:]
    across, along = np.linspace(0.4, 1, 80), np.linspace(-1.1, 1.1, 80)
    mesh = np.stack(np.meshgrid(across, along)).reshape(2, -1)
    for sector, label in PLACES.items():
        here = is_dark & (sectors == sector)
        signal, turn = _thinned(signals[here]), _thinned(turns[here])
        if len(signal) < 50 or signal.std() < 1e-9 or turn.std() < 1e-9:
            continue
        colour = COLOURS[sector]
        density = gaussian_kde(np.stack([signal, turn]))(mesh).reshape(80, 80)
        axis.contour(across, along, density, levels=density.max() * np.array([0.1, 0.3, 0.5, 0.7, 0.9]), colors=colour, linewidths=0.9)
        axis.plot([], [], color=colour, label=label)
        above.plot(across, gaussian_kde(signal)(across), color=colour, linewidth=1)
        beside.plot(gaussian_kde(turn)(along), along, color=colour, linewidth=1)
    for margin in (above, beside):
        margin.axis("off")
    above.set_title("(b) no light; a frame is heard")
    axis.set(xlabel="strength of its signal", ylabel="left wheel minus right")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=4, columnspacing=0.8, handlelength=1.2)


def _thinned(values: Floats, most: int = 3000) -> Floats:
    """At most a number of elements, spread evenly."""
    return np.asarray(values[:: max(1, len(values) // most)], np.float64)


def _parts(width: float, height: float) -> Figure:
    with needs("plot"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _distance(positions: Floats, targets: Floats, extent: Floats) -> Floats:
    """``[steps, R]``: distances on the torus to ``targets`` ``[steps, 1, 2]``."""
    way = positions - targets
    way -= extent * np.round(way / extent)
    return np.asarray(np.hypot(way[..., 0], way[..., 1]))


def _centre(positions: Floats, extent: Floats) -> Floats:
    """``[steps, 1, 2]``: the circular mean on each axis."""
    angles = 2 * np.pi * positions / extent
    mean = np.arctan2(np.sin(angles).mean(axis=1), np.cos(angles).mean(axis=1))
    return np.asarray((mean / (2 * np.pi) * extent)[:, np.newaxis])


def _without_params(light: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in light.items() if key != "controller_params"}


FIGURES: dict[str, Callable[[Champion], Figure]] = {
    "6.29": fig_29, "6.30": fig_30, "6.31": fig_31, "6.32": fig_32, "6.33": fig_33,
    "6.34": fig_34, "6.35": fig_35, "6.36": fig_36, "6.37": fig_37,
}
