//! Statistics for the metrics endpoint.

use engine::{FleetStats, JobStats};

use crate::{clock, runs::RunStats};

use super::Driver;

/// Statistics of fleet and experiments at one moment.
#[derive(Debug, Default)]
pub struct StatsSnapshot {
    /// The fleet.
    pub fleet: FleetStats,
    /// Every unfinished experiment that this program can compute, and its work.
    pub runs: Vec<(RunStats, JobStats)>,
}

impl Driver {
    /// The present statistics.
    pub(super) fn stats(&self) -> StatsSnapshot {
        let runs = self.runs.stats().into_iter().map(|run| {
            let work = self.engine.job_stats(run.experiment.into());
            (run, work)
        });
        StatsSnapshot { runs: runs.collect(), fleet: self.engine.fleet_stats(clock::engine_now()) }
    }
}
