//! A spiking network with its values, in the order of computation; [`neurons`](super::neurons)
//! computes the neurons themselves.

use std::{collections::BTreeSet, ops::Range};

use determinism::simd::Simd;

use super::super::learning::Rule;
use super::encoding::Encoders;
use super::receptors::Receptors;
use super::row::Row;
use super::wiring::{Grouped, Wiring};
use crate::network::{
    Network, Phenotype,
    decoding::{Decoder, Output},
};

/// The values of a genotype for a [`Wiring`].
#[derive(Debug)]
pub(super) struct Circuit {
    pub n_neurons: usize,
    pub n_substeps: u32,
    /// The encoders, which turn stimuli into spikes.
    pub encoders: Encoders,
    /// Synapses from stimuli without an encoder, by postsynaptic neuron.
    pub afferent: Weighted,
    /// Static synapses from spike sources, by presynaptic side: neurons, then nodes of encoders.
    pub outgoing: Weighted,
    /// Dynamic synapses from spike sources; `None` if the synapses are static.
    pub receptors: Option<Receptors>,
    /// The learning rule; `None` without plasticity.
    pub rule: Option<Rule>,
    /// Neurons whose decoders need the first spike, and the number of spikes, ascending.
    pub timed: Vec<usize>,
    /// Neurons whose decoders need filtered spikes, ascending.
    pub filtered: Vec<usize>,
    /// The filter of spikes for decoders.
    pub filter: Filter,
}

/// Synapses in groups, with their weights.
#[derive(Debug)]
pub(super) struct Weighted {
    groups: Vec<Range<usize>>,
    /// Of each synapse, the side that its group does not share, and the weight.
    members: Vec<(u32, f32)>,
    /// The number of each synapse.
    numbers: Vec<usize>,
}

/// x = 1 on a spike, else x *= `retention`; a += `rise` x (1 - a) - `decay` a.
#[derive(Debug, Clone, Copy)]
pub(super) struct Filter {
    pub retention: f32,
    pub rise: f32,
    pub decay: f32,
}

impl Filter {
    /// Time constants, ms.
    const TAU_RISE: f64 = 5.0;
    const TAU_DECAY: f64 = 30.0;

    fn new(dt: f64) -> Self {
        Self {
            retention: (1.0 - dt / Self::TAU_RISE) as f32,
            rise: (0.5 * dt) as f32,
            decay: (dt / Self::TAU_DECAY) as f32,
        }
    }
}

impl Circuit {
    /// The circuit of a genotype.
    pub fn compile(network: &Network, wiring: &Wiring, phenotype: &Phenotype) -> Self {
        let is_filtered =
            |output: &&Output| matches!(output.decoder, Decoder::LinearPopulation { .. });
        let (filtered, timed) = network.outputs.iter().partition(is_filtered);
        Self {
            n_neurons: network.n_neurons(),
            n_substeps: network.n_substeps,
            encoders: Encoders::compile(network, phenotype),
            afferent: Weighted::new(&wiring.afferent, phenotype),
            outgoing: Weighted::new(&wiring.outgoing, phenotype),
            receptors: network
                .receptors
                .map(|params| Receptors::new(params, wiring, phenotype, network.dt)),
            rule: Rule::compile(network, phenotype),
            timed: neurons_of(timed),
            filtered: neurons_of(filtered),
            filter: Filter::new(network.dt),
        }
    }

    /// Number of spike sources: neurons and nodes of encoders.
    pub fn n_sources(&self) -> usize {
        self.n_neurons + self.encoders.n_nodes()
    }
}

/// The neurons of outputs, ascending, each once.
fn neurons_of(outputs: Vec<&Output>) -> Vec<usize> {
    let neurons: BTreeSet<usize> =
        outputs.into_iter().flat_map(|output| output.neurons.clone()).collect();
    neurons.into_iter().collect()
}

impl Weighted {
    pub fn new(grouped: &Grouped, phenotype: &Phenotype) -> Self {
        let weight = |number: usize| phenotype.weights[number] as f32;
        let members =
            grouped.members.iter().map(|member| (member.other as u32, weight(member.synapse)));
        let numbers = grouped.members.iter().map(|member| member.synapse).collect();
        Self { groups: grouped.groups.clone(), members: members.collect(), numbers }
    }

    /// Synapses of a group.
    #[inline(always)]
    pub fn synapses_of(&self, group: usize) -> &[(u32, f32)] {
        &self.members[self.groups[group].clone()]
    }

    /// Numbers of the synapses of a group.
    #[inline(always)]
    pub fn numbers_of(&self, group: usize) -> &[usize] {
        &self.numbers[self.groups[group].clone()]
    }
}

/// The weight of a synapse in W vectors of lanes: the shared weight, or with PLASTIC the present
/// weight of each lane, `[synapse]`.
#[inline(always)]
pub(super) fn weight<S: Simd, const W: usize, const PLASTIC: bool>(
    simd: S,
    shared: f32,
    number: usize,
    plastic: &[[S::f32s; W]],
) -> Row<S, W> {
    if PLASTIC { Row::new(simd, plastic[number]) } else { Row::splat(simd, shared) }
}
