"""Evolution that learns nothing warns, and ends like a coordinator's run."""

import pickle
import sqlite3
import subprocess
import warnings
from pathlib import Path

import numpy as np
import pytest

import swarmevo

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
FLAT = "generations 0 to 9: all 6 individuals have the same fitness 0.25"


@pytest.fixture(autouse=True)
def every_warning_counts():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(scope="module")
def still():
    """An experiment whose script gives all individuals the same fitness: chance soon drives the distribution
    out of all bounds."""
    config = swarmevo.Experiment.from_file(CONFIGS / "tasks" / "scent.json").to_dict()
    config["task"]["script"] = {"name": "still.star", "text": "def sense(robot):\n    return [0.5, 0.5]\n\ndef fitness(world):\n    return 0.25\n"}
    config["topology"]["ensembles"]["H"]["n"] = 1
    config["world"]["objects"]["robot"]["num_instances"] = 1
    experiment = swarmevo.Experiment.from_dict(config)
    return experiment.replace(
        name="still", algorithm="xNES", params={"eta_sigma": 2}, population_size=6, generations=12, evaluation_steps=1,
        num_evaluations=1, champion_every=10_000, champion_trials=2, judgement_trials=2,
    )


def flat(genotypes, trial_set, n_trials):
    return np.full((len(genotypes), n_trials), 0.25)


def test_ten_generations_of_the_same_fitness_warn_and_others_do_not():
    evolution = swarmevo.SNES(3, population_size=6)
    for _ in range(9):
        evolution.ask()
        evolution.tell([0.25] * 6)
    with pytest.warns(swarmevo.EvolutionWarning, match=FLAT) as caught:
        evolution.tell([0.25] * 6)
    assert [it.filename for it in caught] == [__file__]
    evolution.tell(range(6))


def test_fitness_that_is_not_finite_warns():
    evolution = swarmevo.SNES(3, population_size=4)
    with pytest.warns(UserWarning, match="generation 0: the fitness of 1 individuals is not finite; they rank last"):
        evolution.tell([1, 2, 3, np.nan])


def test_tell_refuses_a_distribution_out_of_all_bounds_and_leaves_evolution_unchanged():
    evolution = swarmevo.XNES(6, population_size=6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(swarmevo.EvolutionError, match="all individuals had the same fitness 0.25 in each of") as caught:
            for _ in range(20_000):
                evolution.tell([0.25] * 6)
    assert isinstance(caught.value, ValueError)
    before, asked = evolution.to_json(), evolution.ask()
    with pytest.raises(swarmevo.EvolutionError):
        evolution.tell([0.25] * 6)
    assert evolution.to_json() == before and np.array_equal(evolution.ask(), asked)
    evolution.tell(range(6))


@pytest.mark.parametrize("size, words", [(1, "a single individual, SNES never learns"), (3, "3 individuals teach SNES next to nothing")])
def test_populations_that_teach_nothing_warn(quickstart, size, words):
    few = quickstart.replace(algorithm="SNES", population_size=size, generations=1, champion_trials=1, judgement_trials=2)
    begun = [
        lambda: swarmevo.SNES(3, population_size=size),
        few.evolution,
        lambda: swarmevo.evolve(few, evaluate=lambda genotypes, *_: genotypes[:, 0], progress=False),
    ]
    for begin in begun:
        with pytest.warns(swarmevo.EvolutionWarning, match=words) as caught:
            begin()
        assert [it.filename for it in caught] == [__file__]
    swarmevo.SNES(3, population_size=4)


def test_evolve_warns_with_the_notices_of_a_coordinator(still, tmp_path):
    for name, evaluate in (("", None), ("database", None), ("file", flat)):
        with pytest.warns(swarmevo.EvolutionWarning) as caught:
            swarmevo.evolve(still, evaluate=evaluate, progress=False, data_dir=tmp_path / name if name else None)
        assert {it.filename for it in caught} == {__file__}
        said = [str(it.message) for it in caught if "same fitness" in str(it.message)]
        assert said[0].startswith(FLAT) and said[1].startswith("generations 0 to 11: all 6 individuals"), said
    with sqlite3.connect(tmp_path / "database" / "swarmevo.sqlite3") as database:
        kept = [text for (text,) in database.execute("SELECT message FROM events WHERE kind = 'notice'")]
    assert set(said) < set(kept)


@pytest.mark.parametrize("evaluate", [None, flat])
def test_a_continued_run_counts_the_generations_before_the_interrupt(still, tmp_path, evaluate):
    def stop(generation, evolution):
        if generation.index == 6:
            raise KeyboardInterrupt

    with pytest.raises(swarmevo.Interrupted) as stopped, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        swarmevo.evolve(still, evaluate=evaluate, progress=False, data_dir=tmp_path, callback=stop)
    with pytest.warns(swarmevo.EvolutionWarning) as caught:
        swarmevo.evolve(still, evaluate=evaluate, progress=False, data_dir=tmp_path)
    assert any(str(it.message).startswith(FLAT) for it in caught), [str(it.message) for it in caught]
    copied = pickle.loads(pickle.dumps(stopped.value.run.evolution))
    with pytest.warns(swarmevo.EvolutionWarning, match=FLAT):
        for _ in range(3):
            copied.tell([0.25] * 6)


def test_a_failed_run_in_a_file_stays_failed_and_one_without_generations_starts_again(still, tmp_path):
    warnings.simplefilter("ignore")
    long, asked = still.replace(generations=20_000), []

    def until_the_third(genotypes, trial_set, n_trials):
        asked.append(trial_set)
        return np.full((len(genotypes), n_trials), np.nan if len(asked) > 3 else 0.25)

    for _ in range(2):
        with pytest.raises(swarmevo.EvolutionError, match="no individual of generation 3 has a finite fitness") as failed:
            swarmevo.evolve(long, evaluate=until_the_third, progress=False, data_dir=tmp_path)
    assert len(asked) == 4
    (file,) = tmp_path.glob("*.evolve.json")
    assert str(file) in str(failed.value)
    file.unlink()
    with pytest.raises(swarmevo.EvolutionError, match="generation 0"):
        swarmevo.evolve(long, evaluate=lambda *it: np.nan * flat(*it), progress=False, data_dir=tmp_path)
    assert not file.exists()


def test_evolve_fails_like_swarmctl_run_with_the_same_words(still, programs, tmp_path):
    long = still.replace(generations=20_000)
    file = tmp_path / "still.json"
    file.write_text(long.to_json())
    done = subprocess.run(
        [programs / "swarmctl", "run", file, "--data-dir", tmp_path / "other"], capture_output=True, text=True, timeout=300
    )
    for data_dir, evaluate in ((None, None), (tmp_path / "database", None), (tmp_path / "file", flat)):
        told = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with pytest.raises(swarmevo.EvolutionError, match="evolution can learn nothing from here") as caught:
                swarmevo.evolve(
                    long, evaluate=evaluate, progress=False, data_dir=data_dir, callback=lambda it, _, told=told: told.append(it.index)
                )
        assert told == list(range(len(told))) and 90 < len(told) < 20_000
        assert str(caught.value) in done.stderr and done.returncode != 0
    (kept,) = swarmevo.open(tmp_path / "database").runs()
    assert (kept.summary()["state"], kept.summary()["generations_done"]) == ("failed", len(told))
