"""The states where a network settles under constant inputs that occur in episodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import arguments
from ..champion import Genes
from ..experiment import Experiment
from ..trace import Trace
from .channel import FIRST
from .ctrnn import CTRNN, Equilibrium, LimitCycle
from ..representation import short

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Settled:
    """The behaviour of an isolated network, from a state of zeros, under one constant input."""

    inputs: Floats
    """``[I]``, rounded to 0.1."""
    share: float
    """Share of robots and steps with this input."""
    attractor: Equilibrium | LimitCycle | None
    """The attractor of its state; None if, after 100 of the slowest time constants, it neither rests nor
    cycles."""
    outputs: dict[str, tuple[float, float]]
    """Minimum and maximum rate of each output neuron in the attractor."""

    __repr__ = short


def settled(experiment: Experiment, genotype: Genes, trace: Trace, most: int = 6) -> list[Settled]:
    """For the ``most`` most frequent inputs from step 10 on; empty for networks of other neurons
    than ``rate_model``."""
    most = arguments.whole(most, "most", 0)
    network = experiment.network(genotype)
    if network.description["neuron_model"] != "rate_model":
        return []
    alone = CTRNN.of(network)
    ensembles = {it["ensemble"] for it in experiment.to_dict()["topology"]["outputs"].values()}
    motors = [i for i, ensemble in enumerate(network.ensembles) if ensemble in ensembles]
    found = []
    for inputs, share in zip(*_frequent_inputs(trace, len(network.inputs), most)):
        it = alone.attractor(inputs, time=100 * float(alone.tau.max()))
        rates = np.empty((0, len(network.neurons))) if it is None else np.atleast_2d(it.rates)
        outputs = {network.neurons[i]: (float(rates[:, i].min()), float(rates[:, i].max())) for i in motors if len(rates)}
        found.append(Settled(inputs, float(share), it, outputs))
    return found


def _frequent_inputs(trace: Trace, n_inputs: int, most: int) -> tuple[Floats, Floats]:
    """The most frequent inputs ``[most, I]``, and their shares."""
    active = ~np.isnan(trace.activities[0, 0, :, 0])
    stimuli = trace.stimuli[:, FIRST:, active, :n_inputs].reshape(-1, n_inputs).astype(np.float64)
    distinct, counts = np.unique(stimuli.round(1) + 0.0, axis=0, return_counts=True)
    order = np.argsort(-counts, kind="stable")[:most]
    return distinct[order], counts[order] / counts.sum()
