#!/usr/bin/env python3
"""Compares variants of a repertoire or of a front on a task, with the same number of episodes.

    results/searches.py FILE --variants CHANGE... [--set CHANGE...] [--seeds S...] [--reference POINT]

FILE is an experiment file, such as configs/repertoires/flocking.json, a CHANGE is one of `swarmctl
run --set`, and each variant is one change. POINT is that of `swarmctl front --reference`. Appends
the corrected figures of each run to results/searches/NAME.csv, leaves out runs that are there
already, so you may interrupt the command, and prints median and range over the seeds. Needs
`swarmctl` on the path, Python 3.9 and nothing else.
"""

import argparse
import csv
import json
import tempfile
from pathlib import Path

from report import RESULTS, markdown, read_csv, spread, swarmctl

# Per kind of search: its command, and for each corrected figure its key, its title, factor and digits.
KINDS = {
    "repertoire": [("qd_score", "QD score", 1, 1), ("coverage", "coverage, %", 100, 0), ("stay", "stay in their cell, %", 100, 0)],
    "front": [("hypervolume", "hypervolume", 1, 3), ("stay", "stay on the front, %", 100, 0)],
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--variants", nargs="+", required=True)
    parser.add_argument("--set", nargs="+", default=[], dest="changes")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--reference")
    args = parser.parse_args()
    kind = "front" if "aims" in json.loads(args.file.read_text())["algorithm"] else "repertoire"
    to = RESULTS / "searches" / f"{args.file.stem}-{kind}.csv"
    rows = read_csv(to) if to.exists() else []
    for seed in args.seeds:
        for variant in args.variants:
            if not any((row["variant"], row["seed"]) == (variant, str(seed)) for row in rows):
                rows.append(evolve(args, kind, variant, seed))
                with to.open("w", newline="") as stream:
                    table = csv.DictWriter(stream, rows[0], lineterminator="\n")
                    table.writeheader()
                    table.writerows(rows)
    head = ["variant", *(title for _, title, _, _ in KINDS[kind])]
    print(markdown(head, [line(kind, variant, rows) for variant in args.variants]))


def evolve(args, kind, variant, seed):
    """The figures of one run."""
    sets = [part for change in [variant, *args.changes] for part in ("--set", change)]
    reference = ["--reference", args.reference] if args.reference else []
    with tempfile.TemporaryDirectory() as data:
        swarmctl("run", args.file, *sets, "--seed", seed, "--workers", 1, "--data-dir", data)
        found = json.loads(swarmctl(kind, 1, *reference, "--output", "json", "--data-dir", data))
    judged = found["corrected" if kind == "repertoire" else "figures"]
    figures = {key: round(judged[key], 4) for key, _, _, _ in KINDS[kind]}
    return {"variant": variant, "seed": str(seed), "elites": len(found["elites"]), **figures}


def line(kind, variant, rows):
    def figure(key, factor, digits):
        values = [factor * float(row[key]) for row in rows if row["variant"] == variant]
        return spread(values, digits)

    return [f"`{variant}`", *(figure(key, factor, digits) for key, _, factor, digits in KINDS[kind])]


if __name__ == "__main__":
    main()
