"""The first contact with the package: names, versions, representations, missing packages,
deprecations."""

import inspect
import subprocess
import sys
import time
import tomllib

import numpy as np
import pytest
from conftest import PROJECT

import swarmevo
from swarmevo import analysis
from swarmevo.extras import PACKAGES

EXTRAS = tomllib.loads((PROJECT / "python/pyproject.toml").read_text())["project"]["optional-dependencies"]


@pytest.fixture(scope="module")
def short(quickstart):
    return quickstart.replace(generations=3, champion_every=2, champion_trials=2, judgement_trials=3, evaluation_steps=20)


@pytest.fixture(scope="module")
def data(short, tmp_path_factory):
    directory = tmp_path_factory.mktemp("data")
    swarmevo.evolve(short, progress=False, data_dir=directory)
    return directory


def test_the_version_is_that_of_the_project():
    manifest = tomllib.loads((PROJECT / "python/Cargo.toml").read_text())
    assert swarmevo.__version__ == manifest["package"]["version"]


def test_every_name_is_there_once_and_documented():
    for module in (swarmevo, analysis):
        assert len(set(module.__all__)) == len(module.__all__)
        for name in module.__all__:
            it = getattr(module, name)
            assert not (inspect.isclass(it) or inspect.isfunction(it)) or inspect.getdoc(it), name


def test_every_representation_is_short_and_names_its_object(short, data):
    pytest.importorskip("pettingzoo")
    run = swarmevo.evolve(short, progress=False)
    archive = swarmevo.open(data)
    trace = short.simulate(run.champion, trials=2)
    things = [
        short, run, run.champion, run.champion.judged, run.champion.selection, run.champion.origin, run.evolution,
        run.generations[0], run.generations, trace, trace.show(), short.network(run.champion), short.episodes(), short.episodes().idle(),
        short.measure(run.champion), swarmevo.parallel_env(short), archive, archive.run(1), archive.run(1).individuals(0),
        swarmevo.TrialSet.judgement(3), swarmevo.algorithms()["GA"][0],
        analysis.CTRNN(np.eye(2), tau=[1, 1], bias=[0, 0], gain=[1, 1], input_weights=np.eye(2), activations=["sigmoid"] * 2),
        *analysis.generalisation(short, run.champion, trials=2)[:1], *analysis.ablation(short, run.champion, "groups", trials=2)[:1],
        analysis.influence(short, run.champion, [3], trials=2), analysis.attention(short, run.champion, [3], trials=2),
        analysis.symbols(trace), analysis.channel_use(trace), analysis.spread(trace), analysis.dependence(trace.leds, trace.leds, shuffles=3),
        analysis.components_of_states(trace),
    ]
    for it in things:
        assert len(repr(it)) < 300, repr(it)
        assert "object at 0x" not in repr(it)


def test_properties_of_a_champion_have_names(short, data):
    for champion in (swarmevo.evolve(short, progress=False).champion, swarmevo.open(data).run(1).champion):
        mean, low, high, n_trials = champion.judged
        assert (mean, low, high, n_trials) == (champion.judged.mean, champion.judged.low, champion.judged.high, champion.judged.n_trials)
        assert champion.fitness == mean and low <= mean <= high and n_trials == 3
        assert champion.selection.n_trials >= 2 and champion.selection[0] == champion.selection.mean


def test_generations_are_one_list_of_one_type_here_and_of_records(short, data):
    here, there = swarmevo.evolve(short, progress=False), swarmevo.open(data).run(1)
    assert here.generations == there.generations and isinstance(there.generations, list)
    assert {type(it) for it in [*here.generations, *there.generations]} == {swarmevo.Generation}
    assert list(here.history().columns) == list(there.history().columns)
    assert (here.history()[["generation", "best", "mean", "min", "standard_deviation", "digest"]].equals(
        there.history()[["generation", "best", "mean", "min", "standard_deviation", "digest"]]))


def test_old_names_work_and_name_the_new_ones(data):
    run = swarmevo.open(data).run(1)
    with pytest.warns(DeprecationWarning, match="leave out the"):
        assert [it.summary.generation for it in run.generations()] == [0, 1, 2]
    with pytest.warns(DeprecationWarning, match="is now `index`"):
        assert run.generations[1].generation == 1


def test_fitness_is_read_without_genotypes(short, data, monkeypatch):
    run = swarmevo.open(data).run(1)
    expected = [run.individuals(it).fitness for it in range(3)]
    monkeypatch.setattr(swarmevo.RecordedRun, "individuals", lambda *_: pytest.fail("genotypes are moved"))
    assert all(np.array_equal(run.fitness(it), expected[it]) for it in range(3))
    log = run.fitness_log()
    assert log.fitness.tolist() == np.concatenate(expected).reshape(-1).tolist() and len(log) == 3 * 32 * 3
    assert log.loc[log.generation == 2].equals(run.fitness_log([np.int64(2)]).set_index(log.index[-96:]))
    assert run.fitness_log(range(0)).columns.tolist() == ["generation", "individual", "trial", "fitness"]


def test_missing_fitness_and_missing_genotypes_are_the_same_error(data):
    run = swarmevo.open(data).run(1)
    for read in (run.fitness, run.individuals):
        with pytest.raises(swarmevo.FleetError, match="generation 3"):
            read(3)


def test_unknown_individuals_and_runs_are_value_or_key_errors(data):
    archive = swarmevo.open(data)
    for wrong, kind in {"1@0/99": ValueError, "nonsense": ValueError, "1@0": ValueError, "9": KeyError}.items():
        with pytest.raises(kind) as refused:
            archive.individual(wrong)
        assert str(refused.value) and "\\n" not in str(refused.value)
    with pytest.raises(KeyError):
        archive.run(9)
    with pytest.raises(KeyError):
        archive.run("nobody")


def test_replacing_the_algorithm_leaves_no_parameters_behind(quickstart):
    config = quickstart.to_dict()
    config["algorithm"]["populations"]["network"]["params"] |= {"eta_mu": 0.5}
    tuned = swarmevo.Experiment.from_dict(config)
    for it in (swarmevo.GA, swarmevo.XNES, swarmevo.CMAES, swarmevo.SepCMAES, swarmevo.OpenAIES, swarmevo.PGPE, swarmevo.SNES):
        other = tuned.replace(algorithm=it, seed=3, generations=4, population_size=10, name="other")
        of = other.to_dict()["algorithm"]
        assert (of["name"], other.seed, other.generations, other.population_size, other.name) == (it.algorithm, 3, 4, 10, "other")
        other.evolution().ask()
    assert tuned.replace(algorithm="SNES").config_digest == tuned.config_digest == tuned.replace(name="x").config_digest
    assert tuned.replace(params={"eta_mu": 0.25}).to_dict()["algorithm"]["populations"]["network"]["params"]["eta_mu"] == 0.25
    assert tuned.replace(algorithm="GA").replace(algorithm="SNES").config_digest == quickstart.config_digest
    with pytest.raises(swarmevo.ExperimentError):
        tuned.replace(algorithm="PSO")
    with pytest.raises(swarmevo.ExperimentError) as refused:
        tuned.replace(algorithm="GA", params={"eta_mu": 1, "num_elite": 99})
    assert len(refused.value.problems) >= 2


MISSING = {
    "agents": ["from swarmevo.agents import server; server({data!r})", "from swarmevo.agents.main import main; main(['--directory', {data!r}])"],
    "data": ["import swarmevo; swarmevo.open({data!r}).experiments()", "run.history()", "trace.to_pandas()", "trace.to_polars()",
             "import swarmevo; swarmevo.open({data!r}).to_parquet({data!r})"],
    "fleet": ["import swarmevo; swarmevo.connect()", "import swarmevo; swarmevo.open({data!r}).runs()"],
    "network": ["experiment.network(run.champion).to_networkx()"],
    "plot": ["run.plot()", "from swarmevo.analysis import report; report(experiment, run.champion, {data!r} + '/report', trials=2)"],
    "ribs": ["swarmevo.open({data!r}).run(1).to_ribs()"],
    "steps": ["swarmevo.parallel_env(experiment)"],
    "analysis": ["from swarmevo.analysis import alpha_shape; import numpy as np; alpha_shape(np.random.rand(9, 2), 1.0)"],
}
SETUP = """
import sys
sys.modules |= dict.fromkeys({packages!r})
import swarmevo
experiment = swarmevo.Experiment.quickstart().replace(evaluation_steps=15, generations=1, judgement_trials=1, champion_trials=1)
run = swarmevo.evolve(experiment, progress=False)
trace = experiment.simulate(run.champion, trials=1)
try:
    {call}
except ModuleNotFoundError as error:
    print(error)
"""


@pytest.mark.parametrize("extra", PACKAGES)
def test_the_error_of_a_missing_package_names_the_command_to_install_it(extra, data):
    for call in MISSING[extra]:
        script = SETUP.format(packages=PACKAGES[extra], call=call.format(data=str(data)))
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
        assert f"pip install 'swarmevo[{extra}]'" in done.stdout, (call, done.stdout, done.stderr)


def test_that_error_knows_every_extra():
    assert PACKAGES.keys() == EXTRAS.keys() - {"all", "progress"}


def test_reading_the_fitness_of_many_generations_takes_no_time(tmp_path):
    """A time limit for work that once took seconds: 300 generations of 60 genotypes, 424 genes."""
    experiment = swarmevo.Experiment.quickstart().replace(
        algorithm="SNES", population_size=60, generations=300, evaluation_steps=1, num_evaluations=1, champion_every=300,
        champion_trials=1, judgement_trials=1,
    )
    swarmevo.evolve(experiment, progress=False, data_dir=tmp_path)
    run = swarmevo.open(tmp_path).run(1)
    started = time.monotonic()
    assert len(run.fitness_log()) == 300 * 60
    print(f"{time.monotonic() - started:.2f} s")
    assert time.monotonic() - started < 5
