"""The examples of docs/python.md run, in their order."""

import os
import re

import matplotlib
import numpy as np
import pytest
from conftest import PROJECT
from processes import fleet

import swarmevo

PAGE = (PROJECT / "docs/python.md").read_text()
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
FLEET = ("swarmevo.connect()",)
"""The examples that need a coordinator."""


class SmallCluster:
    """A substitute for a Dask client."""

    def __init__(self):
        from concurrent.futures import ThreadPoolExecutor

        self.pool = ThreadPoolExecutor(1)

    def submit(self, function, /, *arguments, **options):
        return self.pool.submit(function, *arguments, **options)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The part of the project's folder that examples read."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("configs", "results"):
        (folder / name).symlink_to(PROJECT / name)
    return folder


def run(blocks, folder, names):
    """Executes blocks one after the other, with numbers of generations and nodes that fit a test."""
    matplotlib.use("Agg")
    before = os.getcwd()
    os.chdir(folder)
    try:
        for block in blocks:
            exec(compile(block, f"docs/python.md: {block.splitlines()[0]}", "exec"), names)
    finally:
        os.chdir(before)


def names_of_the_page(**more):
    experiment = swarmevo.Experiment.quickstart()
    genotypes = np.random.default_rng(3).random((4, experiment.n_genes))
    return {
        "swarmevo": swarmevo, "np": np, "genotypes": genotypes, "genotype": genotypes[0], "experiment": experiment,
        "reward": lambda genotypes: np.mean(genotypes, axis=1), "cost": lambda genotypes: np.sum(genotypes**2, axis=1),
        "my_function": lambda genotypes: -np.sum((genotypes - 0.3) ** 2, axis=1), **more,
    }


def test_the_page_has_the_examples_that_are_run_here():
    assert len(BLOCKS) >= 9 and sum(any(it in block for it in FLEET) for block in BLOCKS) == 1


def test_examples_without_a_fleet_run(folder):
    pytest.importorskip("pandas")
    needs_fleet = [block for block in BLOCKS if any(it in block for it in FLEET) or "dask_client" in block]
    assert len(needs_fleet) == 2
    names = names_of_the_page()
    run([block for block in BLOCKS if block not in needs_fleet], folder, names)
    assert names["run"].id == 1 and (folder / "tables" / "fitness-1.parquet").exists()


def test_examples_with_a_fleet_run(programs, folder, tmp_path, monkeypatch):
    pytest.importorskip("grpc")
    with fleet(programs, tmp_path) as running:
        running.start_worker()
        monkeypatch.setenv("SWARM_COORDINATOR", running.url)
        blocks = [block for block in BLOCKS if any(it in block for it in FLEET) or "dask_client" in block]
        shorter = [
            block.replace("generations=200", "generations=8").replace("run.resume(300)", "run.resume(10)")
            .replace("http://head-node:7700", running.url).replace("dask_client, 40", "dask_client, 1")
            for block in blocks
        ]
        assert all(new != old for new, old in zip(shorter, blocks))
        names = names_of_the_page(dask_client=SmallCluster())
        names["experiment"] = names["experiment"].replace(evaluation_steps=10, generations=3)
        run(shorter, folder, names)
        assert names["run"].generations[7].index == 7
