//! Tries whether the world has room for its objects: their sizes alone do not show it.

use std::time::Duration;

use determinism::random::TrialSet;
use experiment_file::{AlgorithmConfig, ConfigError};

use crate::initializers::Positions;
use crate::objects::Site;
use crate::problems::Problems;
use crate::script;
use crate::simulation::{EvaluateError, Simulation};
use crate::trial;

/// Most starts to try: enough to find a failure that happens once in a hundred trials.
const N_STARTS_MAX: u64 = 512;
/// Number of steps of the episode that tries a script.
const N_TRIED_STEPS: u32 = 50;
/// Approximate number of distances between robots that a check may compute.
const N_PAIRS_MAX: u64 = 50_000_000;

/// Time after which callers should stop trying an experiment. An incomplete trial is only a
/// warning, so no clock decides whether an experiment is accepted.
pub const TRYING_TIME_MAX: Duration = Duration::from_secs(2);

/// The extent to which an experiment was tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum Tried {
    /// Completely.
    All,
    /// Until the caller stopped it, without a problem so far.
    InPart,
}

impl Tried {
    /// The warning for people, if the trial was incomplete.
    pub fn warning(self) -> Option<&'static str> {
        match self {
            Self::All => None,
            Self::InPart => Some(
                "its start takes long, so only a part of it was tried: a mistake of the script, or \
                 a world too small for its objects, may appear only during the run",
            ),
        }
    }
}

impl Simulation {
    /// Tries the start positions of a run's trials: those of the judgement at its end, then those
    /// of its first generations, up to a limit of work. A trial in which an object finds no place
    /// would end the run.
    ///
    /// This check also executes a script for the first steps of an episode, to find its mistakes
    /// before the run. `goes_on` returns false to stop, for example by a clock; the result is then
    /// [`Tried::InPart`].
    ///
    /// # Errors
    ///
    /// If an object finds no place, or if the script fails.
    pub fn check_starts(
        &self,
        algorithm: &AlgorithmConfig,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Tried, ConfigError> {
        if !self.try_script(goes_on)? {
            return Ok(Tried::InPart);
        }
        let n_pairs: u64 = self.world.sites().map(n_pairs_of_a_draw).sum();
        if n_pairs == 0 {
            return Ok(Tried::All);
        }
        let n_starts = (N_PAIRS_MAX / n_pairs).clamp(1, N_STARTS_MAX);
        let last = algorithm.generations.saturating_sub(1);
        let judgement =
            (0..algorithm.judgement_trials).map(|trial| (TrialSet::Judgement(last), trial));
        let generations = (0..=last).flat_map(|generation| {
            let trials = 0..algorithm.num_evaluations;
            trials.map(move |trial| (TrialSet::Generation(generation), trial))
        });
        let mut problems = Problems::default();
        for (trial_set, trial) in judgement.chain(generations).take(n_starts as usize) {
            if !goes_on() {
                return Ok(Tried::InPart);
            }
            if let Err(EvaluateError::Unplaceable { object, index, .. }) =
                trial::try_places(self, trial_set, trial)
            {
                let path = format!("world.objects.{object}.initializers.positions");
                let message = format!(
                    "no place for number {index} in {trial_set}, trial {trial}, which would end the \
                     run; make the world larger or the number of robots smaller"
                );
                problems.add(path, message);
                break;
            }
        }
        problems.check()?;
        Ok(Tried::All)
    }

    /// Executes the script in a short episode, including its measures; false if it was stopped.
    fn try_script(&self, goes_on: &dyn Fn() -> bool) -> Result<bool, ConfigError> {
        if self.script.is_none() {
            return Ok(true);
        }
        let mut short = self.clone();
        short.n_steps = self.n_steps.min(N_TRIED_STEPS);
        let genotype = vec![0.5; self.genotype_len()];
        let tried = short.measure_while(&genotype, TrialSet::Generation(0), 0..1, goes_on);
        let mut problems = Problems::default();
        if let Err(error @ EvaluateError::Script { .. }) = &tried {
            problems.add(script::PATH, error.to_string());
        }
        problems.check()?;
        Ok(!matches!(tried, Ok(None)))
    }
}

/// Number of distances to compute for placing an object's instances; 0 if they always find a
/// place.
fn n_pairs_of_a_draw(site: &Site) -> u64 {
    match site.positions {
        Positions::Graph { n, .. } => (n as u64 * n as u64).max(1),
        Positions::Fixed(_) | Positions::Uniform { .. } | Positions::Circumference { .. } => 0,
    }
}

#[cfg(test)]
mod tests {
    use experiment_file::{ExperimentConfig, Initializer};

    use super::*;
    use crate::testing::{experiment_a, robot};

    /// Robots in a small world, with one trial per generation.
    fn config(n_robots: u32) -> ExperimentConfig {
        let mut config = experiment_a();
        config.algorithm.num_evaluations = 1;
        config.algorithm.generations = 3;
        config.algorithm.evaluation_steps = 1;
        config.world.width = 250.0;
        config.world.height = 250.0;
        let robot = robot(&mut config);
        robot.num_instances = n_robots;
        robot.initializers.positions =
            Initializer::RandomGraph { max_rad: 100.0, initial_pos: [125.0, 125.0] };
        config
    }

    #[test]
    fn a_world_that_holds_its_robots_in_some_trials_only_is_found() {
        let mut n_found = 0;
        for n_robots in 2..40 {
            let config = config(n_robots);
            // Compilation tries only the first trial of the first generation, which must have a
            // place for all.
            let Ok(simulation) = Simulation::compile(&config) else { continue };
            let Err(error) = simulation.check_starts(&config.algorithm, &|| true) else { continue };
            n_found += 1;
            let text = error.to_string();
            assert!(text.contains("initializers.positions: no place for number"), "{text}");
            assert!(text.contains("make the world larger"), "{text}");
            let genotype = vec![0.5; simulation.genotype_len()];
            let sets = [TrialSet::Judgement(2), TrialSet::Generation(1), TrialSet::Generation(2)];
            let is_real = sets.iter().any(|&set| {
                let n_trials = if set == sets[0] { config.algorithm.judgement_trials } else { 1 };
                (0..n_trials)
                    .any(|trial| simulation.evaluate(&genotype, set, trial..trial + 1).is_err())
            });
            assert!(is_real, "{n_robots} robots: {text}");
        }
        assert!(n_found > 0, "some numbers of robots fit only sometimes");
    }

    #[test]
    fn a_world_with_room_is_not_refused() {
        let roomy = config(3);
        let tried = Simulation::compile(&roomy).unwrap().check_starts(&roomy.algorithm, &|| true);
        assert_eq!(tried, Ok(Tried::All));
    }
}
