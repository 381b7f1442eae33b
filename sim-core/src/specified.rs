//! Simulates an experiment from the text of its specification, the form in which processes
//! exchange experiments. The result is numbers or a failure message.
//!
//! The simulation is deterministic, and so are its failures: every process that computes an item
//! with this module returns the same message, to the byte.

use std::{
    any::Any,
    ops::Range,
    panic::{self, AssertUnwindSafe},
};

use determinism::{Isa, random::TrialSet};
use experiment_file::{ConfigError, ExperimentConfig};

use crate::{Output, Simulation};

/// A simulation that is compiled from text, and whose failures are messages.
#[derive(Debug)]
pub struct SpecifiedSimulation {
    simulation: Simulation,
    robot_steps: u64,
}

impl SpecifiedSimulation {
    /// Compiles a specification, which is an experiment in its canonical form.
    ///
    /// # Errors
    ///
    /// The failure message of every item of that experiment, if the specification is invalid.
    pub fn compile(config_json: &str, isa: Isa) -> Result<Self, String> {
        Self::try_compile(config_json, isa)
            .map_err(|error| format!("the experiment's specification is not valid: {error}"))
    }

    fn try_compile(config_json: &str, isa: Isa) -> Result<Self, ConfigError> {
        let config = ExperimentConfig::from_canonical_json(config_json)?;
        let simulation = Simulation::compile(&config)?.with_isa(isa);
        let n_robots: u64 = config.robots().map(|(_, robot)| u64::from(robot.num_instances)).sum();
        let robot_steps = n_robots * u64::from(config.algorithm.evaluation_steps);
        Ok(Self { simulation, robot_steps })
    }

    /// Environment steps of an episode, summed over robots.
    pub fn robot_steps_per_episode(&self) -> u64 {
        self.robot_steps
    }

    /// Computes the trials of one genotype with [`Simulation::evaluate_while`],
    /// [`Simulation::measure_while`] or [`Simulation::describe_while`], depending on `output`.
    /// `None` if `keep_going` stopped it.
    ///
    /// # Errors
    ///
    /// The failure message of the item.
    pub fn compute(
        &self,
        genotype: &[f64],
        trial_set: TrialSet,
        trials: Range<u32>,
        output: Output,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<f64>>, String> {
        let Self { simulation, .. } = self;
        let computed = match output {
            Output::Fitness => simulation.evaluate_while(genotype, trial_set, trials, keep_going),
            Output::Measures => simulation.measure_while(genotype, trial_set, trials, keep_going),
            Output::Descriptors => {
                simulation.describe_while(genotype, trial_set, trials, keep_going)
            }
        };
        computed.map_err(|error| error.to_string())
    }
}

/// Runs a computation; a panic fails the computation, not the process.
///
/// # Errors
///
/// The error of the computation, or the message of its panic.
pub fn panic_to_failure<T>(computation: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    panic::catch_unwind(AssertUnwindSafe(computation))
        .unwrap_or_else(|payload| Err(format!("panicked: {}", panic_message(&*payload))))
}

/// The message of a caught panic.
pub fn panic_message(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_messages() {
        let invalid = SpecifiedSimulation::compile("{}", Isa::best()).unwrap_err();
        let start = "the experiment's specification is not valid: ";
        assert!(invalid.starts_with(start), "{invalid}");
        let fail = |message: &'static str| panic_to_failure::<()>(move || panic!("{message}"));
        assert_eq!(fail("no such robot"), Err("panicked: no such robot".into()));
        let robot = 1;
        let formatted = panic_to_failure::<()>(|| panic!("robot {robot}"));
        assert_eq!(formatted, Err("panicked: robot 1".into()));
        assert_eq!(panic_to_failure(|| Ok(3)), Ok(3));
    }
}
