//! The records of the store, as plain data.

use std::ops::Deref;

use bundle::Keyframes;
use experiment_file::ExperimentConfig;

use super::Summary;
use crate::{group::Membership, ids::ExperimentId, labels::Labels, priority::Priority};
use evolution::{Champion, Digest, Statistics};

/// The state of an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExperimentState {
    /// Computing, or waiting for workers.
    Running,
    /// Gets no workers until a client resumes it.
    Paused,
    /// All generations done, or the target fitness reached.
    Completed,
    /// Ended by an error.
    Failed,
    /// Ended by a client.
    Cancelled,
}

impl ExperimentState {
    /// Whether it has not ended.
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
    /// The checked configuration.
    pub config: ExperimentConfig,
    /// Link -1 of the digest chain.
    pub config_digest: Digest,
    /// Number of genes of a genotype.
    pub genotype_len: usize,
    /// The state of evolution before its first own generation.
    pub keyframe: Vec<u8>,
    /// Its priority.
    pub priority: Priority,
    /// Its group, if any.
    pub membership: Option<Membership>,
    /// Its labels, by which people find it.
    pub labels: Labels,
    /// Its origin, if it is a fork.
    pub fork: Option<ForkRecord>,
    /// The champion of its keyframe, if it has one.
    pub champion: Option<Champion>,
}

/// The present state of an experiment, with its file.
#[derive(Debug, Clone)]
pub struct StoredExperiment {
    /// Everything else.
    pub record: ExperimentRecord,
    /// Canonical configuration, as JSON.
    pub config_json: String,
}

impl Deref for StoredExperiment {
    type Target = ExperimentRecord;

    fn deref(&self) -> &ExperimentRecord {
        &self.record
    }
}

/// The present state of an experiment without its file, which is longer than all the rest; for
/// lists.
#[derive(Debug, Clone)]
pub struct ExperimentRecord {
    /// Its id.
    pub id: ExperimentId,
    /// Its name.
    pub name: String,
    /// Some keys of its file.
    pub summary: Summary,
    /// Link -1 of the digest chain.
    pub config_digest: String,
    /// The simulation that computes it.
    pub fingerprint: String,
    /// Number of genes of a genotype.
    pub genotype_len: u64,
    /// Its state.
    pub state: ExperimentState,
    /// Why it is paused, or why it ended before its last generation; otherwise empty.
    pub reason: String,
    /// Time of submission, milliseconds since 1970 UTC.
    pub submitted_at_ms: u64,
    /// Latest completed generation.
    pub latest: Option<GenerationRecord>,
    /// The latest link of a digest chain: of the re-evaluations' chain if the latest generation had
    /// a re-evaluation, otherwise of the generations' chain. Empty before the first generation.
    pub digest: String,
    /// Mean fitness of the present champion on the held-out trials that selected it; `None`
    /// before the first re-evaluation.
    pub held_out_fitness: Option<f64>,
    /// Mean fitness of the champion on trials that selected nothing; `None` before the end.
    pub judged_fitness: Option<f64>,
    /// Its priority.
    pub priority: Priority,
    /// Sequence number of its latest event.
    pub last_sequence: u64,
    /// Its group, if any.
    pub membership: Option<Membership>,
    /// Its labels, by which people find it.
    pub labels: Labels,
    /// Whether lists leave it out.
    pub is_archived: bool,
    /// Mean wall-clock time of its latest generations, ms; `None` before the first, and once it
    /// has ended.
    pub recent_generation_ms: Option<f64>,
    /// The first generation in its fitness log; the next generation if the log is empty.
    pub log_from: u64,
    /// Why `log_from` is not generation 0.
    pub log_gap: LogGap,
    /// Its origin, if it is a fork.
    pub fork: Option<ForkRecord>,
}

impl ExperimentRecord {
    /// Whether it has ended without a log and a keyframe.
    pub fn has_no_log(&self) -> bool {
        let has_gap = matches!(self.log_gap, LogGap::Damaged | LogGap::Older);
        !self.state.is_unfinished() && has_gap && self.log_from >= self.n_generations()
    }

    /// Number of completed generations, including those that a fork shares with its parent.
    pub fn n_generations(&self) -> u64 {
        self.latest.as_ref().map_or(0, |latest| latest.generation + 1)
    }

    /// The last link of the generations' digest chain, which the next one covers.
    pub fn last_link(&self) -> &str {
        match (&self.latest, &self.fork) {
            (Some(latest), Some(fork)) if latest.generation == fork.generation => &fork.link,
            (Some(latest), _) => &latest.digest,
            (None, _) => &self.config_digest,
        }
    }

    /// Whether it can be extended after its end.
    pub fn can_be_continued(&self) -> bool {
        self.state == ExperimentState::Completed && self.reason.is_empty()
    }
}

/// Why the fitness log lacks an experiment's first generations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogGap {
    /// It lacks none.
    None,
    /// An older version computed them, which kept no log.
    Older,
    /// A client pruned them.
    Pruned,
    /// They were damaged, so the recovered database omits them.
    Damaged,
    /// They belong to the parent of this fork.
    Forked,
}

impl LogGap {
    /// Its name in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Older => "older",
            Self::Pruned => "pruned",
            Self::Damaged => "damaged",
            Self::Forked => "forked",
        }
    }

    /// The gap of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::None, Self::Older, Self::Pruned, Self::Damaged, Self::Forked]
            .into_iter()
            .find(|gap| gap.name() == name)
    }
}

/// The origin of a fork, an experiment that continues the state of another one, its parent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForkRecord {
    /// The parent.
    pub parent: ExperimentId,
    /// The last generation that it shares with the parent.
    pub generation: u64,
    /// The link of the digest chain before its own first generation.
    pub link: String,
    /// The changes of the experiment file, one line each.
    pub changes: Vec<String>,
}

/// A completed generation.
#[derive(Debug, Clone, PartialEq)]
pub struct GenerationRecord {
    /// From 0.
    pub generation: u64,
    /// Statistics of the individuals' mean fitness.
    pub statistics: Statistics,
    /// Link of the digest chain, hexadecimal.
    pub digest: String,
    /// Wall-clock time, ms.
    pub duration_ms: u64,
    /// Number of simulated episodes.
    pub episodes: u64,
    /// Number of connected workers at its end.
    pub workers: u64,
    /// Share of the fleet's time without computation, 0 to 1.
    pub idle_share: f64,
}

/// Everything from which an experiment's results follow, together with its configuration.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// All generations, with the time at which each was completed, ms since 1970 UTC.
    pub history: Vec<(u64, GenerationRecord)>,
    /// The fitness log.
    pub log: Vec<Vec<u8>>,
    /// States of evolution, each with the number of generations before it, in order.
    pub keyframes: Keyframes,
    /// The champion.
    pub champion: Option<Champion>,
}

/// A generation, and its fitness as bytes of the fitness log.
pub type LogEntry = (GenerationRecord, Vec<u8>);

/// Something that happened to an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// From 1, without gaps.
    pub sequence: u64,
    /// Milliseconds since 1970 UTC.
    pub at_ms: u64,
    /// The event.
    pub kind: EventKind,
}

/// An event of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub enum EventKind {
    /// A generation was completed.
    Generation(GenerationRecord),
    /// The state changed.
    State {
        /// The new state.
        state: ExperimentState,
        /// The reason.
        reason: String,
    },
    /// A notice for people.
    Notice(String),
}
