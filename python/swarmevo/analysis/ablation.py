"""The worth of parts of a network: its fitness without them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .. import arguments
from ..trials import TRIALS_MAX
from ..champion import Genes
from ..experiment import Experiment
from ..fleet import Client
from ..network import Network
from .generalisation import TRIALS_OF
from ..representation import short

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Parts = Literal["neurons", "inputs", "synapses", "groups"]


@dataclass(frozen=True)
class Lesion:
    """A part of a network, and the fitness without it."""

    part: str
    """Its name, such as ``H1_3``, or ``H1_3 > OUT_LED_0`` for a synapse."""
    weights: Floats
    """Number of synapses that the lesion removes."""
    fitness: float
    """Mean fitness over the trials, without the part."""
    change: float
    """Mean change over the trials: fitness without the part minus fitness with it, in the same world and noise."""
    ci95: tuple[float, float]
    """Change ± 1.96 standard errors over trials."""
    is_same: bool
    """Whether the fitness of all trials has the same bits: the part is not used."""

    __repr__ = short


def ablation(
    experiment: Experiment,
    genotype: Genes,
    parts: Parts = "neurons",
    *,
    trials: int = 50,
    client: Client | None = None,
) -> list[Lesion]:
    """Fitness of a genotype ``[d]`` without each of its network's ``parts``, the largest loss first.

    Weights of exactly 0 remove a part: a synapse; all synapses from a neuron or an input, which then
    influences no other neuron (an output's own value still moves the robot); or a group of synapses of the
    experiment file. All noise stays the same, so the part alone causes the change (Meyes et al. 2019 review
    such experiments). Effects of several parts do not add up.

    The trials had no part in evolution; they run here or on the fleet of ``client``. Raises ``ValueError``
    if no gene encodes a weight of a part, or if no value of the gene gives 0.
    """
    trials = arguments.whole(trials, "trials", 1, TRIALS_MAX)
    genes = experiment._genotype(genotype)
    network = experiment.network(genes)
    named = _parts(network, parts)
    where, zero = synapse_genes(experiment)
    fixed = sorted({name for name, synapses in named if (where[synapses] < 0).any() or np.isnan(zero[synapses]).any()})
    if fixed:
        raise ValueError(f"weights that no gene sets to 0: {', '.join(fixed)}; their range must contain 0")
    genotypes = np.tile(genes, (1 + len(named), 1))
    for row, (_, synapses) in zip(genotypes[1:], named):
        row[where[synapses]] = zero[synapses]
    evaluate = experiment.evaluate if client is None else lambda *it, **of: client.evaluate(experiment, *it, **of)
    fitness = np.asarray(evaluate(genotypes, TRIALS_OF, trials=trials), np.float64)
    weights = np.array([it["weight"] for it in network.description["synapses"]])
    found = [_lesion(name, weights[synapses], without, fitness[0]) for (name, synapses), without in zip(named, fitness[1:])]
    return sorted(found, key=lambda it: it.change)


def synapse_genes(experiment: Experiment) -> tuple[Ints, Floats]:
    """For each of the S synapses of ``experiment.network(...).description``: the number of the gene that
    encodes its weight ``[S]``, -1 without one; and the value of that gene for a weight of 0 ``[S]``, NaN
    without one."""

    def weights(genotype: Floats) -> Floats:
        return np.array([it["weight"] for it in experiment.network(genotype).description["synapses"]])

    d = experiment.n_genes
    # A weight is low + gene * span: both ends, and a genotype whose genes all differ, identify the
    # gene.
    low, high = weights(np.zeros(d)), weights(np.ones(d))
    span = high - low
    is_gene = span != 0
    places = np.where(is_gene, (weights(np.arange(d) / d) - low) / np.where(is_gene, span, 1) * d, -1)
    where = np.where(is_gene, np.round(places), -1).astype(np.int64)
    with np.errstate(divide="ignore", invalid="ignore"):
        zero = np.where(is_gene & (low * high <= 0), -low / span, np.nan)
    silent = np.full(d, 0.5)
    silent[where[~np.isnan(zero)]] = zero[~np.isnan(zero)]
    zero[weights(silent) != 0] = np.nan
    return where, zero


def _parts(network: Network, parts: Parts) -> list[tuple[str, Ints]]:
    """Names, and the numbers of the synapses that each lesion removes."""
    synapses = network.description["synapses"]
    sources = [_source(network, it["pre"]) for it in synapses]
    if parts == "synapses":
        names = [f"{source} > {network.neurons[it['post']]}" for source, it in zip(sources, synapses)]
        return [(name, np.array([i])) for i, name in enumerate(names)]
    if parts == "groups":
        labels = [it["group"] for it in synapses]
        return _grouped(labels, dict.fromkeys(labels))
    if parts in ("neurons", "inputs"):
        return _grouped(sources, network.neurons if parts == "neurons" else network.inputs)
    raise ValueError(f"parts are neurons, inputs, synapses or groups, not {parts!r}")


def _grouped(labels: list[str], names: Iterable[str]) -> list[tuple[str, Ints]]:
    of = np.array(labels)
    found = [(name, np.flatnonzero(of == name)) for name in names]
    return [(name, synapses) for name, synapses in found if len(synapses)]


def _source(network: Network, pre: dict[str, int]) -> str:
    return network.inputs[pre["input"]] if "input" in pre else network.neurons[pre["neuron"]]


def _lesion(name: str, weights: Floats, without: Floats, intact: Floats) -> Lesion:
    changes = without - intact
    change = float(changes.mean())
    error = 1.96 * float(changes.std(ddof=1) / np.sqrt(len(changes))) if len(changes) > 1 else float("nan")
    is_same = bool(np.array_equal(without, intact))
    return Lesion(name, weights, float(without.mean()), change, (change - error, change + error), is_same)
