//! Events in virtual time, and how workers and commands react to them.

use std::{
    cmp::Reverse,
    collections::{BTreeSet, VecDeque},
    mem,
    time::Duration,
};

use engine::{Assignments, Command, ItemResult, RefereeRequest, ToWorker};
use model::ids::{AssignmentId, WorkerId};

use super::{Conduct, Happening, Note, Order, Queued, SimulatedFleet, TICK, Work};

/// A liar adds this times its id, so that no two liars agree.
const LIE: f64 = 1e-9;

impl<W: Work> SimulatedFleet<W> {
    pub(super) fn schedule(&mut self, delay: Duration, happening: Happening) {
        self.n_happenings += 1;
        self.agenda.push(Reverse((self.now + delay, self.n_happenings, happening)));
    }

    pub(super) fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::Tick => {
                self.schedule(TICK, Happening::Tick);
                let now = self.instant();
                for (&id, _) in self.workers.iter().filter(|(_, worker)| !worker.is_silent) {
                    self.engine.on_heartbeat(now, id);
                }
                self.engine.on_tick(now);
                self.carry_out();
            }
            Happening::Arrival(id, number) => {
                let message = self.messages.remove(&number).expect("each arrives once");
                self.arrive(id, message);
            }
            Happening::Computed(id, assignment) => self.computed(id, assignment),
            Happening::Result(id, assignment) => {
                let result = self.results.remove(&assignment).expect("each is sent once");
                if self.workers.get(&id).is_some_and(|worker| !worker.is_silent) {
                    self.note(Note::Arrived { assignment });
                    self.engine.on_results(self.instant(), id, vec![result]);
                    self.carry_out();
                }
            }
            Happening::Awake(id) => {
                let worker =
                    self.workers.get_mut(&id).filter(|worker| worker.stalled_until <= self.now);
                let postponed = worker.map(|worker| mem::take(&mut worker.postponed));
                for assignment in postponed.into_iter().flatten() {
                    self.computed(id, assignment);
                }
                self.start_slots(id);
            }
            Happening::Death(id) => {
                self.restart(id);
            }
            Happening::Verdict(question) => {
                if let Some(verdict) = self.verdicts.remove(&question) {
                    self.note(Note::Answered { question });
                    self.engine.on_verdict(self.instant(), question, verdict);
                    self.carry_out();
                }
            }
        }
    }

    fn arrive(&mut self, id: WorkerId, message: ToWorker) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        match message {
            ToWorker::Distribution(job, distribution) => {
                worker.distributions.insert(job, distribution);
            }
            ToWorker::Assignments(Assignments { job, trial_set, output, items }) => {
                if items.iter().any(|assignment| assignment.is_drawn) {
                    self.work.check_distribution(trial_set, worker.distributions.get(&job));
                }
                for assignment in items {
                    // The engine blames a loss on the items that it assigned first.
                    let is_next = assignment.id > worker.last_assignment;
                    assert!(is_next, "sent in the order given: {:?}", assignment.id);
                    worker.last_assignment = assignment.id;
                    worker.queue.push_back(Queued { job, trial_set, output, assignment });
                }
            }
            ToWorker::Drop(assignments) => {
                let assignments = BTreeSet::from_iter(assignments);
                let (waiting, kept) =
                    mem::take(&mut worker.queue).into_iter().partition::<VecDeque<_>, _>(
                        |queued| assignments.contains(&queued.assignment.id),
                    );
                worker.queue = kept;
                let mut dropped: Vec<AssignmentId> =
                    waiting.into_iter().map(|queued| queued.assignment.id).collect();
                if self.model.stops {
                    let running = worker.running.extract_if(.., |id, _| assignments.contains(id));
                    let running: Vec<AssignmentId> = running.map(|(id, _)| id).collect();
                    worker.dropped.extend(&running);
                    dropped.extend(running);
                }
                for assignment in dropped {
                    self.note(Note::Dropped { assignment });
                }
            }
            ToWorker::End(job) => {
                worker.distributions.remove(&job);
                worker.queue.retain(|queued| queued.job != job);
                if self.model.stops {
                    let ours = worker.running.extract_if(.., |_, of| *of == job);
                    worker.dropped.extend(ours.map(|(assignment, _)| assignment));
                }
            }
            _ => {}
        }
        self.start_slots(id);
    }

    fn start_slots(&mut self, id: WorkerId) {
        let now = self.now;
        let model = self.model;
        loop {
            let Some(worker) = self.workers.get_mut(&id) else { return };
            if worker.running.len() >= worker.introduction.n_slots || now < worker.stalled_until {
                return;
            }
            if worker.is_by_hand || worker.conduct == Conduct::Hangs {
                return;
            }
            let Some(queued) = worker.queue.pop_front() else { return };
            let order = queued.order();
            let (assignment, trials) = (queued.assignment.id, order.trials);
            worker.running.insert(assignment, queued.job);
            let conduct = worker.conduct;
            let time = model.time(self.work.place(order.genotype), trials).div_f64(worker.speed);
            if let Some(multiple) = self.work.takes_down_after(order.genotype)
                && conduct != Conduct::Lies
            {
                self.schedule(time * multiple, Happening::Death(id));
                continue;
            }
            let outcome = match conduct {
                Conduct::Fails => Err("it is too hot here".to_owned()),
                Conduct::Babbles => Ok(vec![1.0; trials.len() + 1]),
                Conduct::Honest | Conduct::Hangs => self.work.compute(&order),
                Conduct::Lies | Conduct::LiesAtTheEnd => {
                    let true_values = self.work.compute(&order);
                    let mut values = true_values.unwrap_or_else(|_| vec![0.0; trials.len()]);
                    let n_true = if conduct == Conduct::Lies { 0 } else { values.len() - 1 };
                    let invented = &mut values[n_true..];
                    invented.iter_mut().for_each(|value| *value += LIE * id.0 as f64);
                    Ok(values)
                }
            };
            let output = queued.output;
            let result = ItemResult { id: assignment, output, outcome, compute_time: time };
            self.results.insert(assignment, result);
            self.note(Note::Began { assignment, ends: now + time });
            self.schedule(time, Happening::Computed(id, assignment));
        }
    }

    fn computed(&mut self, id: WorkerId, assignment: AssignmentId) {
        let now = self.now;
        let present = self.workers.get_mut(&id);
        let wanted =
            present.and_then(|worker| (!worker.dropped.remove(&assignment)).then_some(worker));
        let Some(worker) = wanted else {
            self.results.remove(&assignment);
            return;
        };
        if worker.stalled_until == Duration::MAX {
            worker.postponed.push(assignment);
            return;
        }
        if now < worker.stalled_until {
            let rest = worker.stalled_until - now;
            self.schedule(rest, Happening::Computed(id, assignment));
            return;
        }
        worker.running.remove(&assignment);
        self.computed += self.results[&assignment].compute_time;
        self.note(Note::Returned { assignment, arrives: now + self.model.latency });
        self.schedule(self.model.latency, Happening::Result(id, assignment));
        self.start_slots(id);
    }

    pub(super) fn carry_out(&mut self) {
        while let Some(command) = self.engine.poll_command() {
            match command {
                Command::Send(worker, message) => {
                    match &message {
                        ToWorker::Assignments(Assignments { items, .. }) => {
                            self.n_items_sent += items.len();
                            self.n_items_drawn += items.iter().filter(|item| item.is_drawn).count();
                        }
                        ToWorker::Drop(assignments) => self.n_items_dropped += assignments.len(),
                        ToWorker::Distribution(..) => self.n_distributions_sent += 1,
                        _ => {}
                    }
                    self.post(worker, message);
                }
                Command::Disconnect { worker, reason, .. } => {
                    self.forget(worker);
                    self.note(Note::Disconnected { worker, reason });
                }
                Command::FinishBatch { job, evaluated } => {
                    self.evaluated.push((job, evaluated));
                }
                Command::AskReferee { question, request } => {
                    let RefereeRequest { genotype, trial_set, trials, output, .. } = &request;
                    let order = Order { trial_set: *trial_set, trials, genotype, output: *output };
                    self.n_questions += 1;
                    let individual = genotype.individual;
                    self.note(Note::Asked { question, individual, trials: trials.clone() });
                    let verdict = self.work.verdict(&order);
                    let start = self.referee_busy_until.max(self.now);
                    self.referee_busy_until =
                        start + self.model.time(self.work.place(genotype), trials);
                    self.verdicts.insert(question, verdict);
                    let delay = self.referee_busy_until - self.now;
                    self.schedule(delay, Happening::Verdict(question));
                }
                Command::WithdrawQuestion { question } => {
                    self.verdicts.remove(&question);
                }
                Command::Quarantine { name, reason } => {
                    let (known, why) = (name.clone(), reason.clone());
                    self.note(Note::Quarantined { name: known, reason: why });
                    self.quarantined.push((name, reason));
                }
                Command::FailJob { job, reason } => {
                    self.failed.push((job, reason));
                }
            }
        }
        if self.model.checks {
            self.engine.sanity_check();
        }
    }

    fn post(&mut self, worker: WorkerId, message: ToWorker) {
        if self.workers.get(&worker).is_some_and(|worker| worker.is_by_hand) {
            return self.arrive(worker, message);
        }
        let arrives = self.now + self.model.latency;
        if let ToWorker::Assignments(Assignments { items, .. }) = &message {
            for item in items {
                self.note(Note::Sent {
                    worker,
                    assignment: item.id,
                    individual: item.genotype.individual,
                    trials: item.trials.clone(),
                    arrives,
                });
            }
        }
        self.n_messages += 1;
        self.messages.insert(self.n_messages, message);
        self.schedule(self.model.latency, Happening::Arrival(worker, self.n_messages));
    }

    /// Forgets a worker with its unfinished items.
    pub(super) fn forget(&mut self, id: WorkerId) {
        let worker = self.workers.remove(&id);
        for assignment in worker.into_iter().flat_map(|worker| worker.postponed) {
            self.results.remove(&assignment);
        }
    }

    fn note(&mut self, note: Note) {
        self.work.note(self.now, note);
    }
}
