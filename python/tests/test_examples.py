"""The examples run, and the notebook does."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
CONFIGS = EXAMPLES.parents[1] / "configs"


def run(name: str, *args: object) -> str:
    command = [sys.executable, EXAMPLES / name, *map(str, args)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_pycma_drives_the_simulator():
    pytest.importorskip("cma")
    assert "on 200 new trials" in run("leader_by_pycma.py", "--generations", 3)


def test_pyribs_maps_light_followers(tmp_path):
    pytest.importorskip("ribs")
    figure = tmp_path / "map.png"
    out = run("light_follower_by_pyribs.py", "--config", CONFIGS / "light_follower_snes.json",
              "--iterations", 2, "--batch-size", 4, "--steps", 30, "--to", figure)
    assert "kinds" in out and figure.stat().st_size > 1000


@pytest.mark.parametrize(("task", "least"), [("gather", 0.85), ("transport", 0.5)])
def test_champions_drive_robots_of_pymunk(task, least):
    pytest.importorskip("pymunk")
    out = run("robots_in_pymunk.py", task, "--trials", 3)
    means = {line.split()[0]: float(line.split()[1]) for line in out.splitlines()}
    assert list(means) == ["swarmevo", "pymunk", "difference"]
    assert means["pymunk"] > least, out


def test_seeds_are_compared(tmp_path):
    figure = tmp_path / "comparison.png"
    out = run("compare_seeds.py", "--seeds", 2, "--generations", 2, "--to", figure)
    assert "SNES" in out and "GA" in out and figure.stat().st_size > 1000


def test_the_first_notebook_ends_with_a_champion_that_plays():
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(EXAMPLES / "first_swarm.ipynb", as_version=4)
    started = time.monotonic()
    nbclient.NotebookClient(notebook, timeout=300).execute()
    print(f"{len(notebook.cells)} cells in {time.monotonic() - started:.1f} s")
    shown = notebook.cells[-1].outputs[0].data["text/html"]
    assert len(notebook.cells) == 10 and shown.startswith("<iframe srcdoc=")
