//! Assigns the parts of the network to the queries of the genotype.

use std::fmt;

use crate::report::{Path, Report, suggestion};
use crate::{
    EnsembleSelector, GenotypeQuery, GroupSelector, OutputSelector, StimulusSelector,
    SynapseGroupConfig, SynapseModel, SynapseSelector, TopologyConfig,
};

/// The evolvable parts of a network, and the query that covers each.
pub(super) struct ParameterCoverage<'a> {
    topology: &'a TopologyConfig,
    parts: Vec<Part<'a>>,
}

struct Part<'a> {
    kind: PartKind<'a>,
    /// The query that covers the part, and the query's population.
    owner: Option<(&'a GenotypeQuery, &'a str)>,
}

/// A part of the network that a query covers completely or not at all.
#[derive(Clone, Copy)]
enum PartKind<'a> {
    /// The weights of the synapses of a group that start from `pre`.
    Weights { group: &'a str, pre: &'a str, source: Source },
    /// A parameter of an ensemble's neurons.
    Neurons { parameter: &'static str, ensemble: &'a str },
    /// The axonal delays of an ensemble or of an encoded stimulus.
    Delays { source: &'a str },
    /// The weights of a stimulus's receptive field.
    Encoder { stimulus: &'a str },
    /// The coefficients by which a group's weights change.
    Learning { group: &'a str },
    /// The weights of an output's decoding.
    Decoder { output: &'a str },
}

#[derive(Clone, Copy, PartialEq)]
enum Source {
    Sensory,
    Hidden,
    Motor,
}

impl<'a> ParameterCoverage<'a> {
    pub(super) fn new(topology: &'a TopologyConfig) -> Self {
        let source = |name: &str| {
            if topology.stimuli.contains_key(name) {
                Source::Sensory
            } else if topology.outputs.values().any(|output| output.ensemble == name) {
                Source::Motor
            } else {
                Source::Hidden
            }
        };
        let evolvable = |config: &SynapseGroupConfig| config.trainable && config.p > 0.0;
        let groups = topology.synapses.iter().filter(|(_, config)| evolvable(config));
        let weights = groups.flat_map(|(group, config)| {
            let pre = config.pre.iter();
            pre.map(move |pre| PartKind::Weights { group, pre, source: source(pre) })
        });
        let neurons = topology.ensembles.keys().flat_map(|ensemble| {
            let parameters = topology.neuron_model.spec().evolvable();
            parameters.map(move |p| PartKind::Neurons { parameter: p.name(), ensemble })
        });
        let weighted = topology.decoding.iter().filter(|(_, decoding)| decoding.n_weights(1) > 0);
        let decoders = weighted.map(|(output, _)| PartKind::Decoder { output });
        let is_dynamic = topology.synapse_model == SynapseModel::Dynamic;
        let delayed = topology.ensembles.keys().chain(topology.encoding.keys());
        let delays = delayed.filter(|_| is_dynamic).map(|source| PartKind::Delays { source });
        let weighted = topology.encoding.iter();
        let weighted = weighted.filter(|(_, encoding)| encoding.receptive_field.n_weights(1) > 0);
        let encoders = weighted.map(|(stimulus, _)| PartKind::Encoder { stimulus });
        let plastic = topology.learning.iter().flat_map(|learning| &learning.synapses);
        let learning = plastic.map(|group| PartKind::Learning { group });
        let kinds = weights.chain(neurons).chain(delays).chain(encoders);
        let kinds = kinds.chain(learning).chain(decoders);
        let parts = kinds.map(|kind| Part { kind, owner: None }).collect();
        Self { topology, parts }
    }

    /// Assigns to `query` the parts that it names; reports conflicts.
    pub(super) fn claim(
        &mut self,
        query: &'a GenotypeQuery,
        population: &'a str,
        path: &Path,
        report: &Report<'_>,
    ) {
        let part = |key| Path::from(["topology", key]);
        let [stimuli, ensembles, synapses, outputs] =
            ["stimuli", "ensembles", "synapses", "outputs"].map(|map| part(map).keys());
        if self.n_meanings(query) != 1 {
            let others = [&stimuli, &ensembles, &synapses, &outputs];
            return report.conflict(path, &others, || self.explain(query));
        }
        let others = match query {
            GenotypeQuery::Neurons(..) => vec![ensembles, part("neuron_model"), part("neurons")],
            GenotypeQuery::Delays(_) => vec![ensembles, part("encoding"), part("synapse_model")],
            GenotypeQuery::Encoders(_) => vec![stimuli, part("encoding")],
            GenotypeQuery::Learning(_) => vec![synapses, part("learning")],
            GenotypeQuery::Weights(_) => vec![stimuli, part("synapses"), part("outputs")],
            GenotypeQuery::Decoders(_) => vec![outputs, part("decoding")],
        };
        let others: Vec<&Path> = others.iter().collect();
        let (mut matches, mut taken) = (false, None);
        for part in self.parts.iter_mut().filter(|part| part.kind.is_selected_by(query)) {
            matches = true;
            match part.owner {
                None => part.owner = Some((query, population)),
                Some(owner) => taken = taken.or(Some((part.kind, owner))),
            }
        }
        if let Some((part, (other, population))) = taken {
            report.conflict(path, &others, || {
                format!("covers {part} a second time, after `{other}` of population `{population}`")
            });
        } else if !matches {
            report.conflict(path, &others, "covers nothing that can evolve");
        }
    }

    /// Number of possible meanings of the last part of `query`.
    fn n_meanings(&self, query: &GenotypeQuery) -> usize {
        let TopologyConfig { stimuli, encoding, ensembles, synapses, .. } = self.topology;
        match query {
            GenotypeQuery::Neurons(_, EnsembleSelector::Named(name)) => {
                usize::from(ensembles.contains_key(name))
            }
            GenotypeQuery::Delays(EnsembleSelector::Named(name)) => {
                usize::from(ensembles.contains_key(name) || encoding.contains_key(name))
            }
            GenotypeQuery::Encoders(StimulusSelector::Named(name)) => {
                usize::from(stimuli.contains_key(name))
            }
            GenotypeQuery::Weights(SynapseSelector::Named(name)) => {
                let is_source = ensembles.contains_key(name) || stimuli.contains_key(name);
                usize::from(is_source) + usize::from(synapses.contains_key(name))
            }
            GenotypeQuery::Learning(GroupSelector::Named(name)) => {
                usize::from(synapses.contains_key(name))
            }
            GenotypeQuery::Decoders(OutputSelector::Named(name)) => {
                usize::from(self.topology.outputs.contains_key(name))
            }
            _ => 1,
        }
    }

    /// Why the last part of `query` does not have exactly one meaning.
    fn explain(&self, query: &GenotypeQuery) -> String {
        let TopologyConfig { stimuli, ensembles, synapses, .. } = self.topology;
        let (name, what, known): (&str, &str, Vec<&String>) = match query {
            GenotypeQuery::Neurons(_, selector) => {
                (selector.as_str(), "ensemble", ensembles.keys().collect())
            }
            GenotypeQuery::Delays(selector) => {
                let known = ensembles.keys().chain(self.topology.encoding.keys());
                (selector.as_str(), "ensemble or encoded stimulus", known.collect())
            }
            GenotypeQuery::Encoders(selector) => {
                (selector.as_str(), "stimulus", stimuli.keys().collect())
            }
            GenotypeQuery::Weights(selector) => {
                let known = ensembles.keys().chain(stimuli.keys()).chain(synapses.keys());
                (selector.as_str(), "ensemble, stimulus or synapse group", known.collect())
            }
            GenotypeQuery::Learning(selector) => {
                (selector.as_str(), "synapse group", synapses.keys().collect())
            }
            GenotypeQuery::Decoders(selector) => {
                (selector.as_str(), "output", self.topology.outputs.keys().collect())
            }
        };
        if self.n_meanings(query) > 1 {
            format!("ambiguous: `{name}` is a synapse group, and an ensemble or stimulus")
        } else {
            format!("no {what} is named `{name}`; {}", suggestion(name, &known))
        }
    }
}

impl PartKind<'_> {
    fn is_selected_by(&self, query: &GenotypeQuery) -> bool {
        match (self, query) {
            (Self::Weights { group, pre, source }, GenotypeQuery::Weights(selector)) => {
                match selector {
                    SynapseSelector::All => true,
                    SynapseSelector::Sensory => *source == Source::Sensory,
                    SynapseSelector::Hidden => *source == Source::Hidden,
                    SynapseSelector::Motor => *source == Source::Motor,
                    SynapseSelector::Named(name) => name == group || name == pre,
                }
            }
            (Self::Neurons { parameter, ensemble }, GenotypeQuery::Neurons(queried, selector)) => {
                parameter == queried
                    && match selector {
                        EnsembleSelector::All => true,
                        EnsembleSelector::Named(name) => name == ensemble,
                    }
            }
            (Self::Delays { source }, GenotypeQuery::Delays(selector)) => match selector {
                EnsembleSelector::All => true,
                EnsembleSelector::Named(name) => name == source,
            },
            (Self::Encoder { stimulus }, GenotypeQuery::Encoders(selector)) => match selector {
                StimulusSelector::All => true,
                StimulusSelector::Named(name) => name == stimulus,
            },
            (Self::Learning { group }, GenotypeQuery::Learning(selector)) => match selector {
                GroupSelector::All => true,
                GroupSelector::Named(name) => name == group,
            },
            (Self::Decoder { output }, GenotypeQuery::Decoders(selector)) => match selector {
                OutputSelector::All => true,
                OutputSelector::Named(name) => name == output,
            },
            _ => false,
        }
    }
}

impl fmt::Display for PartKind<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Weights { group, pre, .. } => {
                write!(f, "the weights of group `{group}` from `{pre}`")
            }
            Self::Neurons { parameter, ensemble } => {
                write!(f, "the {parameter} of ensemble `{ensemble}`")
            }
            Self::Delays { source } => write!(f, "the delays of `{source}`"),
            Self::Encoder { stimulus } => {
                write!(f, "the weights of the receptive field of `{stimulus}`")
            }
            Self::Learning { group } => {
                write!(f, "the learning coefficients of group `{group}`")
            }
            Self::Decoder { output } => write!(f, "the weights of the decoding of `{output}`"),
        }
    }
}
