//! How things stand, as numbers.

use crate::{
    clock,
    engine::{FleetStats, JobStats},
    ids::ExperimentId,
    store::Generation,
};

use super::Driver;

/// How things stand.
#[derive(Debug, Default)]
pub struct Figures {
    /// Who computes.
    pub fleet: FleetStats,
    /// What is computed: every unfinished experiment that this program can compute.
    pub experiments: Vec<ExperimentFigures>,
}

/// How an experiment stands.
#[derive(Debug)]
pub struct ExperimentFigures {
    /// Its id.
    pub id: ExperimentId,
    /// Its name.
    pub name: String,
    /// Generations that it is to have.
    pub generations_wanted: u64,
    /// The latest generation that is on disk.
    pub latest: Option<Generation>,
    /// Its work.
    pub work: JobStats,
}

impl Driver {
    /// How things stand.
    pub(super) fn figures(&self) -> Figures {
        let experiments = self.experiments.iter().map(|(&id, running)| ExperimentFigures {
            id,
            name: running.config.name.clone(),
            generations_wanted: running.config.algorithm.generations,
            latest: running.latest.clone(),
            work: self.engine.job_stats(id.into()),
        });
        Figures { fleet: self.engine.fleet_stats(clock::now()), experiments: experiments.collect() }
    }
}
