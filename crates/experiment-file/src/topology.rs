//! `topology`: stimuli, ensembles, synapse groups, outputs and their decoding.

use schemars::{JsonSchema, json_schema};
use serde::{Deserialize, Serialize};

use super::{
    EncodingConfig, LearningConfig, NamedMap, NeuronModel, Neurotransmitter, SensorQuery,
    SynapseModel, SynapseParams, encoding, limits, neuron, schema,
};
use crate::DefaultValue::{Depends, Name, Number, Required, Switch, Whole};
use crate::parameters::{kinds, parameters, variants};
use crate::{Domain, Parameter};

parameters! {
    /// Structure of the network; its trainable values come from the genotype.
    pub struct TopologyConfig then schema::with_neurons {
        /// Euler step of the network: of rate neurons in seconds, default 0.1; of spiking ones
        /// in ms, default 1, at most 2.
        dt: f64 = of(Domain::Positive, Depends("")),
        /// Network substeps per environment step.
        time_scale: u32 = whole([1, limits::TIME_SCALE], 20),
        /// Seed of the random connections (and of fixed weights).
        seed: u64 = of(Domain::Seed, Whole(821)),
        /// How the neurons work.
        neuron_model: NeuronModel =
            of(Domain::Variant(NeuronModel::VARIANTS), Name("rate_model")).recent(),
        /// Of rate neurons: whether the gain multiplies the bias, u = F(g (v + beta))
        /// (Eq. 2.2), or not, u = F(g v + beta).
        bias_in_gain: bool = switch(true).original(Switch(false)).recent(),
        /// What rate neurons show until their first substep.
        initial_rates: InitialRates =
            of(Domain::Variant(InitialRates::VARIANTS), Name("activation"))
            .original(Name("zero"))
            .recent(),
        /// Time constant of all rate neurons that an output reads, whatever the genotype
        /// says, seconds.
        motor_tau: Option<f64> = positive(0.0)
            .null()
            .shown("null: that of the genotype")
            .original(Number(0.5))
            .recent(),
        /// How spikes become currents.
        synapse_model: SynapseModel =
            of(Domain::Variant(SynapseModel::VARIANTS), Name("static_synapse")).recent(),
    }
    parts {
        /// The receptors of dynamic synapses; ignored by static ones.
        synapse_params: Option<SynapseParams> =
            optional(|generator| generator.subschema_for::<SynapseParams>())
            unless Option::is_none;
        /// Inputs, in the order in which they are stacked.
        stimuli: NamedMap<StimulusConfig> = required(schema::map::<StimulusConfig>);
        /// How stimuli become spikes. A stimulus without an entry, or with `IdentityEncoding`,
        /// acts as it is.
        encoding: NamedMap<EncodingConfig> =
            optional(encoding::entries) unless NamedMap::is_empty;
        /// Groups of neurons, in the order in which they are numbered.
        ensembles: NamedMap<EnsembleConfig> = required(schema::map::<EnsembleConfig>);
        /// Which ensemble drives which actuator.
        outputs: NamedMap<OutputConfig> = required(schema::map::<OutputConfig>);
        /// Groups of synapses.
        synapses: NamedMap<SynapseGroupConfig> = required(schema::map::<SynapseGroupConfig>);
        /// How weights change while robots live; default null: they do not.
        learning: Option<LearningConfig> =
            optional(|generator| generator.subschema_for::<Option<LearningConfig>>())
            unless Option::is_none;
        /// How activities become actions; one entry per output, same names.
        decoding: NamedMap<DecodingConfig> = required(schema::map::<DecodingConfig>);
    }
}

impl TopologyConfig {
    /// Number of possible synapse sources in a stimulus: nodes of its encoder, or its values.
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
    // Repeats a value of the decoding; nothing depends on it.
    checked { Parameter::one_of("enc", &["real", "cat"], &[], "") }
}

variants! {
    ActuatorQuery, unsupported: &["wireless_transmitter:priority"];
    InitialRates, unsupported: &[];
    SynapseModel, unsupported: &[];
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

parameters! {
    /// One group of synapses: every (pre, post) pair of neurons exists with probability `p`.
    pub struct SynapseGroupConfig {
        /// Names of stimuli or ensembles.
        pre: Vec<String> = of(Domain::Names, Required),
        /// Names of ensembles.
        post: Vec<String> = of(Domain::Names, Required),
        /// Whether the genotype may hold its weights. Fixed weights are drawn from U(-1, 1) with
        /// `topology.seed`.
        trainable: bool = switch(true),
        /// Connection probability.
        p: f64 = unit(1.0),
    }
    ignored { "ntx_fixed": "static synapses have no neurotransmitter"; }
    parts {
        /// Of dynamic synapses, what their spikes release: `AMPA`, `AMPA+NMDA` or `GABA`; default
        /// `AMPA`. Ignored by static ones.
        transmitter as "neuroTX": Option<Neurotransmitter> =
            optional(|_| json_schema!({})) unless Option::is_none;
    }

    /// One group of neurons.
    pub struct EnsembleConfig {
        /// Number of neurons.
        n: u32 = of(Domain::Whole(1, limits::NEURONS), Required),
    }
    parts {
        /// Activation function F; default sigmoid. None for a neuron model without one.
        activation: Option<Activation> =
            optional(|generator| generator.subschema_for::<Activation>()) unless Option::is_none;
        /// Values for parameters that no query of the genotype covers: all parameters of
        /// the neuron model, by name.
        params: NamedMap<f64> = optional(neuron::params_schema);
    }
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
    // Repeats a value of the scheme; nothing depends on it.
    checked { Parameter::switch("is_cat", false, "") }
}

impl DecodingConfig {
    /// Whether it decodes spikes, not activities.
    pub fn is_of_spikes(self) -> bool {
        use DecodingConfig::{FirstToSpike, LinearPopulationDecoding, RankOrderDecoding};
        matches!(self, FirstToSpike {} | RankOrderDecoding { .. } | LinearPopulationDecoding { .. })
    }

    /// Number of values for an ensemble of `n` neurons, unless the decoding yields a category.
    pub fn n_values(self, n: u32) -> u32 {
        match self {
            Self::RankOrderDecoding { num_outputs }
            | Self::LinearPopulationDecoding { num_outputs, .. } => num_outputs,
            _ => n,
        }
    }

    /// Number of weights for an ensemble of `n` neurons; they are ordered value by value.
    pub fn n_weights(self, n: u32) -> u32 {
        match self {
            Self::RankOrderDecoding { num_outputs }
            | Self::LinearPopulationDecoding { num_outputs, .. } => num_outputs * n,
            _ => 0,
        }
    }
}
