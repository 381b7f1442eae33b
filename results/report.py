#!/usr/bin/env python3
"""Prints the numbers of docs/notebook/2026-11-claims.md, as tables.

    results/report.py [DIRECTORY]    runs and evaluations in it; results/ by default

Run results/fetch before: the report covers all seeds, and a clone's tree has one seed of each run.
Needs Python 3.9 and nothing else. `swarmctl compare` prints the statistics of samples.
"""

import csv
import json
import math
import statistics
import subprocess
import sys
from collections import defaultdict
from itertools import combinations
from pathlib import Path

RESULTS = Path(__file__).resolve().parent
LAST = 50
MEANS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
BESTS = (0.3, 0.5, 1.0)
ENDS = (50, 100, 150, 200, 250, 300)
# Kinds of neurons, and how the names of their files end.
MODELS = {
    "CTRNN": "snes",
    "LIF": "lif",
    "LIF, plastic": "lif_plastic",
    "LIF, encoders": "lif_encoded",
    "AdEx": "adex",
}
STEPS = (0, 10, 12, 14, 16, 20, 24, 50, 100, 200, 250, 300, 500, 660, 700, 1000)


def markdown(head, rows):
    """A table as text."""
    line = lambda cells: f"| {' | '.join(map(str, cells))} |\n"
    return line(head) + "|" + "---|" * len(head) + "\n" + "".join(map(line, rows))


def table(head, rows):
    print(markdown(head, rows))


def number(value, digits=3):
    return "" if value is None else f"{value:.{digits}f}"


def interval(value, low, high, digits=3):
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def spread(values, digits=3):
    """The median, then the least and the greatest of several values."""
    median = statistics.median(values)
    return interval(median, min(values), max(values), digits) if len(values) > 1 else number(median, digits)


def middle(estimates):
    """Of values with their intervals: the median one, then the least and the greatest value."""
    ordered = sorted(estimates, key=lambda estimate: estimate[0])
    return f"{interval(*ordered[(len(ordered) - 1) // 2])}; {ordered[0][0]:.3f} to {ordered[-1][0]:.3f}"


def chance(a, b):
    """The two-sided p-value of the exact test of Mann and Whitney; a tie is half a win."""
    values = a + b

    def extreme(first):
        rest = set(range(len(values))) - set(first)
        wins = sum((values[i] > values[j]) + (values[i] == values[j]) / 2 for i in first for j in rest)
        return max(wins, len(a) * len(b) - wins)

    splits = [extreme(first) for first in combinations(range(len(values)), len(a))]
    return sum(split >= extreme(range(len(a))) for split in splits) / len(splits)


def read_csv(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def swarmctl(*args):
    """What a command prints."""
    return subprocess.run(["swarmctl", *map(str, args)], check=True, stdout=subprocess.PIPE, text=True).stdout


def evaluated(config, champion, trials, to, *options):
    """The summary of the evaluation of a champion, whose files are written into the folder `to`."""
    swarmctl("evaluate", "--local", "--workers", 1, "--config", config, "--genotype", champion, "--changed-conditions",
             "--trials", trials, "--to", to, *options)
    return json.loads((Path(to) / "summary.json").read_text())


def print_or_update(page, name, text):
    """Prints a table; with `--update`, writes it into a page, between the marks with its name."""
    if "--update" not in sys.argv:
        print(text, end="")
        return
    begin, end = f"<!-- generated: {name} -->\n", f"<!-- end: {name} -->"
    before, rest = page.read_text().split(begin)
    _, after = rest.split(end)
    page.write_text(f"{before}{begin}\n{text}\n{end}{after}")


def runs(folder):
    print("## Runs\n")
    rows = []
    for path in sorted((folder / "histories").glob("*.csv")):
        history = read_csv(path)
        last = history[-LAST:]
        champion = json.loads((folder / "champions" / f"{path.stem}.json").read_text())
        judged, selected = champion.get("judged"), champion.get("held_out")
        worth = ""
        if judged:
            worth = interval(judged["mean"], *judged["ci95"])
        elif selected:
            worth = f"{selected['mean']:.3f} ± {selected['ci95']:.3f}, selected"
        first = lambda key, least: next(
            (row["generation"] for row in history if float(row[key] or "-inf") > least), ""
        )
        rows.append([
            path.stem,
            len(history),
            number(statistics.fmean(float(row["mean"]) for row in last)),
            number(statistics.fmean(float(row["best"]) for row in last)),
            number(max(float(row["best"]) for row in history)),
            worth,
            number(sum(int(row["duration_ms"]) for row in history) / 3.6e6, 2),
            *(first("mean", least) for least in MEANS),
            *(first("best", least) for least in BESTS),
            history[-1]["digest"][:12],
        ])
    table(
        ["run", "generations", f"mean, last {LAST}", f"best, last {LAST}", "best of all", "champion",
         "wall, h", *(f"mean > {least} from" for least in MEANS), *(f"best > {least} from" for least in BESTS),
         "last digest"],
        rows,
    )


def models(folder):
    """Neuron models on the same task, with the same algorithm and budget."""
    rows = []
    for task in ("leader_selection", "borderline", "orientation_consensus", "light_follower"):
        for model, ending in MODELS.items():
            paths = sorted((folder / "histories").glob(f"{task}_{ending}-*.csv"))
            means = [[float(it["mean"]) for it in read_csv(path)] for path in paths]
            seeds = ", ".join(path.stem.rsplit("-", 1)[1] for path in paths)
            until = lambda end: " ".join(
                number(statistics.fmean(run[end - 10 : end]), 2) for run in means if len(run) >= end
            )
            if paths:
                rows.append([task, model, seeds, *map(until, ENDS)])
    if any(row[1] != "CTRNN" for row in rows):
        print("## Neuron models: mean fitness over the ten generations before, a value per seed\n")
        table(["task", "neurons", "seeds", *(f"generation {end}" for end in ENDS)], rows)


def evaluation(folder):
    print(f"## Evaluation of {folder.name}\n")
    trials = defaultdict(lambda: defaultdict(list))
    for row in read_csv(folder / "trials.csv"):
        if row["time_mean"]:
            trials[row["condition"]][row["metric"]].append((float(row["time_mean"]), row["end"]))
    metrics = sorted({metric for of in trials.values() for metric in of})
    means = lambda cell: table(
        ["condition", *metrics],
        [[name, *(cell([mean for mean, _ in of[metric]]) for metric in metrics)] for name, of in trials.items()],
    )
    print("Mean over trials of the mean over time; in brackets the median.\n")
    means(lambda values: values and f"{statistics.fmean(values):.3f} [{statistics.median(values):.3f}]")
    print("Quartiles of the mean over time.\n")
    means(quartiles)
    if "true_positive_rate" in metrics:
        errors(folder, trials)
    if "near_light_photosensitive" in metrics:
        lost_lights(folder)
    if not (folder / "steps.csv").exists():
        print("Curves by step: not in this tree; results/fetch writes them.\n")
        return
    steps = read_csv(folder / "steps.csv")
    medians = defaultdict(dict)
    for row in steps:
        medians[row["metric"], row["condition"]][int(row["step"])] = row["median"]
    end = max(int(row["step"]) for row in steps)
    print("Median over trials at a step (at the latest recorded one before it).\n")
    shown = sorted({step for step in STEPS if step < end} | {end})
    rows = []
    for (metric, condition), of in sorted(medians.items()):
        # A measure may begin late in an episode.
        at = lambda step: of.get(max((known for known in of if known <= step), default=None), "")
        rows.append([metric, condition, *(at(step) for step in shown)])
    table(["measure", "condition", *shown], rows)


def quartiles(values):
    if len(values) < 2:
        return ""
    first, _, third = statistics.quantiles(values, n=4, method="inclusive")
    return f"{first:.3f} to {third:.3f}"


def errors(folder, trials):
    """Wrong LEDs per step. A trial has one border, whose size follows from the rates:
    accuracy * n = TPR * border + TNR * (n - border)."""
    name = json.loads((folder / "summary.json").read_text())["name"]
    config = json.loads(next((RESULTS.parent / "configs").rglob(f"{name}.json")).read_text())
    evolved = config["algorithm"]["evolvable_object"]
    rows = []
    for condition, of in trials.items():
        if condition != "nominal" and not condition.startswith("robots="):
            continue
        n = config["world"]["objects"][evolved]["num_instances"]
        n = int(condition.removeprefix("robots=")) if condition != "nominal" else n
        rates = zip(*([mean for mean, _ in of[key]] for key in ("accuracy", "true_positive_rate", "true_negative_rate")))
        if len({len(of[key]) for key in ("accuracy", "true_positive_rate", "true_negative_rate")}) != 1:
            print(f"{condition}: a trial has no border, or nothing but a border\n")
            continue
        border = lambda accuracy, tpr, tnr: n * (accuracy - tnr) / (tpr - tnr)
        rates = list(rates)
        misses = [border(*rate) * (1 - rate[1]) for rate in rates]
        alarms = [(n - border(*rate)) * (1 - rate[2]) for rate in rates]
        rows.append([condition, *(number(statistics.fmean(values), 2) for values in (misses, alarms)),
                     estimate([a - b for a, b in zip(misses, alarms)], 2), estimate([rate[1] - rate[2] for rate in rates])])
    table(["condition", "false negatives per step", "false positives per step", "their difference", "TPR - TNR"], rows)


def estimate(values, digits=3):
    """The mean of values with its 95 % interval, by the normal distribution."""
    mean, error = statistics.fmean(values), 1.96 * statistics.stdev(values) / len(values) ** 0.5
    return interval(mean, mean - error, mean + error, digits)


def lost_lights(folder):
    """Trials in which the robots that see the light are near it for less than half of the time, and trials
    in which this holds only for the other robots."""
    near = defaultdict(dict)
    for row in read_csv(folder / "trials.csv"):
        if row["metric"].startswith("near_light_"):
            near[row["condition"], row["trial"]][row["metric"]] = float(row["time_mean"])
    rows = defaultdict(lambda: ([], []))
    for (condition, _), trial in near.items():
        lost = trial["near_light_photosensitive"] < 0.5
        rows[condition][lost].append(trial["near_light_others"])
    mean = lambda values: f"{statistics.fmean(values):.3f}" if values else ""
    behind = lambda kept: sum(near < 0.5 for near in kept)
    first = tuple(map(len, next(iter(rows.values()))))
    table(["condition", "trials that lose the light", "p of the difference from the first", "others near it in these", "in the rest",
           "trials in which only the others lose it"],
          [[name, f"{len(lost)} of {len(lost) + len(kept)}", number(fisher(first, (len(kept), len(lost)))), mean(lost), mean(kept), behind(kept)]
           for name, (kept, lost) in rows.items()])


def fisher(first, second):
    """Fisher's exact test of two samples, two-sided. A sample: the numbers of trials without and with the event."""
    n, marked = sum(first), first[1] + second[1]
    ways = lambda k: math.comb(n, k) * math.comb(sum(second), marked - k)
    all_ways = [ways(k) for k in range(min(n, marked) + 1)]
    return sum(of for of in all_ways if of <= ways(first[1])) / sum(all_ways)


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else RESULTS
    runs(folder)
    models(folder)
    for path in sorted((folder / "evaluations").glob("*")):
        evaluation(path)


if __name__ == "__main__":
    main()
