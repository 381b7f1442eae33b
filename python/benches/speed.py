"""Measures the speed of the package's simulation: ``python python/benches/speed.py SWARMCTL``.

Measures a trace as arrays. Alternates ``evaluate`` with ``swarmctl bench``, so that both meet the
same load of the machine. ``SWARMCTL`` is the release program of the same sources.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Callable

import numpy as np

import swarmevo

CONFIG = Path(__file__).parents[2] / "configs" / "leader_selection_snes.json"
N_TRACES = 30
N_ROUNDS = 9
N_GENOTYPES = 64


def main(swarmctl: str) -> None:
    report("trace, wall, ms", trace_ms(time.perf_counter))
    report("trace, processor, ms", trace_ms(time.process_time))
    report("its fitness alone, wall, ms", trace_ms(time.perf_counter, is_seen=False))
    for n_threads in (1, 2):
        rounds = [(package_us(n_threads), bench_us(swarmctl, n_threads)) for _ in range(N_ROUNDS)]
        package, bench = zip(*rounds)
        report(f"evaluate, {n_threads} threads, us per robot-step", package)
        report(f"swarmctl bench, {n_threads} cores, us per robot-step", bench)
        report("their ratio, round by round", [ours / theirs for ours, theirs in rounds])


def trace_ms(clock: Callable[[], float], is_seen: bool = True) -> list[float]:
    """Milliseconds of each episode of 50 robots and 1,000 steps, without the first one, which warms up.
    ``is_seen``: with all recorded values, instead of the fitness alone."""
    file = swarmevo.Experiment.from_file(CONFIG).to_dict()
    file["algorithm"]["evaluation_steps"] = 1000
    file["world"]["objects"]["robotA"]["num_instances"] = 50
    experiment = swarmevo.Experiment.from_dict(file)
    genotype = np.random.default_rng(1).random(experiment.n_genes)
    times = []
    for _ in range(1 + N_TRACES):
        start = clock()
        if is_seen:
            experiment.simulate(genotype, trials=1)
        else:
            experiment.evaluate(genotype, trials=1)
        times.append(1e3 * (clock() - start))
    return times[1:]


def package_us(n_threads: int) -> float:
    """Wall time of a thread per robot-step, in microseconds."""
    experiment = swarmevo.Experiment.from_file(CONFIG)
    n_robots = experiment.to_dict()["world"]["objects"]["robotA"]["num_instances"]
    genotypes = np.random.default_rng(1).random((N_GENOTYPES, experiment.n_genes))
    start = time.perf_counter()
    fitness = experiment.evaluate(genotypes, threads=n_threads)
    seconds = time.perf_counter() - start
    return 1e6 * n_threads * seconds / (fitness.size * experiment.n_steps * n_robots)


def bench_us(swarmctl: str, n_cores: int) -> float:
    """The same time, measured by the Rust program."""
    command = [swarmctl, "bench", str(CONFIG), "--seconds", "1", "--cores", str(n_cores),
               "--output", "json"]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return float(json.loads(printed)["us_per_robot_step"])


def report(what: str, values: "list[float] | tuple[float, ...]") -> None:
    low, middle, high = min(values), statistics.median(values), max(values)
    print(f"{what:42} {middle:8.3f}   {low:.3f} .. {high:.3f}   load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
