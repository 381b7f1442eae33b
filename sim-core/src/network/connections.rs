//! Draws the synapses of a network, once per experiment, from `topology.seed`.

use std::ops::Range;

use indexmap::IndexMap;

use super::{Ensemble, Stimulus};
use crate::problems::Problems;
use determinism::random::{Purpose, Stream};
use experiment_file::{Neurotransmitter, TopologyConfig};

/// The presynaptic side of a synapse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// Row of an input.
    Input(usize),
    /// Index of a neuron.
    Neuron(usize),
    /// Node of an encoder, among those of all encoders.
    Encoded(usize),
}

/// One synapse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Synapse {
    /// Presynaptic side.
    pub pre: Source,
    /// Postsynaptic neuron.
    pub post: usize,
}

/// A named group of synapses.
#[derive(Debug, Clone)]
pub(crate) struct SynapseGroup {
    /// Its synapses; they are numbered group by group.
    pub synapses: Range<usize>,
    /// Whether the genotype may hold its weights.
    pub trainable: bool,
    /// Whether its weights change while robots live.
    pub is_plastic: bool,
    /// The neurotransmitter of its spikes; `None` for static synapses.
    pub transmitter: Option<Neurotransmitter>,
}

/// Draws the synapses of all groups in the order of their numbers: by group, name of the
/// presynaptic side, name of the postsynaptic side, postsynaptic neuron, presynaptic neuron.
pub(super) fn draw(
    config: &TopologyConfig,
    stimuli: &IndexMap<String, Stimulus>,
    ensembles: &IndexMap<String, Ensemble>,
    problems: &mut Problems,
) -> (IndexMap<String, SynapseGroup>, Vec<Synapse>) {
    let mut groups = IndexMap::new();
    let mut synapses = Vec::new();
    for (index, (group_name, group)) in config.synapses.iter().enumerate() {
        let path = || format!("topology.synapses.{group_name}");
        let mut stream = Stream::new(config.seed, 0, 0, Purpose::Connections, index as u64);
        let first = synapses.len();
        for pre_name in &group.pre {
            let sources: Vec<Source> = match (stimuli.get(pre_name), ensembles.get(pre_name)) {
                (Some(stimulus), _) => match &stimulus.encoder {
                    None => stimulus.inputs.clone().map(Source::Input).collect(),
                    Some(encoder) => encoder.nodes.clone().map(Source::Encoded).collect(),
                },
                (None, Some(ensemble)) => ensemble.neurons.clone().map(Source::Neuron).collect(),
                (None, None) => {
                    problems.add(path(), format!("no stimulus or ensemble is named {pre_name:?}"));
                    continue;
                }
            };
            for post_name in &group.post {
                let Some(ensemble) = ensembles.get(post_name) else {
                    problems.add(path(), format!("no ensemble is named {post_name:?}"));
                    continue;
                };
                for post in ensemble.neurons.clone() {
                    let drawn = sources.iter().filter(|_| stream.bernoulli(group.p));
                    synapses.extend(drawn.map(|&pre| Synapse { pre, post }));
                }
            }
        }
        let synapses = first..synapses.len();
        let (trainable, transmitter) = (group.trainable, group.transmitter);
        let is_plastic =
            config.learning.as_ref().is_some_and(|learning| learning.synapses.contains(group_name));
        let group = SynapseGroup { synapses, trainable, is_plastic, transmitter };
        groups.insert(group_name.clone(), group);
    }
    (groups, synapses)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::Network;
    use crate::testing::experiment_a;

    fn problems_of(config: &TopologyConfig) -> usize {
        let mut problems = Problems::default();
        Network::compile(config, &mut problems);
        problems.check().map_or_else(|error| error.problems.len(), |()| 0)
    }

    #[test]
    fn full_groups_have_every_pair_in_order() {
        let network = Network::compile(&experiment_a().topology, &mut Problems::default());
        let group = &network.groups["I1-H1"];
        let expected: Vec<Synapse> = (0..10)
            .flat_map(|post| (0..2).map(move |pre| Synapse { pre: Source::Input(pre), post }))
            .collect();
        assert_eq!(network.synapses[group.synapses.clone()], expected);
    }

    #[test]
    fn sparse_groups_have_their_share_and_depend_on_the_seed() {
        let mut config = experiment_a().topology;
        config.ensembles["H1"].n = 100;
        let first = Network::compile(&config, &mut Problems::default());
        let n = first.groups["H1-H1"].synapses.len();
        assert!((6_800..7_200).contains(&n), "{n} of 10000");
        assert_eq!(Network::compile(&config, &mut Problems::default()).synapses, first.synapses);
        config.seed += 1;
        assert_ne!(Network::compile(&config, &mut Problems::default()).synapses, first.synapses);
    }

    #[test]
    fn unknown_names_are_problems() {
        let mut config = experiment_a().topology;
        assert_eq!(problems_of(&config), 0);
        config.synapses[0].pre.push("H3".into());
        config.synapses[1].post.push("I1".into());
        assert_eq!(problems_of(&config), 2);
    }
}
