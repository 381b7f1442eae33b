"""Data directories, read without a coordinator."""

import subprocess

import numpy as np
import pytest

import swarmevo

pandas = pytest.importorskip("pandas")
pytest.importorskip("google.protobuf")


@pytest.fixture(scope="module")
def experiment(quickstart):
    config = quickstart.to_dict()
    config["algorithm"].update(judgement_trials=20, champion_trials=10)
    return swarmevo.Experiment.from_dict(config)


@pytest.fixture(scope="module")
def directory(programs, experiment, tmp_path_factory):
    """The data directory of ``swarmctl run`` after four generations."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "file.json").write_text(experiment.to_json())
    subprocess.run(
        [programs / "swarmctl", "run", folder / "file.json", "--generations", "4", "--data-dir",
         folder / "data"],
        check=True, capture_output=True, timeout=300,
    )
    return folder / "data"


def test_a_data_directory_has_its_experiments_histories_and_individuals(directory, experiment):
    here = swarmevo.evolve(experiment, 4, progress=False)
    archive = swarmevo.open(directory)
    assert list(archive.experiments().digest) == [here.digest]
    run = archive.run("quickstart")
    assert run.state == "completed" and list(run.history().best) == [it.best for it in here.generations]
    assert np.array_equal(run.champion.genotype, here.champion.genotype)
    told = run.individuals(3)
    assert np.array_equal(told.fitness, run.experiment.evaluate(told.genotypes, 3))
    with pytest.raises(swarmevo.FleetError) as missing:
        archive.individual("7@0/0")
    assert missing.value.code == "NOT_FOUND"


def test_tables_go_to_parquet(directory, experiment, tmp_path):
    pytest.importorskip("pyarrow")
    files = swarmevo.open(directory).to_parquet(tmp_path)
    assert [file.name for file in files] == [
        "experiments.parquet", "history-1.parquet", "fitness-1.parquet"
    ]
    fitness = pandas.read_parquet(files[2])
    assert len(fitness) == 4 * experiment.population_size * experiment.n_trials
    assert list(fitness.columns) == ["generation", "individual", "trial", "fitness"]


def test_a_directory_without_a_database_is_an_error(tmp_path):
    with pytest.raises(OSError, match=str(tmp_path)):
        swarmevo.open(tmp_path)
