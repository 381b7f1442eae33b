//! A spiking network with its values, in the order in which it is computed.

use std::marker::PhantomData;
use std::ops::Range;

use super::model::Model;
use super::receptors::Receptors;
use super::wiring::{Grouped, Wiring};
use crate::network::{Network, Phenotype};

/// The values of a genotype for a [`Wiring`], and its neurons by model M.
#[derive(Debug)]
pub(super) struct Kernel<M, const C: usize, const Z: usize> {
    pub n_substeps: u32,
    /// Per neuron.
    pub constants: Vec<[f32; C]>,
    /// Per neuron.
    pub starts: Vec<[f32; Z]>,
    /// Synapses from stimuli, by postsynaptic neuron.
    pub afferent: Weighted,
    /// Static synapses between neurons, by presynaptic neuron.
    pub outgoing: Weighted,
    /// Dynamic synapses between neurons; none if they are static.
    pub receptors: Option<Receptors>,
    /// Neurons that outputs decode, ascending.
    pub motor: Vec<usize>,
    /// What decoders filter spikes with.
    pub filter: Filter,
    model: PhantomData<M>,
}

/// Synapses in groups, with their weights.
#[derive(Debug)]
pub(super) struct Weighted {
    groups: Vec<Range<usize>>,
    /// The side that the group does not have in common, and the weight.
    members: Vec<(usize, f32)>,
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

impl<M: Model<C, Z>, const C: usize, const Z: usize> Kernel<M, C, Z> {
    /// The kernel of a genotype.
    pub fn compile(network: &Network, wiring: &Wiring, phenotype: &Phenotype) -> Self {
        let n_neurons = network.n_neurons();
        let of_neuron = |neuron: usize| move |name: &str| phenotype.neurons[name][neuron];
        let constants =
            (0..n_neurons).map(|i| M::constants(&of_neuron(i), network.dt).map(|x| x as f32));
        let starts = (0..n_neurons).map(|i| M::start(&of_neuron(i)).map(|x| x as f32));
        let motor = network.ensembles.values().filter(|ensemble| ensemble.motor);
        Self {
            n_substeps: network.n_substeps,
            constants: constants.collect(),
            starts: starts.collect(),
            afferent: Weighted::new(&wiring.afferent, phenotype),
            outgoing: Weighted::new(&wiring.outgoing, phenotype),
            receptors: network
                .receptors
                .map(|params| Receptors::new(params, wiring, phenotype, network.dt)),
            motor: motor.flat_map(|ensemble| ensemble.neurons.clone()).collect(),
            filter: Filter::new(network.dt),
            model: PhantomData,
        }
    }

    /// Number of neurons.
    pub fn n_neurons(&self) -> usize {
        self.constants.len()
    }
}

impl Weighted {
    pub fn new(grouped: &Grouped, phenotype: &Phenotype) -> Self {
        let weight = |number: usize| phenotype.weights[number] as f32;
        let members = grouped.members.iter().map(|member| (member.other, weight(member.synapse)));
        Self { groups: grouped.groups.clone(), members: members.collect() }
    }

    /// Synapses of a group.
    #[inline(always)]
    pub fn of(&self, group: usize) -> &[(usize, f32)] {
        &self.members[self.groups[group].clone()]
    }
}
