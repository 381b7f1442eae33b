//! Aims: measures that evolution maximises or minimises beside fitness.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::DefaultValue::{Name, Required};
use crate::parameters::{parameters, variants};
use crate::{AlgorithmConfig, Domain, Summarises};

/// Whether more or less of a measure is better.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// More is better.
    #[default]
    Maximise,
    /// Less is better.
    Minimise,
}

variants! {
    Direction, unsupported: &[];
}

parameters! {
    /// A measure that evolution maximises or minimises beside fitness. An individual dominates
    /// another one if it is at least as good in fitness and all aims, and better in one of them.
    pub struct AimConfig {
        /// Name of a measure of the fitness function or of the script.
        measure: String = of(Domain::Text, Required),
        /// Which value of a trial counts. An individual's value is its mean over the trials.
        summarises as "of": Summarises = of(Domain::Variant(Summarises::VARIANTS), Name("mean")),
        /// Whether more or less of it is better.
        direction: Direction = of(Domain::Variant(Direction::VARIANTS), Required),
    }
}

/// A measure of a trial from which evolution learns, beside fitness.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LearntMeasure<'a> {
    /// The place in the file that names it.
    pub path: String,
    /// Its name.
    pub measure: &'a str,
    /// Which value of a trial counts.
    pub summarises: Summarises,
}

impl AlgorithmConfig {
    /// Whether candidates for the champion are compared after this many generations, in the middle
    /// of a run.
    pub fn compares_after(&self, n_generations: u64) -> bool {
        n_generations.is_multiple_of(self.champion_every)
    }

    /// The measures from which evolution learns, in the order of their values: descriptors, then
    /// aims. An experiment has only one of both.
    pub fn learnt_measures(&self) -> impl Iterator<Item = LearntMeasure<'_>> {
        let of = |key: &str, i: usize| format!("algorithm.{key}[{i}].measure");
        let descriptors =
            self.descriptors.iter().enumerate().map(move |(i, descriptor)| LearntMeasure {
                path: of("descriptors", i),
                measure: &descriptor.measure,
                summarises: descriptor.summarises,
            });
        let aims = self.aims.iter().enumerate().map(move |(i, aim)| LearntMeasure {
            path: of("aims", i),
            measure: &aim.measure,
            summarises: aim.summarises,
        });
        descriptors.chain(aims)
    }
}
