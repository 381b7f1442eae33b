//! Limits the damage by workers that crash again and again without a result.
//!
//! A worker that reconnects after a loss gets one item until it has returned a result, so that a
//! loop of crashes holds up one item at a time. Before that item it rests, each time for longer,
//! unless no other worker can compute.

use std::{collections::BTreeMap, time::Duration};

use crate::Instant;

use super::super::worker::Worker;

/// Rest after a first loss, in which a worker gets nothing; doubles with each loss.
const FIRST_REST: Duration = Duration::from_millis(500);
/// The longest rest.
const REST_MAX: Duration = Duration::from_secs(30);
/// Time of absence after which a worker's losses are forgotten.
const MEMORY: Duration = Duration::from_secs(600);

/// Number of names above which old losses are forgotten.
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
        // Checks the flag first, because this runs for every result and few workers have an entry.
        if worker.obstacles.n_losses > 0 {
            self.by_name.remove(&**worker.name());
        }
    }

    /// Number of losses of workers of this name since the last result.
    pub fn n_losses(&self, name: &str) -> u32 {
        self.by_name.get(name).map_or(0, |crash_loop| crash_loop.n_losses)
    }

    /// When a joining worker may get an item, if it was lost before.
    pub fn rest(&self, name: &str) -> Option<Instant> {
        let CrashLoop { n_losses, last } = self.by_name.get(name)?;
        let doublings = (n_losses - 1).min(10);
        Some(*last + (FIRST_REST * (1 << doublings)).min(REST_MAX))
    }
}
