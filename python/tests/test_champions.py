"""A champion is accepted only by the experiment in which it evolved."""

import json
import pickle

import numpy as np
import pytest
from conftest import PROJECT

import swarmevo
from swarmevo import analysis

REFUSED = swarmevo.OtherExperimentError
FILE = PROJECT / "results/champions/leader_selection_snes-0.json"


@pytest.fixture(scope="module")
def tiny(quickstart):
    config = quickstart.to_dict()
    config["algorithm"].update(generations=2, champion_every=2, champion_trials=2, judgement_trials=2, evaluation_steps=20)
    return swarmevo.Experiment.from_dict(config)


@pytest.fixture(scope="module")
def champion(tiny):
    return swarmevo.evolve(tiny, progress=False).champion


@pytest.fixture(scope="module")
def others(tiny):
    """Experiments with as many genes: another world, another seed, another number of trials, another
    network."""
    config = tiny.to_dict()
    config["world"]["width"] = 900
    longer = tiny.to_dict()
    longer["algorithm"]["num_evaluations"] = 4
    slower = tiny.to_dict()
    slower["topology"]["time_scale"] = 10
    return [swarmevo.Experiment.from_dict(it) for it in (config, longer, slower)] + [tiny.replace(seed=7)]


CALLS = {
    "evaluate": lambda it, who: it.evaluate(who, trials=2),
    "evaluate several": lambda it, who: it.evaluate([who, who], trials=2),
    "fitness": lambda it, who: it.fitness(who, 0, 2),
    "measure": lambda it, who: it.measure(who, trials=2),
    "simulate": lambda it, who: it.simulate(who, trials=2),
    "network": lambda it, who: it.network(who),
    "load": lambda it, who: it.episodes().load(who),
    "ablation": lambda it, who: analysis.ablation(it, who, "groups", trials=2),
    "influence": lambda it, who: analysis.influence(it, who, [3], trials=2),
    "attention": lambda it, who: analysis.attention(it, who, [3], trials=2),
    "generalisation": lambda it, who: analysis.generalisation(it, who, trials=2),
    "settled": lambda it, who: analysis.settled(it, who, it.simulate(getattr(who, "genotype", who), trials=2)),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_champion_is_accepted_by_its_experiment_and_refused_by_others(call, tiny, champion, others):
    CALLS[call](tiny, champion)
    for other in others:
        with pytest.raises(REFUSED, match="evolved in another experiment: quickstart, seed 1"):
            CALLS[call](other, champion)
        if call in ("evaluate", "simulate", "network", "load"):
            CALLS[call](other, champion.genotype)


def test_every_function_that_takes_a_genotype_is_tried_here():
    import inspect

    named = [(swarmevo.Experiment, name) for name in dir(swarmevo.Experiment)] + [(swarmevo.Episodes, "load")]
    named += [(analysis, name) for name in analysis.__all__]
    takes = {
        name for owner, name in named
        if not name.startswith("_") and inspect.isfunction(getattr(owner, name))
        and {"genotype", "genotypes"} & set(inspect.signature(getattr(owner, name)).parameters)
    }
    assert takes - CALLS.keys() == {"report"}, "a report is tried by its command"


def test_names_generations_and_judgement_make_no_other_experiment(tiny, champion):
    config = tiny.to_dict()
    config["name"] = "of another name"
    config["algorithm"].update(generations=9, judgement_trials=5)
    other = swarmevo.Experiment.from_dict(config)
    assert other.config_digest == tiny.config_digest == champion.origin.config_digest
    other.check(champion)


def test_a_difference_in_the_seed_alone_is_named(tiny, champion):
    with pytest.raises(REFUSED, match="Only the seed differs: read this experiment with seed=1"):
        tiny.replace(seed=7).check(champion)


def test_a_champion_file_names_its_experiment():
    champion = swarmevo.Champion.from_file(FILE)
    assert champion.origin.config_digest == json.loads(FILE.read_text())["config_digest"]
    assert isinstance(champion.judged, swarmevo.Judged) and champion.judged.low < champion.judged.mean < champion.judged.high
    config = PROJECT / "configs/leader_selection_snes.json"
    swarmevo.Experiment.from_file(config, champion.origin.seed).check(champion)
    with pytest.raises(REFUSED):
        swarmevo.Experiment.from_file(PROJECT / "configs/leader_selection_ga.json", champion.origin.seed).check(champion)


def test_a_champion_of_an_older_simulation_is_recognised(tmp_path):
    file = tmp_path / "older.json"
    file.write_text(FILE.read_text().replace("sim-core 0.1.0 format 3", "sim-core 0.1.0 format 2"))
    champion = swarmevo.Champion.from_file(file)
    with pytest.raises(REFUSED, match="by the simulation `sim-core 0.1.0 format 2`"):
        swarmevo.Experiment.quickstart().check(champion)


def test_a_champion_without_origin_is_refused_and_its_genotype_is_not(tiny):
    evolution = swarmevo.SNES(tiny.n_genes)
    evolution.tell(np.arange(20.0))
    assert evolution.champion.origin is None
    with pytest.raises(REFUSED, match="does not say"):
        tiny.evaluate(evolution.champion)
    tiny.evaluate(evolution.champion.genotype)


def test_the_origin_survives_pickles_and_copies_and_reading_from_a_file(tiny, champion, tmp_path):
    evolution = tiny.evolution()
    evolution.tell(tiny.evaluate(evolution.ask()))
    for it in (pickle.loads(pickle.dumps(evolution)), evolution.copy()):
        tiny.check(it.champion)
    tiny.check(pickle.loads(pickle.dumps(champion)))
    for wrong in ("", "[]", "{}", '{"genotype": "x", "generation": 1}', '{"genotype": [], "generation": 1}', '{"genotype": [[1]], "generation": 1}'):
        (tmp_path / "wrong.json").write_text(wrong)
        with pytest.raises(ValueError, match="is no champion file"):
            swarmevo.Champion.from_file(tmp_path / "wrong.json")


def test_representations_are_short(champion):
    assert len(repr(champion)) < 120 and "judged" in repr(champion)
