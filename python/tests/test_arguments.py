"""The package accepts only whole numbers where it needs them, and names refused arguments."""

import inspect
import re
import tempfile

import numpy as np
import pytest
from conftest import PROJECT

import swarmevo
from swarmevo import analysis
from swarmevo.records import Records

QUICK = swarmevo.Experiment.quickstart().replace(evaluation_steps=20)
GENES = np.full(QUICK.n_genes, 0.5)
TRACE = QUICK.simulate(GENES, trials=2)
LIT = TRACE.leds[:, 10:] > 0
FOLDER = tempfile.TemporaryDirectory()


class Nobody:
    """Stands for a coordinator or a database, which no test may reach."""

    def __init__(self):
        self.client = object.__new__(swarmevo.Client)
        self.client._call = self.client._in_parts = self.call
        self.client.patience = 0
        self.archive = object.__new__(swarmevo.Archive)
        self.archive._call = self.call
        self.run = swarmevo.FleetRun(self.client, 1)
        self.recorded = swarmevo.RecordedRun(self.archive, 1)

    def call(self, *_, **__):
        raise Reached


class Reached(Exception):
    """The arguments have passed all checks."""


HERE = Nobody()


def evolved():
    evolution = QUICK.evolution()
    evolution.tell(np.arange(float(QUICK.population_size)))
    return evolution


def env():
    pytest.importorskip("pettingzoo")
    return swarmevo.parallel_env(QUICK)


CASES = {
    "Experiment.seed": lambda it: swarmevo.Experiment(QUICK.to_json(), seed=it),
    "Experiment.from_dict.seed": lambda it: swarmevo.Experiment.from_dict(QUICK.to_dict(), seed=it),
    "Experiment.from_file.seed": lambda it: swarmevo.Experiment.from_file(PROJECT / "configs/quickstart.json", seed=it),
    "Experiment.replace.seed": lambda it: QUICK.replace(seed=it),
    "Experiment.replace.generations": lambda it: QUICK.replace(generations=it),
    "Experiment.replace.population_size": lambda it: QUICK.replace(population_size=it),
    "Experiment.fitness.trial_set": lambda it: QUICK.fitness(GENES, it, 2),
    "Experiment.fitness.n_trials": lambda it: QUICK.fitness(GENES, 0, it),
    **{
        f"Experiment.{name}.{key}": lambda it, name=name, key=key: getattr(QUICK, name)(
            *([] if name == "episodes" else [GENES]), **{key: it}
        )
        for name in ("evaluate", "measure", "simulate", "episodes")
        for key in ("generation", "trials", "threads") if (name, key) != ("episodes", "threads")
    },
    "Network.to_c.generation": lambda it: QUICK.network(GENES).to_c(FOLDER.name, it),
    "Network.to_c.trials": lambda it: QUICK.network(GENES).to_c(FOLDER.name, 0, trials=it),
    **{
        f"judge.{key}": lambda it, key=key: swarmevo.judge(["def control(robot): robot.led = True"], QUICK, **{"trials": 1, key: it})
        for key in ("trials", "generations", "threads")
    },
    "TrialSet.generation": lambda it: QUICK.evaluate(GENES, swarmevo.TrialSet("generation", it)),
    "TrialSet.block": lambda it: QUICK.evaluate(GENES, swarmevo.TrialSet("held_out", 0, it)),
    "TrialSet.of.trials": swarmevo.TrialSet.of,
    "TrialSet.generation_of.generation": swarmevo.TrialSet.generation_of,
    "TrialSet.held_out.generation": swarmevo.TrialSet.held_out,
    "TrialSet.held_out.block": lambda it: swarmevo.TrialSet.held_out(0, it),
    "TrialSet.judgement.generation": swarmevo.TrialSet.judgement,
    **{
        f"{it.__name__}.{key}": lambda value, it=it, key=key: it(**{"n_genes": 3, key: value})
        for it in (swarmevo.GA, swarmevo.SNES, swarmevo.XNES, swarmevo.CMAES, swarmevo.SepCMAES, swarmevo.OpenAIES,
                   swarmevo.PGPE)
        for key in ("n_genes", "population_size", "seed")
    },
    **{
        f"NSGA2.{key}": lambda value, key=key: swarmevo.NSGA2(**{"n_genes": 3, "aims": ["minimise"], key: value})
        for key in ("n_genes", "population_size", "seed")
    },
    "Evolution.compare.trials": lambda it: evolved().compare(QUICK.fitness, it),
    "Evolution.judge.trials": lambda it: evolved().judge(QUICK.fitness, it),
    "evolve.generations": lambda it: swarmevo.evolve(QUICK, it, progress=False, evaluate=lambda g, s, t: np.zeros(len(g))),
    "evolve.threads": lambda it: swarmevo.evolve(QUICK.replace(judgement_trials=1, champion_trials=1), 1, threads=it, progress=False),
    "Trace.show.trial": lambda it: TRACE.show(it),
    "Trace.show.height": lambda it: TRACE.show(height=it),
    "Trace.save.trial": lambda it: TRACE.save("/dev/null", it),
    "workers.n": lambda it: swarmevo.workers(None, it),
    "workers.slots": lambda it: swarmevo.workers(None, 1, slots=it),
    "SwarmEnv.reset.seed": lambda it: env().reset(seed=it),
    "SwarmEnv.reset.options.generation": lambda it: env().reset(options={"generation": it}),
    "SwarmEnv.reset.options.trial": lambda it: env().reset(options={"trial": it}),
    "Client.submit.seed": lambda it: HERE.client.submit(QUICK, seed=it),
    "Client.submit.generations": lambda it: HERE.client.submit(QUICK, generations=it),
    "Client.submit.priority": lambda it: HERE.client.submit(QUICK, priority=it),
    "Client.evaluate.generation": lambda it: HERE.client.evaluate(QUICK, GENES, it),
    "Client.evaluate.trials": lambda it: HERE.client.evaluate(QUICK, GENES, trials=it),
    "Client.evaluate.priority": lambda it: HERE.client.evaluate(QUICK, GENES, priority=it),
    "Client.run.experiment": lambda it: HERE.client.run(it),
    "Client.individual.address": lambda it: HERE.client.individual(it),
    "Archive.run.experiment": lambda it: HERE.archive.run(it),
    "Archive.individual.address": lambda it: HERE.archive.individual(it),
    "FleetRun.extend.generations": lambda it: HERE.run.extend(it),
    "FleetRun.resume.generations": lambda it: HERE.run.resume(it),
    "FleetRun.set_priority.priority": lambda it: HERE.run.set_priority(it),
    **{
        f"RecordedRun.{name}": lambda it, call=call: call(HERE.recorded, it)
        for name, call in {
            "individual.generation": lambda run, it: run.individual(it, 0),
            "individual.index": lambda run, it: run.individual(0, it),
            "mean.generation": lambda run, it: run.mean(it),
            "individuals.generation": lambda run, it: run.individuals(it),
            "fitness.generation": lambda run, it: run.fitness(it),
            "repertoire.generation": lambda run, it: run.repertoire(it),
            "to_ribs.generation": lambda run, it: run.to_ribs(it),
            "front.generation": lambda run, it: run.front(it),
        }.items()
    },
    "analysis.ablation.trials": lambda it: analysis.ablation(QUICK, GENES, "groups", trials=it),
    "analysis.generalisation.trials": lambda it: analysis.generalisation(QUICK, GENES, trials=it),
    "analysis.report.trials": lambda it: analysis.report(QUICK, GENES, "/nowhere", trials=it),
    "analysis.variant.robots": lambda it: analysis.variant(QUICK, robots=it),
    "analysis.variant.steps": lambda it: analysis.variant(QUICK, steps=it),
    **{
        f"analysis.{name}.{key}": lambda it, name=name, key=key: getattr(analysis, name)(
            QUICK, GENES, **{"steps": [3], "trials": 1, key: [it] if key in ("steps", "agents") else it}
        )
        for name in ("influence", "attention") for key in ("steps", "agents", "trials", "trial_set", "window", "lasting")
    },
    **{
        f"analysis.{name}.first": lambda it, name=name: getattr(analysis, name)(TRACE, first=it)
        for name in ("symbols", "channel_use", "heard", "informants", "spread", "components_of_states")
    },
    **{
        f"analysis.{name}.{key}": lambda it, name=name, key=key: getattr(analysis, name)(TRACE, TRACE.leds, **{key: it})
        for name in ("signalling", "listening") for key in ("first", "shuffles")
    },
    "analysis.speaker_consistency.first": lambda it: analysis.speaker_consistency(TRACE, TRACE.leds, first=it),
    "analysis.speaker_consistency.lags": lambda it: analysis.speaker_consistency(TRACE, TRACE.leds, [it]),
    "analysis.sectors_heard.window": lambda it: analysis.sectors_heard(TRACE, it),
    "analysis.discretise.n_bins": lambda it: analysis.discretise(np.arange(9.0), it),
    "analysis.dependence.shuffles": lambda it: analysis.dependence(np.zeros((2, 2), int), np.zeros((2, 2), int), shuffles=it),
    "analysis.dependence.seed": lambda it: analysis.dependence(np.zeros((2, 2), int), np.zeros((2, 2), int), seed=it),
    "analysis.settled.most": lambda it: analysis.settled(QUICK, GENES, TRACE, it),
    "analysis.continuation.starts": lambda it: analysis.continuation(None, 0, 1, starts=it),
    "analysis.continuation.max_points": lambda it: analysis.continuation(None, 0, 1, max_points=it),
    "analysis.CTRNN.equilibria.starts": lambda it: alone().equilibria([0.0], starts=it),
    "analysis.CTRNN.equilibria.seed": lambda it: alone().equilibria([0.0], seed=it),
}


def alone():
    return analysis.CTRNN(np.eye(1), tau=[1.0], bias=[0.0], gain=[1.0], input_weights=np.eye(1), activations=["sigmoid"])


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(
    "wrong", [3.7, 3.0, "3", -1, True, np.float32(3), np.nan, [3], {}, object(), 10**30, -(10**30), 1 + 0j, np.bool_(True)], ids=lambda wrong: repr(wrong).split(" at 0x")[0]
)
def test_a_value_error_names_every_argument_that_is_no_whole_number(name, wrong):
    if isinstance(wrong, str) and name.endswith(("run.experiment", "individual.address")):
        pytest.skip("names and addresses are texts")
    with pytest.raises(ValueError) as refused:
        CASES[name](wrong)
    assert not isinstance(refused.value, swarmevo.ExperimentError)
    assert re.search(r"whole number|(agents|steps) are numbered|lasting is from", str(refused.value)), refused.value


@pytest.mark.parametrize("name", CASES)
def test_whole_numbers_of_other_libraries_are_whole_numbers(name):
    for kind in (np.int8, np.uint16, np.int64, np.array, int):
        try:
            CASES[name](kind(5))
        except (Reached, TypeError, AttributeError, ModuleNotFoundError):
            assert not name.startswith(("Experiment", "TrialSet", "SNES", "evolve")), name
        except ValueError as error:
            assert "whole number" not in str(error), (name, kind)


def test_no_number_is_forgotten():
    """The table contains every argument that is annotated as a whole number."""
    named = {f"{owner}.{key}".removeprefix("swarmevo.") for owner, key in numbers()}
    inherited = {f"{it.__name__}.{name}" for it in (swarmevo.GA, swarmevo.SNES, swarmevo.XNES, swarmevo.CMAES,
                                                      swarmevo.SepCMAES, swarmevo.OpenAIES, swarmevo.PGPE, swarmevo.NSGA2) for name in ("compare", "judge")}
    left = {it for it in named - CASES.keys() if it.rpartition(".")[0] not in inherited}
    # Leaves out results, which only the package makes; inherited members; and members that are
    # tested under another name.
    made = {"ExperimentError", "Champion", "Generation", "Judged", "Selection", "Origin", "Problem", "Replay", "Workers", "Client", "Interrupted", "LocalRun"}
    left = {it for it in left if it.split(".")[0] not in made or it.count(".") > 1}
    assert left <= {"Evolution.n_genes", "Evolution.population_size", "Evolution.seed", "RecordedRun.experiment_id",
                    "FleetRun.experiment_id", "RecordedRun.fitness_log.generations", "FleetRun.fitness_log.generations",
                    "Trace.where", "Episodes.where", *(f"FleetRun.{it}" for it in (
                        "individual.generation", "individual.index", "mean.generation", "individuals.generation", "fitness.generation", "repertoire.generation", "to_ribs.generation", "front.generation"))} | {
        it for it in left if it.startswith("analysis.") and inspect.isclass(getattr(analysis, it.split(".")[1])) and it.count(".") == 2
    }, left


def numbers():
    for module, names in ((swarmevo, swarmevo.__all__), (analysis, analysis.__all__)):
        prefix = "" if module is swarmevo else "analysis."
        for name in names:
            it = getattr(module, name)
            if inspect.isclass(it):
                yield from of(f"{prefix}{name}", it)
                for method in dir(it):
                    if not method.startswith("_") and callable(getattr(it, method)) and not inspect.isclass(getattr(it, method)):
                        yield from of(f"{prefix}{name}.{method}", getattr(it, method))
            elif callable(it):
                yield from of(f"{prefix}{name}", it)


def of(name, call):
    try:
        signature = inspect.signature(call)
    except (ValueError, TypeError):
        return
    for key, parameter in signature.parameters.items():
        if re.search(r"\bint\b(?! \| float)|AnyTrialSet", str(parameter.annotation)):
            yield name, key


@pytest.mark.parametrize("call", [
    lambda: swarmevo.SNES(10**10), lambda: swarmevo.GA(10**12), lambda: swarmevo.SepCMAES(2**62),
    lambda: swarmevo.SNES(10**6, population_size=2**32 - 1), lambda: swarmevo.OpenAIES(10**9, population_size=10**6),
    lambda: swarmevo._core.ensure_memory(2**100, "all of it"),
])
def test_a_request_beyond_memory_is_a_memory_error_before_the_allocation(call):
    with pytest.raises(MemoryError, match="would take about .* GB"):
        call()


def test_limits_of_an_algorithm_come_before_memory():
    for it in (swarmevo.XNES, swarmevo.CMAES):
        with pytest.raises(ValueError, match="at most 1000 genes"):
            it(10**10)


def test_misspelt_names_get_a_suggestion():
    for call, says in {
        lambda: swarmevo.SNES(3, sigma_int=0.1): "has no parameter `sigma_int`; did you mean `sigma_init`?",
        lambda: QUICK.replace(num_evaluation=3): "did you mean 'num_evaluations'",
        lambda: QUICK.evaluate(GENES, swarmevo.TrialSet("judgment")): "did you mean 'judgement'",
        lambda: env().reset(options={"generatoin": 3}): "did you mean 'generation'",
    }.items():
        with pytest.raises(ValueError, match=re.escape(says)):
            call()


def test_unknown_parts_of_actions_are_refused():
    world = env()
    world.reset(seed=0)
    good = {agent: {"led": 1, "send": 0, "message": [0.5, 0.5]} for agent in world.agents}
    for change, says in [
        ({"robot_0": {"leds": 1}}, "no part of the action of robot_0 is called 'leds'; did you mean 'led'?"),
        ({"robot_0": {"wheels": [0, 0]}}, "no part of the action of robot_0 is called 'wheels'"),
        ({"robot_0": {"led": 2}}, "led of robot_0 is a whole number from 0 to 1, not 2"),
        ({"robot_0": {"led": 0.5}}, "led of robot_0 is a whole number"),
        ({"robot_0": {"send": -1}}, "send of robot_0 is a whole number"),
        ({"robot_0": {"message": [0.5]}}, "message of robot_0: an array [2] is needed, not [1]"),
        ({"robot_0": {"message": [0.5, np.nan]}}, "message component number 1 is NaN"),
        ({"robot_0": 1}, "the action of robot_0 is a dictionary"),
        ({"robot_7": {}}, "no agent is called 'robot_7'; did you mean 'robot_"),
    ]:
        with pytest.raises(ValueError, match=re.escape(says)):
            world.step(good | change)
    with pytest.raises(ValueError, match="every agent needs an action in every step, and 'robot_4' has none"):
        world.step({agent: good[agent] for agent in world.agents[:-1]})
    world.step(good | {"robot_0": {"led": np.int64(1), "send": np.bool_(True), "message": np.float32([0, 1])}, "robot_1": {}})


@pytest.mark.parametrize("part", ["leds", "sends", "wheels", "messages"])
@pytest.mark.parametrize("value", [0.5, -1, 2**32, np.nan, "1", None])
def test_actions_are_not_rounded_wrapped_or_parsed(part, value):
    if part in ("wheels", "messages") and value == 0.5:
        pytest.skip("fits")
    if part in ("wheels", ) and value == -1:
        pytest.skip("fits")
    episodes = QUICK.episodes(trials=1)
    actions = episodes.idle()
    shape = getattr(actions, part).shape
    setattr(actions, part, np.full(shape, value, dtype=object))
    with pytest.raises(ValueError):
        episodes.step(actions)
    with pytest.raises(ValueError, match="takes Actions"):
        episodes.step({part: value})
    assert episodes.n_steps_done == 0


def test_experiments_may_contain_numbers_of_numpy():
    config = QUICK.to_dict()
    config["algorithm"]["generations"] = np.int64(7)
    config["world"]["width"] = np.float32(500)
    assert swarmevo.Experiment.from_dict(config).generations == 7
    config["algorithm"]["generations"] = object()
    with pytest.raises(ValueError, match="no values such as <object"):
        swarmevo.Experiment.from_dict(config)
    with pytest.raises(ValueError, match="a mapping"):
        swarmevo.Experiment.from_dict([1])


@pytest.mark.parametrize("turn", [-1, "1", np.nan, np.inf, True, None])
def test_times_are_seconds(turn):
    with pytest.raises(ValueError, match="turn is a number of seconds"):
        swarmevo.workers(None, 1, turn=turn)


def test_the_records_have_no_other_numbers():
    assert {it for it in dir(Records) if not it.startswith("_")} == {"experiments", "individual", "run", "runs"}
