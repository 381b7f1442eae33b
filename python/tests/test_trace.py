"""Traces: arrays, tables, the player."""

import csv
import json
import subprocess

import numpy as np
import pytest
import swarmevo

from conftest import PROJECT


@pytest.fixture(scope="module")
def trace(quickstart, genotypes):
    return quickstart.simulate(genotypes[0], 1)


@pytest.fixture(scope="module")
def transport():
    """Four robots with bodies, and a box."""
    file = PROJECT / "configs/tasks/transport.json"
    return swarmevo.Experiment.from_file(file).replace(evaluation_steps=60, num_evaluations=2)


def test_arrays_have_the_shapes_that_are_documented(trace):
    shapes = {
        "fitness": (3,), "step_fitness": (3, 100), "positions": (3, 100, 5, 2),
        "headings": (3, 100, 5), "wheels": (3, 100, 5, 2), "leds": (3, 100, 5),
        "sends": (3, 100, 5), "messages": (3, 100, 5, 2), "frame_emitters": (3, 100, 5),
        "frame_messages": (3, 100, 5, 2), "targets": (3, 100, 5), "stimuli": (3, 100, 5, 5),
        "activities": (3, 100, 5, 24), "lights": (3, 100, 0, 2), "areas": (3, 0, 2),
    }
    assert {name: getattr(trace, name).shape for name in shapes} == shapes


def test_watching_changes_no_fitness(quickstart, genotypes, trace):
    assert np.array_equal(trace.fitness, quickstart.evaluate(genotypes[0], 1))
    scored = np.nanmean(trace.step_fitness, axis=1)
    assert np.allclose(scored, trace.fitness, rtol=1e-12)


def test_trials_are_the_same_one_by_one(quickstart, genotypes, trace):
    one = quickstart.simulate(genotypes[0], 1, trials=range(2, 3))
    assert one.trials == range(2, 3)
    for name in ("positions", "stimuli", "activities", "messages", "frame_emitters"):
        assert np.array_equal(getattr(one, name)[0], getattr(trace, name)[2]), name


def test_robots_hear_messages_of_the_previous_step(trace):
    # In the first ten steps, all send their own messages.
    heard = trace.frame_emitters[:, 1:10]
    assert (heard >= 0).any()
    for place in np.argwhere(heard >= 0):
        trial, step, robot = place + [0, 1, 0]
        emitter = trace.frame_emitters[trial, step, robot]
        assert trace.frame_originators[trial, step, robot] == emitter
        sent = trace.messages[trial, step - 1, emitter]
        assert np.array_equal(trace.frame_messages[trial, step, robot], sent)


def test_tables_have_a_row_per_trial_step_and_robot(trace):
    pandas = pytest.importorskip("pandas")
    polars = pytest.importorskip("polars")
    table = trace.to_pandas()
    assert isinstance(table, pandas.DataFrame) and len(table) == 3 * 100 * 5
    row = table[(table.trial == 2) & (table.step == 57) & (table.robot == 4)].iloc[0]
    assert row.x_cm == trace.positions[2, 57, 4, 0]
    assert row.neuron_OUT_LED_0 == trace.activities[2, 57, 4, 23]
    assert row.stimulus_direction_1 == trace.stimuli[2, 57, 4, 4]
    other = trace.to_polars()
    assert isinstance(other, polars.DataFrame) and other.columns == list(table.columns)
    assert other["heading_rad"].to_list() == table["heading_rad"].tolist()


def test_movables_and_contacts_are_those_of_the_room(transport):
    # All robots drive straight on: the wheels' biases are at their maximum, the weights at 0.
    genotype = np.full(transport.n_genes, 0.5)
    genotype[-2:] = 1
    trace = transport.simulate(genotype, 1)
    assert trace.movables.shape == (2, 60, 1, 3) and trace.touches.shape == (2, 60, 4)
    assert trace.touches.dtype == bool
    box, heading = trace.movables[:, :, 0, :2], trace.movables[:, :, 0, 2]
    assert np.allclose(box[:, 0], [80, 100]) and ((0 <= heading) & (heading < 2 * np.pi)).all()
    moved = np.linalg.norm(np.diff(box, axis=1), axis=-1) > 1e-6
    assert moved.any(), "nobody pushes the box"
    near = np.linalg.norm(trace.positions - box[:, :, np.newaxis], axis=-1) < 3.5 + 12 * 2**0.5 + 0.1
    # Who pushes it, touches it.
    assert (near & trace.touches).any(axis=-1)[:, 1:][moved].all()
    assert not trace.touches.all()


def test_points_touch_nothing_and_have_no_movables(trace):
    assert trace.movables.shape == (3, 100, 0, 3) and not trace.touches.any()
    assert "touches" not in trace.columns()


@pytest.mark.parametrize("name", ["quickstart", "transport"])
def test_the_table_is_the_trace_of_swarmctl(name, request, programs, tmp_path):
    """``to_pandas`` has the columns and the values of ``swarmctl simulate --trace``."""
    experiment = request.getfixturevalue(name)
    genes = np.random.default_rng(1).random(experiment.n_genes)
    file, genotype, out = (tmp_path / name for name in ("file.json", "genes.json", "trace.csv"))
    file.write_text(experiment.to_json())
    genotype.write_text(json.dumps(genes.tolist()))
    subprocess.run(
        [programs / "swarmctl", "simulate", file, "--genotype", genotype, "--generation", "1",
         "--trace", out, "--trace-columns", "neurons,frames,targets"],
        check=True, capture_output=True, timeout=120,
    )
    with out.open() as lines:
        rows = list(csv.DictReader(lines))
    columns = experiment.simulate(genes, 1).columns()
    assert len(rows) == len(columns["trial"])
    same = set(rows[0]) & set(columns)
    # In swarmctl's table, modes are words, and missing values are empty.
    assert set(rows[0]) - same == {"mode"} and set(columns) - same == {"sends"}
    for name in sorted(same - {"object"}):
        for row, value in zip(rows[::7], columns[name][::7]):
            if row[name]:
                assert float(row[name]) == value, name


def test_the_player_is_one_page_that_loads_nothing(trace, tmp_path):
    replay = trace.show(1)
    assert replay.html.startswith("<!doctype html>")
    assert "http://" not in replay.html and "https://" not in replay.html
    assert replay._repr_html_().startswith("<iframe srcdoc=")
    with pytest.raises(ValueError, match="the trace has trials"):
        trace.show(3)
    trace.save(tmp_path / "replay.html")
    assert (tmp_path / "replay.html").read_text().startswith("<!doctype html>")
