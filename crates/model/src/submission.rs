//! Turns an experiment file into an experiment that can be stored and run.

mod difference;

use experiment_file::{ConfigError, ExperimentConfig, Problem};
use sim_core::Simulation;

use crate::{
    group::Membership,
    labels::Labels,
    priority::Priority,
    store::{ForkRecord, NewExperiment, StoredExperiment},
};
use evolution::{ALGORITHMS, Digest, Evolution, Fork};

/// A client's submission.
#[derive(Debug, Clone, Default)]
pub struct Submission {
    /// Key against double submission.
    pub request_id: Option<String>,
    /// The experiment file.
    pub config_json: String,
    /// Name if the file gives none.
    pub default_name: String,
    /// Replaces the file's seed.
    pub seed: Option<u64>,
    /// Replaces the file's number of generations.
    pub generations: Option<u64>,
    /// Its priority.
    pub priority: Priority,
    /// Its group, if any.
    pub membership: Option<Membership>,
    /// Its labels, by which people find it.
    pub labels: Labels,
    /// Its parent, if it is a fork.
    pub parent: Option<Parent>,
}

/// The parent of a fork.
#[derive(Debug, Clone)]
pub struct Parent {
    /// The parent experiment.
    pub experiment: StoredExperiment,
    /// Its evolution after the last shared generation.
    pub evolution: Evolution,
}

/// A submission that has passed all checks.
#[derive(Debug)]
pub struct CheckedSubmission {
    /// For the store.
    pub new: NewExperiment,
    /// Keys of the file without effect, and parameters that keep their defaults; one
    /// line each.
    pub warnings: Vec<String>,
}

impl Submission {
    /// Checks a submission completely; it can run if this succeeds. If `goes_on` returns false,
    /// the check stops trying start positions, and warns of that.
    pub fn check(self, goes_on: &dyn Fn() -> bool) -> Result<CheckedSubmission, ConfigError> {
        let (mut config, warnings) =
            ExperimentConfig::from_json(&self.config_json, &self.default_name, ALGORITHMS)?;
        if self.seed.is_some() || self.generations.is_some() {
            config.seed = self.seed.unwrap_or(config.seed);
            config.algorithm.generations = self.generations.unwrap_or(config.algorithm.generations);
            // The limits of a file also apply to values that replace parts of it.
            let name = config.name.clone();
            (config, _) =
                ExperimentConfig::from_json(&config.to_canonical_json(), &name, ALGORITHMS)?;
        }
        let experiment = Simulation::compile(&config)?;
        let tried = experiment.check_starts(&config.algorithm, goes_on)?;
        let (evolution, fork) = match self.parent {
            Some(parent) => {
                let (evolution, fork) = parent.fork(&config, &experiment)?;
                (evolution, Some(fork))
            }
            None => {
                let segments = experiment.population_segments();
                (Evolution::new(&config, segments, sim_core::FINGERPRINT), None)
            }
        };
        let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        warnings.extend(experiment.uncovered_parameters().iter().cloned());
        warnings.extend(tried.warning().map(str::to_owned));
        let new = NewExperiment {
            request_id: self.request_id,
            config_digest: Digest::of_config(&config, sim_core::FINGERPRINT),
            genotype_len: experiment.genotype_len(),
            keyframe: evolution.keyframe(),
            champion: evolution.champion().cloned(),
            fork,
            priority: self.priority,
            membership: self.membership,
            labels: self.labels,
            config,
        };
        Ok(CheckedSubmission { new, warnings })
    }
}

impl Parent {
    /// Forks the parent's evolution with another configuration.
    fn fork(
        self,
        config: &ExperimentConfig,
        simulation: &Simulation,
    ) -> Result<(Evolution, ForkRecord), ConfigError> {
        let Self { experiment, evolution } = self;
        let (parent, _) = ExperimentConfig::from_json(&experiment.config_json, "", ALGORITHMS)?;
        let n_shared = evolution.n_generations();
        let fork = Fork {
            parent: &parent,
            parent_simulation: &experiment.fingerprint,
            child: config,
            segments: simulation.population_segments(),
            simulation: sim_core::FINGERPRINT,
        };
        let evolution = evolution.fork(&fork).map_err(|error| ConfigError {
            problems: error.problems.into_iter().map(problem).collect(),
        })?;
        let record = ForkRecord {
            parent: experiment.id,
            generation: n_shared - 1,
            link: evolution.digest().to_string(),
            changes: difference::difference(&experiment.config_json, &config.to_canonical_json()),
        };
        Ok((evolution, record))
    }
}

fn problem(message: String) -> Problem {
    Problem { path: String::new(), line: None, message }
}
