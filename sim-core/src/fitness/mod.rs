//! How well a swarm does its task (chapter 5 of the thesis).

mod borderline;
mod grouping;
mod leader;
mod light;
mod orientation;

use crate::record::Metrics;
use crate::swarm::Swarm;
use crate::torus::{Torus, Vec2};
use crate::world::World;
use experiment_file::FitnessFunction;

/// What a fitness function sees of a step: the robots that are judged, as they
/// acted and after they moved, and the lights before they move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment<'a> {
    /// The plane.
    pub torus: &'a Torus,
    /// Environment step, from 0.
    pub step: u32,
    /// Whether any robot changed its place in this step.
    pub moved: bool,
    /// Positions of the robots.
    pub positions: &'a [Vec2],
    /// Headings of the robots.
    pub headings: &'a [f64],
    /// Right and left wheel of the robots.
    pub wheels: &'a [[f64; 2]],
    /// Colours of the robots' LEDs.
    pub leds: &'a [u32],
    /// Which of the robots see light.
    pub photosensitive: &'a [bool],
    /// Positions of the lights.
    pub lights: &'a [Vec2],
}

impl<'a> Moment<'a> {
    /// This step of a trial.
    pub fn new(world: &'a World, swarm: &'a Swarm, lights: &'a [Vec2], step: u32) -> Self {
        let evaluated = world.evaluated();
        Self {
            torus: &world.torus,
            step,
            moved: swarm.moved,
            positions: &swarm.positions[evaluated.clone()],
            headings: &swarm.headings[evaluated.clone()],
            wheels: &swarm.wheels[evaluated.clone()],
            leds: &swarm.leds[evaluated.clone()],
            photosensitive: &swarm.photosensitive[evaluated],
            lights,
        }
    }
}

/// A fitness function in one trial. The trial's fitness is the mean over the
/// steps that count.
pub(crate) trait Fitness {
    /// Fitness of a step; none if it does not count.
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64>;

    /// Adds the measures of the step that was judged last.
    fn measure(&self, moment: &Moment<'_>, metrics: &mut Metrics);
}

/// All measures that a fitness function may give, in their order.
pub(crate) fn metric_names(function: FitnessFunction) -> &'static [&'static str] {
    match function {
        FitnessFunction::IdentifyLeader => leader::METRICS,
        FitnessFunction::IdentifyBorderline => borderline::METRICS,
        FitnessFunction::OrientationConsensus | FitnessFunction::Alignment => orientation::METRICS,
        FitnessFunction::GotoLight => light::METRICS,
        FitnessFunction::Grouping => grouping::METRICS,
    }
}

/// The named fitness function at the start of a trial.
pub(crate) fn new(function: FitnessFunction, world: &World) -> Box<dyn Fitness> {
    match function {
        FitnessFunction::IdentifyLeader => Box::new(leader::IdentifyLeader::default()),
        FitnessFunction::IdentifyBorderline => {
            Box::new(borderline::IdentifyBorderline::new(world.communication_range()))
        }
        FitnessFunction::OrientationConsensus => Box::new(orientation::OrientationConsensus),
        FitnessFunction::Alignment => Box::new(orientation::Alignment),
        FitnessFunction::GotoLight => Box::new(light::GotoLight),
        FitnessFunction::Grouping => Box::new(grouping::Grouping),
    }
}

/// Mean of values of a number of robots; 0 without any.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len();
    let sum = values.fold(0.0, |sum, value| sum + value);
    if n == 0 { 0.0 } else { sum / n as f64 }
}

/// What a step is measured as.
#[cfg(test)]
fn metrics(fitness: &mut dyn Fitness, moment: &Moment<'_>) -> Vec<(&'static str, f64)> {
    let mut metrics = Metrics::new();
    fitness.step(moment);
    fitness.measure(moment, &mut metrics);
    metrics.into_iter().collect()
}

#[cfg(test)]
impl Moment<'static> {
    /// Nobody, in a world of 1000 x 1000 cm.
    pub const EMPTY: Self = Self {
        torus: &Torus { width: 1000.0, height: 1000.0 },
        step: 0,
        moved: true,
        positions: &[],
        headings: &[],
        wheels: &[],
        leds: &[],
        photosensitive: &[],
        lights: &[],
    };
}
