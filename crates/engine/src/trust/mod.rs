//! Decides which worker to believe when workers disagree, fail or disappear.
//!
//! The rest of the engine reports trouble here. The consequences: items wait
//! ([`ItemState::Referred`], [`ItemState::Delayed`]), workers get nothing ([`Availability`]), workers
//! compute items only to check others ([`Engine::next_check`]), and batches wait for an audit.
//!
//! [`ItemState::Referred`]: super::item::ItemState::Referred
//! [`ItemState::Delayed`]: super::item::ItemState::Delayed
//! [`Availability`]: super::availability::Availability
//!
//! | event | file | consequence |
//! |---|---|---|
//! | a worker reports a failure, or two return different bits | `doubts.rs` | a question for the referee (`questions.rs`) |
//! | no individual of a generation has a finite fitness | `batch.rs`, `results.rs` (`finish_if_evaluated`) | the referee evaluates up to eight individuals |
//! | a result has the wrong length or kind | `results.rs` (`impossibility`) | quarantine at once |
//! | workers are lost with the same item | `losses.rs` | the item becomes a suspect, and then a question |
//! | a worker is lost, with or without results | `crash_loops.rs` | it gets its next item later, and only one |
//! | the referee answers | `verdicts.rs` | the item fails its job, or a worker is quarantined (`quarantine.rs`) |
//! | a result comes in | `audits.rs`, `unaudited.rs` | a second worker computes a share of the results, too |

pub mod audits;
mod crash_loops;
mod doubts;
pub mod losses;
mod quarantine;
pub mod questions;
pub mod unaudited;
mod verdicts;

use std::time::Duration;

use super::{
    Engine, availability::Obstacles, batch::BatchInProgress, in_flight::ItemKind, item::Item,
    job::JobWork, worker::Worker,
};
use model::ids::{JobId, WorkerId};

use crate::Instant;

use self::{crash_loops::CrashLoops, quarantine::Quarantine, questions::Questions};

/// Time that an audit waits for a second worker to connect or reconnect. Without this wait, a lying
/// worker could escape audits by being the first to connect after the coordinator's start.
const AUDITOR_GRACE: Duration = Duration::from_secs(30);

/// Number of losses without a result after which audits no longer wait for a worker.
const CRASH_LOOP: u32 = 3;

/// The state of everything that concerns the workers' reliability.
#[derive(Debug)]
pub struct Trust {
    /// The questions for the referee.
    pub questions: Questions,
    /// The workers that are proved faulty.
    pub quarantine: Quarantine,
    /// The workers that were lost, and have returned no result since.
    pub crash_loops: CrashLoops,
    /// The last time at which two workers could audit each other, or the engine's start.
    auditors_seen: Instant,
}

impl Trust {
    /// The state of a new engine.
    pub fn new(now: Instant) -> Self {
        Self {
            questions: Questions::default(),
            quarantine: Quarantine::default(),
            crash_loops: CrashLoops::default(),
            auditors_seen: now,
        }
    }

    /// Whether audits wait for a worker. They do not wait for one that is lost again and again
    /// without a result, nor for one in doubt while the referee cannot answer: neither may ever get
    /// an audit.
    pub fn may_audit(&self, worker: &Worker) -> bool {
        let Obstacles { n_losses, question, .. } = &worker.obstacles;
        worker.availability().is_usable_soon()
            && *n_losses < CRASH_LOOP
            && question.is_none_or(|id| self.questions.is_answerable(id))
    }

    /// Whether audits still wait for a second worker to connect.
    pub fn awaits_auditor(&self, now: Instant) -> bool {
        now < self.auditors_seen + AUDITOR_GRACE
    }
}

impl Engine {
    /// The next check of a job's batch, and the worker for it. A check is an audit of a worker that
    /// is not in doubt already, or a suspect; a worker gets one suspect at a time.
    pub(super) fn next_check(
        &self,
        work: &JobWork,
        batch: &BatchInProgress,
    ) -> Option<(WorkerId, ItemKind)> {
        if !batch.audits.is_empty() {
            let mut takers = self.takers(work).map(|(_, id)| id);
            let doubted = self.trust.questions.doubted();
            let may = |id: &WorkerId| batch.audits.has_clear_for(self.workers[id].name(), &doubted);
            if let Some(auditor) = takers.find(may) {
                return Some((auditor, ItemKind::Audit));
            }
        }
        if batch.suspects.is_empty() {
            return None;
        }
        let taker = self.idle_taker(work, |id| !self.workers[&id].has_suspect())?;
        Some((taker, ItemKind::Suspect))
    }

    /// Takes the first audit that a worker may do.
    pub(super) fn take_audit(&mut self, job: JobId, worker: WorkerId) -> Option<Item> {
        let name = self.workers.get(&worker)?.name();
        let batch = self.jobs.get_mut(&job)?.batch.as_mut()?;
        batch.audits.pop_for(name, &self.trust.questions.doubted())
    }

    /// Updates the last time at which two workers could audit each other.
    pub(super) fn note_auditors(&mut self, now: Instant) {
        let mut auditors = self.workers.values().filter(|worker| self.trust.may_audit(worker));
        let first = auditors.next().map(Worker::name);
        if auditors.any(|worker| Some(worker.name()) != first) {
            self.trust.auditors_seen = now;
        }
    }
}
