"""Fitness from a function of the user: accepts any array of the right shape, and nothing else."""

import inspect

import numpy as np
import pytest

import swarmevo
from swarmevo import _core


@pytest.fixture(scope="module")
def short(quickstart):
    """Three generations, two comparisons, a judgement on 7 trials."""
    config = quickstart.to_dict()
    config["algorithm"].update(generations=3, champion_every=2, champion_trials=5, judgement_trials=7)
    return swarmevo.Experiment.from_dict(config)


def noisy(genotypes, trial_set, n_trials):
    """[P, T], the same for the same arguments; numbers that 16 bits hold."""
    trials = np.arange(n_trials) % 4 / 4
    return np.round(genotypes.sum(axis=1) % 7)[:, np.newaxis] + trials


class Foreign:
    """An array of another library, such as JAX's."""

    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return np.array(self.values, dtype=dtype)


FORMS = {
    "float16": lambda it: it.astype(np.float16),
    "float32": lambda it: it.astype(np.float32),
    "longdouble": lambda it: it.astype(np.longdouble),
    "big endian": lambda it: it.astype(">f8"),
    "lists": lambda it: it.tolist(),
    "tuples": lambda it: tuple(map(tuple, it.tolist())),
    "objects": lambda it: it.astype(object),
    "Fortran order": np.asfortranarray,
    "not contiguous": lambda it: np.repeat(it, 2, axis=1)[:, ::2],
    "read only": lambda it: np.broadcast_to(it, it.shape),
    "another library's": Foreign,
    "a list of arrays": list,
}


@pytest.mark.parametrize("form", FORMS)
def test_every_type_of_array_gives_the_same_run(short, form):
    expected = swarmevo.evolve(short, evaluate=noisy, progress=False)
    run = swarmevo.evolve(short, evaluate=lambda *asked: FORMS[form](noisy(*asked)), progress=False)
    assert run.digest == expected.digest
    assert run.champion.judged == expected.champion.judged and run.champion.judged.n_trials == 7


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int32, np.int64, np.uint64, np.bool_])
def test_whole_numbers_are_fitness(short, dtype):
    def whole(genotypes, trial_set, n_trials):
        return (genotypes[:, :n_trials] > 0.5).astype(dtype)

    expected = swarmevo.evolve(short, evaluate=lambda *it: whole(*it).astype(float), progress=False)
    assert swarmevo.evolve(short, evaluate=whole, progress=False).digest == expected.digest


def test_torch_tensors_are_fitness(short):
    torch = pytest.importorskip("torch")
    expected = swarmevo.evolve(short, evaluate=noisy, progress=False)
    run = swarmevo.evolve(short, evaluate=lambda *it: torch.tensor(noisy(*it)), progress=False)
    assert run.digest == expected.digest


def test_a_function_without_noise_may_return_one_number_per_genotype(short):
    run = swarmevo.evolve(short, evaluate=lambda genotypes, *_: genotypes.sum(axis=1).astype("f4"), progress=False)
    assert run.champion.judged.n_trials == run.champion.selection.n_trials == 1
    assert run.champion.judged.mean == np.float32(run.champion.genotype.sum())


WRONG = {
    "another number of trials": lambda g, s, t: np.zeros((len(g), t + 1)),
    "the file's number of trials, always": lambda g, s, t: np.zeros((len(g), 3)),
    "a trial each, in two dimensions": lambda g, s, t: np.zeros((len(g), 1)),
    "a row less": lambda g, s, t: np.zeros((len(g) - 1, t)),
    "a row more": lambda g, s, t: np.zeros((len(g) + 1, t)),
    "a number": lambda g, s, t: 1.0,
    "nothing": lambda g, s, t: None,
    "nothing in lists": lambda g, s, t: [[None] * t for _ in g],
    "text": lambda g, s, t: np.full((len(g), t), "1.0"),
    "complex numbers": lambda g, s, t: np.full((len(g), t), 1j),
    "rows of unequal length": lambda g, s, t: [[0.0] * t for _ in g[1:]] + [[0.0]],
    "transposed": lambda g, s, t: np.zeros((t, len(g))) if t != len(g) else np.zeros(2),
    "a dimension more": lambda g, s, t: np.zeros((len(g), t, 1)),
    "a generator": lambda g, s, t: ([0.0] * t for _ in g),
    "masked": lambda g, s, t: np.ma.masked_less(np.arange(len(g) * t).reshape(len(g), t), 3),
}


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("kind", ["generation", "held_out", "judgement"])
def test_fitness_of_a_wrong_shape_is_refused_at_once_in_any_call(short, wrong, kind):
    asked = []

    def evaluate(genotypes, trial_set, n_trials):
        asked.append(trial_set.kind)
        return (WRONG[wrong] if trial_set.kind == kind else noisy)(genotypes, trial_set, n_trials)

    if (wrong, kind) == ("the file's number of trials, always", "generation"):
        assert swarmevo.evolve(short, evaluate=evaluate, progress=False).champion.judged
        return
    with pytest.raises(ValueError) as refused:
        swarmevo.evolve(short, evaluate=evaluate, progress=False)
    assert asked[-1] == kind and kind not in asked[:-1]
    if kind == "judgement" and "array [1, 7]" not in str(refused.value):
        assert "real numbers" in str(refused.value)


def test_exceptions_of_the_function_pass_unchanged(short):
    class Mine(Exception):
        pass

    def evaluate(genotypes, trial_set, n_trials):
        if trial_set.kind == "judgement":
            raise Mine("the cluster is on fire")
        return noisy(genotypes, trial_set, n_trials)

    with pytest.raises(Mine, match="on fire"):
        swarmevo.evolve(short, evaluate=evaluate, progress=False)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_fitness_that_is_not_finite_ranks_last_and_is_no_judgement(short, value):
    def evaluate(genotypes, trial_set, n_trials):
        fitness = noisy(genotypes, trial_set, n_trials)
        if trial_set.kind == "generation":
            fitness[1:, 0] = value
        if trial_set.kind == "judgement":
            fitness[0, 0] = value
        return fitness

    run = swarmevo.evolve(short, evaluate=evaluate, progress=False)
    assert {it.n_non_finite for it in run.generations} == {short.population_size - 1}
    assert run.champion.judged is None and np.isfinite(run.champion.selection.mean)
    with pytest.raises(ValueError, match="finite"):
        swarmevo.evolve(short, evaluate=lambda g, s, t: np.full((len(g), t), value), progress=False)
    never = swarmevo.evolve(
        short, progress=False,
        evaluate=lambda g, s, t: noisy(g, s, t) if s.kind == "generation" else np.full((len(g), t), value),
    )
    assert never.champion.judged is None and never.champion.selection is None


def test_a_loop_of_the_caller_ends_with_the_champion_of_evolve(short):
    expected = swarmevo.evolve(short, progress=False)
    evolution = short.evolution()
    for generation in range(3):
        evolution.tell(short.evaluate(evolution.ask(), generation))
        if (generation + 1) % 2 == 0:
            assert evolution.compare(short.fitness).selection.n_trials >= 5
    champion = evolution.judge(short.fitness)
    assert champion.judged == expected.champion.judged and champion.judged.n_trials == 7
    assert np.array_equal(champion.genotype, expected.champion.genotype)
    assert evolution.champion.judged is None and evolution.digest == expected.evolution.digest
    assert evolution.judge(short.fitness, trials=3).judged.n_trials == 3


def test_no_champion_is_compared_or_judged_before_the_first_generation(short):
    for evolution in (short.evolution(), swarmevo.SNES(3)):
        for method in (evolution.compare, evolution.judge):
            with pytest.raises(ValueError, match="before the first"):
                method(short.fitness)


def hostile():
    """Arguments that a caller may try."""
    state = swarmevo.GA(4, population_size=6)
    return [
        None, True, -1, 0, 3, 2**63, 10**30, 0.5, float("nan"), "", "3", b"x", [], {}, (), object(), range(3),
        np.zeros(0), np.zeros((0, 0)), np.zeros((1, 0)), np.zeros((1, 1)), np.zeros((6, 1)), np.zeros((7, 2)),
        np.zeros((2, 2)).T, np.full((6, 2), np.nan), np.zeros(4), np.zeros((6, 1), np.float32),
        ("generation", 0, 0, 0, 1), ("generation", 0, 0, 5, 2), ("nothing", 0, 0, 0, 1),
        ("judgement", 2**64 - 1, 255, 999, 1000), state._core, state._core.reevaluation(),
    ]


def test_no_call_of_the_extension_panics(quickstart):
    """Calls every class and function with all kinds of values in each place. A call may raise an exception, but
    not a PanicException, which does not derive from Exception."""
    evolution = swarmevo.SNES(4)
    evolution.tell(np.zeros(20))
    compared = evolution._core.reevaluation()
    while (asked := compared.ask()) is not None:
        compared.tell(np.zeros((len(asked[0]), 1)))
    objects = [
        evolution._core, swarmevo.SNES(4)._core, evolution._core.reevaluation(), compared,
        quickstart._core, quickstart._core.episodes(("generation", 0, 0, 0, 1)),
    ]
    rng = np.random.default_rng(0)
    values = hostile()
    n_calls = 0
    calls = [getattr(_core, name) for name in ("encode_genes", "script_path", "inline_script", "algorithms", "ensure_memory")]
    calls += [getattr(it, name) for it in objects for name in dir(it) if not name.startswith("_")]
    calls += [_core.Evolution, _core.Evolution.from_json, _core.Experiment]
    for call in filter(callable, calls):
        try:
            n_arguments = len(inspect.signature(call).parameters)
        except ValueError:
            n_arguments = 3
        choices = [()] if n_arguments == 0 else [
            tuple(values[i] for i in rng.integers(len(values), size=n_arguments)) for _ in range(150)
        ]
        if n_arguments == 1:
            choices = [(value,) for value in values]
        for arguments in choices:
            n_calls += 1
            try:
                call(*arguments)
            except Exception as error:
                assert not isinstance(error, swarmevo.InternalError), (call, arguments)
    assert n_calls > 1000
