//! How synapses act on spiking neurons: at once, or through receptors that open and close.

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::limits;
use crate::neuron::{TIME, VOLTAGE};
use crate::parameters::parameters;

/// How spikes become currents.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum SynapseModel {
    /// The current is the weight, in the substep after the spike.
    #[default]
    #[serde(rename = "static_synapse")]
    Static,
    /// Receptors of AMPA, GABA and NMDA, after an axonal delay; of spiking neurons only.
    #[serde(rename = "dynamic_synapse")]
    Dynamic,
}

/// The neurotransmitter that the spikes of a group of dynamic synapses release.
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
    /// Slow excitation.
    #[serde(rename = "NMDA")]
    pub nmda: NmdaParams,
}

parameters! {
    /// AMPA receptors.
    #[derive(Copy)]
    pub struct AmpaParams: Default {
        /// Factor of the current.
        gain: f64 = between(GAIN, 0.6),
        /// Time constant of the decay, ms.
        tau: f64 = between(TIME, 5.0),
        /// Reversal potential, mV. With null, the current does not depend on v.
        reversal as "E": Option<f64> = between(VOLTAGE, 0.0).or_null(),
    }

    /// GABA receptors.
    #[derive(Copy)]
    pub struct GabaParams: Default {
        /// Factor of the current.
        gain: f64 = between(GAIN, 1.0),
        /// Time constant of the decay, ms.
        tau: f64 = between(TIME, 10.0),
        /// Reversal potential, mV. With null, the current is negative for any v.
        reversal as "E": Option<f64> = between(VOLTAGE, -70.0).or_null(),
    }

    /// NMDA receptors.
    #[derive(Copy)]
    pub struct NmdaParams: Default {
        /// Factor of the current.
        gain: f64 = between(GAIN, 0.1),
        /// Time constant of the rise, ms.
        tau_rise: f64 = between(TIME, 6.0),
        /// Time constant of the decay, ms.
        tau_decay: f64 = between(TIME, 100.0),
        /// Concentration of magnesium, mM. It blocks the receptors at low v.
        magnesium as "Mg2": f64 = between([0.0, 1_000.0], 0.5),
        /// Reversal potential, mV. With null, the current depends on v only through the block.
        reversal as "E": Option<f64> = between(VOLTAGE, 0.0).or_null(),
    }
}

const GAIN: [f64; 2] = [0.0, limits::SYNAPSE_GAIN];

/// Makes all receptors optional, and adds `NDMA`, as the original spells NMDA.
fn receptors(schema: &mut Schema) {
    schema.remove("required");
    let nmda = schema.pointer("/properties/NMDA").cloned();
    if let (Some(mut nmda), Some(Value::Object(properties))) = (nmda, schema.get_mut("properties"))
    {
        nmda["description"] = json!("Another name of `NMDA`.");
        properties.insert("NDMA".to_owned(), nmda);
    }
}
