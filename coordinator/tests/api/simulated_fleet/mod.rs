//! A fleet in virtual time: the real engine, and simulated workers of given speeds behind a network
//! with latency. There are no sockets, and nothing sleeps.
//!
//! A worker that [joins by hand](SimulatedFleet::join_by_hand) has neither latency nor a time of
//! its own: it computes on the test's command.

mod happenings;

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap, VecDeque},
    num::NonZeroU64,
    ops::Range,
    sync::Arc,
    time::{Duration, Instant},
};

use coordinator::{
    engine::{
        Assignment, Assignments, Batch, Command, Engine, EngineConfig, EvaluatedBatch,
        Introduction, ItemResult, JobActivity, NamePattern, TimelineEntry, ToWorker, WorkerStatus,
    },
    ids::{AssignmentId, JobId, QuestionId, WorkerId},
    priority::Priority,
    referee::{RefereeRequest, Verdict},
};
use evolution::Population;
use sim_core::{Output, TrialSet};

/// The failure that all workers report for a genotype that cannot be computed.
const FAILURE: &str = "it overflowed";
/// Overhead of a call of the simulation, in trials.
const CALL_OVERHEAD: f64 = 0.4;
const TICK: Duration = Duration::from_millis(100);

/// The parameters of the fleet.
#[derive(Debug, Clone, Copy)]
pub struct FleetModel {
    /// One way between coordinator and worker.
    pub latency: Duration,
    /// Mean time of a trial on a worker of speed 1.
    pub trial: Duration,
    /// By genotype and trial, the time varies from 1 - dispersion to 1 + dispersion times the mean.
    pub dispersion: f64,
    /// Whether a worker stops an item that it is told to drop; otherwise it finishes the item
    /// first.
    pub stops: bool,
    /// Whether the engine's state is checked after every event.
    pub checks: bool,
}

/// Stands for the distribution of a trial set's genotypes; as long as five of them.
fn distribution(trial_set: TrialSet) -> Arc<[u8]> {
    let generation = trial_set.generation().expect("nothing else is drawn");
    generation.to_le_bytes().repeat(5).into()
}

/// How a worker treats its items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conduct {
    /// It computes them.
    Honest,
    /// It invents its values, different from those of all others.
    Lies,
    /// It invents the value of the last trial of an item only.
    LiesAtTheEnd,
    /// It reports that they fail.
    Fails,
    /// It returns nothing, but sends heartbeats.
    Hangs,
    /// It returns a result of the wrong length.
    Babbles,
}

/// A simulated worker.
#[derive(Debug)]
struct Worker {
    introduction: Introduction,
    speed: f64,
    queue: VecDeque<(JobId, Assignment)>,
    last_assignment: AssignmentId,
    distributions: BTreeMap<JobId, Arc<[u8]>>,
    running: BTreeMap<AssignmentId, JobId>,
    /// Items in progress that the engine has dropped.
    dropped: BTreeSet<AssignmentId>,
    stalled_until: Duration,
    is_silent: bool,
    is_by_hand: bool,
    conduct: Conduct,
}

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Happening {
    Tick,
    /// The message with this index reaches a worker.
    Arrival(WorkerId, usize),
    Computed(WorkerId, AssignmentId),
    Result(WorkerId, AssignmentId),
    Awake(WorkerId),
    /// An item has taken its worker down.
    Death(WorkerId),
    Verdict(QuestionId),
}

/// The fleet, the engine, and the outcomes of experiments.
pub struct SimulatedFleet {
    pub engine: Engine,
    pub evaluated: Vec<(JobId, EvaluatedBatch)>,
    pub failed: Vec<(JobId, String)>,
    /// Names and reasons.
    pub quarantined: Vec<(String, String)>,
    /// Genotypes that take down the worker that computes them.
    pub poisonous: BTreeSet<u64>,
    /// Time until a poisonous genotype takes its worker down, relative to the time of a result.
    pub poison_takes: u32,
    /// Genotypes that cannot be computed.
    pub failing: BTreeSet<u64>,
    pub has_referee: bool,
    /// Whether the referee returns NaN for every fitness.
    pub has_no_fitness: bool,
    /// Number of questions to the referee.
    pub n_questions: usize,
    pub n_items_sent: usize,
    pub n_items_dropped: usize,
    /// Number of items whose genotype the worker draws.
    pub n_items_drawn: usize,
    pub n_distributions_sent: usize,
    /// Time that workers computed, in all.
    pub computed: Duration,
    model: FleetModel,
    origin: Instant,
    now: Duration,
    n_happenings: u64,
    agenda: BinaryHeap<Reverse<(Duration, u64, Happening)>>,
    messages: BTreeMap<usize, ToWorker>,
    results: BTreeMap<AssignmentId, ItemResult>,
    n_messages: usize,
    workers: BTreeMap<WorkerId, Worker>,
    n_processes: u64,
    /// When the referee has answered all questions.
    referee_busy_until: Duration,
    verdicts: BTreeMap<QuestionId, Verdict>,
}

/// The fitness of an individual of the simulated experiments on a trial.
pub fn fitness(genotype: &[f64], trial: u32) -> f64 {
    genotype[0] * 1000.0 + f64::from(trial)
}

/// A population whose members can be told apart.
pub fn population(n: usize) -> Population {
    (0..n).map(|i| vec![i as f64]).collect()
}

/// A pseudo-random number in 0..1.
pub fn uniform(seed: u64) -> f64 {
    let x = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

impl FleetModel {
    /// Duration of an item on a worker of speed 1.
    fn time(&self, genotype: &[f64], trials: &Range<u32>) -> Duration {
        let trials = trials.clone().map(|trial| {
            let place = (genotype[0] as u64) << 16 | u64::from(trial);
            1.0 + self.dispersion * (2.0 * uniform(place) - 1.0)
        });
        self.trial.mul_f64(trials.sum::<f64>() + CALL_OVERHEAD)
    }
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
            quarantined: Vec::new(),
            poisonous: BTreeSet::new(),
            poison_takes: 1,
            failing: BTreeSet::new(),
            has_referee: true,
            has_no_fitness: false,
            n_questions: 0,
            n_items_sent: 0,
            n_items_dropped: 0,
            n_items_drawn: 0,
            n_distributions_sent: 0,
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
            referee_busy_until: Duration::ZERO,
            verdicts: BTreeMap::new(),
        };
        fleet.schedule(TICK, Happening::Tick);
        fleet
    }

    /// Time since the beginning.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// The same as an instant, for the engine.
    pub fn instant(&self) -> Instant {
        self.origin + self.now
    }

    pub fn worker_ids(&self) -> Vec<WorkerId> {
        self.workers.keys().copied().collect()
    }

    /// The recent work of every worker.
    pub fn timeline(&self) -> Vec<TimelineEntry> {
        self.engine.timeline(self.instant())
    }

    /// The engine's status of the workers.
    pub fn status(&self) -> Vec<WorkerStatus> {
        self.engine.worker_status(self.instant())
    }

    /// A new worker connects.
    pub fn join(&mut self, n_slots: usize, speed: f64) -> WorkerId {
        self.join_with(n_slots, speed, Conduct::Honest)
    }

    /// A new worker connects.
    pub fn join_with(&mut self, n_slots: usize, speed: f64, conduct: Conduct) -> WorkerId {
        let introduction = self.introduction(n_slots);
        self.connect(introduction, speed, conduct, false)
    }

    /// A worker connects that computes on [`Self::step`].
    pub fn join_by_hand(&mut self, n_slots: usize) -> WorkerId {
        let introduction = self.introduction(n_slots);
        self.connect(introduction, 1.0, Conduct::Honest, true)
    }

    /// A worker connects that takes only experiments with a matching name.
    pub fn join_for(&mut self, experiments: &str, speed: f64) -> WorkerId {
        let experiments = NamePattern::new(experiments);
        let introduction = Introduction { experiments, ..self.introduction(1) };
        self.connect(introduction, speed, Conduct::Honest, false)
    }

    fn introduction(&mut self, n_slots: usize) -> Introduction {
        self.n_processes += 1;
        Introduction {
            name: format!("worker-{}", self.n_processes).into(),
            version: "simulated".to_owned(),
            n_slots,
            experiments: NamePattern::default(),
            process: NonZeroU64::new(self.n_processes),
        }
    }

    fn connect(
        &mut self,
        introduction: Introduction,
        speed: f64,
        conduct: Conduct,
        is_by_hand: bool,
    ) -> WorkerId {
        let id = self.engine.on_worker_joined(self.instant(), introduction.clone());
        let worker = Worker {
            introduction,
            speed,
            queue: VecDeque::new(),
            last_assignment: AssignmentId(0),
            distributions: BTreeMap::new(),
            running: BTreeMap::new(),
            dropped: BTreeSet::new(),
            stalled_until: Duration::ZERO,
            is_silent: false,
            is_by_hand,
            conduct,
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

    /// A worker's stream breaks, and the worker reconnects at once.
    pub fn flap(&mut self, id: WorkerId) -> Option<WorkerId> {
        let Worker { introduction, speed, conduct, is_by_hand, .. } = self.workers.remove(&id)?;
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
        Some(self.connect(introduction, speed, conduct, is_by_hand))
    }

    /// A worker is killed, and started again at once under the same name.
    pub fn restart(&mut self, id: WorkerId) -> Option<WorkerId> {
        self.n_processes += 1;
        let process = NonZeroU64::new(self.n_processes);
        let Worker { introduction, speed, conduct, is_by_hand, .. } = self.workers.remove(&id)?;
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
        Some(self.connect(Introduction { process, ..introduction }, speed, conduct, is_by_hand))
    }

    /// The open assignments of a worker that joined by hand.
    pub fn held(&self, id: WorkerId) -> Vec<Assignment> {
        let queue = self.workers.get(&id).map(|worker| &worker.queue);
        queue.into_iter().flatten().map(|(_, assignment)| assignment.clone()).collect()
    }

    /// Computes the oldest item of a worker that joined by hand; returns whether it had one.
    pub fn step(&mut self, id: WorkerId) -> bool {
        let worker = self.workers.get_mut(&id);
        let Some((_, assignment)) = worker.and_then(|worker| worker.queue.pop_front()) else {
            return false;
        };
        let values = assignment.trials.clone().map(|t| fitness(&assignment.genotype, t)).collect();
        self.answer(id, assignment.id, Ok(values));
        true
    }

    /// A worker that joined by hand answers an assignment.
    pub fn answer(
        &mut self,
        id: WorkerId,
        assignment: AssignmentId,
        outcome: Result<Vec<f64>, String>,
    ) {
        self.answer_with(id, assignment, Output::Fitness, outcome);
    }

    /// A worker that joined by hand answers an assignment with numbers of either kind.
    pub fn answer_with(
        &mut self,
        id: WorkerId,
        assignment: AssignmentId,
        output: Output,
        outcome: Result<Vec<f64>, String>,
    ) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.queue.retain(|(_, held)| held.id != assignment);
        }
        let compute_time = self.model.trial;
        let result = ItemResult { id: assignment, output, outcome, compute_time };
        self.engine.on_results(self.instant(), id, vec![result]);
        self.carry_out();
    }

    /// Lets all workers that joined by hand compute until nothing is left.
    pub fn run_by_hand(&mut self) {
        let ids = self.worker_ids();
        while ids.iter().filter(|&&id| self.step(id)).count() > 0 {}
    }

    /// A worker computes nothing for a while, but sends heartbeats.
    pub fn stall(&mut self, id: WorkerId, time: Duration) {
        let until = self.now + time;
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.stalled_until = until;
            self.schedule(time, Happening::Awake(id));
        }
    }

    /// A worker falls silent.
    pub fn silence(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.is_silent = true;
        }
    }

    /// A worker computes wrong values from now on.
    pub fn corrupt(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.conduct = Conduct::Lies;
        }
    }

    pub fn drain(&mut self, id: WorkerId) {
        self.engine.on_draining(self.instant(), id);
        self.carry_out();
    }

    pub fn submit(&mut self, id: JobId, weight: u32) {
        let priority = Priority::new(weight).expect("within bounds");
        let name = id.to_string().replace(' ', "-").into();
        self.engine.on_job_started(id, name, "spec".into(), priority);
    }

    pub fn ask(&mut self, id: JobId, generation: u64, population_size: usize, n_trials: u32) {
        let genotypes = population(population_size);
        let trial_set = TrialSet::Generation(generation);
        let batch = Batch::fitness(trial_set, genotypes, n_trials);
        let batch = Batch { distribution: Some(distribution(trial_set)), ..batch };
        self.engine.on_batch_requested(self.instant(), id, batch);
        self.carry_out();
    }

    /// Time passes in which the coordinator does nothing and hears nothing.
    pub fn freeze(&mut self, time: Duration) {
        self.now += time;
        self.tell(|engine, now| engine.on_tick(now));
    }

    /// The activity of a job.
    pub fn activity(&self, id: JobId) -> JobActivity {
        self.engine.activity(self.instant(), id)
    }

    /// Calls a handler of the engine, and carries out its commands.
    pub fn tell(&mut self, event: impl FnOnce(&mut Engine, Instant)) {
        event(&mut self.engine, self.origin + self.now);
        self.carry_out();
    }

    /// Lets time pass until a condition holds; returns whether it did within `limit`.
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
}
