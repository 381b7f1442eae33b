//! A network with its weights, in the order of computation.

use std::array;
use std::ops::Range;

use super::squash::{self, squash_in_one_lane};
use super::wiring::{WiredBlocks, WiredCoupling, Wiring};
use crate::network::{Network, Phenotype};
use determinism::Isa;
use experiment_file::{Activation, InitialRates};

/// The blocks of a [`Wiring`], with the values of a genotype.
#[derive(Debug)]
pub(super) struct Kernel {
    pub n_substeps: u32,
    pub quads: Blocks<4>,
    pub pairs: Blocks<2>,
    /// The same neurons one by one.
    pub rows: Vec<Row>,
    /// The synapses of `rows`, row by row.
    pub synapses: Vec<Synapse>,
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
    /// Contribution of the bias to y per substep.
    pub drive: [f32; N],
    /// Its synapses in `Blocks::recurrent`.
    pub recurrent: Range<usize>,
    /// Its synapses in `Blocks::afferent`.
    pub afferent: Range<usize>,
}

/// Synapses from one row to the neurons of a block. A block adds them up by ascending rows: the
/// order is part of the format of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling<const N: usize> {
    /// Row of the presynaptic neuron or input.
    pub pre: usize,
    /// Contribution to y per substep and unit of its activity; 0 without a synapse.
    pub weights: [f32; N],
}

/// A neuron, without the zeros of its block.
#[derive(Debug)]
pub(super) struct Row {
    /// F, the same for both rows of a pair.
    pub activation: Activation,
    /// Factor of y in a substep, 1 - r.
    pub retention: f32,
    /// Its synapses in `Kernel::synapses`, by ascending rows.
    pub synapses: Range<usize>,
}

/// A synapse between neurons.
#[derive(Debug, Clone, Copy)]
pub(super) struct Synapse {
    /// Row of the presynaptic neuron.
    pub pre: u32,
    /// Contribution to y per substep and unit of its activity.
    pub weight: f32,
}

impl Kernel {
    /// The kernel of a genotype.
    pub fn compile(network: &Network, wiring: &Wiring, phenotype: &Phenotype) -> Self {
        let mut kernel = Self {
            n_substeps: network.n_substeps,
            quads: Blocks::compile(network, &wiring.quads, phenotype),
            pairs: Blocks::compile(network, &wiring.pairs, phenotype),
            rows: Vec::new(),
            synapses: Vec::new(),
        };
        kernel.quads.list(&mut kernel.rows, &mut kernel.synapses);
        kernel.pairs.list(&mut kernel.rows, &mut kernel.synapses);
        kernel
    }

    /// y of each row at the start.
    pub fn starts(&self) -> impl Iterator<Item = f32> {
        let quads = self.quads.blocks.iter().flat_map(|block| block.start);
        quads.chain(self.pairs.blocks.iter().flat_map(|block| block.start))
    }

    /// u of each row at the start.
    pub fn start_rates(&self, initial_rates: InitialRates, isa: Isa) -> Vec<f32> {
        let starts: Vec<f32> = self.starts().collect();
        match initial_rates {
            InitialRates::Zero => vec![0.0; starts.len()],
            InitialRates::Activation => {
                let pairs = starts.as_chunks::<2>().0.iter().zip(self.pair_activations());
                pairs.flat_map(|(&y, function)| squash_in_one_lane(isa, function, y)).collect()
            }
        }
    }

    /// Number of inputs, up to the last one with a synapse.
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

    /// Number of rows: twice the number of pairs.
    pub fn n_rows(&self) -> usize {
        4 * self.quads.blocks.len() + 2 * self.pairs.blocks.len()
    }
}

impl<const N: usize> Blocks<N> {
    /// Adds the neurons one by one.
    fn list(&self, rows: &mut Vec<Row>, synapses: &mut Vec<Synapse>) {
        for block in &self.blocks {
            for place in 0..N {
                let first = synapses.len();
                for coupling in &self.recurrent[block.recurrent.clone()] {
                    let (pre, weight) = (coupling.pre as u32, coupling.weights[place]);
                    if weight != 0.0 {
                        synapses.push(Synapse { pre, weight });
                    }
                }
                rows.push(Row {
                    activation: block.activation,
                    retention: block.retention[place],
                    synapses: first..synapses.len(),
                });
            }
        }
    }

    fn compile(network: &Network, wired: &WiredBlocks<N>, phenotype: &Phenotype) -> Self {
        let [tau, gain, bias] = ["tau", "gain", "bias"].map(|name| &phenotype.neurons[name]);
        let mut kernel = Self {
            blocks: Vec::with_capacity(wired.blocks.len()),
            recurrent: Vec::with_capacity(wired.recurrent.len()),
            afferent: Vec::with_capacity(wired.afferent.len()),
        };
        for block in &wired.blocks {
            let (mut start, mut retention, mut drive) = ([0.0; N], [0.0; N], [0.0; N]);
            let mut weight_scales = [0.0; N];
            for (place, neuron) in block.neurons.into_iter().enumerate() {
                let Some(neuron) = neuron else { continue };
                let rate = network.dt / tau[neuron];
                let squash_scale = squash::scale(block.activation);
                let scale = squash_scale * gain[neuron];
                let bias_scale = if network.bias_in_gain { scale } else { squash_scale };
                start[place] = (bias_scale * bias[neuron]) as f32;
                retention[place] = (1.0 - rate) as f32;
                drive[place] = (rate * bias_scale * bias[neuron]) as f32;
                weight_scales[place] = rate * scale;
            }
            let weigh = |coupling: &WiredCoupling<N>| {
                let weight = |place: usize| match wired.synapses(coupling, place) {
                    [] => 0.0,
                    synapses => {
                        let weights = synapses.iter().map(|&synapse| phenotype.weights[synapse]);
                        (weight_scales[place] * weights.fold(0.0, |sum, weight| sum + weight))
                            as f32
                    }
                };
                Coupling { pre: coupling.pre, weights: array::from_fn(weight) }
            };
            let wired_recurrent = &wired.recurrent[block.recurrent.clone()];
            let wired_afferent = &wired.afferent[block.afferent.clone()];
            kernel.recurrent.extend(wired_recurrent.iter().map(weigh));
            kernel.afferent.extend(wired_afferent.iter().map(weigh));
            kernel.blocks.push(Block {
                activation: block.activation,
                start,
                retention,
                drive,
                recurrent: block.recurrent.clone(),
                afferent: block.afferent.clone(),
            });
        }
        kernel
    }
}
