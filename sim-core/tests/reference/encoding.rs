//! Encoders of stimuli and their receptive fields, computed node by node.

use determinism::random::Stream;
use experiment_file::{EncodingScheme, ReceptiveField, TopologyConfig};

/// An encoder with its weights.
#[derive(Clone)]
pub struct Encoder {
    scheme: EncodingScheme,
    field: ReceptiveField,
    /// Weights of a linear field, node by node.
    weights: Vec<f64>,
    /// The values that it encodes, among those of all stimuli.
    values: std::ops::Range<usize>,
    /// Its nodes, among the sources of all stimuli.
    sources: std::ops::Range<usize>,
}

/// The state of a robot's encoders, and their random stream.
#[derive(Clone)]
pub struct EncoderState {
    /// Per source of all stimuli: v and refractory substeps, or survival.
    nodes: Vec<[f64; 2]>,
    stream: Stream,
}

/// The encoders of a network, in the order of its stimuli. `covered`: weights in the genotype, as
/// number of the encoder, number of the weight, value.
pub fn encoders(topology: &TopologyConfig, covered: &[(usize, usize, f64)]) -> Vec<Encoder> {
    let mut encoders = Vec::new();
    let (mut value, mut source) = (0, 0);
    for (name, stimulus) in &topology.stimuli {
        let n = stimulus.n as usize;
        let values = value..value + n;
        value = values.end;
        let Some(config) = topology.encoding.get(name) else {
            source += n;
            continue;
        };
        let field = config.receptive_field;
        let mut weights = Vec::new();
        let n_nodes = match field {
            ReceptiveField::Identity {} => n,
            ReceptiveField::Gaussian(field) => n * field.n_neurons as usize,
            ReceptiveField::Triangular(field)
            | ReceptiveField::Conic(field)
            | ReceptiveField::Parabolic(field) => n * field.n_neurons as usize,
            ReceptiveField::Linear(field) => {
                for centre in evenly(0.0, n as f64, field.n_neurons) {
                    weights.extend((0..n).map(|i| (-(i as f64 - centre).abs()).exp()));
                }
                field.n_neurons as usize
            }
        };
        for &(encoder, weight, value) in covered {
            if encoder == encoders.len() {
                weights[weight] = value;
            }
        }
        let sources = source..source + n_nodes;
        source = sources.end;
        encoders.push(Encoder { scheme: config.scheme, field, weights, values, sources });
    }
    encoders
}

/// Weights of each encoder.
pub fn n_weights(topology: &TopologyConfig) -> Vec<(String, usize)> {
    let encoded = topology.stimuli.iter().filter_map(|(name, stimulus)| {
        let n = match topology.encoding.get(name)?.receptive_field {
            ReceptiveField::Linear(field) => field.n_neurons * stimulus.n,
            _ => 0,
        };
        Some((name.clone(), n as usize))
    });
    encoded.collect()
}

/// `n` evenly spaced numbers from `first` to `last`.
fn evenly(first: f64, last: f64, n: u32) -> Vec<f64> {
    let gaps = if n == 1 { 1.0 } else { f64::from(n) - 1.0 };
    (0..n).map(|i| first + (last - first) * f64::from(i) / gaps).collect()
}

impl Encoder {
    /// The values of its nodes.
    fn respond(&self, phi: &[f64]) -> Vec<f64> {
        let phi = &phi[self.values.clone()];
        let (centres, [min, max], inverted) = match self.field {
            ReceptiveField::Identity {} => return phi.to_vec(),
            ReceptiveField::Linear(_) => {
                let sum = |weights: &[f64]| weights.iter().zip(phi).map(|(w, s)| w * s).sum();
                return self.weights.chunks(phi.len()).map(sum).collect();
            }
            ReceptiveField::Gaussian(f) => {
                (evenly(f.min_stim, f.max_stim, f.n_neurons), [f.min_val, f.max_val], f.inverted)
            }
            ReceptiveField::Triangular(f)
            | ReceptiveField::Conic(f)
            | ReceptiveField::Parabolic(f) => {
                (evenly(f.min_stim, f.max_stim, f.n_neurons), [f.min_val, f.max_val], f.inverted)
            }
        };
        let mut values = Vec::new();
        for s in phi {
            for centre in &centres {
                let d = (s - centre).abs();
                let x = match self.field {
                    ReceptiveField::Gaussian(f) => (-f.sigma * d * d).exp(),
                    ReceptiveField::Parabolic(f) => (1.0 - f.slope * d * d).clamp(0.0, 1.0),
                    ReceptiveField::Triangular(f) | ReceptiveField::Conic(f) => {
                        (1.0 - f.slope * d).clamp(0.0, 1.0)
                    }
                    _ => unreachable!("this field has no centres"),
                };
                let x = if inverted { 1.0 - x } else { x };
                values.push(x * (max - min) + min);
            }
        }
        values
    }
}

impl EncoderState {
    /// The state before the first step, with `n_sources` sources.
    pub fn new(encoders: &[Encoder], n_sources: usize, stream: Stream) -> Self {
        let mut nodes = vec![[0.0; 2]; n_sources];
        for encoder in encoders {
            let first = if encoder.scheme == EncodingScheme::Lif { -65.0 } else { 1.0 };
            nodes[encoder.sources.clone()].fill([first, 0.0]);
        }
        Self { nodes, stream }
    }

    /// The inputs of synapses from the sources of all stimuli in a substep of `n_substeps`, and
    /// whether each source spikes.
    pub fn encode(
        &mut self,
        encoders: &[Encoder],
        phi: &[f64],
        substep: u32,
        n_substeps: u32,
    ) -> (Vec<f64>, Vec<bool>) {
        let mut spikes = vec![false; self.nodes.len()];
        let mut inputs = vec![0.0; self.nodes.len()];
        let (mut value, mut source) = (0, 0);
        for encoder in encoders {
            let held = encoder.values.start - value;
            inputs[source..source + held].copy_from_slice(&phi[value..encoder.values.start]);
            let values = encoder.respond(phi);
            for (node, x) in encoder.sources.clone().zip(values) {
                spikes[node] = self.spike(encoder.scheme, node, x, substep, n_substeps);
                inputs[node] = f64::from(u8::from(spikes[node]));
            }
            (value, source) = (encoder.values.end, encoder.sources.end);
        }
        inputs[source..].copy_from_slice(&phi[value..]);
        (inputs, spikes)
    }

    fn spike(
        &mut self,
        scheme: EncodingScheme,
        node: usize,
        x: f64,
        substep: u32,
        n_substeps: u32,
    ) -> bool {
        let [first, second] = &mut self.nodes[node];
        match scheme {
            EncodingScheme::Lif => {
                let current = if *second > 0.0 { 0.0 } else { x };
                *first += (-65.0 - *first + current) / 20.0;
                *second = (*second - 1.0).max(0.0);
                let spiked = *first >= -50.0;
                if spiked {
                    (*first, *second) = (-65.0, 5.0);
                }
                spiked
            }
            EncodingScheme::PoissonRate => {
                *first -= 1e-3 * (x.clamp(0.0, 1e4) / 10.0) * *first;
                let spiked = self.stream.uniform() < 1.0 - *first;
                if spiked {
                    *first = 1.0;
                }
                spiked
            }
            EncodingScheme::RankOrder => {
                x.clamp(1.0, f64::from(n_substeps)).floor() == f64::from(substep + 1)
            }
        }
    }
}
