//! `topology`: stimuli, ensembles, synapse groups, outputs and their decoding.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{
    EncodingConfig, LearningConfig, NamedMap, NeuronModel, Neurotransmitter, SensorQuery,
    SynapseModel, SynapseParams, encoding, limits, neuron, schema,
};
use crate::DefaultValue::Required;
use crate::parameters::{kinds, parameters, variants};
use crate::{Domain, Parameter};

/// Of [`TopologyConfig::dt`], s.
pub(super) const DEFAULT_DT: f64 = 0.1;
/// Of [`TopologyConfig::dt`] of spiking neurons, ms.
pub(super) const DEFAULT_SPIKING_DT: f64 = 1.0;
/// Of [`TopologyConfig::time_scale`].
pub(super) const DEFAULT_TIME_SCALE: u32 = 20;
/// Of [`TopologyConfig::seed`].
pub(super) const DEFAULT_CONNECTION_SEED: u64 = 821;

/// Structure of the network; its trainable values come from the genotype.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional(
        "dt, time_scale, seed, neuron_model, bias_in_gain, initial_rates, motor_tau, \
         synapse_model, synapse_params, encoding, learning"
    ),
    transform = schema::property("neurons", schema::neurons())
)]
pub struct TopologyConfig {
    /// Euler step of the network: of rate neurons in seconds, default 0.1; of spiking ones
    /// in ms, default 1, at most 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub dt: f64,
    /// Network substeps per environment step; default 20.
    #[schemars(range(min = 1, max = limits::TIME_SCALE), extend("default" = DEFAULT_TIME_SCALE))]
    pub time_scale: u32,
    /// Seed of the random connections (and of fixed weights); default 821.
    #[schemars(schema_with = "schema::seed", extend("default" = DEFAULT_CONNECTION_SEED))]
    pub seed: u64,
    /// How the neurons work; default `rate_model`.
    #[serde(skip_serializing_if = "NeuronModel::is_default")]
    pub neuron_model: NeuronModel,
    /// Of rate neurons: whether the gain multiplies the bias, u = F(g (v + beta))
    /// (Eq. 2.2), or not, u = F(g v + beta); default true.
    #[serde(skip_serializing_if = "Clone::clone")]
    #[schemars(extend("default" = true))]
    pub bias_in_gain: bool,
    /// What rate neurons show until their first substep; default `activation`.
    #[serde(skip_serializing_if = "InitialRates::is_default")]
    pub initial_rates: InitialRates,
    /// Time constant of all rate neurons that an output reads, whatever the genotype
    /// says, seconds; default null: that of the genotype.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema::positive_or_null")]
    pub motor_tau: Option<f64>,
    /// How spikes become currents; default `static_synapse`.
    #[serde(skip_serializing_if = "SynapseModel::is_static")]
    pub synapse_model: SynapseModel,
    /// The receptors of dynamic synapses; ignored by static ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "SynapseParams")]
    pub synapse_params: Option<SynapseParams>,
    /// Inputs, in the order in which they are stacked.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub stimuli: NamedMap<StimulusConfig>,
    /// How stimuli become spikes. A stimulus without an entry, or with `IdentityEncoding`, acts as
    /// it is.
    #[serde(skip_serializing_if = "NamedMap::is_empty")]
    #[schemars(schema_with = "encoding::entries")]
    pub encoding: NamedMap<EncodingConfig>,
    /// Groups of neurons, in the order in which they are numbered.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub ensembles: NamedMap<EnsembleConfig>,
    /// Which ensemble drives which actuator.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub outputs: NamedMap<OutputConfig>,
    /// Groups of synapses.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub synapses: NamedMap<SynapseGroupConfig>,
    /// How weights change while robots live; default null: they do not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learning: Option<LearningConfig>,
    /// How activities become actions; one entry per output, same names.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub decoding: NamedMap<DecodingConfig>,
}

impl TopologyConfig {
    /// What synapses can start from in a stimulus: nodes of its encoder, or its values.
    pub fn n_sources(&self, stimulus: &str) -> u32 {
        let n = self.stimuli.get(stimulus).map_or(0, |stimulus| stimulus.n);
        self.encoding.get(stimulus).map_or(n, |encoding| encoding.receptive_field.n_nodes(n))
    }
}

/// Activities u of rate neurons before the first substep of an episode; v is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InitialRates {
    /// What follows from v: F(g beta), or F(beta) without `bias_in_gain`.
    #[default]
    Activation,
    /// 0.
    Zero,
}

impl InitialRates {
    /// Whether the canonical form leaves it out.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

parameters! {
    /// One named input of the network.
    pub struct StimulusConfig {
        /// Number of values; equals the length of the reading.
        n: u32 = of(Domain::Whole(1, limits::INPUTS), Required),
        /// Where the values come from.
        sensor: SensorQuery = of(Domain::Variant(SensorQuery::VARIANTS), Required),
    }

    /// Connects an ensemble to an actuator.
    pub struct OutputConfig {
        /// Name of the ensemble.
        ensemble: String = of(Domain::Text, Required),
        /// What it drives.
        actuator: ActuatorQuery = of(Domain::Variant(ActuatorQuery::VARIANTS), Required),
    }
    // Says what the decoding says, too; nothing depends on it.
    checked { Parameter::one_of("enc", &["real", "cat"], &[], "") }
}

variants! {
    ActuatorQuery, unsupported: &["wireless_transmitter:priority"];
}

/// One group of neurons.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("activation, params"))]
pub struct EnsembleConfig {
    /// Number of neurons.
    #[schemars(range(min = 1, max = limits::NEURONS))]
    pub n: u32,
    /// Activation function F; default sigmoid. None for a neuron model without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Activation")]
    pub activation: Option<Activation>,
    /// Values for parameters that no query of the genotype covers: all parameters of
    /// the neuron model, by name.
    #[schemars(schema_with = "neuron::params_schema")]
    pub params: NamedMap<f64>,
}

/// Activation function of an ensemble.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// 1 / (1 + exp(-x)), range (0, 1).
    #[default]
    Sigmoid,
    /// Hyperbolic tangent, range (-1, 1).
    Tanh,
}

/// An actuator, by the name that config files use.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
pub enum ActuatorQuery {
    /// Wheels: 2 neurons (right, left), or 1 for rotation in place (w, -w).
    #[serde(rename = "wheel_actuator")]
    Wheels,
    /// LED colour.
    #[serde(rename = "led_actuator")]
    Led,
    /// Message of the frame; `msg_length` neurons.
    #[serde(rename = "wireless_transmitter")]
    Message,
    /// Communication mode, 1 send, 0 relay.
    #[serde(rename = "wireless_transmitter:state")]
    Mode,
}

impl ActuatorQuery {
    /// Its name in the file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Wheels => "wheel_actuator",
            Self::Led => "led_actuator",
            Self::Message => "wireless_transmitter",
            Self::Mode => "wireless_transmitter:state",
        }
    }
}

/// One group of synapses: every (pre, post) pair of neurons exists with
/// probability `p`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("trainable, p"),
    transform = schema::property("neuroTX", json!({
        "description": "Of dynamic synapses, what their spikes release: `AMPA`, `AMPA+NMDA` \
                        or `GABA`; default `AMPA`. Ignored by static ones."
    })),
    transform = schema::ignored("ntx_fixed")
)]
pub struct SynapseGroupConfig {
    /// Names of stimuli or ensembles.
    #[schemars(schema_with = "schema::names")]
    pub pre: Vec<String>,
    /// Names of ensembles.
    #[schemars(schema_with = "schema::names")]
    pub post: Vec<String>,
    /// Whether the genotype may hold its weights, default true; fixed weights are
    /// drawn from U(-1, 1) with `topology.seed`.
    #[schemars(extend("default" = true))]
    pub trainable: bool,
    /// Connection probability; default 1.
    #[schemars(range(min = 0, max = 1), extend("default" = 1))]
    pub p: f64,
    /// What their spikes release; none of static synapses.
    #[serde(rename = "neuroTX", skip_serializing_if = "Option::is_none")]
    #[schemars(skip)]
    pub transmitter: Option<Neurotransmitter>,
}

kinds! {
    /// How what an output's ensemble does becomes an action: the first three for rate neurons,
    /// from activities u; the others for spiking ones, from the spikes of the environment step.
    #[derive(Copy)]
    pub enum DecodingConfig by "scheme" {
        /// The activities themselves.
        IdentityDecoding {} = "IdentityDecoding",
        /// One bit per neuron.
        ThresholdDecoding {
            /// false: u >= 0.5. true: Bernoulli(u).
            stochastic: bool = switch(false),
        } = "ThresholdDecoding",
        /// One category, drawn from softmax(u).
        SoftmaxDecoding {} = "SoftmaxDecoding",
        /// The index of the neuron that spiked first: the lowest of those that did at once, 0
        /// if none has.
        FirstToSpike {} ignored("num_outputs": "there are as many as neurons") = "FirstToSpike",
        /// Sum over neurons of weight * spikes * 0.25^rank; the rank is how many neurons of
        /// the ensemble spiked before it for the first time.
        RankOrderDecoding {
            /// Values that it yields, each with weights of its own.
            num_outputs: u32 = whole([1, limits::MESSAGE_LENGTH], 1),
        } = "RankOrderDecoding",
        /// sigmoid(3 W a) + rest_value - 0.5, where a follows each neuron's spikes: it rises
        /// within 5 ms of one and decays with 30 ms.
        LinearPopulationDecoding {
            /// Values that it yields, each with weights of its own.
            num_outputs: u32 = whole([1, limits::MESSAGE_LENGTH], 1),
            /// What it yields where W a = 0.
            rest_value: f64 = between([-1.0, 1.0], 0.5),
        } = "LinearPopulationDecoding",
    }
    // Says what the scheme says, too; nothing depends on it.
    checked { Parameter::switch("is_cat", false, "") }
}

impl DecodingConfig {
    /// Whether it decodes spikes, not activities.
    pub fn is_of_spikes(self) -> bool {
        use DecodingConfig::{FirstToSpike, LinearPopulationDecoding, RankOrderDecoding};
        matches!(self, FirstToSpike {} | RankOrderDecoding { .. } | LinearPopulationDecoding { .. })
    }

    /// Values that it yields for an ensemble of `n` neurons, unless it yields a category.
    pub fn n_values(self, n: u32) -> u32 {
        match self {
            Self::RankOrderDecoding { num_outputs }
            | Self::LinearPopulationDecoding { num_outputs, .. } => num_outputs,
            _ => n,
        }
    }

    /// Its weights for an ensemble of `n` neurons, value by value.
    pub fn n_weights(self, n: u32) -> u32 {
        match self {
            Self::RankOrderDecoding { num_outputs }
            | Self::LinearPopulationDecoding { num_outputs, .. } => num_outputs * n,
            _ => 0,
        }
    }
}
