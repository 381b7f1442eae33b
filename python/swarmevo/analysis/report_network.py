"""The part of a report on the network."""

from __future__ import annotations

import numpy as np

from ..network import Network
from .channel import FIRST
from .continuation import continuation
from .ctrnn import CTRNN
from .drawing import COLOURS, OFF, ON, canvas
from .findings import Findings
from .page import Page
from .wording import attractor, bifurcations, message

SHOWN = 10
"""Number of lesions of each kind in a table, the worst first."""


def network(page: Page, found: Findings) -> None:
    """Lesions, synapses, states in episodes, and, for rate neurons, the isolated network."""
    whole = found.experiment.network(found.genotype)
    page.heading("Worth of each part of the network")
    for of, lesions in found.lesions.items():
        rows = [
            [it.part, len(it.weights), it.fitness, "the same bits" if it.is_same else f"{it.change:+.3f} ({it.ci95[0]:+.3f} to {it.ci95[1]:+.3f})"]
            for it in lesions
        ]
        page.table(f"lesions-{of}", [f"without ({of})", "synapses", "fitness", "change (95 %)"], rows, shown=SHOWN)
    page.note(f"Each row sets weights to 0, with the same noise. The {SHOWN} largest losses; the CSV files have all.")
    _synapses(page, whole)
    _states(page, found)
    if found.settled:
        _alone(page, found, whole)


def _synapses(page: Page, whole: Network) -> None:
    weights = np.hstack([whole.input_weights, whole.weights])
    names = [*whole.inputs, *whole.neurons]
    limit = float(np.abs(weights).max()) or 1.0
    figure, axis = canvas(7.5, 5.4)
    shown = axis.imshow(np.where(weights == 0, np.nan, weights), cmap="RdBu_r", vmin=-limit, vmax=limit)
    axis.set_xticks(range(len(names)), names, rotation=90, fontsize=6)
    axis.set_yticks(range(len(whole.neurons)), whole.neurons, fontsize=6)
    for edge in _edges(whole.ensembles):
        axis.axhline(edge - 0.5, color="#9aa5b1", linewidth=0.6)
        axis.axvline(len(whole.inputs) + edge - 0.5, color="#9aa5b1", linewidth=0.6)
    axis.axvline(len(whole.inputs) - 0.5, color="black", linewidth=0.8)
    axis.set(xlabel="from", ylabel="to", title="Synapses")
    figure.colorbar(shown, label="weight")
    page.figure(figure)


def _edges(ensembles: list[str]) -> list[int]:
    return [i for i in range(1, len(ensembles)) if ensembles[i] != ensembles[i - 1]]


def _states(page: Page, found: Findings) -> None:
    trace, of = found.trace, found.components
    page.heading("States in these episodes")
    page.text(
        f"The first two principal components have {100 * of.shares[:2].sum():.0f} % of the variance of "
        f"{len(of.shares)} neurons; the states use about {of.dimension:.1f} dimensions."
    )
    scores = of.scores[..., :2]
    figure, axes = canvas(9, 3.4, 1, 2)
    active = ~np.isnan(scores[..., 0])
    lit = trace.leds[:, FIRST:] > 0
    plane, on = scores[active], lit[active]
    every = max(1, len(plane) // 4000)
    for is_lit, colour, label in ((False, OFF, "LED off"), (True, ON, "LED on")):
        points = plane[::every][on[::every] == is_lit]
        if len(points):
            axes[0].scatter(points[:, 0], points[:, 1], s=3, color=colour, label=label, rasterized=True)
    axes[0].set(xlabel="first component", ylabel="second component", title="all robots and episodes")
    if on.any():
        axes[0].legend(markerscale=3)
    for robot in np.flatnonzero(active[0, 0])[: len(COLOURS)]:
        course = scores[0, :, robot]
        axes[1].plot(course[:, 0], course[:, 1], color=COLOURS[robot % len(COLOURS)], linewidth=0.6, label=f"robot {robot}")
    axes[1].set(xlabel="first component", title="courses in the first episode")
    axes[1].legend(fontsize=7)
    page.figure(figure)


def _alone(page: Page, found: Findings, whole: Network) -> None:
    page.heading("The network alone")
    rows = [
        [message(it.inputs.tolist()), f"{100 * it.share:.1f} %", attractor(it.attractor), *(_range(*ends) for ends in it.outputs.values())]
        for it in found.settled
    ]
    outputs = list(found.settled[0].outputs)
    page.table("attractors", [", ".join(whole.inputs), "share of steps", "the state settles", *outputs], rows)
    alone, first = CTRNN.of(whole), found.settled[0].inputs
    ways = []
    for it in found.settled[1:]:
        branches = continuation(alone, first, it.inputs, starts=40, max_step=0.1)
        points = [sum(bool(branch.stable[i]) for branch in branches for i in (0, -1) if branch.shares[i] == end) for end in (0.0, 1.0)]
        ways.append([message(it.inputs.tolist()), points[0], points[1], bifurcations(branches)])
    page.table("continuation", [f"from {message(first.tolist())} to", "points that attract there", "and here", "on the way"], ways)
    page.note(
        "Constant inputs, by frequency, rounded to 0.1, and the rates of the output neurons where the state settles. On the way: "
        "the shares of the way at which two equilibria meet (fold) or a cycle begins (Hopf). In episodes, inputs change faster "
        "than a network settles: the states above show its course in between."
    )


def _range(least: float, largest: float) -> str:
    return f"{least:.2f}" if largest - least < 0.005 else f"{least:.2f} to {largest:.2f}"
