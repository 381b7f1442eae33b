//! How jobs share the workers' time: by stride scheduling (Waldspurger & Weihl, "Stride
//! Scheduling: Deterministic Proportional-Share Resource Management", MIT/LCS/TM-528, 1995).
//!
//! A job's *virtual time* grows by the workers' time that it gets, divided by its priority, and
//! the job with the least virtual time comes first. A job that had no queued items starts again
//! at the present virtual time, so that no job saves up time.

use std::{collections::BTreeSet, time::Duration};

use model::ids::JobId;

use super::job::JobWork;

/// The jobs with queued items.
#[derive(Debug, Default)]
pub struct ReadyQueue {
    /// Sorted by virtual time.
    ready: BTreeSet<(u128, JobId)>,
    /// The present virtual time: that of the job whose item was assigned last.
    now: u128,
}

impl ReadyQueue {
    /// The jobs, the next one first.
    pub fn iter(&self) -> impl Iterator<Item = JobId> {
        self.ready.iter().map(|&(_, id)| id)
    }

    /// Number of jobs.
    pub fn len(&self) -> usize {
        self.ready.len()
    }

    /// Whether a job is in the queue.
    pub fn has(&self, id: JobId, work: &JobWork) -> bool {
        self.ready.contains(&(work.virtual_time, id))
    }

    /// Adds or removes a job, depending on whether it has queued items.
    pub fn update(&mut self, id: JobId, work: &mut JobWork) {
        if !work.is_ready() {
            self.ready.remove(&(work.virtual_time, id));
        } else if !self.has(id, work) {
            work.virtual_time = work.virtual_time.max(self.now);
            self.ready.insert((work.virtual_time, id));
        }
    }

    /// Moves a job that waited for a suitable worker to the present virtual time, so that the
    /// wait gives it no advantage.
    pub fn renew(&mut self, id: JobId, work: &mut JobWork) {
        self.ready.remove(&(work.virtual_time, id));
        self.update(id, work);
    }

    /// Charges a job, whose turn it is, for the expected duration of its item.
    pub fn charge(&mut self, id: JobId, work: &mut JobWork, time: Duration) {
        self.now = self.now.max(work.virtual_time);
        self.correct_charge(id, work, Duration::ZERO, time);
        self.update(id, work);
    }

    /// Replaces a charge by the real duration of the item.
    pub fn correct_charge(
        &mut self,
        id: JobId,
        work: &mut JobWork,
        charged: Duration,
        real: Duration,
    ) {
        let has_turn = self.ready.remove(&(work.virtual_time, id));
        work.correct_charge(charged, real);
        if has_turn {
            self.ready.insert((work.virtual_time, id));
        }
    }
}
