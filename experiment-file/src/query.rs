//! Queries: which parameters of the network a population's genes encode.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

/// Names a part of the network's parameters (Table 4.1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GenotypeQuery {
    /// `synapses:weights:...`
    Weights(SynapseSelector),
    /// `neurons:PARAMETER:...`
    Neurons(NeuronParameter, EnsembleSelector),
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

/// The middle part of `neurons:...:...`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NeuronParameter {
    /// beta
    Bias,
    /// tau, decoded on a logarithmic scale: 2 * 10^x.
    Tau,
    /// g
    Gain,
}

/// The last part of `neurons:...:...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EnsembleSelector {
    /// Every ensemble.
    All,
    /// One ensemble.
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

impl fmt::Display for NeuronParameter {
    /// As it stands in a query.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bias => "bias",
            Self::Tau => "tau",
            Self::Gain => "gain",
        })
    }
}

impl fmt::Display for GenotypeQuery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Weights(selector) => write!(f, "synapses:weights:{}", selector.as_str()),
            Self::Neurons(parameter, selector) => {
                write!(f, "neurons:{parameter}:{}", selector.as_str())
            }
        }
    }
}

/// A text that is no query.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseQueryError {
    /// It names something of the original simulator that this one lacks.
    #[error("not supported: `{0}`")]
    Unsupported(String),
    /// It has another form.
    #[error(
        "expected `synapses:weights:NAME` or `neurons:PARAMETER:NAME` with `bias`, `tau` or `gain`"
    )]
    Malformed,
}

impl FromStr for GenotypeQuery {
    type Err = ParseQueryError;

    /// Table 4.1; `gains` is another name of `gain`, as in section 4.3.
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
            ("neurons", "bias") => NeuronParameter::Bias,
            ("neurons", "tau") => NeuronParameter::Tau,
            ("neurons", "gain" | "gains") => NeuronParameter::Gain,
            ("synapses", "delays")
            | ("neurons", "decoding")
            | ("encoders" | "encoding" | "decoders" | "decoding", "weights") => {
                return Err(ParseQueryError::Unsupported(format!("{part}:{parameter}")));
            }
            _ => return Err(ParseQueryError::Malformed),
        };
        Ok(Self::Neurons(
            parameter,
            match selector {
                "all" => EnsembleSelector::All,
                name => EnsembleSelector::Named(name.to_owned()),
            },
        ))
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
        json_schema!({
            "description": "Names a part of the network's parameters (Table 4.1).",
            "type": "string",
            "pattern": "^(synapses:weights|neurons:(bias|tau|gains?)):.+$",
        })
    }
}
