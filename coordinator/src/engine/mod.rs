//! Who computes what: a synchronous state machine.
//!
//! The shell calls a handler for everything that happens and then carries out
//! the [`Command`]s it collects with [`Engine::poll_command`]. Time comes in as
//! an argument; there is no I/O, no clock and no randomness, so a test can drive
//! any fleet through any history.
//!
//! The rules:
//! - An *item* is one genotype and a range of trials, assigned to one worker.
//!   A worker holds one per slot, and as many ahead as it computes in some tens
//!   of milliseconds.
//! - Experiments with work to hand out share the workers' time in proportion to
//!   their priorities. Time that one does not want, such as at its barrier, goes
//!   to the others and is not made up for.
//! - Near the end of a generation, and when slots would be idle, items are split
//!   by trial; when nothing is left to hand out, running items are duplicated if
//!   idle workers should be done sooner. The first result wins, and the others
//!   are told to drop the item.
//! - Work returns to the front of the queue when its worker leaves or falls
//!   silent, never because it takes long.
//! - A result counts by its place in the generation, not by its arrival, and the
//!   first one for each place is kept. So who computes what, and how often,
//!   cannot change a generation's fitness.
//! - Two results for the same place whose bits differ mean a faulty worker. The
//!   generation's results are thrown away, both workers get nothing more, and the
//!   experiment is paused with a reason that names them: nothing that was
//!   committed is lost, nothing doubtful is committed, and somebody decides. To
//!   find such workers, a share of the individuals can be audited: computed by a
//!   second worker, too, if there is one.
//! - Work that fails, or that takes its worker down, [`MAX_ATTEMPTS`] times
//!   fails its experiment, and the fleet goes on with the others. A worker whose
//!   process comes back was not taken down.

mod activity;
mod blame;
mod dispatch;
mod experiment;
mod figures;
mod fleet_time;
mod generation;
mod messages;
mod results;
mod standings;
mod worker;

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    mem,
    num::NonZeroU64,
    sync::Arc,
    time::{Duration, Instant},
};

use crate::{
    ids::{ExperimentId, WorkerId},
    priority::Priority,
};
use evolution::{Genotype, Population};

pub use activity::{Activity, HeldItems, RoundActivity};
use dispatch::Outgoing;
use experiment::ExperimentWork;
pub use figures::{FleetFigures, Tally, WorkFigures};
use fleet_time::FleetTime;
use generation::{GenerationInProgress, Shape, Task};
use standings::Standings;
use worker::Worker;

pub use messages::{
    Command, FleetSize, Introduction, Item, ItemResult, JudgedGeneration, SharedGenotype,
    WorkerStatus,
};

/// Times that work is tried before its experiment is given up.
pub const MAX_ATTEMPTS: u32 = 3;

/// How an engine decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineConfig {
    /// A worker that is silent for so long loses its items.
    pub lease: Duration,
    /// Share of the individuals, 0 to 1, that two workers compute.
    pub audit_fraction: f64,
    /// Whether items are split by trial when that keeps slots busy.
    pub split: bool,
    /// Whether waiting items move to idle slots, and running ones are duplicated.
    pub duplicate: bool,
}

impl EngineConfig {
    /// Splits and duplicates, audits nothing.
    pub fn new(lease: Duration) -> Self {
        Self { lease, audit_fraction: 0.0, split: true, duplicate: true }
    }
}

/// The state machine.
#[derive(Debug)]
pub struct Engine {
    config: EngineConfig,
    last_tick: Instant,
    n_workers_seen: u64,
    n_items_assigned: u64,
    workers: BTreeMap<WorkerId, Worker>,
    standings: Standings,
    experiments: BTreeMap<ExperimentId, ExperimentWork>,
    /// Experiments with something to hand out, by what they were served.
    turns: BTreeSet<(u128, ExperimentId)>,
    /// What the experiment that was served last had been served: who comes back
    /// from waiting begins there, so that nobody saves up turns.
    served_until: u128,
    outgoing: Outgoing,
    commands: VecDeque<Command>,
    fleet_time: FleetTime,
    tally: Tally,
}

impl Engine {
    /// An engine without workers or work.
    pub fn new(now: Instant, config: EngineConfig) -> Self {
        Self {
            config,
            last_tick: now,
            n_workers_seen: 0,
            n_items_assigned: 0,
            workers: BTreeMap::new(),
            standings: Standings::default(),
            experiments: BTreeMap::new(),
            turns: BTreeSet::new(),
            served_until: 0,
            outgoing: Outgoing::default(),
            commands: VecDeque::new(),
            fleet_time: FleetTime::new(now),
            tally: Tally::default(),
        }
    }

    /// The next thing to do, if any. Call until there is none after every
    /// handler.
    pub fn poll_command(&mut self) -> Option<Command> {
        self.commands.pop_front()
    }

    /// Connected workers and slots.
    pub fn fleet_size(&self) -> FleetSize {
        FleetSize { n_workers: self.workers.len(), n_slots: self.fleet_time.n_slots() }
    }

    /// The connected workers, in the order in which they joined.
    pub fn worker_status(&self, now: Instant) -> Vec<WorkerStatus> {
        self.workers.iter().map(|(&id, worker)| worker.status(id, now)).collect()
    }

    /// A worker has introduced itself.
    pub fn on_worker_joined(&mut self, now: Instant, introduction: Introduction) -> WorkerId {
        if let Some(process) = introduction.process {
            self.forgive(process);
        }
        self.n_workers_seen += 1;
        self.tally.n_workers_joined += 1;
        let id = WorkerId(self.n_workers_seen);
        self.fleet_time.set_slots(now, self.fleet_time.n_slots() + introduction.n_slots);
        let worker = Worker::new(introduction, now);
        self.standings.add(id, &worker);
        self.workers.insert(id, worker);
        self.assign(now);
        id
    }

    /// A worker's stream has ended. Its work goes to others; returns how many
    /// items that are.
    pub fn on_worker_left(&mut self, now: Instant, id: WorkerId) -> usize {
        let n_items_requeued = self.forget_worker(now, id, Some("was lost"));
        self.assign(now);
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
        if self.workers.contains_key(&id) {
            self.update_worker(id, |worker| worker.is_draining = true);
            self.finish_waived(now);
        }
    }

    /// A worker has computed items.
    pub fn on_results(&mut self, now: Instant, id: WorkerId, results: Vec<ItemResult>) {
        self.on_heartbeat(now, id);
        for result in results {
            self.on_result(now, id, result);
        }
        self.assign(now);
    }

    /// An experiment exists; workers will need its specification.
    pub fn on_experiment_started(&mut self, id: ExperimentId, spec: Arc<str>, priority: Priority) {
        self.experiments.insert(id, ExperimentWork::new(spec, priority));
    }

    /// The genotypes of an experiment's next generation are known.
    pub fn on_generation_asked(
        &mut self,
        now: Instant,
        id: ExperimentId,
        generation: u64,
        genotypes: Population,
        n_trials: u32,
    ) {
        self.ask(now, id, generation, genotypes, Shape { n_trials, n_values: 1 });
    }

    /// A genotype is to be evaluated: for the engine a generation of one, of which
    /// every trial gives `n_values` numbers.
    pub fn on_evaluation_asked(
        &mut self,
        now: Instant,
        id: ExperimentId,
        genotype: Genotype,
        n_trials: u32,
        n_values: usize,
    ) {
        let genotypes = vec![genotype].into();
        self.ask(now, id, sim_core::EVALUATION, genotypes, Shape { n_trials, n_values });
    }

    fn ask(
        &mut self,
        now: Instant,
        id: ExperimentId,
        generation: u64,
        genotypes: Population,
        shape: Shape,
    ) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        assert!(work.generation.is_none(), "one generation at a time");
        self.fleet_time.advance(now);
        let clock = self.fleet_time;
        work.generation = Some(GenerationInProgress::new(generation, genotypes, shape, now, clock));
        self.make_ready(id);
        self.assign(now);
    }

    /// An experiment waits until it is resumed. Its work is taken back; what has
    /// been judged is kept.
    pub fn on_experiment_paused(&mut self, now: Instant, id: ExperimentId) {
        self.pause(id);
        self.assign(now);
    }

    /// A paused experiment goes on.
    pub fn on_experiment_resumed(&mut self, now: Instant, id: ExperimentId) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        work.is_paused = false;
        self.make_ready(id);
        self.finish_waived(now);
        self.assign(now);
    }

    /// An experiment's share of the fleet is another from now on.
    pub fn on_priority_set(&mut self, id: ExperimentId, priority: Priority) {
        if let Some(work) = self.experiments.get_mut(&id) {
            work.priority = priority;
        }
    }

    /// An experiment is over, for whatever reason.
    pub fn on_experiment_ended(&mut self, now: Instant, id: ExperimentId) {
        self.forget_experiment(id);
        self.assign(now);
    }

    /// Time has passed. Call several times per lease, and as often as late work
    /// should be noticed.
    pub fn on_tick(&mut self, now: Instant) {
        let lease = self.config.lease;
        // If the coordinator itself has paused (a suspended laptop, a debugger),
        // that is not its workers' silence.
        let pause = now.saturating_duration_since(mem::replace(&mut self.last_tick, now));
        if pause > lease / 2 {
            self.workers.values_mut().for_each(|worker| worker.last_heard += pause);
            let works = self.experiments.values_mut();
            let generations = works.filter_map(|work| work.generation.as_mut());
            generations.for_each(|generation| generation.blames.postpone(pause));
        }
        let silent: Vec<WorkerId> = self
            .workers
            .iter()
            .filter(|(_, worker)| worker.last_heard + lease <= now)
            .map(|(&id, _)| id)
            .collect();
        for id in silent {
            // Silence is the network's fault, or a pause's, not an item's.
            self.drop_worker(now, id, None, format!("silent for {} s", lease.as_secs_f64()));
        }
        self.give_up_overdue(now);
        self.assign(now);
    }

    /// Lets an experiment take turns, if it has something to hand out.
    fn make_ready(&mut self, id: ExperimentId) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        if work.is_ready() && !self.turns.contains(&(work.served, id)) {
            work.served = work.served.max(self.served_until);
            self.turns.insert((work.served, id));
        }
    }

    fn correct_charge(&mut self, id: ExperimentId, charged: Duration, real: Duration) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        let has_turn = self.turns.remove(&(work.served, id));
        work.correct_charge(charged, real);
        if has_turn {
            self.turns.insert((work.served, id));
        }
    }

    /// Whether the results of a task are compared with another worker's. Depends
    /// on nothing but the seed-independent place of the individual, so that the
    /// same individuals are audited whoever computes them.
    fn is_audited(&self, id: ExperimentId, task: &Task) -> bool {
        let Some(work) = self.experiments.get(&id) else { return false };
        let Some(generation) = &work.generation else { return false };
        let place = [id.0, generation.number, u64::from(task.individual)];
        let hash = place.into_iter().fold(0, |hash, part| mix(hash ^ part));
        (hash as f64) < self.config.audit_fraction * (1u128 << 64) as f64
    }

    /// A process is alive, so that no work has taken it down.
    fn forgive(&mut self, process: NonZeroU64) {
        let ids: Vec<ExperimentId> = self.experiments.keys().copied().collect();
        for id in ids {
            let work = self.experiments.get_mut(&id).expect("just listed");
            let Some(generation) = &mut work.generation else { continue };
            for task in generation.blames.on_process_joined(process) {
                self.requeue(id, &task);
            }
        }
    }

    /// Fails experiments whose work has taken too many workers down for good.
    fn give_up_overdue(&mut self, now: Instant) {
        let overdue: Vec<(ExperimentId, Task, String)> = self
            .experiments
            .iter()
            .filter_map(|(&id, work)| {
                let generation = work.generation.as_ref()?;
                let (task, blame) = generation.blames.overdue(now)?;
                // Another copy's result may have come.
                let is_needed = generation.duplicable(task).is_some();
                is_needed.then(|| (id, task.clone(), blame.to_owned()))
            })
            .collect();
        for (id, task, blame) in overdue {
            self.fail(id, &task, &blame);
        }
    }

    fn drop_worker(&mut self, now: Instant, id: WorkerId, blame: Option<&str>, reason: String) {
        let n_items_requeued = self.forget_worker(now, id, blame);
        self.commands.push_back(Command::Disconnect { worker: id, reason, n_items_requeued });
    }

    /// `blame`: what happened to it that the items it was computing may have
    /// caused, if they may.
    fn forget_worker(&mut self, now: Instant, id: WorkerId, blame: Option<&str>) -> usize {
        let Some(worker) = self.workers.remove(&id) else { return 0 };
        match worker.is_draining {
            true => self.tally.n_workers_left += 1,
            false => self.tally.n_workers_lost += 1,
        }
        self.standings.remove(id, &worker);
        self.fleet_time.set_slots(now, self.fleet_time.n_slots() - worker.n_slots());
        // Only what it was computing can have taken it down: its oldest items,
        // one per slot. A worker that said goodbye was not taken down.
        let n_suspects = if worker.is_draining { 0 } else { worker.n_slots() };
        let n_items = worker.in_flight.len();
        let blame = blame.map(|blame| format!("its worker \"{}\" {blame}", worker.name()));
        let process = worker.introduction.process;
        // Later items first, so that the earliest ends up at the queue's front.
        for (age_rank, (item, assignment)) in worker.in_flight.into_iter().enumerate().rev() {
            self.forget_holder(item, &assignment);
            self.correct_charge(assignment.experiment, assignment.charge, Duration::ZERO);
            let blame = blame.as_deref().filter(|_| age_rank < n_suspects);
            self.retry(now, assignment, blame.map(|blame| (process, blame)));
        }
        self.finish_waived(now);
        n_items
    }

    fn forget_experiment(&mut self, id: ExperimentId) {
        self.withdraw(id);
        self.experiments.remove(&id);
    }

    fn pause(&mut self, id: ExperimentId) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        if !mem::replace(&mut work.is_paused, true) {
            self.withdraw(id);
        }
    }

    /// Takes an experiment away from all workers; its work waits again.
    fn withdraw(&mut self, id: ExperimentId) {
        let Some(work) = self.experiments.get_mut(&id) else { return };
        self.turns.remove(&(work.served, id));
        let mut audits = Vec::new();
        for (&worker_id, worker) in &mut self.workers {
            worker.recalled.retain(|(_, assignment)| assignment.experiment != id);
            if worker.known_experiments.remove(&id) {
                self.standings.remove(worker_id, worker);
                let ours = worker.in_flight.extract_if(.., |_, a| a.experiment == id);
                audits.extend(ours.filter(|(_, a)| a.is_audit).map(|(_, a)| a.task));
                self.standings.add(worker_id, worker);
                self.commands.push_back(Command::SendEnd { worker: worker_id, experiment: id });
            }
        }
        if let Some(generation) = &mut work.generation {
            generation.requeue_all();
            audits.into_iter().for_each(|task| generation.push_audit(task));
        }
    }

    fn generation_mut(&mut self, id: ExperimentId) -> &mut GenerationInProgress {
        let work = self.experiments.get_mut(&id);
        work.and_then(|work| work.generation.as_mut()).expect("what is assigned is being judged")
    }

    fn update_worker<T>(&mut self, id: WorkerId, change: impl FnOnce(&mut Worker) -> T) -> T {
        let worker = self.workers.get_mut(&id).expect("the caller has seen it");
        self.standings.remove(id, worker);
        let result = change(worker);
        self.standings.add(id, worker);
        result
    }

    /// Panics if the state contradicts itself. For tests: it looks at everything.
    pub fn sanity_check(&self) {
        let mut standings = Standings::default();
        let mut in_flight: BTreeMap<ExperimentId, BTreeMap<_, _>> = BTreeMap::new();
        for (&id, worker) in &self.workers {
            standings.add(id, worker);
            for (&item, assignment) in &worker.in_flight {
                assert!(worker.known_experiments.contains(&assignment.experiment));
                let entry = (id, assignment.task.clone(), assignment.is_audit);
                in_flight.entry(assignment.experiment).or_default().insert(item, entry);
            }
            assert!(worker.recalled.len() <= 2 * worker.n_slots());
        }
        assert_eq!(standings.available, self.standings.available);
        assert_eq!(standings.backlogged, self.standings.backlogged);
        assert_eq!(standings.n_idle_slots, self.standings.n_idle_slots);
        assert_eq!(standings.n_usable_slots, self.standings.n_usable_slots);
        for (&id, work) in &self.experiments {
            let in_flight = in_flight.remove(&id).unwrap_or_default();
            assert!(!work.is_paused || in_flight.is_empty(), "paused work is nobody's");
            assert_eq!(self.turns.contains(&(work.served, id)), work.is_ready());
            match &work.generation {
                Some(generation) => generation.sanity_check(&in_flight),
                None => assert!(in_flight.is_empty()),
            }
        }
        assert!(in_flight.is_empty(), "nobody computes for an experiment that is over");
        let n_ready = self.experiments.values().filter(|work| work.is_ready()).count();
        assert_eq!(self.turns.len(), n_ready);
        let has_queued = |work: &&ExperimentWork| {
            work.is_ready() && work.generation.as_ref().is_some_and(|g| g.n_queued() > 0)
        };
        assert!(
            !self.has_idle_slot() || self.experiments.values().find(has_queued).is_none(),
            "no work waits while a slot is idle"
        );
        assert!(self.outgoing.is_empty(), "everything is sent");
        let n_slots: usize = self.workers.values().map(Worker::n_slots).sum();
        assert_eq!(n_slots, self.fleet_time.n_slots());
        let Tally { n_workers_joined, n_workers_left, n_workers_lost, .. } = self.tally;
        let n_gone = n_workers_left + n_workers_lost;
        assert_eq!(n_workers_joined - n_gone, self.workers.len() as u64);
    }
}

/// A step of SplitMix64 (Steele, Lea & Flood 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests;
