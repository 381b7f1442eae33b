"""Fronts: of functions by ask and tell, and of recorded runs as tables."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import swarmevo

PROJECT = Path(__file__).resolve().parents[2]
TASK = PROJECT / "configs/repertoires/flocking.json"


def started(**changes):
    return swarmevo.NSGA2(4, **{"aims": ["minimise"], "population_size": 40, "seed": 3, "reevaluated": 0, **changes})


def tell(evolution):
    genes = evolution.ask()
    off = ((genes[:, 1:] - 0.5) ** 2).sum(axis=1)
    evolution.tell(genes[:, 0] - off, measures=(genes[:, 0] ** 2 + off)[:, np.newaxis])


def test_a_front_has_all_compromises_of_a_function():
    evolution = started()
    for _ in range(100):
        tell(evolution)
    front = evolution.front()
    assert front.genotypes.shape == (len(front.fitness), 4) and front.aims.shape == (len(front.fitness), 1)
    assert np.allclose(front.aims[:, 0], front.fitness**2, atol=0.05)
    assert front.fitness.min() < 0.05 and front.fitness.max() > 0.95
    order = np.argsort(front.fitness)
    assert (np.diff(front.aims[order, 0]) >= 0).all(), "more fitness costs more"
    generation, individual = front.born[0]
    assert generation < 100 and individual < 40


def test_a_front_of_nobody_has_columns():
    evolution = started()
    for _ in range(2):
        front = evolution.front()
        assert (front.genotypes.shape, front.fitness.shape, front.aims.shape) == ((0, 4), (0,), (0, 1))
        assert len(front.born) == 0
        evolution.tell(evolution.ask()[:, 0], measures=np.full((40, 1), np.nan))


def test_states_continue_to_the_same_bits():
    evolution = started(reevaluated=0.25)
    for _ in range(3):
        tell(evolution)
    again = swarmevo.Evolution.from_json(evolution.to_json())
    for it in (evolution, again):
        tell(it)
    assert evolution.digest == again.digest and (evolution.ask() == again.ask()).all()


def test_trials_have_measures_of_their_own():
    evolution = started()
    genes = evolution.ask()
    fitness = np.stack([genes[:, 0], genes[:, 0] + 1], axis=1)
    evolution.tell(fitness, measures=np.stack([genes[:, 1], genes[:, 1] + 2], axis=1)[:, :, np.newaxis])
    front = evolution.front()
    assert np.allclose(front.fitness, front.genotypes[:, 0] + 0.5)
    assert np.allclose(front.aims[:, 0], front.genotypes[:, 1] + 1)


def test_mistakes_name_what_is_valid():
    evolution = started()
    with pytest.raises(ValueError, match="also learns from measures"):
        evolution.tell(evolution.ask()[:, 0])
    with pytest.raises(ValueError, match="1 values"):
        evolution.tell(np.zeros(40), measures=np.zeros((40, 2)))
    with pytest.raises(ValueError, match=r"\[P, T, M\]"):
        evolution.tell(np.zeros((40, 3)), measures=np.zeros((40, 1)))
    with pytest.raises(ValueError, match="learns from fitness alone"):
        swarmevo.SNES(2).tell(np.zeros(20), measures=np.zeros((20, 1)))
    with pytest.raises(ValueError, match="no front"):
        swarmevo.SNES(2).front()
    with pytest.raises(ValueError, match="no direction is called 'least'"):
        swarmevo.NSGA2(2, aims=["least"])
    with pytest.raises(ValueError, match="needs 1 to 2 aims"):
        swarmevo.NSGA2(2, aims=[])
    tell(evolution)
    with pytest.raises(ValueError, match="a fleet judges all elites"):
        evolution.judge(lambda genotypes, trials, n: np.zeros((len(genotypes), n)))


@pytest.fixture(scope="module")
def run(programs, tmp_path_factory):
    directory = tmp_path_factory.mktemp("fronts")
    config = swarmevo.Experiment.from_file(TASK).to_dict()
    del config["algorithm"]["descriptors"]
    config["algorithm"] |= {
        "name": "NSGA-II", "aims": [{"measure": "together", "direction": "minimise"}],
        "generations": 4, "population_size": 12, "num_evaluations": 2, "evaluation_steps": 20, "champion_trials": 2,
        "judgement_trials": 3,
    }
    for population in config["algorithm"]["populations"].values():
        population["params"] = {}
    file = directory / "front.json"
    file.write_text(json.dumps(config))
    data = directory / "data"
    subprocess.run([programs / "swarmctl", "run", file, "--data-dir", data], check=True, capture_output=True)
    return swarmevo.open(data).run(1)


def test_a_row_is_an_elite_with_its_values_and_their_worth(run):
    pytest.importorskip("pandas")
    elites = run.front()
    assert elites.attrs["aims"] == {"together_mean": "minimise"}
    assert elites["judged_fitness"].notna().all() and elites["trials"].ge(2).all()
    shown = elites[elites["shown"]]
    assert elites.attrs["stay"] == pytest.approx(len(shown) / len(elites))
    # None is better than another one in both.
    for _, one in shown.iterrows():
        better = (shown["judged_fitness"] > one["judged_fitness"]) & (shown["judged_together_mean"] <= one["judged_together_mean"])
        assert not better.any()
    generation, individual = elites["address"].iloc[0].split("@")[1].split("/")
    assert run.individual(int(generation), int(individual)).genotype.shape == (run.experiment.n_genes,)


def test_a_reference_point_makes_volumes_comparable(run):
    pytest.importorskip("pandas")
    reference = (run.front()["judged_fitness"].min() - 1, 5)
    elites = run.front(reference=reference)
    assert elites.attrs["reference"] == reference and elites.attrs["hypervolume"] > 1
    with pytest.raises(swarmevo.RefusedArgument, match="needs 2 finite numbers, for fitness, together"):
        run.front(reference=[1.0])


def test_earlier_fronts_are_not_judged(run):
    pytest.importorskip("pandas")
    elites = run.front(1)
    assert elites["shown"].all() and elites["judged_fitness"].isna().all() and elites.attrs["stay"] is None


def test_other_runs_have_none(tmp_path):
    pytest.importorskip("pandas")
    quick = swarmevo.Experiment.quickstart().replace(
        generations=2, evaluation_steps=10, champion_trials=2, judgement_trials=2
    )
    recorded = swarmevo.evolve(quick, progress=False, data_dir=tmp_path)
    with pytest.raises(swarmevo.RefusedArgument, match="SNES evolves none; NSGA-II does"):
        swarmevo.open(tmp_path).run(recorded.id).front()
