"""python -m swarmevo.analysis GENOTYPE -o DIRECTORY: writes a report on it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..champion import Champion
from ..errors import OtherExperimentError, SwarmError
from ..experiment import Experiment
from ..files import open as open_archive
from ..fleet import connect
from .report import report


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m swarmevo.analysis", description="Reports how a genotype solves its task.")
    parser.add_argument("genotype", help="champion file, or an address such as 3 or 3@5/7")
    parser.add_argument("--config", type=Path, help="experiment file; a champion file needs it, and its seed replaces the file's")
    parser.add_argument(
        "--changed-conditions", action="store_true",
        help="accept an experiment in which the genotype did not evolve",
    )
    parser.add_argument("--data-dir", type=Path, help="read addresses from this directory instead of a coordinator")
    parser.add_argument("--fleet", action="store_true", help="evaluate other conditions on the coordinator's fleet")
    parser.add_argument("--trials", type=int, default=50, help="episodes (%(default)s)")
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory of report.html and its tables")
    arguments = parser.parse_args()
    try:
        if Path(arguments.genotype).is_file():
            if arguments.config is None:
                parser.error("a champion file needs --config, the experiment file with which it evolved")
            champion = Champion.from_file(arguments.genotype)
        else:
            records = connect() if arguments.data_dir is None else open_archive(arguments.data_dir)
            champion = records.individual(arguments.genotype)
        if arguments.config is None:
            experiment = records.run(int(arguments.genotype.partition("@")[0])).experiment
        else:
            seed = None if champion.origin is None else champion.origin.seed
            experiment = Experiment.from_file(arguments.config, seed)
        if not arguments.changed_conditions:
            experiment.check(champion)
        client = connect() if arguments.fleet else None
        title = f"{experiment.name}: {Path(arguments.genotype).stem}"
        print(report(experiment, champion.genotype, arguments.output, title=title, trials=arguments.trials, client=client))
    except OtherExperimentError as error:
        print(f"error: {error.reason}; --changed-conditions accepts this one", file=sys.stderr)
        return 1
    except (SwarmError, OSError, ValueError, KeyError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
