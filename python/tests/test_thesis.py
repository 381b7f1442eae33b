"""The figures of the thesis, from the champions of this project."""

import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import PROJECT

from swarmevo import analysis
from swarmevo.analysis.drawing import style
from swarmevo.analysis.thesis import attractors
from swarmevo.analysis.thesis.__main__ import EXPERIMENTS, file_name
from swarmevo.analysis.thesis.champion import REACH, Champion
from swarmevo.analysis.thesis.light_follower import other_way, photosensitive
from swarmevo.analysis.thesis.orientation_consensus import directions


def champion(name, trials=2):
    return Champion(name, PROJECT / "results", PROJECT / "configs", trials)


ALL = {**EXPERIMENTS, "attractors": attractors.FIGURES}


@pytest.mark.parametrize(("name", "number"), [(name, number) for name, figures in ALL.items() for number in figures])
def test_every_figure_is_drawn(name, number):
    with style():
        figure = ALL[name][number](champion(name))
        axes = [axis for axis in figure.get_axes() if axis.axison]
        assert axes and all(axis.has_data() for axis in axes), "no panel is empty"


def test_every_figure_of_the_registry_is_in_the_documents_with_its_number():
    text = (PROJECT / "docs/notebook/2026-11-claims.md").read_text(encoding="utf-8")
    embedded = dict(re.findall(r"!\[Fig\. ([\d.]+): [^\]]+\]\(\.\./figures/(thesis-[^)]+)\)", text))
    numbers = [number for figures in ALL.values() for number in figures]
    assert embedded == {number: file_name(number) for number in numbers}
    for name in embedded.values():
        png = (PROJECT / "docs/figures" / name).read_bytes()
        assert png.startswith(b"\x89PNG") and len(png) > 1_000, name
    assert {it.name for it in (PROJECT / "docs/figures").glob("thesis-*")} == set(embedded.values())


def test_one_command_writes_the_requested_figures_and_the_same_bytes_again(tmp_path):
    command = [sys.executable, "-m", "swarmevo.analysis.thesis", "leader_selection", "--trials", "2", "--only", "6.8", "-o"]
    for folder in ("once", "again"):
        subprocess.run([*command, tmp_path / folder], cwd=PROJECT, check=True, capture_output=True)
    once, again = ((tmp_path / folder / file_name("6.8")).read_bytes() for folder in ("once", "again"))
    assert once == again and once.startswith(b"\x89PNG")
    wrong = [*command[:5], "1", "--only", "6.99", "-o", str(tmp_path)]
    refused = subprocess.run(wrong, cwd=PROJECT, capture_output=True, text=True)
    assert refused.returncode == 2
    assert "6.99 is no figure of leader_selection" in refused.stderr and "--trials: 2 or more" in refused.stderr


def test_the_border_equals_that_of_the_simulator():
    for robots in (10, 30):
        trace = champion("borderline").trace(6, robots=robots, steps=1)
        for positions, targets in zip(trace.positions[:, 0], trace.targets[:, 0]):
            found = analysis.border(positions, (1000, 1000), REACH)
            assert np.array_equal(found, targets > 0)


def test_an_alpha_of_zero_is_the_convex_hull_and_a_larger_one_has_more_points():
    points = np.random.default_rng(4).random((80, 2))
    from scipy.spatial import ConvexHull

    on = [set(analysis.alpha_shape(points, radius)[0].tolist()) for radius in (np.inf, 0.3, 0.1)]
    assert on[0] == set(ConvexHull(points).vertices.tolist())
    assert on[0] < on[1] < on[2]
    # The outline is closed: as many edges end in each point as begin there.
    edges = analysis.alpha_shape(points, 0.3)[1]
    assert (np.bincount(edges.reshape(-1)) % 2 == 0).all()


def test_a_swarm_across_the_seam_is_drawn_in_one_piece_and_has_the_same_border():
    points = np.random.default_rng(3).random((20, 2)) * 300
    moved = (points + 900) % 1000
    assert np.array_equal(analysis.border(points, (1000, 1000), 150), analysis.border(moved, (1000, 1000), 150))


def test_aligned_robots_head_the_same_way():
    trace = champion("orientation_consensus").trace(2)
    receiving, sending = directions(trace)
    aligned = (receiving >= 0) & ((sending - receiving) % 360 == 180)
    emitters = np.maximum(trace.frame_emitters[:, 10:], 0)
    before = trace.headings[:, 9:-1]
    apart = before - np.take_along_axis(before, emitters, axis=2)
    apart = np.abs((apart + np.pi) % (2 * np.pi) - np.pi)
    # Sectors are a quarter of a turn wide, so that headings differ by less than that.
    assert apart[aligned].max() < np.pi / 2 + 0.2
    assert apart[(receiving >= 0) & ~aligned].mean() > apart[aligned].mean()


def test_the_share_of_robots_that_see_the_light_is_that_of_the_file():
    trace = champion("light_follower").trace(3)
    assert (photosensitive(trace).sum(axis=1) <= 2).all() and photosensitive(trace).any()


def test_the_light_can_take_another_path():
    light = champion("light_follower")
    there = light.trace(1).lights
    other = other_way(light).simulate(light.genotype, 0, trials=1).lights
    assert there.shape == other.shape and not np.array_equal(there, other)


def test_words_are_heard_unchanged_one_step_later_per_hop():
    trace = champion("leader_selection").trace(3)
    trial, step, robot = np.nonzero(trace.frame_hops > 0)
    hops = trace.frame_hops[trial, step, robot].astype(int)
    said = step - hops
    known = said >= 0
    origin = trace.frame_originators[trial, step, robot]
    heard = trace.frame_messages[trial, step, robot][known]
    assert np.array_equal(heard, trace.messages[trial[known], said[known], origin[known]])


def test_words_spread_no_faster_than_a_reach_per_step():
    found = analysis.spread(champion("leader_selection").trace(5))
    assert found.shares.sum() == pytest.approx(1)
    assert 0 < found.speed <= REACH
    assert (found.distances <= REACH * np.arange(1, len(found.shares) + 1)).all()
    assert 1 <= found.hearers <= found.farthest <= 9
