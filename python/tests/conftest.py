"""Shared fixtures of tests."""

import os
from pathlib import Path

import numpy as np
import pytest

import swarmevo

PROJECT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def quickstart() -> swarmevo.Experiment:
    """Five robots, 424 genes, three trials of 100 steps."""
    return swarmevo.Experiment.quickstart()


@pytest.fixture(scope="session")
def genotypes(quickstart: swarmevo.Experiment) -> np.ndarray:
    return np.random.default_rng(1).random((7, quickstart.n_genes))


@pytest.fixture(scope="session")
def programs() -> Path:
    """The folder of the programs that Cargo has built."""
    folder = Path(os.environ.get("SWARM_TEST_PROGRAMS", PROJECT / "target" / "debug"))
    if not all((folder / name).exists() for name in ("swarmctl", "coordinator", "worker")):
        pytest.skip(f"SKIPPED: no programs in {folder}; cargo build --workspace makes them")
    return folder
