#!/usr/bin/env python3
"""Prints the table of repertoires in docs/gallery.md, from the bundles in results/repertoires.

    results/repertoires.py              prints it
    results/repertoires.py --update     writes it into that page, the maps into docs/figures, the elites beside the bundles
    results/repertoires.py --run        evolves them anew before, in three minutes of one core each

Needs `swarmctl` on the path, Python 3.9 and nothing else.
"""

import json
import sys
import tempfile

from report import RESULTS, markdown, print_or_update, swarmctl

DOCS = RESULTS.parent / "docs"
NAMES = ["flocking", "foraging"]
HEAD = ["repertoire", "descriptors", "elites", "QD score", "coverage", "stay in their cell"]


def evolve(name, bundle):
    with tempfile.TemporaryDirectory() as data:
        file = RESULTS.parent / "configs" / "repertoires" / f"{name}.json"
        swarmctl("run", file, "--workers", 1, "--data-dir", data)
        swarmctl("export", 1, "--to", bundle, "--force", "--data-dir", data)


def line(name):
    bundle = RESULTS / "repertoires" / f"{name}.zip"
    if "--run" in sys.argv:
        evolve(name, bundle)
    with tempfile.TemporaryDirectory() as data:
        swarmctl("import", bundle, "--data-dir", data)
        found = json.loads(swarmctl("repertoire", 1, "--output", "json", "--data-dir", data))
        if "--update" in sys.argv:
            bundle.with_suffix(".csv").write_text(swarmctl("repertoire", 1, "--output", "csv", "--data-dir", data))
            swarmctl("repertoire", 1, "--to", DOCS / "figures" / f"repertoire-{name}.png", "--force", "--data-dir", data)
    of = found["corrected"]
    descriptors = ", ".join(f"`{axis['measure']}`" for axis in found["axes"])
    return [name, descriptors, str(len(found["elites"])), f"{of['qd_score']:.1f}", f"{of['coverage']:.0%}", f"{of['stay']:.0%}"]


if __name__ == "__main__":
    print_or_update(DOCS / "gallery.md", "repertoires", markdown(HEAD, map(line, NAMES)))
