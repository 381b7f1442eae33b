//! Everything that is read: what there is to know of experiments, as core types.
//!
//! Queries work on the store alone, so they need no running driver and cannot slow
//! one down. The gRPC services convert what they return; a page or a program that
//! reads a database can use the same.

mod champion;
mod explanation;
mod pages;
mod watch;

use crate::{
    ids::ExperimentId,
    store::{ExperimentRecord, Store, StoreError},
};

pub use champion::{ChampionReport, StoredChampion};
pub use explanation::{incompatibility, latest_notices};
pub use pages::{events, generations};
pub use watch::{WatchError, watch};

/// Why a query has no answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// There is no such experiment.
    #[error("there is no experiment {0}; `swarmctl list` shows all")]
    NotFound(ExperimentId),
    /// There is no champion yet.
    #[error("experiment {0} has no champion yet: its first generation is not complete")]
    NoChampion(ExperimentId),
    /// This release cannot decode the genotype.
    #[error(
        "experiment {experiment} was computed with \"{theirs}\", this is \"{ours}\"; its network \
         can be decoded with that release only"
    )]
    OtherSimulation {
        /// The experiment.
        experiment: ExperimentId,
        /// Fingerprint of the simulation that computed it.
        theirs: String,
        /// Fingerprint of this program's simulation.
        ours: &'static str,
    },
    /// What is stored cannot be decoded.
    #[error("{0}")]
    Undecodable(String),
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Reads one experiment.
pub fn experiment(store: &Store, id: ExperimentId) -> Result<ExperimentRecord, QueryError> {
    store.experiment(id)?.ok_or(QueryError::NotFound(id))
}
