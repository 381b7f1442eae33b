"""Episodes step by step, and environments."""

from pathlib import Path

import numpy as np
import pytest

import swarmevo

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


@pytest.mark.parametrize(
    "name", ["quickstart", "light_follower_ga", "orientation_consensus_snes", "borderline_ga"]
)
def test_stepping_with_the_network_gives_the_bits_of_the_simulation(name):
    config = swarmevo.Experiment.from_file(CONFIGS / f"{name}.json").to_dict()
    config["algorithm"]["evaluation_steps"] = 60
    experiment = swarmevo.Experiment.from_dict(config)
    genotype = np.random.default_rng(5).random(experiment.n_genes)
    trace = experiment.simulate(genotype, 2, trials=range(1, 3))
    episodes = experiment.episodes(2, trials=range(1, 3))
    episodes.load(genotype)
    for step in range(experiment.n_steps):
        stimuli = trace.stimuli[:, step][:, episodes.agents]
        assert np.array_equal(episodes.stimuli, stimuli)
        actions = episodes.decide()
        assert np.array_equal(actions.wheels, trace.wheels[:, step][:, episodes.agents])
        fitness = episodes.step(actions)
        assert np.array_equal(fitness, trace.step_fitness[:, step], equal_nan=True)
        assert np.array_equal(episodes.sent, trace.sends[:, step][:, episodes.agents])
    assert episodes.is_over and np.array_equal(episodes.fitness, trace.fitness)
    with pytest.raises(ValueError, match="the episode has ended"):
        episodes.step(episodes.idle())


def test_actions_that_do_not_fit_are_refused(quickstart):
    episodes = quickstart.episodes()
    with pytest.raises(ValueError, match="no network is loaded"):
        episodes.decide()
    actions = episodes.idle()
    actions.messages[0, 0, 1] = 1.5
    with pytest.raises(ValueError, match=r"message component number 1 is 1.5, not within \[0, 1\]"):
        episodes.step(actions)
    actions = episodes.idle()
    actions.leds = actions.leds[:, 1:]
    with pytest.raises(ValueError, match="leds: an array"):
        episodes.step(actions)
    assert episodes.n_steps_done == 0


def test_pettingzoo_accepts_the_environment(quickstart):
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(swarmevo.parallel_env(quickstart), num_cycles=250)
    parallel_seed_test(lambda: swarmevo.parallel_env(quickstart), num_cycles=50)


def test_an_environment_is_the_experiment(quickstart):
    pytest.importorskip("pettingzoo")
    genotypes = np.random.default_rng(8).random((50, quickstart.n_genes))
    fitness = quickstart.evaluate(genotypes, 7, trials=range(2, 3))[:, 0]
    genotype = genotypes[fitness.argmax()]
    env = swarmevo.parallel_env(quickstart)
    episodes = quickstart.episodes(7, trials=range(2, 3))
    episodes.load(genotype)
    observations, _ = env.reset(options={"generation": 7, "trial": 2})
    assert env.agents == [f"robot_{i}" for i in range(5)]
    total = 0.0
    while env.agents:
        assert np.array_equal(np.stack(list(observations.values())), episodes.stimuli[0])
        told = episodes.decide()
        actions = {
            agent: {"led": told.leds[0, i], "send": int(told.sends[0, i]),
                    "message": told.messages[0, i]}
            for i, agent in enumerate(env.agents)
        }
        episodes.step(told)
        observations, rewards, terminations, truncations, infos = env.step(actions)
        total += rewards["robot_0"]
    assert not any(terminations.values()) and all(truncations.values())
    assert infos["robot_3"]["fitness"] == fitness.max() > 0 and total > 0


@pytest.mark.parametrize(
    ("name", "output", "ensemble", "scheme"),
    [
        ("quickstart", "shine", "OUT_LED", "SoftmaxDecoding"),
        ("spiking/leader_selection_lif", "outB", "OUT_LED", "FirstToSpike"),
    ],
)
def test_an_led_has_the_colours_from_which_the_network_chooses(name, output, ensemble, scheme):
    pytest.importorskip("pettingzoo")
    config = swarmevo.Experiment.from_file(CONFIGS / f"{name}.json").to_dict()
    config["algorithm"]["evaluation_steps"] = 5
    config["topology"]["ensembles"][ensemble]["n"] = 4
    config["topology"]["decoding"][output] = {"scheme": scheme}
    env = swarmevo.parallel_env(swarmevo.Experiment.from_dict(config))
    env.reset(seed=1)
    assert all(env.action_space(agent)["led"].n == 4 for agent in env.agents)
    env.step({agent: env.action_space(agent).sample() | {"led": 3} for agent in env.agents})


def test_traces_and_episodes_show_what_a_script_senses():
    config = swarmevo.Experiment.from_file(CONFIGS / "tasks" / "scent.json").to_dict()
    config["algorithm"]["evaluation_steps"] = 20
    experiment = swarmevo.Experiment.from_dict(config)
    genotype = np.random.default_rng(5).random(experiment.n_genes)
    trace = experiment.simulate(genotype, 2)
    assert trace.stimulus_names == ["scent_0", "scent_1"]
    columns = trace.columns()
    assert np.array_equal(columns["stimulus_scent_1"], trace.stimuli[..., 1].ravel())
    episodes = experiment.episodes(2)
    episodes.load(genotype)
    for step in range(experiment.n_steps):
        assert np.array_equal(episodes.stimuli, trace.stimuli[:, step])
        episodes.step(episodes.decide())
    assert episodes.is_over and np.array_equal(episodes.fitness, trace.fitness)
    # The scent, as the script has it: by the place of the antennae, with noise of 0.01.
    before, headings = trace.positions[:, :-1], trace.headings[:, :-1]
    for i, side in enumerate((0.8, -0.8)):
        tip = before + 15 * np.stack([np.cos(headings + side), np.sin(headings + side)], axis=-1)
        away = (tip - trace.areas[:, np.newaxis] + 200) % 400 - 200
        expected = np.exp(-np.hypot(away[..., 0], away[..., 1]) / 80)
        error = trace.stimuli[:, 1:, :, i] - expected
        assert np.abs(error).max() < 0.06 and 0.005 < error.std() < 0.02
