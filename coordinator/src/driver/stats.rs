//! How things stand, as numbers.

use crate::{
    clock,
    engine::{FleetStats, JobStats},
    runs::RunStats,
};

use super::Driver;

/// How things stand at a moment.
#[derive(Debug, Default)]
pub struct StatsSnapshot {
    /// The fleet.
    pub fleet: FleetStats,
    /// Every unfinished experiment that this program can compute, and its work.
    pub runs: Vec<(RunStats, JobStats)>,
}

impl Driver {
    /// How things stand now.
    pub(super) fn stats(&self) -> StatsSnapshot {
        let runs = self.runs.stats().into_iter().map(|run| {
            let work = self.engine.job_stats(run.experiment.into());
            (run, work)
        });
        StatsSnapshot { runs: runs.collect(), fleet: self.engine.fleet_stats(clock::now()) }
    }
}
