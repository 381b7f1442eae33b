"""Evolves leader selection by pycma, as an example of any optimiser that asks and tells.

    pip install './python[all]' cma
    python python/examples/leader_by_pycma.py --generations 60
    python python/examples/leader_by_pycma.py --fleet       # computed by a coordinator's workers
"""

import argparse

import cma
import numpy as np

import swarmevo


def main() -> None:
    parser = argparse.ArgumentParser(description="Evolves leader selection by pycma.")
    parser.add_argument("--generations", type=int, default=60)
    parser.add_argument("--population-size", type=int, default=32)
    parser.add_argument("--fleet", action="store_true", help="evaluate on SWARM_COORDINATOR's fleet")
    args = parser.parse_args()

    experiment = swarmevo.Experiment.quickstart()
    evaluate = experiment.evaluate
    if args.fleet:
        client = swarmevo.connect()

        def evaluate(genotypes, generation):
            return client.evaluate(experiment, genotypes, generation)

    # Bounds would be slow with hundreds of genes, so the optimiser has none, and its samples are
    # mirrored into [0, 1]. A full covariance matrix of 424 genes would learn slowly, so the matrix is
    # diagonal.
    start = np.full(experiment.n_genes, 0.5)
    options = {"popsize": args.population_size, "CMA_diagonal": True, "seed": 1, "verbose": -9}
    optimiser = cma.CMAEvolutionStrategy(start, 0.3, options)
    for generation in range(args.generations):
        asked = np.array(optimiser.ask())
        # Every generation gets its own worlds, as in the project's runs.
        fitness = evaluate(swarmevo.mirror(asked), generation).mean(axis=1)
        optimiser.tell(asked.tolist(), (-fitness).tolist())
        if (generation + 1) % 10 == 0:
            print(f"{generation + 1}/{args.generations}  best {fitness.max():.3f}  mean {fitness.mean():.3f}")

    # The fitness of the mean of the distribution, on trials that selected nothing.
    found = swarmevo.mirror(optimiser.mean)
    judged = experiment.evaluate(found, swarmevo.TrialSet.judgement(args.generations), trials=200)
    print(f"mean of the distribution: {judged.mean():.3f} on 200 new trials")


if __name__ == "__main__":
    main()
