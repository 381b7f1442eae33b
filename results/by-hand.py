#!/usr/bin/env python3
"""Compares champions of configs/tasks with controllers written by hand, on the same trials.

    results/by-hand.py [--trials N] [TASK...]

For every TASK, by default all of configs/tasks/by_hand, evaluates results/champions/TASK-0.json, and robots
that do what configs/tasks/by_hand/TASK.star says, on trials that no evolution uses, and prints the
means with their 95 % intervals. Needs swarmctl in the PATH, Python 3.9 and nothing else.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

RESULTS = Path(__file__).resolve().parent
TASKS = RESULTS.parent / "configs" / "tasks"


def evaluation(config, champion, trials, to):
    """What `swarmctl evaluate` says of the experiment file as it is."""
    command = ["swarmctl", "evaluate", "--local", "--config", config, "--genotype", champion,
               "--changed-conditions", "--trials", str(trials), "--to", to]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    return json.loads((to / "summary.json").read_text())["conditions"][0]


def by_hand(task, folder):
    """The experiment file of a task in which the script decides what robots do."""
    config = json.loads((TASKS / f"{task}.json").read_text())
    scripts = [TASKS / f"{task}.star", TASKS / "by_hand" / f"{task}.star"]
    text = "\n".join(script.read_text() for script in scripts)
    config["task"]["script"] = {"name": f"{task}_by_hand.star", "text": text}
    evolvable = config["algorithm"]["evolvable_object"]
    config["world"]["objects"][evolvable]["controller"] = "script_controller"
    path = folder / f"{task}.json"
    path.write_text(json.dumps(config))
    return path


def estimate(value):
    return f"{value['mean']:.2f} ({value['ci95'][0]:.2f} to {value['ci95'][1]:.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("tasks", nargs="*", metavar="TASK")
    args = parser.parse_args()
    tasks = args.tasks or sorted(path.stem for path in (TASKS / "by_hand").glob("*.star"))
    print("| task | evolved | by hand |")
    print("|---|---|---|")
    for task in tasks:
        champion = RESULTS / "champions" / f"{task}-0.json"
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            configs = {"evolved": TASKS / f"{task}.json", "hand": by_hand(task, folder)}
            fitness = [
                estimate(evaluation(config, champion, args.trials, folder / name)["fitness"])
                for name, config in configs.items()
            ]
        print(f"| {task} | {' | '.join(fitness)} |", flush=True)


if __name__ == "__main__":
    main()
