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
        /// Euler step of the network. Spiking neurons take 0.001 to 2 ms.
        dt: f64 = of(Domain::Positive, Depends("0.1 s, of spiking neurons 1 ms")),
        /// Network substeps per environment step.
        time_scale: u32 = whole([1, limits::TIME_SCALE], 20),
        /// Seed of random connections, and of weights and delays that do not evolve.
        seed: u64 = of(Domain::Seed, Whole(821)),
        /// How the neurons work. The name `ctrnn` means `rate_model`, too.
        neuron_model: NeuronModel =
            of(Domain::Variant(NeuronModel::VARIANTS), Name("rate_model")).recent(),
        /// Of rate neurons: whether the gain multiplies the bias, u = F(g (v + beta))
        /// (Eq. 2.2), or not, u = F(g v + beta).
        bias_in_gain: bool = switch(true).original(Switch(false)).recent(),
        /// Activities of rate neurons before their first substep.
        initial_rates: InitialRates =
            of(Domain::Variant(InitialRates::VARIANTS), Name("activation"))
            .original(Name("zero"))
            .recent(),
        /// Time constant of all rate neurons that an output reads, s. It replaces the time
        /// constants of the genotype.
        motor_tau: Option<f64> = positive(0.0)
            .null()
            .shown("null: the time constants of the genotype")
            .original(Number(0.5))
            .recent(),
        /// How spikes become currents.
        synapse_model: SynapseModel =
            of(Domain::Variant(SynapseModel::VARIANTS), Name("static_synapse")).recent(),
    }
    parts {
        /// The receptors of dynamic synapses. Static synapses ignore them.
        synapse_params: Option<SynapseParams> =
            optional(|generator| generator.subschema_for::<SynapseParams>())
            unless Option::is_none;
        /// Inputs of the network, by names that you choose.
        stimuli: NamedMap<StimulusConfig> = required(schema::map::<StimulusConfig>);
        /// How stimuli become spikes. A stimulus without an entry, or with `IdentityEncoding`,
        /// reaches the network unencoded.
        encoding: NamedMap<EncodingConfig> =
            optional(encoding::entries) unless NamedMap::is_empty;
        /// Groups of neurons, by names that you choose. Their order numbers the neurons.
        ensembles: NamedMap<EnsembleConfig> = required(schema::map::<EnsembleConfig>);
        /// The ensemble that drives each actuator, by names that you choose.
        outputs: NamedMap<OutputConfig> = required(schema::map::<OutputConfig>);
        /// Groups of synapses, by names that you choose. No two groups connect the same pair.
        synapses: NamedMap<SynapseGroupConfig> = required(schema::map::<SynapseGroupConfig>);
        /// How weights change while robots live; default null: they do not.
        learning: Option<LearningConfig> =
            optional(|generator| generator.subschema_for::<Option<LearningConfig>>())
            unless Option::is_none;
        /// How activities become actions: an entry for each of `outputs`, with the same name.
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
    /// The activity that follows from v = 0: F(g beta), or F(beta) without `bias_in_gain`.
    #[default]
    Activation,
    /// 0.
    Zero,
}

parameters! {
    /// An input of the network.
    pub struct StimulusConfig {
        /// Number of values, which must equal the length of the reading.
        n: u32 = of(Domain::Whole(1, limits::INPUTS), Required),
        /// The reading that gives the values.
        sensor: SensorQuery = of(Domain::Variant(SensorQuery::VARIANTS), Required),
    }

    /// Connects an ensemble to an actuator.
    pub struct OutputConfig {
        /// Name of the ensemble.
        ensemble: String = of(Domain::Text, Required),
        /// The actuator that the ensemble drives.
        actuator: ActuatorQuery = of(Domain::Variant(ActuatorQuery::VARIANTS), Required),
    }
    // Repeats a value of the decoding; nothing depends on it.
    checked { Parameter::one_of("enc", &["real", "cat"], &[], "Without effect: the decoding determines it") }
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
    /// Wheels: 2 values, right and left, or 1 value w for rotation in place, (w, -w).
    #[serde(rename = "wheel_actuator")]
    Wheels,
    /// LED: 1 value, on or off, or a neuron for each of 2 or more colours.
    #[serde(rename = "led_actuator")]
    Led,
    /// Message of the frame: `msg_length` values.
    #[serde(rename = "wireless_transmitter")]
    Message,
    /// Communication mode, 1 send, 0 relay: 1 value, or with `FirstToSpike` 2 neurons, relay and
    /// send.
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
        /// Neurotransmitter of dynamic synapses: `AMPA`, `AMPA+NMDA` or `GABA`; default `AMPA`.
        /// Static synapses ignore it. `AMPA+NDMA` is another name of `AMPA+NMDA`.
        transmitter as "neuroTX": Option<Neurotransmitter> =
            optional(|_| json_schema!({})) unless Option::is_none;
    }

    /// One group of neurons.
    pub struct EnsembleConfig {
        /// Number of neurons.
        n: u32 = of(Domain::Whole(1, limits::NEURONS), Required),
    }
    parts {
        /// Activation function F of rate neurons; default `sigmoid`. Files may also state it in
        /// `params`.
        activation: Option<Activation> =
            optional(|generator| generator.subschema_for::<Activation>()) unless Option::is_none;
        /// Parameters of the neuron model that no query of the genotype covers, by name.
        params: NamedMap<f64> = optional(neuron::params_schema);
    }
}

kinds! {
    /// How an output's ensemble becomes an action. The first three are for rate neurons and read
    /// activities u; the others are for spiking neurons and read the spikes of the environment
    /// step.
    #[derive(Copy)]
    pub enum DecodingConfig by "scheme" {
        /// The activities themselves, for wheels or a message.
        IdentityDecoding {} = "IdentityDecoding",
        /// One bit per neuron, for an LED, a mode, wheels or a message.
        ThresholdDecoding {
            /// false: u >= 0.5. true: Bernoulli(u).
            stochastic: bool = switch(false),
        } = "ThresholdDecoding",
        /// One category, drawn from softmax(u), for an LED of several colours.
        SoftmaxDecoding {} = "SoftmaxDecoding",
        /// One category, the index of the neuron that spiked first, for an LED of several colours
        /// or a mode. The lowest index wins a tie. If no neuron spiked, the category is 0.
        FirstToSpike {} ignored("num_outputs": "the number of neurons determines it") = "FirstToSpike",
        /// Sum over neurons of weight * spikes * 0.25^rank. The rank of a neuron is the number of
        /// neurons that spiked before its first spike.
        RankOrderDecoding {
            /// Number of values that the decoding yields, each with its own weights: 1 or 2 for
            /// wheels, 1 for an LED or a mode (on if the value is at least 0.5), and `msg_length`
            /// for a message.
            num_outputs: u32 = whole([1, limits::MESSAGE_LENGTH], 1),
        } = "RankOrderDecoding",
        /// sigmoid(3 W a) + rest_value - 0.5, where a follows each neuron's spikes: it rises within
        /// 5 ms of a spike and decays with a time constant of 30 ms. With the default `rest_value`,
        /// a single neuron cannot switch an LED: give it two.
        LinearPopulationDecoding {
            /// Number of values that the decoding yields, each with its own weights: 1 or 2 for
            /// wheels, 1 for an LED or a mode (on if the value is at least 0.5), and `msg_length`
            /// for a message.
            num_outputs: u32 = whole([1, limits::MESSAGE_LENGTH], 1),
            /// The value that the decoding yields where W a = 0.
            rest_value: f64 = between([-1.0, 1.0], 0.5),
        } = "LinearPopulationDecoding",
    }
    // Repeats a value of the scheme; nothing depends on it.
    checked { Parameter::switch("is_cat", false, "Without effect: the scheme determines it") }
}

impl DecodingConfig {
    /// Whether the decoding reads spikes instead of activities.
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
