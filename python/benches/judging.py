"""Measures how many candidate scripts are judged per minute: ``python python/benches/judging.py [CANDIDATES]``.

The candidates are variants of hand-written controllers of ten robots, in one trial of 300 steps each, on all
processors. Prints the rate of whole judgements by the clock, and the rate that two processors without other work would
have, by the time that processors took. Then the processor's time of the parts of one judgement.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np

import swarmevo
from swarmevo import _core, judging

CONFIGS = Path(__file__).parents[2] / "configs/tasks"
N_ROUNDS = 3
TASKS = ("aggregation", "dispersion", "chain")
IDLE = "def control(robot):\n    robot.left = {x}\n"


def main(n_candidates: int = 2000) -> None:
    print(f"swarmevo {swarmevo.__version__}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for name in TASKS:
        task = swarmevo.Experiment.from_file(CONFIGS / f"{name}.json").replace(evaluation_steps=300)
        assert task.n_robots == 10, task
        written = (CONFIGS / "by_hand" / f"{name}.star").read_text()
        for what, text in (("by hand", written), ("idle", IDLE)):
            candidates = [f"{text.replace('{x}', '0.5')}\nVARIANT = {i}\n" for i in range(n_candidates)]
            rates, of_two = [], []
            for _ in range(N_ROUNDS):
                started, worked = time.perf_counter(), time.process_time()
                verdicts = swarmevo.judge(candidates, task, trials=1)
                rates.append(60 * n_candidates / (time.perf_counter() - started))
                of_two.append(2 * 60 * n_candidates / (time.process_time() - worked))
                assert not any(it.error for it in verdicts), verdicts[0]
            print(f"{name:12} {what:8} {np.median(rates):8.0f} scripts per minute   {min(rates):.0f} .. {max(rates):.0f}   "
                  f"two processors {np.median(of_two):.0f}")
        parts(task, written)


def parts(task: swarmevo.Experiment, text: str) -> None:
    """Milliseconds of the parts of one judgement."""
    made = milliseconds(lambda: judging._controlled(task, text))
    file = judging._controlled(task, text)
    compiled = milliseconds(lambda: swarmevo.Experiment(file))
    experiment = swarmevo.Experiment(file)
    genes = np.full(task.n_genes, 0.5)
    trials = swarmevo.TrialSet.evaluation()
    steps = milliseconds(lambda: experiment.evaluate(genes, trials, trials=1, threads=1))
    measured = milliseconds(lambda: experiment.measure(genes, trials, trials=1, threads=1))
    where = ("evaluation", 0, 0, 0, 1)
    whole = milliseconds(lambda: _core.judge([file], None, where, 1, 60.0))
    print(f"{'':12} ms of one: text {made:.2f}, read and compile {compiled:.2f}, 300 steps {steps:.2f}, with measures {measured:.2f}, whole {whole:.2f}")


def milliseconds(work: object) -> float:
    times = []
    for _ in range(30):
        started = time.process_time()
        work()
        times.append(1e3 * (time.process_time() - started))
    return float(np.median(times))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
