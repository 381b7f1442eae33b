"""Whole runs in this process: storage, interrupts, continuation, callbacks."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from test_copies import in_process, send_table

import swarmevo

GENERATIONS = 7


@pytest.fixture(scope="module")
def short(quickstart):
    """Seven generations, with comparisons after the third and the sixth, and one that only the end
    causes."""
    return quickstart.replace(
        generations=GENERATIONS, champion_every=3, champion_trials=4, judgement_trials=9, evaluation_steps=30
    )


@pytest.fixture(scope="module")
def whole(short):
    return swarmevo.evolve(short, progress=False)


def stop_after(n):
    """A callback that raises Ctrl-C after a number of generations."""

    def callback(generation, evolution):
        assert evolution.n_generations == generation.index + 1
        if generation.index + 1 == n:
            raise KeyboardInterrupt

    return callback


def same(run, other):
    assert (run.digest, run.generations) == (other.digest, other.generations)
    assert run.champion.judged == other.champion.judged and run.champion.origin == other.champion.origin
    assert np.array_equal(run.champion.genotype, other.champion.genotype)
    assert run.evolution.to_json() == other.evolution.to_json()


def rows(directory, **names):
    return [{key: run.summary()[key] for key in ("state", "generations_done", "digest")} for run in swarmevo.open(directory).runs()]


def test_a_run_that_is_kept_has_the_same_bits_and_is_not_computed_again(short, whole, tmp_path):
    run = swarmevo.evolve(short, progress=False, data_dir=tmp_path)
    same(run, whole)
    assert run.id == 1 and rows(tmp_path) == [{"state": "completed", "generations_done": GENERATIONS, "digest": whole.digest}]
    seen = []
    again = swarmevo.evolve(short, progress=False, data_dir=tmp_path, callback=lambda *it: seen.append(it))
    same(again, whole)
    assert seen == [] and len(rows(tmp_path)) == 1
    recorded = swarmevo.open(tmp_path).run(1)
    assert recorded.champion.judged == whole.champion.judged and recorded.generations == whole.generations
    short.check(recorded.champion)


@pytest.mark.parametrize("n", range(1, GENERATIONS + 1))
def test_the_same_call_continues_an_interrupted_run_to_the_same_bits(short, whole, tmp_path, n):
    with pytest.raises(swarmevo.Interrupted) as stopped:
        swarmevo.evolve(short, progress=False, data_dir=tmp_path, callback=stop_after(n))
    assert stopped.value.run.generations == whole.generations[:n] and stopped.value.run.evolution.n_generations == n
    state = "completed" if n == GENERATIONS else "running"
    assert [it["state"] for it in rows(tmp_path)] == [state]
    seen = []
    run = swarmevo.evolve(short, progress=False, data_dir=tmp_path, callback=lambda it, _: seen.append(it.index))
    same(run, whole)
    assert seen == list(range(n, GENERATIONS)) and len(rows(tmp_path)) == 1


def test_an_interrupted_run_that_is_not_kept_is_in_the_exception(short, whole):
    with pytest.raises(KeyboardInterrupt) as stopped:
        swarmevo.evolve(short, progress=False, callback=stop_after(4))
    run = stopped.value.run
    assert run.generations == whole.generations[:4] and run.champion.judged is None
    assert run.champion.selection is not None and "4 of 7 generations are complete; `run` of" in str(stopped.value)
    evolution = run.evolution
    for generation in range(4, GENERATIONS):
        told = evolution.tell(short.evaluate(evolution.ask(), generation))
        if evolution.n_generations % 3 == 0:
            evolution.compare(short.fitness)
    assert told == whole.generations[-1] and evolution.judge(short.fitness).judged == whole.champion.judged


def test_an_interrupt_within_a_comparison_leaves_whole_generations(short, whole):
    def evaluate(genotypes, trial_set, n_trials):
        if trial_set.kind == "held_out" and trial_set.generation == 5:
            raise KeyboardInterrupt
        return short.evaluate(genotypes, trial_set, trials=n_trials)

    with pytest.raises(swarmevo.Interrupted) as stopped:
        swarmevo.evolve(short, progress=False, evaluate=evaluate)
    assert stopped.value.run.evolution.n_generations == 5 == len(stopped.value.run.generations)
    with pytest.raises(KeyboardInterrupt) as nothing:
        swarmevo.evolve(short, progress=False, evaluate=lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    assert type(nothing.value) is KeyboardInterrupt


def test_exceptions_of_a_callback_pass_unchanged_and_the_generation_is_kept(short, whole, tmp_path):
    def callback(generation, _):
        if generation.index == 2:
            raise OSError("the disk of my log is full")

    with pytest.raises(OSError, match="my log"):
        swarmevo.evolve(short, progress=False, data_dir=tmp_path, callback=callback)
    assert rows(tmp_path)[0]["generations_done"] == 3
    same(swarmevo.evolve(short, progress=False, data_dir=tmp_path), whole)


def test_a_callback_cannot_change_the_run(short, whole):
    def callback(generation, evolution):
        evolution.tell(np.arange(float(short.population_size)))

    same(swarmevo.evolve(short, progress=False, callback=callback), whole)


def test_more_generations_continue_from_fewer(short, whole, tmp_path):
    swarmevo.evolve(short, 4, progress=False, data_dir=tmp_path)
    seen = []
    same(swarmevo.evolve(short, progress=False, data_dir=tmp_path, callback=lambda it, _: seen.append(it.index)), whole)
    assert seen == [4, 5, 6] and len(rows(tmp_path)) == 1


def test_another_seed_is_another_experiment_of_the_directory(short, tmp_path):
    for seed in (1, 2):
        swarmevo.evolve(short.replace(seed=seed), 1, progress=False, data_dir=tmp_path)
    assert len(rows(tmp_path)) == 2


def test_a_directory_that_is_in_use_is_refused_at_once(short, tmp_path):
    for evaluate in (None, noisy):
        def run(callback=None, evaluate=evaluate):
            swarmevo.evolve(short, 1, progress=False, data_dir=tmp_path, callback=callback, evaluate=evaluate)

        def callback(*_, run=run):
            with pytest.raises(OSError, match="in use by another"):
                run()

        run(callback)
        run()


@pytest.mark.parametrize("wrong", [{"evaluate": 3}, {"callback": "f"}, {"generations": 0}, {"threads": 0}])
def test_arguments_that_do_not_fit_are_refused_before_anything_is_computed_or_kept(short, tmp_path, wrong):
    with pytest.raises(ValueError):
        swarmevo.evolve(short, progress=False, data_dir=tmp_path / "data", **wrong)
    with pytest.raises(ValueError, match="takes an Experiment"):
        swarmevo.evolve(short.to_dict(), progress=False, data_dir=tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_a_directory_that_cannot_be_used_is_an_error_of_the_system(short, tmp_path):
    (tmp_path / "file").write_text("")
    for evaluate in (None, lambda g, s, t: g[:, 0]):
        with pytest.raises(OSError):
            swarmevo.evolve(short, 1, progress=False, evaluate=evaluate, data_dir=tmp_path / "file")


def test_a_run_ends_at_its_target_fitness(short, tmp_path):
    target = swarmevo.evolve(short, progress=False).generations[1].mean
    config = short.to_dict()
    config["algorithm"]["target_fitness"] = target
    experiment = swarmevo.Experiment.from_dict(config)
    run = swarmevo.evolve(experiment, progress=False, data_dir=tmp_path)
    assert len(run.generations) < GENERATIONS and run.generations[-1].mean >= target and run.champion.judged
    assert rows(tmp_path)[0]["state"] == "completed"
    assert swarmevo.evolve(experiment, progress=False, data_dir=tmp_path).digest == run.digest


def test_a_database_is_read_in_another_process(short, tmp_path):
    swarmevo.evolve(short, 1, progress=False, data_dir=tmp_path)
    archive = swarmevo.open(tmp_path)
    assert len(archive.experiments()) == 1
    for start in ("fork", "spawn"):
        assert in_process(start, send_table, archive) == [1]
    assert len(archive.experiments()) == 1


def run_by_swarmctl(programs, file, directory, *arguments):
    command = [programs / "swarmctl", "run", file, "--data-dir", directory, "--output", "json", *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=300)
    return json.loads(done.stdout.splitlines()[-1])


def test_swarmctl_continues_a_run_of_python_and_python_one_of_swarmctl(short, whole, programs, tmp_path):
    file = tmp_path / "short.json"
    file.write_text(short.to_json())
    for n in (2, 3):
        directory = tmp_path / str(n)
        with pytest.raises(swarmevo.Interrupted):
            swarmevo.evolve(short, progress=False, data_dir=directory, callback=stop_after(n))
        assert run_by_swarmctl(programs, file, directory)["digest"] == whole.digest
        same(swarmevo.evolve(short, progress=False, data_dir=directory), whole)
        assert len(rows(directory)) == 1
    fewer = tmp_path / "fewer"
    run_by_swarmctl(programs, file, fewer, "--generations", "4")
    same(swarmevo.evolve(short, progress=False, data_dir=fewer), whole)
    assert len(rows(fewer)) == 1


def test_stored_runs_are_sound_and_verifiable(short, programs, tmp_path):
    swarmevo.evolve(short, progress=False, data_dir=tmp_path / "data")
    for command in (
        ["doctor", "--data-dir", tmp_path / "data"],
        ["export", "1", "--data-dir", tmp_path / "data", "--to", tmp_path / "run.zip"],
    ):
        done = subprocess.run([programs / "swarmctl", *command], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
    bundle = next(tmp_path.glob("run.zip*"))
    done = subprocess.run([programs / "swarmctl", "verify", bundle], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def test_ctrl_c_ends_a_long_run_at_once_and_keeps_it(tmp_path):
    script = """
import signal, sys, swarmevo
# Children of a shell's background job inherit that they ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
experiment = swarmevo.Experiment.quickstart().replace(evaluation_steps=3000, num_evaluations=100, population_size=200)
small = experiment.replace(evaluation_steps=30, num_evaluations=1)
try:
    swarmevo.evolve(small, 10**6, progress=False, data_dir=sys.argv[1], callback=lambda it, _: it.index == 2 and print("three", flush=True))
except swarmevo.Interrupted as stopped:
    print("kept", len(stopped.run.generations), flush=True)
try:
    print("begun", flush=True)
    swarmevo.evolve(experiment, progress=False, data_dir=sys.argv[1])
except KeyboardInterrupt:
    print("over", flush=True)
"""
    process = subprocess.Popen([sys.executable, "-c", script, tmp_path], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "three\n"
        process.send_signal(signal.SIGINT)
        word, n_kept = process.stdout.readline().split()
        assert word == "kept" and rows(tmp_path)[0]["generations_done"] == int(n_kept) >= 3
        assert process.stdout.readline() == "begun\n"
        while len(rows(tmp_path)) < 2:
            pass
        started = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "over\n"
        assert time.monotonic() - started < 5, "within a second, beside other work"
        assert process.wait(60) == 0
    finally:
        process.kill()


def noisy(genotypes, trial_set, n_trials):
    return genotypes[:, :n_trials] + 0.1 * trial_set.generation


@pytest.mark.parametrize("n", [1, 3, GENERATIONS])
def test_a_run_with_fitness_from_elsewhere_is_kept_in_a_file(short, tmp_path, n):
    expected = swarmevo.evolve(short, progress=False, evaluate=noisy)
    with pytest.raises(swarmevo.Interrupted, match="the same call continues"):
        swarmevo.evolve(short, progress=False, evaluate=noisy, data_dir=tmp_path, callback=stop_after(n))
    assert {it.suffixes[-1] for it in tmp_path.iterdir()} == {".json", ".lock"}
    seen = []
    run = swarmevo.evolve(short, progress=False, evaluate=noisy, data_dir=tmp_path, callback=lambda it, _: seen.append(it.index))
    same(run, expected)
    assert seen == list(range(n, GENERATIONS))
    same(swarmevo.evolve(short, progress=False, evaluate=noisy, data_dir=tmp_path), expected)
    longer = swarmevo.evolve(short, 9, progress=False, evaluate=noisy, data_dir=tmp_path)
    same(longer, swarmevo.evolve(short, 9, progress=False, evaluate=noisy))


def test_an_exception_of_the_function_loses_nothing_that_is_kept(short, tmp_path):
    def evaluate(genotypes, trial_set, n_trials):
        if trial_set.generation == 4:
            raise ConnectionError("the cluster is gone")
        return noisy(genotypes, trial_set, n_trials)

    with pytest.raises(ConnectionError):
        swarmevo.evolve(short, progress=False, evaluate=evaluate, data_dir=tmp_path)
    seen = []
    swarmevo.evolve(short, progress=False, evaluate=noisy, data_dir=tmp_path, callback=lambda it, _: seen.append(it.index))
    assert seen == [4, 5, 6]


def test_a_file_that_is_no_run_is_refused_and_left(short, tmp_path):
    swarmevo.evolve(short, 1, progress=False, evaluate=noisy, data_dir=tmp_path)
    (file,) = tmp_path.glob("*.evolve.json")
    content = json.loads(file.read_text())
    for wrong in ("", "[]", "{}", json.dumps(content | {"format": 2}), json.dumps(content | {"generations": []})):
        file.write_text(wrong)
        with pytest.raises(ValueError, match="is no run to continue"):
            swarmevo.evolve(short, 1, progress=False, evaluate=noisy, data_dir=tmp_path)
        assert file.read_text() == wrong and len(os.listdir(tmp_path)) == 2
