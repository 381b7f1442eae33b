//! The controller: the existing synapses, the decoding of genotypes (section 3.4.2), and the
//! CTRNN's dynamics (sections 2.1 and 3.4.1), with dense matrices.

use std::ops::Range;

use determinism::random::{Purpose, Stream};
use experiment_file::{
    Activation, EnsembleSelector, ExperimentConfig, GenotypeQuery, GroupSelector, InitialRates,
    Neurotransmitter, StimulusSelector, SynapseSelector, TopologyConfig,
};

use super::{encoding, spiking};

/// The parameter that a gene encodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gene {
    /// Weight of the synapse of this number.
    Weight(usize),
    /// Parameter of the neuron of this number.
    Neuron(&'static str, usize),
    /// Weight of the decoding of an output, by number of the output.
    Decoder(usize, usize),
    /// Delay of the neuron of this number; numbers after the last neuron are sources of stimuli.
    Delay(usize),
    /// Weight of the receptive field of an encoder, by number of the encoder.
    Encoder(usize, usize),
    /// Coefficient A, B, C or D of a group of synapses, by number of the group.
    Coefficient(usize, usize),
}

/// A gene with its bounds.
struct BoundedGene {
    gene: Gene,
    min: f64,
    max: f64,
}

#[derive(Clone, Copy)]
enum Pre {
    Input(usize),
    Neuron(usize),
}

/// An existing synapse.
struct Synapse {
    group: String,
    group_idx: usize,
    trainable: bool,
    pre_name: String,
    pre: Pre,
    post: usize,
}

/// Numbers of the sources of a stimulus, if there is one of this name.
fn inputs_of(topology: &TopologyConfig, name: &str) -> Option<Range<usize>> {
    let mut start = 0;
    for stimulus in topology.stimuli.keys() {
        let end = start + topology.n_sources(stimulus) as usize;
        if stimulus == name {
            return Some(start..end);
        }
        start = end;
    }
    None
}

/// Numbers of the neurons of an ensemble, if there is one of this name.
pub fn neurons_of(topology: &TopologyConfig, name: &str) -> Option<Range<usize>> {
    let mut start = 0;
    for (ensemble, config) in &topology.ensembles {
        let end = start + config.n as usize;
        if ensemble == name {
            return Some(start..end);
        }
        start = end;
    }
    None
}

/// M_ij ~ B(p): every pair exists with its group's probability, drawn once per experiment. Synapses
/// are numbered in this order.
fn synapses(topology: &TopologyConfig) -> Vec<Synapse> {
    let mut synapses = Vec::new();
    for (group_idx, (group, config)) in topology.synapses.iter().enumerate() {
        let mut stream = Stream::new(topology.seed, 0, 0, Purpose::Connections, group_idx as u64);
        for pre_name in &config.pre {
            let sources: Vec<Pre> = match inputs_of(topology, pre_name) {
                Some(inputs) => inputs.map(Pre::Input).collect(),
                None => neurons_of(topology, pre_name)
                    .expect("pre names a stimulus or an ensemble")
                    .map(Pre::Neuron)
                    .collect(),
            };
            for post_name in &config.post {
                for post in neurons_of(topology, post_name).expect("post names an ensemble") {
                    for &pre in &sources {
                        if stream.uniform() < config.p {
                            synapses.push(Synapse {
                                group: group.clone(),
                                group_idx,
                                trainable: config.trainable,
                                pre_name: pre_name.clone(),
                                pre,
                                post,
                            });
                        }
                    }
                }
            }
        }
    }
    synapses
}

/// Whether a query's selector covers a synapse (Table 4.1).
fn selects(topology: &TopologyConfig, selector: &SynapseSelector, synapse: &Synapse) -> bool {
    let is_sensory = matches!(synapse.pre, Pre::Input(_));
    let is_motor = topology.outputs.values().any(|output| output.ensemble == synapse.pre_name);
    synapse.trainable
        && match selector {
            SynapseSelector::All => true,
            SynapseSelector::Sensory => is_sensory,
            SynapseSelector::Motor => is_motor,
            SynapseSelector::Hidden => !is_sensory && !is_motor,
            SynapseSelector::Named(name) => *name == synapse.pre_name || *name == synapse.group,
        }
}

/// Eq. 3.17, generalised: the segments that the queries name, in their order.
fn bounded_genes(config: &ExperimentConfig, synapses: &[Synapse]) -> Vec<BoundedGene> {
    let topology = &config.topology;
    let mut genes = Vec::new();
    for population in config.algorithm.populations.values() {
        for (i, query) in population.objects.iter().enumerate() {
            let (min, max) = (population.min_vals[i], population.max_vals[i]);
            let covered: Vec<Gene> = match query {
                GenotypeQuery::Weights(selector) => (0..synapses.len())
                    .filter(|&s| selects(topology, selector, &synapses[s]))
                    .map(Gene::Weight)
                    .collect(),
                GenotypeQuery::Neurons(parameter, selector) => {
                    let neurons = ensembles(topology, selector);
                    neurons.map(|neuron| Gene::Neuron(parameter, neuron)).collect()
                }
                GenotypeQuery::Delays(selector) => {
                    axons(topology, selector).into_iter().map(Gene::Delay).collect()
                }
                GenotypeQuery::Learning(selector) => {
                    let learning =
                        topology.learning.as_ref().expect("a query of learning needs plasticity");
                    let groups = topology.synapses.keys().enumerate();
                    let selected = groups.filter(|(_, name)| {
                        learning.synapses.contains(name)
                            && match selector {
                                GroupSelector::All => true,
                                GroupSelector::Named(selected) => selected == *name,
                            }
                    });
                    selected
                        .flat_map(|(group, _)| (0..4).map(move |i| Gene::Coefficient(group, i)))
                        .collect()
                }
                GenotypeQuery::Encoders(selector) => encoding::n_weights(topology)
                    .into_iter()
                    .enumerate()
                    .filter(|(_, (name, _))| match selector {
                        StimulusSelector::All => true,
                        StimulusSelector::Named(selected) => selected == name,
                    })
                    .flat_map(|(encoder, (_, n))| (0..n).map(move |w| Gene::Encoder(encoder, w)))
                    .collect(),
                GenotypeQuery::Decoders(selector) => spiking::decoders(topology, selector)
                    .into_iter()
                    .flat_map(|(output, n)| (0..n).map(move |w| Gene::Decoder(output, w)))
                    .collect(),
            };
            genes.extend(covered.into_iter().map(|gene| BoundedGene { gene, min, max }));
        }
    }
    genes
}

fn ensembles(topology: &TopologyConfig, selector: &EnsembleSelector) -> Range<usize> {
    match selector {
        EnsembleSelector::All => 0..n_neurons(topology),
        EnsembleSelector::Named(name) => {
            neurons_of(topology, name).expect("the query names an ensemble")
        }
    }
}

/// The axons with a delay: neurons, then sources of encoded stimuli.
fn axons(topology: &TopologyConfig, selector: &EnsembleSelector) -> Vec<usize> {
    let n = n_neurons(topology);
    let of_stimulus = |name: &str| {
        let inputs = inputs_of(topology, name).expect("the stimulus has inputs");
        (n + inputs.start..n + inputs.end).collect::<Vec<_>>()
    };
    match selector {
        EnsembleSelector::All => {
            let encoded =
                topology.stimuli.keys().filter(|name| topology.encoding.contains_key(*name));
            (0..n).chain(encoded.flat_map(|name| of_stimulus(name))).collect()
        }
        EnsembleSelector::Named(name) if topology.encoding.contains_key(name) => of_stimulus(name),
        EnsembleSelector::Named(_) => ensembles(topology, selector).collect(),
    }
}

/// The parameters that the genes of the experiment's genotypes encode.
pub fn genes(config: &ExperimentConfig) -> Vec<Gene> {
    bounded_genes(config, &synapses(&config.topology)).iter().map(|bounded| bounded.gene).collect()
}

fn n_neurons(topology: &TopologyConfig) -> usize {
    topology.ensembles.values().map(|ensemble| ensemble.n as usize).sum()
}

/// Number of sources of all stimuli.
pub fn n_inputs(topology: &TopologyConfig) -> usize {
    topology.stimuli.keys().map(|stimulus| topology.n_sources(stimulus) as usize).sum()
}

/// Weights, row = postsynaptic neuron.
#[derive(Clone)]
pub struct Matrices {
    /// N x N
    pub w_neurons: Vec<Vec<f64>>,
    /// N x I
    pub w_inputs: Vec<Vec<f64>>,
    /// N x (N + I), of the synapses whose transmitter opens AMPA, GABA and NMDA receptors.
    pub w_receptors: [Vec<Vec<f64>>; 3],
}

/// The ends of a synapse.
pub struct Ends {
    pub group: String,
    pub group_idx: usize,
    /// A neuron, or N + a source of stimuli.
    pub pre: usize,
    pub post: usize,
}

/// The ends of each synapse.
pub fn ends(topology: &TopologyConfig) -> Vec<Ends> {
    let of_synapse = |synapse: Synapse| Ends {
        group: synapse.group,
        group_idx: synapse.group_idx,
        pre: match synapse.pre {
            Pre::Input(input) => n_neurons(topology) + input,
            Pre::Neuron(neuron) => neuron,
        },
        post: synapse.post,
    };
    synapses(topology).into_iter().map(of_synapse).collect()
}

/// The decoded values of a genotype.
pub struct Decoded {
    /// By number of the synapse.
    pub weights: Vec<f64>,
    /// The weights as matrices.
    pub matrices: Matrices,
    /// By number of the group: A, B, C and D of plasticity.
    pub coefficients: Vec<[f64; 4]>,
    /// Parameters of neurons: name, neuron, number within the bounds.
    pub neurons: Vec<(&'static str, usize, f64)>,
    /// Neuron, or N + source, and number within the bounds.
    pub delays: Vec<(usize, f64)>,
    /// Weights of receptive fields: encoder, number, value.
    pub encoders: Vec<(usize, usize, f64)>,
    /// Weights of decodings: output, number, value.
    pub decoders: Vec<(usize, usize, f64)>,
}

/// Decodes a genotype: x * (max - min) + min. Weights that no query covers are drawn from
/// U(-1, 1).
pub fn decode_genes(config: &ExperimentConfig, genotype: &[f64]) -> Decoded {
    let topology = &config.topology;
    let synapses = synapses(topology);
    let genes = bounded_genes(config, &synapses);
    assert_eq!(genotype.len(), genes.len(), "length of the genotype");
    let mut weights: Vec<Option<f64>> = vec![None; synapses.len()];
    let (mut neurons, mut decoders, mut delays) = (Vec::new(), Vec::new(), Vec::new());
    let mut encoders = Vec::new();
    let coefficients = topology
        .learning
        .as_ref()
        .map_or([0.0; 4], |learning| [learning.a, learning.b, learning.c, learning.d]);
    let mut coefficients = vec![coefficients; topology.synapses.len()];
    for (x, BoundedGene { gene, min, max }) in genotype.iter().zip(&genes) {
        let value = x * (max - min) + min;
        match *gene {
            Gene::Weight(synapse) => weights[synapse] = Some(value),
            Gene::Neuron(name, neuron) => neurons.push((name, neuron, value)),
            Gene::Delay(neuron) => delays.push((neuron, value)),
            Gene::Coefficient(group, index) => coefficients[group][index] = value,
            Gene::Encoder(encoder, weight) => encoders.push((encoder, weight, value)),
            Gene::Decoder(output, weight) => decoders.push((output, weight, value)),
        }
    }
    let mut fixed_weights: Vec<Stream> = (0..topology.synapses.len() as u64)
        .map(|group| Stream::new(topology.seed, 0, 0, Purpose::FixedWeights, group))
        .collect();
    let fill = |(synapse, weight): (&Synapse, Option<f64>)| {
        weight.unwrap_or_else(|| -1.0 + 2.0 * fixed_weights[synapse.group_idx].uniform())
    };
    let weights: Vec<f64> = synapses.iter().zip(weights).map(fill).collect();
    let matrices = matrices(topology, &weights);
    Decoded { weights, matrices, coefficients, neurons, delays, encoders, decoders }
}

/// The weights of all synapses as matrices.
pub fn matrices(topology: &TopologyConfig, weights: &[f64]) -> Matrices {
    let n = n_neurons(topology);
    let mut w_neurons = vec![vec![0.0; n]; n];
    let mut w_receptors = [(); 3].map(|()| vec![vec![0.0; n + n_inputs(topology)]; n]);
    let mut w_inputs = vec![vec![0.0; n_inputs(topology)]; n];
    for (synapse, &weight) in synapses(topology).iter().zip(weights) {
        let transmitter = topology.synapses[synapse.group_idx].transmitter;
        let opened: &[usize] = match transmitter {
            None => &[],
            Some(Neurotransmitter::Ampa) => &[0],
            Some(Neurotransmitter::Gaba) => &[1],
            Some(Neurotransmitter::AmpaNmda) => &[0, 2],
        };
        let axon = match synapse.pre {
            Pre::Input(input) => {
                if opened.is_empty() || !topology.encoding.contains_key(&synapse.pre_name) {
                    w_inputs[synapse.post][input] = weight;
                    continue;
                }
                n + input
            }
            Pre::Neuron(neuron) => {
                w_neurons[synapse.post][neuron] = weight;
                neuron
            }
        };
        for &receptor in opened {
            w_receptors[receptor][synapse.post][axon] = weight;
        }
    }
    Matrices { w_neurons, w_inputs, w_receptors }
}

/// The phenotype: N neurons, I inputs.
#[derive(Clone)]
pub struct Network {
    dt: f64,
    time_scale: u32,
    /// N x N, row = postsynaptic neuron.
    pub w_neurons: Vec<Vec<f64>>,
    /// N x I, row = postsynaptic neuron.
    pub w_inputs: Vec<Vec<f64>>,
    pub tau: Vec<f64>,
    pub gain: Vec<f64>,
    pub bias: Vec<f64>,
    activation: Vec<Activation>,
    bias_in_gain: bool,
    initial_rates: InitialRates,
}

impl Network {
    /// Decodes a genotype: y = x * (max - min) + min, and 2 * 10^y for tau. Parameters that no
    /// query covers keep their defaults; such weights are drawn from U(-1, 1).
    pub fn decode(config: &ExperimentConfig, genotype: &[f64]) -> Self {
        let topology = &config.topology;
        let Decoded { matrices, neurons, .. } = decode_genes(config, genotype);
        let Matrices { w_neurons, w_inputs, .. } = matrices;

        let mut tau = Vec::new();
        let mut gain = Vec::new();
        let mut bias = Vec::new();
        let mut activation = Vec::new();
        for ensemble in topology.ensembles.values() {
            for _ in 0..ensemble.n {
                tau.push(ensemble.params["tau"]);
                gain.push(ensemble.params["gain"]);
                bias.push(ensemble.params["bias"]);
                activation
                    .push(ensemble.activation.expect("rate neurons have an activation function"));
            }
        }
        for (name, neuron, value) in neurons {
            match name {
                "bias" => bias[neuron] = value,
                "gain" => gain[neuron] = value,
                "tau" => tau[neuron] = 2.0 * 10f64.powf(value),
                other => panic!("{other} is no parameter of a CTRNN"),
            }
        }

        if let Some(motor_tau) = topology.motor_tau {
            for output in topology.outputs.values() {
                let neurons = neurons_of(topology, &output.ensemble);
                tau[neurons.expect("the output names an ensemble")].fill(motor_tau);
            }
        }

        let &TopologyConfig { dt, time_scale, bias_in_gain, initial_rates, .. } = topology;
        Self {
            dt,
            time_scale,
            w_neurons,
            w_inputs,
            tau,
            gain,
            bias,
            activation,
            bias_in_gain,
            initial_rates,
        }
    }

    pub fn n_neurons(&self) -> usize {
        self.tau.len()
    }

    pub fn set_weights(&mut self, matrices: Matrices) {
        (self.w_neurons, self.w_inputs) = (matrices.w_neurons, matrices.w_inputs);
    }

    /// u = F(g * (v + beta)), or F(g * v + beta)
    pub fn activities(&self, v: &[f64]) -> Vec<f64> {
        (0..v.len())
            .map(|i| {
                let x = if self.bias_in_gain {
                    self.gain[i] * (v[i] + self.bias[i])
                } else {
                    self.gain[i] * v[i] + self.bias[i]
                };
                match self.activation[i] {
                    Activation::Sigmoid => 1.0 / (1.0 + (-x).exp()),
                    Activation::Tanh => x.tanh(),
                }
            })
            .collect()
    }

    /// One environment step: `time_scale` times
    /// v(t + dt) = v + (dt / tau) * (-v + W_N F(g * (v + beta)) + W_I phi),
    /// all neurons at once, phi held. Returns u after the last substep.
    pub fn step(&self, v: &mut [f64], phi: &[f64], is_first_step: bool) -> Vec<f64> {
        for substep in 0..self.time_scale {
            let mut u = self.activities(v);
            if is_first_step && substep == 0 && self.initial_rates == InitialRates::Zero {
                u.fill(0.0);
            }
            for (i, v) in v.iter_mut().enumerate() {
                let from_neurons = dot(&self.w_neurons[i], &u);
                let from_inputs = dot(&self.w_inputs[i], phi);
                *v += (self.dt / self.tau[i]) * (-*v + from_neurons + from_inputs);
            }
        }
        self.activities(v)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// With W = 0 the fixed point is v = W_I phi, approached by the factor
/// 1 - dt / tau per substep; a neuron that excites itself settles where
/// v = w F(v).
#[test]
fn the_ctrnn_settles_at_its_fixed_point() {
    let mut network = Network {
        dt: 0.1,
        time_scale: 20,
        w_neurons: vec![vec![0.0, 0.0], vec![0.0, 2.0]],
        w_inputs: vec![vec![3.0], vec![0.0]],
        tau: vec![2.0, 0.2],
        gain: vec![1.0, 1.0],
        bias: vec![0.0, 0.0],
        activation: vec![Activation::Sigmoid, Activation::Sigmoid],
        bias_in_gain: true,
        initial_rates: InitialRates::Activation,
    };
    let mut v = vec![0.0, 0.0];
    network.step(&mut v, &[0.5], true);
    assert!((v[0] - 1.5 * (1.0 - 0.95f64.powi(20))).abs() < 1e-14);
    for _ in 0..100 {
        network.step(&mut v, &[0.5], false);
    }
    assert!((v[0] - 1.5).abs() < 1e-12);
    assert!((v[1] - 2.0 / (1.0 + (-v[1]).exp())).abs() < 1e-12);

    network.activation[1] = Activation::Tanh;
    network.bias[1] = 0.5;
    network.gain[1] = 3.0;
    assert_eq!(network.activities(&[0.0, 0.0]), [0.5, 1.5f64.tanh()]);
    network.bias_in_gain = false;
    assert_eq!(network.activities(&[0.0, 0.0]), [0.5, 0.5f64.tanh()]);
}
