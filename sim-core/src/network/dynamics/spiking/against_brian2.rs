//! Compares neurons with Brian2; `sim-core/tests/fixtures/neurons.py` makes the fixtures.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::lanes::Lanes;
use crate::network::connections::Source;
use crate::network::dynamics::NetworkState;
use crate::network::{Network, Phenotype};
use crate::problems::Problems;
use crate::testing::experiment_a_spiking;
use determinism::Isa;
use experiment_file::{NeuronModel, Neurotransmitter, SynapseModel, SynapseParams};

/// Approximate voltage from rest to the peak of a spike, mV.
const SPAN: f64 = 100.0;

fn fixture() -> Value {
    serde_json::from_str(include_str!("../../../../tests/fixtures/neurons.json")).unwrap()
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

fn numbers(value: &Value) -> impl Iterator<Item = f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap())
}

/// Compares all spikes, and samples of the voltages.
fn assert_follows(name: &str, spikes: &[usize], voltages: &[f32], every: usize, expected: &Value) {
    let times: Vec<usize> = expected["spikes"].as_array().unwrap().iter().map(number).collect();
    assert_eq!(spikes, times, "{name}");
    let sampled = voltages.iter().skip(every - 1).step_by(every);
    for (index, (&v, expected)) in sampled.zip(numbers(&expected["voltages"])).enumerate() {
        let difference = (f64::from(v) - expected).abs() / SPAN;
        assert!(difference < 1e-4, "{name}, sample {index}: {v}, expected {expected}");
    }
}

/// A neuron that takes its one stimulus as current, substep by substep.
fn neuron(model: NeuronModel, parameters: &Value) -> (Network, Phenotype) {
    let mut config = experiment_a_spiking(model).topology;
    config.time_scale = 1;
    config.stimuli.retain(|name, _| name == "I2");
    config.ensembles.retain(|name, _| name == "OUT_LED");
    config.ensembles["OUT_LED"].n = 1;
    config.outputs.retain(|name, _| name == "outB");
    config.decoding.retain(|name, _| name == "outB");
    config.synapses.retain(|name, _| name == "I2-H1");
    config.synapses["I2-H1"].post = vec!["OUT_LED".into()];
    let mut problems = Problems::default();
    let network = Network::compile(&config, &mut problems);
    problems.check().unwrap();
    let value = |name: &'static str| vec![parameters[name].as_f64().unwrap()];
    let neurons = model
        .spec()
        .parameters
        .iter()
        .map(|parameter| (parameter.name(), value(parameter.name())))
        .collect();
    (
        network,
        Phenotype {
            weights: vec![1.0],
            neurons,
            delays: Vec::new(),
            encoders: Vec::new(),
            learning: Vec::new(),
            decoders: vec![vec![1.0]],
        },
    )
}

#[test]
fn every_model_spikes_and_moves_as_in_brian2() {
    let fixture = fixture();
    let (held, every) = (number(&fixture["held"]), number(&fixture["every"]));
    let models: BTreeMap<&str, NeuronModel> =
        NeuronModel::ALL.into_iter().map(|model| (model.name(), model)).collect();
    let fixtures = fixture["models"].as_object().unwrap();
    assert_eq!(fixtures.len(), 5);
    for (name, fixture) in fixtures {
        let (network, phenotype) = neuron(models[name.as_str()], &fixture["parameters"]);
        let mut state = NetworkState::new(Isa::best(), &network, &phenotype, 1);
        let mut stimuli = Lanes::new(1, 1);
        let (mut spikes, mut voltages) = (Vec::new(), Vec::new());
        let currents: Vec<f64> = numbers(&fixture["currents"]).collect();
        for substep in 0..held * currents.len() {
            stimuli.set(0, 0, currents[substep / held] as f32);
            state.step(&stimuli);
            if state.activity().get(0, 0) > 0.0 {
                spikes.push(substep);
            }
            voltages.push(state.voltages().unwrap().get(0, 0));
        }
        assert_follows(name, &spikes, &voltages, every, fixture);
    }
}

/// Two neurons release AMPA and NMDA, two release GABA, and each has a current.
#[test]
fn dynamic_synapses_work_as_in_brian2() {
    let fixture = fixture();
    let (held, every) = (number(&fixture["held"]), number(&fixture["every"]));
    let fixture = &fixture["network"];
    let mut config = experiment_a_spiking(NeuronModel::Lif).topology;
    config.time_scale = 1;
    config.synapse_model = SynapseModel::Dynamic;
    config.synapse_params = Some(SynapseParams::default());
    config.stimuli.retain(|name, _| name == "I2");
    config.stimuli["I2"].n = 4;
    config.ensembles.retain(|name, _| ["H1", "OUT_LED"].contains(&name.as_str()));
    config.ensembles.values_mut().for_each(|ensemble| ensemble.n = 2);
    config.outputs.retain(|name, _| name == "outB");
    config.decoding.retain(|name, _| name == "outB");
    config.synapses.retain(|name, _| ["I2-H1", "H1-LED", "LED-H1"].contains(&name.as_str()));
    for (group, transmitter) in
        [("H1-LED", Neurotransmitter::AmpaNmda), ("LED-H1", Neurotransmitter::Gaba)]
    {
        config.synapses[group].transmitter = Some(transmitter);
        config.synapses[group].p = 1.0;
    }
    for group in config.synapses.values_mut() {
        group.post = vec!["H1".into(), "OUT_LED".into()];
    }
    let mut problems = Problems::default();
    let network = Network::compile(&config, &mut problems);
    problems.check().unwrap();
    let matrix: Vec<Vec<f64>> =
        fixture["weights"].as_array().unwrap().iter().map(|row| numbers(row).collect()).collect();
    let weights = network.synapses.iter().map(|synapse| match synapse.pre {
        Source::Input(input) => f64::from(u8::from(input == synapse.post)),
        Source::Neuron(pre) => matrix[synapse.post][pre],
        Source::Encoded(_) => unreachable!("stimuli are currents"),
    });
    let weights = weights.collect();
    let parameters = &fixture["parameters"];
    let value = |name: &'static str| vec![parameters[name].as_f64().unwrap(); 4];
    let specified = NeuronModel::Lif.spec().parameters.iter();
    let neurons = specified.map(|parameter| (parameter.name(), value(parameter.name()))).collect();
    let delays = numbers(&fixture["delays"]).collect();
    let decoders = vec![vec![1.0; 2]];
    let phenotype = Phenotype {
        weights,
        neurons,
        delays,
        encoders: Vec::new(),
        learning: Vec::new(),
        decoders,
    };

    let mut state = NetworkState::new(Isa::best(), &network, &phenotype, 1);
    let mut stimuli = Lanes::new(4, 1);
    let mut spikes = [(); 4].map(|()| Vec::new());
    let mut voltages = [(); 4].map(|()| Vec::new());
    let currents = fixture["currents"].as_array().unwrap();
    for substep in 0..held * currents.len() {
        for (neuron, current) in numbers(&currents[substep / held]).enumerate() {
            stimuli.set(neuron, 0, current as f32);
        }
        state.step(&stimuli);
        let v = state.voltages().unwrap();
        for neuron in 0..4 {
            if state.activity().get(neuron, 0) > 0.0 {
                spikes[neuron].push(substep);
            }
            voltages[neuron].push(v.get(neuron, 0));
        }
    }
    for neuron in 0..4 {
        let expected = serde_json::json!({
            "spikes": fixture["spikes"][neuron],
            "voltages": fixture["voltages"][neuron],
        });
        assert!(spikes[neuron].len() > 5, "neuron {neuron} is silent");
        assert_follows("network", &spikes[neuron], &voltages[neuron], every, &expected);
    }
}
