"""python -m swarmevo.analysis.thesis EXPERIMENT -o DIRECTORY: draws the thesis's figures of the experiment."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import SwarmError
from ..drawing import save_png, style
from . import attractors, borderline, leader_selection, light_follower, orientation_consensus
from .champion import Champion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXPERIMENTS: dict[str, Mapping[str, Callable[[Champion], Figure]]] = {
    "leader_selection": leader_selection.FIGURES,
    "borderline": borderline.FIGURES,
    "orientation_consensus": orientation_consensus.FIGURES,
    "light_follower": light_follower.FIGURES,
}
"""Figures by their number in the thesis; those of chapter 2 need no champion."""


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m swarmevo.analysis.thesis", description="Draws the figures of the thesis from champions."
    )
    parser.add_argument("experiment", choices=[*EXPERIMENTS, "attractors"], help="whose figures")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of champions and histories (%(default)s)")
    parser.add_argument("--configs", type=Path, default=Path("configs"), help="folder of experiment files (%(default)s)")
    parser.add_argument("--trials", type=int, default=50, help="episodes of each statistic (%(default)s)")
    parser.add_argument("--only", nargs="+", metavar="FIGURE", help="numbers of figures, such as 6.4; all if absent")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of the figures")
    arguments = parser.parse_args()
    figures = attractors.FIGURES if arguments.experiment == "attractors" else EXPERIMENTS[arguments.experiment]
    unknown = sorted(set(arguments.only or []) - set(figures))
    if unknown or arguments.trials < 2:
        wrong = [f"{it} is no figure of {arguments.experiment}, which has {', '.join(figures)}" for it in unknown]
        parser.error("; ".join(wrong + ["--trials: 2 or more, for intervals"] * (arguments.trials < 2)))
    champion = Champion(arguments.experiment, arguments.results, arguments.configs, arguments.trials)
    arguments.output.mkdir(parents=True, exist_ok=True)
    try:
        with style():
            for number, draw in figures.items():
                if arguments.only is None or number in arguments.only:
                    path = arguments.output / file_name(number)
                    save_png(draw(champion), path)
                    print(path)
    except (SwarmError, OSError, ValueError, KeyError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def file_name(number: str) -> str:
    """The name of a figure's file, with a number that sorts: ``thesis-6.04.png`` of Fig. 6.4."""
    chapter, _, figure = number.partition(".")
    return f"thesis-{chapter}.{int(figure):02}.png"


if __name__ == "__main__":
    sys.exit(main())
