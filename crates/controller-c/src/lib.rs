//! Controllers as C99 that computes the bits of the simulation.
//!
//! [`export`] writes the files of a controller: the network of one robot and its radio, without
//! heap, globals, and functions of libm other than `fmaf`; and recorded episodes (`vectors`), with
//! which the test among these files compares every bit.
//!
//! `rate` and `spiking` write the neurons, `plastic` their learning, `encoding` the encoders,
//! `decoding` the decisions, `radio` the radio, `interface` the header, `trial` the test; the
//! folder `c` has the functions that do not depend on the network. `names` and `literals` turn
//! names and numbers into text of C.

mod controller;
mod decoding;
mod encoding;
mod interface;
mod literals;
mod names;
mod plastic;
mod radio;
mod rate;
mod readme;
mod spiking;
mod trial;
mod vectors;

use std::ops::{ControlFlow, Range};

use experiment_file::ActuatorQuery;
use sim_core::blueprint::{Blueprint, Decoder, Neurons};
use sim_core::{EvaluateError, Simulation, TrialSet};
use vectors::Vectors;

/// Where a controller comes from, for its comments and its page.
#[derive(Debug, Clone)]
pub struct About {
    /// Name of the experiment.
    pub experiment: String,
    /// The genotype: "champion of experiment 3".
    pub genotype: String,
    /// Digest of the configuration, in hexadecimal.
    pub config_digest: String,
}

/// The files of a controller.
#[derive(Debug, Clone)]
pub struct Controller {
    /// Names and contents.
    pub files: Vec<(&'static str, Vec<u8>)>,
    /// Number of recorded steps of robots.
    pub robot_steps: u64,
}

/// Why a controller cannot be exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// The robots have another controller.
    #[error(
        "its robots have no network: name a robot with the controller `neural_controller` as \
         `algorithm.evolvable_object`"
    )]
    NoNetwork,
    /// The genotype does not fit, or an episode cannot be simulated.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The recorded episodes are too long.
    #[error("its recorded episodes would have more than {} MB", len_max / 1_000_000)]
    TooLong {
        /// Their largest size, bytes.
        len_max: usize,
    },
    /// The caller does not want it any more.
    #[error("it was stopped")]
    Stopped,
}

/// The episodes to record.
pub struct Episodes<'a> {
    /// Their trial set.
    pub trial_set: TrialSet,
    /// Their trials.
    pub trials: Range<u32>,
    /// Largest size of the records together, bytes.
    pub len_max: usize,
    /// Whether to continue.
    pub keep_going: &'a dyn Fn() -> bool,
}

/// A size of records that fits the memory of most machines, bytes.
pub const LEN_MAX: usize = 2_000_000_000;

/// Name of the file with recorded episodes.
const VECTORS: &str = "test_vectors.bin";

/// The names of all files that a controller may have.
pub const NAMES: [&str; 8] = [
    "README.md",
    "controller.h",
    "controller.c",
    "swarm_radio.h",
    "swarm_radio.c",
    "test.c",
    "Makefile",
    VECTORS,
];

/// The controller that a genotype encodes, with recorded episodes.
///
/// # Errors
///
/// If the evolvable robots have no network, if an episode cannot be simulated or is too long, or if
/// `keep_going` of the episodes returns false.
pub fn export(
    simulation: &Simulation,
    genotype: &[f64],
    episodes: Episodes<'_>,
    about: &About,
) -> Result<Controller, ExportError> {
    let blueprint = simulation.blueprint(genotype)?.ok_or(ExportError::NoNetwork)?;
    let Episodes { trial_set, trials, len_max, keep_going } = episodes;
    let mut vectors = Vectors::new(&blueprint, &simulation.witnesses(), simulation.n_steps());
    for trial in trials.clone() {
        let mut refusal = None;
        let mut add = |testimony: &_| {
            vectors.add(testimony);
            refusal = if vectors.n_bytes() > len_max {
                Some(ExportError::TooLong { len_max })
            } else {
                (!keep_going()).then_some(ExportError::Stopped)
            };
            if refusal.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        simulation.testify(genotype, trial_set, trial, &mut add)?;
        refusal.map_or(Ok(()), Err)?;
    }
    let episodes = match trials.len() {
        1 => format!("trial {} of {trial_set}", trials.start),
        _ => format!("trials {} to {} of {trial_set}", trials.start, trials.end.saturating_sub(1)),
    };
    let names = Names::new(&blueprint);
    let mut texts = vec![
        ("README.md", readme::page(&blueprint, &names, about, &episodes)),
        ("controller.h", interface::header(&blueprint, &names, about)),
        ("controller.c", controller::text(&blueprint, &names)),
        ("test.c", trial::text(&blueprint, &names)),
        ("Makefile", trial::makefile(&blueprint)),
    ];
    if has_radio(&blueprint) {
        texts.push(("swarm_radio.h", radio::header(&blueprint)));
        texts.push(("swarm_radio.c", radio::text(&blueprint, &names)));
    }
    let texts = texts.into_iter().map(|(name, text)| (name, text.into_bytes()));
    let robot_steps = vectors.n_records().into();
    let files = texts.chain([(VECTORS, vectors.finish())]).collect();
    Ok(Controller { files, robot_steps })
}

/// The names of C for those of the experiment file.
struct Names {
    /// Of stimuli.
    stimuli: Vec<String>,
    /// Of ensembles.
    ensembles: Vec<String>,
}

impl Names {
    fn new(blueprint: &Blueprint) -> Self {
        // The member `reward` comes after the stimuli.
        let reward = plastic::takes_reward(blueprint).then_some("reward");
        let stimuli = blueprint.stimuli.iter().map(|stimulus| &*stimulus.name);
        let mut stimuli = names::identifiers(reward.into_iter().chain(stimuli));
        stimuli.drain(..usize::from(reward.is_some()));
        let ensembles = blueprint.ensembles.iter().map(|(name, _)| &**name);
        Self { stimuli, ensembles: names::identifiers(ensembles) }
    }
}

/// Whether the robot has a radio.
fn has_radio(Blueprint { radio, .. }: &Blueprint) -> bool {
    radio.receiver.is_some() || radio.transmitter.is_some()
}

/// Number of inputs.
fn n_inputs(blueprint: &Blueprint) -> usize {
    blueprint.stimuli.last().map_or(0, |stimulus| stimulus.inputs.end)
}

/// Number of neurons.
fn n_neurons(blueprint: &Blueprint) -> usize {
    blueprint.ensembles.last().map_or(0, |(_, neurons)| neurons.end)
}

/// Number of uniform numbers that a controller draws in a step.
fn n_draws(blueprint: &Blueprint) -> usize {
    let encoding = match &blueprint.neurons {
        Neurons::Rate(_) => 0,
        Neurons::Spiking(neurons) => neurons.n_drawing() * blueprint.n_substeps as usize,
    };
    encoding + blueprint.outputs.iter().map(|output| output.n_draws).sum::<usize>()
}

/// A member of the actions.
struct ActionField {
    actuator: ActuatorQuery,
    /// Its type, name and number of values, which is 0 for a single value.
    kind: &'static str,
    name: &'static str,
    n: usize,
}

/// The actions that the network decides, in the order of test vectors.
fn actions(blueprint: &Blueprint) -> Vec<ActionField> {
    let mut fields = Vec::new();
    let field = |actuator, kind, name, n| ActionField { actuator, kind, name, n };
    for actuator in
        [ActuatorQuery::Wheels, ActuatorQuery::Led, ActuatorQuery::Mode, ActuatorQuery::Message]
    {
        let mut outputs = blueprint.outputs.iter().filter(|output| output.actuator == actuator);
        let Some(output) = outputs.next_back() else { continue };
        // These decoders compute in double precision; others give activities or whole numbers.
        let real = match output.decoder {
            Decoder::RankOrder | Decoder::LinearPopulation { .. } => "double",
            _ => "float",
        };
        match actuator {
            ActuatorQuery::Wheels => {
                fields.push(field(actuator, real, "wheel_right", 0));
                fields.push(field(actuator, real, "wheel_left", 0));
            }
            ActuatorQuery::Led => fields.push(field(actuator, "uint32_t", "led", 0)),
            ActuatorQuery::Mode => fields.push(field(actuator, "uint32_t", "send", 0)),
            ActuatorQuery::Message => {
                fields.push(field(actuator, real, "message", blueprint.radio.message_len));
            }
        }
    }
    fields
}
