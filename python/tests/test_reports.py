"""Reports of the command: on a champion file, on an address, with a fleet."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import PROJECT
from processes import fleet

import swarmevo
from swarmevo import analysis

CONFIGS = [PROJECT / "configs", PROJECT / "configs/spiking", PROJECT / "configs/tasks"]


def config_of(champion):
    """The experiment file of a champion such as ``foraging-0``."""
    name = champion.rpartition("-")[0]
    return next(folder / f"{name}.json" for folder in CONFIGS if (folder / f"{name}.json").exists())


def champion_file(champion):
    return PROJECT / f"results/champions/{champion}.json"


def command(*arguments, **environment):
    """Runs `python -m swarmevo.analysis` in a folder without settings."""
    return subprocess.run(
        [sys.executable, "-m", "swarmevo.analysis", *map(str, arguments)],
        capture_output=True, text=True, timeout=300, env={"PATH": "/usr/bin:/bin", **environment},
    )


def files(directory):
    return {path.name: path.read_bytes() for path in sorted(directory.iterdir())}


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Champion A's file and an experiment file of 40 steps that it fits."""
    experiment = swarmevo.Experiment.from_file(config_of("leader_selection_snes-0"))
    path = tmp_path_factory.mktemp("short") / "short.json"
    path.write_text(analysis.variant(experiment, steps=40).to_json())
    return champion_file("leader_selection_snes-0"), path


@pytest.fixture(scope="module")
def reported(short, tmp_path_factory):
    """The report on champion A, computed in this process."""
    directory = tmp_path_factory.mktemp("here")
    made = command(short[0], "--config", short[1], "--changed-conditions", "--trials", 2, "-o", directory)
    assert made.returncode == 0, made.stderr
    assert made.stdout == f"{directory / 'report.html'}\n"
    return directory


def test_one_command_reports_on_a_champion_file(short, reported, tmp_path):
    champion, config = short
    genotype = json.loads(champion.read_text())["genotype"]
    analysis.report(swarmevo.Experiment.from_file(config), genotype, tmp_path, title="leader_selection_snes: leader_selection_snes-0", trials=2)
    assert files(tmp_path) == files(reported)
    assert {"report.html", "answer.txt", "inputs.csv", "conditions.csv", "lesions-neurons.csv"} <= files(tmp_path).keys()


def test_every_refusal_is_one_line(short, tmp_path):
    champion, config = short
    (tmp_path / "half.json").write_text('{"genotype": [0.5]}')
    without = command(champion, "-o", tmp_path)
    assert without.returncode == 2 and "a champion file needs --config" in without.stderr
    for arguments, says in (
        ((champion, "--config", tmp_path / "none.json"), "none.json"),
        ((champion, "--config", PROJECT / "configs/quickstart.json"), "evolved in another experiment"),
        (
            (champion, "--config", PROJECT / "configs/quickstart.json", "--changed-conditions"),
            "a genotype has 424 genes, not [445]",
        ),
        ((champion, "--config", config), "--changed-conditions accepts"),
        ((tmp_path / "half.json", "--config", config), "is no champion file"),
        (("1@3/2", "--data-dir", tmp_path), str(tmp_path)),
        ((champion, "--config", config, "--changed-conditions", "--trials", 1), "from 2 to 1000"),
    ):
        refused = command(*arguments, "-o", tmp_path / "report")
        assert refused.returncode == 1 and refused.stderr.startswith("error: ") and says in refused.stderr
        assert refused.stderr.count("\n") == 1


def test_one_command_reports_on_an_individual_of_a_data_directory(programs, quickstart, tmp_path):
    file, data = tmp_path / "file.json", tmp_path / "data"
    file.write_text(quickstart.to_json())
    run = [programs / "swarmctl", "run", file, "--generations", "4", "--set", "algorithm.evaluation_steps=40", "--data-dir", data]
    subprocess.run(run, check=True, capture_output=True, timeout=300)
    made = command("1@3/2", "--data-dir", data, "--trials", 2, "-o", tmp_path / "report")
    assert made.returncode == 0, made.stderr
    archive = swarmevo.open(data)
    genotype = archive.individual("1@3/2").genotype
    analysis.report(archive.run(1).experiment, genotype, tmp_path / "again", title="quickstart: 2", trials=2)
    assert files(tmp_path / "report") == files(tmp_path / "again")


def test_conditions_and_lesions_are_the_same_on_a_fleet(programs, short, reported, tmp_path):
    pytest.importorskip("grpc")
    champion, config = short
    with fleet(programs, tmp_path) as running:
        running.start_worker()
        made = command(
            champion, "--config", config, "--changed-conditions", "--trials", 2, "--fleet", "-o", tmp_path / "report",
            SWARM_COORDINATOR=running.url,
        )
        assert made.returncode == 0, made.stderr
        assert files(tmp_path / "report") == files(reported)
        with running.connect() as client:
            experiment, genotype = swarmevo.Experiment.from_file(config), json.loads(champion.read_text())["genotype"]
            for measure in (analysis.generalisation, analysis.ablation):
                here, there = (measure(experiment, genotype, trials=3, client=it) for it in (None, client))
                assert len(here) > 10
                for mine, its in zip(here, there, strict=True):
                    np.testing.assert_equal(vars(mine), vars(its))


@pytest.mark.parametrize(
    "champion",
    ["leader_selection_ga-0", "orientation_consensus_snes-0", "light_follower_snes-0", "leader_selection_lif-0",
     "leader_selection_adex-0", "foraging-0", "flocking-0"],
)  # fmt: skip
def test_a_champion_of_any_kind_has_an_answer_of_numbers(champion, tmp_path):
    experiment = analysis.variant(swarmevo.Experiment.from_file(config_of(champion)), steps=60)
    genotype = json.loads(champion_file(champion).read_text())["genotype"]
    analysis.report(experiment, genotype, tmp_path, trials=2)
    answer = (tmp_path / "answer.txt").read_text()
    assert len(answer.splitlines()) >= 3 and all(it.endswith(".") for it in answer.splitlines())
    for path in [tmp_path / "answer.txt", *tmp_path.glob("*.csv")]:
        assert not re.search(r"\bnan\b", path.read_text(), re.IGNORECASE), path.name
