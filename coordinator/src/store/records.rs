//! What the store keeps, as plain data.

use experiment_file::ExperimentConfig;

use crate::{ids::ExperimentId, priority::Priority};
use evolution::{Digest, Statistics};

/// Where an experiment stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExperimentState {
    /// Computing, or waiting for workers.
    Running,
    /// Given no workers until it is resumed.
    Paused,
    /// All generations done, or the target fitness reached.
    Completed,
    /// Given up.
    Failed,
    /// Ended by a client.
    Cancelled,
}

impl ExperimentState {
    /// Whether it may still go on.
    pub fn is_unfinished(self) -> bool {
        matches!(self, Self::Running | Self::Paused)
    }

    /// Its name in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Completed => "completed",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// The state of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Running, Self::Paused, Self::Completed, Self::Failed, Self::Cancelled]
            .into_iter()
            .find(|state| state.name() == name)
    }
}

/// A submission that has passed all checks.
#[derive(Debug, Clone)]
pub struct NewExperiment {
    /// The client's key against double submission.
    pub request_id: Option<String>,
    /// Checked.
    pub config: ExperimentConfig,
    /// Link -1 of the digest chain.
    pub config_digest: Digest,
    /// Genes of a genotype.
    pub genotype_len: usize,
    /// Evolution before its first generation: the state of its first checkpoint.
    pub checkpoint: Vec<u8>,
    /// Its share of the fleet.
    pub priority: Priority,
}

/// An experiment as it stands.
#[derive(Debug, Clone)]
pub struct ExperimentRecord {
    /// Its id.
    pub id: ExperimentId,
    /// Canonical configuration, as JSON.
    pub config_json: String,
    /// Link -1 of the digest chain.
    pub config_digest: String,
    /// The simulation that computes it.
    pub fingerprint: String,
    /// Genes of a genotype.
    pub genotype_len: u64,
    /// Where it stands.
    pub state: ExperimentState,
    /// Why it ended, if not by completing its generations, or why it is paused.
    pub reason: String,
    /// Milliseconds since 1970 UTC.
    pub submitted_at_ms: u64,
    /// Latest completed generation.
    pub latest: Option<GenerationRecord>,
    /// The link that the latest generation ended with, of the re-evaluations'
    /// digest chain or the generations'; empty before the first.
    pub digest: String,
    /// Mean fitness of the champion so far on the held-out trials by which it was
    /// selected; none before the first re-evaluation.
    pub held_out_fitness: Option<f64>,
    /// Mean fitness of the champion on trials that selected nothing; none before the end.
    pub judged_fitness: Option<f64>,
    /// Its share of the fleet.
    pub priority: Priority,
    /// Sequence number of its latest event.
    pub last_sequence: u64,
}

/// A completed generation.
#[derive(Debug, Clone, PartialEq)]
pub struct GenerationRecord {
    /// From 0.
    pub generation: u64,
    /// Of the individuals' mean fitness.
    pub statistics: Statistics,
    /// Link of the digest chain, hexadecimal.
    pub digest: String,
    /// Wall-clock time.
    pub duration_ms: u64,
    /// Episodes simulated.
    pub episodes: u64,
    /// Workers at its end.
    pub workers: u64,
    /// Share of the fleet's time not spent computing.
    pub idle_share: f64,
}

/// Something that happened to an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// From 1, without gaps.
    pub sequence: u64,
    /// Milliseconds since 1970 UTC.
    pub at_ms: u64,
    /// What.
    pub kind: EventKind,
}

/// What can happen to an experiment.
#[derive(Debug, Clone, PartialEq)]
pub enum EventKind {
    /// A generation was completed.
    Generation(GenerationRecord),
    /// The state changed.
    State {
        /// The new state.
        state: ExperimentState,
        /// Why.
        reason: String,
    },
    /// Something worth a line in a log.
    Notice(String),
}
