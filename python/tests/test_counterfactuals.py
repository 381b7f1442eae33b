"""Counterfactuals: what one message, or one thing that was sensed, has caused."""

import json

import numpy as np
import pytest
from conftest import PROJECT

import swarmevo
from swarmevo import analysis


@pytest.fixture(scope="module")
def leader():
    """Experiment A and its champion."""
    champion = json.loads((PROJECT / "results/champions/leader_selection_snes-0.json").read_text())
    return swarmevo.Experiment.from_file(PROJECT / "configs/leader_selection_snes.json"), champion["genotype"]


def test_what_a_leader_says_moves_others_and_what_relays_would_say_does_not(leader):
    found = analysis.influence(*leader, [40, 45], trials=4)
    assert found.said.any() and not found.said.all()
    assert (found.reached[~found.said] == 0).all(), "a message that is not sent has no influence"
    assert (found.reached[found.said] > 0).any()
    assert found.reached.max() <= 9


def test_a_message_that_nobody_senses_has_no_influence_at_all(leader):
    experiment, genotype = leader
    config = experiment.to_dict()
    config["world"]["objects"]["robotA"]["perturbations"] = {
        "stimuli_inhibition": {"stimuli": "wireless_receiver:msg", "affected_robots": "all"}
    }
    found = analysis.influence(swarmevo.Experiment.from_dict(config), genotype, [5, 40], trials=4)
    assert found.said.any()
    assert not found.reached.any() and not found.leds.any() and not found.fitness.any()


def test_a_message_replaced_by_itself_changes_nothing_and_a_wrong_step_is_refused(leader):
    experiment, genotype = leader
    trace = experiment.simulate(genotype, swarmevo.TrialSet.evaluation(), trials=1)
    (sender, *_) = np.flatnonzero(trace.sends[0, 40])
    episodes = experiment.episodes(swarmevo.TrialSet.evaluation(), trials=1)
    episodes.load(genotype)
    while episodes.n_steps_done < 40:
        episodes.step(episodes.decide())
    itself = episodes.decide().messages[0, sender]
    found = analysis.influence(experiment, genotype, [40], replace=itself, agents=[sender], trials=1)
    assert not found.said.any() and not found.reached.any()
    with pytest.raises(ValueError, match="steps from 0 to 298"):
        analysis.influence(experiment, genotype, [299], trials=1)


def test_what_an_input_without_synapses_says_is_heeded_by_nobody(leader):
    experiment, genotype = leader
    where, zero = analysis.synapse_genes(experiment)
    network = experiment.network(genotype)
    of = [i for i, it in enumerate(network.description["synapses"]) if it["pre"] in ({"input": 0}, {"input": 1})]
    deaf = np.array(genotype)
    deaf[where[of]] = zero[of]
    for genes, is_deaf in ((deaf, True), (genotype, False)):
        found = analysis.attention(experiment, genes, [30, 35], sensor="wireless_receiver:msg", replace=0.7, trials=3)
        assert found.sensed.all()
        effects = (found.heeded, found.reached, found.leds, found.fitness)
        assert not any(it.any() for it in effects) if is_deaf else found.heeded.any()


def test_who_senses_what_it_would_have_sensed_does_what_it_did(leader):
    found = analysis.attention(*leader, [0], replace="freeze", trials=3)
    assert not found.sensed.any() and not found.heeded.any() and not found.reached.any()


def test_the_longer_a_robot_is_deaf_the_more_it_does_otherwise(leader):
    once, always = (
        analysis.attention(*leader, [40], sensor="wireless_receiver", lasting=lasting, trials=5) for lasting in (1, 11)
    )
    assert (once.sensed <= always.sensed).all() and once.sensed.any()
    assert (once.heeded[~once.sensed] == 0).all(), "nothing replaced, nothing caused"
    assert always.leds.sum() > once.leds.sum()


def test_sensors_that_no_network_has_are_refused(leader):
    with pytest.raises(ValueError, match="no input comes from 'light_sensor'; there are wireless_receiver:msg, "):
        analysis.attention(*leader, [40], sensor="light_sensor")
    with pytest.raises(ValueError, match="lasting from 1 to 11"):
        analysis.attention(*leader, [40], lasting=12)
    with pytest.raises(ValueError, match="agents are numbered from 0 to 9, not 10, -1"):
        analysis.attention(*leader, [40], agents=[3, 10, -1])


def test_stimuli_that_do_not_fit_are_refused_and_those_that_are_set_are_sensed(quickstart, genotypes):
    episodes = quickstart.episodes()
    before = episodes.stimuli
    with pytest.raises(ValueError, match="stimuli are an array"):
        episodes.stimuli = before[:, 1:]
    wrong = before.copy()
    wrong[0, 1, 2] = np.nan
    with pytest.raises(ValueError, match="stimulus number 7 is NaN, not within the finite numbers"):
        episodes.stimuli = wrong
    assert np.array_equal(episodes.stimuli, before)
    episodes.stimuli = np.full_like(before, 0.25)
    assert (episodes.stimuli == 0.25).all()
