//! The order in which synapses of a spiking network are computed: the part of a
//! [`Circuit`](super::circuit::Circuit) that depends only on the network's structure.

use std::ops::Range;

use indexmap::IndexMap;

use crate::network::connections::{Source, Synapse, SynapseGroup};
use experiment_file::Neurotransmitter;

/// Synapses, grouped by their presynaptic or postsynaptic side.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    /// Synapses from stimuli, by postsynaptic neuron, and then by ascending input.
    pub afferent: Grouped,
    /// Static synapses from spike sources, by presynaptic side: neurons, then nodes of encoders.
    pub outgoing: Grouped,
    /// Dynamic synapses from spike sources, by postsynaptic neuron, one group for each
    /// [`Receptor`].
    pub receptive: [Grouped; 3],
}

/// The receptors of dynamic synapses, in the order of [`Wiring::receptive`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Receptor {
    Ampa,
    Gaba,
    Nmda,
}

/// Synapses in groups.
#[derive(Debug, Clone)]
pub(crate) struct Grouped {
    /// The range of each group's members.
    pub groups: Vec<Range<usize>>,
    /// The members, group by group.
    pub members: Vec<Member>,
}

/// A synapse in its group.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Member {
    /// The side that the group does not share: an input or a neuron; numbers after the last neuron
    /// are nodes of encoders.
    pub other: usize,
    /// Number of the synapse.
    pub synapse: usize,
}

impl Wiring {
    /// Orders the synapses of `n_neurons` neurons and `n_encoded` nodes of encoders.
    pub fn new(
        n_neurons: usize,
        n_encoded: usize,
        groups: &IndexMap<String, SynapseGroup>,
        synapses: &[Synapse],
    ) -> Self {
        let mut transmitters = vec![None; synapses.len()];
        for group in groups.values() {
            transmitters[group.synapses.clone()].fill(group.transmitter);
        }
        let mut receptive = [(); 3].map(|()| vec![Vec::new(); n_neurons]);
        let mut afferent = vec![Vec::new(); n_neurons];
        let mut outgoing = vec![Vec::new(); n_neurons + n_encoded];
        for (number, &Synapse { pre, post }) in synapses.iter().enumerate() {
            let pre = match pre {
                Source::Input(input) => {
                    afferent[post].push(Member { other: input, synapse: number });
                    continue;
                }
                Source::Neuron(neuron) => neuron,
                Source::Encoded(node) => n_neurons + node,
            };
            match transmitters[number] {
                None => outgoing[pre].push(Member { other: post, synapse: number }),
                Some(transmitter) => {
                    for &receptor in opened_by(transmitter) {
                        let member = Member { other: pre, synapse: number };
                        receptive[receptor as usize][post].push(member);
                    }
                }
            }
        }
        Self {
            afferent: Grouped::new(afferent),
            outgoing: Grouped::new(outgoing),
            receptive: receptive.map(Grouped::new),
        }
    }
}

fn opened_by(transmitter: Neurotransmitter) -> &'static [Receptor] {
    match transmitter {
        Neurotransmitter::Ampa => &[Receptor::Ampa],
        Neurotransmitter::AmpaNmda => &[Receptor::Ampa, Receptor::Nmda],
        Neurotransmitter::Gaba => &[Receptor::Gaba],
    }
}

impl Grouped {
    fn new(groups: Vec<Vec<Member>>) -> Self {
        let mut members = Vec::new();
        let groups = groups.into_iter().map(|mut group| {
            group.sort_by_key(|member| (member.other, member.synapse));
            let first = members.len();
            members.append(&mut group);
            first..members.len()
        });
        let groups = groups.collect();
        Self { groups, members }
    }
}
