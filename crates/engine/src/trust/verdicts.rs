//! Asks the referee, and draws the consequences of its answers.

use std::{collections::BTreeSet, mem, sync::Arc, time::Duration};

use model::ids::{JobId, QuestionId, WorkerId};

use crate::{
    Instant,
    referee::{RefereeRequest, Verdict},
};

use super::{
    super::{
        Command, Engine, batch::BatchInProgress, item::Item, known_results::REFEREE,
        results::NoResult, timeline::Fate,
    },
    questions::{Doubt, Party, Question, wrong},
};

impl Engine {
    /// The referee has answered a question.
    pub fn on_verdict(&mut self, now: Instant, id: QuestionId, verdict: Verdict) {
        // The question may have been withdrawn.
        let Some(mut question) = self.trust.questions.take(id) else { return };
        let is_of_losses = matches!(question.doubt, Doubt::Losses);
        match verdict {
            // Without losses of workers, this proves nothing: the system may be short of memory.
            Verdict::Died(trouble) | Verdict::Unavailable(trouble) if !is_of_losses => {
                let is_first = question.trouble.is_none();
                question.postpone(now, trouble);
                if is_first && matches!(question.doubt, Doubt::Failure { .. }) {
                    self.release(&question);
                }
                self.trust.questions.put_back(id, question);
            }
            // The next loss leads to another question.
            Verdict::Unavailable(_) => self.release(&question),
            Verdict::Died(how) if question.on_death(now) => {
                let failure = format!("it takes its process down ({how})");
                self.settle(now, id, &question, Err(&failure));
            }
            Verdict::Died(_) => self.trust.questions.put_back(id, question),
            Verdict::Failed(failure) => self.settle(now, id, &question, Err(&failure)),
            Verdict::Values(values) => self.settle(now, id, &question, Ok(&values)),
        }
        self.assign(now);
    }

    /// Has the referee evaluate an item of a job's batch, and withholds the item from workers
    /// meanwhile. Workers whose results are in doubt get nothing.
    pub(crate) fn ask_referee(&mut self, job: JobId, item: Item, doubt: Doubt) {
        let Some(work) = self.jobs.get_mut(&job) else { return };
        let Some(batch) = &mut work.batch else { return };
        let request = RefereeRequest {
            specification: Arc::clone(&work.spec),
            genotype: batch.genotype(item.individual),
            trial_set: batch.request.trial_set,
            trials: item.trials.clone(),
            output: batch.request.output,
        };
        let question = Question::new(job, item.clone(), request, doubt);
        match question.doubt {
            Doubt::Disagreement { .. } => batch.n_disagreements += 1,
            Doubt::NoFitness => {}
            // The result of an audited item is known.
            Doubt::Failure { .. } | Doubt::Losses if batch.is_known(&item) => {}
            Doubt::Failure { .. } | Doubt::Losses => batch.refer(item),
        }
        let parties: Vec<WorkerId> = question.parties().iter().map(|party| party.id).collect();
        let (id, command) = self.trust.questions.ask(question);
        for party in parties {
            self.update_worker(party, |worker| worker.obstacles.question = Some(id));
        }
        self.update_readiness(job);
        self.commands.push_back(command);
    }

    /// Repeats questions that the referee could not answer.
    pub(crate) fn ask_again(&mut self, now: Instant) {
        self.commands.extend(self.trust.questions.asked_again(now));
    }

    /// The failure as other workers confirm it, in the same words, while the referee cannot answer;
    /// `None` if too few do. A confirmation needs workers with most of the slots, because fewer may
    /// be faulty, and at least two names.
    pub(crate) fn confirmation(
        &self,
        job: JobId,
        item: &Item,
        reporter: &Party,
        message: &str,
    ) -> Option<String> {
        let questions = self.trust.questions.about(job).map(|(_, question)| question);
        let others = questions.filter_map(|question| match &question.doubt {
            Doubt::Failure { reporter, message: same }
                if question.trouble.is_some()
                    && self.batch_with(job, question.request.trial_set).is_some()
                    && same == message
                    && question.item.overlaps(item) =>
            {
                Some(reporter)
            }
            _ => None,
        });
        let reporters: Vec<&Party> = others.chain([reporter]).collect();
        let names: BTreeSet<&str> = reporters.iter().map(|party| &*party.name).collect();
        let ids: BTreeSet<WorkerId> = reporters.iter().map(|party| party.id).collect();
        let work = &self.jobs[&job];
        let trusted = self
            .workers
            .iter()
            .filter(|(_, worker)| worker.obstacles.quarantined.is_none() && worker.takes(work));
        let (mut n_slots, mut n_reporting) = (0, 0);
        for (id, worker) in trusted {
            n_slots += worker.n_slots();
            n_reporting += if ids.contains(id) { worker.n_slots() } else { 0 };
        }
        let is_confirmed = names.len() > 1 && 2 * n_reporting > n_slots;
        is_confirmed.then(|| format!("{} workers report: {message}", names.len()))
    }

    /// Withdraws questions about a job that no longer matter.
    pub(crate) fn withdraw_questions(&mut self, job: JobId, is_moot: impl Fn(&Question) -> bool) {
        let moot = self.trust.questions.about(job).filter(|(_, question)| is_moot(question));
        for id in moot.map(|(id, _)| id).collect::<Vec<QuestionId>>() {
            let Some(question) = self.trust.questions.take(id) else { continue };
            self.end_doubt(id, &question);
            self.commands.push_back(Command::WithdrawQuestion { question: id });
        }
    }

    /// Settles a question: the item has these values everywhere, or fails for this reason
    /// everywhere. Workers that returned anything else are faulty.
    fn settle(
        &mut self,
        now: Instant,
        id: QuestionId,
        question: &Question,
        finding: Result<&[f64], &str>,
    ) {
        self.end_doubt(id, question);
        for (party, reason) in question.refuted(finding) {
            self.put_in_quarantine(now, party, &reason);
        }
        let (job, item) = (question.job, &question.item);
        let Some(batch) = self.batch_of(question) else { return };
        let values = match finding {
            Ok(values) => values,
            Err(failure) => return self.fail(now, job, item, failure),
        };
        batch.n_refereed += u32::from(matches!(question.doubt, Doubt::NoFitness));
        // A third worker's result since then may be wrong, too.
        while let Some(batch) = self.batch_mut(job)
            && let Err(disagreement) = batch.known.compare(item, values)
            && let Some(party) = disagreement.first
        {
            let [returned, right] = &disagreement.values;
            let reason = wrong(returned, right, &question.place());
            self.put_in_quarantine(now, &party, &reason);
        }
        if self.batch(job).is_some_and(|batch| batch.n_values(item.trials.len()) == values.len()) {
            self.make_known(now, job, REFEREE, item, values, true);
        }
        self.update_readiness(job);
        self.finish_if_evaluated(now, job);
    }

    /// The batch that a question is about, if it is still being computed.
    fn batch_of(&mut self, question: &Question) -> Option<&mut BatchInProgress> {
        self.batch_with_mut(question.job, question.request.trial_set)
    }

    /// Ends the doubt about the workers of a question.
    fn end_doubt(&mut self, id: QuestionId, question: &Question) {
        for party in question.parties() {
            let worker = self.workers.get(&party.id);
            if worker.is_some_and(|worker| worker.obstacles.question == Some(id)) {
                self.update_worker(party.id, |worker| worker.obstacles.question = None);
            }
        }
        if matches!(question.doubt, Doubt::Disagreement { .. }) {
            if let Some(batch) = self.batch_of(question) {
                batch.n_disagreements -= 1;
            }
        } else if question.withholds() {
            self.release(question);
        }
    }

    /// Gives a question's item to workers again.
    fn release(&mut self, question: &Question) {
        if self.batch_of(question).is_some_and(|batch| batch.release(&question.item)) {
            self.requeue(question.job, &question.item);
        }
    }

    /// A worker is proved faulty: it gets nothing until an operator readmits it, and its results
    /// for incomplete batches no longer count.
    pub(crate) fn put_in_quarantine(&mut self, now: Instant, party: &Party, reason: &str) {
        let process = self.workers.get(&party.id).and_then(|worker| worker.introduction.process);
        if self.trust.quarantine.add(&party.name, process, reason) {
            self.counters.n_workers_quarantined += 1;
            let (name, reason) = (party.name.to_string(), reason.to_owned());
            self.commands.push_back(Command::Quarantine { name, reason });
        }
        let workers = self.workers.iter();
        let faulty = workers
            .filter(|(_, worker)| self.trust.quarantine.reason(&worker.introduction).is_some());
        let faulty = faulty.map(|(&id, _)| id).chain([party.id]).collect::<BTreeSet<WorkerId>>();
        for id in faulty {
            if self.workers.get(&id).is_some_and(|worker| worker.obstacles.quarantined.is_none()) {
                self.isolate(now, id, reason);
            }
        }
        self.discard(&party.name);
        self.finish_evaluated(now);
    }

    /// Takes everything back from a worker in quarantine.
    fn isolate(&mut self, now: Instant, id: WorkerId, reason: &str) {
        let in_flight: Vec<_> = self.workers[&id].in_flight.keys().copied().collect();
        let written_off = self.update_worker(id, |worker| {
            worker.obstacles.quarantined = Some(reason.to_owned());
            worker.obstacles.question = None;
            worker.obstacles.is_stalled = false;
            mem::take(&mut worker.written_off)
        });
        for item in written_off.into_iter().flatten().map(|(_, item)| item) {
            let who = (id, &self.workers[&id]);
            self.timeline.add(now, who, item, Fate::TakenBack, Duration::ZERO);
        }
        for assignment_id in in_flight.into_iter().rev() {
            if let Some(assignment) = self.recall(now, id, assignment_id) {
                self.on_no_result(now, assignment, NoResult::TakenBack);
            }
        }
        self.update_worker(id, |worker| worker.recalled.clear());
    }

    /// Forgets the values of a faulty worker in all batches, and notes which earlier generations
    /// it may have spoilt.
    fn discard(&mut self, name: &str) {
        let ids: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in ids {
            let Some(work) = self.jobs.get_mut(&id) else { continue };
            if let Some(generations) = work.unaudited.take(name) {
                let (first, last) = generations.into_inner();
                work.notices.push(format!(
                    "worker \"{name}\" is faulty, and no audit has agreed with it in generations \
                     {first} to {last}: its results there may be wrong"
                ));
            }
            if let Some(batch) = &mut work.batch {
                batch.discard(name);
                self.update_readiness(id);
            }
        }
    }

    /// Lets a worker out of quarantine; returns whether it was there.
    pub fn on_readmitted(&mut self, now: Instant, name: &str) -> bool {
        let workers = self.workers.iter();
        let freed = workers
            .filter(|(_, worker)| self.trust.quarantine.name(&worker.introduction) == Some(name))
            .map(|(&id, _)| id)
            .collect::<Vec<WorkerId>>();
        if !self.trust.quarantine.remove(name) {
            return false;
        }
        for id in freed {
            // The process may be in quarantine under another name as well.
            let reason = self.trust.quarantine.reason(&self.workers[&id].introduction);
            let reason = reason.map(str::to_owned);
            self.update_worker(id, |worker| worker.obstacles.quarantined = reason);
        }
        self.finish_evaluated(now);
        self.assign(now);
        true
    }

    /// A worker was found to be faulty before the engine began.
    pub fn on_quarantine_restored(&mut self, name: &str, reason: &str) {
        self.trust.quarantine.add(name, None, reason);
    }

    /// The workers in quarantine, connected or not, and why.
    pub fn quarantine(&self) -> impl Iterator<Item = (&str, &str)> {
        self.trust.quarantine.iter()
    }
}
