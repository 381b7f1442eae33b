"""Figures of swarms: rasters, bands, boxes, bars, swarms in the plane. Needs Matplotlib (`plot`)."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..extras import needs
from .border import components, displacements
from .proportions import Proportion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#1f6fb4", "#d9480f", "#2b8a3e", "#7b3fa0", "#b08900", "#495057")
"""Colours of curves, in this order."""
ON, OFF = "#d9480f", "#4c78a8"
"""Colours of robots with the LED on or in sight of the light, and of the other robots."""

_STYLE = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "font.size": 9,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "svg.hashsalt": "swarmevo",
}


def style() -> AbstractContextManager[None]:
    """A context that sets the style of figures."""
    with needs("plot"):
        import matplotlib

    return matplotlib.rc_context(_STYLE)


def canvas(width: float, height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """A figure of ``width`` x ``height`` inches and its axes, as ``Figure.subplots`` gives them. No
    window and no global state."""
    with needs("plot"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, **options)


def save_png(figure: Figure, path: Path) -> None:
    """Writes a small PNG with a palette, which is lossless for figures of few colours."""
    from PIL import Image

    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=130)
    image = Image.open(file).convert("RGB")
    image = image.quantize(128, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    image.save(path, optimize=True)


def band(axis: Axes, values: ArrayLike, label: str, colour: str, linewidth: float = 1.3) -> None:
    """Median and quartiles over trials of ``values`` ``[T, K]``; NaN where a trial has none."""
    array = np.asarray(values, np.float64)
    at = np.arange(array.shape[1])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # steps without a value in any trial are gaps
        first, median, third = np.nanquantile(array, (0.25, 0.5, 0.75), axis=0)
    axis.fill_between(at, first, third, color=colour, alpha=0.2, linewidth=0)
    axis.plot(at, median, color=colour, label=label, linewidth=linewidth)


def bands(axis: Axes, curves: Mapping[str, ArrayLike]) -> None:
    """A :func:`band` for each of the curves, with a legend."""
    for i, ((label, values), colour) in enumerate(zip(curves.items(), COLOURS)):
        # The first curve stays visible beneath others that coincide with it.
        band(axis, values, label, colour, linewidth=2.6 if i == 0 else 1.2)
    axis.set_xlabel("step")
    axis.margins(x=0)
    axis.legend()


def raster(axis: Axes, flags: ArrayLike, title: str) -> None:
    """Black where ``flags`` ``[steps, R]`` are true, a row for each robot."""
    shown = np.asarray(flags, bool).T
    axis.imshow(~shown, aspect="auto", interpolation="nearest", cmap="gray", vmin=0, vmax=1)
    axis.set(xlabel="step", ylabel="robot", title=title)
    axis.set_yticks(range(0, len(shown), 1 if len(shown) <= 10 else 5))


def boxes(axis: Axes, groups: Sequence[ArrayLike], labels: Sequence[str], fill: Sequence[str] | None = None) -> None:
    """Box plots with whiskers of 1.5 interquartile ranges."""
    drawn = axis.boxplot(
        [np.asarray(group) for group in groups],
        patch_artist=True,
        widths=0.55,
        flierprops={"marker": "o", "markersize": 3, "markerfacecolor": "white", "markeredgewidth": 0.6},
        medianprops={"color": ON, "linewidth": 1.4},
    )
    for patch, colour in zip(drawn["boxes"], fill or ["#e9eef4"] * len(groups)):
        patch.set(facecolor=colour, linewidth=0.8)
    axis.set_xticks(range(1, len(labels) + 1), list(labels))


def bars(axis: Axes, labels: Sequence[str], shares: Iterable[Proportion], colours: Sequence[str] | None = None) -> None:
    """Proportions in percent, with their 95 % intervals over trials."""
    found = list(shares)
    heights = np.array([100 * it.share for it in found])
    ends = 100 * np.array([it.ci95 for it in found])
    # An interval that is cut off at 0 or 1 has no bar beyond.
    errors = np.abs(np.nan_to_num(ends.T - heights))
    at = range(len(found))
    axis.bar(at, heights, width=0.6, color=colours or [COLOURS[0]] * len(found))
    axis.errorbar(at, heights, yerr=errors, fmt="none", ecolor="black", elinewidth=1, capsize=3)
    for x, it, height, error in zip(at, found, heights, errors[1]):
        axis.annotate(
            f"{height:.1f}" if it.rows else "none", (x, (height if it.rows else 0) + error), ha="center", va="bottom",
            xytext=(0, 2), textcoords="offset points", fontsize=8,
        )
    axis.set_xticks(list(at), list(labels))
    axis.set_xlim(-0.6, max(len(found), 2) - 0.4)
    axis.set_ylim(0, 108)
    axis.set_yticks(range(0, 101, 20))


def unwrapped(headings: ArrayLike) -> NDArray[np.float64]:
    """Headings ``[steps, R]`` without jumps by 2 pi."""
    return np.asarray(np.unwrap(np.asarray(headings, np.float64), axis=0))


def in_one_piece(positions: ArrayLike, size: ArrayLike, reach: float) -> NDArray[np.float64]:
    """Positions ``[R, 2]`` in the plane, each part of the swarm in one piece."""
    found = np.array(positions, np.float64)
    for robots, points in components(positions, size, reach):
        found[robots] = points
    return found


def swarm(
    axis: Axes,
    positions: ArrayLike,
    size: ArrayLike,
    *,
    reach: float,
    colours: str | Sequence[str],
    headings: ArrayLike | None = None,
    edges: bool = True,
    labels: bool = False,
    arrows: float = 9,
) -> None:
    """Robots ``[R, 2]``, with lines between those in radio range (closer than ``reach``), and their
    headings as arrows, ``arrows`` of which fit into the width."""
    points = np.asarray(positions, np.float64)
    if edges:
        ways = displacements(positions, size)
        for one, other in zip(*np.nonzero(np.hypot(ways[..., 0], ways[..., 1]) < reach)):
            if one < other:
                end = points[one] + ways[one, other]
                axis.plot(*zip(points[one], end), color="#c3cad2", linewidth=0.7, zorder=1)
    axis.scatter(points[:, 0], points[:, 1], s=34, c=colours, zorder=3, edgecolors="white", linewidths=0.5)
    if headings is not None:
        angle = np.asarray(headings, np.float64)
        axis.quiver(
            points[:, 0], points[:, 1], np.cos(angle), np.sin(angle), color="#b02a37", zorder=2, angles="xy",
            pivot="tail", width=0.009, headwidth=3.6, headlength=4, headaxislength=3.6, scale=arrows,
        )
    for robot, (x, y) in enumerate(points) if labels else ():
        axis.annotate(str(robot), (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7)
    axis.set_aspect("equal")
    axis.set(xticks=[], yticks=[])
    for spine in axis.spines.values():
        spine.set(visible=True, color="#c3cad2")
