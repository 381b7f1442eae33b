//! Decides whether a worker gets items.

use model::ids::QuestionId;

use crate::Instant;

/// Whether a worker gets items; if not, the first reason that applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Availability<'a> {
    /// The worker wants no more items.
    Draining,
    /// The worker is proved faulty, for this reason.
    Quarantined(&'a str),
    /// The worker returned nothing for a long time while others did. It gets no items until it
    /// returns a result.
    Stalled,
    /// A result of the worker is in doubt. It gets no items until the referee has answered.
    Doubted,
    /// The worker was lost, and has returned nothing since. It gets no items until this time.
    Resting(Instant),
    /// The worker was lost, and has returned nothing since. It gets one item.
    OnProbation,
    /// The worker gets as many items as it has credit for.
    Free,
}

/// The reasons why a worker gets no items; several may apply at the same time.
#[derive(Debug, Default)]
pub struct Obstacles {
    /// Whether it wants no more items.
    pub is_draining: bool,
    /// Why it is in quarantine, if it is.
    pub quarantined: Option<String>,
    /// Whether it is stalled.
    pub is_stalled: bool,
    /// The open question about one of its results.
    pub question: Option<QuestionId>,
    /// Until when it rests.
    pub resting_until: Option<Instant>,
    /// Number of losses of workers of its name since the last result; after a loss, it is on
    /// probation.
    pub n_losses: u32,
}

impl Obstacles {
    /// Whether the worker gets items.
    pub fn availability(&self) -> Availability<'_> {
        match self {
            Self { is_draining: true, .. } => Availability::Draining,
            Self { quarantined: Some(reason), .. } => Availability::Quarantined(reason),
            Self { is_stalled: true, .. } => Availability::Stalled,
            Self { question: Some(_), .. } => Availability::Doubted,
            Self { resting_until: Some(until), .. } => Availability::Resting(*until),
            Self { n_losses: 1.., .. } => Availability::OnProbation,
            _ => Availability::Free,
        }
    }
}

impl Availability<'_> {
    /// Whether the worker may get items now.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Free | Self::OnProbation)
    }

    /// Whether the worker may get items now, or soon.
    pub fn is_usable_soon(self) -> bool {
        self.is_usable() || matches!(self, Self::Doubted | Self::Resting(_))
    }

    /// Why the worker gets nothing for a while, for people. `silent_since`: its last result, or
    /// its introduction.
    pub fn why_it_waits(self, silent_since: Instant, now: Instant) -> Option<String> {
        match self {
            Self::Stalled => {
                let seconds = now.saturating_duration_since(silent_since).as_secs();
                Some(format!(
                    "it has returned nothing for {seconds} s while others have; it gets items \
                     again after its next result"
                ))
            }
            Self::Doubted => {
                Some("one of its results is in doubt until the referee has answered".to_owned())
            }
            Self::Resting(until) => {
                let left = until.saturating_duration_since(now).as_secs_f64();
                Some(format!(
                    "it was lost, and has returned nothing since; it gets an item in {left:.1} s"
                ))
            }
            Self::Draining | Self::Quarantined(_) | Self::OnProbation | Self::Free => None,
        }
    }
}
