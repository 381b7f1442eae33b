"""Workers inside executors, Dask and Ray, for a real coordinator."""

import concurrent.futures
import multiprocessing
import os
import signal
import time

import numpy as np
import pytest

import swarmevo
from processes import fleet

pytest.importorskip("grpc")
pytest.importorskip("pandas")
WORKER_TOKEN = "worker-token-0123456789abcdef0123"
CLIENT_TOKEN = "client-token-0123456789abcdef0123"


@pytest.fixture
def started(programs, tmp_path):
    with fleet(programs, tmp_path) as running:
        yield running


def until(condition):
    give_up_at = time.monotonic() + 90
    while not condition():
        assert time.monotonic() < give_up_at, "it has never come true"
        time.sleep(0.05)


def assert_evaluates(started, experiment, genotypes):
    with started.connect() as client:
        fitness = client.evaluate(experiment, genotypes, 5)
        assert np.array_equal(fitness, experiment.evaluate(genotypes, 5))


def test_threads_are_workers_turn_by_turn_until_they_are_stopped(started, quickstart, genotypes):
    with concurrent.futures.ThreadPoolExecutor(2) as executor:
        with swarmevo.workers(executor, 2, started.url, turn=0.5) as kept, started.connect() as client:
            until(lambda: len(client.workers()) == 2)
            first = set(client.workers()["id"])
            assert_evaluates(started, quickstart, genotypes)
            # Others have taken their places.
            until(lambda: len(client.workers()) == 2 and not first & set(client.workers()["id"]))
        assert kept.n_running == 0 and kept.problem is None


def test_a_worker_that_is_refused_says_why(programs, tmp_path, quickstart, genotypes, monkeypatch):
    tokens = {"SWARM_CLIENT_TOKEN": CLIENT_TOKEN, "SWARM_WORKER_TOKEN": WORKER_TOKEN}
    (tmp_path / "token").write_text(WORKER_TOKEN)
    with fleet(programs, tmp_path, **tokens) as started:
        with concurrent.futures.ThreadPoolExecutor(1) as executor:
            with swarmevo.workers(executor, 1, started.url) as kept:
                until(lambda: kept.problem is not None)
            assert "token" in kept.problem
            file = str(tmp_path / "token")
            with swarmevo.workers(executor, 1, started.url, token_file=file) as kept:
                monkeypatch.setenv("SWARM_CLIENT_TOKEN", CLIENT_TOKEN)
                assert_evaluates(started, quickstart, genotypes)
                assert kept.problem is None


def test_processes_are_workers(started, quickstart, genotypes):
    spawning = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=spawning) as executor:
        with swarmevo.workers(executor, 1, started.url, turn=2):
            assert_evaluates(started, quickstart, genotypes)


def test_executors_that_fork_are_refused():
    forking = multiprocessing.get_context("fork")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=forking) as executor:
        with pytest.raises(ValueError, match="get_context..spawn"):
            swarmevo.workers(executor, 1, "http://127.0.0.1:1", turn=0.1).stop(wait=False)


def test_a_dask_cluster_is_a_fleet_and_a_lost_node_is_replaced(started, quickstart, genotypes):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as dask, started.connect() as client:
        with swarmevo.workers(dask, 2, started.url, turn=3):
            until(lambda: len(client.workers()) == 2)
            ids = set(client.workers()["id"])
            os.kill(next(iter(dask.run(os.getpid).values())), signal.SIGKILL)
            assert_evaluates(started, quickstart, genotypes)
            # The nanny starts the node again, and there are two workers again.
            until(lambda: len(set(client.workers()["id"]) - ids) > 0 and len(client.workers()) == 2)


def test_a_ray_cluster_is_a_fleet_and_a_lost_process_is_replaced(started, quickstart, genotypes):
    ray = pytest.importorskip("ray")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    try:
        with swarmevo.workers(ray, 2, started.url, turn=3), started.connect() as client:
            until(lambda: len(client.workers()) == 2)
            ids = set(client.workers()["id"])

            kill_one_of_ray()
            assert_evaluates(started, quickstart, genotypes)
            until(lambda: len(set(client.workers()["id"]) - ids) > 0 and len(client.workers()) == 2)
    finally:
        ray.shutdown()


def kill_one_of_ray() -> None:
    """Kills one of the processes that Ray has started for the workers."""
    psutil = pytest.importorskip("psutil")
    mine = psutil.Process().children(recursive=True)
    serving = [it for it in mine if "serve" in " ".join(it.cmdline())]
    assert serving, [it.cmdline() for it in mine]
    serving[0].kill()
