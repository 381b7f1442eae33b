//! Records of an episode: every robot in every step, and the fitness and measures of the task.

use std::borrow::Cow;
use std::ops::Not;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Serialize;

use crate::communication::Mode;
use crate::torus::Vec2;

/// Name of a measure.
pub type MeasureName = Cow<'static, str>;

/// Named measures of a task, beside its fitness; `docs/evaluation.md` lists them with their units.
/// A measure is absent in a step in which it is undefined, such as the distance to a light in a
/// world without lights.
pub type Measures = IndexMap<MeasureName, f64>;

/// The result of a watched episode.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EpisodeSummary {
    /// The fitness of the episode.
    #[schemars(with = "Option<f64>")]
    pub fitness: f64,
    /// Means of the measures over the steps that have them, by name.
    #[serde(rename = "metrics")]
    #[schemars(with = "IndexMap<MeasureName, Option<f64>>")]
    pub measures: Measures,
}

/// One environment step of a trial.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StepRecord {
    /// From 0.
    pub step: u32,
    /// Fitness of the step; `None` if it does not count.
    pub fitness: Option<f64>,
    /// Measures of the step.
    #[serde(rename = "metrics")]
    pub measures: Measures,
    /// All robots, in the order of the objects of the world.
    pub robots: Vec<RobotRecord>,
    /// Positions of all lights during the step, cm.
    pub lights: Vec<Vec2>,
    /// Positions of all ground areas during the step, cm.
    pub areas: Vec<Vec2>,
    /// All movables at the end of the step, in the order of the objects of the world.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub movables: Vec<MovableRecord>,
}

/// A movable in one step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct MovableRecord {
    /// Its centre of mass, cm.
    pub position: Vec2,
    /// Radians in \[0, 2 pi).
    pub heading: f64,
}

/// The room of a trial in a world with bodies: all that does not change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoomRecord {
    /// Corners of the boundary, counter-clockwise, cm.
    pub boundary: Vec<Vec2>,
    /// The ends of each part of a wall, cm.
    pub walls: Vec<[Vec2; 2]>,
    /// Obstacles at their places.
    pub obstacles: Vec<Outline>,
    /// Movables, about their centre of mass and with heading 0.
    pub movables: Vec<Outline>,
    /// Radius of each robot, cm.
    pub radii: Vec<f64>,
}

/// A shape.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outline {
    /// A disc.
    Disc {
        /// cm
        center: Vec2,
        /// cm
        radius: f64,
    },
    /// The corners of a polygon, cm.
    Polygon(Vec<Vec2>),
}

/// One robot in one step.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RobotRecord {
    /// Position at the end of the step, cm.
    pub position: Vec2,
    /// Heading at the end of the step, radians in \[0, 2 pi).
    pub heading: f64,
    /// The stimuli of its controller, one value per input.
    pub stimuli: Vec<f64>,
    /// Activity of every neuron after the step, in the order of
    /// [`Simulation::network_json`](crate::Simulation::network_json); empty without a network.
    /// For spiking neurons, the share of substeps with a spike.
    pub activity: Vec<f64>,
    /// Voltage of every spiking neuron after the step, mV, in the same order; empty without
    /// spiking neurons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub voltages: Vec<f64>,
    /// The frame that the robot took from the air; `None` if it took none.
    pub received: Option<ReceivedFrame>,
    /// The message of that frame; zeros without a frame.
    pub received_message: Vec<f64>,
    /// Actions of the right and left wheel, in \[-1, 1\]: what the wheels are told, whatever they
    /// do in a pseudo-reality.
    pub wheels: [f64; 2],
    /// Colour of its LED, 0 off.
    pub led: u32,
    /// Whether it sends or relays.
    pub mode: Mode,
    /// Its own message after quantisation, components in \[0, 1\]; on the air if `mode` is
    /// [`Mode::Send`].
    pub message: Vec<f64>,
    /// Whether a script has made it fail.
    #[serde(skip_serializing_if = "Not::not")]
    pub failed: bool,
    /// Whether it carries something, as a script decides.
    #[serde(skip_serializing_if = "Not::not")]
    pub carries: bool,
    /// Whether its body touches something.
    #[serde(skip_serializing_if = "Not::not")]
    pub touches: bool,
    /// Whether its LED should be on; `None` if the task does not define it.
    pub target: Option<bool>,
}

/// A frame that a robot took from the air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReceivedFrame {
    /// The robot that emitted it.
    pub emitter: usize,
    /// The robot whose message it carries.
    pub originator: usize,
    /// Number of emissions so far, from 1.
    pub hops: u32,
    /// The sector that received it.
    pub sector: usize,
    /// Its strength as the radio measures it, in \[0, 1\].
    pub signal: f64,
}
