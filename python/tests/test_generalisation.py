"""Fitness under other conditions: the list of conditions, and the change of each."""

import numpy as np
import pytest
from conftest import PROJECT

import swarmevo
from swarmevo import analysis
from swarmevo.analysis.generalisation import _conditions


def test_other_conditions_are_other_experiments_in_the_same_trials(quickstart, genotypes):
    found = analysis.generalisation(quickstart, genotypes[0], trials=3)
    as_it_is = quickstart.evaluate(genotypes[:1], 1_000_000, trials=3)[0]
    assert found[0].what == "" and found[0].mean == as_it_is.mean()
    for what in ("robots", "robots, as dense as before"):
        assert {it.value for it in found if it.what == what} == {2, 8, 10, 15, 25}
    assert {it.value for it in found if it.what.startswith("reach of the radio")} == {50, 75, 150, 200}


def test_a_swarm_that_does_not_fit_is_a_row_that_says_so(quickstart, genotypes):
    config = quickstart.to_dict()
    config["world"] |= {"width": 200, "height": 200}
    found = analysis.generalisation(swarmevo.Experiment.from_dict(config), genotypes[0], trials=2)
    problems = {it.value: it.problem for it in found if it.what == "robots"}
    assert "no place" in problems[25] and problems[8] == ""


def test_affected_robots_stay_the_same_share_of_a_swarm():
    experiment = swarmevo.Experiment.from_file(PROJECT / "configs/light_follower_snes.json")
    (robots,) = (config for what, value, config in _conditions(experiment.to_dict()) if (what, value) == ("robots", 20))
    inhibited = robots["world"]["objects"]["robotA"]["perturbations"]["stimuli_inhibition"]
    assert (inhibited if isinstance(inhibited, dict) else inhibited[0])["affected_robots"] == 16


def conditions(name, what):
    experiment = swarmevo.Experiment.from_file(PROJECT / f"configs/{name}.json")
    return {value: swarmevo.Experiment.from_dict(config) for of, value, config in _conditions(experiment.to_dict()) if of == what}


def neighbours(experiment, reach=100):
    """Robots within the radio's reach of a robot when episodes begin."""
    trace = experiment.simulate(np.full(experiment.n_genes, 0.5), 1_000_000, trials=40)
    world = experiment.to_dict()["world"]
    size = np.array([world["width"], world["height"]])
    ways = trace.positions[:, 0, :, np.newaxis] - trace.positions[:, 0, np.newaxis]
    apart = np.linalg.norm((ways + size / 2) % size - size / 2, axis=-1)
    return float((apart < reach).sum(axis=-1).mean() - 1)


def test_a_world_that_grows_with_its_swarm_keeps_its_density_and_one_that_does_not_gets_crowded():
    as_dense, crowded = (conditions("light_follower_snes", what)[30] for what in ("robots, as dense as before", "robots"))
    world = as_dense.to_dict()["world"]
    assert world["width"] * world["height"] / 30 == pytest.approx(1000 * 1000 / 10)
    assert world["objects"]["light_red"]["initializers"]["positions"]["params"]["values"] == [[pytest.approx(500 * 3**0.5)] * 2]
    ten = neighbours(swarmevo.Experiment.from_file(PROJECT / "configs/light_follower_snes.json"))
    # Only the share of robots at the swarm's border differs.
    assert ten < neighbours(as_dense) < 1.6 * ten
    assert neighbours(crowded) > 3 * ten


def test_density_changes_alone_if_the_file_sets_the_starting_density():
    what = "density of as many robots, times"
    found = conditions("light_follower_snes", what)
    assert {it.n_robots for it in found.values()} == {10}
    company = [neighbours(found[density]) for density in (0.25, 0.5, 2, 4)]
    assert company == sorted(company) and company[-1] > 3 * company[0]
    assert not conditions("leader_selection_snes", what), "a random graph has distances of its own"


def test_other_sets_of_trials_are_disjoint_and_have_the_same_experiment(quickstart, genotypes):
    found = [it for it in analysis.generalisation(quickstart, genotypes[0], trials=3) if it.what == "set of trials"]
    assert [it.value for it in found] == [2, 3, 4, 5]
    for it in found:
        there = quickstart.evaluate(genotypes[0], 1_000_000 + int(it.value) - 1, trials=3)
        assert it.mean == there.mean()
    assert len({it.mean for it in found}) == 4
