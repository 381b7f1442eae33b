//! The fitness functions that a file may name: one row each in [`fitness_functions!`] below, from
//! which the reader, the schema and the checks follow. `sim-core`'s `fitness` computes them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ActuatorQuery;
use crate::parameters::{parameters, variants};

/// A requirement of a fitness function on the experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// The network drives this actuator.
    OutputTo(ActuatorQuery),
    /// There is a light in the world.
    Light,
    /// The file brings a script.
    Script,
    /// An episode is longer than this many first steps, which do not count.
    StepsBeyond(u32),
}

parameters! {
    /// Constants of fitness functions.
    #[derive(Copy)]
    pub struct FitnessParams: Default {
        /// alpha of the alpha shape whose border `identify_borderline` and `world.border()` of
        /// scripts use: circumradii are below the world's width / alpha.
        alpha: f64 = positive(15.0).recent(),
        /// Distance to a light that counts as near in `goto_light`, cm.
        near: f64 = amount(80.0).recent(),
    }
}

variants! {
    FitnessFunction, unsupported: &[];
}

/// Steps at the start of an episode that `alignment` does not count.
pub const ALIGNMENT_SETTLING_STEPS: u32 = 100;

/// Declares the fitness functions. Each has one row: its name in the file, and its requirements.
macro_rules! fitness_functions {
    ($(
        $(#[doc = $doc:literal])*
        $name:literal = $function:ident: [$($need:expr),*],
    )*) => {
        /// How the fitness of a trial is computed.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum FitnessFunction {
            $(
                $(#[doc = $doc])*
                #[serde(rename = $name)]
                $function,
            )*
        }

        impl FitnessFunction {
            /// All fitness functions.
            pub const ALL: &[Self] = &[$(Self::$function),*];

            /// Its name in the file.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$function => $name,)*
                }
            }

            /// Its requirements on the experiment.
            pub(crate) fn needs(self) -> &'static [Need] {
                match self {
                    $(Self::$function => &[$($need),*],)*
                }
            }
        }
    };
}

fitness_functions! {
    /// Experiment A: exactly one robot, and always the same, has its LED on.
    "identify_leader" = IdentifyLeader: [Need::OutputTo(ActuatorQuery::Led)],
    /// Experiment B: robots on the swarm's border have their LED on.
    "identify_borderline" = IdentifyBorderline: [Need::OutputTo(ActuatorQuery::Led)],
    /// Experiment C: robots have the same heading and do not turn (Eq. 5.5).
    "orientation_consensus" = OrientationConsensus: [Need::OutputTo(ActuatorQuery::Wheels)],
    /// Experiment C as in SpikeSwarmSim. The first 100 steps do not count.
    "alignment" = Alignment: [
        Need::OutputTo(ActuatorQuery::Wheels),
        Need::StepsBeyond(ALIGNMENT_SETTLING_STEPS)
    ],
    /// Experiment D: robots near the light.
    "goto_light" = GotoLight: [Need::Light],
    /// Robots near their centroid, but not on top of each other.
    "grouping" = Grouping: [],
    /// The function `fitness` of `task.script`; the default of files that have one.
    "script" = Script: [Need::Script],
}
