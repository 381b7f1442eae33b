//! Statistics of runs.

use crate::{ids::ExperimentId, store::GenerationRecord};

use super::Runs;

/// Statistics of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunStats {
    /// Its experiment.
    pub experiment: ExperimentId,
    /// Name of the experiment.
    pub name: String,
    /// Number of generations that it should have.
    pub generations_wanted: u64,
    /// The latest generation that is on disk.
    pub latest: Option<GenerationRecord>,
}

impl Runs {
    /// Statistics of all runs, in the order of their experiments.
    pub fn stats(&self) -> Vec<RunStats> {
        let stats = self.runs.iter().map(|(&experiment, run)| RunStats {
            experiment,
            name: run.config.name.clone(),
            generations_wanted: run.config.algorithm.generations,
            latest: run.latest.clone(),
        });
        stats.collect()
    }
}
