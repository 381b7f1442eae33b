//! Fitness functions of swarms (chapter 5 of the thesis).
//!
//! A fitness function is a row in `experiment-file`'s `fitness`, with its name and requirements,
//! and a [`Definition`] beside its code here. Each file has the functions of one subject.

mod borderline;
mod grouping;
mod leader;
mod light;
mod orientation;

use crate::record::Measures;
use crate::swarm::Swarm;
use crate::torus::{Torus, Vec2};
use crate::world::World;
use experiment_file::{FitnessFunction, FitnessParams};

/// The data of a step for a fitness function: the evaluated robots after their motion, their
/// actions, and the lights before their motion.
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
    /// Whether each robot sees light.
    pub photosensitive: &'a [bool],
    /// Positions of the lights.
    pub lights: &'a [Vec2],
}

impl<'a> Moment<'a> {
    /// The moment of a step.
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
    /// Fitness of a step; `None` if it does not count.
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64>;

    /// Adds the measures of the last scored step.
    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures);

    /// Whether each robot's LED should have been on in the last scored step; empty if the task
    /// does not define it.
    fn targets(&self) -> &[bool] {
        &[]
    }
}

/// The part of a fitness function that all trials share.
#[derive(Debug)]
pub(crate) struct Definition {
    /// Its name in experiment files.
    pub function: FitnessFunction,
    /// Names of all its measures, in order.
    pub measures: &'static [&'static str],
    /// Creates the function at the start of a trial.
    pub start: fn(&World, &FitnessParams) -> Box<dyn Fitness>,
}

/// The definition of a fitness function; `None` for the script's.
pub(crate) fn definition(function: FitnessFunction) -> Option<&'static Definition> {
    [
        leader::DEFINITIONS,
        borderline::DEFINITIONS,
        orientation::DEFINITIONS,
        light::DEFINITIONS,
        grouping::DEFINITIONS,
    ]
    .into_iter()
    .flatten()
    .find(|definition| definition.function == function)
}

/// Mean of values of a number of robots; 0 without any.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len();
    let sum = values.fold(0.0, |sum, value| sum + value);
    if n == 0 { 0.0 } else { sum / n as f64 }
}

#[cfg(test)]
use std::borrow::Cow;

/// The measures of a step.
#[cfg(test)]
fn measures(fitness: &mut dyn Fitness, moment: &Moment<'_>) -> Vec<(&'static str, f64)> {
    let mut measures = Measures::new();
    fitness.step(moment);
    fitness.measure(moment, &mut measures);
    let name = |name| match name {
        Cow::Borrowed(name) => name,
        Cow::Owned(name) => unreachable!("the name {name} is no literal"),
    };
    measures.into_iter().map(|(measure, value)| (name(measure), value)).collect()
}

#[test]
fn every_fitness_function_is_defined() {
    for &function in FitnessFunction::ALL {
        let is_script = function == FitnessFunction::Script;
        assert_eq!(definition(function).is_none(), is_script, "{}", function.name());
    }
}

#[cfg(test)]
impl Moment<'static> {
    /// A moment without robots, in a world of 1000 x 1000 cm.
    pub const EMPTY: Self = Self {
        torus: &Torus::new(1000.0, 1000.0),
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
