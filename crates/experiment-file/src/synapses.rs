//! What synapses do to spiking neurons: at once, or through receptors that open and close.

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{limits, schema};

/// How spikes become currents.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SynapseModel {
    /// The weight, in the substep after the spike.
    #[default]
    #[serde(rename = "static_synapse")]
    Static,
    /// Receptors of AMPA, GABA and NMDA, after an axonal delay; of spiking neurons only.
    #[serde(rename = "dynamic_synapse")]
    Dynamic,
}

impl SynapseModel {
    /// Whether the canonical form leaves it out.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
    pub(super) fn is_static(&self) -> bool {
        *self == Self::Static
    }
}

/// What the spikes of a group of dynamic synapses release.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Neurotransmitter {
    /// Excites for some milliseconds.
    #[default]
    #[serde(rename = "AMPA")]
    Ampa,
    /// Excites for some milliseconds, and for a tenth of a second where v is high.
    #[serde(rename = "AMPA+NMDA", alias = "AMPA+NDMA")]
    AmpaNmda,
    /// Inhibits.
    #[serde(rename = "GABA")]
    Gaba,
}

/// The receptors of dynamic synapses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = receptors)]
pub struct SynapseParams {
    /// Fast excitation.
    #[serde(rename = "AMPA")]
    pub ampa: AmpaParams,
    /// Inhibition.
    #[serde(rename = "GABA")]
    pub gaba: GabaParams,
    /// Slow excitation; also `NDMA`.
    #[serde(rename = "NMDA")]
    pub nmda: NmdaParams,
}

/// AMPA receptors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("gain, tau, E"))]
pub struct AmpaParams {
    /// Factor of the current; default 0.6.
    #[schemars(range(min = 0, max = limits::SYNAPSE_GAIN), extend("default" = 0.6))]
    pub gain: f64,
    /// Time constant of the decay, ms; default 5.
    #[schemars(range(min = 0.01, max = 10_000), extend("default" = 5.0))]
    pub tau: f64,
    /// Reversal potential, mV, or null: the current does not depend on v; default 0.
    #[serde(rename = "E")]
    #[schemars(range(min = -200, max = 200), extend("default" = 0.0))]
    pub reversal: Option<f64>,
}

/// GABA receptors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("gain, tau, E"))]
pub struct GabaParams {
    /// Factor of the current; default 1.
    #[schemars(range(min = 0, max = limits::SYNAPSE_GAIN), extend("default" = 1.0))]
    pub gain: f64,
    /// Time constant of the decay, ms; default 10.
    #[schemars(range(min = 0.01, max = 10_000), extend("default" = 10.0))]
    pub tau: f64,
    /// Reversal potential, mV, or null: the current is negative whatever v; default -70.
    #[serde(rename = "E")]
    #[schemars(range(min = -200, max = 200), extend("default" = -70.0))]
    pub reversal: Option<f64>,
}

/// NMDA receptors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("gain, tau_rise, tau_decay, Mg2, E")
)]
pub struct NmdaParams {
    /// Factor of the current; default 0.1.
    #[schemars(range(min = 0, max = limits::SYNAPSE_GAIN), extend("default" = 0.1))]
    pub gain: f64,
    /// Time constant of the rise, ms; default 6.
    #[schemars(range(min = 0.01, max = 10_000), extend("default" = 6.0))]
    pub tau_rise: f64,
    /// Time constant of the decay, ms; default 100.
    #[schemars(range(min = 0.01, max = 10_000), extend("default" = 100.0))]
    pub tau_decay: f64,
    /// Concentration of magnesium, mM, which blocks them at low v; default 0.5.
    #[serde(rename = "Mg2")]
    #[schemars(range(min = 0, max = 1_000), extend("default" = 0.5))]
    pub magnesium: f64,
    /// Reversal potential, mV, or null: the current depends on v by the block only;
    /// default 0.
    #[serde(rename = "E")]
    #[schemars(range(min = -200, max = 200), extend("default" = 0.0))]
    pub reversal: Option<f64>,
}

impl Default for AmpaParams {
    fn default() -> Self {
        Self { gain: 0.6, tau: 5.0, reversal: Some(0.0) }
    }
}

impl Default for GabaParams {
    fn default() -> Self {
        Self { gain: 1.0, tau: 10.0, reversal: Some(-70.0) }
    }
}

impl Default for NmdaParams {
    fn default() -> Self {
        Self { gain: 0.1, tau_rise: 6.0, tau_decay: 100.0, magnesium: 0.5, reversal: Some(0.0) }
    }
}

/// All may be left out, and the original spells NMDA `NDMA`.
fn receptors(schema: &mut Schema) {
    schema.remove("required");
    let nmda = schema.pointer("/properties/NMDA").cloned();
    if let (Some(nmda), Some(Value::Object(properties))) = (nmda, schema.get_mut("properties")) {
        properties.insert("NDMA".to_owned(), nmda);
    }
}
