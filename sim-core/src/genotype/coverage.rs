//! The parameters of a network that the genotype covers, and the values of the others.

use indexmap::IndexMap;

use super::Parameter;
use crate::network::{Network, Phenotype};
use crate::problems::Problems;
use determinism::random::{Purpose, Stream};
use experiment_file::{LearningConfig, ReceptiveField, TopologyConfig, limits};

/// The first stream of fixed weights of decoders, after those of groups of synapses.
const DECODERS: u64 = 1 << 32;

/// The stream of delays, after those of the connections of groups.
const DELAYS: u64 = 1 << 32;
/// Number of possible delays.
const N_DELAYS: usize = (*limits::DELAYS.end() - *limits::DELAYS.start()) as usize + 1;

/// Default values of all parameters. Draws all weights of a decoder and all delays, covered or not,
/// so that no value depends on the queries.
pub(super) fn defaults(
    config: &TopologyConfig,
    network: &Network,
    coverage: &ParameterCoverage,
    problems: &mut Problems,
) -> Phenotype {
    let mut weights = vec![0.0; network.synapses.len()];
    for (index, group) in network.groups.values().enumerate() {
        let mut stream = Stream::new(config.seed, 0, 0, Purpose::FixedWeights, index as u64);
        for synapse in group.synapses.clone().filter(|&synapse| !coverage.weights[synapse]) {
            weights[synapse] = -1.0 + 2.0 * stream.uniform();
        }
    }
    let mut neurons = IndexMap::new();
    for (parameter, covered) in network.model.spec().parameters.iter().zip(&coverage.neurons) {
        let mut values = Vec::with_capacity(network.n_neurons());
        for (name, ensemble) in &network.ensembles {
            let value = ensemble.default_of(parameter);
            let is_used = !covered[ensemble.neurons.clone()].iter().all(|&covered| covered);
            // Euler steps beyond twice the time constant diverge.
            if parameter.is_time_constant && network.dt > 2.0 * value && is_used {
                let value = parameter.with_unit(value);
                let message = format!("{value} is less than half of topology.dt: unstable");
                let path = format!("topology.ensembles.{name}.params.{}", parameter.name());
                problems.add(path, message);
            }
            values.extend(ensemble.neurons.clone().map(|_| value));
        }
        neurons.insert(parameter.name(), values);
    }
    let decoders = network.outputs.iter().enumerate().map(|(index, output)| {
        let number = DECODERS + index as u64;
        let mut stream = Stream::new(config.seed, 0, 0, Purpose::FixedWeights, number);
        (0..output.n_weights).map(|_| -1.0 + 2.0 * stream.uniform()).collect()
    });
    let decoders = decoders.collect();
    let mut stream = Stream::new(config.seed, 0, 0, Purpose::Connections, DELAYS);
    let delay = |_| f64::from(*limits::DELAYS.start()) + stream.below(N_DELAYS) as f64;
    let delays = (0..network.n_delays()).map(delay).collect();
    let encoders = network.encoders().map(|(inputs, encoder)| {
        let ReceptiveField::Linear(field) = encoder.config.receptive_field else {
            return Vec::new();
        };
        let n = inputs.len() as u32;
        let weight = |node| (0..n).map(move |value| field.default_weight(node, value, n));
        (0..field.n_neurons).flat_map(weight).collect()
    });
    let encoders = encoders.collect();
    let coefficients = network.learning.as_ref().map_or([0.0; 4], LearningConfig::coefficients);
    let learning = vec![coefficients; network.groups.len()];
    Phenotype { weights, neurons, delays, encoders, learning, decoders }
}

/// Whether the genotype covers each parameter.
pub(super) struct ParameterCoverage {
    /// By number of the synapse.
    weights: Vec<bool>,
    /// By index of the parameter and number of the neuron.
    neurons: Vec<Vec<bool>>,
    /// By number of the neuron, and then of the node.
    delays: Vec<bool>,
    /// By number of the encoder and of the weight.
    encoders: Vec<Vec<bool>>,
    /// By number of the group of synapses: A, B, C and D.
    learning: Vec<[bool; 4]>,
    /// By number of the output and of the weight.
    decoders: Vec<Vec<bool>>,
}

impl ParameterCoverage {
    pub fn new(network: &Network) -> Self {
        let n_parameters = network.model.spec().parameters.len();
        Self {
            weights: vec![false; network.synapses.len()],
            neurons: vec![vec![false; network.n_neurons()]; n_parameters],
            delays: vec![false; network.n_delays()],
            encoders: network
                .encoders()
                .map(|(_, encoder)| vec![false; encoder.n_weights])
                .collect(),
            learning: vec![[false; 4]; network.groups.len()],
            decoders: network.outputs.iter().map(|output| vec![false; output.n_weights]).collect(),
        }
    }

    /// The flag of a parameter.
    pub fn flag_mut(&mut self, parameter: Parameter) -> &mut bool {
        match parameter {
            Parameter::Weight(synapse) => &mut self.weights[synapse],
            Parameter::Neuron { parameter, neuron } => &mut self.neurons[parameter][neuron],
            Parameter::Delay(neuron) => &mut self.delays[neuron],
            Parameter::Coefficient { group, index } => &mut self.learning[group][index],
            Parameter::Encoder { encoder, weight } => &mut self.encoders[encoder][weight],
            Parameter::Decoder { output, weight } => &mut self.decoders[output][weight],
        }
    }

    /// Describes the parameters that are not covered. Omits what the file leaves out by choice:
    /// parameters that it declares untrainable, and parameters that evolve in no neuron.
    pub fn describe(&self, config: &TopologyConfig, network: &Network) -> Vec<String> {
        let mut lines = Vec::new();
        for (name, group) in network.groups.iter().filter(|(_, group)| group.trainable) {
            let n = group.synapses.clone().filter(|&synapse| !self.weights[synapse]).count();
            if n > 0 {
                lines.push(format!("synapses:weights:{name}: {n} weights stay random"));
            }
        }
        let n = self.delays.iter().filter(|covered| !**covered).count();
        if n > 0 {
            lines.push(format!("synapses:delays: {n} delays stay random"));
        }
        let encoded = network.stimuli.iter().filter(|(_, stimulus)| stimulus.encoder.is_some());
        for ((name, _), covered) in encoded.zip(&self.encoders) {
            let n = covered.iter().filter(|covered| !**covered).count();
            if n > 0 {
                lines.push(format!("encoders:weights:{name}: {n} weights stay exp(-|i - c|)"));
            }
        }
        if let Some(learning) = &network.learning {
            let groups = network.groups.iter().zip(&self.learning);
            for ((name, _), _) in
                groups.filter(|((_, group), covered)| group.is_plastic && !covered[0])
            {
                let [a, b, c, d] = learning.coefficients();
                lines.push(format!("learning:coefficients:{name} stay {a}, {b}, {c}, {d}"));
            }
        }
        for (name, covered) in config.outputs.keys().zip(&self.decoders) {
            let n = covered.iter().filter(|covered| !**covered).count();
            if n > 0 {
                lines.push(format!("decoders:weights:{name}: {n} weights stay random"));
            }
        }
        let parameters = network.model.spec().parameters.iter().zip(&self.neurons);
        for (parameter, covered) in parameters.filter(|(_, covered)| covered.contains(&true)) {
            for (name, ensemble) in &network.ensembles {
                if covered[ensemble.neurons.clone()].iter().any(|covered| !covered) {
                    let value = ensemble.default_of(parameter);
                    lines.push(format!("neurons:{}:{name} stays {value}", parameter.name()));
                }
            }
        }
        lines
    }
}
