"""Repertoires of recorded runs as tables."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import swarmevo

PROJECT = Path(__file__).resolve().parents[2]
TASK = PROJECT / "configs/repertoires/flocking.json"


def swarmctl(programs, *args):
    subprocess.run([programs / "swarmctl", *args], check=True, capture_output=True)


def evolved(programs, directory, algorithm):
    """A data directory with a short run of an algorithm."""
    config = swarmevo.Experiment.from_file(TASK).to_dict()
    config["algorithm"] |= {
        "name": algorithm, "generations": 4, "population_size": 12, "num_evaluations": 2, "evaluation_steps": 20,
        "champion_trials": 2, "judgement_trials": 3,
    }
    for population in config["algorithm"]["populations"].values():
        population["params"] = {}
    file = directory / "flocking.json"
    file.write_text(json.dumps(config))
    swarmctl(programs, "run", file, "--data-dir", directory / "data")
    return directory / "data"


@pytest.fixture(scope="module")
def run(programs, tmp_path_factory):
    return swarmevo.open(evolved(programs, tmp_path_factory.mktemp("repertoires"), "MAP-Elites")).run(1)


@pytest.fixture(scope="module")
def forked(programs, tmp_path_factory):
    """Run 3 continues run 2 after its generation 3, and run 2 the first one after its generation 1. Their algorithm
    has room for all individuals."""
    data = evolved(programs, tmp_path_factory.mktemp("forked"), "DNS")
    for start, seed, generations in (("1@1", "2", "5"), ("2@3", "3", "6")):
        swarmctl(programs, "fork", start, "--seed", seed, "--generations", generations, "--data-dir", data)
    return swarmevo.open(data)


def test_a_row_is_an_elite_with_its_behaviour_and_its_worth(run):
    pytest.importorskip("pandas")
    elites = run.repertoire()
    axes = elites.attrs["axes"]
    assert len(axes) == 2 and all(axis["cells"] > 1 for axis in axes.values())
    for name, axis in axes.items():
        assert elites[name].between(*axis["range"]).all()
    assert elites["judged_fitness"].notna().all() and elites["trials"].ge(2).all()
    # By judged behaviour, a cell shows one of its elites.
    shown = elites[elites["shown"]]
    assert shown["judged_cell"].is_unique and set(shown["judged_cell"]) == set(elites["judged_cell"])
    corrected = elites.attrs["corrected"]
    n_cells = 1
    for axis in axes.values():
        n_cells *= axis["cells"]
    assert corrected["coverage"] == pytest.approx(len(shown) / n_cells)
    assert corrected["qd_score"] == pytest.approx(shown["judged_fitness"].sum())
    assert corrected["stay"] == pytest.approx((elites["cell"] == elites["judged_cell"]).mean())


def test_addresses_of_elites_lead_to_them(run):
    pytest.importorskip("pandas")
    elites = run.repertoire()
    generation, individual = elites["address"].iloc[0].split("@")[1].split("/")
    found = run.individual(int(generation), int(individual))
    assert found.genotype.shape == (run.experiment.n_genes,)


def test_earlier_repertoires_are_not_judged(run):
    pytest.importorskip("pandas")
    elites = run.repertoire(1)
    assert elites["judged_fitness"].isna().all() and "corrected" not in elites.attrs
    assert elites[elites["shown"]]["cell"].is_unique


def test_other_runs_have_none(tmp_path):
    pytest.importorskip("pandas")
    quick = swarmevo.Experiment.quickstart().replace(
        generations=2, evaluation_steps=10, champion_trials=2, judgement_trials=2
    )
    recorded = swarmevo.evolve(quick, progress=False, data_dir=tmp_path)
    with pytest.raises(swarmevo.RefusedArgument, match="SNES evolves none"):
        swarmevo.open(tmp_path).run(recorded.id).repertoire()


def test_ribs_has_the_same_cells_the_same_worth_and_draws_them(run):
    for package in ("pandas", "ribs"):
        pytest.importorskip(package)
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from ribs.visualize import grid_archive_heatmap

    elites = run.repertoire()
    archive = run.to_ribs()
    corrected, shown = elites.attrs["corrected"], elites[elites["shown"]]
    assert archive.stats.coverage == pytest.approx(corrected["coverage"])
    assert archive.stats.qd_score == pytest.approx(corrected["qd_score"])
    assert list(archive.dims) == [axis["cells"] for axis in elites.attrs["axes"].values()]
    kept = archive.data(return_type="dict")
    cells = map(tuple, archive.int_to_grid_index(kept["index"]))
    assert dict(zip(kept["address"], cells)) == dict(zip(shown["address"], shown["judged_cell"]))
    for address, genotype in zip(kept["address"][:3], kept["solution"]):
        generation, individual = map(int, address.split("@")[1].split("/"))
        assert np.array_equal(run.individual(generation, individual).genotype, genotype)
    grid_archive_heatmap(archive)
    assert pyplot.gcf().axes
    pyplot.close("all")


def test_before_the_end_ribs_has_the_evidence(run):
    for package in ("pandas", "ribs"):
        pytest.importorskip(package)
    elites = run.repertoire(1)
    shown = elites[elites["shown"]]
    kept = run.to_ribs(1).data(return_type="dict")
    assert dict(zip(kept["address"], kept["objective"])) == dict(zip(shown["address"], shown["fitness"]))


def test_elites_of_forks_have_the_address_of_their_birth(forked):
    pytest.importorskip("pandas")
    elites = forked.run(3).repertoire(4)
    born = {address: tuple(map(int, address.replace("/", "@").split("@"))) for address in elites["address"]}
    for experiment, generation, _ in born.values():
        assert experiment == (1 if generation <= 1 else 2 if generation <= 3 else 3)
    assert {experiment for experiment, _, _ in born.values()} == {1, 2, 3}
    shown = elites[elites["shown"]]
    for address, cell in zip(shown["address"], shown["cell"]):
        experiment, generation, individual = born[address]
        found = forked.individual(address)
        assert (found.generation, found.individual) == (generation, individual)
        assert found.origin.config_digest == forked.run(experiment).experiment.config_digest
        of_cell = forked.individual(f"3@4/cell({cell[0]},{cell[1]})")
        assert np.array_equal(of_cell.genotype, found.genotype) and of_cell.origin == found.origin


def test_ribs_has_the_elites_that_a_fork_takes_over(forked):
    for package in ("pandas", "ribs"):
        pytest.importorskip(package)
    elites = forked.run(2).repertoire(2)
    kept = forked.run(2).to_ribs(2).data(return_type="dict")
    assert set(kept["address"]) == set(elites["address"][elites["shown"]])
    assert any(address.startswith("1@") for address in kept["address"])
    for address, genotype in zip(kept["address"], kept["solution"]):
        assert np.array_equal(forked.individual(address).genotype, genotype)
