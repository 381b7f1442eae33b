"""How does it do it? A report on one genotype."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..experiment import Experiment
from ..fleet import Client
from ..trace import Trace
from ..trials import TrialSet
from .channel import FIRST, channel_use, informants, listening, signalling, symbols
from .counterfactual import influence
from .ctrnn import CTRNN, Equilibrium, LimitCycle
from .generalisation import Condition, generalisation
from .information import Codes, codes, discretise
from .page import Page
from .proportions import conditional

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def report(
    experiment: Experiment,
    genotype: ArrayLike,
    directory: str | os.PathLike[str],
    *,
    title: str | None = None,
    trials: int = 50,
    client: Client | None = None,
) -> Path:
    """Writes ``report.html`` and its tables as CSV to ``directory``; returns the page's path.

    ``trials`` episodes of the set of evaluations are simulated, which had no part in evolution, and
    as many for every input that is taken away. Other conditions are evaluated on the fleet of ``client``,
    if there is one. Needs SciPy and Matplotlib (``analysis``, ``plot``).
    """
    genes = np.asarray(genotype, dtype=np.float64)
    trace = experiment.simulate(genes, TrialSet.evaluation(), trials=trials)
    page = Page(title or experiment.name, Path(directory))
    page.text(
        f"{trace.n_robots} robots, {trials} episodes of {trace.n_steps} steps that had no part in evolution: "
        f"fitness {_mean(trace.fitness)}."
    )
    _inputs(page, experiment, genes, trace)
    _conditions(page, generalisation(experiment, genes, trials=trials, client=client))
    _channel(page, trace)
    _meaning(page, trace)
    _influence(page, experiment, genes)
    _episode(page, trace)
    _network(page, experiment, genes, trace)
    return page.write()


def _inputs(page: Page, experiment: Experiment, genotype: NDArray[np.float64], trace: Trace) -> None:
    page.heading("Which inputs matter")
    rows: list[list[object]] = [["none", _mean(trace.fitness), ""]]
    for sensor in _sensors(experiment):
        blind = _without(experiment, sensor)
        fitness = blind.evaluate(genotype[np.newaxis], TrialSet.evaluation(), trials=len(trace.fitness))[0]
        change = "the same bits" if np.array_equal(fitness, trace.fitness) else _mean(fitness - trace.fitness)
        rows.append([sensor, _mean(fitness), change])
    page.table("inputs", ["input that is 0", "fitness", "change, in the same trials"], rows)
    page.note("Mean over trials with its 95 % interval. The same worlds and noise with and without the input.")


def _conditions(page: Page, conditions: list[Condition]) -> None:
    page.heading("Under other conditions")
    rows = [
        [it.what or "as evolved", "" if np.isnan(it.value) else f"{it.value:g}", it.problem or it.mean, *_ends(it)]
        for it in conditions
    ]
    page.table("conditions", ["changed", "to", "fitness", "from", "to (95 %)"], rows)
    page.note("Mean over trials that have the same numbers in all rows, and its 95 % interval.")


def _ends(condition: Condition) -> list[object]:
    return ["", ""] if condition.problem else list(condition.ci95)


def _channel(page: Page, trace: Trace) -> None:
    use = channel_use(trace)
    page.heading("What is said")
    page.text(
        f"From step {FIRST} on, {100 * use.sends:.1f} % of robots send their own message, the others relay; "
        f"{100 * use.hears:.1f} % hear something. What is sent has {use.entropy:.2f} bits."
    )
    found = symbols(trace)
    sends = trace.sends[:, FIRST:]
    is_lit = trace.leds[:, FIRST:] > 0
    lit = conditional(is_lit, np.where(sends, found.own, -1))
    rows = [
        [_message(message), f"{100 * share:.1f} %", _percent(lit.get(found.legend.index(message)))]
        for message, share in list(use.shares.items())[:6]
    ]
    page.table("symbols", ["symbol sent", "share", "LED on"], rows)
    if is_lit.any():
        by_mode = conditional(is_lit, sends.astype(int))
        modes = [[name, _percent(by_mode.get(mode))] for mode, name in enumerate(("relay", "send"))]
        page.table("modes", ["mode", "LED on"], modes)
    hops = [[i + 1, f"{100 * share:.1f} %"] for i, share in enumerate(use.hops)]
    page.table("hops", ["emissions until heard", "share of frames"], hops)
    page.note("± standard errors over trials.")
    figure, axes = _figure(4.2, 3.6)
    shown = axes.imshow(informants(trace), cmap="Blues", vmin=0)
    axes.set(xlabel="robot that said it first", ylabel="robot that hears it", title="Who informs whom")
    figure.colorbar(shown, label="share of what is heard")
    page.figure(figure)


def _meaning(page: Page, trace: Trace) -> None:
    page.heading("What it tells, and who heeds it")
    head = ["", "bits", "by chance", "97.5 % of chance below", "p"]

    def row(name: str, it: Any) -> list[object]:
        return [name, it.bits, it.chance, it.chance95, it.p]

    told = {name: code for name, code in _states(trace).items() if _varies(code)}
    page.table("signalling", ["the message sent tells of", *head[1:]], [row(n, signalling(trace, c)) for n, c in told.items()])
    done = {name: code for name, code in _responses(trace).items() if _varies(code)}
    page.table("listening", ["the message heard tells of", *head[1:]], [row(n, listening(trace, c)) for n, c in done.items()])
    page.note(
        "Mutual information. Chance: the same with the trials of one variable in another order. What is "
        "heard and what is done may also depend on each other because neighbours sense alike; what happens "
        "without the input, above, and without single messages, below, says whether they are heeded."
    )


def _influence(page: Page, experiment: Experiment, genotype: NDArray[np.float64]) -> None:
    page.heading("What single messages did")
    steps = range(FIRST, experiment.n_steps - 1, max(1, experiment.n_steps // 20))
    it = influence(experiment, genotype, steps, trials=10)
    if not it.said.any():
        page.text("Every message that is sent is 0 already: there is nothing to replace.")
        return
    moved = it.reached > 0
    page.text(
        f"{it.said.sum()} messages were replaced by zeros, one at a time, with all noise as it was: "
        f"{100 * moved[it.said].mean():.0f} % of them changed what another robot did within 10 steps, "
        f"{it.reached[it.said].mean():.1f} robots on average; another LED was otherwise for "
        f"{it.leds[it.said].mean():.2f} steps, and the fitness of these steps changed by {it.fitness[it.said].mean():+.3f}."
    )
    figure, axis = _figure(8, 2.6)
    shown = axis.imshow(it.reached[0].T, aspect="auto", interpolation="nearest", cmap="Oranges", vmin=0)
    axis.set_xticks(range(len(it.steps))[::2], [str(step) for step in it.steps[::2]])
    axis.set(xlabel="step in which the message was replaced", ylabel="robot that said it", title="Robots that then acted otherwise, first episode")
    figure.colorbar(shown)
    page.figure(figure)


def _episode(page: Page, trace: Trace) -> None:
    page.heading("One episode")
    found = symbols(trace, 0)
    panels = {"LED": trace.leds[0] > 0, "sends": trace.sends[0], "own symbol, by frequency": found.own[0]}
    figure, axes = _figure(8, 1.3 + 1.2 * len(panels), len(panels))
    for axis, (name, values) in zip(axes, panels.items()):
        axis.imshow(values.T, aspect="auto", interpolation="nearest", cmap="Greys" if values.dtype == bool else "viridis")
        axis.set(ylabel="robot", title=name)
    axes[-1].set_xlabel("step")
    figure.tight_layout()
    page.figure(figure)


def _network(page: Page, experiment: Experiment, genotype: NDArray[np.float64], trace: Trace) -> None:
    network = experiment.network(genotype)
    if network.description["neuron_model"] != "rate_model":
        return
    page.heading("The network alone")
    alone = CTRNN.of(network)
    active = ~np.isnan(trace.activities[0, 0, :, 0])
    stimuli = trace.stimuli[:, FIRST:, active, : len(network.inputs)].reshape(-1, len(network.inputs))
    distinct, counts = np.unique(stimuli.round(1) + 0.0, axis=0, return_counts=True)
    order = np.argsort(-counts, kind="stable")[:6]
    rows = []
    for i in order:
        it = alone.attractor(distinct[i], time=100 * float(alone.tau.max()))
        rows.append([_message(tuple(distinct[i].tolist())), f"{100 * counts[i] / counts.sum():.1f} %", _kind(it)])
    page.table("attractors", [", ".join(network.inputs), "share of steps", "where the state goes if it stays"], rows)
    states = trace.activities[:, FIRST:, active].reshape(-1, trace.activities.shape[-1]).astype(float)
    centred = states - states.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov(centred.T))
    shares = values[::-1] / max(values.sum(), 1e-300)
    page.text(f"The first two principal components have {100 * shares[:2].sum():.0f} % of the variance of {len(values)} neurons.")
    figure, axis = _figure(5, 4)
    plane = centred @ vectors[:, [-1, -2]]
    lit = (trace.leds[:, FIRST:, active] > 0).reshape(-1)
    step = max(1, len(plane) // 4000)
    for is_lit, colour, label in ((False, "#7f8c9b", "LED off"), (True, "#d9480f", "LED on")):
        points = plane[::step][lit[::step] == is_lit]
        axis.scatter(points[:, 0], points[:, 1], s=3, color=colour, label=label, rasterized=True)
    axis.set(xlabel="first component", ylabel="second component", title="States in these episodes")
    axis.legend(markerscale=3)
    page.figure(figure)


def _states(trace: Trace) -> dict[str, Codes]:
    named = zip(trace.stimulus_names, np.moveaxis(trace.stimuli, -1, 0))
    return {
        "its LED": trace.leds.astype(np.int64),
        "what its LED should be": trace.targets.astype(np.int64),
        "the sector that it heard": trace.frame_sectors.astype(np.int64) + 1,
        **{f"its input {name}": discretise(values) for name, values in named},
    }


def _responses(trace: Trace) -> dict[str, Codes]:
    return {
        "its LED": trace.leds.astype(np.int64),
        "whether it sends": trace.sends.astype(np.int64),
        "its own message": codes(*np.moveaxis(trace.messages, -1, 0)),
        "how it turns": discretise(trace.wheels[..., 1] - trace.wheels[..., 0], 3),
        "how fast it drives": discretise(trace.wheels.sum(axis=-1), 3),
    }


def _varies(code: Codes) -> bool:
    known = code[:, FIRST:][code[:, FIRST:] >= 0]
    return known.size > 0 and bool((known != known.flat[0]).any())


def _sensors(experiment: Experiment) -> list[str]:
    stimuli = experiment.to_dict()["topology"]["stimuli"].values()
    return list(dict.fromkeys(it["sensor"] for it in stimuli))


def _without(experiment: Experiment, sensor: str) -> Experiment:
    """The same experiment, in which one input of the evolved robots is 0."""
    config = experiment.to_dict()
    for name in _evolved(config):
        perturbations = config["world"]["objects"][name].setdefault("perturbations", {})
        before = perturbations.get("stimuli_inhibition", [])
        before = before if isinstance(before, list) else [before]
        perturbations["stimuli_inhibition"] = [*before, {"stimuli": sensor, "affected_robots": "all"}]
    return Experiment.from_dict(config)


def _evolved(config: dict[str, Any]) -> list[str]:
    objects = config["world"]["objects"].items()
    return [name for name, it in objects if it["type"] == "robot" and it.get("controller") == "neural_controller"]


def _kind(it: Equilibrium | LimitCycle | None) -> str:
    if isinstance(it, Equilibrium):
        return "to a point"
    return f"round in {it.period:.1f}" if isinstance(it, LimitCycle) else "neither to rest nor round, as far as was followed"


def _mean(values: NDArray[np.float64]) -> str:
    error = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return f"{values.mean():.3f} ± {1.96 * error:.3f}"


def _message(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{value + 0.0:.2g}" for value in values) + ")"


def _percent(it: Any) -> str:
    return "" if it is None or it.rows == 0 else f"{100 * it.share:.1f} ± {100 * it.error:.1f} %"


def _figure(width: float, height: float, rows: int = 1) -> tuple[Figure, Any]:
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    matplotlib.rcParams["svg.hashsalt"] = "swarmevo"
    figure = Figure(figsize=(width, height))
    FigureCanvasSVG(figure)
    return figure, figure.subplots(rows) if rows > 1 else figure.subplots()
