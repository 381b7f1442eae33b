"""Measures the time of all 10,000 counterfactuals of experiment A: ``python
python/benches/counterfactuals.py``.

Replaces every message and every radio reading of ten robots in 20 steps of 50 trials, first in one thread, then
with the robots split between two threads.
"""

import json
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Callable

import swarmevo
from swarmevo import analysis

PROJECT = Path(__file__).parents[2]
STEPS = range(20, 290, 14)
TRIALS = 50
N_ROUNDS = 3


def main() -> None:
    experiment = swarmevo.Experiment.from_file(PROJECT / "configs/leader_selection_snes.json")
    genotype = json.loads((PROJECT / "results/champions/leader_selection_snes-0.json").read_text())["genotype"]
    robots = list(range(experiment.n_robots))
    asked = len(STEPS) * len(robots) * TRIALS

    def of(measure: Callable[..., object], agents: "list[int]") -> None:
        measure(experiment, genotype, STEPS, agents=agents, trials=TRIALS)

    for measure in (analysis.influence, analysis.attention):
        for n_threads in (1, 2):
            for _ in range(N_ROUNDS):
                wall, processor = time.perf_counter(), time.process_time()
                with ThreadPoolExecutor(n_threads) as pool:
                    list(pool.map(lambda agents: of(measure, agents), (robots[i::n_threads] for i in range(n_threads))))
                wall, processor = time.perf_counter() - wall, time.process_time() - processor
                print(
                    f"{measure.__name__}, {asked} in {n_threads} threads: {wall:6.1f} s, {processor:6.1f} s of processor time"
                    f"   load {os.getloadavg()[0]:.1f}", flush=True
                )


if __name__ == "__main__":
    main()
