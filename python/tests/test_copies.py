"""Copies, pickles and forked processes continue to the same bits, or fail at once."""

import copy
import multiprocessing
import pickle
import threading

import numpy as np
import pytest

import swarmevo

SECONDS = 60
"""Time after which a silent process counts as hanging."""
WAYS = {"pickle": lambda it: pickle.loads(pickle.dumps(it)), "deepcopy": copy.deepcopy, "copy": copy.copy}
STARTS = [it for it in ("fork", "spawn") if it in multiprocessing.get_all_start_methods()]


def begun(experiment, n_steps):
    """Episodes after every kind of call."""
    rng = np.random.default_rng(n_steps)
    episodes = experiment.episodes(3, trials=range(2, 4))
    shape = (2, len(episodes.agents))
    episodes.load(rng.random(experiment.n_genes))
    for step in range(n_steps):
        if step % 3 == 1:
            episodes.stimuli = rng.random((*shape, episodes.n_inputs))
        if step % 4 == 2:
            episodes.silence(rng.random(shape) < 0.5)
        actions = episodes.decide()
        if step % 2:
            actions.messages = rng.random(actions.messages.shape)
        if step % 5 == 3:
            episodes.decide()
        episodes.step(actions)
        if step == 6:
            episodes.load(rng.random(experiment.n_genes))
    return episodes


def rest(episodes):
    """All bits of the remaining steps."""
    bits = [episodes.stimuli.tobytes(), episodes.sent.tobytes()]
    while not episodes.is_over:
        actions = episodes.decide()
        bits += [actions.messages.tobytes(), actions.leds.tobytes(), episodes.step(actions).tobytes()]
        bits += [episodes.stimuli.tobytes(), episodes.sent.tobytes()]
    return b"".join([*bits, episodes.fitness.tobytes()])


def send_rest(pipe, episodes):
    pipe.send(rest(episodes))


def in_process(start, call, *arguments):
    """The result of `call` in another process."""
    context = multiprocessing.get_context(start)
    ours, theirs = context.Pipe()
    process = context.Process(target=call, args=(theirs, *arguments))
    process.start()
    try:
        assert ours.poll(SECONDS), "it hangs"
        return ours.recv()
    finally:
        process.kill()
        process.join()


@pytest.mark.parametrize("n_steps", [0, 1, 12])
@pytest.mark.parametrize("way", WAYS)
def test_a_copy_of_episodes_continues_to_the_same_bits_and_leaves_the_original(quickstart, way, n_steps):
    episodes = begun(quickstart, n_steps)
    once = WAYS[way](episodes)
    again = WAYS[way](once)
    assert once.n_steps_done == n_steps and not once.is_over
    assert rest(once) == rest(again) == rest(episodes)
    assert once.is_over and WAYS[way](episodes).is_over


@pytest.mark.parametrize("start", STARTS)
def test_episodes_continue_in_another_process(quickstart, start):
    episodes = begun(quickstart, 12)
    assert in_process(start, send_rest, episodes) == rest(episodes)


def test_steps_that_the_network_decides_take_no_memory(quickstart):
    episodes = quickstart.episodes(trials=200)
    small = len(pickle.dumps(episodes))
    episodes.load(np.full(quickstart.n_genes, 0.5))
    while not episodes.is_over:
        episodes.step(episodes.decide())
    assert len(pickle.dumps(episodes)) < small + 20_000


def act(world, rng):
    return {agent: {"led": int(rng.integers(2)), "send": int(rng.integers(2)), "message": rng.random(2)} for agent in world.agents}


def played(world, seed):
    """Observations, rewards and infos until the end, and of one more episode."""
    rng, seen = np.random.default_rng(seed), []
    for _ in range(2):
        while world.agents:
            observations, rewards, _, _, infos = world.step(act(world, rng))
            seen.append((np.stack(list(observations.values())).tobytes(), rewards, infos))
        world.reset()
    return seen


def send_played(pipe, world):
    pipe.send(played(world, 4))


@pytest.fixture
def world(quickstart):
    pytest.importorskip("pettingzoo")
    world = swarmevo.parallel_env(quickstart)
    world.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(9):
        world.step(act(world, rng))
    return world


@pytest.mark.parametrize("way", WAYS)
def test_a_copy_of_an_environment_continues_to_the_same_bits(world, way):
    other = WAYS[way](world)
    assert other.possible_agents == world.possible_agents and other.action_spaces == world.action_spaces
    assert played(other, 4) == played(world, 4)


@pytest.mark.parametrize("start", STARTS)
def test_an_environment_continues_in_another_process(world, start):
    assert in_process(start, send_played, world) == played(world, 4)


@pytest.mark.parametrize("num_cpus", [0, 2])
def test_supersuit_runs_environments_side_by_side(quickstart, num_cpus):
    supersuit = pytest.importorskip("supersuit")
    from gymnasium.vector.utils import batch_space

    vector = supersuit.pettingzoo_env_to_vec_env_v1(swarmevo.parallel_env(quickstart))
    both = supersuit.concat_vec_envs_v1(vector, 2, num_cpus=num_cpus, base_class="gymnasium")
    try:
        observations, _ = both.reset(seed=3)
        assert np.asarray(observations).shape == (10, 5)
        n_steps = 0
        while n_steps < quickstart.n_steps:
            actions = batch_space(both.action_space, 10).sample()
            observations, rewards, terminations, truncations, _ = both.step(actions)
            n_steps += 1
        assert all(truncations) and not any(terminations)
    finally:
        both.close()


@pytest.mark.parametrize("way", [*WAYS])
def test_everything_else_can_be_copied(quickstart, way):
    trace = quickstart.simulate(np.full(quickstart.n_genes, 0.5), trials=1)
    evolution = quickstart.evolution()
    generation = evolution.tell(np.arange(32.0))
    for it in (quickstart, trace, evolution, generation, evolution.champion, swarmevo.TrialSet.judgement(3), quickstart.network(trace.genotype)):
        other = WAYS[way](it)
        assert type(other) is type(it) and repr(other) == repr(it)


def test_a_recorded_run_can_be_copied(quickstart, tmp_path):
    short = quickstart.replace(generations=1, evaluation_steps=5, champion_trials=1, judgement_trials=1)
    swarmevo.evolve(short, progress=False, data_dir=tmp_path)
    run = swarmevo.open(tmp_path).run(1)
    for way in WAYS.values():
        assert way(run).digest == run.digest and repr(way(run)) == repr(run)


def send_asked(pipe, evolution):
    try:
        pipe.send(evolution.ask().tobytes())
    except swarmevo.ForkError as error:
        pipe.send(str(error))


@pytest.mark.skipif("fork" not in STARTS, reason="there is no fork here")
def test_an_evolution_works_in_a_forked_process_even_if_another_thread_uses_it():
    evolution = swarmevo.XNES(300, population_size=60, seed=2)
    evolution.tell(np.arange(60.0))
    expected = evolution.ask().tobytes()
    assert in_process("fork", send_asked, evolution) == expected
    stop = threading.Event()

    def use():
        while not stop.is_set():
            evolution.tell(np.arange(60.0))

    thread = threading.Thread(target=use)
    thread.start()
    try:
        for _ in range(20):
            answer = in_process("fork", send_asked, evolution)
            assert isinstance(answer, bytes) or "another thread used this" in answer
    finally:
        stop.set()
        thread.join()


def send_table(pipe, archive):
    pipe.send(list(archive.experiments().id))


def send_error(pipe, call):
    try:
        pipe.send(call())
    except swarmevo.SwarmError as error:
        pipe.send((type(error).__name__, str(error)))


@pytest.mark.skipif("fork" not in STARTS, reason="there is no fork here")
def test_a_client_says_at_once_that_it_was_forked():
    pytest.importorskip("grpc")
    client = swarmevo.connect("http://127.0.0.1:1", patience=0)
    for call in (client.runs, lambda: client.evaluate(swarmevo.Experiment.quickstart(), np.full((1, 424), 0.5))):
        name, says = in_process("fork", send_error, call)
        assert name == "ForkError" and "swarmevo.connect()" in says
