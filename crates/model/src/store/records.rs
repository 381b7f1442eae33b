//! What the store keeps, as plain data.

use std::ops::Deref;

use bundle::Keyframes;
use experiment_file::ExperimentConfig;

use super::{ForkRecord, Summary};
use crate::{group::Membership, ids::ExperimentId, labels::Labels, priority::Priority};
use evolution::{Champion, Digest, Statistics};

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
    /// Evolution before its first own generation.
    pub keyframe: Vec<u8>,
    /// Its share of the fleet.
    pub priority: Priority,
    /// The group that it belongs to, if any.
    pub membership: Option<Membership>,
    /// What people find it by.
    pub labels: Labels,
    /// Where it comes from, if it is a fork.
    pub fork: Option<ForkRecord>,
    /// The champion of its keyframe, if it has one.
    pub champion: Option<Champion>,
}

/// An experiment as it stands, with its file.
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

/// An experiment as it stands, as lists have it: without its file, which is longer than all the
/// rest.
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
    /// The group that it belongs to, if any.
    pub membership: Option<Membership>,
    /// What people find it by.
    pub labels: Labels,
    /// Whether lists leave it out.
    pub is_archived: bool,
    /// Mean wall-clock time of its latest generations, ms; none before the first.
    pub recent_generation_ms: Option<f64>,
    /// The first generation in its fitness log; one that is not complete if there is none.
    pub log_from: u64,
    /// Why that is not generation 0.
    pub log_gap: LogGap,
    /// Where it comes from, if it is a fork.
    pub fork: Option<ForkRecord>,
}

impl ExperimentRecord {
    /// Whether it has ended, and neither log nor keyframe was kept of it.
    pub fn has_no_log(&self) -> bool {
        let has_gap = matches!(self.log_gap, LogGap::Damaged | LogGap::Older);
        !self.state.is_unfinished() && has_gap && self.log_from >= self.n_generations()
    }

    /// Completed generations, with those that a fork shares with its parent.
    pub fn n_generations(&self) -> u64 {
        self.latest.as_ref().map_or(0, |latest| latest.generation + 1)
    }

    /// The link of the generations' digest chain on which the next generation hangs.
    pub fn last_link(&self) -> &str {
        match (&self.latest, &self.fork) {
            (Some(latest), Some(fork)) if latest.generation == fork.generation => &fork.link,
            (Some(latest), _) => &latest.digest,
            (None, _) => &self.config_digest,
        }
    }

    /// Whether more generations can be asked for although it has ended.
    pub fn can_be_continued(&self) -> bool {
        self.state == ExperimentState::Completed && self.reason.is_empty()
    }
}

/// Why the fitness log lacks an experiment's first generations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogGap {
    /// It does not.
    None,
    /// They were computed by a version that kept no log.
    Older,
    /// A client had them deleted.
    Pruned,
    /// They were damaged, and so were not taken into a recovered database.
    Damaged,
    /// They are the parent's, of which this is a fork.
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

/// Everything that an experiment's results follow from, with its configuration.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// All generations, with the time at which each was completed, ms since 1970 UTC.
    pub history: Vec<(u64, GenerationRecord)>,
    /// The fitness log.
    pub log: Vec<Vec<u8>>,
    /// States of evolution, by the number of generations before them, in order.
    pub keyframes: Keyframes,
    /// The champion.
    pub champion: Option<Champion>,
}

/// A generation, and what evolution was told of it.
pub type LogEntry = (GenerationRecord, Vec<u8>);

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
