//! Reports the present activity of a job, and the reason why it waits.

use std::{sync::Arc, time::Duration};

use model::ids::{JobId, WorkerId};
use sim_core::TrialSet;

use super::{
    Engine, Instant, availability::Availability, batch::BatchInProgress, item::ItemState,
    job::JobWork, trust::questions::OpenQuestion, worker::Worker,
};

/// The present activity of a job, and the workers that could compute it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JobActivity {
    /// The batch in progress; none between batches, and after the end of the job.
    pub batch: Option<BatchActivity>,
    /// Number of connected workers.
    pub n_workers: usize,
    /// Number of those that get the job's items.
    pub n_workers_available: usize,
    /// Number of those that would get items, but whose pattern excludes the job.
    pub n_workers_of_others: usize,
    /// Workers that get no items, except those that are leaving.
    pub withheld: Vec<WithheldWorker>,
    /// Open questions about the job for the referee.
    pub questions: Vec<OpenQuestion>,
    /// Other jobs with items that no worker has.
    pub rivals: Vec<JobId>,
}

/// A connected worker that gets no items.
#[derive(Debug, Clone, PartialEq)]
pub struct WithheldWorker {
    /// The worker.
    pub worker: WorkerId,
    /// Its name, or the name under which it is in quarantine.
    pub name: String,
    /// Why it gets no items.
    pub reason: String,
    /// Whether it is in quarantine; any other reason passes by itself.
    pub is_quarantined: bool,
}

/// A batch that is being computed.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchActivity {
    /// Its trial set.
    pub trial_set: TrialSet,
    /// Trials, over all individuals.
    pub n_episodes: usize,
    /// Trials without a result.
    pub n_episodes_left: usize,
    /// Items that no worker has.
    pub n_items_queued: usize,
    /// Audits that no worker has. Each needs a worker whose name differs from the first worker's.
    pub n_audits_waiting: usize,
    /// Individuals that were in progress when their worker was lost, and that still have no
    /// result.
    pub n_individuals_failing: usize,
    /// The workers that have the other items.
    pub shares: Vec<WorkerShare>,
    /// Time since it began.
    pub running_for: Duration,
}

/// Items of a batch that a worker has.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkerShare {
    /// The worker.
    pub worker: WorkerId,
    /// Its name.
    pub name: String,
    /// Number of items.
    pub n_items: usize,
    /// Time since the oldest of these assignments.
    pub oldest_for: Duration,
    /// Time since its last message.
    pub silent_for: Duration,
}

/// An evaluation that has not ended.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationActivity {
    /// Its experiment's name.
    pub name: Arc<str>,
    /// Its activity.
    pub activity: JobActivity,
}

impl Engine {
    /// The state of each trial of a job's batch, by individual; nothing between batches.
    pub fn trial_states(&self, id: JobId) -> Vec<Vec<ItemState>> {
        let Some(batch) = self.batch(id) else { return Vec::new() };
        let of = |individual| {
            (0..batch.request.n_trials).map(move |trial| batch.state(individual, trial))
        };
        (0..batch.request.genotypes.len() as u32)
            .map(|individual| of(individual).collect())
            .collect()
    }

    /// The activity of all evaluations, in the order of their arrival.
    pub fn evaluations(&self, now: Instant) -> Vec<EvaluationActivity> {
        let evaluations = self.jobs.iter().filter(|(id, _)| id.experiment().is_none());
        let activity = |(&id, work): (&JobId, &JobWork)| EvaluationActivity {
            name: Arc::clone(&work.name),
            activity: self.activity(now, id),
        };
        evaluations.map(activity).collect()
    }

    /// The activity of a job; without a batch if the engine does not know the job.
    pub fn activity(&self, now: Instant, id: JobId) -> JobActivity {
        let work = self.jobs.get(&id);
        let usable = self.workers.values().filter(|worker| worker.availability().is_usable());
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
                _ => (false, worker.why_it_waits(now)?),
            };
            let name = self.trust.quarantine.name(&worker.introduction);
            let name = name.unwrap_or(worker.name()).to_owned();
            Some(WithheldWorker { worker: worker_id, name, reason, is_quarantined })
        });
        withheld.collect()
    }

    fn batch_activity(&self, now: Instant, id: JobId, batch: &BatchInProgress) -> BatchActivity {
        let shares = self.workers.iter().filter_map(|(&worker_id, worker)| {
            let ours = || worker.in_flight.values().filter(|assigned| assigned.job == id);
            Some(WorkerShare {
                worker: worker_id,
                name: worker.name().to_string(),
                n_items: ours().count(),
                oldest_for: now.saturating_duration_since(ours().next()?.assigned),
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
            shares: shares.collect(),
            running_for: batch.running_for(now),
        }
    }
}
