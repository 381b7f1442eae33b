//! What there is to see in an episode: every robot in every step, and how well
//! the task is done.

use std::borrow::Cow;
use std::ops::Not;

use indexmap::IndexMap;
use serde::Serialize;

use crate::communication::Mode;
use crate::torus::Vec2;

/// Name of a measure.
pub type MeasureName = Cow<'static, str>;

/// Named measures of a task, beside its fitness; `docs/evaluation.md` lists them
/// with their units. A measure that does not exist in a step (of distances to a
/// light without lights, of robots with the LED on when there are none) is absent.
pub type Measures = IndexMap<MeasureName, f64>;

/// The result of an episode that was watched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EpisodeSummary {
    /// The same as [`Simulation::evaluate`](crate::Simulation::evaluate) gives.
    pub fitness: f64,
    /// Means over the steps.
    #[serde(rename = "metrics")]
    pub measures: Measures,
}

/// One environment step of a trial.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StepRecord {
    /// From 0.
    pub step: u32,
    /// Fitness of the step; none if it does not count.
    pub fitness: Option<f64>,
    /// Measures of the step.
    #[serde(rename = "metrics")]
    pub measures: Measures,
    /// All robots, in the order of the objects of the world.
    pub robots: Vec<RobotRecord>,
    /// Positions of all lights during the step.
    pub lights: Vec<Vec2>,
    /// Positions of all ground areas during the step.
    pub areas: Vec<Vec2>,
}

/// One robot in one step.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RobotRecord {
    /// Position at the end of the step, cm.
    pub position: Vec2,
    /// Heading at the end of the step, in \[0, 2 pi).
    pub heading: f64,
    /// What its controller got, input by input.
    pub stimuli: Vec<f64>,
    /// Activity of every neuron of its network after the step, in the order of
    /// [`Simulation::network_json`](crate::Simulation::network_json); empty without a network.
    pub activity: Vec<f64>,
    /// Voltage of every spiking neuron after the step, mV, in the same order; empty
    /// without spiking neurons. Their activity is the share of substeps with a spike.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub voltages: Vec<f64>,
    /// The frame that it took from the air.
    pub received: Option<ReceivedFrame>,
    /// The message of that frame; zeros without one.
    pub received_message: Vec<f64>,
    /// Actions of the right and left wheel, in \[-1, 1\].
    pub wheels: [f64; 2],
    /// Colour of its LED, 0 off.
    pub led: u32,
    /// Whether it sent or relayed.
    pub mode: Mode,
    /// Its own message, as quantised; on the air if it sent.
    pub message: Vec<f64>,
    /// Whether a script has put it out of order.
    #[serde(skip_serializing_if = "Not::not")]
    pub failed: bool,
    /// Whether it carries something, as a script says.
    #[serde(skip_serializing_if = "Not::not")]
    pub carries: bool,
    /// Whether its LED should be on, where the task says who it should be.
    pub target: Option<bool>,
}

/// A frame that a robot took from the air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReceivedFrame {
    /// The robot from which it came.
    pub emitter: usize,
    /// The robot whose message it carries.
    pub originator: usize,
    /// Emissions until then, from 1.
    pub hops: u32,
    /// The sector that received it.
    pub sector: usize,
    /// Its strength, in (0, 1\].
    pub signal: f64,
}
