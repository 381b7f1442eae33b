//! Workers that are lost, and lost again before they return a result.
//!
//! A worker that comes back after a loss is given one item until it has returned a result,
//! so that a loop of crashes holds up one item at a time. It waits for longer and longer
//! before that, unless nobody else can compute.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use super::super::worker::Worker;

/// Time after a first loss in which a worker is given nothing; doubles with each.
const FIRST_REST: Duration = Duration::from_millis(500);
/// The longest.
const REST_MAX: Duration = Duration::from_secs(30);
/// A worker that stays away for so long is forgotten.
const MEMORY: Duration = Duration::from_secs(600);

/// Names above which those of long ago are forgotten.
const N_REMEMBERED: usize = 1024;

/// Losses by the worker's name, since its last result.
#[derive(Debug, Default)]
pub struct CrashLoops {
    by_name: BTreeMap<String, CrashLoop>,
}

#[derive(Debug)]
struct CrashLoop {
    n_losses: u32,
    last: Instant,
}

impl CrashLoops {
    /// A worker was lost.
    pub fn on_lost(&mut self, now: Instant, name: &str) {
        if self.by_name.len() >= N_REMEMBERED {
            self.by_name.retain(|_, crash_loop| now < crash_loop.last + MEMORY);
        }
        let crash_loop =
            self.by_name.entry(name.to_owned()).or_insert(CrashLoop { n_losses: 0, last: now });
        crash_loop.n_losses += 1;
        crash_loop.last = now;
    }

    /// A worker has returned a result.
    pub fn on_result(&mut self, worker: &Worker) {
        // Few have an entry: this is called for every result.
        if worker.obstacles.is_on_probation {
            self.by_name.remove(worker.name());
        }
    }

    /// When a worker that joins may be given an item, if it was lost before.
    pub fn rest(&self, name: &str) -> Option<Instant> {
        let CrashLoop { n_losses, last } = self.by_name.get(name)?;
        let doublings = (n_losses - 1).min(10);
        Some(*last + (FIRST_REST * (1 << doublings)).min(REST_MAX))
    }
}
