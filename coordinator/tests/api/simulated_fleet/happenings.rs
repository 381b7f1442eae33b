//! Events in virtual time, and how workers and commands react to them.

use super::*;

impl SimulatedFleet {
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
                    self.engine.on_results(self.instant(), id, vec![result]);
                    self.carry_out();
                }
            }
            Happening::Awake(id) => self.start_slots(id),
            Happening::Death(id) => {
                self.restart(id);
            }
            Happening::Verdict(question) => {
                if let Some(verdict) = self.verdicts.remove(&question) {
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
            ToWorker::Assignments(Assignments { job, trial_set, items, .. }) => {
                if items.iter().any(|assignment| assignment.is_drawn) {
                    let known = worker.distributions.get(&job);
                    assert_eq!(
                        known,
                        Some(&distribution(trial_set)),
                        "the worker has the distribution to draw from"
                    );
                }
                for assignment in items {
                    // The engine blames a loss on the items that it assigned first.
                    let is_next = assignment.id > worker.last_assignment;
                    assert!(is_next, "sent in the order given: {:?}", assignment.id);
                    worker.last_assignment = assignment.id;
                    worker.queue.push_back((job, assignment));
                }
            }
            ToWorker::Drop(assignments) => {
                let assignments = BTreeSet::from_iter(assignments);
                worker.queue.retain(|(_, assignment)| !assignments.contains(&assignment.id));
                let running: Vec<AssignmentId> =
                    worker.running.keys().copied().filter(|id| assignments.contains(id)).collect();
                if self.model.stops {
                    for assignment in running {
                        worker.running.remove(&assignment);
                        worker.dropped.insert(assignment);
                    }
                }
            }
            ToWorker::End(job) => {
                worker.distributions.remove(&job);
                worker.queue.retain(|(of, _)| *of != job);
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
            let Some((job, assignment)) = worker.queue.pop_front() else { return };
            worker.running.insert(assignment.id, job);
            let time = model.time(&assignment.genotype, &assignment.trials).div_f64(worker.speed);
            let individual = assignment.genotype[0] as u64;
            if self.poisonous.contains(&individual) && worker.conduct != Conduct::Lies {
                self.schedule(time * self.poison_takes, Happening::Death(id));
                continue;
            }
            let last = assignment.trials.end - 1;
            let wrong = |trial| match worker.conduct {
                Conduct::Lies => 1e-9 * id.0 as f64,
                Conduct::LiesAtTheEnd if trial == last => 1e-9 * id.0 as f64,
                _ => 0.0,
            };
            let values =
                assignment.trials.clone().map(|t| fitness(&assignment.genotype, t) + wrong(t));
            let outcome = match worker.conduct {
                Conduct::Fails => Err("it is too hot here".to_owned()),
                Conduct::Babbles => Ok(vec![1.0; assignment.trials.len() + 1]),
                Conduct::Honest if self.failing.contains(&individual) => Err(FAILURE.to_owned()),
                _ => Ok(values.collect()),
            };
            let output = Output::Fitness;
            let result = ItemResult { id: assignment.id, output, outcome, compute_time: time };
            self.results.insert(assignment.id, result);
            self.schedule(time, Happening::Computed(id, assignment.id));
        }
    }

    fn computed(&mut self, id: WorkerId, assignment: AssignmentId) {
        let now = self.now;
        let gone =
            self.workers.get_mut(&id).is_none_or(|worker| worker.dropped.remove(&assignment));
        if gone {
            self.results.remove(&assignment);
            return;
        }
        let worker = self.workers.get_mut(&id).expect("just seen");
        if now < worker.stalled_until {
            let rest = worker.stalled_until - now;
            self.schedule(rest, Happening::Computed(id, assignment));
            return;
        }
        worker.running.remove(&assignment);
        self.computed += self.results[&assignment].compute_time;
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
                Command::Disconnect { worker, .. } => {
                    self.workers.remove(&worker);
                }
                Command::FinishBatch { job, evaluated } => {
                    self.evaluated.push((job, evaluated));
                }
                Command::AskReferee { question, request } => {
                    let RefereeRequest { genotype, trials, .. } = request;
                    self.n_questions += 1;
                    let individual = genotype[0] as u64;
                    let verdict = if !self.has_referee {
                        Verdict::Unavailable("it is not there".to_owned())
                    } else if self.poisonous.contains(&individual) {
                        Verdict::Died("signal 11".to_owned())
                    } else if self.failing.contains(&individual) {
                        Verdict::Failed(FAILURE.to_owned())
                    } else if self.has_no_fitness {
                        Verdict::Values(vec![f64::NAN; trials.len()])
                    } else {
                        Verdict::Values(trials.clone().map(|t| fitness(&genotype, t)).collect())
                    };
                    let start = self.referee_busy_until.max(self.now);
                    self.referee_busy_until = start + self.model.time(&genotype, &trials);
                    self.verdicts.insert(question, verdict);
                    let delay = self.referee_busy_until - self.now;
                    self.schedule(delay, Happening::Verdict(question));
                }
                Command::WithdrawQuestion { question } => {
                    self.verdicts.remove(&question);
                }
                Command::Quarantine { name, reason } => self.quarantined.push((name, reason)),
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
        self.n_messages += 1;
        self.messages.insert(self.n_messages, message);
        self.schedule(self.model.latency, Happening::Arrival(worker, self.n_messages));
    }
}
