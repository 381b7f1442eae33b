//! Continuous-time recurrent neural network (sections 2.1 and 3.4 of the thesis;
//! Beer 1995), by synchronous Euler steps:
//!
//! v(t+dt) = v + r * (-v + W_N u + W_I phi), u = F(g * (v + beta)), v(0) = 0,
//! r = dt / tau.
//!
//! The state is kept as the exponent that F needs, y = k * g * (v + beta), k being
//! F's [`squash::scale`]. Then a step is
//!
//! y(t+dt) = (1 - r) * y + r * k * g * (W_N u + W_I phi + beta), u = F(y),
//!
//! with one multiply-add per synapse and one per neuron; W_I phi is constant
//! within an environment step. It is computed in f32, which `docs/performance.md`
//! justifies; all constants are computed in f64 and rounded once.
//!
//! All lanes share the weights; no value of one lane ever meets another's. Neurons
//! go in pairs, which share the loads of presynaptic activities and a division;
//! the pairs are a matter of the network's structure alone.

mod kernel;
mod squash;

use super::Dynamics;
use crate::lanes::Lanes;
use crate::network::connections::Source;
use crate::network::{Network, Phenotype};
use experiment_file::Activation;
use kernel::{Chunk, Coupling, Kernel, Pair};
use numeric::Isa;

/// Vectors per row of a chunk, at most: two neurons' sums then fit in registers.
const MAX_CHUNK_WIDTH: usize = 4;

/// A network with its weights, and its state in every lane.
#[derive(Debug)]
pub(crate) struct Ctrnn {
    isa: Isa,
    kernel: Kernel,
    chunks: Vec<Chunk>,
    /// The kernel's row of each neuron.
    rows: Vec<usize>,
}

impl Ctrnn {
    /// At rest: v = 0 in every lane.
    pub fn new(isa: Isa, network: &Network, phenotype: &Phenotype, n_lanes: usize) -> Self {
        let (kernel, rows) = compile(network, phenotype);
        let n_vectors = n_lanes.div_ceil(isa.vector_len());
        let n_chunks = n_vectors.div_ceil(MAX_CHUNK_WIDTH);
        let width = n_vectors.div_ceil(n_chunks.max(1)).max(1);
        let chunks = (0..n_vectors).step_by(width).map(|first| {
            let width = width.min(n_vectors - first);
            Chunk::new(&kernel, first * isa.vector_len(), width, isa)
        });
        let chunks = chunks.collect();
        Self { isa, kernel, chunks, rows }
    }
}

impl Dynamics for Ctrnn {
    fn step(&mut self, stimuli: &Lanes) {
        for chunk in &mut self.chunks {
            chunk.advance(&self.kernel, stimuli, self.isa);
        }
    }

    /// u
    fn write_activity(&self, activity: &mut Lanes) {
        for chunk in &self.chunks {
            for (neuron, &row) in self.rows.iter().enumerate() {
                let lanes = chunk.activity(row);
                activity.row_mut(neuron)[chunk.first_lane()..][..lanes.len()]
                    .copy_from_slice(lanes);
            }
        }
    }
}

/// The kernel of a genotype, and its row of each neuron.
fn compile(network: &Network, phenotype: &Phenotype) -> (Kernel, Vec<usize>) {
    let pairs = pair_up(network);
    let mut rows = vec![0; network.n_neurons()];
    for (index, (_, members)) in pairs.iter().enumerate() {
        for (half, neuron) in members.iter().enumerate() {
            if let Some(neuron) = neuron {
                rows[*neuron] = 2 * index + half;
            }
        }
    }
    let mut incoming = vec![Vec::new(); network.n_neurons()];
    for (synapse, weight) in network.synapses.iter().zip(&phenotype.weights) {
        incoming[synapse.post].push((synapse.pre, *weight));
    }
    let [tau, gain, bias] = ["tau", "gain", "bias"].map(|name| &phenotype.neurons[name]);
    let mut kernel = Kernel::new(network.n_substeps);
    for (activation, members) in pairs {
        let mut pair = Pair { activation, ..Pair::default() };
        let first = (kernel.recurrent.len(), kernel.afferent.len());
        for (half, neuron) in members.into_iter().enumerate() {
            let Some(neuron) = neuron else { continue };
            let rate = network.dt / tau[neuron];
            let scale = squash::scale(activation) * gain[neuron];
            pair.start[half] = (scale * bias[neuron]) as f32;
            pair.retention[half] = (1.0 - rate) as f32;
            pair.drive[half] = (rate * scale * bias[neuron]) as f32;
            for &(pre, weight) in &incoming[neuron] {
                let weight = (rate * scale * weight) as f32;
                let (couplings, first, pre) = match pre {
                    Source::Neuron(pre) => (&mut kernel.recurrent, first.0, rows[pre]),
                    Source::Input(pre) => (&mut kernel.afferent, first.1, pre),
                };
                // A row that both neurons of the pair listen to is read once.
                let known = couplings[first..].iter().position(|c| c.pre == pre);
                let index = first + known.unwrap_or(couplings.len() - first);
                if known.is_none() {
                    couplings.push(Coupling { pre, weights: [0.0; 2] });
                }
                couplings[index].weights[half] = weight;
            }
        }
        pair.recurrent = first.0..kernel.recurrent.len();
        pair.afferent = first.1..kernel.afferent.len();
        kernel.pairs.push(pair);
    }
    (kernel, rows)
}

/// All neurons, in pairs of one activation function: neighbours of an ensemble
/// first, because they have most of their presynaptic neurons in common, then
/// what ensembles have left over.
fn pair_up(network: &Network) -> Vec<(Activation, [Option<usize>; 2])> {
    let mut pairs = Vec::new();
    let mut left_over = [(Activation::Sigmoid, None), (Activation::Tanh, None)];
    for ensemble in network.ensembles.values() {
        // The reader gives every ensemble of rate neurons one.
        let function = ensemble.activation.unwrap_or_default();
        let mut neurons = ensemble.neurons.clone();
        while let Some(first) = neurons.next() {
            let second = neurons.next();
            if second.is_some() {
                pairs.push((function, [Some(first), second]));
                continue;
            }
            for (activation, single) in &mut left_over {
                if *activation == function {
                    match single.take() {
                        None => *single = Some(first),
                        Some(other) => pairs.push((*activation, [Some(other), Some(first)])),
                    }
                }
            }
        }
    }
    for (activation, single) in left_over {
        if single.is_some() {
            pairs.push((activation, [single, None]));
        }
    }
    pairs
}

#[cfg(test)]
mod tests;
