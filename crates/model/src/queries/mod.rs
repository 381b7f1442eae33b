//! The calls that only read experiments, in the messages of clients.
//!
//! Queries use only the store, so they need no running driver and cannot slow one down.

mod ancestry;
mod bundle;
mod calls;
mod dynamics;
mod explanation;
mod families;
mod fitness;
mod front;
mod generation;
mod individuals;
mod lineage;
mod reader;
mod repertoire;

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use tonic::Status;

use crate::{
    Address, Cell, NotAnAddress,
    ids::ExperimentId,
    store::{Store, StoreError, StoredExperiment},
};

pub use bundle::StoredBundle;
pub use explanation::{incompatibility, latest_notices};
pub use families::Families;
use fitness::fitness;
pub use generation::{Gap, StoredGeneration};
pub use reader::{BlockingReader, Reader};

/// Why a query has no answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// There is no such experiment.
    #[error("there is no experiment {0}; `swarmctl list` shows all")]
    NotFound(ExperimentId),
    /// Only an ended experiment has a bundle.
    #[error("experiment {0} has not ended: `swarmctl watch {0}` ends when it has")]
    NotEnded(ExperimentId),
    /// The fitness log is longer than a bundle may be.
    #[error(
        "experiment {experiment} does not fit into a bundle: its fitness log and its keyframes \
         have {} MiB, but all files of a bundle together have at most {}",
        len.div_ceil(1 << 20),
        ::bundle::UNPACKED_LEN_MAX >> 20
    )]
    TooLongForBundle {
        /// The experiment.
        experiment: ExperimentId,
        /// Bytes of its log and its keyframes.
        len: u64,
    },
    /// There is no champion yet.
    #[error("experiment {0} has no champion yet: its first generation is not complete")]
    NoChampion(ExperimentId),
    /// There is no such generation yet.
    #[error(
        "generation {generation} of experiment {experiment} is not complete; {}",
        match n_generations {
            0 => "none is".to_owned(),
            n => format!("the latest complete one is {}", n - 1),
        }
    )]
    NoGeneration {
        /// The experiment.
        experiment: ExperimentId,
        /// The generation.
        generation: u64,
        /// Number of complete generations.
        n_generations: u64,
    },
    /// The fitness log lacks a generation.
    #[error("generation {generation} of experiment {experiment} cannot be recovered: {why}")]
    NotInLog {
        /// The experiment.
        experiment: ExperimentId,
        /// The generation.
        generation: u64,
        /// Why the log lacks the generation.
        why: Gap,
    },
    /// The fitness log differs from the stored one.
    #[error(
        "the fitness log of experiment {experiment} is damaged near generation {generation}; \
         `swarmctl doctor --data-dir DIR` finds its sound parts"
    )]
    DamagedLog {
        /// The experiment.
        experiment: ExperimentId,
        /// The requested generation.
        generation: u64,
    },
    /// A generation has no such individual.
    #[error(
        "generation {generation} of experiment {experiment} has no individual {individual}: they \
         are 0 to {}",
        n_individuals - 1
    )]
    NoIndividual {
        /// The experiment.
        experiment: ExperimentId,
        /// The generation.
        generation: u64,
        /// The index.
        individual: u32,
        /// Number of individuals of the generation.
        n_individuals: u32,
    },
    /// The algorithm has no distribution.
    #[error("the algorithm of experiment {experiment} keeps a population: it has no mean")]
    NoMean {
        /// The experiment.
        experiment: ExperimentId,
    },
    /// The algorithm evolves no repertoire.
    #[error("experiment {experiment} has no repertoire: {algorithm} evolves none; MAP-Elites does")]
    NoRepertoire {
        /// The experiment.
        experiment: ExperimentId,
        /// Its algorithm.
        algorithm: String,
    },
    /// The algorithm evolves no front.
    #[error("experiment {experiment} has no front: {algorithm} evolves none; NSGA-II does")]
    NoFront {
        /// The experiment.
        experiment: ExperimentId,
        /// Its algorithm.
        algorithm: String,
    },
    /// A reference point has other numbers than the aims.
    #[error("the reference point needs {expected} finite numbers, for {aims}; it has {found}")]
    WrongReference {
        /// Its length.
        found: usize,
        /// Fitness and aims.
        expected: usize,
        /// Their names.
        aims: String,
    },
    /// A cell of a repertoire has no elite.
    #[error(
        "{cell} has no elite after generation {generation} of experiment {experiment}; `swarmctl \
         repertoire {experiment}` lists those that have one"
    )]
    EmptyCell {
        /// The experiment.
        experiment: ExperimentId,
        /// The generation.
        generation: u64,
        /// The cell.
        cell: Cell,
    },
    /// The individual has no lineage, or its lineage is too large.
    #[error("{0}")]
    NoLineage(String),
    /// A recomputed generation differs from the stored one.
    #[error(
        "generation {generation} of experiment {experiment} is not recovered to the same bits: \
         {what}; use the release that computed it, \"{theirs}\""
    )]
    OtherBits {
        /// The experiment.
        experiment: ExperimentId,
        /// The generation.
        generation: u64,
        /// The difference.
        what: String,
        /// Fingerprint of the simulation that computed it.
        theirs: String,
    },
    /// Stored data cannot be decoded.
    #[error("{0}")]
    Undecodable(String),
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Reads an address from a client; INVALID_ARGUMENT if it is invalid.
fn address(text: &str) -> Result<Address, Status> {
    text.parse().map_err(|error: NotAnAddress| Status::invalid_argument(error.to_string()))
}

/// Why stored data of a generation cannot be recomputed here.
fn other_bits(experiment: &StoredExperiment, generation: u64, what: String) -> QueryError {
    let theirs = experiment.fingerprint.clone();
    QueryError::OtherBits { experiment: experiment.id, generation, what, theirs }
}

/// The file of an experiment, to recompute a generation.
fn config(experiment: &StoredExperiment, generation: u64) -> Result<ExperimentConfig, QueryError> {
    ExperimentConfig::from_json(&experiment.config_json, "", ALGORITHMS)
        .map(|(config, _)| config)
        .map_err(|error| other_bits(experiment, generation, error.to_string()))
}

/// Reads one experiment.
pub fn experiment(store: &Store, id: ExperimentId) -> Result<StoredExperiment, QueryError> {
    store.experiment(id)?.ok_or(QueryError::NotFound(id))
}
