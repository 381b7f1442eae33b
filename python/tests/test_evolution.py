"""Algorithms as ask and tell, and whole runs here."""

import json
import pickle
import subprocess

import numpy as np
import pytest

import swarmevo

ALL = [swarmevo.GA, swarmevo.SNES, swarmevo.XNES, swarmevo.CMAES, swarmevo.SepCMAES,
       swarmevo.OpenAIES, swarmevo.PGPE]


def sphere(genotypes):
    return -np.sum((genotypes - 0.3) ** 2, axis=1)


@pytest.mark.parametrize("algorithm", ALL, ids=lambda it: it.__name__)
def test_every_algorithm_improves_and_continues_from_its_state_to_the_same_bits(algorithm):
    evolution = algorithm(5, population_size=20, seed=3)
    first = evolution.tell(sphere(evolution.ask()))
    for _ in range(40):
        evolution.tell(sphere(evolution.ask()))
    from_json = swarmevo.Evolution.from_json(evolution.to_json())
    from_pickle = pickle.loads(pickle.dumps(evolution))
    copy = evolution.copy()
    assert type(from_pickle) is algorithm
    for _ in range(3):
        told = evolution.tell(sphere(evolution.ask()))
        for other in (from_json, from_pickle, copy):
            assert other.tell(sphere(other.ask())).digest == told.digest
    assert told.mean > first.mean and evolution.champion.fitness > first.best
    assert algorithm.algorithm in swarmevo.algorithms()


def test_asking_twice_gives_the_same_and_trials_count_by_their_mean():
    one, other = swarmevo.SNES(4, seed=1), swarmevo.SNES(4, seed=1)
    genotypes = one.ask()
    assert np.array_equal(genotypes, one.ask()) and genotypes.shape == (20, 4)
    fitness = sphere(genotypes)
    one.tell(np.stack([fitness - 1, fitness + 1], axis=1))
    other.tell(fitness)
    assert np.array_equal(one.ask(), other.ask())


def test_a_setup_is_refused_with_all_its_mistakes():
    with pytest.raises(ValueError) as refused:
        swarmevo.CMAES(1001, population_size=1, sigma_init=2.0, eta_mu=1)
    assert len(str(refused.value).splitlines()) == 4
    with pytest.raises(ValueError, match="whole number below the population size"):
        swarmevo.GA(2, population_size=4, num_elite=4)
    swarmevo.GA(2, population_size=5, num_elite=4)
    with pytest.raises(TypeError, match="class of an algorithm"):
        swarmevo.Evolution(3)


def test_fitness_that_does_not_fit_is_refused_and_changes_nothing():
    evolution = swarmevo.SNES(4)
    genotypes = evolution.ask()
    for wrong in (np.zeros(19), np.zeros((20, 0)), np.zeros((20, 1, 1)), np.full(20, np.nan)):
        with pytest.raises(ValueError):
            evolution.tell(wrong)
    assert np.array_equal(evolution.ask(), genotypes) and evolution.n_generations == 0
    fitness = sphere(genotypes)
    fitness[3] = -np.inf
    assert evolution.tell(fitness).n_non_finite == 1


def test_a_panic_is_an_exception():
    state = json.loads(swarmevo.SNES(4).to_json())
    state["population_size"] = 0
    evolution = swarmevo.Evolution.from_json(json.dumps(state))
    with pytest.raises(swarmevo.InternalError) as panic:
        evolution.tell(np.zeros((0, 1)))
    assert isinstance(panic.value, RuntimeError)
    with pytest.raises(ValueError, match="not the state of an evolution"):
        swarmevo.Evolution.from_json("{}")


def test_a_run_here_is_the_run_of_swarmctl(quickstart, programs, tmp_path):
    """Nine generations: a scheduled comparison of candidates, and one more at the end."""
    config = quickstart.to_dict()
    config["algorithm"].update(generations=9, champion_every=4)
    file = tmp_path / "short.json"
    file.write_text(json.dumps(config))
    done = subprocess.run(
        [programs / "swarmctl", "run", file, "--data-dir", tmp_path / "data", "--output", "json"],
        check=True, capture_output=True, text=True, timeout=300,
    )
    run = swarmevo.evolve(swarmevo.Experiment.from_file(file), progress=False)
    assert f'"{run.digest}"' in done.stdout
    assert f'"{run.generations[3].digest}"' in done.stdout
    assert run.champion.judged is not None and run.champion.judged[3] == 200


def test_a_run_continues_where_a_shorter_one_has_ended(quickstart):
    config = quickstart.to_dict()
    config["algorithm"].update(champion_every=2, judgement_trials=2)
    experiment = swarmevo.Experiment.from_dict(config)
    long = swarmevo.evolve(experiment, 5, progress=False)
    short = swarmevo.evolve(experiment, 3, progress=False)
    assert short.generations == long.generations[:3]
    evolution = short.evolution
    assert evolution.n_generations == 3
    told = evolution.tell(experiment.evaluate(evolution.ask(), 3))
    assert told == long.generations[3]


def test_a_run_has_a_table_and_a_curve(quickstart):
    pytest.importorskip("pandas")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    run = swarmevo.evolve(quickstart, 2, progress=False)
    history = run.history()
    assert list(history.generation) == [0, 1]
    assert len(run.plot().lines) == 2
