//! A fleet in virtual time: the real engine, and workers that take as long as
//! they say, over a network with latency. No sockets, no sleeping.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap, VecDeque},
    num::NonZeroU64,
    time::{Duration, Instant},
};

use coordinator::{
    engine::{
        Assignment, Batch, Command, Engine, EngineConfig, EvaluatedBatch, Introduction, ItemResult,
        WorkerStatus,
    },
    ids::{AssignmentId, JobId, WorkerId},
    priority::Priority,
};
use evolution::Population;
use sim_core::TrialSet;

/// What a call of the simulation costs beside its trials, in trials.
const CALL_OVERHEAD: f64 = 0.4;
const TICK: Duration = Duration::from_millis(100);

/// What the fleet is made of.
#[derive(Debug, Clone, Copy)]
pub struct FleetModel {
    /// One way between coordinator and worker.
    pub latency: Duration,
    /// Mean time of a trial on a worker of speed 1.
    pub trial: Duration,
    /// Trials take from 1 - dispersion to 1 + dispersion times that, by genotype
    /// and trial.
    pub dispersion: f64,
    /// Whether a worker leaves off an item that it is told to drop; else it
    /// finishes it first.
    pub stops: bool,
    /// Whether the engine's state is checked after every event.
    pub checks: bool,
}

/// A simulated worker.
#[derive(Debug)]
struct Worker {
    introduction: Introduction,
    speed: f64,
    queue: VecDeque<(JobId, Assignment)>,
    running: BTreeMap<AssignmentId, JobId>,
    /// Computed, but wanted no more.
    dropped: BTreeSet<AssignmentId>,
    stalled_until: Duration,
    is_silent: bool,
    /// Makes up what it does not compute.
    is_faulty: bool,
}

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Happening {
    Tick,
    /// A message of these commands' numbers reaches a worker.
    Arrival(WorkerId, usize),
    Computed(WorkerId, AssignmentId),
    Result(WorkerId, AssignmentId),
    Awake(WorkerId),
}

/// The fleet, the engine, and what became of experiments.
pub struct SimulatedFleet {
    pub engine: Engine,
    pub evaluated: Vec<(JobId, EvaluatedBatch)>,
    pub failed: Vec<(JobId, String)>,
    pub paused: Vec<(JobId, String)>,
    pub n_items_sent: usize,
    pub n_items_dropped: usize,
    /// Time that workers computed, in all.
    pub computed: Duration,
    model: FleetModel,
    origin: Instant,
    now: Duration,
    n_happenings: u64,
    agenda: BinaryHeap<Reverse<(Duration, u64, Happening)>>,
    messages: BTreeMap<usize, Command>,
    results: BTreeMap<AssignmentId, ItemResult>,
    n_messages: usize,
    workers: BTreeMap<WorkerId, Worker>,
    n_processes: u64,
}

/// The fitness of an individual of the simulated experiments on a trial.
pub fn fitness(genotype: &[f64], trial: u32) -> f64 {
    genotype[0] * 1000.0 + f64::from(trial)
}

/// A population whose members can be told apart.
pub fn population(n: usize) -> Population {
    (0..n).map(|i| vec![i as f64]).collect()
}

/// A number in 0..1 that looks random.
pub fn uniform(seed: u64) -> f64 {
    let x = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

impl SimulatedFleet {
    #[expect(
        clippy::disallowed_methods,
        reason = "any instant will do as the origin of virtual time"
    )]
    pub fn new(model: FleetModel, config: EngineConfig) -> Self {
        let origin = Instant::now();
        let mut fleet = Self {
            engine: Engine::new(origin, config),
            evaluated: Vec::new(),
            failed: Vec::new(),
            paused: Vec::new(),
            n_items_sent: 0,
            n_items_dropped: 0,
            computed: Duration::ZERO,
            model,
            origin,
            now: Duration::ZERO,
            n_happenings: 0,
            agenda: BinaryHeap::new(),
            messages: BTreeMap::new(),
            results: BTreeMap::new(),
            n_messages: 0,
            workers: BTreeMap::new(),
            n_processes: 0,
        };
        fleet.schedule(TICK, Happening::Tick);
        fleet
    }

    /// Time since the beginning.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// The same, as the engine counts it.
    pub fn instant(&self) -> Instant {
        self.origin + self.now
    }

    pub fn worker_ids(&self) -> Vec<WorkerId> {
        self.workers.keys().copied().collect()
    }

    pub fn status(&self) -> Vec<WorkerStatus> {
        self.engine.worker_status(self.instant())
    }

    /// A new worker connects.
    pub fn join(&mut self, n_slots: usize, speed: f64) -> WorkerId {
        self.n_processes += 1;
        let introduction = Introduction {
            name: format!("worker-{}", self.n_processes),
            version: "simulated".to_owned(),
            n_slots,
            process: NonZeroU64::new(self.n_processes),
        };
        self.connect(introduction, speed)
    }

    fn connect(&mut self, introduction: Introduction, speed: f64) -> WorkerId {
        let id = self.engine.on_worker_joined(self.instant(), introduction.clone());
        let worker = Worker {
            introduction,
            speed,
            queue: VecDeque::new(),
            running: BTreeMap::new(),
            dropped: BTreeSet::new(),
            stalled_until: Duration::ZERO,
            is_silent: false,
            is_faulty: false,
        };
        self.workers.insert(id, worker);
        self.carry_out();
        id
    }

    /// A worker's stream breaks, and it does not come back.
    pub fn kill(&mut self, id: WorkerId) {
        self.workers.remove(&id);
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
    }

    /// A worker's stream breaks, and it comes back at once.
    pub fn flap(&mut self, id: WorkerId) {
        let Some(worker) = self.workers.remove(&id) else { return };
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
        self.connect(worker.introduction, worker.speed);
    }

    /// A worker computes nothing for a while, but its heart beats.
    pub fn stall(&mut self, id: WorkerId, time: Duration) {
        let until = self.now + time;
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.stalled_until = until;
            self.schedule(time, Happening::Awake(id));
        }
    }

    /// A worker is not heard of any more.
    pub fn silence(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.is_silent = true;
        }
    }

    /// A worker computes wrong values from now on.
    pub fn corrupt(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.is_faulty = true;
        }
    }

    pub fn drain(&mut self, id: WorkerId) {
        self.engine.on_draining(self.instant(), id);
        self.carry_out();
    }

    pub fn submit(&mut self, id: JobId, weight: u32) {
        let priority = Priority::new(weight).expect("within bounds");
        self.engine.on_job_started(id, "spec".into(), priority);
    }

    pub fn ask(&mut self, id: JobId, generation: u64, population_size: usize, n_trials: u32) {
        let genotypes = population(population_size);
        let batch = Batch::fitness(TrialSet::Generation(generation), genotypes, n_trials);
        self.engine.on_batch_requested(self.instant(), id, batch);
        self.carry_out();
    }

    /// Lets something happen to the engine.
    pub fn tell(&mut self, event: impl FnOnce(&mut Engine, Instant)) {
        event(&mut self.engine, self.origin + self.now);
        self.carry_out();
    }

    /// Lets time pass until a condition holds; whether it did before the time was
    /// over.
    pub fn run_until(&mut self, limit: Duration, mut is_met: impl FnMut(&Self) -> bool) -> bool {
        let end = self.now + limit;
        while !is_met(self) {
            let Some(Reverse((at, _, happening))) = self.agenda.pop() else { return false };
            if at > end {
                self.agenda.push(Reverse((at, 0, happening)));
                self.now = end;
                return false;
            }
            self.now = at;
            self.happen(happening);
        }
        true
    }

    /// Lets time pass.
    pub fn run_for(&mut self, time: Duration) {
        self.run_until(time, |_| false);
    }

    fn schedule(&mut self, delay: Duration, happening: Happening) {
        self.n_happenings += 1;
        self.agenda.push(Reverse((self.now + delay, self.n_happenings, happening)));
    }

    fn happen(&mut self, happening: Happening) {
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
        }
    }

    fn arrive(&mut self, id: WorkerId, message: Command) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        match message {
            Command::SendAssignments { job, assignments, .. } => {
                worker.queue.extend(assignments.into_iter().map(|assignment| (job, assignment)));
            }
            Command::SendDrop { assignments, .. } => {
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
            Command::SendEnd { job, .. } => {
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
            let Some((job, assignment)) = worker.queue.pop_front() else { return };
            worker.running.insert(assignment.id, job);
            let trials: f64 = assignment
                .trials
                .clone()
                .map(|trial| {
                    let place = (assignment.genotype[0] as u64) << 16 | u64::from(trial);
                    1.0 + model.dispersion * (2.0 * uniform(place) - 1.0)
                })
                .sum();
            let time = model.trial.mul_f64((trials + CALL_OVERHEAD) / worker.speed);
            let wrong = if worker.is_faulty { 1e-9 } else { 0.0 };
            let values = assignment
                .trials
                .clone()
                .map(|t| fitness(&assignment.genotype, t) + wrong)
                .collect();
            let result = ItemResult {
                id: assignment.id,
                output: sim_core::Output::Fitness,
                outcome: Ok(values),
                compute_time: time,
            };
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

    fn carry_out(&mut self) {
        while let Some(command) = self.engine.poll_command() {
            match command {
                Command::SendAssignments { worker, ref assignments, .. } => {
                    self.n_items_sent += assignments.len();
                    self.post(worker, command);
                }
                Command::SendDrop { worker, ref assignments } => {
                    self.n_items_dropped += assignments.len();
                    self.post(worker, command);
                }
                Command::SendEnd { worker, .. } | Command::SendSpec { worker, .. } => {
                    self.post(worker, command);
                }
                Command::Disconnect { worker, .. } => {
                    self.workers.remove(&worker);
                }
                Command::FinishBatch { job, evaluated } => {
                    self.evaluated.push((job, evaluated));
                }
                Command::PauseJob { job, reason } => {
                    self.paused.push((job, reason));
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

    fn post(&mut self, worker: WorkerId, message: Command) {
        self.n_messages += 1;
        self.messages.insert(self.n_messages, message);
        self.schedule(self.model.latency, Happening::Arrival(worker, self.n_messages));
    }
}
