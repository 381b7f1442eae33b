"""Evolves light followers by MAP-Elites of pyribs: not one controller, but a map of many.

    pip install './python[all]' ribs
    python python/examples/light_follower_by_pyribs.py --config configs/light_follower_snes.json

Writes a heat map: the fitness of the best controller of each kind, by the speed of its robots and
the sharpness of their turns.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from ribs.archives import GridArchive
from ribs.emitters import GaussianEmitter
from ribs.schedulers import Scheduler

import swarmevo

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


def main() -> None:
    parser = argparse.ArgumentParser(description="Illuminates light followers by MAP-Elites.")
    parser.add_argument("--config", type=Path, required=True)
    parser.add_argument("--iterations", type=int, default=50)
    parser.add_argument("--batch-size", type=int, default=20)
    parser.add_argument("--steps", type=int, default=200, help="of an episode")
    parser.add_argument("--to", type=Path, default=Path("light-followers.png"))
    args = parser.parse_args()

    config = swarmevo.Experiment.from_file(args.config).to_dict()
    config["algorithm"]["evaluation_steps"] = args.steps
    experiment = swarmevo.Experiment.from_dict(config)
    archive = GridArchive(
        solution_dim=experiment.n_genes, dims=[20, 20], ranges=[(0.0, 1.0), (0.0, 1.0)], seed=1
    )
    emitter = GaussianEmitter(
        archive, sigma=0.1, x0=np.full(experiment.n_genes, 0.5), batch_size=args.batch_size, seed=2
    )
    scheduler = Scheduler(archive, [emitter])
    for iteration in range(args.iterations):
        solutions = scheduler.ask()
        found = [behave(experiment, swarmevo.mirror(genes)) for genes in solutions]
        fitness, behaviour = zip(*found)
        scheduler.tell(np.array(fitness), np.array(behaviour))
        if (iteration + 1) % 10 == 0 or iteration + 1 == args.iterations:
            stats = archive.stats
            print(f"{iteration + 1}/{args.iterations}  {stats.num_elites} kinds  best {stats.obj_max:.3f}")

    image = np.full((20, 20), np.nan)
    elites = archive.data(return_type="dict")
    cells = archive.int_to_grid_index(elites["index"])
    image[cells[:, 1], cells[:, 0]] = elites["objective"]
    figure, ax = pyplot.subplots()
    shown = ax.imshow(image, origin="lower", extent=(0, 1, 0, 1))
    ax.set_xlabel("speed of the wheels")
    ax.set_ylabel("difference of the wheels")
    ax.set_title("best fitness of each kind of light follower")
    figure.colorbar(shown, label="fitness")
    figure.savefig(args.to)
    print(f"{args.to}")


def behave(experiment: swarmevo.Experiment, genotype: np.ndarray) -> tuple[float, list[float]]:
    """Fitness, and the kind of behaviour."""
    trace = experiment.simulate(genotype, trials=1)
    speed = np.abs(trace.wheels.mean(axis=-1)).mean()
    turn = np.abs(trace.wheels[..., 0] - trace.wheels[..., 1]).mean() / 2
    return float(trace.fitness.mean()), [float(speed), float(turn)]


if __name__ == "__main__":
    main()
