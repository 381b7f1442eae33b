//! The state of a job in the engine, and the job's share of the fleet.

use std::{sync::Arc, time::Duration};

use model::priority::Priority;

use super::{Instant, batch::BatchInProgress, item::Item, trust::unaudited::Unaudited};

/// Overhead of a call, in trials. Measured: a single trial of the shipped experiments takes 1.38
/// to 1.8 times as long as one of several in a call.
pub const CALL_OVERHEAD: f64 = 0.4;
/// Assumed duration of a trial before the first result.
const UNKNOWN_TRIAL: Duration = Duration::from_millis(10);

/// A job that has not ended.
#[derive(Debug)]
pub struct JobWork {
    /// Its experiment's name, which workers' patterns accept or exclude.
    pub name: Arc<str>,
    /// The specification, opaque to the engine; every worker gets it once.
    pub spec: Arc<str>,
    /// Whether it is paused.
    pub is_paused: bool,
    /// The batch that is being computed.
    pub batch: Option<BatchInProgress>,
    /// Its priority, which determines its share of the fleet.
    pub priority: Priority,
    /// Workers' time that it got, divided by its priority, in ns: the job with the least is next.
    pub virtual_time: u128,
    /// Number of trials whose fitness became known.
    pub n_episodes: u64,
    /// For each worker, how long its results have been unconfirmed.
    pub unaudited: Unaudited,
    /// Notices for the owner, sent with the finished batch.
    pub notices: Vec<String>,
    /// Time per trial for a worker of pace 1, s; smoothed.
    trial_s: Option<f64>,
    n_learnt: u64,
}

impl JobWork {
    /// A job without a batch.
    pub fn new(name: Arc<str>, spec: Arc<str>, priority: Priority) -> Self {
        Self {
            name,
            spec,
            is_paused: false,
            batch: None,
            priority,
            virtual_time: 0,
            n_episodes: 0,
            unaudited: Unaudited::default(),
            notices: Vec::new(),
            trial_s: None,
            n_learnt: 0,
        }
    }

    /// Whether it has queued items.
    pub fn is_ready(&self) -> bool {
        !self.is_paused && self.batch.as_ref().is_some_and(BatchInProgress::has_waiting)
    }

    /// Expected duration of `n_trials` trials for a worker of this pace; `None` before any
    /// result.
    pub fn expected(&self, n_trials: usize, pace: f64) -> Option<Duration> {
        let trial_s = self.trial_s?;
        let seconds = (n_trials as f64 + CALL_OVERHEAD) * trial_s * pace;
        Some(Duration::from_secs_f64(seconds.clamp(1e-6, 1e9)))
    }

    /// The charge for `n_trials` trials until their real duration is known.
    pub fn charge(&self, n_trials: usize, pace: f64) -> Duration {
        self.expected(n_trials, pace).unwrap_or(UNKNOWN_TRIAL * n_trials as u32)
    }

    /// Learns from an item that took `busy` for a worker of this pace, in a fleet of this many
    /// workers.
    pub fn learn(&mut self, item: &Item, busy: Duration, pace: f64, n_workers: usize) {
        let trial_s = busy.as_secs_f64() / (item.trials.len() as f64 + CALL_OVERHEAD) / pace;
        let smoothed = self.trial_s.get_or_insert(trial_s);
        // The mean of the first results, then a moving mean over several rounds of all workers.
        // Fast workers answer first, so a shorter mean would hide the differences between
        // workers.
        self.n_learnt += 1;
        let n_of_mean = self.n_learnt.min(100 + 4 * n_workers as u64);
        let gain = 1.0 / n_of_mean as f64;
        *smoothed = (*smoothed + gain * (trial_s - *smoothed)).max(1e-9);
    }

    /// Replaces a charge by the real duration.
    pub fn correct_charge(&mut self, charged: Duration, real: Duration) {
        self.virtual_time =
            (self.virtual_time + self.weighted(real)).saturating_sub(self.weighted(charged));
    }

    fn weighted(&self, time: Duration) -> u128 {
        time.as_nanos() * u128::from(Priority::MAX) / u128::from(self.priority.weight())
    }
}

/// The remaining time of an item. An overdue item is assumed to need as long again as it is
/// overdue.
pub fn remaining(expected: Instant, now: Instant) -> Duration {
    let late = now.saturating_duration_since(expected);
    late.max(expected.saturating_duration_since(now))
}
