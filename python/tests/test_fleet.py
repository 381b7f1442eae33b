"""A coordinator and its fleet, as real processes."""

import concurrent.futures
import json
import shutil
import subprocess
import threading
import time
import warnings

import numpy as np
import pytest

import swarmevo
from processes import fleet
from swarmevo import ExperimentError, FleetError, TrialSet, protocol
from swarmevo.fleet import IN_FLIGHT_MAX
from swarmevo.settings import Settings

grpc = pytest.importorskip("grpc")
pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def running(programs, tmp_path_factory):
    """A coordinator with two workers."""
    with fleet(programs, tmp_path_factory.mktemp("fleet")) as started:
        started.start_worker("one")
        started.start_worker("two")
        yield started


@pytest.fixture(scope="module")
def client(running):
    with running.connect() as connected:
        yield connected


@pytest.fixture(scope="module")
def short(quickstart):
    """A short experiment."""
    config = quickstart.to_dict()
    config["algorithm"].update(generations=6, judgement_trials=20, champion_trials=10)
    return swarmevo.Experiment.from_dict(config)


@pytest.fixture(scope="module")
def here(short):
    return swarmevo.evolve(short, progress=False)


@pytest.fixture(scope="module")
def run(client, short):
    return client.submit(short, labels={"who": "me"}).wait(progress=False)


def test_a_run_of_the_fleet_is_the_run_here(run, here):
    assert run.state == "completed" and run.digest == here.digest
    assert np.array_equal(run.champion.genotype, here.champion.genotype)
    assert run.champion.judged == here.champion.judged
    history, own = run.history(), here.history()
    for column in ("generation", "best", "mean", "min", "digest"):
        assert list(history[column]) == list(own[column])


def test_watching_shows_every_generation_once(run, here):
    watched = [(it.index, it.digest) for it in run.watch()]
    assert watched == [(it.index, it.digest) for it in here.generations]


def test_any_individual_comes_back(run, short, client):
    evolution = short.evolution()
    for generation in range(3):
        told = run.individuals(generation)
        assert np.array_equal(told.genotypes, evolution.ask())
        assert np.array_equal(told.fitness, short.evaluate(told.genotypes, generation))
        evolution.tell(told.fitness)
    assert np.array_equal(run.mean(2), evolution.mean)
    one = run.individual(1, 7)
    assert np.array_equal(one.genotype, run.individuals(1).genotypes[7])
    assert np.array_equal(client.individual(f"{run.id}@1/7").genotype, one.genotype)
    log = run.fitness_log(range(1, 3))
    assert len(log) == 2 * short.population_size * short.n_trials
    assert run.experiment.to_json() == short.to_json()


def test_fitness_travels_without_genotypes(run, client, monkeypatch):
    told, answers, call = run.individuals(2), [], client._call

    def spy(name, **request):
        answers.append(call(name, **request))
        return answers[-1]

    monkeypatch.setattr(client, "_call", spy)
    assert np.array_equal(run.fitness(2), told.fitness)
    log = run.fitness_log([2])
    assert np.array_equal(log.fitness.to_numpy().reshape(told.fitness.shape), told.fitness)
    individuals = [it for answer in answers for it in answer.individuals]
    assert len(individuals) == 2 * len(told.fitness) and not any(it.genotype for it in individuals)


ASKING = {
    "evaluate": lambda client, short, genotypes: client.evaluate(short, genotypes),
    "wait": lambda client, short, _: client.submit(short).wait(progress=False),
    "watch": lambda client, short, _: list(client.submit(short).watch()),
}


@pytest.mark.parametrize("ask", ASKING)
def test_waiting_for_missing_workers_is_a_warning(programs, tmp_path, short, genotypes, ask):
    seen = []
    with fleet(programs, tmp_path) as started, started.connect() as client, warnings.catch_warnings():

        def show(message, category, filename, *_):
            seen.append((category, filename))
            assert f"`worker --coordinator {started.url}`" in str(message)
            started.start_worker()

        warnings.simplefilter("always")
        warnings.showwarning = show
        ASKING[ask](client, short, genotypes)
        assert seen == [(swarmevo.FleetWarning, __file__)]
        # Now a worker is connected.
        client.evaluate(short, genotypes, trials=50)
        client.submit(short, seed=7).wait(progress=False)
        assert len(seen) == 1


def test_experiments_are_listed_and_found_by_name(run, client):
    table = client.experiments()
    row = table[table.id == run.id].iloc[0]
    assert row["name"] == "quickstart" and row.state == "completed"
    assert row.champion_fitness == run.champion.judged[0]
    assert client.run(run.id).digest == run.digest
    with pytest.raises(KeyError, match="no experiment is named 'nobody'"):
        client.run("nobody")
    with pytest.raises(FleetError) as missing:
        client.run(4711)
    assert missing.value.code == "NOT_FOUND"


def test_the_fleet_evaluates_to_the_bits_of_the_simulator_here(client, quickstart, genotypes):
    for trials in (3, TrialSet.held_out(2, 1), TrialSet.judgement(5)):
        fitness = client.evaluate(quickstart, genotypes, trials, trials=4)
        assert np.array_equal(fitness, quickstart.evaluate(genotypes, trials, trials=4))
    assert client.evaluate(quickstart, genotypes[0]).shape == (3,)
    assert client.evaluate(quickstart, genotypes[:0]).shape == (0, 3)
    with pytest.raises(ValueError, match="trials of an evolution"):
        client.evaluate(quickstart, genotypes, TrialSet.evaluation())
    with pytest.raises(FleetError, match=r"outside \[0, 1\]"):
        client.evaluate(quickstart, genotypes + 1)


def test_large_populations_travel_in_parts(client, quickstart, genotypes, monkeypatch):
    monkeypatch.setattr("swarmevo.fleet.REQUEST_LEN_MAX", 3 * 8 * (quickstart.n_genes + 2))
    fitness = client.evaluate(quickstart, genotypes, 3)
    assert np.array_equal(fitness, quickstart.evaluate(genotypes, 3))


class Crowded(grpc.RpcError):
    """The refusal of a coordinator that holds as much as it may."""

    def code(self):
        return grpc.StatusCode.RESOURCE_EXHAUSTED

    def details(self):
        return "256 MiB of requests wait; try again later"


class Answer:
    """Stands for a request that is under way, until somebody takes its answer or its refusal."""

    def __init__(self, under_way, fitness):
        self.under_way, self.fitness = under_way, fitness
        under_way.append(self)

    def result(self, timeout=None):
        self.cancel()
        if self.fitness is None:
            raise Crowded
        return protocol.message("EvaluateFitnessResponse")(fitness=[{"values": it} for it in self.fitness])

    def cancel(self):
        if self in self.under_way:
            self.under_way.remove(self)


class Evaluations:
    """Stands for the call of a coordinator that refuses some requests. The first gene of an individual is its
    fitness."""

    def __init__(self, refusals):
        self.refusals, self.under_way, self.most, self.asked = refusals, [], 0, 0

    def future(self, request, metadata=None):
        self.asked += 1
        refused = self.asked in self.refusals
        answer = Answer(self.under_way, None if refused else [[it.values[0]] for it in request.genotypes])
        self.most = max(self.most, len(self.under_way))
        return answer


def asking(experiment, monkeypatch, refusals=(), patience=60.0):
    """A client of such a coordinator, which sends two genotypes in a request, and sixty genotypes."""
    monkeypatch.setattr("swarmevo.fleet.REQUEST_LEN_MAX", 2 * (8 * experiment.n_genes + 16))
    monkeypatch.setattr("swarmevo.fleet.PAUSE_S", 0.0)
    client, call = swarmevo.connect("http://127.0.0.1:9", patience=patience), Evaluations(refusals)
    monkeypatch.setattr(client, "_call_of", lambda *_: (call, protocol.message("EvaluateFitnessRequest")))
    return client, call, np.random.default_rng(3).random((60, experiment.n_genes))


def test_a_large_population_has_few_parts_under_way(quickstart, monkeypatch):
    client, call, many = asking(quickstart, monkeypatch)
    assert np.array_equal(client.evaluate(quickstart, many, trials=1), many[:, :1])
    assert call.asked == 30 and call.most == IN_FLIGHT_MAX and not call.under_way


def test_parts_that_a_busy_coordinator_refuses_are_repeated_while_patience_lasts(quickstart, monkeypatch):
    client, call, many = asking(quickstart, monkeypatch, refusals=(1, 5, 9, 10))
    assert np.array_equal(client.evaluate(quickstart, many, trials=1), many[:, :1])
    assert call.asked == 34 and call.most == IN_FLIGHT_MAX
    client, call, many = asking(quickstart, monkeypatch, refusals=(5,), patience=0)
    with pytest.raises(FleetError, match="256 MiB") as refused:
        client.evaluate(quickstart, many, trials=1)
    assert refused.value.code == "RESOURCE_EXHAUSTED" and not call.under_way


def test_anybodys_optimiser_drives_the_fleet(client, short, here):
    """Drives an evolution from here, with the same results as a coordinator's run."""
    run = swarmevo.evolve(
        short, progress=False,
        evaluate=lambda genotypes, trial_set, n: client.evaluate(short, genotypes, trial_set, trials=n),
    )
    assert run.digest == here.digest


def test_a_file_with_mistakes_is_refused_with_all_of_them(client, quickstart):
    config = quickstart.to_dict()
    config["algorithm"]["population_sise"] = 3
    config["algorithm"]["generations"] = -1
    with pytest.raises(ExperimentError) as refused:
        client.submit(config)
    assert len(refused.value.problems) == 2


def test_an_experiment_is_paused_resumed_and_cancelled(client, quickstart):
    run = client.submit(quickstart, generations=100_000, name="long")
    run.pause("lunch")
    assert run.state == "paused" and run.message.reason.endswith("lunch")
    run.resume()
    assert run.state == "running"
    run.set_priority(7)
    run.cancel()
    assert run.state == "cancelled" and run.message.priority == 7
    assert client.run("long").id == run.id
    with pytest.raises(FleetError, match="cancelled"):
        run.wait(progress=False)


def test_workers_are_listed(client):
    give_up_at = time.monotonic() + 60
    while not set(client.workers()["name"]) >= {"one", "two"}:
        assert time.monotonic() < give_up_at


def test_killed_workers_and_a_killed_coordinator_change_nothing(
    programs, tmp_path, quickstart, genotypes
):
    many = np.tile(genotypes, (30, 1))
    expected = quickstart.evaluate(many, trials=50)
    with fleet(programs, tmp_path) as started, started.connect() as client:
        victim = started.start_worker("victim")
        found: list = []
        asking = threading.Thread(
            target=lambda: found.append(client.evaluate(quickstart, many, trials=50))
        )
        asking.start()
        give_up_at = time.monotonic() + 60
        while time.monotonic() < give_up_at:
            workers = client.workers()
            if len(workers) and workers.items_in_flight.max() > 0:
                break
        victim.kill()
        started.coordinator.kill()
        started.coordinator.wait()
        started.start_coordinator()
        started.start_worker("heir")
        asking.join(timeout=120)
        assert not asking.is_alive() and np.array_equal(found[0], expected)


def test_settings_are_found_as_swarmctl_finds_them(tmp_path, monkeypatch):
    for name in ("COORDINATOR", "CLIENT_TOKEN", "CLIENT_TOKEN_FILE", "TLS_CA", "PLAINTEXT"):
        monkeypatch.delenv(f"SWARM_{name}", raising=False)
    file = tmp_path / "config.json"
    file.write_text(json.dumps({"coordinator": "http://file:1", "token-file": "secret"}))
    monkeypatch.setenv("SWARM_CONFIG", str(file))
    found = Settings.find(Settings())
    assert found.address == "http://file:1" and found.token_file == str(tmp_path / "secret")
    # A token must reach its own coordinator only.
    other = Settings.find(Settings(coordinator="http://other:1"))
    assert other.address == "http://other:1" and other.token_file is None
    monkeypatch.setenv("SWARM_COORDINATOR", "http://variable:1")
    monkeypatch.setenv("SWARM_CLIENT_TOKEN", "of-the-variable")
    found = Settings.find(Settings())
    assert found.address == "http://variable:1" and found.token() == "of-the-variable"
    monkeypatch.setenv("SWARM_CONFIG", str(tmp_path / "absent.json"))
    with pytest.raises(FileNotFoundError):
        Settings.find(Settings())


def test_settings_may_have_comments_and_trailing_commas(tmp_path, monkeypatch):
    monkeypatch.delenv("SWARM_COORDINATOR", raising=False)
    file = tmp_path / "config.json"
    file.write_text('{\n  // The usual place.\n  "coordinator": "http://file:1", /* "x": */\n}\n')
    monkeypatch.setenv("SWARM_CONFIG", str(file))
    assert Settings.find(Settings()).address == "http://file:1"


@pytest.mark.parametrize(
    ("text", "mistake"),
    [
        ("{\n  // \"plaintext\": 1\n  \"plaintext\": 1,\n}", "line 3: `plaintext` is true or false, not int"),
        ('{\n\n  "coordinator": 7700}', "line 3: `coordinator` is text, not int"),
        ('{\n  "coordinater": "http://h:1"}', "line 2: unknown key `coordinater`; known: coordinator, token-file"),
        ("{\n  \"coordinator\" \"x\"}", "line 2: Expecting ':' delimiter"),
        ("[]", "line 1: settings are an object, not list"),
    ],
)
def test_a_mistake_in_the_settings_is_named_with_its_line(tmp_path, monkeypatch, text, mistake):
    file = tmp_path / "config.json"
    file.write_text(text)
    monkeypatch.setenv("SWARM_CONFIG", str(file))
    with pytest.raises(ValueError) as refused:
        swarmevo.connect()
    assert str(refused.value).startswith(f"{file}: {mistake}") and type(refused.value) is ValueError


def test_a_token_is_not_sent_unencrypted(monkeypatch):
    monkeypatch.setenv("SWARM_CLIENT_TOKEN", "a-token-0123456789abcdef01234567")
    with pytest.raises(ValueError, match="unencrypted"):
        swarmevo.connect("http://fleet.example:7700")


def test_tokens_are_required_where_the_coordinator_has_them(programs, tmp_path, monkeypatch):
    token = "client-token-0123456789abcdef0123"
    worker_token = "worker-token-0123456789abcdef0123"
    tokens = {"SWARM_CLIENT_TOKEN": token, "SWARM_WORKER_TOKEN": worker_token}
    with fleet(programs, tmp_path, **tokens) as started:
        with started.connect() as stranger, pytest.raises(FleetError) as refused:
            stranger.experiments()
        assert refused.value.code == "UNAUTHENTICATED"
        (tmp_path / "token").write_text(token + "\n")
        with started.connect(token_file=str(tmp_path / "token")) as client:
            assert len(client.experiments()) == 0


def test_tls_is_spoken_by_client_and_workers(programs, tmp_path, quickstart, genotypes):
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("SKIPPED: no openssl to make a certificate with")
    certificate, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    subprocess.run(
        [openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
         "-nodes", "-keyout", key, "-out", certificate, "-days", "2", "-subj", "/CN=localhost",
         "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1",
         "-addext", "basicConstraints=critical,CA:FALSE"],
        check=True, capture_output=True,
    )
    files = ("--tls-cert", str(certificate), "--tls-key", str(key))
    with fleet(programs, tmp_path, *files) as started:
        url = started.url.replace("http://127.0.0.1", "https://localhost")
        with swarmevo.connect(url, tls_ca=str(certificate)) as client:
            with concurrent.futures.ThreadPoolExecutor(1) as executor:
                with swarmevo.workers(executor, 1, url, tls_ca=str(certificate)):
                    fitness = client.evaluate(quickstart, genotypes)
        assert np.array_equal(fitness, quickstart.evaluate(genotypes))
        with swarmevo.connect(url, patience=0) as stranger, pytest.raises(FleetError):
            stranger.experiments()


def test_a_missing_coordinator_is_an_error():
    with swarmevo.connect("http://127.0.0.1:9", patience=0) as client:
        with pytest.raises(FleetError) as refused:
            client.experiments()
    assert refused.value.code == "UNAVAILABLE" and "127.0.0.1:9" in str(refused.value)
