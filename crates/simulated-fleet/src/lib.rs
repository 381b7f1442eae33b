//! A fleet in virtual time: the real engine, and simulated workers of given speeds behind a network
//! with latency. There are no sockets, and nothing sleeps.
//!
//! What workers compute is a [`Work`]. A worker that [joins by hand](SimulatedFleet::join_by_hand)
//! has neither latency nor a time of its own: it computes on the caller's command.

mod happenings;
mod work;
mod workers;

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap, VecDeque},
    ops::Range,
    sync::Arc,
    time::Duration,
};

use engine::{
    Assignment, Engine, EngineConfig, EvaluatedBatch, Instant, Introduction, ItemResult,
    JobActivity, TimelineEntry, ToWorker, Verdict, WorkerStatus,
};
use model::ids::{AssignmentId, JobId, QuestionId, WorkerId};
use sim_core::{Output, TrialSet};

pub use work::{Note, Order, Work};

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
    queue: VecDeque<Queued>,
    last_assignment: AssignmentId,
    distributions: BTreeMap<JobId, Arc<[u8]>>,
    running: BTreeMap<AssignmentId, JobId>,
    /// Items in progress that the engine has dropped.
    dropped: BTreeSet<AssignmentId>,
    stalled_until: Duration,
    /// Items whose end falls into a stall without end.
    postponed: Vec<AssignmentId>,
    is_silent: bool,
    is_by_hand: bool,
    conduct: Conduct,
}

/// An item at a worker.
#[derive(Debug)]
struct Queued {
    job: JobId,
    trial_set: TrialSet,
    output: Output,
    assignment: Assignment,
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
#[derive(Debug)]
pub struct SimulatedFleet<W> {
    /// The engine.
    pub engine: Engine,
    /// What the workers compute.
    pub work: W,
    /// The evaluated batches.
    pub evaluated: Vec<(JobId, EvaluatedBatch)>,
    /// The failed jobs, and why.
    pub failed: Vec<(JobId, String)>,
    /// Names and reasons.
    pub quarantined: Vec<(String, String)>,
    /// Number of questions to the referee.
    pub n_questions: usize,
    /// Number of items sent to workers.
    pub n_items_sent: usize,
    /// Number of items that workers were told to drop.
    pub n_items_dropped: usize,
    /// Number of items whose genotype the worker draws.
    pub n_items_drawn: usize,
    /// Number of distributions sent to workers.
    pub n_distributions_sent: usize,
    /// Time that workers computed, in all.
    pub computed: Duration,
    model: FleetModel,
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

/// A pseudo-random number in 0..1.
pub fn uniform(seed: u64) -> f64 {
    let x = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

impl FleetModel {
    /// Duration of an item on a worker of speed 1.
    fn time(&self, genotype: u64, trials: &Range<u32>) -> Duration {
        let trials = trials.clone().map(|trial| {
            let place = genotype << 16 | u64::from(trial);
            1.0 + self.dispersion * (2.0 * uniform(place) - 1.0)
        });
        self.trial.mul_f64(trials.sum::<f64>() + CALL_OVERHEAD)
    }
}

impl<W: Work> SimulatedFleet<W> {
    /// A fleet without workers.
    pub fn new(model: FleetModel, config: EngineConfig, work: W) -> Self {
        let mut fleet = Self {
            engine: Engine::new(Instant::after_origin(Duration::ZERO), config),
            work,
            evaluated: Vec::new(),
            failed: Vec::new(),
            quarantined: Vec::new(),
            n_questions: 0,
            n_items_sent: 0,
            n_items_dropped: 0,
            n_items_drawn: 0,
            n_distributions_sent: 0,
            computed: Duration::ZERO,
            model,
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
        Instant::after_origin(self.now)
    }

    /// The connected workers.
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
        event(&mut self.engine, Instant::after_origin(self.now));
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

impl Queued {
    fn order(&self) -> Order<'_> {
        Order {
            trial_set: self.trial_set,
            trials: &self.assignment.trials,
            genotype: &self.assignment.genotype,
            output: self.output,
        }
    }
}
