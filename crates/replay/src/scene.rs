//! The constants of all steps of an episode.

use experiment_file::{
    ExperimentConfig, ObjectConfig, RobotConfig, RobotController, Seed, SensorQuery,
};
use serde::Serialize;
use sim_core::{EvaluateError, MeasureName, RoomRecord, TrialSet};

use super::Episode;
use crate::trials::Trials;

/// An episode without its steps.
#[derive(Debug, Serialize)]
pub struct Scene {
    /// The name of the genotype.
    name: String,
    /// The experiment's name.
    experiment: String,
    seed: Seed,
    /// Generation of the worlds, if they belong to one.
    generation: Option<u64>,
    /// The purpose of the trials.
    trial_set: &'static str,
    trial: u32,
    /// The trials of the individual, if known.
    pub trials: Option<Trials>,
    fitness_function: &'static str,
    pub steps: u32,
    /// cm
    width: f64,
    height: f64,
    robots: Vec<Robots>,
    pub n_robots: usize,
    pub message_len: usize,
    /// Values of the longest list of stimuli.
    pub n_inputs: usize,
    pub n_neurons: usize,
    ensembles: Vec<Rows>,
    pub lights: Vec<Disc>,
    pub areas: Vec<Disc>,
    /// Of a world with bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub room: Option<RoomRecord>,
    pub measure_names: Vec<MeasureName>,
}

/// The robots of one object.
#[derive(Debug, Serialize)]
struct Robots {
    name: String,
    n: usize,
    /// cm; none without a transmitter.
    emits_within: Option<f64>,
    /// cm; none without a receiver.
    hears_within: Option<f64>,
    /// Number of sectors of the receiver.
    n_sectors: u32,
    /// Levels of a component of a message; none if it is not quantised.
    n_levels: Option<u32>,
    stimuli: Vec<Rows>,
    /// Whether a network controls the robots.
    has_network: bool,
    sees_lights: bool,
    sees_areas: bool,
}

/// Rows under one name.
#[derive(Debug, Serialize)]
struct Rows {
    name: String,
    n: u32,
}

/// A light, or a ground area.
#[derive(Debug, Serialize)]
pub struct Disc {
    /// The name of its object, such as `nest`.
    name: String,
    color: String,
    /// cm
    range: f64,
}

impl Scene {
    /// The scene of an episode.
    pub fn new(episode: &Episode<'_>) -> Result<Self, EvaluateError> {
        let config = episode.config;
        let robots: Vec<Robots> =
            config.robots().map(|(name, robot)| Robots::new(name, robot, config)).collect();
        let n_inputs =
            |robots: &Robots| robots.stimuli.iter().map(|stimulus| stimulus.n as usize).sum();
        let message_len = config.robots().filter_map(|(_, robot)| message_len(robot)).max();
        let discs = |properties: fn(&ObjectConfig) -> Option<(u32, f64, &str)>| -> Vec<Disc> {
            let objects = config.world.objects.iter();
            let kinds = objects.filter_map(|(name, object)| Some((name, properties(object)?)));
            let each = kinds.flat_map(|(name, (n, range, color))| {
                (0..n).map(move |_| Disc { name: name.clone(), color: color.into(), range })
            });
            each.collect()
        };
        Ok(Self {
            name: episode.name.to_owned(),
            experiment: config.name.clone(),
            seed: Seed(config.seed),
            generation: episode.trial_set.generation(),
            trial_set: match episode.trial_set {
                TrialSet::Generation(_) => "generation",
                TrialSet::HeldOut { .. } => "held-out",
                TrialSet::Judgement(_) => "judgement",
                TrialSet::Evaluation => "evaluation",
            },
            trial: episode.trial,
            trials: None,
            fitness_function: config.algorithm.fitness_function.name(),
            steps: config.algorithm.evaluation_steps,
            width: config.world.width,
            height: config.world.height,
            n_robots: robots.iter().map(|robots| robots.n).sum(),
            message_len: message_len.unwrap_or_default() as usize,
            n_inputs: robots.iter().map(n_inputs).max().unwrap_or_default(),
            n_neurons: config.topology.ensembles.values().map(|ensemble| ensemble.n as usize).sum(),
            ensembles: rows(
                config.topology.ensembles.iter().map(|(name, ensemble)| (&**name, ensemble.n)),
            ),
            robots,
            lights: discs(|object| match object {
                ObjectConfig::LightSource(light) => {
                    Some((light.num_instances, light.params.range, &light.params.color))
                }
                _ => None,
            }),
            areas: discs(|object| match object {
                ObjectConfig::GroundArea(area) => {
                    Some((area.num_instances, area.params.range, &area.params.color))
                }
                _ => None,
            }),
            room: episode.simulation.room(episode.trial_set, episode.trial)?,
            measure_names: episode.simulation.measure_names().to_vec(),
        })
    }
}

impl Robots {
    fn new(name: &str, robot: &RobotConfig, config: &ExperimentConfig) -> Self {
        let transmitter = robot.actuators.wireless_transmitter.as_ref();
        let receiver = robot.sensors.wireless_receiver.as_ref();
        let has_network = robot.controller == RobotController::NeuralController;
        let light = robot.sensors.reading_len(SensorQuery::Light).unwrap_or_default();
        Self {
            name: name.to_owned(),
            n: robot.num_instances as usize,
            emits_within: transmitter.map(|transmitter| transmitter.range),
            hears_within: receiver.map(|receiver| receiver.range),
            n_sectors: receiver.map_or(0, |receiver| receiver.n_sectors),
            n_levels: transmitter
                .filter(|transmitter| transmitter.quantize)
                .map(|transmitter| transmitter.n_levels()),
            stimuli: if has_network {
                rows(config.topology.stimuli.iter().map(|(name, stimulus)| (&**name, stimulus.n)))
            } else {
                rows([("light_sensor", light)].into_iter())
            },
            has_network,
            sees_lights: light > 0,
            sees_areas: robot.sensors.reading_len(SensorQuery::Ground).is_some_and(|n| n > 0),
        }
    }
}

fn rows<'a>(named: impl Iterator<Item = (&'a str, u32)>) -> Vec<Rows> {
    named.map(|(name, n)| Rows { name: name.to_owned(), n }).collect()
}

/// Components of the messages that a robot sends or hears; all have the same length.
fn message_len(robot: &RobotConfig) -> Option<u32> {
    let receiver = robot.sensors.wireless_receiver.as_ref();
    let transmitter = robot.actuators.wireless_transmitter.as_ref();
    receiver
        .map(|receiver| receiver.msg_length)
        .or(transmitter.map(|transmitter| transmitter.msg_length))
}
