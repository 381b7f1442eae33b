//! What becomes of results, and of work that gave none.

use std::{
    num::NonZeroU64,
    time::{Duration, Instant},
};

use sim_core::Output;

use crate::ids::{AssignmentId, JobId, WorkerId};

use super::{
    Command, Engine, ItemResult,
    batch::BatchInProgress,
    item::Item,
    timeline::Fate,
    trust::{AfterLoss, Doubt},
    worker::{AssignedItem, Worker},
};

/// Why an item has no result yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoResult {
    /// It was taken back, or has to be done by somebody else.
    TakenBack,
    /// Its worker was lost while it computed it, and `is_alone` nothing else.
    WorkerLost { process: Option<NonZeroU64>, is_alone: bool },
}

impl Engine {
    pub(super) fn on_result(&mut self, now: Instant, id: WorkerId, result: ItemResult) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        let is_in_flight =
            worker.written_off.is_empty() || worker.in_flight.contains_key(&result.id);
        let assignment = worker.in_flight.get(&result.id);
        let Some(assignment) = assignment.or_else(|| worker.written_off.get(&result.id)) else {
            if let (Some(recalled), Ok(values)) = (worker.take_recalled(result.id), result.outcome)
                && self.is_due(recalled.job, result.output)
            {
                self.on_late_result(now, id, &recalled, &values);
            }
            // Else the experiment has ended meanwhile, or the worker makes items
            // up. Neither can do harm.
            return;
        };
        let n_trials = assignment.item.trials.len();
        let batch = self.jobs[&assignment.job].batch.as_ref();
        let n_values = batch.map_or(n_trials, |batch| batch.n_values(n_trials));
        let is_wanted = batch.is_some_and(|batch| batch.trial_set() == assignment.trial_set);
        let impossible = match &result.outcome {
            Ok(values) if is_wanted && values.len() != n_values => {
                Some(format!("it returned {} values for {n_trials} trials", values.len()))
            }
            Ok(_) if batch.is_some_and(|batch| batch.output() != result.output) => {
                Some(match result.output {
                    Output::Fitness => "it returned fitness where measures are due".to_owned(),
                    Output::Measures => "it returned measures where fitness is due".to_owned(),
                })
            }
            _ => None,
        };
        if let Some(reason) = impossible {
            return self.put_in_quarantine(now, &self.party(id), &reason);
        }
        let is_ok = result.outcome.is_ok();
        if is_ok {
            self.trust.on_result(&self.workers[&id]);
        }
        let Some((assignment, busy)) = self.end_assignment(now, id, &result) else { return };
        if is_in_flight {
            self.forget_holder(result.id, &assignment);
        }
        match result.outcome {
            Ok(values) => {
                self.counters.n_items_computed += 1;
                self.fleet_time.add_busy(busy);
                if is_in_flight && is_wanted {
                    self.accept(now, id, &assignment, &values);
                } else {
                    self.accept_late(now, id, &assignment, &values);
                }
            }
            Err(message) => {
                self.counters.n_items_failed += 1;
                if is_in_flight {
                    self.on_failure_reported(now, id, assignment, message);
                }
            }
        }
    }

    /// Whether this is what the results of a job's batch are.
    fn is_due(&self, job: JobId, output: Output) -> bool {
        let batch = self.jobs.get(&job).and_then(|work| work.batch.as_ref());
        batch.is_none_or(|batch| batch.output() == output)
    }

    /// Ends an assignment that is answered, and learns how long things take, and that its
    /// worker is at work; returns the assignment and how long it took, as far as that can
    /// be true. One change of the worker, as this is done for every result.
    fn end_assignment(
        &mut self,
        now: Instant,
        id: WorkerId,
        result: &ItemResult,
    ) -> Option<(AssignedItem, Duration)> {
        let is_ok = result.outcome.is_ok();
        let jobs = &self.jobs;
        let worker = self.workers.get_mut(&id)?;
        self.load_index.remove(id, worker);
        let assignment = worker.in_flight.remove(result.id);
        let Some(assignment) = assignment.or_else(|| worker.written_off.remove(&result.id)) else {
            self.load_index.add(id, worker);
            return None;
        };
        let n_trials = assignment.item.trials.len();
        let busy = worker.time.add_result(now, assignment.assigned, result.compute_time);
        let pace = worker.pace;
        if is_ok {
            worker.learn(busy, jobs[&assignment.job].expected(n_trials, 1.0));
        }
        worker.last_result = Some(now);
        worker.is_stalled = false;
        worker.is_on_probation &= !is_ok;
        self.load_index.add(id, worker);
        let fate = if is_ok { Fate::Computed } else { Fate::Failed };
        self.timeline.add(now, (id, worker), assignment.clone(), fate, busy);
        if is_ok && let Some(work) = self.jobs.get_mut(&assignment.job) {
            work.learn(&assignment.item, busy, pace, self.workers.len());
        }
        self.correct_charge(assignment.job, assignment.charge, busy);
        Some((assignment, busy))
    }

    fn accept(&mut self, now: Instant, id: WorkerId, assignment: &AssignedItem, values: &[f64]) {
        let (job, item) = (assignment.job, &assignment.item);
        let Some(batch) = self.batch_mut(job) else { return };
        if let Err(disagreement) = batch.known.compare(item, values) {
            if assignment.is_audit {
                batch.push_audit(item);
                self.update_readiness(job);
            } else {
                self.requeue(job, item);
            }
            self.on_disagreement(now, job, id, item, disagreement);
            return;
        }
        // What was to be audited may have been discarded meanwhile.
        let n_new = self.take_values(now, job, id, item, values, assignment.is_audit);
        if assignment.is_audit && n_new == 0 {
            let auditor = self.party(id).name;
            let Some(batch) = self.batch_mut(job) else { return };
            if batch.computed_by(item) == Some(&auditor) {
                // What it was to audit is gone, and its own value in the place.
                batch.push_audit(item);
            } else {
                batch.count_audited(item, auditor);
            }
        }
        if assignment.is_audit {
            self.update_readiness(job);
        } else {
            self.make_ready(job);
        }
        self.finish_if_evaluated(now, job);
    }

    /// Takes the values of those trials that have none; returns the number of these.
    /// `may_be_queued`: whether the item may be waiting for another worker.
    pub(super) fn take_values(
        &mut self,
        now: Instant,
        job: JobId,
        id: WorkerId,
        item: &Item,
        values: &[f64],
        may_be_queued: bool,
    ) -> usize {
        let is_audited = self.is_audited(job, item);
        let Some(work) = self.jobs.get_mut(&job) else { return 0 };
        let Some(batch) = &mut work.batch else { return 0 };
        // The referee is nobody's name.
        let name = self.workers.get(&id).map_or("", Worker::name);
        let new = if is_audited { batch.unknown(item) } else { Vec::new() };
        let n_new = batch.known.accept(id, name, item, values);
        new.iter().for_each(|part| batch.push_audit(part));
        if may_be_queued && n_new > 0 {
            batch.unqueue(item.individual);
        }
        work.n_episodes += n_new as u64;
        self.counters.n_episodes += n_new as u64;
        for (holder, assignment_id) in batch.redundant(item.individual) {
            self.recall(now, holder, assignment_id);
        }
        n_new
    }

    /// A worker that had been given up has computed an item after all.
    fn accept_late(
        &mut self,
        now: Instant,
        id: WorkerId,
        assignment: &AssignedItem,
        values: &[f64],
    ) {
        let (job, item) = (assignment.job, &assignment.item);
        let Some(work) = self.jobs.get(&job).filter(|work| !work.is_paused) else { return };
        let Some(batch) = &work.batch else { return };
        if batch.trial_set() != assignment.trial_set {
            return;
        }
        if let Err(disagreement) = batch.known.compare(item, values) {
            self.on_disagreement(now, job, id, item, disagreement);
        } else if !assignment.is_audit {
            self.take_values(now, job, id, item, values, true);
            self.update_readiness(job);
            self.finish_if_evaluated(now, job);
        }
    }

    /// Finishes batches whose last audits no worker can do any more.
    pub(super) fn finish_waived(&mut self, now: Instant) {
        let known = |batch: &BatchInProgress| batch.is_known_throughout();
        let waiting: Vec<JobId> = self
            .jobs
            .iter()
            .filter(|(_, work)| work.batch.as_ref().is_some_and(known))
            .map(|(&id, _)| id)
            .collect();
        for id in waiting {
            self.finish_if_evaluated(now, id);
        }
    }

    /// Reports a batch of which nothing is left to do. An audit for which
    /// there is no second worker, and has been none for a while, is waived, and counted as
    /// such.
    pub(super) fn finish_if_evaluated(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let Some(batch) = work.batch.as_ref().filter(|_| !work.is_paused) else { return };
        let is_in_grace = self.trust.awaits_auditor(now);
        let (workers, job) = (&self.workers, &*work);
        let has_auditor = |batch: &BatchInProgress| {
            // Of a fleet that is divided among experiments, auditors that have been seen may be
            // another's.
            let is_awaited = is_in_grace && workers.values().all(|worker| worker.takes(job));
            let mut auditors =
                workers.values().filter(|worker| worker.may_audit() && worker.takes(job));
            is_awaited || auditors.any(|worker| batch.audits.has_for(worker.name()))
        };
        if !batch.is_finished(has_auditor) {
            return;
        }
        if let Some(item) = batch.without_fitness() {
            if self.trust.n_questions(id, |doubt| matches!(doubt, Doubt::NoFitness)) == 0 {
                self.ask_referee(id, item, Doubt::NoFitness);
            }
            return;
        }
        self.ready_queue.remove(&(work.virtual_time, id));
        self.fleet_time.advance(now);
        let Some(batch) = work.batch.take() else { return };
        if let sim_core::TrialSet::Generation(generation) = batch.trial_set() {
            work.unaudited.add(generation, batch.contributors());
        }
        let notices = std::mem::take(&mut work.notices);
        let evaluated = batch.into_evaluated(now, self.workers.len(), &self.fleet_time, notices);
        self.commands.push_back(Command::FinishBatch { job: id, evaluated });
        self.withdraw_questions(id, |question| matches!(question.doubt, Doubt::Losses));
    }

    /// Queues an item again that gave no result.
    pub(super) fn retry(&mut self, now: Instant, assignment: AssignedItem, why: NoResult) {
        let AssignedItem { job: id, item, is_audit, .. } = assignment;
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let Some(batch) = &mut work.batch else { return };
        self.counters.n_items_requeued += 1;
        if is_audit {
            // It may have been the second worker that made an audit possible.
            batch.push_audit(&item);
            self.update_readiness(id);
            return;
        }
        let next = match why {
            NoResult::TakenBack => AfterLoss::Retry,
            NoResult::WorkerLost { process, is_alone } => {
                batch.losses.add(now, &item, process, is_alone)
            }
        };
        match next {
            AfterLoss::Wait(until) => batch.delay(item, until),
            AfterLoss::Ask if self.may_ask_about_losses(id, &item) => {
                self.ask_referee(id, item, Doubt::Losses);
            }
            AfterLoss::Ask | AfterLoss::Retry => self.requeue(id, &item),
        }
    }

    /// Others have what a lost worker was computing, but it may have taken the worker down.
    pub(super) fn on_written_off_lost(
        &mut self,
        now: Instant,
        assignment: &AssignedItem,
        lost: NoResult,
    ) {
        let NoResult::WorkerLost { process, is_alone } = lost else { return };
        let (job, item) = (assignment.job, &assignment.item);
        let batch = self.batch_mut(job);
        let Some(batch) = batch.filter(|batch| batch.trial_set() == assignment.trial_set) else {
            return;
        };
        let is_loss = !assignment.is_audit;
        if is_loss
            && batch.losses.add(now, item, process, is_alone) == AfterLoss::Ask
            && self.may_ask_about_losses(job, item)
        {
            self.ask_referee(job, item.clone(), Doubt::Losses);
        }
    }

    /// Queues items that had to wait for a while.
    pub(super) fn requeue_delayed(&mut self, now: Instant) {
        let ids: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in ids {
            let take_due = |engine: &mut Self| engine.batch_mut(id)?.take_due(now);
            while let Some(item) = take_due(self) {
                self.requeue(id, &item);
            }
        }
    }

    /// Queues what no other worker computes of an item, before all others, and lets
    /// what others compute of it be duplicated again.
    pub(super) fn requeue(&mut self, id: JobId, item: &Item) {
        let Some(batch) = self.jobs.get_mut(&id).and_then(|work| work.batch.as_mut()) else {
            return;
        };
        for part in batch.unclaimed(item).into_iter().rev() {
            batch.queue_front(part);
        }
        let holders: Vec<(WorkerId, AssignmentId)> = batch.holders(item.individual).collect();
        for (holder, assignment_id) in holders {
            let worker: Option<&Worker> = self.workers.get(&holder);
            if let Some(assignment) = worker.and_then(|worker| worker.in_flight.get(&assignment_id))
                && !assignment.is_suspect
            {
                batch.uncovered.insert((assignment.expected, assignment_id), holder);
            }
        }
        self.update_readiness(id);
    }

    /// An item fails wherever it is computed.
    pub(super) fn fail(&mut self, now: Instant, id: JobId, item: &Item, failure: &str) {
        let Some(batch) = self.batch_mut(id) else { return };
        let reason = format!(
            "individual {} of {}, trials {}..{}, fails wherever it is computed: {failure}",
            item.individual,
            batch.name(),
            item.trials.start,
            item.trials.end,
        );
        self.forget_job(now, id);
        self.commands.push_back(Command::FailJob { job: id, reason });
    }
}
