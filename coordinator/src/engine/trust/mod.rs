//! Finds out whom to believe when workers disagree, fail or disappear.
//!
//! The rest of the engine reports trouble. Consequences are items that wait ([`ItemState::Held`],
//! [`ItemState::Delayed`]), workers that get nothing ([`Availability`]), items that are computed
//! for the sake of trust ([`Engine::next_check`]), and batches that wait for an audit.
//!
//! [`ItemState::Held`]: super::item::ItemState::Held
//! [`ItemState::Delayed`]: super::item::ItemState::Delayed
//! [`Availability`]: super::availability::Availability
//!
//! | event | file | consequence |
//! |---|---|---|
//! | a worker reports a failure, or two return different bits | `doubts.rs` | a question for the referee (`questions.rs`) |
//! | workers are lost with the same item | `losses.rs` | the item becomes a suspect, and then a question |
//! | a worker is lost, whatever it had returned | `crash_loops.rs` | it gets its next item later, and one only |
//! | the referee answers | `verdicts.rs` | the item fails its job, or a worker is quarantined (`quarantine.rs`) |
//! | a result comes in | `audits.rs`, `unaudited.rs` | a second worker computes a share of the results, too |

mod audits;
mod crash_loops;
mod doubts;
mod losses;
mod quarantine;
mod questions;
mod unaudited;
mod verdicts;

use std::time::{Duration, Instant};

use super::{
    Engine,
    batch::BatchInProgress,
    item::Item,
    job::JobWork,
    worker::{Source, Worker},
};
use crate::ids::{JobId, WorkerId};

use self::{
    audits::Doubted, crash_loops::CrashLoops, quarantine::Quarantine, questions::Questions,
};

pub use self::{
    audits::Audits,
    losses::{AfterLoss, LossRecord},
    questions::Doubt,
    unaudited::Unaudited,
};

/// An audit waits for so long for a second worker to come, or to come back: else one that
/// lies would only have to be the first that is there after the coordinator's start.
const AUDITOR_GRACE: Duration = Duration::from_secs(30);

/// What is known of the workers' reliability.
#[derive(Debug)]
pub struct Trust {
    /// What the referee is asked.
    pub questions: Questions,
    /// The workers that questions are about.
    doubted: Doubted,
    /// The workers that are proved faulty.
    pub quarantine: Quarantine,
    /// The workers that were lost, and have returned no result since.
    pub crash_loops: CrashLoops,
    /// When there were last two workers that can audit each other, or the engine began.
    auditors_seen: Instant,
}

impl Trust {
    /// Nothing is known yet.
    pub fn new(now: Instant) -> Self {
        Self {
            questions: Questions::default(),
            doubted: Doubted::new(),
            quarantine: Quarantine::default(),
            crash_loops: CrashLoops::default(),
            auditors_seen: now,
        }
    }

    /// Whether a second worker, for audits, may still come.
    pub fn awaits_auditor(&self, now: Instant) -> bool {
        now < self.auditors_seen + AUDITOR_GRACE
    }
}

impl Engine {
    /// The worker that is to compute something of a job's batch for the sake of trust: an audit
    /// of values whose worker is not in doubt already, or an item that workers were lost with,
    /// one at a time.
    pub(super) fn next_check(
        &self,
        work: &JobWork,
        batch: &BatchInProgress,
    ) -> Option<(WorkerId, Source)> {
        if !batch.audits.is_empty() {
            let mut takers = self.takers(work).map(|(_, id)| id);
            let may = |id: &WorkerId| {
                batch.audits.has_clear_for(self.workers[id].name(), &self.trust.doubted)
            };
            if let Some(auditor) = takers.find(may) {
                return Some((auditor, Source::Audits));
            }
        }
        if batch.suspects.is_empty() {
            return None;
        }
        let taker = self.idle_taker(work, |id| !self.workers[&id].has_suspect())?;
        Some((taker, Source::Suspects))
    }

    /// Takes the first audit that a worker may do.
    pub(super) fn take_audit(&mut self, job: JobId, worker: WorkerId) -> Option<Item> {
        let name = self.workers.get(&worker)?.name();
        let batch = self.jobs.get_mut(&job)?.batch.as_mut()?;
        batch.audits.pop_for(name, &self.trust.doubted)
    }

    /// Notes when there were last two workers that can audit each other.
    pub(super) fn note_auditors(&mut self, now: Instant) {
        let mut auditors = self.workers.values().filter(|worker| worker.may_audit());
        let first = auditors.next().map(Worker::name);
        if auditors.any(|worker| Some(worker.name()) != first) {
            self.trust.auditors_seen = now;
        }
    }
}
