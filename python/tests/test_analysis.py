"""Analysis: planted protocols and known networks give known answers."""

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import PROJECT

import swarmevo
from swarmevo import analysis
from swarmevo.analysis import CTRNN, Equilibrium, LimitCycle

T, STEPS, R = 30, 60, 8


def planted(symbols, sends=None, heard=None):
    """The parts of a trace that the measures read, of a swarm that sends `symbols` [T, STEPS, R]."""
    shape = symbols.shape
    heard = np.full(shape, -1) if heard is None else heard
    return SimpleNamespace(
        messages=symbols[..., np.newaxis].astype(float),
        sends=np.ones(shape, bool) if sends is None else sends,
        frame_messages=np.maximum(heard, 0)[..., np.newaxis].astype(float),
        frame_emitters=np.where(heard >= 0, 0, -1),
        frame_originators=np.where(heard >= 0, 0, -1),
        frame_hops=np.where(heard >= 0, 1, 0),
        n_robots=shape[-1],
    )


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def binary_entropy(p):
    return -p * np.log2(p) - (1 - p) * np.log2(1 - p)


@pytest.mark.parametrize("p", [0.0, 0.3, 0.8])
def test_a_symbol_that_copies_a_stimulus_has_the_expected_information(rng, p):
    stimulus = rng.integers(0, 2, (T, STEPS, R))
    copies = rng.random(stimulus.shape) < p
    said = np.where(copies, stimulus, rng.integers(0, 2, stimulus.shape))
    found = analysis.signalling(planted(said), stimulus)
    # The symbol equals the stimulus with probability p + (1 - p) / 2.
    expected = 1 - binary_entropy(p + (1 - p) / 2)
    assert found.excess == pytest.approx(expected, abs=0.01)
    assert (found.p < 0.01) == (p > 0)


def test_unsent_messages_of_relays_do_not_count(rng):
    stimulus = rng.integers(0, 2, (T, STEPS, R))
    sends = rng.random(stimulus.shape) < 0.5
    said = np.where(sends, stimulus, 1 - stimulus)
    assert analysis.signalling(planted(said, sends), stimulus).bits == pytest.approx(1, abs=0.01)


def test_a_channel_without_listeners_has_no_positive_listening(rng):
    heard = rng.integers(-1, 2, (T, STEPS, R))
    trace = planted(rng.integers(0, 2, (T, STEPS, R)), heard=heard)
    deaf = analysis.listening(trace, rng.integers(0, 2, (T, STEPS, R)))
    assert abs(deaf.excess) < 0.002 and deaf.p > 0.01
    obedient = analysis.listening(trace, np.maximum(heard, 0))
    assert obedient.bits == pytest.approx(1, abs=0.01) and obedient.p < 0.01


def test_slow_variables_do_not_seem_to_depend_on_each_other(rng):
    # One value per trial and robot: shuffled rows would find hundreds of independent agreements.
    slow = np.repeat(rng.integers(0, 2, (T, 1, 1)), STEPS, axis=1).repeat(R, axis=2)
    other = np.repeat(rng.integers(0, 2, (T, 1, 1)), STEPS, axis=1).repeat(R, axis=2)
    assert analysis.dependence(slow, other).p > 0.05
    assert analysis.dependence(slow, slow).p < 0.01


def test_entropy_and_information_of_known_tables():
    assert analysis.entropy([0, 1, 2, 3]) == 2
    assert analysis.entropy([7, 7]) == 0
    assert analysis.mutual_information([0, 0, 1, 1], [0, 1, 0, 1]) == 0
    assert analysis.mutual_information([0, 1, 2, 3], [5, 5, 6, 6]) == 1
    codes = analysis.codes([0, 0, 1], [2.5, 3.5, 2.5])
    assert len(set(codes.tolist())) == 3


def test_a_robot_that_acts_on_its_message_two_steps_later_is_consistent_at_that_lag(rng):
    said = rng.integers(0, 2, (T, STEPS, R))
    found = analysis.speaker_consistency(planted(said), np.roll(said, 2, axis=1), range(4))
    assert found[2] == pytest.approx(1)
    assert all(found[lag] < 0.01 for lag in (0, 1, 3))


def test_bins_hold_equal_counts_and_no_missing_values():
    assert analysis.discretise([0.1, 0.2, 0.3, 0.4, np.nan], 2).tolist() == [0, 0, 1, 1, -1]
    assert analysis.discretise([0.0, 1.0, 1.0], 4).tolist() == [0, 1, 1]


def test_the_error_of_a_proportion_is_that_over_trials(rng):
    # All rows of a trial are alike: 30 trials are 30 observations, not 14,400.
    event = np.repeat(rng.random((T, 1, 1)) < 0.5, STEPS, axis=1).repeat(R, axis=2)
    found = analysis.proportion(event)
    values = event[:, 0, 0]
    assert found.share == values.mean()
    assert found.error == pytest.approx(values.std(ddof=1) / np.sqrt(T))
    by = analysis.conditional(event, event.astype(int))
    assert (by[0].share, by[1].share) == (0, 1)
    assert np.isnan(analysis.proportion(event, np.zeros_like(event)).share)


def test_the_use_of_a_channel(quickstart, genotypes):
    trace = quickstart.simulate(genotypes[0], 1)
    use = analysis.channel_use(trace)
    assert sum(use.shares.values()) == pytest.approx(1)
    assert use.hops.sum() == pytest.approx(1)
    who = analysis.informants(trace)
    assert np.allclose(who.sum(axis=1)[who.any(axis=1)], 1)
    assert (np.diag(who) == 0).all(), "nobody hears itself"
    assert ((analysis.heard(trace) > 0) == (trace.frame_emitters[:, 10:] >= 0)).all()


# Beer (1995), Adaptive Behavior 3(4): two neurons that oscillate.
OSCILLATOR = {"weights": [[4.5, 1], [-1, 4.5]], "bias": [-2.75, -1.75]}


def test_beers_oscillator_goes_round_and_a_held_input_stops_it():
    network = CTRNN(**OSCILLATOR)
    inside = network.equilibria([0, 0])
    assert len(inside) == 1 and not inside[0].is_stable and inside[0].eigenvalues[0].imag != 0
    cycle = network.attractor([0, 0], start=[0.1, 0])
    assert isinstance(cycle, LimitCycle)
    # The state returns after a period, also by Euler's method in small steps.
    dt = cycle.period / 5000
    states = network.trajectory(np.zeros((30_000, 2)), dt=dt, start=[0.1, 0])
    assert np.abs(states[-1] - states[-5001]).max() < 0.02
    assert np.abs(states[-1] - states[-2501]).max() > 0.1
    rest = network.attractor([5, 0], start=[0.1, 0])
    assert isinstance(rest, Equilibrium) and rest.is_stable


def test_a_followed_attractor_changes_its_kind_where_eigenvalues_cross():
    network = CTRNN(**OSCILLATOR)
    inputs = [[phi, 0] for phi in np.linspace(3, 0, 7)]
    kinds = [type(it) for it in network.follow(inputs)]
    stable = [any(it.is_stable for it in network.equilibria(phi)) for phi in inputs]
    assert kinds == [Equilibrium if it else LimitCycle for it in stable]
    assert kinds[0] is Equilibrium and kinds[-1] is LimitCycle


def test_two_neurons_that_excite_themselves_have_every_equilibrium():
    # Each neuron by itself, w = 8 and bias -4: rates near 0 and 1, and 1/2 between them.
    found = CTRNN([[8, 0], [0, 8]], bias=-4).equilibria([0, 0])
    assert len(found) == 9
    assert sum(it.is_stable for it in found) == 4


def test_an_isolated_network_acts_as_in_the_swarm(quickstart, genotypes):
    trace = quickstart.simulate(genotypes[0], 1)
    network = CTRNN.of(quickstart.network(genotypes[0]))
    topology = quickstart.to_dict()["topology"]
    inputs = np.repeat(trace.stimuli[0, :20, 0], topology["time_scale"], axis=0)
    states = network.trajectory(inputs, dt=topology["dt"])[topology["time_scale"] :: topology["time_scale"]]
    assert np.allclose(network.rates(states), trace.activities[0, :20, 0], atol=1e-4)


def test_a_report_says_which_inputs_matter_and_is_the_same_file_twice(quickstart, genotypes, tmp_path):
    path = analysis.report(quickstart, genotypes[0], tmp_path / "once", trials=2)
    page = path.read_text()
    headings = ("How it solves the task", "Which inputs matter", "Under other conditions", "Messages", "Flow of messages")
    for heading in (*headings, "Worth of each part of the network", "The network alone"):
        assert heading in page
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    ), "it needs no network"
    again = analysis.report(quickstart, genotypes[0], tmp_path / "again", trials=2)
    assert again.read_text() == page
    with open(tmp_path / "once" / "inputs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["input that is 0"] for row in rows][0] == "none" and len(rows) > 3


def test_removing_an_absent_input_changes_no_bit(tmp_path):
    config = json.loads((PROJECT / "configs/leader_selection_snes.json").read_text())
    champion = json.loads((PROJECT / "results/champions/leader_selection_snes-0.json").read_text())
    config["algorithm"]["evaluation_steps"] = 60
    config["world"]["objects"]["robotA"]["perturbations"] = {
        "stimuli_inhibition": {"stimuli": "wireless_receiver:state", "affected_robots": "all"}
    }
    experiment = swarmevo.Experiment.from_dict(config)
    analysis.report(experiment, champion["genotype"], tmp_path, trials=3)
    with open(tmp_path / "inputs.csv", newline="") as file:
        change = {row["input that is 0"]: row["change, in the same trials"] for row in csv.DictReader(file)}
    assert change["wireless_receiver:state"] == "the same bits"
    assert change["wireless_receiver:msg"] != "the same bits"
