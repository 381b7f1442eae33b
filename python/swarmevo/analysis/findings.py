"""The measurements of a genotype for a report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..champion import Genes
from ..experiment import Experiment
from ..fleet import Client
from ..trace import Trace
from ..trials import TrialSet
from .ablation import Lesion, ablation
from .channel import FIRST, ChannelUse, channel_use, listening, signalling
from .counterfactual import Attention, Influence, attention, influence, input_columns
from .generalisation import Condition, generalisation
from .information import Codes, Dependence, codes, discretise
from .settling import Settled, settled
from .spread import Spread, spread
from .states import Components, components_of_states
from .variants import variant
from ..representation import short

Floats = NDArray[np.float64]

COUNTERFACTUAL_TRIALS = 10
"""Number of episodes for counterfactuals; each counterfactual simulates another episode."""
MOMENTS = 20
"""Approximate number of steps of an episode with counterfactuals."""


@dataclass(frozen=True)
class Input:
    """One sensor, or one of its readings, as an input of networks."""

    sensor: str
    fitness: Floats
    """``[T]``: without it."""
    change: Floats
    """``[T]``: fitness without the input minus fitness with it."""
    usual: float
    """Share of its most frequent value, among the robots and steps with a reading."""

    __repr__ = short


@dataclass(frozen=True)
class Findings:
    """Findings about one genotype, in trials that had no part in its evolution."""

    experiment: Experiment
    genotype: Floats
    trace: Trace
    inputs: list[Input]
    """Inputs, the largest loss first."""
    conditions: list[Condition]
    use: ChannelUse | None
    """None for robots without radio, whose other findings about messages are empty."""
    spread: Spread | None
    told: dict[str, Dependence]
    """The information of a message about its sender."""
    heeded: dict[str, Dependence]
    """The information of a message about its hearer's next action."""
    influence: Influence | None
    attention: dict[str, Attention]
    """For each sensor: the effect of zeros instead of its readings, for one step of one robot."""
    lesions: dict[str, list[Lesion]]
    """Lesions of groups of synapses and of neurons, the largest loss first."""
    components: Components
    settled: list[Settled]
    """The states where an isolated network of rate neurons settles, under the most frequent
    inputs."""

    __repr__ = short


def findings(experiment: Experiment, genotype: Genes, *, trials: int, client: Client | None = None) -> Findings:
    """Measures everything, in some 30 s of processor time for 10 robots and 300 steps, 50
    trials."""
    genotype = experiment._genotype(genotype)
    trace = experiment.simulate(genotype, TrialSet.evaluation(), trials=trials)
    sensors = _sensors(experiment)
    inputs = sorted((_input(experiment, genotype, trace, it) for it in sensors), key=lambda it: float(it.change.mean()))
    moments = range(FIRST, experiment.n_steps - 1, max(1, experiment.n_steps // MOMENTS))
    has_radio = trace.messages.shape[-1] > 0
    told = {name: code for name, code in states(trace).items() if _varies(code)} if has_radio else {}
    done = {name: code for name, code in responses(trace).items() if _varies(code)} if has_radio else {}
    few = min(trials, COUNTERFACTUAL_TRIALS)
    readers = dict.fromkeys(it.partition(":")[0] for it in sensors)
    return Findings(
        experiment,
        genotype,
        trace,
        inputs,
        generalisation(experiment, genotype, trials=trials, client=client),
        channel_use(trace) if has_radio else None,
        spread(trace) if has_radio else None,
        {name: signalling(trace, code) for name, code in told.items()},
        {name: listening(trace, code) for name, code in done.items()},
        influence(experiment, genotype, moments, trials=few) if has_radio else None,
        {it: attention(experiment, genotype, moments, sensor=it, trials=few) for it in readers},
        {of: _lesions(experiment, genotype, of, trials, client) for of in ("groups", "neurons")},
        components_of_states(trace),
        settled(experiment, genotype, trace),
    )


def states(trace: Trace) -> dict[str, Codes]:
    """Properties of a sender that a message may reveal, as codes ``[T, steps, R]``."""
    named = zip(trace.stimulus_names, np.moveaxis(trace.stimuli, -1, 0))
    return {
        "its LED": trace.leds.astype(np.int64),
        "what its LED should be": trace.targets.astype(np.int64),
        "the sector that it heard": trace.frame_sectors.astype(np.int64) + 1,
        **{f"its input {name}": discretise(values) for name, values in named},
    }


def responses(trace: Trace) -> dict[str, Codes]:
    """Actions of a hearer, as codes ``[T, steps, R]``."""
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


def _input(experiment: Experiment, genotype: Floats, trace: Trace, sensor: str) -> Input:
    blind = variant(experiment, without=sensor)
    fitness = blind.evaluate(genotype, TrialSet.evaluation(), trials=len(trace.fitness))
    values = trace.stimuli[:, FIRST:, :, input_columns(experiment, sensor)]
    # Without a frame, the readings of the radio are zeros.
    there = trace.frame_emitters[:, FIRST:] >= 0 if sensor.startswith("wireless_receiver") else np.isfinite(values).all(axis=-1)
    rows = values[there & np.isfinite(values).all(axis=-1)]
    counts = np.unique(rows, axis=0, return_counts=True)[1] if len(rows) else np.array([0])
    return Input(sensor, fitness, fitness - trace.fitness, float(counts.max() / max(1, len(rows))))


def _lesions(experiment: Experiment, genotype: Floats, of: str, trials: int, client: Client | None) -> list[Lesion]:
    try:
        return ablation(experiment, genotype, "groups" if of == "groups" else "neurons", trials=trials, client=client)
    except ValueError:
        return []  # Weights that no gene sets to 0 cannot be removed.
