"""An evaluator for OpenEvolve, whose programs are controllers: scripts with ``control(robot)``.

    SWARM_TASK=configs/tasks/aggregation.json openevolve-run first.star python/examples/judge_for_openevolve.py --config my.yaml

``my.yaml`` has ``file_suffix: .star`` and ``language: python``. A model reads the error of a bad script.
"""

import os
from pathlib import Path

from openevolve.evaluation_result import EvaluationResult

import swarmevo

TASK = swarmevo.Experiment.from_file(os.environ["SWARM_TASK"])
BAD = float(os.environ.get("SWARM_BAD", 0))  # less than every fitness of the task


def evaluate(program_path: str) -> EvaluationResult:
    [verdict] = swarmevo.judge([Path(program_path).read_text()], TASK, trials=10)
    if verdict.error is not None:
        return EvaluationResult({"combined_score": BAD}, {"error": verdict.error})
    return EvaluationResult({"combined_score": verdict.fitness, **verdict.measures})
