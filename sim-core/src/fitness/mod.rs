//! How well a swarm does its task.

mod leader;

use crate::config::FitnessFunction;

/// What a fitness function sees of a step: the robots that are judged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment<'a> {
    /// Colours of their LEDs.
    pub leds: &'a [u32],
}

/// A fitness function in one trial. The trial's fitness is the mean over the
/// steps that count.
pub(crate) trait Fitness {
    /// Fitness of a step; none if it does not count.
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64>;
}

/// Whether [`new`] knows the function.
pub(crate) fn is_supported(function: FitnessFunction) -> bool {
    function == FitnessFunction::IdentifyLeader
}

/// The named fitness function at the start of a trial.
pub(crate) fn new(_function: FitnessFunction) -> Box<dyn Fitness> {
    Box::new(leader::IdentifyLeader::default())
}
