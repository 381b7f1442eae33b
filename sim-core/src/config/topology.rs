//! `topology`: stimuli, ensembles, synapse groups, outputs and their decoding.

use serde::{Deserialize, Serialize};

use super::NamedMap;

/// Of [`TopologyConfig::dt`].
pub(super) const DEFAULT_DT: f64 = 0.1;
/// Of [`TopologyConfig::time_scale`].
pub(super) const DEFAULT_TIME_SCALE: u32 = 20;
/// Of [`TopologyConfig::seed`].
pub(super) const DEFAULT_CONNECTION_SEED: u64 = 821;

/// Structure of the CTRNN; its trainable values come from the genotype.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TopologyConfig {
    /// Euler step of the network, seconds; default 0.1.
    pub dt: f64,
    /// Network substeps per environment step; default 20.
    pub time_scale: u32,
    /// Seed of the random connections (and of fixed weights); default 821.
    pub seed: u64,
    /// Inputs, in the order in which they are stacked.
    pub stimuli: NamedMap<StimulusConfig>,
    /// Groups of neurons, in the order in which they are numbered.
    pub ensembles: NamedMap<EnsembleConfig>,
    /// Which ensemble drives which actuator.
    pub outputs: NamedMap<OutputConfig>,
    /// Groups of synapses.
    pub synapses: NamedMap<SynapseGroupConfig>,
    /// How activities become actions; one entry per output, same names.
    pub decoding: NamedMap<DecodingConfig>,
}

/// One named input of the network.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StimulusConfig {
    /// Number of values; equals the length of the reading.
    pub n: u32,
    /// Where the values come from.
    pub sensor: SensorQuery,
}

/// A reading of a robot, by the name that config files use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum SensorQuery {
    /// Message of the chosen frame; `msg_length` values.
    #[serde(rename = "wireless_receiver:msg")]
    ReceiverMessage,
    /// Strength of the chosen frame; 1 value.
    #[serde(rename = "wireless_receiver:signal")]
    ReceiverSignal,
    /// (cos, sin) of the sector that received it; 2 values.
    #[serde(rename = "wireless_receiver:receiving_direction")]
    ReceiverReceivingDirection,
    /// (cos, sin) of the emitter's sector that faced the receiver; 2 values.
    #[serde(rename = "wireless_receiver:sending_direction")]
    ReceiverSendingDirection,
    /// Own communication mode, 1 send, 0 relay; 1 value.
    #[serde(rename = "wireless_receiver:state")]
    ReceiverState,
    /// Light per sector; `n_sectors` values.
    #[serde(rename = "light_sensor")]
    Light,
    /// Nearness of other robots per sector; `n_sectors` values.
    #[serde(rename = "distance_sensor")]
    Distance,
    /// 1 on a ground area of the sensor's colour; 1 value.
    #[serde(rename = "ground_sensor")]
    Ground,
}

/// One group of neurons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnsembleConfig {
    /// Number of neurons.
    pub n: u32,
    /// Activation function F; default sigmoid.
    pub activation: Activation,
    /// Values for parameters that no query of the genotype covers.
    pub params: NeuronParams,
}

/// Activation function of an ensemble.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// 1 / (1 + exp(-x)), range (0, 1).
    Sigmoid,
    /// Hyperbolic tangent, range (-1, 1).
    Tanh,
}

/// Neuron parameters outside the genotype.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NeuronParams {
    /// Time constant, seconds; default 2 (the middle of Table 3.3's scale,
    /// 2 * 10^0).
    pub tau: f64,
    /// Gain g; default 1.
    pub gain: f64,
    /// Bias beta; default 0.
    pub bias: f64,
}

impl Default for NeuronParams {
    fn default() -> Self {
        Self { tau: 2.0, gain: 1.0, bias: 0.0 }
    }
}

/// Connects an ensemble to an actuator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputConfig {
    /// Name of the ensemble.
    pub ensemble: String,
    /// What it drives.
    pub actuator: ActuatorQuery,
}

/// An actuator, by the name that config files use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
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

/// One group of synapses: every (pre, post) pair of neurons exists with
/// probability `p`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SynapseGroupConfig {
    /// Names of stimuli or ensembles.
    pub pre: Vec<String>,
    /// Names of ensembles.
    pub post: Vec<String>,
    /// Whether the genotype may hold its weights, default true; fixed weights are
    /// drawn from U(-1, 1) with `topology.seed`.
    pub trainable: bool,
    /// Connection probability; default 1.
    pub p: f64,
}

/// How the activities of an output's ensemble become an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "scheme", content = "params")]
pub enum DecodingConfig {
    /// The activities themselves.
    IdentityDecoding {},
    /// One bit per neuron.
    ThresholdDecoding {
        /// false: u >= 0.5. true: Bernoulli(u).
        stochastic: bool,
    },
    /// One category, drawn from softmax(u).
    SoftmaxDecoding {},
}
