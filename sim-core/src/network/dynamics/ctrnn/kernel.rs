//! A network with its weights, in the order in which it is computed.

use std::collections::BTreeMap;
use std::ops::Range;

use super::squash;
use crate::network::connections::Source;
use crate::network::{Network, Phenotype};
use experiment_file::{Activation, InitialRates};

/// Neurons in blocks of four and, what is left of ensembles, of two. A neuron's row is its
/// place, blocks of four first; rows 2k and 2k+1 are a pair, which shares a division.
#[derive(Debug)]
pub(super) struct Kernel {
    pub n_substeps: u32,
    /// u at the start.
    pub initial_rates: InitialRates,
    pub quads: Blocks<4>,
    pub pairs: Blocks<2>,
}

/// Blocks of N neurons, and their synapses, block by block.
#[derive(Debug, Default)]
pub(super) struct Blocks<const N: usize> {
    pub blocks: Vec<Block<N>>,
    /// Synapses between neurons.
    pub recurrent: Vec<Coupling<N>>,
    /// Synapses from inputs.
    pub afferent: Vec<Coupling<N>>,
}

/// N neurons of one activation function.
#[derive(Debug)]
pub(super) struct Block<const N: usize> {
    /// F
    pub activation: Activation,
    /// y at the start.
    pub start: [f32; N],
    /// Factor of y in a substep, 1 - r.
    pub retention: [f32; N],
    /// What the bias adds to y in a substep.
    pub drive: [f32; N],
    /// Its synapses in `Blocks::recurrent`.
    pub recurrent: Range<usize>,
    /// Its synapses in `Blocks::afferent`.
    pub afferent: Range<usize>,
}

/// Synapses of one row with the neurons of a block. A block's are added up by ascending
/// rows: the order is part of the format of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling<const N: usize> {
    /// Row of the presynaptic neuron or input.
    pub pre: usize,
    /// What its activity adds to y in a substep, per unit; 0 without a synapse.
    pub weights: [f32; N],
}

impl Kernel {
    /// The kernel of a genotype, and its row of each neuron.
    pub fn compile(network: &Network, phenotype: &Phenotype) -> (Self, Vec<usize>) {
        let Members { quads, pairs } = Members::of(network);
        let quad_rows = quads.iter().flat_map(|(_, members)| members.iter().copied().map(Some));
        let pair_rows = pairs.iter().flat_map(|(_, members)| members.iter().copied());
        let mut rows = vec![0; network.n_neurons()];
        for (row, neuron) in quad_rows.chain(pair_rows).enumerate() {
            if let Some(neuron) = neuron {
                rows[neuron] = row;
            }
        }
        let mut incoming = vec![[BTreeMap::new(), BTreeMap::new()]; network.n_neurons()];
        for (synapse, weight) in network.synapses.iter().zip(&phenotype.weights) {
            let [recurrent, afferent] = &mut incoming[synapse.post];
            // Two groups of synapses may join the same neurons.
            *match synapse.pre {
                Source::Neuron(pre) => recurrent.entry(rows[pre]).or_insert(0.0),
                Source::Input(pre) => afferent.entry(pre).or_insert(0.0),
            } += weight;
        }
        let wiring = Wiring { network, phenotype, incoming };
        let mut kernel = Self {
            n_substeps: network.n_substeps,
            initial_rates: network.initial_rates,
            quads: Blocks::default(),
            pairs: Blocks::default(),
        };
        for (activation, members) in quads {
            kernel.quads.add(&wiring, activation, members.map(Some));
        }
        for (activation, members) in pairs {
            kernel.pairs.add(&wiring, activation, members);
        }
        (kernel, rows)
    }

    /// y of each row at the start.
    pub fn starts(&self) -> impl Iterator<Item = f32> {
        let quads = self.quads.blocks.iter().flat_map(|block| block.start);
        quads.chain(self.pairs.blocks.iter().flat_map(|block| block.start))
    }

    /// Inputs, up to the last one that has a synapse.
    pub fn n_inputs(&self) -> usize {
        let quads = self.quads.afferent.iter().map(|coupling| coupling.pre);
        let pairs = self.pairs.afferent.iter().map(|coupling| coupling.pre);
        quads.chain(pairs).max().map_or(0, |last| last + 1)
    }

    /// F of each pair of rows.
    pub fn pair_activations(&self) -> impl Iterator<Item = Activation> {
        let quads = self.quads.blocks.iter().flat_map(|block| [block.activation; 2]);
        quads.chain(self.pairs.blocks.iter().map(|block| block.activation))
    }

    /// Rows: twice the number of pairs.
    pub fn n_rows(&self) -> usize {
        4 * self.quads.blocks.len() + 2 * self.pairs.blocks.len()
    }
}

/// What blocks are made from.
struct Wiring<'a> {
    network: &'a Network,
    phenotype: &'a Phenotype,
    /// Of each neuron: rows and weights of its synapses with neurons and with inputs.
    incoming: Vec<[BTreeMap<usize, f64>; 2]>,
}

impl<const N: usize> Blocks<N> {
    fn add(&mut self, wiring: &Wiring<'_>, activation: Activation, members: [Option<usize>; N]) {
        let Wiring { network, phenotype, incoming } = wiring;
        let [tau, gain, bias] = ["tau", "gain", "bias"].map(|name| &phenotype.neurons[name]);
        let (mut start, mut retention, mut drive) = ([0.0; N], [0.0; N], [0.0; N]);
        let mut couplings = [BTreeMap::new(), BTreeMap::new()];
        for (place, neuron) in members.into_iter().enumerate() {
            let Some(neuron) = neuron else { continue };
            let rate = network.dt / tau[neuron];
            let squash_scale = squash::scale(activation);
            let scale = squash_scale * gain[neuron];
            let bias_scale = if network.bias_in_gain { scale } else { squash_scale };
            start[place] = (bias_scale * bias[neuron]) as f32;
            retention[place] = (1.0 - rate) as f32;
            drive[place] = (rate * bias_scale * bias[neuron]) as f32;
            for (couplings, incoming) in couplings.iter_mut().zip(&incoming[neuron]) {
                for (&pre, weight) in incoming {
                    let weights = couplings.entry(pre).or_insert([0.0; N]);
                    weights[place] = (rate * scale * weight) as f32;
                }
            }
        }
        let [recurrent, afferent] = couplings;
        let recurrent = append(&mut self.recurrent, recurrent);
        let afferent = append(&mut self.afferent, afferent);
        self.blocks.push(Block { activation, start, retention, drive, recurrent, afferent });
    }
}

/// Adds couplings, given as rows and weights, and returns where they are.
fn append<const N: usize>(
    couplings: &mut Vec<Coupling<N>>,
    added: BTreeMap<usize, [f32; N]>,
) -> Range<usize> {
    let first = couplings.len();
    couplings.extend(added.into_iter().map(|(pre, weights)| Coupling { pre, weights }));
    first..couplings.len()
}

/// All neurons, in blocks of one activation function. It depends on the network's
/// structure alone.
struct Members {
    quads: Vec<(Activation, [usize; 4])>,
    pairs: Vec<(Activation, [Option<usize>; 2])>,
}

impl Members {
    /// Neighbours of an ensemble first, because they have most of their presynaptic
    /// neurons in common, then what ensembles have left over.
    fn of(network: &Network) -> Self {
        let (mut quads, mut pairs) = (Vec::new(), Vec::new());
        let mut left_over = [(Activation::Sigmoid, None), (Activation::Tanh, None)];
        for ensemble in network.ensembles.values() {
            // The reader gives every ensemble of rate neurons one.
            let function = ensemble.activation.unwrap_or_default();
            let neurons: Vec<usize> = ensemble.neurons.clone().collect();
            let (of_four, rest) = neurons.as_chunks();
            quads.extend(of_four.iter().map(|&members| (function, members)));
            let (of_two, rest) = rest.as_chunks();
            pairs.extend(of_two.iter().map(|&members: &[usize; 2]| (function, members.map(Some))));
            let [first] = *rest else { continue };
            for (activation, single) in &mut left_over {
                if *activation == function {
                    match single.take() {
                        None => *single = Some(first),
                        Some(other) => pairs.push((*activation, [Some(other), Some(first)])),
                    }
                }
            }
        }
        for (activation, single) in left_over {
            if single.is_some() {
                pairs.push((activation, [single, None]));
            }
        }
        Self { quads, pairs }
    }
}
