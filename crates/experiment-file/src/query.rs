//! Queries: which parameters of the network a population's genes encode.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

use super::neuron::evolvable_parameters;

/// Names a part of the network's parameters (Table 4.1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GenotypeQuery {
    /// `synapses:weights:...`
    Weights(SynapseSelector),
    /// `neurons:PARAMETER:...`: the name of a parameter that evolves in some
    /// [`NeuronModel`](crate::NeuronModel).
    Neurons(&'static str, EnsembleSelector),
    /// `decoders:weights:...`
    Decoders(OutputSelector),
    /// `synapses:delays:...`: the axonal delays of neurons, and of nodes of encoders, with
    /// dynamic synapses.
    Delays(EnsembleSelector),
    /// `encoders:weights:...`
    Encoders(StimulusSelector),
    /// `learning:coefficients:...`: A, B, C and D of groups of synapses.
    Learning(GroupSelector),
}

/// The last part of `learning:coefficients:...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GroupSelector {
    /// Every plastic group of synapses.
    All,
    /// One group.
    Named(String),
}

impl GroupSelector {
    /// As it stands in a query.
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => "all",
            Self::Named(name) => name,
        }
    }
}

/// The last part of `encoders:weights:...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StimulusSelector {
    /// Every stimulus whose receptive field has weights.
    All,
    /// One stimulus.
    Named(String),
}

impl StimulusSelector {
    /// As it stands in a query.
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => "all",
            Self::Named(name) => name,
        }
    }
}

/// The last part of `decoders:weights:...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputSelector {
    /// Every output whose decoding has weights.
    All,
    /// One output.
    Named(String),
}

impl OutputSelector {
    /// As it stands in a query.
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => "all",
            Self::Named(name) => name,
        }
    }
}

/// The last part of `synapses:weights:...`. Kinds refer to the *presynaptic*
/// side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SynapseSelector {
    /// Every trainable synapse.
    All,
    /// From stimuli.
    Sensory,
    /// From ensembles that drive no output.
    Hidden,
    /// From ensembles that drive an output.
    Motor,
    /// From the ensemble (or stimulus) of this name, or in the synapse group of
    /// this name.
    Named(String),
}

/// The last part of `neurons:...:...` and of `synapses:delays:...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EnsembleSelector {
    /// Every ensemble; for delays, also every stimulus whose spikes have one.
    All,
    /// One ensemble; for delays, possibly a stimulus.
    Named(String),
}

impl SynapseSelector {
    /// As it stands in a query.
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => "all",
            Self::Sensory => "sensory",
            Self::Hidden => "hidden",
            Self::Motor => "motor",
            Self::Named(name) => name,
        }
    }
}

impl EnsembleSelector {
    /// As it stands in a query.
    pub fn as_str(&self) -> &str {
        match self {
            Self::All => "all",
            Self::Named(name) => name,
        }
    }
}

impl fmt::Display for GenotypeQuery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Weights(selector) => write!(f, "synapses:weights:{}", selector.as_str()),
            Self::Neurons(parameter, selector) => {
                write!(f, "neurons:{parameter}:{}", selector.as_str())
            }
            Self::Delays(selector) => write!(f, "synapses:delays:{}", selector.as_str()),
            Self::Decoders(selector) => write!(f, "decoders:weights:{}", selector.as_str()),
            Self::Encoders(selector) => write!(f, "encoders:weights:{}", selector.as_str()),
            Self::Learning(selector) => write!(f, "learning:coefficients:{}", selector.as_str()),
        }
    }
}

/// Why a text is not a query.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseQueryError {
    /// The text names a part of SpikeSwarmSim that this simulator lacks.
    #[error("not supported: `{0}`")]
    Unsupported(String),
    /// The text does not have the form of a query.
    #[error(
        "expected `synapses:weights:NAME`, `synapses:delays:NAME`, `encoders:weights:NAME`, \
         `decoders:weights:NAME`, `learning:coefficients:NAME` or `neurons:PARAMETER:NAME`, with a \
         parameter of the neuron model"
    )]
    Malformed,
}

impl FromStr for GenotypeQuery {
    type Err = ParseQueryError;

    /// Table 4.1, with the parameters of all neuron models.
    fn from_str(text: &str) -> Result<Self, ParseQueryError> {
        let mut parts = text.splitn(3, ':');
        let mut next = || parts.next().filter(|part| !part.is_empty());
        let (Some(part), Some(parameter), Some(selector)) = (next(), next(), next()) else {
            return Err(ParseQueryError::Malformed);
        };
        let parameter = match (part, parameter) {
            ("synapses", "weights") => {
                return Ok(Self::Weights(match selector {
                    "all" => SynapseSelector::All,
                    "sensory" => SynapseSelector::Sensory,
                    "hidden" => SynapseSelector::Hidden,
                    "motor" => SynapseSelector::Motor,
                    name => SynapseSelector::Named(name.to_owned()),
                }));
            }
            ("decoders" | "decoding", "weights") => {
                return Ok(Self::Decoders(match selector {
                    "all" => OutputSelector::All,
                    name => OutputSelector::Named(name.to_owned()),
                }));
            }
            ("synapses", "delays") => return Ok(Self::Delays(ensembles(selector))),
            ("encoders" | "encoding", "weights") => {
                return Ok(Self::Encoders(match selector {
                    "all" => StimulusSelector::All,
                    name => StimulusSelector::Named(name.to_owned()),
                }));
            }
            ("learning", "coefficients") => {
                return Ok(Self::Learning(match selector {
                    "all" => GroupSelector::All,
                    name => GroupSelector::Named(name.to_owned()),
                }));
            }
            ("neurons", "decoding") => {
                return Err(ParseQueryError::Unsupported(format!("{part}:{parameter}")));
            }
            ("neurons", name) => {
                let known = evolvable_parameters();
                let named = known.iter().find(|p| p.name() == name || p.aliases.contains(&name));
                named.ok_or(ParseQueryError::Malformed)?.name()
            }
            _ => return Err(ParseQueryError::Malformed),
        };
        Ok(Self::Neurons(parameter, ensembles(selector)))
    }
}

fn ensembles(selector: &str) -> EnsembleSelector {
    match selector {
        "all" => EnsembleSelector::All,
        name => EnsembleSelector::Named(name.to_owned()),
    }
}

impl Serialize for GenotypeQuery {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl JsonSchema for GenotypeQuery {
    fn schema_name() -> Cow<'static, str> {
        "GenotypeQuery".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let parameters = evolvable_parameters();
        let names = parameters.iter().flat_map(|p| [&[p.name()], p.aliases].concat());
        let names = names.collect::<Vec<_>>().join("|");
        json_schema!({
            "description": "Names a part of the network's parameters (Table 4.1).",
            "type": "string",
            "pattern": format!("^(synapses:(weights|delays)|(de|en)co(ders|ding):weights|learning:coefficients|neurons:({names})):.+$"),
        })
    }
}
