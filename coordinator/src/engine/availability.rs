//! Whether a worker is given items.

use std::time::Instant;

use crate::ids::QuestionId;

use super::worker::Worker;

/// Whether a worker is given items; if not, the first reason that applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Availability<'a> {
    /// It wants no more items.
    Draining,
    /// It is proved faulty, for this reason.
    Quarantined(&'a str),
    /// It returned nothing for a long time while others did: it gets nothing until it does.
    Stalled,
    /// Its word is in doubt until the referee has answered.
    Doubted,
    /// It was lost, has returned nothing since, and gets nothing until this time.
    Resting(Instant),
    /// It was lost, and has returned nothing since: it is given one item.
    OnProbation,
    /// It is given as many items as it has credit for.
    Free,
}

/// What keeps items from a worker. Several things may at the same time, each for its own reason.
#[derive(Debug, Default)]
pub struct Obstacles {
    /// Whether it wants no more items.
    pub is_draining: bool,
    /// Why it is in quarantine, if it is.
    pub quarantined: Option<String>,
    /// Whether it is stalled.
    pub is_stalled: bool,
    /// The question that its word is in doubt for.
    pub question: Option<QuestionId>,
    /// Until when it rests.
    pub resting_until: Option<Instant>,
    /// Whether it is on probation.
    pub is_on_probation: bool,
}

impl Worker {
    /// Whether it is given items.
    pub fn availability(&self) -> Availability<'_> {
        match &self.obstacles {
            Obstacles { is_draining: true, .. } => Availability::Draining,
            Obstacles { quarantined: Some(reason), .. } => Availability::Quarantined(reason),
            Obstacles { is_stalled: true, .. } => Availability::Stalled,
            Obstacles { question: Some(_), .. } => Availability::Doubted,
            Obstacles { resting_until: Some(until), .. } => Availability::Resting(*until),
            Obstacles { is_on_probation: true, .. } => Availability::OnProbation,
            _ => Availability::Free,
        }
    }

    /// Whether it may be given items now.
    pub fn is_usable(&self) -> bool {
        matches!(self.availability(), Availability::Free | Availability::OnProbation)
    }

    /// Whether audits wait for it: it may be given items now, or soon.
    pub fn may_audit(&self) -> bool {
        self.is_usable()
            || matches!(self.availability(), Availability::Doubted | Availability::Resting(_))
    }

    /// Why it is given nothing for a while, for people.
    pub fn waits(&self, now: Instant) -> Option<String> {
        match self.availability() {
            Availability::Stalled => {
                let silent = self.last_result.unwrap_or(self.time.joined());
                let seconds = now.saturating_duration_since(silent).as_secs();
                Some(format!(
                    "it has returned nothing for {seconds} s while others have; it gets items \
                     when it does"
                ))
            }
            Availability::Doubted => {
                Some("its word is in doubt until the referee has answered".to_owned())
            }
            Availability::Resting(until) => {
                let left = until.saturating_duration_since(now).as_secs_f64();
                Some(format!(
                    "it was lost, and has returned nothing since; it gets an item in {left:.1} s"
                ))
            }
            Availability::Draining
            | Availability::Quarantined(_)
            | Availability::OnProbation
            | Availability::Free => None,
        }
    }
}
