//! Who computes what: a synchronous state machine.
//!
//! The shell calls a handler for everything that happens and then carries out
//! the [`Command`]s it collects with [`Engine::poll_command`]. Time comes in as
//! an argument; there is no I/O, no clock and no randomness, so a test can drive
//! any fleet through any history.
//!
//! The rules:
//! - An *item* is one genotype and a range of trials, assigned to one worker.
//!   A worker holds at most [`CREDITS_PER_SLOT`] items per slot, so that it has
//!   the next one at hand while results travel.
//! - Work returns to the front of the queue when its worker leaves or falls
//!   silent, never because it takes long.
//! - A result counts only while its item is assigned, and by its place in the
//!   generation, not by its arrival. So who computes what, and how often, cannot
//!   change a generation's fitness.
//! - Work that fails, or that takes its worker down, [`MAX_ATTEMPTS`] times
//!   fails its experiment, and the fleet goes on with the others.

mod generation;
mod worker;

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    mem,
    ops::Range,
    sync::Arc,
    time::{Duration, Instant},
};

use crate::{
    evolution::Genotype,
    ids::{ExperimentId, ItemId, WorkerId},
};

use generation::{GenerationInProgress, Task};
use worker::Worker;

/// Items in flight per slot.
pub const CREDITS_PER_SLOT: usize = 2;
/// Times that work is tried before its experiment is given up.
pub const MAX_ATTEMPTS: u32 = 3;

/// The state machine.
#[derive(Debug)]
pub struct Engine {
    lease: Duration,
    last_tick: Instant,
    n_workers_seen: u64,
    n_items_assigned: u64,
    workers: BTreeMap<WorkerId, Worker>,
    /// Workers with credit, least loaded first.
    available: BTreeSet<(u64, WorkerId)>,
    experiments: BTreeMap<ExperimentId, ExperimentWork>,
    /// Experiments with unassigned work; the front one is served next.
    turns: VecDeque<ExperimentId>,
    commands: VecDeque<Command>,
    fleet_time: FleetTime,
}

/// What the engine knows of an experiment.
#[derive(Debug)]
struct ExperimentWork {
    /// Opaque to the engine; every worker gets it once.
    spec: Arc<str>,
    generation: Option<GenerationInProgress>,
}

/// What the shell has to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Send a worker the specification of an experiment.
    SendSpec {
        /// To whom.
        worker: WorkerId,
        /// Of what.
        experiment: ExperimentId,
        /// As given to [`Engine::on_experiment_started`].
        spec: Arc<str>,
    },
    /// Send a worker items of one generation.
    SendItems {
        /// To whom.
        worker: WorkerId,
        /// Of what.
        experiment: ExperimentId,
        /// Whose trial seeds apply.
        generation: u64,
        /// At least one.
        items: Vec<Item>,
    },
    /// Tell a worker that an experiment is over.
    SendEnd {
        /// To whom.
        worker: WorkerId,
        /// What is over.
        experiment: ExperimentId,
    },
    /// Close a worker's stream; the engine has forgotten it already.
    Disconnect {
        /// Whose.
        worker: WorkerId,
        /// For the log and for the worker.
        reason: String,
        /// Items that it held and that others will get.
        n_items_requeued: usize,
    },
    /// A generation is judged.
    FinishGeneration {
        /// Of what.
        experiment: ExperimentId,
        /// The outcome.
        judged: JudgedGeneration,
    },
    /// An experiment cannot go on; the engine has forgotten it already.
    FailExperiment {
        /// Which.
        experiment: ExperimentId,
        /// For its owner.
        reason: String,
    },
}

/// One genotype and the trials to run it on, assigned to a worker.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// This assignment.
    pub id: ItemId,
    /// Trials to run.
    pub trials: Range<u32>,
    /// Its genes.
    pub genotype: Arc<Genotype>,
}

/// A worker's answer to an item.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemResult {
    /// The assignment.
    pub id: ItemId,
    /// Fitness per trial, or why there is none.
    pub outcome: Result<Vec<f64>, String>,
    /// Time the worker computed.
    pub compute_time: Duration,
}

/// A generation with all its fitness.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedGeneration {
    /// Index of the generation.
    pub generation: u64,
    /// Fitness per individual and trial.
    pub trial_fitness: Vec<Vec<f64>>,
    /// From its start to its last result.
    pub duration: Duration,
    /// Workers connected at its end.
    pub n_workers: usize,
    /// Share of the slots' time, meanwhile, that was not spent computing.
    pub idle_share: f64,
}

/// A worker as a reader of logs sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FleetSize {
    /// Connected workers.
    pub n_workers: usize,
    /// Their slots.
    pub n_slots: usize,
}

impl Engine {
    /// An engine without workers or work. A worker that is silent for `lease`
    /// loses its items.
    pub fn new(now: Instant, lease: Duration) -> Self {
        Self {
            lease,
            last_tick: now,
            n_workers_seen: 0,
            n_items_assigned: 0,
            workers: BTreeMap::new(),
            available: BTreeSet::new(),
            experiments: BTreeMap::new(),
            turns: VecDeque::new(),
            commands: VecDeque::new(),
            fleet_time: FleetTime::new(now),
        }
    }

    /// The next thing to do, if any. Call until there is none after every
    /// handler.
    pub fn poll_command(&mut self) -> Option<Command> {
        self.commands.pop_front()
    }

    /// Connected workers and slots.
    pub fn fleet_size(&self) -> FleetSize {
        FleetSize { n_workers: self.workers.len(), n_slots: self.fleet_time.n_slots }
    }

    /// A worker has introduced itself.
    pub fn on_worker_joined(&mut self, now: Instant, name: &str, n_slots: usize) -> WorkerId {
        self.n_workers_seen += 1;
        let id = WorkerId(self.n_workers_seen);
        let worker = Worker::new(name, n_slots, now);
        self.available.insert((worker.load(), id));
        self.workers.insert(id, worker);
        self.fleet_time.set_slots(now, |n_slots_before| n_slots_before + n_slots);
        self.assign();
        id
    }

    /// A worker's stream has ended. Its work goes to others; returns how many
    /// items that are.
    pub fn on_worker_left(&mut self, now: Instant, id: WorkerId) -> usize {
        let n_items_requeued = self.forget_worker(now, id, Some("was lost"));
        self.assign();
        n_items_requeued
    }

    /// A worker is alive.
    pub fn on_heartbeat(&mut self, now: Instant, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.last_heard = now;
        }
    }

    /// A worker wants no more items. It will finish what it computes and leave.
    pub fn on_draining(&mut self, now: Instant, id: WorkerId) {
        self.on_heartbeat(now, id);
        if let Some(worker) = self.workers.get_mut(&id) {
            self.available.remove(&(worker.load(), id));
            worker.is_draining = true;
        }
    }

    /// A worker has computed items.
    pub fn on_results(&mut self, now: Instant, id: WorkerId, results: Vec<ItemResult>) {
        self.on_heartbeat(now, id);
        for result in results {
            self.on_result(now, id, result);
        }
        self.assign();
    }

    /// An experiment exists; workers will need its specification.
    pub fn on_experiment_started(&mut self, id: ExperimentId, spec: Arc<str>) {
        self.experiments.insert(id, ExperimentWork { spec, generation: None });
    }

    /// The genotypes of an experiment's next generation are known.
    pub fn on_generation_asked(
        &mut self,
        now: Instant,
        id: ExperimentId,
        generation: u64,
        genotypes: Vec<Genotype>,
        n_trials: u32,
    ) {
        let Some(experiment) = self.experiments.get_mut(&id) else { return };
        assert!(experiment.generation.is_none(), "one generation at a time");
        self.fleet_time.advance(now);
        let clock = self.fleet_time;
        experiment.generation =
            Some(GenerationInProgress::new(generation, genotypes, n_trials, now, clock));
        self.turns.push_back(id);
        self.assign();
    }

    /// An experiment is over, for whatever reason.
    pub fn on_experiment_ended(&mut self, id: ExperimentId) {
        self.forget_experiment(id);
        self.assign();
    }

    /// Time has passed. Call several times per lease.
    pub fn on_tick(&mut self, now: Instant) {
        let lease = self.lease;
        // If the coordinator itself has paused (a suspended laptop, a debugger),
        // that is not its workers' silence.
        let pause = now.saturating_duration_since(mem::replace(&mut self.last_tick, now));
        if pause > lease / 2 {
            self.workers.values_mut().for_each(|worker| worker.last_heard += pause);
        }
        let silent: Vec<WorkerId> = self
            .workers
            .iter()
            .filter(|(_, worker)| worker.last_heard + lease <= now)
            .map(|(&id, _)| id)
            .collect();
        for id in silent {
            // Silence is the network's fault, or a pause's, not an item's.
            self.disconnect(now, id, None, format!("silent for {} s", lease.as_secs_f64()));
        }
        self.assign();
    }

    fn on_result(&mut self, now: Instant, id: WorkerId, result: ItemResult) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        // Unknown: the experiment has ended meanwhile, or the worker makes items
        // up. Neither can do harm.
        let Some(assignment) = worker.in_flight.get(&result.id) else { return };
        let n_trials = assignment.task.trials.len();
        if let Ok(fitness) = &result.outcome
            && fitness.len() != n_trials
        {
            let reason = format!("it returned {} values for {n_trials} trials", fitness.len());
            let blame = format!("was dropped: {reason}");
            self.disconnect(now, id, Some(&blame), reason);
            return;
        }
        let (experiment_id, task) = self.take_assignment(id, result.id);
        self.fleet_time.add_busy(result.compute_time);
        match result.outcome {
            Ok(fitness) => self.accept(now, experiment_id, &task, fitness),
            Err(message) => {
                let blame = format!("the worker reports: {message}");
                self.retry(experiment_id, task, Some(&blame));
            }
        }
    }

    fn accept(&mut self, now: Instant, id: ExperimentId, task: &Task, fitness: Vec<f64>) {
        let Some(experiment) = self.experiments.get_mut(&id) else { return };
        let Some(generation) = &mut experiment.generation else { return };
        generation.accept(task, fitness);
        if generation.is_judged() {
            self.fleet_time.advance(now);
            let generation = experiment.generation.take().expect("just seen");
            let judged = generation.into_judged(now, self.workers.len(), &self.fleet_time);
            self.commands.push_back(Command::FinishGeneration { experiment: id, judged });
        }
    }

    /// Queues work again. `blame`: why this attempt counts against it, if it does.
    fn retry(&mut self, id: ExperimentId, mut task: Task, blame: Option<&str>) {
        let Some(experiment) = self.experiments.get_mut(&id) else { return };
        let Some(generation) = &mut experiment.generation else { return };
        if let Some(blame) = blame {
            task.n_failed_attempts += 1;
            if task.n_failed_attempts >= MAX_ATTEMPTS {
                let reason = format!(
                    "individual {} of {}, trials {}..{}, failed {MAX_ATTEMPTS} times; \
                     at last {blame}",
                    task.individual,
                    generation.name(),
                    task.trials.start,
                    task.trials.end,
                );
                self.forget_experiment(id);
                self.commands.push_back(Command::FailExperiment { experiment: id, reason });
                return;
            }
        }
        if generation.queue.is_empty() {
            self.turns.push_back(id);
        }
        generation.queue.push_front(task);
    }

    /// Gives queued work to the least loaded workers, the experiments taking
    /// turns.
    fn assign(&mut self) {
        let mut batches: BTreeMap<(WorkerId, ExperimentId), (u64, Vec<Item>)> = BTreeMap::new();
        while let Some(&experiment_id) = self.turns.front()
            && let Some((_, worker_id)) = self.available.pop_first()
        {
            let experiment = &mut self.experiments.get_mut(&experiment_id);
            let generation = experiment
                .as_mut()
                .and_then(|experiment| experiment.generation.as_mut())
                .expect("an experiment that takes turns has queued work");
            let task = generation.queue.pop_front().expect("as above");
            self.n_items_assigned += 1;
            let item = Item {
                id: ItemId(self.n_items_assigned),
                trials: task.trials.clone(),
                genotype: Arc::clone(&generation.genotypes[task.individual as usize]),
            };
            let number = generation.number;
            self.turns.pop_front();
            if !generation.queue.is_empty() {
                self.turns.push_back(experiment_id);
            }

            let worker = self.workers.get_mut(&worker_id).expect("available workers exist");
            worker.assign(item.id, experiment_id, task);
            if worker.has_credit() {
                self.available.insert((worker.load(), worker_id));
            }
            let batch = batches.entry((worker_id, experiment_id));
            batch.or_insert_with(|| (number, Vec::new())).1.push(item);
        }
        for ((worker, experiment), (generation, items)) in batches {
            let is_new = self
                .workers
                .get_mut(&worker)
                .is_some_and(|worker| worker.known_experiments.insert(experiment));
            if is_new {
                let spec = Arc::clone(&self.experiments[&experiment].spec);
                self.commands.push_back(Command::SendSpec { worker, experiment, spec });
            }
            self.commands.push_back(Command::SendItems { worker, experiment, generation, items });
        }
    }

    /// Ends an assignment and gives its worker the credit back.
    fn take_assignment(&mut self, worker_id: WorkerId, item: ItemId) -> (ExperimentId, Task) {
        let worker = self.workers.get_mut(&worker_id).expect("the caller has seen it");
        self.available.remove(&(worker.load(), worker_id));
        let assignment = worker.in_flight.remove(&item).expect("the caller has seen it");
        if worker.has_credit() {
            self.available.insert((worker.load(), worker_id));
        }
        (assignment.experiment, assignment.task)
    }

    fn disconnect(&mut self, now: Instant, id: WorkerId, blame: Option<&str>, reason: String) {
        let n_items_requeued = self.forget_worker(now, id, blame);
        self.commands.push_back(Command::Disconnect { worker: id, reason, n_items_requeued });
    }

    /// `blame`: what happened to it that the items it was computing may have
    /// caused, if they may.
    fn forget_worker(&mut self, now: Instant, id: WorkerId, blame: Option<&str>) -> usize {
        let Some(worker) = self.workers.remove(&id) else { return 0 };
        self.available.remove(&(worker.load(), id));
        self.fleet_time.set_slots(now, |n_slots| n_slots - worker.n_slots);
        // Only what it was computing can have taken it down: its oldest items,
        // one per slot. A worker that said goodbye was not taken down.
        let n_suspects = if worker.is_draining { 0 } else { worker.n_slots };
        let n_items = worker.in_flight.len();
        // Later items first, so that the earliest ends up at the queue's front.
        for (age_rank, (_, assignment)) in worker.in_flight.into_iter().enumerate().rev() {
            let blame = blame.filter(|_| age_rank < n_suspects);
            let blame = blame.map(|blame| format!("its worker \"{}\" {blame}", worker.name));
            self.retry(assignment.experiment, assignment.task, blame.as_deref());
        }
        n_items
    }

    fn forget_experiment(&mut self, id: ExperimentId) {
        if self.experiments.remove(&id).is_none() {
            return;
        }
        self.turns.retain(|&turn| turn != id);
        for (&worker_id, worker) in &mut self.workers {
            if worker.known_experiments.remove(&id) {
                self.available.remove(&(worker.load(), worker_id));
                worker.in_flight.retain(|_, assignment| assignment.experiment != id);
                if worker.has_credit() {
                    self.available.insert((worker.load(), worker_id));
                }
                self.commands.push_back(Command::SendEnd { worker: worker_id, experiment: id });
            }
        }
    }
}

/// How long the fleet's slots have existed, and computed, altogether.
#[derive(Debug, Clone, Copy)]
struct FleetTime {
    now: Instant,
    n_slots: usize,
    capacity_s: f64,
    busy_s: f64,
}

impl FleetTime {
    fn new(now: Instant) -> Self {
        Self { now, n_slots: 0, capacity_s: 0.0, busy_s: 0.0 }
    }

    fn advance(&mut self, now: Instant) {
        let elapsed = now.saturating_duration_since(self.now);
        self.capacity_s += elapsed.as_secs_f64() * self.n_slots as f64;
        self.now = self.now.max(now);
    }

    fn set_slots(&mut self, now: Instant, n_slots: impl FnOnce(usize) -> usize) {
        self.advance(now);
        self.n_slots = n_slots(self.n_slots);
    }

    fn add_busy(&mut self, time: Duration) {
        self.busy_s += time.as_secs_f64();
    }

    /// Share of the slots' time since `start` that was not spent computing.
    fn idle_share_since(&self, start: &Self) -> f64 {
        let capacity_s = self.capacity_s - start.capacity_s;
        if capacity_s > 0.0 {
            (1.0 - (self.busy_s - start.busy_s) / capacity_s).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests;
