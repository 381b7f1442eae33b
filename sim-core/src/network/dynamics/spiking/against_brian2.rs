//! Neurons against Brian2: the fixtures are made by `sim-core/tests/fixtures/neurons.py`.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::lanes::Lanes;
use crate::network::dynamics::NetworkState;
use crate::network::{Network, Phenotype};
use crate::problems::Problems;
use crate::testing::experiment_a_spiking;
use experiment_file::NeuronModel;
use numeric::Isa;

/// Between rest and the peak of a spike, about, mV.
const SPAN: f64 = 100.0;

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
    let neurons = model.spec().parameters.iter().map(|it| (it.name, value(it.name))).collect();
    (network, Phenotype { weights: vec![1.0], neurons, decoders: vec![vec![1.0]] })
}

#[test]
fn every_model_spikes_and_moves_as_in_brian2() {
    let fixture: Value =
        serde_json::from_str(include_str!("../../../../tests/fixtures/neurons.json")).unwrap();
    let number = |value: &Value| value.as_u64().unwrap() as usize;
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
        let currents = fixture["currents"].as_array().unwrap();
        for substep in 0..held * currents.len() {
            stimuli.set(0, 0, currents[substep / held].as_f64().unwrap() as f32);
            state.step(&stimuli);
            if state.activity().get(0, 0) > 0.0 {
                spikes.push(substep);
            }
            voltages.push(state.voltages().unwrap().get(0, 0));
        }
        let expected: Vec<usize> =
            fixture["spikes"].as_array().unwrap().iter().map(number).collect();
        assert_eq!(spikes, expected, "{name}");
        let sampled = voltages.iter().skip(every - 1).step_by(every);
        for (index, (&v, expected)) in
            sampled.zip(fixture["voltages"].as_array().unwrap()).enumerate()
        {
            let expected = expected.as_f64().unwrap();
            let difference = (f64::from(v) - expected).abs() / SPAN;
            assert!(difference < 1e-4, "{name}, sample {index}: {v}, expected {expected}");
        }
    }
}
