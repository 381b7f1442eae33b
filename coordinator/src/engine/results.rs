//! What becomes of results, and of work that gave none.

use std::{
    num::NonZeroU64,
    time::{Duration, Instant},
};

use crate::ids::{ExperimentId, ItemId, WorkerId};

use super::{
    Command, Engine, ItemResult,
    blame::Verdict,
    generation::{Disagreement, GenerationInProgress, Task},
    worker::{Assignment, Worker},
};

impl Engine {
    pub(super) fn on_result(&mut self, now: Instant, id: WorkerId, result: ItemResult) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        let Some(assignment) = worker.in_flight.get(&result.id) else {
            if let (Some(recalled), Ok(fitness)) = (worker.take_recalled(result.id), result.outcome)
            {
                self.on_late_result(now, id, &recalled, &fitness);
            }
            // Else the experiment has ended meanwhile, or the worker makes items
            // up. Neither can do harm.
            return;
        };
        let n_trials = assignment.task.trials.len();
        let generation = self.experiments[&assignment.experiment].generation.as_ref();
        let n_values = generation.map_or(n_trials, |generation| generation.n_values(n_trials));
        if let Ok(fitness) = &result.outcome
            && fitness.len() != n_values
        {
            let reason = format!("it returned {} values for {n_trials} trials", fitness.len());
            self.drop_worker(now, id, Some("was dropped"), reason);
            return;
        }
        let assignment = self.take_assignment(id, result.id);
        let busy = self.account(now, id, &assignment, result.compute_time);
        match result.outcome {
            Ok(fitness) => {
                self.tally.n_items_computed += 1;
                self.fleet_time.add_busy(busy);
                self.accept(now, id, &assignment, &fitness);
            }
            Err(message) => {
                self.tally.n_items_failed += 1;
                let blame = format!("the worker reports: {message}");
                self.retry(now, assignment, Some((None, &blame)));
            }
        }
    }

    /// Learns how long things take; returns how long this took, as far as it can
    /// be true.
    fn account(
        &mut self,
        now: Instant,
        id: WorkerId,
        assignment: &Assignment,
        compute_time: Duration,
    ) -> Duration {
        let work = &self.experiments[&assignment.experiment];
        let expected = work.expected(assignment.task.trials.len(), 1.0);
        let (busy, pace) = self.update_worker(id, |worker| {
            let busy = worker.time.add_result(now, assignment.assigned, compute_time);
            let pace = worker.pace;
            worker.learn(busy, expected);
            (busy, pace)
        });
        let work = self.experiments.get_mut(&assignment.experiment).expect("it is assigned");
        work.learn(&assignment.task, busy, pace);
        self.correct_charge(assignment.experiment, assignment.charge, busy);
        busy
    }

    fn accept(&mut self, now: Instant, id: WorkerId, assignment: &Assignment, fitness: &[f64]) {
        let (experiment, task) = (assignment.experiment, &assignment.task);
        if let Err(disagreement) = self.generation_mut(experiment).compare(task, fitness) {
            self.on_disagreement(now, experiment, id, task, &disagreement);
            return;
        }
        if assignment.is_audit {
            self.generation_mut(experiment).count_audited();
        } else {
            let is_audited = self.is_audited(experiment, task);
            let worker = &self.workers[&id];
            let work = self.experiments.get_mut(&experiment).expect("it is assigned");
            let generation = work.generation.as_mut().expect("it is assigned");
            let n_new = generation.accept(id, worker.name(), task, fitness);
            work.n_episodes += n_new as u64;
            self.tally.n_episodes += n_new as u64;
            if n_new > 0 && is_audited {
                generation.push_audit(task.clone());
            }
            for (holder, item) in generation.redundant(task.individual) {
                self.recall(holder, item);
            }
            self.make_ready(experiment);
        }
        self.finish_if_judged(now, experiment);
    }

    /// Another's result came first, but this one is here, so compare them.
    fn on_late_result(
        &mut self,
        now: Instant,
        id: WorkerId,
        recalled: &Assignment,
        fitness: &[f64],
    ) {
        let experiment = recalled.experiment;
        let work = self.experiments.get(&experiment);
        let generation = work.and_then(|work| work.generation.as_ref());
        if let Some(generation) = generation
            && generation.number == recalled.generation
            && let Err(disagreement) = generation.compare(&recalled.task, fitness)
        {
            self.on_disagreement(now, experiment, id, &recalled.task, &disagreement);
        }
    }

    /// Two workers differ about the same trial, so one of them is faulty, and
    /// nobody knows which. Neither gets work any more. What else they judged may be
    /// wrong as well: the generation starts over, when somebody who has been told
    /// says so. What is committed stays as it is.
    fn on_disagreement(
        &mut self,
        now: Instant,
        experiment: ExperimentId,
        second: WorkerId,
        task: &Task,
        disagreement: &Disagreement,
    ) {
        let Disagreement { first, first_name, trial, values: (a, b) } = disagreement;
        let second_name = self.workers[&second].name().to_owned();
        let generation = self.generation_mut(experiment);
        let reason = format!(
            "workers \"{first_name}\" ({first}) and \"{second_name}\" ({second}) differ: {a:?} and \
             {b:?} for trial {trial} of individual {} of {}; at least one of them is faulty, and \
             results of earlier generations may be wrong, too; neither gets work until it is \
             started again, and the generation is judged anew when the experiment is resumed",
            task.individual,
            generation.name(),
        );
        self.pause(experiment);
        self.generation_mut(experiment).start_over();
        for id in [*first, second] {
            self.distrust(now, id, &reason);
        }
        self.commands.push_back(Command::PauseExperiment { experiment, reason });
    }

    /// A worker gets no work any more, and what it has goes to others.
    fn distrust(&mut self, now: Instant, id: WorkerId, reason: &str) {
        let Some(worker) = self.workers.get(&id) else { return };
        let items: Vec<ItemId> = worker.in_flight.keys().copied().collect();
        self.update_worker(id, |worker| worker.distrusted = Some(reason.to_owned()));
        for item in items.into_iter().rev() {
            let assignment = self.recall(id, item);
            self.retry(now, assignment, None);
        }
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.recalled.clear();
        }
        self.finish_waived(now);
    }

    /// Concludes generations whose last audits nobody can do any more.
    pub(super) fn finish_waived(&mut self, now: Instant) {
        let known = |generation: &GenerationInProgress| generation.is_known_throughout();
        let waiting: Vec<ExperimentId> = self
            .experiments
            .iter()
            .filter(|(_, work)| work.generation.as_ref().is_some_and(known))
            .map(|(&id, _)| id)
            .collect();
        for id in waiting {
            self.finish_if_judged(now, id);
        }
    }

    /// Reports a generation in which nothing is left to do. An audit for which
    /// there is no second worker is waived, and counted as such.
    fn finish_if_judged(&mut self, now: Instant, id: ExperimentId) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        let Some(generation) = &work.generation else { return };
        let workers = &self.workers;
        let has_auditor = |generation: &GenerationInProgress| {
            let mut usable = workers.values().filter(|worker| worker.is_usable());
            usable.any(|worker| generation.has_audit_for(worker.name()))
        };
        if !generation.is_judged(has_auditor) {
            return;
        }
        self.turns.remove(&(work.served, id));
        self.fleet_time.advance(now);
        let generation = work.generation.take().expect("just seen");
        let judged = generation.into_judged(now, self.workers.len(), &self.fleet_time);
        self.commands.push_back(Command::FinishGeneration { experiment: id, judged });
    }

    /// Queues work again that gave no result. `blame`: what counts against it, if
    /// anything, and whose return would take that back.
    pub(super) fn retry(
        &mut self,
        now: Instant,
        assignment: Assignment,
        blame: Option<(Option<NonZeroU64>, &str)>,
    ) {
        let Assignment { experiment: id, task, is_audit, .. } = assignment;
        let Some(work) = self.experiments.get_mut(&id) else { return };
        let Some(generation) = &mut work.generation else { return };
        self.tally.n_items_requeued += 1;
        if is_audit {
            // It may have been the second worker that made an audit possible.
            generation.push_audit(task);
            self.make_ready(id);
            return;
        }
        if let Some((process, blame)) = blame {
            let until = now + self.config.lease;
            match generation.blames.add(&task, process, blame, until) {
                Verdict::Retry => {}
                Verdict::HoldBack => return,
                Verdict::Fail => return self.fail(id, &task, blame),
            }
        }
        self.requeue(id, &task);
    }

    /// Queues what nobody else computes of a task, before all other work, and lets
    /// what others compute of it be duplicated again.
    pub(super) fn requeue(&mut self, id: ExperimentId, task: &Task) {
        let work = self.experiments.get_mut(&id).expect("the caller has seen it");
        let generation = work.generation.as_mut().expect("the caller has seen it");
        for part in generation.unclaimed(task).into_iter().rev() {
            generation.push_front(part);
        }
        let holders: Vec<(WorkerId, ItemId)> = generation.holders(task.individual).collect();
        for (holder, item) in holders {
            let worker: Option<&Worker> = self.workers.get(&holder);
            if let Some(assignment) = worker.and_then(|worker| worker.in_flight.get(&item)) {
                generation.uncovered.insert((assignment.expected, item), holder);
            }
        }
        self.make_ready(id);
    }

    pub(super) fn fail(&mut self, id: ExperimentId, task: &Task, blame: &str) {
        let generation = self.generation_mut(id);
        let reason = format!(
            "individual {} of {}, trials {}..{}, failed {} times; at last {blame}",
            task.individual,
            generation.name(),
            task.trials.start,
            task.trials.end,
            super::MAX_ATTEMPTS,
        );
        self.forget_experiment(id);
        self.commands.push_back(Command::FailExperiment { experiment: id, reason });
    }
}
