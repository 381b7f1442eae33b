"""Candidate scripts are judged by the task, many at once: good ones have a fitness, bad ones a reason."""

import time

import numpy as np
import pytest
from conftest import PROJECT
from processes import fleet

import swarmevo

CONFIGS = PROJECT / "configs/tasks"
LEADER = "def control(robot):\n    robot.led = robot.id == 0\n"


@pytest.fixture(scope="module")
def gathering():
    return swarmevo.Experiment.from_file(CONFIGS / "aggregation.json")


@pytest.fixture(scope="module")
def by_hand():
    return (CONFIGS / "by_hand/aggregation.star").read_text()


def test_the_verdict_on_a_controller_is_what_the_simulator_computes(gathering, by_hand):
    [verdict] = swarmevo.judge([by_hand], gathering, trials=4)
    config = gathering.to_dict()
    config["world"]["objects"]["robot"]["controller"] = "script_controller"
    config["task"]["script"]["text"] += "\n" + by_hand
    same = swarmevo.Experiment.from_dict(config)
    measured = same.measure(np.full(same.n_genes, 0.5), swarmevo.TrialSet.evaluation(), trials=4)
    assert verdict.trial_fitness.tolist() == measured.fitness.tolist() and verdict.fitness == measured.fitness.mean()
    assert verdict.measures["largest_cluster"] == pytest.approx(np.nanmean(measured.measures["largest_cluster"]))
    assert verdict.error is None and verdict.measures.keys() == {"largest_cluster", "solved"} and verdict.fitness > 0.9


def test_candidates_are_judged_alike_in_any_number_on_any_threads(gathering, by_hand):
    candidates = [by_hand.replace("TURN = 4", f"TURN = {turn}") for turn in (0, 1, 2, 4, 8)]
    together = swarmevo.judge(candidates, gathering, trials=3, threads=2)
    assert [it.fitness for it in together] == [swarmevo.judge([it], gathering, trials=3, threads=1)[0].fitness for it in candidates]
    assert len({it.fitness for it in together}) == 5
    assert swarmevo.judge([], gathering) == []


@pytest.mark.parametrize(("text", "why"), [
    ("", "neither"),
    ("x = 1", "neither"),
    ("def control(robot):\n    robot.left =", "candidate.star:2"),
    ("def control(robot):\n    robot.left = 7", "candidate.star:2: the action of a wheel"),
    ("def control(robot):\n    robot.left = 1 / 0", "candidate.star:2"),
    ("def control(robot):\n    robot.colour = 1", "candidate.star:2"),
    ("def control(robot):\n    fail('no idea', robot.id)", "no idea"),
    ("SIGHT = 3\ndef control(robot):\n    robot.left = 1", "`SIGHT` is a constant of the task's script"),
    ("def control(robot):\n    robot.left = 1\n" + "# long\n" * 6000, "32"),
    (LEADER + "def fitness(world):\n    return 1e9", "`control` and `fitness`"),
    (LEADER + "def  final(state):\n    return 1e9", "`control` and `final`"),
    (LEADER + "def \\\nreact(world):\n    pass", "`control` and `react`"),
    (LEADER + "def sense(robot):\n    return [1, 1]", "`control` and `sense`"),
])
def test_a_bad_candidate_has_a_reason_and_hinders_nobody(gathering, by_hand, text, why):
    bad, good = swarmevo.judge([text, by_hand], gathering, trials=2)
    assert bad.fitness == -np.inf and bad.trial_fitness.size == 0 and not bad.measures
    assert why in bad.error, bad.error
    assert good.error is None and good.fitness > 0.5


def test_lines_of_the_task_are_named_as_such(gathering):
    [bad] = swarmevo.judge(["def nearest(robot):\n    return 1\ndef is_late(world):\n    return 1\ndef control(robot):\n    robot.left = 1"], gathering)
    assert "is_late" in bad.error and ("the task's script:" in bad.error or "candidate.star:3" in bad.error), bad.error


def test_a_candidate_that_takes_too_long_is_given_up(gathering):
    slow = "def control(robot):\n    n = 0\n    for i in range(200):\n        for j in range(200):\n            n = n + i\n    robot.left = 0\n"
    started = time.monotonic()
    [bad] = swarmevo.judge([slow], gathering, trials=4, seconds=0.3)
    assert "longer than 0.3 s" in bad.error and time.monotonic() - started < 5


def test_a_goal_is_judged_by_the_task_after_an_evolution(gathering):
    small = gathering.replace(generations=6, judgement_trials=4, champion_trials=4)
    near = ("def fitness(world):\n    center = world.centroid(world.robots)\n"
            "    return -sum([robot.distance(center) for robot in world.robots]) / 1000\n")
    far = near.replace("-sum", "sum")
    good, bad, wrong, error = swarmevo.judge([near, far, near.replace("center)", "centre)"), "def fitness(world):\n    return 1 / 0"], small, trials=20)
    assert good.fitness > bad.fitness and good.measures["largest_cluster"] > bad.measures["largest_cluster"]
    assert "centre" in wrong.error and "candidate.star:3" in wrong.error and "candidate.star:2" in error.error
    quickstart = swarmevo.Experiment.quickstart().replace(generations=2, judgement_trials=2, champion_trials=2)
    [verdict] = swarmevo.judge(["def fitness(world):\n    return len([it for it in world.robots if it.led])"], quickstart)
    assert verdict.error is None and "leaders" in verdict.measures


def test_arguments_are_checked(gathering):
    for candidates in ("def control(robot):\n    robot.left = 1", [3]):
        with pytest.raises(ValueError):
            swarmevo.judge(candidates, gathering)
    for wrong in ({"trials": 0}, {"trials": 1.5}, {"seconds": -1}, {"generations": 0}, {"threads": 0}):
        with pytest.raises(ValueError):
            swarmevo.judge([LEADER], gathering, **wrong)


def test_a_fleet_judges_with_the_same_bits(gathering, by_hand, programs, tmp_path):
    pytest.importorskip("grpc")
    candidates = [by_hand, "def control(robot):\n    robot.left = 7", by_hand.replace("TURN = 4", "TURN = 1"), "def control(robot):\n    x"]
    goal = "def fitness(world):\n    return -world.robots[0].distance(world.center)"
    small = gathering.replace(generations=2, judgement_trials=4, champion_trials=4)
    with fleet(programs, tmp_path) as running:
        running.start_worker()
        with running.connect() as client:
            there = swarmevo.judge([*candidates, goal], small, trials=3, client=client)
    here = swarmevo.judge([*candidates, goal], small, trials=3)
    for one, other in zip(there, here):
        assert one.fitness == other.fitness and one.trial_fitness.tolist() == other.trial_fitness.tolist()
        assert one.measures == pytest.approx(other.measures, nan_ok=True) and (one.error is None) == (other.error is None)
    assert "candidate.star:2: the action of a wheel" in there[1].error
