//! The order in which the synapses of a spiking network are computed: what of a
//! [`Kernel`](super::kernel::Kernel) depends on the network's structure alone.

use std::ops::Range;

use crate::network::connections::{Source, Synapse};

/// Synapses by what starts them or where they end.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    /// Synapses from stimuli, by postsynaptic neuron; a neuron's ascend by their input.
    pub afferent: Grouped,
    /// Synapses between neurons, by presynaptic neuron.
    pub outgoing: Grouped,
}

/// Synapses in groups.
#[derive(Debug, Clone)]
pub(crate) struct Grouped {
    /// Of each group: its members.
    pub groups: Vec<Range<usize>>,
    /// Group by group.
    pub members: Vec<Member>,
}

/// A synapse in its group.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Member {
    /// The side that the group does not have in common: an input or a neuron.
    pub other: usize,
    /// Number of the synapse.
    pub synapse: usize,
}

impl Wiring {
    /// Orders the synapses of `n_neurons` neurons.
    pub fn new(n_neurons: usize, synapses: &[Synapse]) -> Self {
        let mut afferent = vec![Vec::new(); n_neurons];
        let mut outgoing = vec![Vec::new(); n_neurons];
        for (number, &Synapse { pre, post }) in synapses.iter().enumerate() {
            match pre {
                Source::Input(input) => {
                    afferent[post].push(Member { other: input, synapse: number });
                }
                Source::Neuron(pre) => {
                    outgoing[pre].push(Member { other: post, synapse: number });
                }
            }
        }
        Self { afferent: Grouped::new(afferent), outgoing: Grouped::new(outgoing) }
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
