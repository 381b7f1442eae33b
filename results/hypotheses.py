#!/usr/bin/env python3
"""Evolves experiments with one thing changed at a time, and prints the effects.

    results/hypotheses.py run [EXPERIMENT...] [--variants V...] [--seeds S...] [--workers N]
    results/hypotheses.py report [--update]

EXPERIMENT is a name in the table below. `report` prints the table of every experiment, or writes it into
docs/notebook/2026-11-thesis.md; p is of the exact test of Mann and Whitney against the unchanged file. `run` writes
history and champion of each run to results/hypotheses/EXPERIMENT/VARIANT-SEED.csv and .json, and leaves existing runs
alone, so you may interrupt it. The variant `as it is` is the unchanged file, whose runs are in results/histories.
Needs Python 3.9, and for `run` swarmctl in the PATH.
"""

import argparse
import copy
import json
import statistics
from pathlib import Path

import algorithms
from report import LAST, RESULTS, chance, markdown, print_or_update, read_csv, spread

PAGE = RESULTS.parent / "docs" / "notebook" / "2026-11-thesis.md"
SEEDS = [0, 1, 2, 3, 4]

GA = "algorithm.populations.p1.params."
DRAWN = {"topology.decoding.outB.params.stochastic": True, "topology.decoding.outC.params.stochastic": True}
TABLE_3_4 = {GA + "alpha": 0.5, GA + "mutation_sigma": 0.5477225575051661}
MODE = {
    "topology.synapses.COMM-MODE": {"pre": "OUT_COMM", "post": "OUT_MODE", "trainable": True, "p": 1.0},
    "topology.synapses.MODE-COMM": {"pre": "OUT_MODE", "post": "OUT_COMM", "trainable": True, "p": 1.0},
}
RECURRENT = "topology.synapses.{}.p"
GA_NETWORK = {
    **{RECURRENT.format(name): 0.7 for name in ("H1-H1", "H2-H2")},
    RECURRENT.format("H1-H2"): 1.0,
    **{RECURRENT.format(name): 0.85 for name in ("COMM-H1", "WHEELS-H1", "MODE-H1")},
    "topology.synapses.WHEELS-WHEELS": {
        "pre": "OUT_WHEELS", "post": "OUT_WHEELS", "trainable": True, "p": 1.0
    },
}
ROBOT = "world.objects.robotA."
SENSORS = ROBOT + "sensors."
LONG_RADIO = {
    SENSORS + "wireless_receiver.range": 150,
    SENSORS + "wireless_receiver.msg_length": 3,
    ROBOT + "actuators.wireless_transmitter.range": 150,
    ROBOT + "actuators.wireless_transmitter.msg_length": 3,
    "topology.stimuli.I1.n": 3,
    "topology.ensembles.OUT_COMM.n": 3,
}
# Enough to tell variants of D apart: after 150 generations, the first three have the verdicts of 300.
SHORT = {"algorithm.generations": 150}
# For each experiment, a file of configs/original: the changes of each variant.
VARIANTS = {
    "borderline_ga_program": {
        "LED and mode drawn": DRAWN,
        "Table 3.4's alpha and sigma": TABLE_3_4,
        "LED and mode drawn, Table 3.4's alpha and sigma": {**DRAWN, **TABLE_3_4},
        "synapses between message and mode": MODE,
        "bias inside the gain": {"topology.bias_in_gain": True},
    },
    "orientation_consensus_ga_program": {
        "tournament selection": {GA + "selection_operator": "tournament", GA + "tournament_size": 3},
        "Table 3.4's alpha and sigma": TABLE_3_4,
        "tournament selection, Table 3.4's alpha and sigma": {
            GA + "selection_operator": "tournament", GA + "tournament_size": 3, **TABLE_3_4
        },
        "bias inside the gain": {"topology.bias_in_gain": True},
    },
    "light_follower_snes_program": {
        "light at 0.013 rad per step": {
            "world.objects.light_red.controller.params.angle_step": 0.013
        },
        "the network of the original's file for the GA": GA_NETWORK,
        "first deviation 0.2": {GA + "sigma_init": 0.2},
        "radio of 150 cm, messages of 3": {**LONG_RADIO, **SHORT},
        "wheels from -1 to 1": {"topology.ensembles.OUT_WHEELS.activation": "tanh", **SHORT},
        "Table 3.2's decay": {
            **{SENSORS + sensor + ".decay_rho": 0.05 for sensor in ("light_sensor", "wireless_receiver")},
            **SHORT,
        },
        "Table 3.2's noise": {SENSORS + "light_sensor.noise_variance": 0.1, **SHORT},
    },
}
AS_IT_IS = "as it is"
# Other files of configs/original to compare with an experiment; `results/add-run` runs them.
FILES = {"light_follower_snes_program": {"the file for the GA": "light_follower_ga_program"}}
IN_FILE_NAMES = str.maketrans(" ", "-", ",'")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="evolve missing runs")
    run.add_argument("experiments", nargs="*", default=list(VARIANTS), metavar="EXPERIMENT")
    run.add_argument("--variants", nargs="+")
    run.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    run.add_argument("--workers", type=int, default=1)
    commands.add_parser("report", help="print existing runs").add_argument("--update", action="store_true")
    args = parser.parse_args()
    if args.command == "report":
        # Without runs, an experiment has no table.
        for name in [name for name in VARIANTS if read(name, AS_IT_IS, 0)]:
            print_or_update(PAGE, name, report(name))
        return
    for name in args.experiments:
        for variant, changes in VARIANTS[name].items():
            if args.variants is None or variant in args.variants:
                for seed in args.seeds:
                    evolve(name, variant, changes, seed, args.workers)


def evolve(name, variant, changes, seed, workers):
    stem = stem_of(name, variant, seed)
    if Path(f"{stem}.json").exists():
        return
    stem.parent.mkdir(parents=True, exist_ok=True)
    experiment = changed(read_config(name), changes)
    mean = algorithms.evolve(experiment, seed, stem, workers)
    print(f"{name}, {variant}, seed {seed}: {mean:.3f}", flush=True)


def read_config(name):
    return json.loads((RESULTS.parent / "configs" / "original" / f"{name}.json").read_text())


def changed(experiment, changes):
    experiment = copy.deepcopy(experiment)
    for path, value in changes.items():
        *parents, last = path.split(".")
        inner = experiment
        for key in parents:
            inner = inner[key]
        inner[last] = value
    return experiment


def stem_of(name, variant, seed):
    """The path of a run's files, without their endings."""
    folder = RESULTS / "hypotheses" / name
    return folder / f"{variant.translate(IN_FILE_NAMES)}-{seed}"


def report(name):
    """The table of an experiment. Longer runs also have a column of the shorter ones' last generations."""
    variants = {
        variant: [run for seed in SEEDS if (run := read(name, variant, seed))]
        for variant in [AS_IT_IS, *VARIANTS[name], *FILES.get(name, {})]
    }
    ends = sorted({len(means) for runs in variants.values() for means, _ in runs})
    heads = [*(f"mean, generations {end - LAST} to {end - 1}" for end in ends), "champion"]
    unchanged = columns(variants[AS_IT_IS], ends)
    rows = []
    for variant, runs in variants.items():
        cells = []
        for values, others in zip(columns(runs, ends), unchanged):
            p = f", p = {chance(values, others):.3f}" if variant != AS_IT_IS and values and others else ""
            cells.append(f"{spread(values)}{p}" if values else "")
        rows.append([variant, len(runs), *cells])
    return markdown(["variant", "seeds", *heads], [row for row in rows if row[1]])


def columns(runs, ends):
    """The values of each column: means of the last generations up to each end, and the longest runs' champions."""
    means = [[statistics.mean(run[end - LAST : end]) for run, _ in runs if len(run) >= end] for end in ends]
    return [*means, [champion for run, champion in runs if len(run) >= ends[-1]]]


def read(name, variant, seed):
    """The mean fitness of each generation and the champion's worth; None if it has not run."""
    file = name if variant == AS_IT_IS else FILES.get(name, {}).get(variant)
    if file:
        history = RESULTS / "histories" / f"{file}-{seed}.csv"
        champion = RESULTS / "champions" / f"{file}-{seed}.json"
    else:
        stem = stem_of(name, variant, seed)
        history, champion = Path(f"{stem}.csv"), Path(f"{stem}.json")
    if not champion.exists():
        return None
    means = [float(row["mean"]) for row in read_csv(history)]
    return means, json.loads(champion.read_text())["judged"]["mean"]


if __name__ == "__main__":
    main()
