//! What becomes of results, and of work that gave none.

use std::{
    num::NonZeroU64,
    time::{Duration, Instant},
};

use sim_core::Output;

use crate::ids::{AssignmentId, JobId, WorkerId};

use super::{
    Command, Engine, ItemResult,
    batch::{BatchInProgress, Disagreement},
    failures::RetryDecision,
    item::Item,
    worker::{AssignedItem, Worker},
};

impl Engine {
    pub(super) fn on_result(&mut self, now: Instant, id: WorkerId, result: ItemResult) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        let Some(assignment) = worker.in_flight.get(&result.id) else {
            let recalled = worker.take_recalled(result.id);
            if let (Some(recalled), Ok(fitness)) = (recalled, result.outcome)
                && self.is_due(recalled.job, result.output)
            {
                self.on_late_result(now, id, &recalled, &fitness);
            }
            // Else the experiment has ended meanwhile, or the worker makes items
            // up. Neither can do harm.
            return;
        };
        let (job, n_trials) = (assignment.job, assignment.item.trials.len());
        let batch = self.jobs[&job].batch.as_ref();
        let n_values = batch.map_or(n_trials, |batch| batch.n_values(n_trials));
        if let Ok(fitness) = &result.outcome
            && fitness.len() != n_values
        {
            let reason = format!("it returned {} values for {n_trials} trials", fitness.len());
            self.drop_worker(now, id, Some("was dropped"), reason);
            return;
        }
        if result.outcome.is_ok() && !self.is_due(job, result.output) {
            let reason = match result.output {
                Output::Fitness => "it returned fitness where measures are due",
                Output::Measures => "it returned measures where fitness is due",
            };
            self.drop_worker(now, id, Some("was dropped"), reason.to_owned());
            return;
        }
        let assignment = self.take_assignment(id, result.id);
        let busy = self.account(now, id, &assignment, result.compute_time);
        match result.outcome {
            Ok(fitness) => {
                self.counters.n_items_computed += 1;
                self.fleet_time.add_busy(busy);
                self.accept(now, id, &assignment, &fitness);
            }
            Err(message) => {
                self.counters.n_items_failed += 1;
                let failure = format!("the worker reports: {message}");
                self.retry(now, assignment, Some((None, &failure)));
            }
        }
    }

    /// Whether this is what the results of a job's batch are.
    fn is_due(&self, job: JobId, output: Output) -> bool {
        let batch = self.jobs.get(&job).and_then(|work| work.batch.as_ref());
        batch.is_none_or(|batch| batch.output() == output)
    }

    /// Learns how long things take; returns how long this took, as far as it can
    /// be true.
    fn account(
        &mut self,
        now: Instant,
        id: WorkerId,
        assignment: &AssignedItem,
        compute_time: Duration,
    ) -> Duration {
        let work = &self.jobs[&assignment.job];
        let expected = work.expected(assignment.item.trials.len(), 1.0);
        let (busy, pace) = self.update_worker(id, |worker| {
            let busy = worker.time.add_result(now, assignment.assigned, compute_time);
            let pace = worker.pace;
            worker.learn(busy, expected);
            (busy, pace)
        });
        let work = self.jobs.get_mut(&assignment.job).expect("it is assigned");
        work.learn(&assignment.item, busy, pace);
        self.correct_charge(assignment.job, assignment.charge, busy);
        busy
    }

    fn accept(&mut self, now: Instant, id: WorkerId, assignment: &AssignedItem, fitness: &[f64]) {
        let (job, item) = (assignment.job, &assignment.item);
        if let Err(disagreement) = self.batch_mut(job).compare(item, fitness) {
            self.on_disagreement(now, job, id, item, &disagreement);
            return;
        }
        if assignment.is_audit {
            self.batch_mut(job).count_audited();
        } else {
            let is_audited = self.is_audited(job, item);
            let worker = &self.workers[&id];
            let work = self.jobs.get_mut(&job).expect("it is assigned");
            let batch = work.batch.as_mut().expect("it is assigned");
            let n_new = batch.accept(id, worker.name(), item, fitness);
            work.n_episodes += n_new as u64;
            self.counters.n_episodes += n_new as u64;
            if n_new > 0 && is_audited {
                batch.push_audit(item.clone());
            }
            for (holder, assignment_id) in batch.redundant(item.individual) {
                self.recall(holder, assignment_id);
            }
            self.make_ready(job);
        }
        self.finish_if_evaluated(now, job);
    }

    /// Another's result came first, but this one is here, so compare them.
    fn on_late_result(
        &mut self,
        now: Instant,
        id: WorkerId,
        recalled: &AssignedItem,
        fitness: &[f64],
    ) {
        let job = recalled.job;
        let work = self.jobs.get(&job);
        let batch = work.and_then(|work| work.batch.as_ref());
        if let Some(batch) = batch
            && batch.trial_set() == recalled.trial_set
            && let Err(disagreement) = batch.compare(&recalled.item, fitness)
        {
            self.on_disagreement(now, job, id, &recalled.item, &disagreement);
        }
    }

    /// Two workers differ about the same trial, so one of them is faulty, and nobody
    /// knows which. Neither gets work any more. Their other results may be wrong as
    /// well: the batch starts over when the job is resumed. What is committed stays.
    fn on_disagreement(
        &mut self,
        now: Instant,
        job: JobId,
        second: WorkerId,
        item: &Item,
        disagreement: &Disagreement,
    ) {
        let Disagreement { first, first_name, trial, values: (a, b) } = disagreement;
        let second_name = self.workers[&second].name().to_owned();
        let batch = self.batch_mut(job);
        let reason = format!(
            "workers \"{first_name}\" ({first}) and \"{second_name}\" ({second}) differ: {a:?} and \
             {b:?} for trial {trial} of individual {} of {}; at least one of them is faulty, and \
             results of earlier generations may be wrong, too; neither gets work until it is \
             started again, and the generation is evaluated anew when the experiment is resumed",
            item.individual,
            batch.name(),
        );
        self.pause(job);
        self.batch_mut(job).start_over();
        for id in [*first, second] {
            self.distrust(now, id, &reason);
        }
        self.commands.push_back(Command::PauseJob { job, reason });
    }

    /// A worker gets no work any more, and what it has goes to others.
    fn distrust(&mut self, now: Instant, id: WorkerId, reason: &str) {
        let Some(worker) = self.workers.get(&id) else { return };
        let assignments: Vec<AssignmentId> = worker.in_flight.keys().copied().collect();
        self.update_worker(id, |worker| worker.distrusted = Some(reason.to_owned()));
        for assignment_id in assignments.into_iter().rev() {
            let assignment = self.recall(id, assignment_id);
            self.retry(now, assignment, None);
        }
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.recalled.clear();
        }
        self.finish_waived(now);
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
    /// there is no second worker is waived, and counted as such.
    fn finish_if_evaluated(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let Some(batch) = &work.batch else { return };
        let workers = &self.workers;
        let has_auditor = |batch: &BatchInProgress| {
            let mut usable = workers.values().filter(|worker| worker.is_usable());
            usable.any(|worker| batch.has_audit_for(worker.name()))
        };
        if !batch.is_finished(has_auditor) {
            return;
        }
        self.ready_queue.remove(&(work.virtual_time, id));
        self.fleet_time.advance(now);
        let batch = work.batch.take().expect("just seen");
        let evaluated = batch.into_evaluated(now, self.workers.len(), &self.fleet_time);
        self.commands.push_back(Command::FinishBatch { job: id, evaluated });
    }

    /// Queues an item again that gave no result. `failure`: what counts against it, if
    /// anything, and the process whose return would take that back.
    pub(super) fn retry(
        &mut self,
        now: Instant,
        assignment: AssignedItem,
        failure: Option<(Option<NonZeroU64>, &str)>,
    ) {
        let AssignedItem { job: id, item, is_audit, .. } = assignment;
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let Some(batch) = &mut work.batch else { return };
        self.counters.n_items_requeued += 1;
        if is_audit {
            // It may have been the second worker that made an audit possible.
            batch.push_audit(item);
            self.make_ready(id);
            return;
        }
        if let Some((process, failure)) = failure {
            let until = now + self.config.lease;
            match batch.failures.add(&item, process, failure, until) {
                RetryDecision::Retry => {}
                RetryDecision::HoldBack => return,
                RetryDecision::Fail => return self.fail(id, &item, failure),
            }
        }
        self.requeue(id, &item);
    }

    /// Queues what no other worker computes of an item, before all others, and lets
    /// what others compute of it be duplicated again.
    pub(super) fn requeue(&mut self, id: JobId, item: &Item) {
        let work = self.jobs.get_mut(&id).expect("the caller has seen it");
        let batch = work.batch.as_mut().expect("the caller has seen it");
        for part in batch.unclaimed(item).into_iter().rev() {
            batch.push_front(part);
        }
        let holders: Vec<(WorkerId, AssignmentId)> = batch.holders(item.individual).collect();
        for (holder, assignment_id) in holders {
            let worker: Option<&Worker> = self.workers.get(&holder);
            if let Some(assignment) = worker.and_then(|worker| worker.in_flight.get(&assignment_id))
            {
                batch.uncovered.insert((assignment.expected, assignment_id), holder);
            }
        }
        self.make_ready(id);
    }

    pub(super) fn fail(&mut self, id: JobId, item: &Item, failure: &str) {
        let batch = self.batch_mut(id);
        let reason = format!(
            "individual {} of {}, trials {}..{}, failed {} times; at last {failure}",
            item.individual,
            batch.name(),
            item.trials.start,
            item.trials.end,
            super::MAX_ATTEMPTS,
        );
        self.forget_job(id);
        self.commands.push_back(Command::FailJob { job: id, reason });
    }
}
