//! The order of a network's computation: the part of a [`Kernel`](super::kernel::Kernel) that
//! depends only on the network's structure, and that all genotypes share.

use std::array;
use std::collections::BTreeMap;
use std::ops::Range;

use indexmap::IndexMap;

use crate::network::Ensemble;
use crate::network::connections::{Source, Synapse};
use experiment_file::Activation;

/// Neurons in blocks of four, and the remaining neurons of the ensembles in blocks of two. A
/// neuron's row is its position, blocks of four first. Rows 2k and 2k+1 are a pair, which shares a
/// division.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    /// Row of each neuron.
    pub rows: Vec<usize>,
    pub quads: WiredBlocks<4>,
    pub pairs: WiredBlocks<2>,
}

/// Blocks of N neurons, and their synapses, block by block.
#[derive(Debug, Clone, Default)]
pub(crate) struct WiredBlocks<const N: usize> {
    pub blocks: Vec<WiredBlock<N>>,
    /// Synapses between neurons.
    pub recurrent: Vec<WiredCoupling<N>>,
    /// Synapses from inputs.
    pub afferent: Vec<WiredCoupling<N>>,
    /// Numbers of synapses; those between the same neurons are adjacent.
    synapses: Vec<usize>,
}

/// N neurons of one activation function.
#[derive(Debug, Clone)]
pub(crate) struct WiredBlock<const N: usize> {
    /// F
    pub activation: Activation,
    /// Its neurons; the last block of a function may have an empty place.
    pub neurons: [Option<usize>; N],
    /// Its synapses in `WiredBlocks::recurrent`.
    pub recurrent: Range<usize>,
    /// Its synapses in `WiredBlocks::afferent`.
    pub afferent: Range<usize>,
}

/// Synapses from one row to the neurons of a block. A block has its couplings by ascending rows.
#[derive(Debug, Clone)]
pub(crate) struct WiredCoupling<const N: usize> {
    /// Row of the presynaptic neuron or input.
    pub pre: usize,
    /// The range of each neuron's synapses in `WiredBlocks::synapses`.
    synapses: [Range<usize>; N],
}

/// Numbers of a neuron's synapses by their presynaptic row; there may be several per row, from
/// several groups.
type Incoming = BTreeMap<usize, Vec<usize>>;

impl Wiring {
    /// Orders a network.
    pub fn new(ensembles: &IndexMap<String, Ensemble>, synapses: &[Synapse]) -> Self {
        let Members { quads, pairs } = Members::from_ensembles(ensembles);
        let quad_rows = quads.iter().flat_map(|(_, members)| members);
        let pair_rows = pairs.iter().flat_map(|(_, members)| members);
        let n_neurons = ensembles.values().last().map_or(0, |ensemble| ensemble.neurons.end);
        let mut rows = vec![0; n_neurons];
        for (row, neuron) in quad_rows.chain(pair_rows).enumerate() {
            if let Some(neuron) = *neuron {
                rows[neuron] = row;
            }
        }
        let mut incoming = vec![[Incoming::new(), Incoming::new()]; n_neurons];
        for (number, synapse) in synapses.iter().enumerate() {
            let [recurrent, afferent] = &mut incoming[synapse.post];
            let same = match synapse.pre {
                Source::Neuron(pre) => recurrent.entry(rows[pre]),
                Source::Input(pre) => afferent.entry(pre),
                // The reader guarantees that only spiking neurons take spikes.
                Source::Encoded(_) => continue,
            };
            same.or_default().push(number);
        }
        let (mut wired_quads, mut wired_pairs) = (WiredBlocks::default(), WiredBlocks::default());
        for (activation, members) in quads {
            wired_quads.add(&incoming, activation, members);
        }
        for (activation, members) in pairs {
            wired_pairs.add(&incoming, activation, members);
        }
        Self { rows, quads: wired_quads, pairs: wired_pairs }
    }
}

impl<const N: usize> WiredBlocks<N> {
    /// Numbers of the synapses at a place of a coupling, ascending; may be empty.
    #[inline(always)]
    pub fn synapses(&self, coupling: &WiredCoupling<N>, place: usize) -> &[usize] {
        &self.synapses[coupling.synapses[place].clone()]
    }

    fn add(
        &mut self,
        incoming: &[[Incoming; 2]],
        activation: Activation,
        neurons: [Option<usize>; N],
    ) {
        let mut couplings = [BTreeMap::new(), BTreeMap::new()];
        for (place, neuron) in neurons.into_iter().enumerate() {
            let Some(neuron) = neuron else { continue };
            for (couplings, incoming) in couplings.iter_mut().zip(&incoming[neuron]) {
                for (&pre, synapses) in incoming {
                    let first = self.synapses.len();
                    self.synapses.extend(synapses);
                    let places = couplings.entry(pre).or_insert_with(|| array::from_fn(|_| 0..0));
                    places[place] = first..self.synapses.len();
                }
            }
        }
        let [recurrent, afferent] = couplings;
        let recurrent = append(&mut self.recurrent, recurrent);
        let afferent = append(&mut self.afferent, afferent);
        self.blocks.push(WiredBlock { activation, neurons, recurrent, afferent });
    }
}

/// Adds couplings, given as rows and synapses, and returns their range.
fn append<const N: usize>(
    couplings: &mut Vec<WiredCoupling<N>>,
    added: BTreeMap<usize, [Range<usize>; N]>,
) -> Range<usize> {
    let first = couplings.len();
    couplings.extend(added.into_iter().map(|(pre, synapses)| WiredCoupling { pre, synapses }));
    first..couplings.len()
}

/// All neurons, in blocks of one activation function.
struct Members {
    quads: Vec<(Activation, [Option<usize>; 4])>,
    pairs: Vec<(Activation, [Option<usize>; 2])>,
}

impl Members {
    /// First joins neighbours within an ensemble, because they share most of their presynaptic
    /// neurons, and then the remaining neurons of all ensembles.
    fn from_ensembles(ensembles: &IndexMap<String, Ensemble>) -> Self {
        let (mut quads, mut pairs) = (Vec::new(), Vec::new());
        let mut left_over = [(Activation::Sigmoid, None), (Activation::Tanh, None)];
        for ensemble in ensembles.values() {
            // The reader gives every ensemble of rate neurons an activation function.
            let function = ensemble.activation.unwrap_or_default();
            let neurons: Vec<usize> = ensemble.neurons.clone().collect();
            let (of_four, rest) = neurons.as_chunks();
            quads.extend(of_four.iter().map(|&members: &[usize; 4]| (function, members.map(Some))));
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
