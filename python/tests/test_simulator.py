"""Experiments and their simulation in this process."""

import pickle
import signal
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import swarmevo
from swarmevo import Experiment, ExperimentError, TrialSet

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def test_fitness_does_not_depend_on_threads_trials_or_other_genotypes(quickstart, genotypes):
    fitness = quickstart.evaluate(genotypes, 3, threads=1)
    assert fitness.shape == (7, 3) and fitness.dtype == np.float64
    for threads in (2, 3, 16):
        assert np.array_equal(quickstart.evaluate(genotypes, 3, threads=threads), fitness)
    assert np.array_equal(quickstart.evaluate(genotypes[4], 3, threads=2), fitness[4])
    part = quickstart.evaluate(genotypes, 3, trials=range(1, 3))
    assert np.array_equal(part, fitness[:, 1:])
    assert quickstart.evaluate(genotypes[:0], 3).shape == (0, 3)


def test_trial_sets_are_different_worlds(quickstart, genotypes):
    sets = [0, 1, TrialSet.held_out(0), TrialSet.held_out(0, 1), TrialSet.judgement(0),
            TrialSet.evaluation()]
    fitness = [quickstart.evaluate(genotypes, it, trials=4).tobytes() for it in sets]
    assert len(set(fitness)) == len(sets)
    same = quickstart.evaluate(genotypes, TrialSet.generation_of(1), trials=4)
    assert same.tobytes() == fitness[1]


def test_measures_have_a_value_per_step_and_change_no_fitness(quickstart, genotypes):
    measured = quickstart.measure(genotypes, 2)
    assert np.array_equal(measured.fitness, quickstart.evaluate(genotypes, 2))
    assert list(measured.measures) == quickstart.measure_names == ["leaders", "one_leader"]
    assert measured.measures["leaders"].shape == (7, 3, 100)
    trace = quickstart.simulate(genotypes[5], 2)
    assert np.array_equal(trace.measures["leaders"], measured.measures["leaders"][5])


def test_a_file_is_read_with_the_script_that_it_refers_to(tmp_path):
    experiment = Experiment.from_file(CONFIGS / "tasks" / "foraging.json")
    script = (CONFIGS / "tasks" / "foraging.star").read_text(encoding="utf-8")
    assert experiment.to_dict()["task"]["script"] == {"name": "foraging.star", "text": script}
    (tmp_path / "alone.json").write_text((CONFIGS / "tasks" / "foraging.json").read_text())
    with pytest.raises(OSError, match="foraging.star"):
        Experiment.from_file(tmp_path / "alone.json")


def test_a_file_with_mistakes_is_refused_with_all_of_them():
    config = Experiment.quickstart().to_dict()
    config["algorithm"]["population_sise"] = 3
    config["world"]["objects"]["robot"]["num_instances"] = -5
    with pytest.raises(ExperimentError) as refused:
        Experiment.from_dict(config)
    paths = {problem.path for problem in refused.value.problems}
    assert "algorithm.population_sise" in paths
    assert "world.objects.robot.num_instances" in paths
    assert "did you mean `population_size`?" in str(refused.value)
    assert isinstance(refused.value, ValueError)
    assert pickle.loads(pickle.dumps(refused.value)).problems == refused.value.problems


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.json")), ids=lambda path: path.stem)
def test_every_shipped_file_is_an_experiment(path):
    experiment = Experiment.from_file(path)
    again = Experiment.from_dict(experiment.to_dict())
    assert again.to_json() == experiment.to_json()
    assert experiment.bounds.shape == (experiment.n_genes, 2)


def test_an_experiment_pickles_with_its_seed(quickstart, genotypes):
    other = Experiment.from_dict(quickstart.to_dict(), seed=99)
    assert other.seed == 99 and quickstart.seed == 1
    copy = pickle.loads(pickle.dumps(other))
    assert np.array_equal(copy.evaluate(genotypes), other.evaluate(genotypes))
    assert not np.array_equal(copy.evaluate(genotypes), quickstart.evaluate(genotypes))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda g: g[:, :-1], "genotypes are an array [P, 424]"),
        (lambda g: g + 1.0, "outside [0, 1]"),
        (lambda g: g * np.nan, "outside [0, 1]"),
    ],
)
def test_genotypes_that_do_not_fit_are_refused(quickstart, genotypes, change, message):
    with pytest.raises(ValueError, match=message.replace("[", r"\[").replace("]", r"\]")):
        quickstart.evaluate(change(genotypes))


@pytest.mark.parametrize("trials", [0, -1, range(0), range(0, 6, 2), range(-2, 3), 1001])
def test_missing_trials_are_refused(quickstart, genotypes, trials):
    with pytest.raises(ValueError, match="trials"):
        quickstart.evaluate(genotypes, trials=trials)


def test_computations_release_the_interpreter(quickstart, genotypes):
    many = np.tile(genotypes, (40, 1))
    counted, done = 0, threading.Event()
    worker = threading.Thread(target=lambda: (quickstart.evaluate(many, threads=1), done.set()))
    worker.start()
    while not done.is_set():
        counted += 1
    worker.join()
    assert counted > 100


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers here")
def test_ctrl_c_interrupts(quickstart):
    config = quickstart.to_dict()
    config["algorithm"]["evaluation_steps"] = 100_000
    long = Experiment.from_dict(config)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        started = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            long.evaluate(np.full((64, long.n_genes), 0.5), trials=100)
        assert time.monotonic() - started < 30
    finally:
        signal.signal(signal.SIGALRM, before)


def test_mirror_equals_the_reflection_of_the_algorithms():
    x = np.array([0.0, 0.25, 1.0, 1.25, -0.25, 2.25, -1.25, 1001.25])
    expected = [0.0, 0.25, 1.0, 0.75, 0.25, 0.25, 0.75, 0.75]
    assert swarmevo.mirror(x).tolist() == expected
    assert np.all((swarmevo.mirror([1e300, -1e300]) >= 0) & (swarmevo.mirror([1e300]) <= 1))


def test_a_network_becomes_c_that_computes_the_same_bits(quickstart, genotypes, tmp_path):
    network = quickstart.network(genotypes[0])
    files = network.to_c(tmp_path / "robot", 3, trials=2)
    assert {"controller.c", "swarm_radio.c", "README.md"} < {it.name for it in files}
    made = subprocess.run(["make", "-s", "test"], cwd=tmp_path / "robot", capture_output=True, text=True)
    steps = 2 * 5 * quickstart.n_steps
    assert made.stdout == f"{steps} robot-steps, 0 bits differ\n", made
    with pytest.raises(ValueError, match="only a description"):
        swarmevo.Network(network.description).to_c(tmp_path)


def test_a_network_has_the_weights_that_its_genes_encode(quickstart):
    config = quickstart.to_dict()
    low = quickstart.network(np.zeros(424))
    high = quickstart.network(np.ones(424))
    assert low.inputs == ["message_0", "message_1", "mode_0", "direction_0", "direction_1"]
    assert low.neurons[:2] == ["H1_0", "H1_1"] and low.neurons[-1] == "OUT_LED_0"
    population = config["algorithm"]["populations"]["network"]
    assert low.weights.min() == population["min_vals"][0] == -3
    assert high.input_weights.max() == population["max_vals"][0] == 3
    assert set(low.parameters) >= {"tau", "bias", "gain"}
    assert low.weights.shape == (24, 24) and low.input_weights.shape == (24, 5)
    pytest.importorskip("networkx")
    graph = low.to_networkx()
    assert graph.number_of_nodes() == 29
    assert graph.number_of_edges() == len(low.description["synapses"])
    edge = graph["message_0"]["H1_0"][0]
    assert edge["weight"] == -3 and edge["trainable"]
