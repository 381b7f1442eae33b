"""Measures the cost of driving a fleet from Python: ``python python/benches/dispatch.py PROGRAMS``.

On a coordinator and two workers of one slot, alternates generations of 100 individuals of leader
selection with ``Client.evaluate`` of 100 genotypes in the same trials. Measures episodes of one step and one
trial, which take almost no time, and those of the file. ``PROGRAMS``: the directory of the release
programs ``coordinator`` and ``worker``.
"""

import os
import statistics
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import swarmevo

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from processes import Fleet, fleet  # noqa: E402

CONFIGS = Path(__file__).parents[2] / "configs"
N_ROUNDS = 9


def main(programs: str) -> None:
    shortest = {"evaluation_steps": 1, "num_evaluations": 1}
    cases = (
        ("SNES, 1 step", "leader_selection_snes", shortest, 200),
        ("GA, 1 step", "leader_selection_ga", shortest, 200),
        ("SNES, 300 steps", "leader_selection_snes", {}, 10),
    )
    with TemporaryDirectory() as directory, fleet(Path(programs), Path(directory)) as started:
        for name in ("one", "two"):
            started.start_worker(name)
        for what, name, changes, n_generations in cases:
            file = swarmevo.Experiment.from_file(CONFIGS / f"{name}.json").to_dict()
            file["algorithm"].update(
                changes, generations=n_generations, judgement_trials=1, champion_trials=1
            )
            rounds = [both(started, file, seed) for seed in range(N_ROUNDS)]
            inside, outside = zip(*rounds)
            report(f"{what}: a generation of a run, ms", inside)
            report(f"{what}: Client.evaluate, ms", outside)
            ratios = [ours / theirs for ours, theirs in rounds]
            report(f"{what}: share of the run's rate", ratios)


def both(started: Fleet, file: dict, seed: int) -> tuple[float, float]:
    """Milliseconds of a generation of the coordinator, and of one that a client drives."""
    file["seed"] = seed
    experiment = swarmevo.Experiment.from_dict(file)
    with started.connect() as client:
        run = client.submit(experiment).wait(progress=False)
        done = run.history()["completed_at_ms"].to_list()
        inside = (done[-1] - done[0]) / (len(done) - 1)
        genotypes = run.individuals(0).genotypes
        times = []
        for generation in range(experiment.to_dict()["algorithm"]["generations"]):
            start = time.perf_counter()
            client.evaluate(experiment, genotypes, generation)
            times.append(1e3 * (time.perf_counter() - start))
    return inside, statistics.mean(times)


def report(what: str, values: "list[float] | tuple[float, ...]") -> None:
    low, middle, high = min(values), statistics.median(values), max(values)
    print(f"{what:46} {middle:8.3f}   {low:.3f} .. {high:.3f}   load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
