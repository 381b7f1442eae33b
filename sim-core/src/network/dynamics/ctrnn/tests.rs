//! Compares the network with its equations, and with itself on other instruction sets.

use super::*;
use crate::network::connections::Source;
use crate::network::dynamics::NetworkState;
use crate::problems::Problems;
use crate::testing::experiment_a;
use experiment_file::{Activation, ExperimentConfig, InitialRates};

/// The equation without rearrangement, in f64, for one robot.
fn reference(network: &Network, phenotype: &Phenotype, stimuli: &[f64], v: &mut [f64]) -> Vec<f64> {
    let activities = |v: &[f64]| -> Vec<f64> {
        let mut u = Vec::new();
        for ensemble in network.ensembles.values() {
            u.extend(ensemble.neurons.clone().map(|i| {
                let [gain, bias] = ["gain", "bias"].map(|name| phenotype.neurons[name][i]);
                let x =
                    if network.bias_in_gain { gain * (v[i] + bias) } else { gain * v[i] + bias };
                match ensemble.activation.unwrap() {
                    Activation::Sigmoid => 1.0 / (1.0 + libm::exp(-x)),
                    Activation::Tanh => libm::tanh(x),
                }
            }));
        }
        u
    };
    let starts_at_zero = network.initial_rates == InitialRates::Zero && v.iter().all(|v| *v == 0.0);
    for substep in 0..network.n_substeps {
        let mut u = activities(v);
        if starts_at_zero && substep == 0 {
            u.fill(0.0);
        }
        let mut drive = vec![0.0; v.len()];
        for (synapse, weight) in network.synapses.iter().zip(&phenotype.weights) {
            drive[synapse.post] += weight
                * match synapse.pre {
                    Source::Input(input) => stimuli[input],
                    Source::Neuron(neuron) => u[neuron],
                    Source::Encoded(_) => unreachable!("rate neurons take no spikes"),
                };
        }
        for i in 0..v.len() {
            v[i] += network.dt / phenotype.neurons["tau"][i] * (drive[i] - v[i]);
        }
    }
    activities(v)
}

/// The network of a configuration, and the phenotype of one of its genotypes.
fn compiled(config: &ExperimentConfig) -> (Network, Phenotype) {
    let mut problems = Problems::default();
    let network = Network::compile(&config.topology, &mut problems);
    let codec = crate::genotype::Codec::compile(config, &network, &mut problems);
    problems.check().unwrap();
    let phenotype = codec.decode(&crate::testing::genotype(codec.genotype_len(), 5));
    (network, phenotype)
}

/// Experiment A's network, and variants with every kind of block: one ensemble of `tanh`, odd
/// numbers of neurons, two groups of synapses between the same neurons, more pairs of neurons
/// than a vector has lanes; and neurons as in SpikeSwarmSim.
fn networks() -> [(Network, Phenotype); 5] {
    let mut tanh = experiment_a();
    tanh.topology.ensembles["H2"].activation = Some(Activation::Tanh);
    let mut odd = tanh.clone();
    odd.topology.ensembles["H1"].n = 7;
    odd.topology.ensembles["H2"].n = 9;
    let again = odd.topology.synapses["H1-H1"].clone();
    odd.topology.synapses.insert("H1-H1 again".into(), again);
    let mut large = odd.clone();
    large.topology.ensembles["H1"].n = 39;
    let mut original = odd.clone();
    original.topology.bias_in_gain = false;
    original.topology.initial_rates = InitialRates::Zero;
    [experiment_a(), tanh, odd, large, original].map(|config| compiled(&config))
}

fn stimulus(step: usize, lane: usize, input: usize) -> f64 {
    libm::sin((lane + 3 * input + 7 * step) as f64)
}

/// Stimuli of one step in some lanes.
fn stimuli(step: usize, lanes: std::ops::Range<usize>) -> Lanes {
    let n_inputs = 5;
    let mut stimuli = Lanes::new(n_inputs, lanes.len());
    for (index, lane) in lanes.enumerate() {
        for input in 0..n_inputs {
            stimuli.set(input, index, stimulus(step, lane, input) as f32);
        }
    }
    stimuli
}

/// Activities `[neuron]` of one lane after some steps with the given lanes.
fn bits(
    (network, phenotype): &(Network, Phenotype),
    isa: Isa,
    lanes: std::ops::Range<usize>,
    lane: usize,
) -> Vec<u32> {
    let mut state = NetworkState::new(isa, network, phenotype, lanes.len());
    for step in 0..3 {
        state.step(&stimuli(step, lanes.clone()));
    }
    state.activity().column(lane - lanes.start).map(f32::to_bits).collect()
}

#[test]
fn every_lane_follows_the_equation() {
    for (network, phenotype) in networks() {
        // Rounding errors add up over presynaptic neurons, and networks amplify them.
        let tolerance = if network.n_neurons() > 40 { 1e-4 } else { 1e-5 };
        let n_lanes = 11;
        let mut state = NetworkState::new(Isa::best(), &network, &phenotype, n_lanes);
        let mut v = vec![vec![0.0; network.n_neurons()]; n_lanes];
        for step in 0..5 {
            state.step(&stimuli(step, 0..n_lanes));
            for (lane, v) in v.iter_mut().enumerate() {
                let phi: Vec<f64> = (0..5).map(|input| stimulus(step, lane, input)).collect();
                let u = reference(&network, &phenotype, &phi, v);
                for (neuron, u) in u.into_iter().enumerate() {
                    let difference = (f64::from(state.activity().get(neuron, lane)) - u).abs();
                    assert!(difference < tolerance, "step {step}, lane {lane}: {difference}");
                }
            }
        }
    }
}

#[test]
fn instruction_sets_agree_in_every_bit() {
    for network in networks() {
        for n_lanes in [1, 3, 6, 15, 50, 53, 100] {
            for lane in [0, n_lanes / 2, n_lanes - 1] {
                let expected = bits(&network, Isa::best(), 0..n_lanes, lane);
                for isa in Isa::available() {
                    assert_eq!(bits(&network, isa, 0..n_lanes, lane), expected, "{isa}");
                }
            }
        }
    }
}

#[test]
fn a_lane_does_not_depend_on_its_place_or_its_neighbours() {
    for network in networks() {
        for isa in Isa::available() {
            let alone = bits(&network, isa, 70..71, 70);
            for lanes in [70..71, 69..71, 67..71, 65..71, 60..80, 0..71, 37..170] {
                assert_eq!(bits(&network, isa, lanes.clone(), 70), alone, "{isa}, {lanes:?}");
            }
        }
    }
}
