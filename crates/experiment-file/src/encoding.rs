//! How stimuli become spikes: receptive fields, and the encoders behind them.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{limits, schema};
use crate::parameters::{kinds, parameters};
use crate::{DefaultValue, Domain};

/// How a stimulus becomes spikes: each of its values passes a receptive field, whose nodes spike.
/// Only spiking neurons take encoders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("receptive_field"))]
pub struct EncodingConfig {
    /// How a node's value becomes spikes.
    pub scheme: EncodingScheme,
    /// How values of the stimulus become values of nodes; default
    /// `gaussian_receptive_field`.
    pub receptive_field: ReceptiveField,
}

/// How the value x of a node becomes spikes; a substep counts as 1 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum EncodingScheme {
    /// A LIF neuron with its default parameters gets x as its current. It spikes for x above
    /// 15 only, so state `max_val`.
    #[serde(rename = "LIF_Encoding")]
    Lif,
    /// Survival s -= 0.001 (x / 10) s per substep; a spike with probability 1 - s, then
    /// s = 1. x is cut to the range from 0 to 10,000.
    #[serde(rename = "PoissonRateCoding")]
    PoissonRate,
    /// One spike per environment step, in substep x rounded down, where the first substep is 1
    /// (Thorpe and Gautrais 1998). x is cut to the range from 1 to `time_scale`, and there must be
    /// at least as many substeps as nodes.
    #[serde(rename = "RankOrderCoding")]
    RankOrder,
}

kinds! {
    /// How the values s of a stimulus become values of nodes. With the distance d from s to the
    /// node's centre and the formula x of the field, a node has the value x (max_val - min_val) +
    /// min_val. The identity and the linear field have no centres and no such scale.
    #[derive(Copy)]
    pub enum ReceptiveField by "name" then receptive_fields {
        /// s itself, one node per value.
        Identity {} = "identity_receptive_field",
        /// x = exp(-sigma d^2). The default if a file names no field.
        Gaussian(GaussianField) = "gaussian_receptive_field",
        /// x = 1 - slope |d|, at least 0.
        Triangular(SlopedField) = "triangular_receptive_field",
        /// The same as `triangular_receptive_field`.
        Conic(SlopedField) = "conic_receptive_field",
        /// x = 1 - slope d^2, at least 0.
        Parabolic(SlopedField) = "parabolic_receptive_field",
        /// `n_neurons` nodes for the whole stimulus, each a weighted sum of its values. Weights can
        /// evolve (`encoders:weights:NAME`). Other weights are exp(-|i - c|), with i the number of
        /// the value from 0, and centres c spaced evenly from 0 to the number of values.
        Linear(LinearField) = "linear_receptive_field",
    }
}

/// The field if a file names none.
pub(super) const DEFAULT_FIELD: &str = "gaussian_receptive_field";

const VALUE: [f64; 2] = [-limits::FIELD_VALUE, limits::FIELD_VALUE];
const MIN_VAL: DefaultValue = DefaultValue::Depends("0, of `RankOrderCoding` 1");
const MAX_VAL: DefaultValue = DefaultValue::Depends("1, of `RankOrderCoding` `time_scale`");

parameters! {
    /// A field with the shape of a bell.
    #[derive(Copy)]
    pub struct GaussianField {
        /// Factor of d^2.
        sigma: f64 = between([0.0, limits::STEEPNESS], 6.0),
        /// Nodes for each value of the stimulus.
        n_neurons: u32 = whole([1, limits::FIELD_NODES], 1),
        /// Centre of the first node, or of a single node.
        min_stim: f64 = between(VALUE, 0.0),
        /// Centre of the last node, if there are two or more. The other centres are evenly between.
        max_stim: f64 = between(VALUE, 1.0),
        /// Value of a node far from its centre.
        min_val: f64 = of(Domain::Between(VALUE[0], VALUE[1]), MIN_VAL),
        /// Value of a node at its centre.
        max_val: f64 = of(Domain::Between(VALUE[0], VALUE[1]), MAX_VAL),
        /// Whether 1 - x takes the place of x: `min_val` is at the centre, `max_val` far from it.
        inverted: bool = switch(false),
    }

    /// A field that falls to zero at a finite distance.
    #[derive(Copy)]
    pub struct SlopedField {
        /// Factor of the distance d, or of its square.
        slope: f64 = between([0.0, limits::STEEPNESS], 5.0),
        /// Nodes for each value of the stimulus.
        n_neurons: u32 = whole([1, limits::FIELD_NODES], 1),
        /// Centre of the first node, or of a single node.
        min_stim: f64 = between(VALUE, 0.0),
        /// Centre of the last node, if there are two or more. The other centres are evenly between.
        max_stim: f64 = between(VALUE, 1.0),
        /// Value of a node far from its centre.
        min_val: f64 = of(Domain::Between(VALUE[0], VALUE[1]), MIN_VAL),
        /// Value of a node at its centre.
        max_val: f64 = of(Domain::Between(VALUE[0], VALUE[1]), MAX_VAL),
        /// Whether 1 - x takes the place of x: `min_val` is at the centre, `max_val` far from it.
        inverted: bool = switch(false),
    }

    /// A field whose weights can evolve. A weight that no query covers is exp(-|i - c|), with i the
    /// number of the value, and centres c spaced evenly from 0 to the number of values.
    #[derive(Copy)]
    pub struct LinearField {
        /// Nodes for the whole stimulus.
        n_neurons: u32 = whole([1, limits::FIELD_NODES], 1),
    }
}

/// The common form of fields with centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialField {
    /// Value at a distance d from the centre, between 0 and 1.
    pub shape: RadialShape,
    /// The steepness: `sigma` or `slope`.
    pub steepness: f64,
    /// Nodes per value.
    pub n_neurons: u32,
    /// First and last centre.
    pub centres: [f64; 2],
    /// Values for 0 and 1 of the shape, before `inverted`.
    pub values: [f64; 2],
    /// Whether 1 - shape replaces the shape.
    pub inverted: bool,
}

/// Value of a field at a distance d from its centre, k being its steepness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RadialShape {
    /// exp(-k d^2)
    Bell,
    /// max(1 - k |d|, 0)
    Cone,
    /// max(1 - k d^2, 0)
    Parabola,
}

impl RadialField {
    /// Centre of a node among those of a value.
    pub fn centre(&self, node: u32) -> f64 {
        let [first, last] = self.centres;
        let n_gaps = f64::from(self.n_neurons.max(2) - 1);
        first + (last - first) * f64::from(node) / n_gaps
    }
}

impl ReceptiveField {
    /// The field in the common form of fields with centres; `None` for the identity and the
    /// linear field.
    pub fn radial(&self) -> Option<RadialField> {
        let (shape, field) = match *self {
            Self::Identity {} | Self::Linear(_) => return None,
            Self::Gaussian(field) => return Some(field.radial()),
            Self::Triangular(field) | Self::Conic(field) => (RadialShape::Cone, field),
            Self::Parabolic(field) => (RadialShape::Parabola, field),
        };
        Some(field.radial(shape))
    }

    /// Number of nodes of a stimulus with `n` values.
    pub fn n_nodes(&self, n: u32) -> u32 {
        match self {
            Self::Identity {} => n,
            Self::Linear(field) => field.n_neurons,
            _ => n * self.radial().map_or(1, |field| field.n_neurons),
        }
    }

    /// Number of weights that can evolve, for a stimulus with `n` values; they are ordered node
    /// by node.
    pub fn n_weights(&self, n: u32) -> u32 {
        match self {
            Self::Linear(field) => field.n_neurons * n,
            _ => 0,
        }
    }
}

impl GaussianField {
    fn radial(self) -> RadialField {
        let Self { sigma, n_neurons, min_stim, max_stim, min_val, max_val, inverted } = self;
        RadialField {
            shape: RadialShape::Bell,
            steepness: sigma,
            n_neurons,
            centres: [min_stim, max_stim],
            values: [min_val, max_val],
            inverted,
        }
    }
}

impl SlopedField {
    fn radial(self, shape: RadialShape) -> RadialField {
        let Self { slope, n_neurons, min_stim, max_stim, min_val, max_val, inverted } = self;
        RadialField {
            shape,
            steepness: slope,
            n_neurons,
            centres: [min_stim, max_stim],
            values: [min_val, max_val],
            inverted,
        }
    }
}

impl LinearField {
    /// Default weight of value `value` in the sum of node `node`, for a stimulus with `n` values.
    pub fn default_weight(&self, node: u32, value: u32, n: u32) -> f64 {
        let n_gaps = f64::from(self.n_neurons.max(2) - 1);
        let centre = f64::from(n) * f64::from(node) / n_gaps;
        libm::exp(-libm::fabs(f64::from(value) - centre))
    }
}

/// Makes `name` optional for the default field.
fn receptive_fields(schema: &mut Schema) {
    let variants = schema.get_mut("oneOf").and_then(Value::as_array_mut);
    for variant in variants.into_iter().flatten() {
        if variant["properties"]["name"]["const"] == DEFAULT_FIELD {
            variant["required"] = json!([]);
        }
    }
}

/// An entry of `encoding`: an encoder, or `IdentityEncoding` for a stimulus without one.
pub(super) fn entries(generator: &mut SchemaGenerator) -> Schema {
    let encoder = generator.subschema_for::<EncodingConfig>();
    json_schema!({
        "type": "object",
        "additionalProperties": {"anyOf": [
            encoder,
            {
                "type": "object",
                "properties": {
                    "scheme": {"const": "IdentityEncoding"},
                    "receptive_field": {"description": "Accepted and ignored."},
                },
                "required": ["scheme"],
                "additionalProperties": false,
            },
        ]},
    })
}
