//! Plasticity: weights that change while robots live.

use crate::DefaultValue::{Depends, Null};
use crate::parameters::parameters;
use crate::{Domain, limits};

const COEFFICIENT: [f64; 2] = [-limits::COEFFICIENT, limits::COEFFICIENT];

parameters! {
    /// How weights change while robots live: before every environment step but the first, each
    /// weight of a plastic group grows by `learning_rate` R (A x_i x_j + B x_i + C x_j + D), and
    /// is then cut to `max_weight`. x are the activities of the postsynaptic neuron i and the
    /// presynaptic side j in the step before: u of rate neurons, the share of substeps with a
    /// spike of what spikes, the value of a stimulus. R is 1 without `reward`. A group has
    /// coefficients of its own, which can evolve (`learning:coefficients`).
    pub struct LearningConfig {
        /// Factor of all changes.
        learning_rate: f64 = unit(1e-4),
        /// Largest absolute value of a plastic weight.
        max_weight: f64 = of(
            Domain::Between(0.0, limits::PLASTIC_WEIGHT),
            Depends("10, of spiking neurons 1000"),
        ),
        /// A of groups whose coefficients do not evolve.
        a as "A": f64 = between(COEFFICIENT, 1.0),
        /// B, likewise.
        b as "B": f64 = between(COEFFICIENT, 0.0),
        /// C, likewise.
        c as "C": f64 = between(COEFFICIENT, 0.0),
        /// D, likewise.
        d as "D": f64 = between(COEFFICIENT, 0.0),
        /// Names of the plastic groups.
        synapses: Vec<String> = of(Domain::Names, Depends("all")),
        /// Makes changes depend on reward.
        reward: Option<RewardConfig> = of(Domain::Object(RewardConfig::OBJECT), Null)
            .null()
            .shown("null: they do not")
            .recent(),
    }

    /// How reward changes weights: x are those of `delay` steps ago, and R is the sum of the
    /// rewards since then, r + discount r' + discount^2 r'' + ... A reward is the fitness of a
    /// step, 0 where it does not count.
    #[derive(Copy)]
    pub struct RewardConfig {
        /// Environment steps.
        delay: u32 = whole([1, limits::REWARD_DELAY], 30),
        /// Factor of each reward against the one before.
        discount: f64 = unit(0.9),
    }
}

impl LearningConfig {
    /// A, B, C and D of a group whose coefficients do not evolve.
    pub fn coefficients(&self) -> [f64; 4] {
        [self.a, self.b, self.c, self.d]
    }
}
