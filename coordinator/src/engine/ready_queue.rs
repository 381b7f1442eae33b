//! How jobs share the workers' time: by stride scheduling (Waldspurger & Weihl, "Stride
//! Scheduling: Deterministic Proportional-Share Resource Management", MIT/LCS/TM-528, 1995).
//!
//! A job's *virtual time* grows by the workers' time that it gets, divided by its priority, and
//! the job with the least virtual time comes first. A job that had nothing to hand out starts
//! again at the present virtual time, so that nobody saves up time.

use std::{collections::BTreeSet, time::Duration};

use crate::ids::JobId;

use super::job::JobWork;

/// The jobs with something to hand out.
#[derive(Debug, Default)]
pub struct ReadyQueue {
    /// By virtual time.
    ready: BTreeSet<(u128, JobId)>,
    /// The present virtual time: that of the job that was given workers last.
    now: u128,
}

impl ReadyQueue {
    /// The jobs, the one whose turn it is first.
    pub fn iter(&self) -> impl Iterator<Item = JobId> {
        self.ready.iter().map(|&(_, id)| id)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.ready.len()
    }

    /// Whether a job is among them.
    pub fn has(&self, id: JobId, work: &JobWork) -> bool {
        self.ready.contains(&(work.virtual_time, id))
    }

    /// Sorts a job in or out, depending on whether it has something to hand out.
    pub fn update(&mut self, id: JobId, work: &mut JobWork) {
        if !work.is_ready() {
            self.ready.remove(&(work.virtual_time, id));
        } else if !self.has(id, work) {
            work.virtual_time = work.virtual_time.max(self.now);
            self.ready.insert((work.virtual_time, id));
        }
    }

    /// A job has waited for a worker that takes it: it has saved up no time meanwhile.
    pub fn renew(&mut self, id: JobId, work: &mut JobWork) {
        self.ready.remove(&(work.virtual_time, id));
        self.update(id, work);
    }

    /// It is a job's turn, and it is charged for the workers' time that its item should take.
    pub fn charge(&mut self, id: JobId, work: &mut JobWork, time: Duration) {
        self.now = self.now.max(work.virtual_time);
        self.correct_charge(id, work, Duration::ZERO, time);
        self.update(id, work);
    }

    /// Replaces a charge by the time that the item took.
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
