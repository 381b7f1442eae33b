//! The controller of a genotype as numbers: everything that one robot needs to compute the same
//! bits outside of this program. All values are those with which the simulation computes, in the
//! order in which it adds them up.

use std::ops::Range;

use crate::network::dynamics;
use crate::simulation::{EvaluateError, Simulation};
use experiment_file::{
    Activation, ActuatorQuery, EncodingScheme, NeuronModel, RadialShape, RobotController,
    SendingDirection, SensorQuery,
};

pub use crate::exp2::COEFFICIENTS as EXP2;
pub use crate::network::decoding::Decoder;

/// The controller of one robot of the evolvable object, and its radio.
#[derive(Debug, Clone, PartialEq)]
pub struct Blueprint {
    /// Substeps of the network per environment step.
    pub n_substeps: u32,
    /// Stimuli, in the order of their inputs.
    pub stimuli: Vec<Stimulus>,
    /// Ensembles with their neurons, in the order of the neurons.
    pub ensembles: Vec<(String, Range<usize>)>,
    /// The neurons with their synapses.
    pub neurons: Neurons,
    /// The plasticity of weights; `None`: weights are constant.
    pub plasticity: Option<Plasticity>,
    /// Outputs, in the order in which they draw.
    pub outputs: Vec<Output>,
    /// The robot's radio.
    pub radio: Radio,
    /// Duration of an environment step, s; `None` for robots without wheels, which have no clock.
    pub step_duration: Option<f64>,
}

/// A named input of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct Stimulus {
    /// Its name in the experiment file.
    pub name: String,
    /// The reading that it carries.
    pub sensor: SensorQuery,
    /// Its inputs.
    pub inputs: Range<usize>,
}

/// An ensemble that drives an actuator.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// The actuator.
    pub actuator: ActuatorQuery,
    /// The neurons.
    pub neurons: Range<usize>,
    /// The decoder.
    pub decoder: Decoder,
    /// Weights of the decoder, one list per value.
    pub weights: Vec<Vec<f64>>,
    /// Number of uniform numbers that it draws in a step.
    pub n_draws: usize,
}

/// A synapse, or several between the same two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The other end.
    pub other: usize,
    /// Its weight, in the units of its table.
    pub weight: f32,
    /// Number of the synapse, for plastic weights.
    pub synapse: usize,
}

/// The neurons of a network with their synapses.
#[derive(Debug, Clone, PartialEq)]
pub enum Neurons {
    /// Rate neurons.
    Rate(RateNeurons),
    /// Spiking neurons.
    Spiking(Box<SpikingNeurons>),
}

/// Rate neurons in rows. In a substep, y = retention * y + drive + the weighted inputs and
/// activities, where y is the exponent that the activation function needs; then u = F(y).
#[derive(Debug, Clone, PartialEq)]
pub struct RateNeurons {
    /// The row of each neuron.
    pub rows_of: Vec<usize>,
    /// The rows; with constant weights, rows 2k and 2k + 1 share a division. A row may have no
    /// neuron.
    pub rows: Vec<RateRow>,
    /// Whether u = F(y) before the first substep; otherwise u = 0.
    pub start_active: bool,
}

/// A rate neuron.
#[derive(Debug, Clone, PartialEq)]
pub struct RateRow {
    /// F
    pub activation: Activation,
    /// y at the start.
    pub start: f32,
    /// Factor of y in a substep.
    pub retention: f32,
    /// Contribution of the bias to y per substep.
    pub drive: f32,
    /// Contribution to y per substep and unit of current: 1 with constant weights, which contain
    /// it.
    pub scale: f32,
    /// Synapses from inputs, in the order of addition.
    pub afferent: Vec<Link>,
    /// Synapses from rows, in the order of addition.
    pub recurrent: Vec<Link>,
}

/// Spiking neurons.
#[derive(Debug, Clone, PartialEq)]
pub struct SpikingNeurons {
    /// Their model.
    pub model: NeuronModel,
    /// Constants of the model, neuron by neuron.
    pub constants: Vec<Vec<f32>>,
    /// State variables at the start, neuron by neuron.
    pub starts: Vec<Vec<f32>>,
    /// Synapses from inputs without an encoder, by postsynaptic neuron.
    pub afferent: Vec<Vec<Link>>,
    /// Static synapses by spike source: neurons, then nodes of encoders.
    pub outgoing: Vec<Vec<Link>>,
    /// Dynamic synapses.
    pub receptors: Option<Receptors>,
    /// The encoders, in the order of their nodes.
    pub encoders: Vec<Encoder>,
    /// The constants of the LIF neurons of encoders.
    pub lif: [f32; 5],
    /// Neurons that outputs decode, ascending.
    pub motor: Vec<usize>,
    /// The filter of their spikes: factor of x, growth and decay of a per substep.
    pub filter: [f32; 3],
}

impl SpikingNeurons {
    /// Number of nodes that draw a uniform number in every substep.
    pub fn n_drawing(&self) -> usize {
        let draws = |encoder: &&Encoder| encoder.scheme == EncodingScheme::PoissonRate;
        self.encoders.iter().filter(draws).map(|encoder| encoder.nodes.len()).sum()
    }
}

/// Dynamic synapses: AMPA, GABA and NMDA, in this order.
#[derive(Debug, Clone, PartialEq)]
pub struct Receptors {
    /// Delay of each spike source, substeps, at least 1.
    pub delays: Vec<usize>,
    /// Synapses of each receptor, by postsynaptic neuron.
    pub incoming: [Vec<Vec<Link>>; 3],
    /// Gain and reversal potential of each receptor.
    pub drives: [(f32, Option<f32>); 3],
    /// Factors of `s_ampa`, `s_gaba` and x per substep.
    pub retention: [f32; 3],
    /// The rise of `s_nmda` per substep.
    pub rise: f32,
    /// The decay of `s_nmda` per substep.
    pub decay: f32,
    /// The magnesium concentration, over 3.57.
    pub magnesium: f32,
}

/// An encoder of a stimulus.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoder {
    /// How a node's value becomes spikes.
    pub scheme: EncodingScheme,
    /// Its inputs.
    pub inputs: Range<usize>,
    /// Its nodes among those of all encoders.
    pub nodes: Range<usize>,
    /// Its receptive field.
    pub field: Field,
    /// Smallest and largest value of a node; `None` without limits.
    pub limits: Option<[f32; 2]>,
}

/// A receptive field, which turns values of a stimulus into values of nodes.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    /// The value itself.
    Identity,
    /// Nodes with centres, for each value of the stimulus.
    Radial {
        /// The response at a distance from the centre.
        shape: RadialShape,
        /// Its steepness.
        steepness: f32,
        /// The centres.
        centres: Vec<f32>,
        /// The value of a node is response * scale + offset.
        scale: f32,
        /// The value of a node without response.
        offset: f32,
    },
    /// Weighted sums of the values: weights, node by node.
    Linear(Vec<f32>),
}

/// The rule by which weights change.
#[derive(Debug, Clone, PartialEq)]
pub struct Plasticity {
    /// All weights at the start, by number of the synapse.
    pub weights: Vec<f32>,
    /// The plastic synapses.
    pub synapses: Vec<PlasticSynapse>,
    /// Largest absolute weight.
    pub max_weight: f32,
    /// Factors of the rewards, beginning at the step of the activities; `None` without reward.
    pub discounts: Option<Vec<f32>>,
}

/// A plastic synapse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlasticSynapse {
    /// Its number.
    pub synapse: usize,
    /// Its presynaptic side: a neuron, then a node of an encoder, then an input.
    pub pre: usize,
    /// Its postsynaptic neuron.
    pub post: usize,
    /// A, B, C and D, each times the learning rate.
    pub coefficients: [f32; 4],
}

/// A robot's radio.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Radio {
    /// Components of a message; 0 without radio.
    pub message_len: usize,
    /// The receiver.
    pub receiver: Option<RadioReceiver>,
    /// The transmitter.
    pub transmitter: Option<Transmitter>,
}

/// A receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct RadioReceiver {
    /// (cos, sin) of each sector in the robot's own frame of reference.
    pub directions: Vec<[f64; 2]>,
    /// Frames with this many hops are not accepted.
    pub max_hops: u32,
    /// The robot whose sector is the sending direction.
    pub sending_direction: SendingDirection,
}

/// A transmitter.
#[derive(Debug, Clone, PartialEq)]
pub struct Transmitter {
    /// The quantiser of messages.
    pub quantiser: Option<Lattice>,
    /// Steps at the start in which the robot always sends.
    pub sending_steps: u32,
    /// Whether a frame with the message 0 is on the air before the first step.
    pub initial_frame: bool,
}

/// The lattice of a quantiser.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// A point's weight is 2^(slope * distance), up to a common factor.
    pub slope: f32,
    /// Levels of a component; the last component of a point runs fastest.
    pub levels: Vec<f64>,
}

impl Simulation {
    /// The controller that a genotype encodes, and the radio of the robots that it drives.
    /// `Ok(None)` if the evolvable robots have no network.
    ///
    /// # Errors
    ///
    /// If the genotype has the wrong length, or a gene outside \[0, 1\].
    pub fn blueprint(&self, genotype: &[f64]) -> Result<Option<Blueprint>, EvaluateError> {
        let phenotype = self.phenotype(genotype)?;
        let (network, group) = (&self.network, &self.world.groups[self.world.evolvable]);
        if group.controller != RobotController::NeuralController {
            return Ok(None);
        }
        let stimuli = network.stimuli.iter().map(|(name, stimulus)| Stimulus {
            name: name.clone(),
            sensor: stimulus.sensor,
            inputs: stimulus.inputs.clone(),
        });
        let ensembles = network.ensembles.iter();
        let outputs = network.outputs.iter().zip(&phenotype.decoders);
        let outputs = outputs.map(|(output, weights)| Output {
            actuator: output.actuator,
            neurons: output.neurons.clone(),
            decoder: output.decoder,
            weights: weights.chunks_exact(output.neurons.len().max(1)).map(Into::into).collect(),
            n_draws: output.n_draws(self.world.message_len),
        });
        let (neurons, plasticity) = dynamics::blueprint(network, &phenotype);
        Ok(Some(Blueprint {
            n_substeps: network.n_substeps,
            stimuli: stimuli.collect(),
            ensembles: ensembles.map(|(name, of)| (name.clone(), of.neurons.clone())).collect(),
            neurons,
            plasticity,
            outputs: outputs.collect(),
            radio: self.world.radio_of(group),
            step_duration: group.drive.as_ref().map(|drive| drive.step_duration),
        }))
    }
}
