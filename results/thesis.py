#!/usr/bin/env python3
"""Prints the outcome of each reading of the thesis: of its tables, and of the constants of SpikeSwarmSim.

    results/thesis.py              the table of docs/reproduction.md
    results/thesis.py --update     writes it into that page

The mean fitness is that of the last 50 generations: the median over the runs, in brackets the least and
the greatest. The worth is that of the champion of the median run, with its 95 % interval, then the range
over all runs. Readings without runs in results/ have no row. Needs Python 3.9 and nothing else.
"""

import json
import statistics

from report import LAST, RESULTS, markdown, print_or_update, read_csv, spread

PAGE = RESULTS.parent / "docs" / "reproduction.md"
# Experiment, reading, algorithm, and the name of the experiment file.
READINGS = [
    ("A", "Table 3.4", "GA", "leader_selection_ga"),
    ("A", "SpikeSwarmSim's rates", "SNES", "leader_selection_snes"),
    ("B", "Table 3.4", "GA", "borderline_ga"),
    ("B", "two constants of SpikeSwarmSim", "GA", "borderline_ga_original"),
    ("B", "SpikeSwarmSim's file", "GA", "borderline_ga_program"),
    ("B", "SpikeSwarmSim's rates", "SNES", "borderline_snes"),
    ("C", "Eq. 5.5 and Table 3.4", "GA", "orientation_consensus_ga"),
    ("C", "Eq. 5.5, SpikeSwarmSim's rates", "SNES", "orientation_consensus_snes"),
    ("C", "SpikeSwarmSim's function, Table 3.4", "GA", "orientation_consensus_alignment_ga"),
    ("C", "SpikeSwarmSim's function and rates", "SNES", "orientation_consensus_alignment_snes"),
    ("C", "SpikeSwarmSim's file", "GA", "orientation_consensus_ga_program"),
    ("D", "Table 3.2 and 3.4, twice SpikeSwarmSim's speed", "GA", "light_follower_thesis_sensors_ga"),
    ("D", "Table 3.2, twice SpikeSwarmSim's speed", "SNES", "light_follower_thesis_sensors_snes"),
    ("D", "Table 3.4, SpikeSwarmSim's sensors, twice its speed", "GA", "light_follower_ga"),
    ("D", "SpikeSwarmSim's sensors and rates, twice its speed", "SNES", "light_follower_snes"),
    ("D", "SpikeSwarmSim's constants and speed, its network for the GA", "SNES", "light_follower_snes_original"),
    ("D", "SpikeSwarmSim's file", "GA", "light_follower_ga_program"),
    ("D", "SpikeSwarmSim's file", "SNES", "light_follower_snes_program"),
]


def row(experiment, reading, algorithm, name):
    """A list with the row of the table; empty without runs."""
    stems = sorted(path.stem for path in (RESULTS / "champions").glob(f"{name}-*.json"))
    if not stems:
        return []
    histories = [read_csv(RESULTS / "histories" / f"{stem}.csv") for stem in stems]
    champions = [json.loads((RESULTS / "champions" / f"{stem}.json").read_text())["judged"] for stem in stems]
    means = [statistics.fmean(float(it["mean"]) for it in history[-LAST:]) for history in histories]
    worths = sorted(champions, key=lambda it: it["mean"])
    middle = worths[(len(worths) - 1) // 2]
    worth = f"{middle['mean']:.3f}, 95 % {middle['ci95'][0]:.3f} to {middle['ci95'][1]:.3f}"
    among = f" ({worths[0]['mean']:.3f} to {worths[-1]['mean']:.3f})" if len(worths) > 1 else ""
    cells = [
        experiment,
        reading,
        algorithm,
        len(stems),
        len(histories[0]),
        spread(means),
        worth + among,
    ]
    return [cells]


def table():
    head = ["experiment", "reading", "algorithm", "seeds", "generations", f"mean, last {LAST}", "champion"]
    return markdown(head, sum((row(*reading) for reading in READINGS), []))


if __name__ == "__main__":
    print_or_update(PAGE, "readings", table())
