"""Analysis of networks: continuation of equilibria, lesions, states."""

import numpy as np
import pytest

import swarmevo
from swarmevo import analysis
from swarmevo.analysis import CTRNN, Equilibrium, LimitCycle
from swarmevo.analysis.thesis.attractors import NETWORKS, PATTERNS, WAYS

# Beer (1995), Adaptive Behavior 3(4): two neurons that oscillate.
OSCILLATOR = CTRNN([[4.5, 1], [-1, 4.5]], bias=[-2.75, -1.75])


def test_beers_circuit_has_a_hopf_point_where_the_trace_of_its_jacobian_is_zero():
    (branch,) = analysis.continuation(OSCILLATOR, [-3, 0], [3, 0])
    hopf = [it for it in branch.bifurcations if it.kind == "hopf"]
    assert len(hopf) == 2
    for it in hopf:
        jacobian = OSCILLATOR.jacobian(it.equilibrium.voltages)
        assert np.trace(jacobian) == pytest.approx(0, abs=1e-8)
        assert np.linalg.det(jacobian) > 0
        assert it.period == pytest.approx(2 * np.pi / np.sqrt(np.linalg.det(jacobian)), rel=1e-6)
        # On one side of the Hopf point the state comes to rest. On the other it cycles with about that period.
        at = -3 + 6 * it.share
        inwards = 0.02 * np.sign(-at)
        rest = OSCILLATOR.attractor([at - 5 * inwards, 0])
        cycle = OSCILLATOR.attractor([at + 5 * inwards, 0])
        assert isinstance(rest, Equilibrium) and isinstance(cycle, LimitCycle)
        assert cycle.period == pytest.approx(it.period, rel=0.2)


def test_a_branch_agrees_with_equilibria_of_a_new_search():
    (branch,) = analysis.continuation(OSCILLATOR, [-3, 0], [3, 0])
    for share in (0.0, 0.31, 0.5, 0.77, 1.0):
        searched = OSCILLATOR.equilibria([-3 + 6 * share, 0])
        crossings = np.flatnonzero(np.diff(np.sign(branch.shares - share)))
        followed = branch.rates[[0] if share == 0 else [-1] if share == 1 else crossings]
        for it in searched:
            assert np.abs(followed - it.rates).max(axis=1).min() < 0.02
    assert np.abs([OSCILLATOR.derivative(v, [-3 + 6 * s, 0]) for v, s in zip(branch.voltages, branch.shares)]).max() < 1e-8


def test_a_neuron_that_excites_itself_folds_where_algebra_says():
    w = 8.0
    neuron = CTRNN([[w]], bias=-4)
    (branch,) = analysis.continuation(neuron, [-2], [2])
    folds = [it for it in branch.bifurcations if it.kind == "fold"]
    assert len(folds) == len(branch.bifurcations) == 2
    # v = w u + I, and dv/dt is stationary in v where w u (1 - u) = 1.
    for it in folds:
        u = it.equilibrium.rates[0]
        assert w * u * (1 - u) == pytest.approx(1, abs=1e-6)
        assert -2 + 4 * it.share == pytest.approx(np.log(u / (1 - u)) + 4 - w * u, abs=1e-6)
    assert branch.stable[[0, -1]].all() and not branch.stable.all()


def test_branches_that_do_not_meet_are_all_followed():
    # Two neurons by themselves, of which the input moves only one: three branches.
    branches = analysis.continuation(CTRNN([[1, 0], [0, 8]], bias=[0, -4]), [-1, 0], [1, 0])
    assert len(branches) == 3
    assert sum(bool(branch.stable.all()) for branch in branches) == 2
    with pytest.raises(ValueError, match="more than 5 points"):
        analysis.continuation(OSCILLATOR, [-3, 0], [3, 0], max_points=5)


def test_the_networks_of_figure_2_2_have_the_attractors_that_the_thesis_states():
    start = [0.1, 0.0]
    for pattern in PATTERNS:
        assert isinstance(NETWORKS["a"].attractor(pattern, start=start), Equilibrium)
        # No equilibrium attracts.
        assert not any(it.is_stable for it in NETWORKS["b"].equilibria(pattern))
        kind = LimitCycle if pattern == (0, 0) else Equilibrium
        assert isinstance(NETWORKS["c"].attractor(pattern, start=start), kind)


def test_the_cycles_of_figure_2_2_have_the_periods_that_are_documented():
    found = {pattern: NETWORKS["b"].attractor(pattern, start=[0.1, 0.0]) for pattern in PATTERNS}
    # With (1, 0) the state spirals for thousands of time constants, next to a Hopf point.
    assert found.pop((1, 0)) is None
    (beside,) = NETWORKS["b"].equilibria((1, 0))
    assert beside.eigenvalues[0].real == pytest.approx(7e-5, abs=5e-6)
    assert all(isinstance(it, LimitCycle) for it in found.values())
    assert [round(it.period, 1) for it in found.values()] == [29.0, 30.1, 34.5]
    assert NETWORKS["c"].attractor((0, 0), start=[0.1, 0.0]).period == pytest.approx(29.0, abs=0.05)
    for it in found.values():
        # One round: rates that go up and down once, and end where they began.
        rates = it.rates[:, 0]
        assert np.ptp(rates) > 0.1 and np.abs(it.rates[0] - it.rates[-1]).max() < 0.1
        assert np.count_nonzero(np.diff(np.sign(rates - rates.mean()))) in (1, 2)


def test_inputs_of_figure_2_2_pass_the_bifurcations_that_are_documented():
    def on_the_way(name, last):
        (branch,) = analysis.continuation(NETWORKS[name], (0, 0), last)
        return [(it.kind, round(it.share, 2)) for it in branch.bifurcations]

    assert sorted(on_the_way("a", (0, 1))) == [("fold", 0.03), ("fold", 0.11)]
    for last, share in (((1, 0), 0.16), ((0, 1), 0.11), ((1, 1), 0.25)):
        assert [at for kind, at in on_the_way("c", last) if kind == "hopf"] == [share]


def test_the_ways_of_figure_2_3_move_a_point_and_turn_one_into_a_cycle():
    first, last, which = WAYS["a"]
    assert all(it.stable.all() and not it.bifurcations for it in analysis.continuation(NETWORKS[which], first, last))
    first, last, which = WAYS["b"]
    (branch,) = analysis.continuation(NETWORKS[which], first, last)
    (hopf,) = branch.bifurcations
    assert hopf.kind == "hopf" and hopf.share == pytest.approx(0.748, abs=5e-4)
    assert branch.stable[branch.shares < hopf.share - 1e-6].all()
    assert not branch.stable[branch.shares > hopf.share + 1e-6].any()


def test_every_synapse_has_the_gene_that_encodes_its_weight(quickstart, genotypes):
    where, zero = analysis.synapse_genes(quickstart)
    synapses = quickstart.network(genotypes[0]).description["synapses"]
    assert len(where) == len(synapses) == len(set(where.tolist())), "a gene each"
    for synapse in (0, 7, len(where) - 1):
        changed = genotypes[0].copy()
        changed[where[synapse]] = zero[synapse]
        after = [it["weight"] for it in quickstart.network(changed).description["synapses"]]
        before = [it["weight"] for it in synapses]
        assert after[synapse] == 0.0
        assert after[:synapse] + after[synapse + 1 :] == before[:synapse] + before[synapse + 1 :]


def test_lesions_are_ranked_by_their_cost_and_those_without_effect_say_so(quickstart, genotypes):
    found = analysis.ablation(quickstart, genotypes[0], "neurons", trials=4)
    network = quickstart.network(genotypes[0])
    changes = [it.change for it in found]
    assert changes == sorted(changes)
    # A neuron without outgoing synapses has no effect.
    sources = {network.neurons[i] for i in np.flatnonzero((network.weights != 0).any(axis=0))}
    assert {it.part for it in found} == sources
    # Removing a zero weight does not change a bit.
    where, zero = analysis.synapse_genes(quickstart)
    silent = genotypes[0].copy()
    of = [i for i, it in enumerate(network.description["synapses"]) if it["pre"] == {"neuron": 3}]
    silent[where[of]] = zero[of]
    again = {it.part: it for it in analysis.ablation(quickstart, silent, "neurons", trials=4)}
    assert again[network.neurons[3]].is_same and again[network.neurons[3]].change == 0


def test_removing_an_input_equals_silencing_its_sensor(quickstart, genotypes):
    stimuli = quickstart.to_dict()["topology"]["stimuli"]
    name = next(name for name, it in stimuli.items() if it["sensor"] == "wireless_receiver:state")
    lesions = {it.part: it for it in analysis.ablation(quickstart, genotypes[0], "inputs", trials=4)}
    blind = analysis.variant(quickstart, without="wireless_receiver:state")
    fitness = blind.evaluate(genotypes[0], 1_000_000, trials=4)
    assert lesions[f"{name}_0"].fitness == fitness.mean()


def test_weights_that_no_gene_can_silence_are_refused(quickstart, genotypes):
    config = quickstart.to_dict()
    (population,) = config["algorithm"]["populations"].values()
    population["min_vals"][0] = 0.5
    with pytest.raises(ValueError, match="no gene sets to 0"):
        analysis.ablation(swarmevo.Experiment.from_dict(config), genotypes[0], trials=2)
    with pytest.raises(ValueError, match="parts are neurons"):
        analysis.ablation(quickstart, genotypes[0], "layers", trials=2)


def test_principal_components_have_the_variance_of_the_states(quickstart, genotypes):
    trace = quickstart.simulate(genotypes[0], 1)
    found = analysis.components_of_states(trace)
    assert found.shares.sum() == pytest.approx(1) and (np.diff(found.shares) <= 1e-12).all()
    assert np.allclose(found.axes @ found.axes.T, np.eye(len(found.axes)), atol=1e-9)
    states = trace.activities[:, 10:].reshape(-1, trace.activities.shape[-1]).astype(float)
    back = found.scores.reshape(len(states), -1) @ found.axes + states.mean(axis=0)
    assert np.allclose(back, states, atol=1e-9)
    assert 1 <= found.dimension <= len(found.shares)
