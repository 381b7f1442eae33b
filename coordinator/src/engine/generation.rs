//! A generation that is being judged: what is known, who computes the rest, what
//! waits.

use std::{
    collections::{BTreeMap, VecDeque},
    ops::Range,
    sync::Arc,
    time::{Duration, Instant},
};

use crate::ids::{ItemId, WorkerId};
use evolution::Population;

use super::{FleetTime, JudgedGeneration, blame::Blames};

/// Copies of a trial that are computed at the same time, at most.
const COPIES_MAX: usize = 3;
/// Who judged a trial that nobody has judged.
const NOBODY: WorkerId = WorkerId(0);

/// Numbers of one task of measured trials, half a MiB: results travel in messages of
/// limited size.
const VALUES_PER_TASK: usize = 1 << 16;

/// What there is to know of each individual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Trials.
    pub n_trials: u32,
    /// Numbers per trial: 1, its fitness, or all that is measured of it.
    pub n_values: usize,
}

impl Shape {
    /// Trials of a task: all, if they are no more than numbers.
    fn trials_per_task(self) -> u32 {
        match self.n_values {
            1 => self.n_trials,
            n_values => u32::try_from(VALUES_PER_TASK / n_values).unwrap_or(u32::MAX).max(1),
        }
    }
}

/// A part of a generation: one individual on a range of trials.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    /// Index of the individual.
    pub individual: u32,
    /// Trials to run.
    pub trials: Range<u32>,
}

/// Somebody who computes a task.
#[derive(Debug, Clone)]
struct Holder {
    item: ItemId,
    worker: WorkerId,
    trials: Range<u32>,
    is_audit: bool,
}

/// Two workers' results for the same trial differ.
#[derive(Debug, Clone)]
pub struct Disagreement {
    /// Whose result came first.
    pub first: WorkerId,
    /// Its name.
    pub first_name: Arc<str>,
    /// About which trial.
    pub trial: u32,
    /// What the first said, and the second.
    pub values: (f64, f64),
}

/// A generation that is being judged.
#[derive(Debug)]
pub struct GenerationInProgress {
    /// Index of the generation, or address of held-out trials.
    pub number: u64,
    /// Who is judged.
    pub genotypes: Population,
    shape: Shape,
    /// What no worker has been given, in the order in which it will be.
    queue: VecDeque<Task>,
    n_trials_queued: usize,
    /// By individual.
    holders: BTreeMap<u32, Vec<Holder>>,
    /// Running work that nobody duplicates, by when it should be done.
    pub uncovered: BTreeMap<(Instant, ItemId), WorkerId>,
    /// Work that takes workers down.
    pub blames: Blames,
    /// Per individual and trial, [`Shape::n_values`] each; meaningless until judged.
    trial_fitness: Vec<Vec<f64>>,
    /// Whose result it is; per individual and trial, in one row.
    judges: Vec<WorkerId>,
    /// Of everybody among `judges`.
    names: BTreeMap<WorkerId, Arc<str>>,
    n_trials_left: usize,
    /// Work that another worker has to confirm, by the name of the first.
    audits: BTreeMap<Arc<str>, VecDeque<Task>>,
    n_audits_in_flight: usize,
    n_audited: usize,
    started: Instant,
    fleet_time_at_start: FleetTime,
}

/// All there is to do, in tasks.
fn tasks(n_individuals: usize, shape: Shape) -> impl Iterator<Item = Task> {
    let n_per_task = shape.trials_per_task();
    let firsts = move |_| (0..shape.n_trials).step_by(n_per_task.max(1) as usize);
    (0..n_individuals as u32).flat_map(move |individual| {
        firsts(individual).map(move |first| {
            let last = shape.n_trials.min(first.saturating_add(n_per_task));
            Task { individual, trials: first..last }
        })
    })
}

impl GenerationInProgress {
    /// A generation of which nothing is judged.
    pub fn new(
        number: u64,
        genotypes: Population,
        shape: Shape,
        now: Instant,
        fleet_time: FleetTime,
    ) -> Self {
        let n_all = genotypes.len() * shape.n_trials as usize;
        let n_values = shape.n_trials as usize * shape.n_values;
        Self {
            number,
            shape,
            queue: tasks(genotypes.len(), shape).collect(),
            n_trials_queued: n_all,
            holders: BTreeMap::new(),
            uncovered: BTreeMap::new(),
            blames: Blames::default(),
            trial_fitness: vec![vec![f64::NAN; n_values]; genotypes.len()],
            judges: vec![NOBODY; n_all],
            names: BTreeMap::new(),
            n_trials_left: n_all,
            audits: BTreeMap::new(),
            n_audits_in_flight: 0,
            n_audited: 0,
            genotypes,
            started: now,
            fleet_time_at_start: fleet_time,
        }
    }

    /// Queues all that is not judged; nobody computes anything any more.
    pub fn requeue_all(&mut self) {
        self.holders.clear();
        self.n_audits_in_flight = 0;
        self.uncovered.clear();
        self.queue.clear();
        self.n_trials_queued = 0;
        for task in tasks(self.genotypes.len(), self.shape) {
            for task in self.unclaimed(&task) {
                self.n_trials_queued += task.trials.len();
                self.queue.push_back(task);
            }
        }
    }

    /// Forgets all results: whoever gave them cannot be trusted.
    pub fn start_over(&mut self) {
        self.judges.fill(NOBODY);
        self.names.clear();
        self.n_trials_left = self.judges.len();
        self.audits.clear();
        self.n_audited = 0;
        self.requeue_all();
    }

    fn index(&self, individual: u32, trial: u32) -> usize {
        individual as usize * self.shape.n_trials as usize + trial as usize
    }

    fn is_known(&self, individual: u32, trial: u32) -> bool {
        self.judges[self.index(individual, trial)] != NOBODY
    }

    /// The parts of a task that are neither judged, nor computed by anybody, nor
    /// held back.
    pub fn unclaimed(&self, task: &Task) -> Vec<Task> {
        self.parts(task, |trial| {
            !self.is_known(task.individual, trial)
                && self.n_copies(task.individual, trial) == 0
                && !self.blames.is_held_back(task.individual, trial)
        })
    }

    /// The part of a task that may be computed once more.
    pub fn duplicable(&self, task: &Task) -> Option<Task> {
        let parts = self.parts(task, |trial| {
            !self.is_known(task.individual, trial)
                && self.n_copies(task.individual, trial) < COPIES_MAX
        });
        parts.into_iter().next()
    }

    fn n_copies(&self, individual: u32, trial: u32) -> usize {
        let holders = self.holders.get(&individual).into_iter().flatten();
        holders.filter(|holder| !holder.is_audit && holder.trials.contains(&trial)).count()
    }

    /// The contiguous parts of a task whose trials satisfy a condition.
    fn parts(&self, task: &Task, is_in: impl Fn(u32) -> bool) -> Vec<Task> {
        let individual = task.individual;
        let mut parts: Vec<Task> = Vec::new();
        for trial in task.trials.clone().filter(|&trial| is_in(trial)) {
            match parts.last_mut() {
                Some(part) if part.trials.end == trial => part.trials.end += 1,
                _ => parts.push(Task { individual, trials: trial..trial + 1 }),
            }
        }
        parts
    }

    /// Queues work before all other.
    pub fn push_front(&mut self, task: Task) {
        self.n_trials_queued += task.trials.len();
        self.queue.push_front(task);
    }

    /// Takes the first `n_trials` trials at most of the first task in the queue.
    pub fn pop_front(&mut self, n_trials: usize) -> Option<Task> {
        let mut task = self.queue.pop_front()?;
        self.n_trials_queued -= task.trials.len();
        if n_trials < task.trials.len() {
            let middle = task.trials.start + n_trials as u32;
            self.push_front(Task { trials: middle..task.trials.end, ..task.clone() });
            task.trials.end = middle;
        }
        Some(task)
    }

    /// Trials per individual.
    pub fn n_trials(&self) -> u32 {
        self.shape.n_trials
    }

    /// Numbers that so many trials give.
    pub fn n_values(&self, n_trials: usize) -> usize {
        n_trials * self.shape.n_values
    }

    /// Tasks that wait.
    pub fn n_queued(&self) -> usize {
        self.queue.len()
    }

    /// Items that wait: tasks, and audits.
    pub fn n_waiting(&self) -> usize {
        self.queue.len() + self.audits.values().map(VecDeque::len).sum::<usize>()
    }

    /// Items that workers have.
    pub fn n_in_flight(&self) -> usize {
        self.holders.values().map(Vec::len).sum()
    }

    /// Trials that wait.
    pub fn n_trials_queued(&self) -> usize {
        self.n_trials_queued
    }

    /// Whether an audit waits.
    pub fn has_audits(&self) -> bool {
        !self.audits.is_empty()
    }

    /// Whether an audit waits for a worker of this name.
    pub fn has_audit_for(&self, name: &str) -> bool {
        self.audits.keys().any(|first| **first != *name)
    }

    /// Takes the first audit that a worker of this name may do.
    pub fn pop_audit_for(&mut self, name: &str) -> Option<Task> {
        let (first, tasks) = self.audits.iter_mut().find(|(first, _)| ***first != *name)?;
        let task = tasks.pop_front();
        if tasks.is_empty() {
            let first = Arc::clone(first);
            self.audits.remove(&first);
        }
        task
    }

    /// Whether anything waits.
    pub fn has_waiting(&self) -> bool {
        !self.queue.is_empty() || !self.audits.is_empty()
    }

    /// A worker has been given a task.
    pub fn add_holder(&mut self, item: ItemId, worker: WorkerId, task: &Task, is_audit: bool) {
        self.n_audits_in_flight += usize::from(is_audit);
        let holder = Holder { item, worker, trials: task.trials.clone(), is_audit };
        self.holders.entry(task.individual).or_default().push(holder);
    }

    /// A worker has a task no more. An audit that is not over waits again.
    pub fn remove_holder(&mut self, item: ItemId, individual: u32) {
        let Some(holders) = self.holders.get_mut(&individual) else { return };
        let Some(index) = holders.iter().position(|holder| holder.item == item) else { return };
        let holder = holders.remove(index);
        if holders.is_empty() {
            self.holders.remove(&individual);
        }
        self.n_audits_in_flight -= usize::from(holder.is_audit);
    }

    /// Everybody who computes parts of an individual, apart from audits.
    pub fn holders(&self, individual: u32) -> impl Iterator<Item = (WorkerId, ItemId)> {
        let holders = self.holders.get(&individual).into_iter().flatten();
        holders.filter(|holder| !holder.is_audit).map(|holder| (holder.worker, holder.item))
    }

    /// Queues an audit; the first worker is the one whose result is known.
    pub fn push_audit(&mut self, task: Task) {
        let first = self.judges[self.index(task.individual, task.trials.start)];
        if let Some(name) = self.names.get(&first) {
            self.audits.entry(Arc::clone(name)).or_default().push_back(task);
        }
    }

    /// Whether a worker's values agree with what is known.
    pub fn compare(&self, task: &Task, fitness: &[f64]) -> Result<(), Disagreement> {
        for (trial, values) in task.trials.clone().zip(fitness.chunks_exact(self.shape.n_values)) {
            let first = self.judges[self.index(task.individual, trial)];
            if first == NOBODY {
                continue;
            }
            let known = &self.trial_fitness[task.individual as usize][self.places(trial)];
            let mut pairs = known.iter().copied().zip(values.iter().copied());
            if let Some(values) = pairs.find(|(known, value)| known.to_bits() != value.to_bits()) {
                let first_name = Arc::clone(&self.names[&first]);
                return Err(Disagreement { first, first_name, trial, values });
            }
        }
        Ok(())
    }

    /// Where the numbers of a trial are among those of its individual.
    fn places(&self, trial: u32) -> Range<usize> {
        let first = self.n_values(trial as usize);
        first..first + self.shape.n_values
    }

    /// Records those values of a task that are not known; returns their number.
    pub fn accept(&mut self, worker: WorkerId, name: &str, task: &Task, fitness: &[f64]) -> usize {
        let mut n_new = 0;
        for (trial, values) in task.trials.clone().zip(fitness.chunks_exact(self.shape.n_values)) {
            let (index, places) = (self.index(task.individual, trial), self.places(trial));
            if self.judges[index] == NOBODY {
                self.judges[index] = worker;
                self.trial_fitness[task.individual as usize][places].copy_from_slice(values);
                n_new += 1;
            }
        }
        if n_new > 0 && !self.names.contains_key(&worker) {
            self.names.insert(worker, name.into());
        }
        self.n_trials_left -= n_new;
        n_new
    }

    /// An audit has agreed.
    pub fn count_audited(&mut self) {
        self.n_audited += 1;
    }

    /// Who computes parts of an individual whose results are all known, apart from
    /// audits.
    pub fn redundant(&self, individual: u32) -> Vec<(WorkerId, ItemId)> {
        let holders = self.holders.get(&individual).into_iter().flatten();
        holders
            .filter(|holder| !holder.is_audit)
            .filter(|holder| holder.trials.clone().all(|trial| self.is_known(individual, trial)))
            .map(|holder| (holder.worker, holder.item))
            .collect()
    }

    /// Trials of all individuals.
    pub fn n_episodes(&self) -> usize {
        self.judges.len()
    }

    /// Those whose fitness is not known.
    pub fn n_episodes_left(&self) -> usize {
        self.n_trials_left
    }

    /// Time since it began.
    pub fn running_for(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.started)
    }

    /// What it is called in messages.
    pub fn name(&self) -> String {
        if self.number == sim_core::EVALUATION {
            return "the evaluation".into();
        }
        match self.number.checked_sub(sim_core::held_out(0)) {
            Some(generation) => format!("the re-evaluation after generation {generation}"),
            None => format!("generation {}", self.number),
        }
    }

    /// Whether all fitness is known and no audit is under way, or waits for a worker
    /// that is there.
    pub fn is_judged(&self, is_there: impl Fn(&Self) -> bool) -> bool {
        self.n_trials_left == 0
            && self.n_audits_in_flight == 0
            && (self.audits.is_empty() || !is_there(self))
    }

    /// Whether all fitness is known.
    pub fn is_known_throughout(&self) -> bool {
        self.n_trials_left == 0
    }

    /// The outcome.
    pub fn into_judged(
        self,
        now: Instant,
        n_workers: usize,
        fleet_time: &FleetTime,
    ) -> JudgedGeneration {
        JudgedGeneration {
            generation: self.number,
            trial_fitness: self.trial_fitness,
            duration: now.saturating_duration_since(self.started),
            n_workers,
            idle_share: fleet_time.idle_share_since(&self.fleet_time_at_start),
            n_audited: self.n_audited,
            n_unaudited: self.audits.values().map(VecDeque::len).sum(),
        }
    }

    /// Panics if the state contradicts itself; `in_flight`: what workers hold of
    /// it, in any order.
    pub fn sanity_check(&self, in_flight: &BTreeMap<ItemId, (WorkerId, Task, bool)>) {
        let n_queued: usize = self.queue.iter().map(|task| task.trials.len()).sum();
        assert_eq!(n_queued, self.n_trials_queued);
        let n_known = self.judges.iter().filter(|&&judge| judge != NOBODY).count();
        assert_eq!(n_known + self.n_trials_left, self.judges.len());
        let mut n_holders = 0;
        for (&individual, holders) in &self.holders {
            assert!(!holders.is_empty());
            for Holder { item, worker, trials, is_audit } in holders {
                n_holders += 1;
                let task = Task { individual, trials: trials.clone() };
                assert_eq!(in_flight[item], (*worker, task, *is_audit));
            }
        }
        assert_eq!(n_holders, in_flight.len(), "every holder is known");
        let n_audits = in_flight.values().filter(|(.., is_audit)| *is_audit).count();
        assert_eq!(n_audits, self.n_audits_in_flight);
        for ((_, item), worker) in &self.uncovered {
            assert_eq!(in_flight[item].0, *worker);
        }
        // Every trial is judged, queued or being computed, possibly by several, or
        // held back; and it is queued only if it is nothing else.
        let mut claims = vec![0_u32; self.judges.len()];
        for task in &self.queue {
            for trial in task.trials.clone() {
                claims[self.index(task.individual, trial)] += 1;
            }
        }
        for (index, n_queued) in claims.into_iter().enumerate() {
            let n_trials = self.shape.n_trials as usize;
            let (individual, trial) = ((index / n_trials) as u32, (index % n_trials) as u32);
            let n_copies = self.n_copies(individual, trial);
            let is_known = self.is_known(individual, trial);
            let is_held_back = self.blames.is_held_back(individual, trial);
            let is_waited_for = !is_known && (n_copies > 0 || is_held_back);
            let n_states = u32::from(is_known) + n_queued + u32::from(is_waited_for);
            assert_eq!(n_states, 1, "individual {individual}, trial {trial}");
            assert!(n_copies <= COPIES_MAX);
        }
    }
}
