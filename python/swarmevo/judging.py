"""Judges many candidate scripts at once: controllers and goals that a program or a language model has written."""

from __future__ import annotations

import ast
import json
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Sequence

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments
from .errors import EvolutionError, FleetError, SwarmError
from .experiment import Experiment, thread_count
from .representation import short
from .trials import TRIALS_MAX, TrialSet, address

if TYPE_CHECKING:
    from .fleet import Client

Floats = NDArray[np.float64]

HOOKS = ("control", "fitness", "final", "measures", "sense", "move", "react")
"""The functions that a simulator calls."""
CONSTANT = re.compile(r"^(\w+)\s*=", re.MULTILINE)
GOAL = {"fitness", "final"}
NAME = "candidate.star"
FLEET_CALLS_MAX = 32
"""Candidates that a fleet judges at the same time."""
ABOUT_THE_FLEET = ("UNAVAILABLE", "DEADLINE_EXCEEDED", "UNAUTHENTICATED", "PERMISSION_DENIED", "UNIMPLEMENTED", "RESOURCE_EXHAUSTED")
"""Failures that are not the fault of a candidate."""


@dataclass(frozen=True)
class Verdict:
    """What a candidate is worth."""

    fitness: float
    """Mean fitness over the trials, by the task; minus infinity for a bad candidate."""
    trial_fitness: Floats = field(default_factory=lambda: np.empty(0))
    """``[T]``: the fitness of each trial; empty for a bad candidate."""
    measures: dict[str, float] = field(default_factory=dict)
    """The mean of each measure of the task over steps and trials; NaN for a measure without a value."""
    error: str | None = None
    """Why the candidate is bad, with the line of the script; None for a good one."""

    __repr__ = short


def judge(
    candidates: Sequence[str],
    task: Experiment,
    *,
    trials: int = 10,
    generations: int | None = None,
    client: Client | None = None,
    threads: int | None = None,
    seconds: float = 10.0,
) -> list[Verdict]:
    """Judges each candidate by the task: by its fitness and measures, in T ``trials`` that no evolution uses, the
    same for all candidates. A bad script is a bad candidate with its error, and never an exception.

    A candidate is the text of a script (``docs/tasks.md`` of the project), with one of

    - ``control(robot)``: a controller, in place of the robots' network;
    - ``fitness(world)`` or ``final(state)``: a goal. Evolution pursues it for ``generations``, by default those of
      the task, and the task judges the champion. This costs an evolution for each candidate.

    It may have functions of its own, but no other one that the simulator calls: so no candidate can change how it is
    judged. A task that keeps its books in the ``state`` of robots can still be deceived by a controller.

    ``client``: a fleet that judges, with the same bits. Else this process does, with ``threads``, and gives up a
    controller after ``seconds``. New trials, for a last judgement: ``task.replace(seed=...)``.

    >>> task = Experiment.quickstart()
    >>> leader, silent, wrong = judge(["def control(robot):\\n    robot.led = robot.id == 0",
    ...     "def control(robot):\\n    robot.led = False", "def control(robot):\\n    robot.led = 1 / 0"], task, trials=2)
    >>> leader.fitness > silent.fitness, leader.measures["leaders"]
    (True, 1.0)
    >>> wrong.error
    'candidate.star:2: division by zero, for robot 0 (in step 0 of evaluation, trial 0)'
    """
    if isinstance(candidates, str):
        raise ValueError("candidates are a list of scripts, not one text")
    texts = [arguments.name_of(it, "a candidate") for it in candidates]
    n_trials = arguments.whole(trials, "trials", 1, TRIALS_MAX)
    generations = None if generations is None else arguments.whole(generations, "generations", 1)
    seconds = arguments.seconds(seconds, "seconds")
    own = _script(task)[1]
    verdicts: list[Verdict | None] = [_refused(text, own) for text in texts]
    controllers = [i for i, text in enumerate(texts) if verdicts[i] is None and "control" in _hooks(text)]
    goals = [i for i, text in enumerate(texts) if verdicts[i] is None and i not in set(controllers)]
    if controllers:
        files = [_controlled(task, texts[i]) for i in controllers]
        if client is None:
            where = address(TrialSet.evaluation(), n_trials, n_trials)
            judged = [_verdict(*it) for it in _core.judge(files, None, where, thread_count(threads), seconds)]
        else:
            judged = _by_fleet(client, files, np.full(task.n_genes, 0.5), n_trials)
        for i, verdict in zip(controllers, judged):
            verdicts[i] = verdict
    for i in goals:
        verdicts[i] = _of_goal(task, texts[i], n_trials, generations, client, threads)
    return [_placed(it, text, own) for it, text in zip(verdicts, texts) if it is not None]


def _hooks(text: str) -> set[str]:
    """The functions of a script that a simulator would call; perhaps more, never fewer."""
    return set(re.findall(r"\bdef[\s\\]+(\w+)", text)) & set(HOOKS)


def _refused(text: str, own: str) -> Verdict | None:
    """The verdict of a candidate that is not even tried."""
    found = _hooks(text)
    if found == {"control"} or (found and found <= GOAL):
        # The task's value would replace the candidate's, without a word.
        twice = sorted(set(CONSTANT.findall(text)) & set(CONSTANT.findall(own)))
        return _bad(f"`{twice[0]}` is a constant of the task's script, too; choose another name") if twice else None
    names = " and ".join(f"`{it}`" for it in sorted(found)) or "neither"
    return _bad(f"a candidate defines `control`, or `fitness` or `final`, and no other function that the simulator calls; this one defines {names}")


def _bad(error: str) -> Verdict:
    return Verdict(-np.inf, error=error)


def _script(task: Experiment) -> tuple[str, str]:
    """Name and text of the task's own script; empty for a built-in goal."""
    script = task.to_dict().get("task", {}).get("script", {"name": "", "text": ""})
    return script["name"], script["text"]


def _controlled(task: Experiment, text: str) -> str:
    """The experiment file in which a script controls the robots."""
    config = task.to_dict()
    config["world"]["objects"][config["algorithm"]["evolvable_object"]]["controller"] = "script_controller"
    return _with_script(config, text, _script(task)[1])


def _pursued(task: Experiment, text: str, generations: int | None) -> str:
    """The experiment file whose goal is a script."""
    config = task.to_dict()
    config["algorithm"].pop("fitness_function", None)
    config["algorithm"] |= {} if generations is None else {"generations": generations}
    own = _script(task)[1].splitlines()
    for it in ast.parse("\n".join(own)).body:
        if isinstance(it, ast.FunctionDef) and it.name in GOAL:
            own[it.lineno - 1 : it.end_lineno] = [""] * ((it.end_lineno or it.lineno) - it.lineno + 1)
    return _with_script(config, text, "\n".join(own))


def _with_script(config: dict[str, Any], text: str, own: str) -> str:
    # The candidate comes first, so that its lines have their numbers.
    config["task"] = {"script": {"name": NAME, "text": f"{text}\n{own}"}}
    return json.dumps(config)


def _placed(verdict: Verdict, text: str, own: str) -> Verdict:
    """A verdict whose error names lines of the candidate, or says that they are the task's."""
    if verdict.error is None:
        return verdict
    n_lines = len(text.splitlines()) + (text[-1:] == "\n")

    def place(found: re.Match[str]) -> str:
        line = int(found[1])
        return found[0] if line <= n_lines or not own else f"the task's script:{line - n_lines}"

    return Verdict(verdict.fitness, error=re.sub(re.escape(NAME) + r":(\d+)", place, verdict.error))


def _verdict(fitness: Sequence[float], measures: Sequence[tuple[str, Sequence[float]]], error: str | None) -> Verdict:
    """A verdict of the extension."""
    if error is not None:
        return _bad(error)
    means = {name: _mean(np.asarray(values, np.float64)) for name, values in measures}
    return Verdict(float(np.mean(fitness)), np.asarray(fitness), means)


def _mean(values: Floats) -> float:
    """The mean of the values that there are."""
    return float(np.mean(values[~np.isnan(values)])) if not np.isnan(values).all() else float("nan")


def _by_fleet(client: Client, files: Sequence[str], genotype: Floats, n_trials: int) -> list[Verdict]:
    def one(file: str) -> Verdict:
        try:
            names, steps = client._measured(file, genotype, n_trials)
        except FleetError as error:
            if error.code in ABOUT_THE_FLEET:
                raise
            return _bad(str(error))
        measures = [(name, [_mean(values[:, i]) for _, values in steps]) for i, name in enumerate(names)]
        return _verdict([fitness for fitness, _ in steps], measures, None)

    with ThreadPoolExecutor(FLEET_CALLS_MAX) as pool:
        return list(pool.map(one, files))


def _of_goal(
    task: Experiment, text: str, n_trials: int, generations: int | None, client: Client | None, threads: int | None
) -> Verdict:
    """What the champion that evolved for a goal is worth by the task."""
    from .local import evolve

    try:
        experiment = Experiment(_pursued(task, text, generations))
        if client is None:
            champion = evolve(experiment, progress=False, threads=threads).champion.genotype
        else:
            champion = client.submit(experiment).wait(progress=False).champion.genotype
    except FleetError as error:
        if error.code in ABOUT_THE_FLEET:
            raise
        return _bad(str(error))
    except (SwarmError, EvolutionError, ValueError) as error:
        return _bad(str(error))
    if client is not None:
        [verdict] = _by_fleet(client, [task.to_json()], champion, n_trials)
        return verdict
    measured = task.measure(champion, TrialSet.evaluation(), trials=n_trials, threads=threads)
    measures = [(name, [_mean(steps) for steps in values]) for name, values in measured.measures.items()]
    return _verdict(measured.fitness.tolist(), measures, None)
