"""Evaluators for OpenEvolve and ShinkaEvolve, with the real packages, and a substitute for the model.

They are large, so they are no part of requirements.txt: ``pip install -r python/tests/evolvers.txt``.
"""

import asyncio
import json
import sys
from pathlib import Path

import pytest
from conftest import PROJECT
from stub_model import model, mutated

EXAMPLES = PROJECT / "python/examples"
TASK = PROJECT / "configs/tasks/aggregation.json"
FIRST = (PROJECT / "configs/tasks/by_hand/aggregation.star").read_text().replace("TURN = 4", "TURN = 0.1")


@pytest.fixture
def evolver(request):
    try:
        return pytest.importorskip(request.param)
    except pytest.skip.Exception:
        pytest.skip(f"SKIPPED: no package {request.param}; pip install -r python/tests/evolvers.txt")


@pytest.mark.parametrize("evolver", ["openevolve"], indirect=True)
def test_openevolve_evolves_controllers(evolver, tmp_path, monkeypatch):
    from openevolve.config import Config, LLMModelConfig

    monkeypatch.setenv("SWARM_TASK", str(TASK))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    config = Config(max_iterations=8, diff_based_evolution=False, file_suffix=".star", language="python", random_seed=3)
    config.llm.models = config.llm.evaluator_models = [LLMModelConfig(name="stub", init_client=model)]
    config.evaluator.cascade_evaluation = False
    config.evaluator.parallel_evaluations = 1
    (tmp_path / "first.star").write_text(FIRST)
    found = evolver.run_evolution(tmp_path / "first.star", EXAMPLES / "judge_for_openevolve.py", config, output_dir=str(tmp_path / "out"))
    first = asyncio.run(evaluated(config, FIRST))
    assert found.best_score >= first["combined_score"] > 0 and {"solved", "largest_cluster"} <= set(found.metrics)
    assert "def control(robot)" in found.best_code
    bad = asyncio.run(evaluated(config, "def control(robot):\n    robot.nothing = 1\n"))
    assert bad["combined_score"] == 0


async def evaluated(config, program):
    from openevolve.evaluator import Evaluator

    return await Evaluator(config.evaluator, str(EXAMPLES / "judge_for_openevolve.py"), suffix=".star").evaluate_program(program, "one")


@pytest.mark.parametrize("evolver", ["shinka"], indirect=True)
def test_shinkaevolve_runs_the_evaluator_as_jobs(evolver, tmp_path):
    from shinka.launch import JobScheduler, LocalJobConfig

    job = LocalJobConfig(eval_program_path=str(EXAMPLES / "judge_for_shinka.py"), extra_cmd_args={"task": str(TASK)}, python_executable=sys.executable)
    scheduler = JobScheduler("local", job)
    programs, results = [FIRST], []
    for generation in range(4):
        place = tmp_path / f"gen_{generation}"
        place.mkdir()
        (place / "main.star").write_text(programs[-1])
        found, _ = scheduler.run(str(place / "main.star"), str(place))
        results.append((found["correct"]["correct"], found["metrics"]["combined_score"], programs[-1]))
        programs.append(mutated(max(results)[2]) if generation < 2 else "def control(robot):\n    robot.nothing = 1\n")
    assert all(score > 0 for is_good, score, _ in results if is_good) and results[0][0]
    assert results[3][:2] == (False, 0.0)
    assert "candidate.star:2: no object has a `nothing`" in json.loads((tmp_path / "gen_3" / "correct.json").read_text())["error"]
