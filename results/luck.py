#!/usr/bin/env python3
"""How much of selection is luck, and what fewer trials would have selected, from records of runs.

    results/fetch
    results/luck.py [BUNDLE...]

A bundle has the fitness of every individual in every trial. For every generation, the script
splits the variance of fitness into that between individuals and the rest, which is luck: all
individuals meet the same trials, so the difficulty of a trial is no part of either. Then it lets
rules rank by some trials, and measures the gain: the fitness of the better half, with the weights
of SNES, above the mean of all, in a trial that the rule did not use. Needs Python 3.9 and nothing
else.
"""

import argparse
import random
import struct
import zipfile
from functools import lru_cache
from math import log
from pathlib import Path
from statistics import fmean, median

from report import RESULTS

NAMES = ["leader_selection_ga-0", "borderline_snes-0", "orientation_consensus_snes-0", "light_follower_snes-0"]
N_BLOCKS = 20


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    bundles = [RESULTS / "bundles" / f"{name}.zip" for name in NAMES]
    parser.add_argument("bundles", type=Path, nargs="*", default=bundles)
    for bundle in parser.parse_args().bundles:
        report(bundle)


def report(bundle):
    generations = [trials for trials in read(bundle) if len({tuple(row) for row in trials}) > 1]
    n_trials = len(generations[0][0])
    print(f"\n{bundle.stem}: {len(generations)} generations, {len(generations[0])} individuals, {n_trials} trials")
    parts = [variances(trials) for trials in generations]
    print("| generations | share of luck by 1 | 2 | 5 | 10 | 20 trials |\n|---|---|---|---|---|---|")
    for name, chosen in (("first tenth", parts[: len(parts) // 10]), ("last half", parts[len(parts) // 2 :]), ("all", parts)):
        print(f"| {name} | " + " | ".join(f"{luck(chosen, n):.2f}" for n in (1, 2, 5, 10, 20)) + " |")

    print("| rule | trials per individual | gain | gain per trial |\n|---|---|---|---|")
    rules = {
        **{f"{n} of {n_trials} trials": (n, lambda means, n=n: means(n)) for n in range(1, n_trials)},
        "race: 1 trial, the better half 3 more": (2.5, race(1, 4)),
        "race: 2 trials, the better half 2 more": (3, race(2, 4)),
    }
    gains = {name: [gain(trials, rule) for trials in generations] for name, (_, rule) in rules.items()}
    full = gains[f"{n_trials - 1} of {n_trials} trials"]
    for name, (cost, _) in rules.items():
        share, low, high = ratio(gains[name], full)
        faster = (n_trials - 1) / cost
        print(f"| {name} | {cost:g} | {share:.2f} ({low:.2f} to {high:.2f}) | {share * faster:.2f} ({low * faster:.2f} to {high * faster:.2f}) |")


def read(bundle):
    """Per generation, the fitness [individual][trial] from the frames of the fitness log."""
    with zipfile.ZipFile(bundle) as archive:
        log = archive.read("fitness-log.bin")
    at = 0
    while at < len(log):
        (length,) = struct.unpack_from("<Q", log, at)
        yield entry(log[at + 8 : at + 8 + length])
        at += 8 + length


def entry(data):
    at = 1  # after the version of the format

    def count():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    rows = []
    for _ in range(count()):
        n = count()
        rows.append(struct.unpack_from(f"<{n}d", data, at))
        at += 8 * n
    return rows


def variances(trials):
    """Variance between individuals, and of one trial around that: a two-way analysis of variance."""
    n, t = len(trials), len(trials[0])
    means, columns = [fmean(row) for row in trials], [fmean(column) for column in zip(*trials)]
    whole = fmean(means)
    rest = sum((x - m - c + whole) ** 2 for row, m in zip(trials, means) for x, c in zip(row, columns)) / ((n - 1) * (t - 1))
    between = t * sum((m - whole) ** 2 for m in means) / (n - 1)
    return max(0.0, (between - rest) / t), rest


def luck(parts, n):
    """Median share of luck in the variance of a mean over n trials."""
    return median(rest / n / (true + rest / n) if true + rest > 0 else 1.0 for true, rest in parts)


def race(first, whole):
    def rule(means):
        early = means(first)
        late = means(whole)
        kept = set(sorted(range(len(early)), key=lambda i: -early[i])[: len(early) // 2])
        # Those out of the race rank behind all others.
        return [(i in kept, late[i] if i in kept else early[i]) for i in range(len(early))]

    return rule


def gain(trials, rule):
    """The gain by a rule, a mean over the trials that it does not use."""
    n, t = len(trials), len(trials[0])
    gains = []
    for held_out in range(t):
        others = [i for i in range(t) if i != held_out]
        rng = random.Random(held_out)
        rng.shuffle(others)
        selected = rule(lambda k: [fmean(row[i] for i in others[:k]) for row in trials])
        ranking = sorted(range(n), key=lambda i: selected[i], reverse=True)
        mean = fmean(row[held_out] for row in trials)
        gains.append(sum(u * (trials[i][held_out] - mean) for i, u in zip(ranking, utilities(n))))
    return fmean(gains)


@lru_cache
def utilities(n):
    raw = [max(0.0, log(n / 2 + 1) - log(k)) for k in range(1, n + 1)]
    return [u / sum(raw) for u in raw]


def ratio(gains, full):
    """Ratio of the sums, with a 95 % interval by bootstrap of blocks of successive generations."""
    size = max(1, len(gains) // N_BLOCKS)
    blocks = [(sum(gains[i : i + size]), sum(full[i : i + size])) for i in range(0, len(gains), size)]
    rng = random.Random(0)
    drawn = []
    for _ in range(1000):
        chosen = rng.choices(blocks, k=len(blocks))
        drawn.append(sum(a for a, _ in chosen) / sum(b for _, b in chosen))
    drawn.sort()
    return sum(gains) / sum(full), drawn[25], drawn[974]


if __name__ == "__main__":
    main()
