"""Networks, which genotypes encode."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .extras import needs
from .trials import AnyTrialSet

if TYPE_CHECKING:
    import networkx

    from .experiment import Experiment


class Network:
    """A network's neurons, inputs and synapses, as matrices and as a graph.

    Neurons are numbered in the order of the ensembles of the experiment file, inputs in that
    of its stimuli.
    """

    def __init__(self, description: dict[str, Any]) -> None:
        self.description: dict[str, Any] = description
        """The whole network, as in ``swarmctl champion --output json``."""
        neurons = description["neurons"]
        self.inputs: list[str] = [
            f"{it['name']}_{i}" for it in description["stimuli"] for i in range(it["n"])
        ]
        """Names of the I inputs: ``STIMULUS_0`` and so on."""
        self.ensembles: list[str] = [neuron["ensemble"] for neuron in neurons]
        """The ensemble of each of the N neurons."""
        seen: dict[str, int] = {}
        self.neurons: list[str] = []
        """Names of the N neurons: ``ENSEMBLE_0`` and so on."""
        for ensemble in self.ensembles:
            self.neurons.append(f"{ensemble}_{seen.setdefault(ensemble, 0)}")
            seen[ensemble] += 1
        names = [key for key in (neurons[0] if neurons else {}) if _is_number(neurons[0][key])]
        self.parameters: dict[str, NDArray[np.float64]] = {
            name: np.array([neuron[name] for neuron in neurons]) for name in names
        }
        """Parameters of the neurons by name, such as ``tau``, ``bias`` and ``gain`` of ``ctrnn``: ``[N]``."""
        self.input_weights: NDArray[np.float64] = np.zeros((len(neurons), len(self.inputs)))
        """``[N, I]``: weight of each synapse from an input, 0 without a synapse."""
        self.weights: NDArray[np.float64] = np.zeros((len(neurons), len(neurons)))
        """``[N, N]``: ``weights[post, pre]``, 0 without a synapse."""
        self.nodes: list[str] = [
            f"{it['name']}_node_{i}"
            for it in description["stimuli"]
            for i in range(it.get("encoder", {}).get("n_nodes", 0))
        ]
        """Names of the E nodes of encoders, which spike: ``STIMULUS_node_0`` and so on."""
        self.node_weights: NDArray[np.float64] = np.zeros((len(neurons), len(self.nodes)))
        """``[N, E]``: weight of each synapse from a node of an encoder."""
        for synapse in description["synapses"]:
            pre = synapse["pre"]
            if "input" in pre:
                self.input_weights[synapse["post"], pre["input"]] += synapse["weight"]
            elif "node" in pre:
                self.node_weights[synapse["post"], pre["node"]] += synapse["weight"]
            else:
                self.weights[synapse["post"], pre["neuron"]] += synapse["weight"]

    _origin: tuple[Experiment, NDArray[np.float64]] | None = None

    def to_c(
        self,
        directory: str | os.PathLike[str],
        generation: AnyTrialSet = 0,
        *,
        trials: int | range | None = 1,
    ) -> list[Path]:
        """Writes the controller with its radio as C99, with T recorded trials: ``make test`` in the
        directory compares every bit with them. Replaces existing files, and returns all paths. As
        ``swarmctl export-controller``, for networks of :meth:`Experiment.network`."""
        experiment, genes = self._found("to_c")
        files = experiment._controller_c(genes, generation, trials)
        directory = Path(directory)
        directory.mkdir(parents=True, exist_ok=True)
        for name, content in files:
            (directory / name).write_bytes(content)
        return [directory / name for name, _ in files]

    def to_onnx(self, path: str | os.PathLike[str]) -> Path:
        """Writes one step of the controller as a graph of ONNX, for R robots at once: from ``stimulus_NAME``
        ``[R, n]`` and ``state`` to ``activities`` ``[R, N]``, ``next_state`` and what the robots do. Leave ``state``
        out in the first step. Replaces an existing file, and returns its path. Raises :class:`ValueError` for
        spiking and for plastic networks. As ``swarmctl export-controller --language onnx``, for networks of
        :meth:`Experiment.network`."""
        experiment, genes = self._found("to_onnx")
        path = Path(path)
        path.write_bytes(experiment._controller_onnx(genes))
        return path

    def _found(self, method: str) -> tuple[Experiment, NDArray[np.float64]]:
        if self._origin is None:
            raise ValueError(f"this network is only a description; {method} needs one of experiment.network(genotype)")
        return self._origin

    def to_networkx(self) -> networkx.MultiDiGraph:
        """A graph with a node per input, node of an encoder and neuron, under their names, and an
        edge per synapse with ``weight``, ``group`` (its name in the file) and ``trainable``."""
        with needs("network"):
            import networkx

        graph: networkx.MultiDiGraph = networkx.MultiDiGraph()
        for name in self.inputs:
            graph.add_node(name, kind="input")
        for name in self.nodes:
            graph.add_node(name, kind="node")
        for i, name in enumerate(self.neurons):
            graph.add_node(name, kind="neuron", **self.description["neurons"][i])
        for synapse in self.description["synapses"]:
            pre = synapse["pre"]
            if "input" in pre:
                source = self.inputs[pre["input"]]
            elif "node" in pre:
                source = self.nodes[pre["node"]]
            else:
                source = self.neurons[pre["neuron"]]
            rest = {key: synapse[key] for key in synapse if key not in ("pre", "post")}
            graph.add_edge(source, self.neurons[synapse["post"]], **rest)
        return graph

    def __repr__(self) -> str:
        n_synapses = len(self.description["synapses"])
        return (
            f"<Network: {len(self.inputs)} inputs, {len(self.neurons)} neurons, "
            f"{n_synapses} synapses>"
        )


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
