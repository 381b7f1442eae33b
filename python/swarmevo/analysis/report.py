"""A report on how one genotype solves its task."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from .. import arguments
from ..champion import Genes
from ..experiment import Experiment
from ..fleet import Client
from ..trials import TRIALS_MAX
from .answer import answer
from .channel import FIRST, informants, symbols
from .drawing import canvas, raster, style
from .findings import Findings, findings
from .generalisation import Condition
from .page import Page
from .proportions import conditional
from .report_network import network
from .wording import mean, message, percent


def report(
    experiment: Experiment,
    genotype: Genes,
    directory: str | os.PathLike[str],
    *,
    title: str | None = None,
    trials: int = 50,
    client: Client | None = None,
) -> Path:
    """Writes ``report.html`` and its tables as CSV to ``directory``; returns the page's path.

    The function simulates ``trials`` episodes of the set of evaluations, which had no part in evolution, and
    as many for every removed input and part of the network. If ``client`` is given, its fleet evaluates other
    conditions and lesions. Needs SciPy and Matplotlib (``analysis``, ``plot``). Raises ``ValueError`` for one
    trial, which has no intervals, and :class:`~swarmevo.OtherExperimentError` for a champion of another
    experiment; for a report under changed conditions, give its ``genotype``.
    """
    trials = arguments.whole(trials, "the number of trials of a report", 2, TRIALS_MAX)
    found = findings(experiment, genotype, trials=trials, client=client)
    trace = found.trace
    page = Page(title or experiment.name, Path(directory))
    page.text(
        f"{trace.n_robots} robots, {trials} episodes of {trace.n_steps} steps that had no part in evolution: "
        f"fitness {mean(trace.fitness)}."
    )
    with style():
        page.heading("How it solves the task")
        page.sentences("answer", answer(found))
        _inputs(page, found)
        _conditions(page, found.conditions)
        if found.use is not None:
            _channel(page, found)
            _meaning(page, found)
        _counterfactuals(page, found)
        _episode(page, found)
        network(page, found)
    return page.write()


def _inputs(page: Page, found: Findings) -> None:
    page.heading("Which inputs matter")
    rows: list[list[object]] = [["none", mean(found.trace.fitness), "", ""]]
    for it in found.inputs:
        change = mean(it.change) if it.change.any() else "the same bits"
        rows.append([it.sensor, mean(it.fitness), change, f"{100 * it.usual:.1f} %"])
    page.table("inputs", ["input that is 0", "fitness", "change, in the same trials", "most frequent value in"], rows)
    page.note(
        "Mean over trials with its 95 % interval. The same worlds and noise with and without the input. "
        "Last column: share of the most frequent value among the readings of the input."
    )


def _conditions(page: Page, conditions: list[Condition]) -> None:
    page.heading("Under other conditions")
    rows = [
        [it.what or "as evolved", "" if np.isnan(it.value) else f"{it.value:g}", it.problem or it.mean, *_ends(it)]
        for it in conditions
    ]
    page.table("conditions", ["changed", "to", "fitness", "from", "to (95 %)"], rows)
    page.note("Mean over trials, with its 95 % interval. All rows have the same trials, except those of other sets.")


def _ends(condition: Condition) -> list[object]:
    return ["", ""] if condition.problem else list(condition.ci95)


def _channel(page: Page, found: Findings) -> None:
    use, trace, words = found.use, found.trace, found.spread
    assert use is not None and words is not None
    page.heading("Messages")
    page.text(
        f"From step {FIRST} on, {100 * use.sends:.1f} % of robots send their own message, the others relay; "
        f"{100 * use.hears:.1f} % hear something. The sent messages have {use.entropy:.2f} bits."
    )
    code = symbols(trace)
    sends = trace.sends[:, FIRST:]
    is_lit = trace.leds[:, FIRST:] > 0
    lit = conditional(is_lit, np.where(sends, code.own, -1))
    rows = [
        [message(it), f"{100 * share:.1f} %", percent(lit.get(code.legend.index(it)))]
        for it, share in list(use.shares.items())[:6]
    ]
    page.table("symbols", ["symbol sent", "share", "LED on"], rows)
    if is_lit.any():
        by_mode = conditional(is_lit, sends.astype(int))
        modes = [[name, percent(by_mode.get(mode))] for mode, name in enumerate(("relay", "send"))]
        page.table("modes", ["mode", "LED on"], modes)
    hops = [[i + 1, f"{100 * part:.1f} %", cm] for i, (part, cm) in enumerate(zip(words.shares, words.distances))]
    page.table("hops", ["emissions until heard", "share of frames", "cm from its sender"], hops)
    page.note("± standard errors over trials.")
    figure, axes = canvas(4.2, 3.6)
    shown = axes.imshow(informants(trace), cmap="Blues", vmin=0)
    axes.set(xlabel="robot that first sent it", ylabel="robot that hears it", title="Flow of messages")
    figure.colorbar(shown, label="share of heard messages")
    page.figure(figure)


def _meaning(page: Page, found: Findings) -> None:
    page.heading("Information of messages, and its use")
    head = ["", "bits", "by chance", "97.5 % of chance below", "p"]

    def row(name: str, it: Any) -> list[object]:
        return [name, it.bits, it.chance, it.chance95, it.p]

    told, heeded = ([row(*it) for it in of.items()] for of in (found.told, found.heeded))
    page.table("signalling", ["the message sent tells of", *head[1:]], told)
    page.table("listening", ["the message heard tells of", *head[1:]], heeded)
    page.note(
        "Mutual information. Chance: the same with the trials of one variable in another order. A message "
        "heard and an action may depend on each other only because neighbours sense alike. The fitness without "
        "the input, above, and the effects of single messages, below, show whether robots heed messages."
    )


def _counterfactuals(page: Page, found: Findings) -> None:
    page.heading("Effects of single messages and readings")
    rows: list[list[object]] = []
    it = found.influence
    if it is not None and it.said.any():
        share = 100 * float((it.reached[it.said] > 0).mean())
        rows.append(["a message sent", int(it.said.sum()), "", f"{share:.1f} %", *_effects(it.leds[it.said], it.fitness[it.said])])
    for sensor, of in found.attention.items():
        if of.sensed.any():
            own, others = (100 * float(part[of.sensed].mean()) for part in (of.heeded, of.reached > 0))
            effects = _effects(of.leds[of.sensed], of.fitness[of.sensed])
            rows.append([f"{sensor}, for one step", int(of.sensed.sum()), f"{own:.1f} %", f"{others:.1f} %", *effects])
    if not rows:
        page.text("No reading can be replaced by zeros.")
        return
    page.table("counterfactuals", ["made 0", "times", "own actions differ", "others do", "LED differs, steps", "fitness"], rows)
    page.note(
        "One change at a time, with the same noise: it alone causes each difference of a bit within 10 steps. LED: of "
        "other robots for a message, of the robot itself for a reading."
    )
    if it is None or not it.said.any():
        return
    figure, axis = canvas(8, 2.6)
    shown = axis.imshow(it.reached[0].T, aspect="auto", interpolation="nearest", cmap="Oranges", vmin=0)
    axis.set_xticks(range(len(it.steps))[::2], [str(step) for step in it.steps[::2]])
    axis.set(xlabel="step in which the message was replaced", ylabel="robot that sent it", title="Robots whose actions then differ, first episode")
    figure.colorbar(shown)
    page.figure(figure)


def _effects(leds: Any, fitness: Any) -> list[object]:
    return [f"{leds.mean():.2f}", f"{fitness.mean():+.3f}"]


def _episode(page: Page, found: Findings) -> None:
    trace = found.trace
    page.heading("One episode")
    panels: dict[str, Any] = {}
    if (trace.leds > 0).any():
        panels["black: LED on"] = trace.leds[0] > 0
    if found.use is not None and not trace.sends[0].all():
        panels["black: sends its own message"] = trace.sends[0]
    figure, axes = canvas(8, 1.5 * (len(panels) + 1) + 0.6, len(panels) + 1, sharex=True, squeeze=False)
    for axis, (name, values) in zip(axes[:, 0], panels.items()):
        raster(axis, values, name)
        axis.set_xlabel("")
    turning = trace.wheels[0, ..., 1] - trace.wheels[0, ..., 0]
    shown, name, limit = (turning, "left wheel minus right", 2) if trace.wheels.any() else (_own_symbols(found), "own symbol, by frequency", None)
    image = axes[-1, 0].imshow(
        shown.T, aspect="auto", interpolation="nearest", cmap="RdBu" if limit else "viridis",
        vmin=-limit if limit else None, vmax=limit,
    )
    axes[-1, 0].set(ylabel="robot", title=name, xlabel="step")
    figure.colorbar(image, ax=axes[-1, 0])
    page.figure(figure)


def _own_symbols(found: Findings) -> Any:
    return symbols(found.trace, 0).own[0] if found.use is not None else np.zeros(found.trace.leds[0].shape)
