//! What becomes of an experiment's work at a moment: for whoever wonders why
//! nothing happens.

use std::time::{Duration, Instant};

use sim_core::TrialSet;

use crate::ids::{JobId, WorkerId};

use super::{Engine, batch::BatchInProgress};

/// What the engine knows of an experiment and of who could compute it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JobActivity {
    /// What is being judged; none between rounds, and once it has ended.
    pub batch: Option<BatchActivity>,
    /// Connected workers.
    pub n_workers: usize,
    /// Those that are given work.
    pub n_workers_available: usize,
    /// Other experiments with items that no worker has.
    pub rivals: Vec<JobId>,
}

/// A generation, or held-out trials, being judged.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchActivity {
    /// Which worlds and noise its trials meet.
    pub trial_set: TrialSet,
    /// Trials, over all individuals.
    pub n_episodes: usize,
    /// Those whose fitness is not known.
    pub n_episodes_left: usize,
    /// Items that no worker has.
    pub n_items_queued: usize,
    /// Individuals that failed, or took a worker down.
    pub n_individuals_failing: usize,
    /// Who has the other items.
    pub held: Vec<HeldItems>,
    /// Time since it began.
    pub running_for: Duration,
}

/// Items of a round in a worker's hands.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldItems {
    /// Whose.
    pub worker: WorkerId,
    /// What it calls itself.
    pub name: String,
    /// How many.
    pub n_items: usize,
    /// Time since it was given the oldest of them.
    pub held_for: Duration,
    /// Time since its last sign of life.
    pub silent_for: Duration,
}

impl Engine {
    /// What becomes of an experiment's work.
    pub fn activity(&self, now: Instant, id: JobId) -> JobActivity {
        let batch = self.jobs.get(&id).and_then(|work| work.batch.as_ref());
        let rivals = self.jobs.iter().filter(|(other, work)| **other != id && work.is_ready());
        JobActivity {
            batch: batch.map(|batch| self.batch_activity(now, id, batch)),
            n_workers: self.workers.len(),
            n_workers_available: self.workers.values().filter(|worker| worker.is_usable()).count(),
            rivals: rivals.map(|(&other, _)| other).collect(),
        }
    }

    fn batch_activity(&self, now: Instant, id: JobId, batch: &BatchInProgress) -> BatchActivity {
        let held = self.workers.iter().filter_map(|(&worker_id, worker)| {
            let ours = || worker.in_flight.values().filter(|assigned| assigned.job == id);
            Some(HeldItems {
                worker: worker_id,
                name: worker.name().to_owned(),
                n_items: ours().count(),
                held_for: now.saturating_duration_since(ours().next()?.assigned),
                silent_for: now.saturating_duration_since(worker.last_heard),
            })
        });
        BatchActivity {
            trial_set: batch.trial_set(),
            n_episodes: batch.n_episodes(),
            n_episodes_left: batch.n_episodes_left(),
            n_items_queued: batch.n_queued(),
            n_individuals_failing: batch.failures.n_individuals(),
            held: held.collect(),
            running_for: batch.running_for(now),
        }
    }
}
