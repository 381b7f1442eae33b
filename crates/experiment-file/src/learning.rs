//! Plasticity: weights that change while robots live.

use crate::DefaultValue::{Depends, Null};
use crate::parameters::parameters;
use crate::{Domain, limits};

const COEFFICIENT: [f64; 2] = [-limits::COEFFICIENT, limits::COEFFICIENT];

parameters! {
    /// How weights change while robots live. In every environment step but the first, a weight
    /// grows by `learning_rate` times the terms of A, B, C and D, which depend on the activities
    /// of both neurons. Each group has coefficients of its own, which can evolve
    /// (`learning:coefficients:NAME`).
    pub struct LearningConfig {
        /// Factor of all changes.
        learning_rate: f64 = unit(1e-4),
        /// Largest absolute value of a plastic weight. Larger ones of a genotype are cut at the
        /// first change.
        max_weight: f64 = of(
            Domain::Between(0.0, limits::PLASTIC_WEIGHT),
            Depends("10, of spiking neurons 1000"),
        ),
        /// Coefficient of the product of both activities. A group whose coefficients evolve does
        /// not use it.
        a as "A": f64 = between(COEFFICIENT, 1.0),
        /// Coefficient of the postsynaptic activity, used as `A` is.
        b as "B": f64 = between(COEFFICIENT, 0.0),
        /// Coefficient of the presynaptic activity, used as `A` is.
        c as "C": f64 = between(COEFFICIENT, 0.0),
        /// Constant term, used as `A` is.
        d as "D": f64 = between(COEFFICIENT, 0.0),
        /// Names of the plastic groups.
        synapses: Vec<String> = of(Domain::Names, Depends("all")),
        /// Makes changes depend on reward.
        reward: Option<RewardConfig> = of(Domain::Object(RewardConfig::OBJECT), Null)
            .null()
            .shown("null: they do not")
            .recent(),
    }

    /// How reward changes weights: a change follows from the activities of `delay` steps ago, times
    /// the discounted sum of the rewards since then. A reward is the fitness of a step, 0 if the
    /// step does not count.
    #[derive(Copy)]
    pub struct RewardConfig {
        /// Environment steps from the activities to the reward.
        delay: u32 = whole([1, limits::REWARD_DELAY], 30),
        /// Factor of each reward relative to the previous step's.
        discount: f64 = unit(0.9),
    }
}

impl LearningConfig {
    /// A, B, C and D of a group whose coefficients do not evolve.
    pub fn coefficients(&self) -> [f64; 4] {
        [self.a, self.b, self.c, self.d]
    }
}
