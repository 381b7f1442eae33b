//! What a job is doing at a moment, and what it waits for.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use sim_core::TrialSet;

use crate::ids::{JobId, WorkerId};

use super::{
    Engine, availability::Availability, batch::BatchInProgress, job::JobWork, worker::Worker,
};

/// What a job is doing, and which workers could compute it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JobActivity {
    /// The batch that is being computed; none between batches, and once the job has
    /// ended.
    pub batch: Option<BatchActivity>,
    /// Connected workers.
    pub n_workers: usize,
    /// Those that are given the job's items.
    pub n_workers_available: usize,
    /// Those that would be given items, but do not take the job's.
    pub n_workers_of_others: usize,
    /// Those that are given nothing, but for the ones that are leaving.
    pub withheld: Vec<WithheldWorker>,
    /// What the referee is asked about the job.
    pub questions: Vec<OpenQuestion>,
    /// Other jobs with items that no worker has.
    pub rivals: Vec<JobId>,
}

/// A connected worker that is given nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct WithheldWorker {
    /// The worker.
    pub worker: WorkerId,
    /// What it calls itself, or the name under which it is in quarantine.
    pub name: String,
    /// Why.
    pub reason: String,
    /// Whether it is in quarantine; else it is for a while only.
    pub is_quarantined: bool,
}

/// An item that the referee is asked about.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenQuestion {
    /// The item's individual.
    pub individual: u32,
    /// What is in doubt.
    pub doubt: String,
    /// Why the referee could not answer so far.
    pub trouble: Option<String>,
}

/// A batch that is being computed.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchActivity {
    /// Which worlds and noise its trials meet.
    pub trial_set: TrialSet,
    /// Trials, over all individuals.
    pub n_episodes: usize,
    /// Trials without a result.
    pub n_episodes_left: usize,
    /// Items that no worker has.
    pub n_items_queued: usize,
    /// Audits that no worker has; they need one of another name than the first.
    pub n_audits_waiting: usize,
    /// Individuals that a worker was computing when it was lost, and that have no result
    /// since.
    pub n_individuals_failing: usize,
    /// The workers that have the other items.
    pub held: Vec<HeldItems>,
    /// Time since it began.
    pub running_for: Duration,
}

/// Items of a batch that a worker has.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldItems {
    /// The worker.
    pub worker: WorkerId,
    /// What it calls itself.
    pub name: String,
    /// Number of items.
    pub n_items: usize,
    /// Time since it was given the oldest of them.
    pub held_for: Duration,
    /// Time since its last sign of life.
    pub silent_for: Duration,
}

/// An evaluation that has not ended.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationActivity {
    /// Its experiment's name.
    pub name: Arc<str>,
    /// What it is doing.
    pub activity: JobActivity,
}

impl Engine {
    /// What all evaluations are doing, in the order in which they came.
    pub fn evaluations(&self, now: Instant) -> Vec<EvaluationActivity> {
        let evaluations = self.jobs.iter().filter(|(id, _)| id.experiment().is_none());
        let activity = |(&id, work): (&JobId, &JobWork)| EvaluationActivity {
            name: Arc::clone(&work.name),
            activity: self.activity(now, id),
        };
        evaluations.map(activity).collect()
    }

    /// What a job is doing; without a batch if the engine does not know it.
    pub fn activity(&self, now: Instant, id: JobId) -> JobActivity {
        let work = self.jobs.get(&id);
        let usable = self.workers.values().filter(|worker| worker.is_usable());
        let (takers, others): (Vec<&Worker>, Vec<&Worker>) =
            usable.partition(|worker| work.is_none_or(|work| worker.takes(work)));
        let questions = self.trust.questions.about(id);
        let rivals = self.jobs.iter().filter(|(other, work)| **other != id && work.is_ready());
        JobActivity {
            batch: self.batch(id).map(|batch| self.batch_activity(now, id, batch)),
            n_workers: self.workers.len(),
            n_workers_available: takers.len(),
            n_workers_of_others: others.len(),
            withheld: self.withheld(now),
            questions: questions.map(|(_, question)| question.activity()).collect(),
            rivals: rivals.map(|(&other, _)| other).collect(),
        }
    }

    fn withheld(&self, now: Instant) -> Vec<WithheldWorker> {
        let withheld = self.workers.iter().filter_map(|(&worker_id, worker)| {
            let (is_quarantined, reason) = match worker.availability() {
                Availability::Quarantined(reason) => (true, reason.to_owned()),
                _ => (false, worker.waits(now)?),
            };
            let name = self.trust.quarantine.name(&worker.introduction);
            let name = name.unwrap_or(worker.name()).to_owned();
            Some(WithheldWorker { worker: worker_id, name, reason, is_quarantined })
        });
        withheld.collect()
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
            trial_set: batch.request.trial_set,
            n_episodes: batch.known.n_episodes(),
            n_episodes_left: batch.known.n_episodes_left(),
            n_items_queued: batch.n_waiting() - batch.audits.n_waiting(),
            n_audits_waiting: batch.audits.n_waiting(),
            n_individuals_failing: batch.n_individuals_failing(),
            held: held.collect(),
            running_for: batch.running_for(now),
        }
    }
}
