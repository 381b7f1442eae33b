//! Finds out whom to believe when workers disagree, fail or disappear.
//!
//! The rest of the engine reports trouble, and asks three things: whether a worker may have
//! items, which items wait for an answer, and whether a batch still waits for an audit.
//!
//! | event | file | consequence |
//! |---|---|---|
//! | a worker reports a failure, or two return different bits | `doubts.rs` | a question for the referee (`questions.rs`) |
//! | workers are lost with the same item | `losses.rs` | the item becomes a suspect, and then a question |
//! | a worker is lost before it returns anything | `crash_loops.rs` | it gets its next item later, and one only |
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

use super::{Engine, Introduction, OpenQuestion, item::Item, worker::Worker};
use crate::ids::JobId;

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
    questions: Questions,
    /// The workers that questions are about.
    doubted: Doubted,
    quarantine: Quarantine,
    crash_loops: CrashLoops,
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

    /// Why a worker is in quarantine, if it is.
    pub fn quarantine_reason(&self, introduction: &Introduction) -> Option<&str> {
        self.quarantine.reason(introduction)
    }

    /// The name under which a worker is in quarantine, if it is: an operator readmits that one.
    pub fn quarantine_name(&self, introduction: &Introduction) -> Option<&str> {
        self.quarantine.name(introduction)
    }

    /// When a worker that joins may have an item, if it was lost before it returned anything.
    pub fn rest(&self, name: &str) -> Option<Instant> {
        self.crash_loops.rest(name)
    }

    /// A worker was lost.
    pub fn on_lost(&mut self, now: Instant, name: &str) {
        self.crash_loops.on_lost(now, name);
    }

    /// A worker has returned a result.
    pub fn on_result(&mut self, worker: &Worker) {
        self.crash_loops.on_result(worker);
    }

    /// Whether a worker may do one of these audits now: of values whose worker is not in doubt.
    pub fn has_audit_for(&self, name: &str, audits: &Audits) -> bool {
        audits.has_clear_for(name, &self.doubted)
    }

    /// Takes the first such audit.
    pub fn pop_audit_for(&self, name: &str, audits: &mut Audits) -> Option<Item> {
        audits.pop_for(name, &self.doubted)
    }

    /// Whether a second worker, for audits, may still come.
    pub fn awaits_auditor(&self, now: Instant) -> bool {
        now < self.auditors_seen + AUDITOR_GRACE
    }

    /// The open questions about a job, for people.
    pub fn open_questions(&self, job: JobId) -> Vec<OpenQuestion> {
        self.questions.about(job).map(|(_, question)| question.activity()).collect()
    }

    /// How many questions about a job have this doubt.
    pub fn n_questions(&self, job: JobId, is_reason: impl Fn(&Doubt) -> bool) -> usize {
        self.questions.n_about(job, is_reason)
    }

    /// Number of questions since the engine began.
    pub fn n_asked(&self) -> u64 {
        self.questions.n_asked()
    }
}

impl Engine {
    /// Notes when there were last two workers that can audit each other.
    pub(super) fn note_auditors(&mut self, now: Instant) {
        let mut auditors = self.workers.values().filter(|worker| worker.may_audit());
        let first = auditors.next().map(Worker::name);
        if auditors.any(|worker| Some(worker.name()) != first) {
            self.trust.auditors_seen = now;
        }
    }
}
