#!/usr/bin/env python3
"""Prints how many genes SpikeSwarmSim gives to the networks of the thesis's experiments.

    results/genotypes.py [FILE...]    experiment files; by default one per network

SpikeSwarmSim draws connections with numpy's generator, seeded with 821, group by group in the order of
the file. `swarmctl validate` prints the number of genes in this simulator, which draws from another
generator. Needs Python 3.9 and nothing else.
"""

import json
import random
import sys
from pathlib import Path

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
NETWORKS = [
    "leader_selection_ga",
    "original/borderline_ga_program",
    "original/orientation_consensus_ga_program",
    "original/light_follower_ga_program",
    "original/light_follower_snes_program",
]
SEED = 821
# A bias, a gain and a time constant.
GENES_OF_A_NEURON = 3


def numpy_generator(seed):
    """The Mersenne Twister in the state of numpy.random.seed(seed): `random` gives the same numbers."""
    words = [seed]
    for i in range(1, 624):
        words.append((1812433253 * (words[-1] ^ (words[-1] >> 30)) + i) & 0xFFFFFFFF)
    generator = random.Random()
    generator.setstate((3, (*words, 624), None))
    return generator


def n_genes(topology):
    sizes = {name: group["n"] for part in ("stimuli", "ensembles") for name, group in topology[part].items()}
    generator = numpy_generator(SEED)
    n = GENES_OF_A_NEURON * sum(ensemble["n"] for ensemble in topology["ensembles"].values())
    for group in topology["synapses"].values():
        pairs = sizes[group["pre"]] * sizes[group["post"]]
        # numpy.random.choice(2, p=[1 - p, p]) is 1 where the number is not below 1 - p.
        n += sum(generator.random() >= 1 - group.get("p", 1) for _ in range(pairs))
    return n


def main():
    for path in map(Path, sys.argv[1:] or [CONFIGS / f"{name}.json" for name in NETWORKS]):
        print(f"{path.stem}: {n_genes(json.loads(path.read_text())['topology'])}")


if __name__ == "__main__":
    main()
