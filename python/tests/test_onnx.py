"""Controllers as graphs of ONNX, in onnxruntime, against recorded episodes."""

from pathlib import Path

import numpy as np
import pytest

import swarmevo

onnx = pytest.importorskip("onnx", reason="SKIPPED: no onnx; python/tests/requirements.txt has it")
ort = pytest.importorskip("onnxruntime", reason="SKIPPED: no onnxruntime; python/tests/requirements.txt has it")

ROOT = Path(__file__).resolve().parents[2]
THESIS = ["leader_selection_snes", "borderline_snes", "light_follower_snes", "orientation_consensus_snes"]
# With tanh; with both functions; with a whole number.
SCRIPTS = ["tasks/transport", "tasks/slalom", "tasks/synchronisation"]


def session(path):
    options = ort.SessionOptions()
    options.log_severity_level = 3
    return ort.InferenceSession(str(path), options)


def replayed(experiment, genotype, path, trials=5):
    """A recorded episode, and what the graph answers to its stimuli: tables of all robots, step by step."""
    onnx.checker.check_model(onnx.load(experiment.network(genotype).to_onnx(path)), full_check=True)
    graph = session(path)
    trace = experiment.simulate(genotype, swarmevo.TrialSet.evaluation(), trials=trials)
    widths = {it.name: it.shape[1] for it in graph.get_inputs()}
    names = [it.name for it in graph.get_outputs()]
    ends = np.cumsum(list(widths.values()))[:-1]
    answers, state = [], {}
    for stimuli in trace.stimuli.transpose(1, 0, 2, 3):
        robots = stimuli.reshape(-1, stimuli.shape[-1])
        inputs = dict(zip(widths, np.split(robots, ends, axis=1)))
        answers.append(dict(zip(names, graph.run(names, {**inputs, **state}))))
        state = {"state": answers[-1]["next_state"]}
    return trace, {name: np.stack([it[name] for it in answers], axis=1) for name in names}


def in_rows(values):
    """`[T, steps, R, ...]` as `[T R, steps, ...]`."""
    return np.moveaxis(values, 2, 1).reshape(-1, values.shape[1], *values.shape[3:])


def champion(name):
    file = swarmevo.Champion.from_file(ROOT / f"results/champions/{name.rpartition('/')[2]}-0.json")
    return swarmevo.Experiment.from_file(ROOT / f"configs/{name}.json", seed=file.origin.seed), file


@pytest.mark.parametrize("name", THESIS + SCRIPTS)
def test_champions_answer_as_in_their_episodes(name, tmp_path):
    trace, answers = replayed(*champion(name), tmp_path / "controller.onnx")
    away = np.abs(answers["activities"] - in_rows(trace.activities)).max(axis=(0, 2))
    print(f"{name}: activities differ by {away[0]:.1e} in the first step, {away.max():.1e} at most")
    # Networks remember, so that differences of rounding last and grow.
    assert away[0] <= 1e-6 and away.max() <= 1e-3
    if "wheels" in answers:
        assert np.abs(answers["wheels"] - in_rows(trace.wheels)).max() <= 1e-3
    if "led" in answers:
        assert (answers["led"][..., 0] == in_rows(trace.leds)).mean() > 0.999
    if "send" in answers:
        # In the first steps, radios send whatever the network decides.
        assert (answers["send"][:, 100:, 0] == in_rows(trace.sends)[:, 100:]).mean() > 0.999


def test_drawn_decisions_are_probabilities(quickstart, genotypes, tmp_path):
    config = quickstart.to_dict()
    topology = config["topology"]
    outputs = {it["actuator"]: name for name, it in topology["outputs"].items()}
    led, send = outputs["led_actuator"], outputs["wireless_transmitter:state"]
    topology["ensembles"][topology["outputs"][led]["ensemble"]].update(n=3)
    topology["decoding"][led] = {"scheme": "SoftmaxDecoding"}
    topology["decoding"][send] = {"scheme": "ThresholdDecoding", "params": {"stochastic": True}}
    experiment = swarmevo.Experiment.from_dict(config)
    genes = np.random.default_rng(5).random(experiment.n_genes)
    trace, answers = replayed(experiment, genes, tmp_path / "controller.onnx", trials=20)
    activities = answers["activities"]
    ensembles = np.array(experiment.network(genes).ensembles)
    of = {name: activities[..., ensembles == topology["outputs"][name]["ensemble"]] for name in (led, send)}
    weights = np.exp(of[led])
    assert np.allclose(answers["led_probabilities"], weights / weights.sum(axis=-1, keepdims=True), atol=1e-6)
    assert np.allclose(answers["send_probability"], of[send], atol=1e-6)
    # They are those with which robots draw.
    leds, chances = in_rows(trace.leds), answers["led_probabilities"]
    for colour in range(3):
        assert (leds == colour).mean() == pytest.approx(chances[..., colour].mean(), abs=0.02)


def test_stimuli_have_the_names_of_the_file(quickstart, tmp_path):
    config = quickstart.to_dict()
    topology = config["topology"]
    name = next(iter(topology["stimuli"]))
    topology["stimuli"]["state ü 🐜"] = topology["stimuli"].pop(name)
    for group in topology["synapses"].values():
        group["pre"] = ["state ü 🐜" if it == name else it for it in group["pre"]]
    experiment = swarmevo.Experiment.from_dict(config)
    _, answers = replayed(experiment, np.full(experiment.n_genes, 0.7), tmp_path / "controller.onnx", trials=1)
    graph = session(tmp_path / "controller.onnx")
    assert "stimulus_state ü 🐜" in {it.name for it in graph.get_inputs()}
    # The caller may leave it out.
    assert [it.name for it in graph.get_overridable_initializers()] == ["state"]
    assert {"next_state", "activities", "message"} < set(answers)


def test_networks_that_no_graph_can_express_are_refused(quickstart, tmp_path):
    genes = np.full(quickstart.n_genes, 0.5)
    with pytest.raises(ValueError, match="only a description"):
        swarmevo.Network(quickstart.network(genes).description).to_onnx(tmp_path / "controller.onnx")
    for name, why in (("borderline_lif", "neurons spike"), ("leader_selection_lif_plastic", "weights change")):
        experiment = swarmevo.Experiment.from_file(ROOT / f"configs/spiking/{name}.json")
        network = experiment.network(np.full(experiment.n_genes, 0.5))
        with pytest.raises(ValueError, match=why):
            network.to_onnx(tmp_path / "controller.onnx")
    assert not (tmp_path / "controller.onnx").exists()
