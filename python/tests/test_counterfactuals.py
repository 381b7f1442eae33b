"""Counterfactuals: the effects of one message or one reading."""

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


@pytest.fixture(scope="module")
def follower():
    """Experiment D, in which eight of ten robots do not see the light, and its champion."""
    champion = json.loads((PROJECT / "results/champions/light_follower_snes-0.json").read_text())
    return swarmevo.Experiment.from_file(PROJECT / "configs/light_follower_snes.json"), champion["genotype"]


def inhibited(experiment, sensor):
    """The experiment whose robots sense nothing by a sensor, and never fail."""
    return analysis.variant(experiment, perturbations={"stimuli_inhibition": {"stimuli": sensor, "affected_robots": "all"}})


def course(leader, silent=False):
    """Actions and stimuli of each step of one episode. Either all robots are silent in all steps, or none is."""
    experiment, genotype = leader
    episodes = experiment.episodes(swarmevo.TrialSet.evaluation(), trials=1)
    episodes.load(genotype)
    actions, stimuli = [], []
    while not episodes.is_over:
        stimuli.append(episodes.stimuli[0])
        actions.append(episodes.decide())
        episodes.silence(np.full(actions[-1].sends.shape, silent))
        episodes.step(actions[-1])
    return actions, stimuli


def same(one, other):
    """Whether two answers are equal, except for the agents in question."""
    return all(np.array_equal(mine, its) for name, mine in vars(one).items() for its in [vars(other)[name]])


def test_messages_of_a_leader_move_others_and_unsent_messages_of_relays_do_not(leader):
    found = analysis.influence(*leader, [40, 45], trials=4)
    assert found.said.any() and not found.said.all()
    assert (found.reached[~found.said] == 0).all(), "a message that is not sent has no influence"
    assert (found.reached[found.said] > 0).any()
    assert found.reached.max() <= 9


@pytest.mark.parametrize("sensor", ["wireless_receiver:msg", "wireless_receiver"])
def test_a_message_that_nobody_senses_has_no_influence_at_all(leader, sensor):
    experiment, genotype = leader
    found = analysis.influence(inhibited(experiment, sensor), genotype, [5, 40], trials=4)
    assert found.said.any()
    assert not found.reached.any() and not found.leds.any() and not found.fitness.any()


@pytest.mark.parametrize("reading", ["msg", "receiving_direction", "state"])
def test_inhibited_inputs_stay_inhibited(leader, reading):
    experiment, genotype = leader
    sensor = f"wireless_receiver:{reading}"
    there, away = (
        analysis.attention(it, genotype, [30, 40], sensor=sensor, replace=0.7, lasting=5, trials=3)
        for it in (experiment, inhibited(experiment, sensor))
    )
    assert there.sensed.all() and there.heeded.any()
    assert not any(it.any() for it in (away.sensed, away.heeded, away.reached, away.leds, away.fitness))


def test_replaced_readings_of_light_affect_only_robots_that_see_it(follower):
    found = analysis.attention(*follower, [20, 60], sensor="light_sensor", replace=0.7, trials=3)
    assert (found.sensed.sum(axis=-1) == 2).all(), "eight of ten are blind"
    assert found.heeded[found.sensed].any()
    assert not any(it[~found.sensed].any() for it in (found.heeded, found.reached, found.leds, found.fitness))


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
    with pytest.raises(ValueError, match="steps are numbered from 0 to 298"):
        analysis.influence(experiment, genotype, [299], trials=1)


def test_an_input_without_synapses_has_no_effect(leader):
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


def test_an_unchanged_reading_changes_no_action(leader):
    found = analysis.attention(*leader, [0], replace="freeze", trials=3)
    assert not found.sensed.any() and not found.heeded.any() and not found.reached.any()


def test_longer_deafness_changes_more_actions(leader):
    once, always = (
        analysis.attention(*leader, [40], sensor="wireless_receiver", lasting=lasting, trials=5) for lasting in (1, 11)
    )
    assert (once.sensed <= always.sensed).all() and once.sensed.any()
    assert (once.heeded[~once.sensed] == 0).all(), "nothing replaced, nothing caused"
    assert always.leds.sum() > once.leds.sum()


def test_sensors_that_no_network_has_are_refused(leader):
    with pytest.raises(ValueError, match="no input comes from 'light_sensor'; there are wireless_receiver:msg, "):
        analysis.attention(*leader, [40], sensor="light_sensor")
    with pytest.raises(ValueError, match="lasting is from 1 to 11"):
        analysis.attention(*leader, [40], lasting=12)
    with pytest.raises(ValueError, match="agents are numbered from 0 to 9, not 10, -1"):
        analysis.attention(*leader, [40], agents=[3, 10, -1])


def test_stimuli_that_do_not_fit_are_refused_and_those_that_are_set_are_sensed(quickstart, genotypes):
    episodes = quickstart.episodes()
    before = episodes.stimuli
    with pytest.raises(ValueError, match="stimuli: an array"):
        episodes.stimuli = before[:, 1:]
    wrong = before.copy()
    wrong[0, 1, 2] = np.nan
    with pytest.raises(ValueError, match="stimulus number 7 is NaN, not within the finite numbers"):
        episodes.stimuli = wrong
    assert np.array_equal(episodes.stimuli, before)
    episodes.stimuli = np.full_like(before, 0.25)
    assert (episodes.stimuli == 0.25).all()


def test_frozen_values_are_those_of_the_previous_step_and_permuted_ones_those_of_the_next_robot(leader):
    actions, stimuli = course(leader)
    episode = {"agents": [3], "trials": 1, "lasting": 1}
    # A step in which robot 3 sends, and the messages and readings of robots 3 and 4 differ from
    # each other and from the previous step.
    step = next(
        k for k in range(1, 290)
        if actions[k].sends[0, 3]
        and all((actions[k].messages[0, 3] != it).any() for it in (actions[k - 1].messages[0, 3], actions[k].messages[0, 4]))
        and all((stimuli[k][3] != it).any() for it in (stimuli[k - 1][3], stimuli[k][4]))
    )
    of = {"freeze": (actions[step - 1].messages[0, 3], stimuli[step - 1][3]), "permute": (actions[step].messages[0, 4], stimuli[step][4])}
    for mode, (message, sensed) in of.items():
        said = [analysis.influence(*leader, [step], replace=it, **episode) for it in (mode, message)]
        assert said[0].said.all() and same(*said), mode
        heard = [analysis.attention(*leader, [step], replace=it, sensor="all", **episode) for it in (mode, sensed)]
        assert heard[0].sensed.all() and same(*heard), mode


def test_longer_replacements_of_messages_change_more_actions_of_others(leader):
    once, always = (analysis.influence(*leader, [5], replace=0.0, lasting=lasting, trials=5) for lasting in (1, 11))
    assert (once.said <= always.said).all() and once.said.any()
    assert not once.reached[~once.said].any() and not always.reached[~always.said].any()
    assert always.reached.sum() > once.reached.sum() and always.leds.sum() > once.leds.sum()


def test_a_silent_swarm_acts_like_robots_out_of_reach(leader):
    experiment, genotype = leader
    config = experiment.to_dict()
    config["world"]["objects"]["robotA"]["initializers"]["positions"] = {
        "name": "fixed", "params": {"values": [[200 * (i % 5), 500 * (i // 5)] for i in range(10)]}
    }
    apart, together = course((swarmevo.Experiment.from_dict(config), genotype))[0], course(leader)[0]
    silent = course(leader, silent=True)[0]
    assert [it.leds.tolist() for it in silent] == [it.leds.tolist() for it in apart] != [it.leds.tolist() for it in together]
    assert all(np.array_equal(mine.messages, its.messages) for mine, its in zip(silent, apart))


def test_silence_differs_from_a_message_of_zeros(leader):
    zeros, silence = (analysis.influence(*leader, [40, 45], replace=it, trials=4) for it in (0.0, "silence"))
    assert silence.said.all(), "also a frame that is relayed is missing"
    assert silence.reached[~zeros.said].any()
    assert (silence.reached != zeros.reached)[zeros.said].any()


def test_one_call_silences_a_whole_robot(leader):
    experiment, genotype = leader
    found = analysis.influence(experiment, genotype, [0], replace="silence", lasting=300, window=299, trials=2)
    once = analysis.influence(experiment, genotype, [0], replace="silence", window=299, trials=2)
    assert (found.reached > 0).all() and found.leds.sum() > once.leds.sum()


def test_silence_is_no_reading_and_needs_the_right_shape(leader, quickstart):
    with pytest.raises(ValueError, match='"permute" or, of messages, "silence", not \'silence\''):
        analysis.attention(*leader, [40], replace="silence", trials=1)
    with pytest.raises(ValueError, match="lasting is from 1 to 11"):
        analysis.influence(*leader, [40], lasting=0)
    with pytest.raises(ValueError, match="who is silent: an array"):
        quickstart.episodes().silence([True])
