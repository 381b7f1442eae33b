//! Handles results, and assignments that end without one.

use std::time::Duration;

use model::ids::{AssignmentId, JobId, WorkerId};
use sim_core::{Output, TrialSet};

use super::{
    Command, Engine, Instant, ItemResult,
    batch::BatchInProgress,
    in_flight::{AssignedItem, ItemKind},
    item::{Item, ItemState},
    timeline::Fate,
    trust::{
        audits::is_audited,
        losses::{AfterLoss, WorkerLoss},
        questions::Doubt,
    },
    worker::Worker,
};

/// Why an assignment ended without a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoResult {
    /// It was taken back, or another worker has to compute it.
    TakenBack,
    /// Its worker was lost during the computation.
    WorkerLost(WorkerLoss),
}

impl Engine {
    /// A worker has answered an assignment: one that it has, one that it had when it was written
    /// off, or one that was taken back. Any other answer is ignored: its job has ended meanwhile,
    /// or the worker invents items.
    pub(super) fn on_result(&mut self, now: Instant, id: WorkerId, result: ItemResult) {
        let Some(worker) = self.workers.get(&id) else { return };
        let in_flight = worker.in_flight.get(&result.id);
        let is_late = in_flight.is_none();
        let Some(assignment) = in_flight.or_else(|| worker.written_off.get(&result.id)) else {
            return self.compare_recalled(now, id, &result);
        };
        if let Some(reason) = self.impossibility(assignment, &result) {
            return self.put_in_quarantine(now, &self.party(id), &reason);
        }
        if result.outcome.is_ok() {
            self.trust.crash_loops.on_result(&self.workers[&id]);
        }
        let Some((assignment, busy)) = self.end_assignment(now, id, &result) else { return };
        if !is_late {
            self.forget_holder(result.id, &assignment);
        }
        match result.outcome {
            Ok(values) => {
                self.counters.n_items_computed += 1;
                self.fleet_time.add_busy(busy);
                self.accept(now, id, &assignment, &values, is_late);
            }
            Err(message) => {
                self.counters.n_items_failed += 1;
                if !is_late {
                    self.on_failure_reported(now, id, assignment, message);
                }
            }
        }
    }

    /// Why no correct worker returns this result for an assignment; `None` if one might.
    fn impossibility(&self, assignment: &AssignedItem, result: &ItemResult) -> Option<String> {
        // A batch that has ended may have been of another output.
        let batch = self.batch_with(assignment.job, assignment.trial_set)?;
        let values = result.outcome.as_ref().ok()?;
        let n_trials = assignment.item.trials.len();
        if values.len() != batch.n_values(n_trials) {
            return Some(format!("it returned {} values for {n_trials} trials", values.len()));
        }
        (batch.request.output != result.output).then(|| {
            let [returned, due] =
                [result.output, batch.request.output].map(|output| match output {
                    Output::Fitness => "fitness",
                    Output::Measures => "measures",
                    Output::Descriptors => "descriptors",
                });
            let verb = if due == "fitness" { "is" } else { "are" };
            format!("it returned {returned} where {due} {verb} due")
        })
    }

    /// Compares the result of a recalled assignment with the earlier result of another worker.
    fn compare_recalled(&mut self, now: Instant, id: WorkerId, result: &ItemResult) {
        let worker = self.workers.get_mut(&id);
        let recalled = worker.and_then(|worker| worker.take_recalled(result.id));
        if let (Some(AssignedItem { job, trial_set, item, .. }), Ok(values)) =
            (recalled, &result.outcome)
            && let Some(batch) = self.batch_with(job, trial_set)
            && batch.request.output == result.output
            && let Err(disagreement) = batch.known.compare(&item, values)
        {
            self.on_disagreement(now, job, id, &item, disagreement);
        }
    }

    /// Ends an answered assignment, and learns from its duration. Returns the assignment and its
    /// plausible duration. All of this is one update of the worker, because it happens for every
    /// result.
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
        worker.obstacles.is_stalled = false;
        if is_ok {
            worker.obstacles.n_losses = 0;
        }
        self.load_index.add(id, worker);
        let fate = if is_ok { Fate::Computed } else { Fate::Failed };
        self.timeline.add(now, (id, worker), assignment.clone(), fate, busy);
        if is_ok && let Some(work) = self.jobs.get_mut(&assignment.job) {
            work.learn(&assignment.item, busy, pace, self.workers.len());
        }
        self.correct_charge(assignment.job, assignment.charge, busy);
        Some((assignment, busy))
    }

    /// Accepts the values of an assignment, or finds that another worker's differ. `is_late`:
    /// whether other workers have got the item meanwhile.
    fn accept(
        &mut self,
        now: Instant,
        id: WorkerId,
        assignment: &AssignedItem,
        values: &[f64],
        is_late: bool,
    ) {
        let (job, item, is_audit) = (assignment.job, &assignment.item, assignment.is_audit());
        if self.jobs.get(&job).is_none_or(|work| work.is_paused) {
            return;
        }
        let Some(batch) = self.batch_with_mut(job, assignment.trial_set) else { return };
        if let Err(disagreement) = batch.known.compare(item, values) {
            if !is_late && is_audit {
                batch.push_audit(item);
                self.update_readiness(job);
            } else if !is_late {
                self.requeue(job, item);
            }
            return self.on_disagreement(now, job, id, item, disagreement);
        }
        if is_late && is_audit {
            return;
        }
        // The audited values may have been discarded meanwhile.
        let n_new = self.make_known(now, job, id, item, values, is_late || is_audit);
        if is_audit && n_new == 0 {
            let auditor = self.party(id).name;
            let Some(batch) = self.batch_mut(job) else { return };
            if batch.computed_by(item) == Some(&auditor) {
                // The audited value was discarded, and a worker of the auditor's own name has
                // computed it again.
                batch.push_audit(item);
            } else {
                batch.count_audited(item, auditor);
            }
        }
        self.update_readiness(job);
        self.finish_if_evaluated(now, job);
    }

    /// Makes the values of an item's trials known that have none, queues their audits, and
    /// recalls duplicates that are no longer needed. Returns the number of these trials.
    /// `may_be_queued`: whether the item may wait for another worker.
    pub(super) fn make_known(
        &mut self,
        now: Instant,
        job: JobId,
        id: WorkerId,
        item: &Item,
        values: &[f64],
        may_be_queued: bool,
    ) -> usize {
        let Some(work) = self.jobs.get_mut(&job) else { return 0 };
        let Some(batch) = &mut work.batch else { return 0 };
        // The referee has no worker's name.
        let name = self.workers.get(&id).map_or("", |worker| worker.name());
        let trial_set = batch.request.trial_set;
        let new = if is_audited(self.config.audit_fraction, job, trial_set, item.individual) {
            batch.parts(item, |state| state != ItemState::Done)
        } else {
            Vec::new()
        };
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

    /// Finishes each batch that has no work left: its last audits may have lost their auditors.
    pub(super) fn finish_evaluated(&mut self, now: Instant) {
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

    /// Reports a batch that has no work left, or first asks the referee about fitness that is not a
    /// number. If there has been no second worker for a while, the engine waives the remaining
    /// audits, and counts them.
    pub(super) fn finish_if_evaluated(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let Some(batch) = work.batch.as_ref().filter(|_| !work.is_paused) else { return };
        let is_in_grace = self.trust.awaits_auditor(now);
        let (workers, trust, job) = (&self.workers, &self.trust, &*work);
        let has_auditor = |batch: &BatchInProgress| {
            // In a fleet that is divided among experiments, the auditors seen last may not take
            // this one.
            let is_awaited = is_in_grace && workers.values().all(|worker| worker.takes(job));
            let mut auditors =
                workers.values().filter(|worker| trust.may_audit(worker) && worker.takes(job));
            is_awaited || auditors.any(|worker| batch.audits.has_for(worker.name()))
        };
        if !batch.is_finished(has_auditor) {
            return;
        }
        if let Some(item) = batch.next_to_referee() {
            if self.trust.questions.n_about(id, |doubt| matches!(doubt, Doubt::NoFitness)) == 0 {
                self.ask_referee(id, item, Doubt::NoFitness);
            }
            return;
        }
        self.fleet_time.advance(now);
        let Some(batch) = work.batch.take() else { return };
        self.ready_queue.update(id, work);
        if let TrialSet::Generation(generation) = batch.request.trial_set {
            work.unaudited.add(generation, batch.contributors());
        }
        let notices = std::mem::take(&mut work.notices);
        let evaluated = batch.into_evaluated(now, self.workers.len(), &self.fleet_time, notices);
        self.commands.push_back(Command::FinishBatch { job: id, evaluated });
        self.withdraw_questions(id, |question| matches!(question.doubt, Doubt::Losses));
    }

    /// An assignment has ended without a result: its item is queued again, delayed, or left to
    /// the referee.
    pub(super) fn on_no_result(&mut self, now: Instant, assignment: AssignedItem, why: NoResult) {
        let AssignedItem { job: id, item, kind, .. } = assignment;
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let Some(batch) = &mut work.batch else { return };
        self.counters.n_items_requeued += 1;
        let next = match why {
            NoResult::TakenBack => AfterLoss::Retry,
            NoResult::WorkerLost(loss) => batch.losses.add(now, &item, loss),
        };
        match next {
            // Its values are known, so nothing but the audit is lost.
            AfterLoss::Ask if kind == ItemKind::Audit => batch.audits.waive(),
            _ if kind == ItemKind::Audit => {
                batch.push_audit(&item);
                self.update_readiness(id);
            }
            AfterLoss::Wait(until) => batch.delay(item, until),
            AfterLoss::Ask if self.may_ask_about_losses(id, &item) => {
                self.ask_referee(id, item, Doubt::Losses);
            }
            AfterLoss::Ask | AfterLoss::Retry => self.requeue(id, &item),
        }
    }

    /// A worker was lost after it was written off. Other workers have its items already, but an
    /// item may have taken the worker down.
    pub(super) fn on_written_off_lost(
        &mut self,
        now: Instant,
        assignment: &AssignedItem,
        loss: WorkerLoss,
    ) {
        let (job, item) = (assignment.job, &assignment.item);
        let Some(batch) = self.batch_with_mut(job, assignment.trial_set) else { return };
        if !assignment.is_audit()
            && batch.losses.add(now, item, loss) == AfterLoss::Ask
            && self.may_ask_about_losses(job, item)
        {
            self.ask_referee(job, item.clone(), Doubt::Losses);
        }
    }

    /// Queues delayed items whose time has come.
    pub(super) fn requeue_delayed(&mut self, now: Instant) {
        let ids: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in ids {
            let take_due = |engine: &mut Self| engine.batch_mut(id)?.take_due(now);
            while let Some(item) = take_due(self) {
                self.requeue(id, &item);
            }
        }
    }

    /// Queues the parts of an item that no other worker computes, ahead of all other items. Parts
    /// that other workers compute may get duplicates again.
    pub(super) fn requeue(&mut self, id: JobId, item: &Item) {
        let Some(batch) = self.jobs.get_mut(&id).and_then(|work| work.batch.as_mut()) else {
            return;
        };
        batch.queue_first(item);
        let holders: Vec<(WorkerId, AssignmentId)> = batch.holders(item.individual).collect();
        for (holder, assignment_id) in holders {
            let worker: Option<&Worker> = self.workers.get(&holder);
            if let Some(assignment) = worker.and_then(|worker| worker.in_flight.get(&assignment_id))
                && assignment.kind != ItemKind::Suspect
            {
                batch.not_duplicated.insert((assignment.expected, assignment_id), holder);
            }
        }
        self.update_readiness(id);
    }

    /// Fails the job of an item that fails wherever it is computed.
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
