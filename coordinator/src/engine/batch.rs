//! A batch that is being computed: the results so far, who computes the rest, and
//! what waits.

use std::{
    collections::BTreeMap,
    mem,
    ops::Range,
    sync::Arc,
    time::{Duration, Instant},
};

use sim_core::{Output, TrialSet};

use crate::ids::{AssignmentId, WorkerId};

use super::{
    Batch, EvaluatedBatch, SharedGenotype,
    fleet_time::FleetTime,
    item::Item,
    known_results::KnownResults,
    queue::Queue,
    trust::{Audits, LossRecord},
};

/// Numbers of one item of measures, half a MiB: results travel in messages of
/// limited size.
const VALUES_PER_ITEM: usize = 1 << 16;

/// Individuals that the referee evaluates before a generation counts as one without finite
/// fitness. One is enough if any worker is honest and the fitness function is of use; more,
/// as single genotypes may have no finite fitness.
const WITHOUT_FITNESS_MIN: u32 = 8;

/// Trials of an item: all of them, unless they give more numbers than that.
fn trials_per_item(batch: &Batch) -> u32 {
    let n_trials = match batch.output {
        Output::Fitness => batch.n_trials,
        Output::Measures => {
            u32::try_from(VALUES_PER_ITEM / batch.values_per_trial.max(1)).unwrap_or(u32::MAX)
        }
    };
    n_trials.max(1)
}

/// A worker that computes an item.
#[derive(Debug, Clone)]
struct Holder {
    assignment_id: AssignmentId,
    worker: WorkerId,
    trials: Range<u32>,
    is_audit: bool,
}

/// A batch that is being computed.
#[derive(Debug)]
pub struct BatchInProgress {
    batch: Batch,
    /// What no worker has been given, in the order in which it will be.
    queue: Queue,
    /// Items that workers were lost with and that no worker has been given again.
    suspects: Queue,
    /// Items that no worker is given until the referee has answered.
    held_back: Vec<Item>,
    /// Items that no worker is given until a time.
    delayed: Vec<(Instant, Item)>,
    /// Disagreements that the referee has not settled.
    pub n_disagreements: usize,
    /// Individuals that the referee has evaluated because none has a finite fitness.
    pub n_without_fitness: u32,
    /// The workers that compute items, by individual.
    holders: BTreeMap<u32, Vec<Holder>>,
    /// Assignments that are not duplicated yet, by when they should be done.
    pub uncovered: BTreeMap<(Instant, AssignmentId), WorkerId>,
    /// Items that workers were lost with.
    pub losses: LossRecord,
    /// The results so far.
    pub known: KnownResults,
    /// What another worker has to confirm.
    pub audits: Audits,
    started: Instant,
    fleet_time_at_start: FleetTime,
}

/// Everything that a batch asks for, as items.
fn items(batch: &Batch) -> impl Iterator<Item = Item> + use<> {
    let (n_trials, n_per_item) = (batch.n_trials, trials_per_item(batch));
    (0..batch.genotypes.len() as u32).flat_map(move |individual| {
        (0..n_trials).step_by(n_per_item as usize).map(move |first| {
            let last = n_trials.min(first.saturating_add(n_per_item));
            Item { individual, trials: first..last }
        })
    })
}

impl BatchInProgress {
    /// A batch without results.
    pub fn new(batch: Batch, now: Instant, fleet_time: FleetTime) -> Self {
        let n_individuals = batch.genotypes.len();
        let known = KnownResults::new(n_individuals, batch.n_trials, batch.values_per_trial);
        Self {
            queue: items(&batch).collect(),
            suspects: Queue::default(),
            held_back: Vec::new(),
            delayed: Vec::new(),
            n_disagreements: 0,
            n_without_fitness: 0,
            holders: BTreeMap::new(),
            uncovered: BTreeMap::new(),
            losses: LossRecord::default(),
            known,
            audits: Audits::default(),
            batch,
            started: now,
            fleet_time_at_start: fleet_time,
        }
    }

    /// Which worlds and noise its trials meet.
    pub fn trial_set(&self) -> TrialSet {
        self.batch.trial_set
    }

    /// What workers can draw its genotypes from.
    pub fn distribution(&self) -> Option<&Arc<[u8]>> {
        self.batch.distribution.as_ref()
    }

    /// What workers return for a trial.
    pub fn output(&self) -> Output {
        self.batch.output
    }

    /// The genotype of an individual.
    pub fn genotype(&self, individual: u32) -> SharedGenotype {
        SharedGenotype { population: Arc::clone(&self.batch.genotypes), individual }
    }

    /// Queues everything without a result, as no worker computes it any more.
    pub fn requeue_all(&mut self) {
        self.holders.clear();
        self.audits.n_in_flight = 0;
        self.uncovered.clear();
        (self.queue, self.suspects) = Default::default();
        for item in items(&self.batch) {
            for item in self.unclaimed(&item) {
                self.queue_back(item);
            }
        }
    }

    fn queue_back(&mut self, item: Item) {
        self.queue_of(&item).push_back(item);
    }

    /// Forgets all values of a worker, and the audits of them, and queues what is unknown
    /// then.
    pub fn discard(&mut self, name: &str) {
        self.audits.discard(name);
        for item in self.known.discard(name) {
            for part in self.unclaimed(&item) {
                self.queue_back(part);
            }
        }
    }

    /// Takes what is known or held back of an individual out of the queues.
    pub fn unqueue(&mut self, individual: u32) {
        let queues = [mem::take(&mut self.queue), mem::take(&mut self.suspects)];
        let rest = |item: Item| {
            if item.individual == individual { self.unclaimed(&item) } else { vec![item] }
        };
        let [queue, suspects] = queues.map(|queue| queue.into_iter().flat_map(rest).collect());
        (self.queue, self.suspects) = (queue, suspects);
    }

    /// Gives an item to no worker until [`Self::release`].
    pub fn hold_back(&mut self, item: Item) {
        let individual = item.individual;
        self.held_back.push(item);
        self.unqueue(individual);
    }

    /// Takes back [`Self::hold_back`]; whether it was in force.
    pub fn release(&mut self, item: &Item) -> bool {
        let index = self.held_back.iter().position(|held_back| held_back == item);
        index.map(|index| self.held_back.swap_remove(index)).is_some()
    }

    /// Gives an item to no worker until a time.
    pub fn delay(&mut self, item: Item, until: Instant) {
        self.delayed.push((until, item));
    }

    /// An item whose time has come. One at a time: an item that waits twice, because two
    /// copies were lost, is held back until the second one is taken, too.
    pub fn take_due(&mut self, now: Instant) -> Option<Item> {
        let index = self.delayed.iter().position(|(until, _)| *until < now)?;
        Some(self.delayed.remove(index).1)
    }

    fn is_held_back(&self, individual: u32, trial: u32) -> bool {
        let delayed = self.delayed.iter().map(|(_, item)| item);
        let mut items = self.held_back.iter().chain(delayed);
        items.any(|item| item.individual == individual && item.trials.contains(&trial))
    }

    /// The parts of an item that have no result, that no worker computes, and that
    /// are not held back.
    pub fn unclaimed(&self, item: &Item) -> Vec<Item> {
        item.parts(|trial| {
            !self.known.has(item.individual, trial)
                && self.n_copies(item.individual, trial) == 0
                && !self.is_held_back(item.individual, trial)
        })
    }

    /// The first part of an item that may be given to another worker as well.
    pub fn duplicable(&self, item: &Item) -> Option<Item> {
        let may = |trial| {
            !self.known.has(item.individual, trial) && !self.is_held_back(item.individual, trial)
        };
        item.parts(may).into_iter().next()
    }

    /// Whether a worker computes a part of an item, apart from audits.
    pub fn is_holder(&self, worker: WorkerId, item: &Item) -> bool {
        let holders = self.holders.get(&item.individual).into_iter().flatten();
        let mut holders = holders.filter(|holder| !holder.is_audit && holder.worker == worker);
        holders.any(|holder| {
            holder.trials.start < item.trials.end && item.trials.start < holder.trials.end
        })
    }

    fn n_copies(&self, individual: u32, trial: u32) -> usize {
        let holders = self.holders.get(&individual).into_iter().flatten();
        holders.filter(|holder| !holder.is_audit && holder.trials.contains(&trial)).count()
    }

    /// Queues an item before all others; a suspect, with the suspects.
    pub fn queue_front(&mut self, item: Item) {
        self.queue_of(&item).push_front(item);
    }

    fn queue_of(&mut self, item: &Item) -> &mut Queue {
        if self.losses.is_suspect(item) { &mut self.suspects } else { &mut self.queue }
    }

    /// Takes at most `n_trials` trials of the first item that waits: [`Queue::pop_front`].
    pub fn pop_front(&mut self, n_trials: usize) -> Option<Item> {
        self.queue.pop_front(n_trials)
    }

    /// The same with the rests last: [`Queue::pop_whole_first`].
    pub fn pop_whole_first(&mut self, n_trials: usize) -> Option<Item> {
        self.queue.pop_whole_first(n_trials, trials_per_item(&self.batch) as usize)
    }

    /// Trials per individual.
    pub fn n_trials(&self) -> u32 {
        self.batch.n_trials
    }

    /// Numbers that so many trials give.
    pub fn n_values(&self, n_trials: usize) -> usize {
        n_trials * self.batch.values_per_trial
    }

    /// Items in the queue.
    pub fn n_queued(&self) -> usize {
        self.queue.len()
    }

    /// Items that wait for a worker, audits included.
    pub fn n_waiting(&self) -> usize {
        self.queue.len() + self.suspects.len() + self.audits.n_waiting()
    }

    /// Items that workers have.
    pub fn n_in_flight(&self) -> usize {
        self.holders.values().map(Vec::len).sum()
    }

    /// Trials that wait.
    pub fn n_trials_queued(&self) -> usize {
        self.queue.n_trials()
    }

    /// Whether a suspect waits.
    pub fn has_suspects(&self) -> bool {
        !self.suspects.is_empty()
    }

    /// Takes the first suspect.
    pub fn pop_suspect(&mut self) -> Option<Item> {
        self.suspects.pop_front(usize::MAX)
    }

    /// Whether anything waits.
    pub fn has_waiting(&self) -> bool {
        !self.queue.is_empty() || !self.suspects.is_empty() || !self.audits.is_empty()
    }

    /// An item has been given to a worker.
    pub fn add_holder(
        &mut self,
        assignment_id: AssignmentId,
        worker: WorkerId,
        item: &Item,
        is_audit: bool,
    ) {
        self.audits.n_in_flight += usize::from(is_audit);
        let holder = Holder { assignment_id, worker, trials: item.trials.clone(), is_audit };
        self.holders.entry(item.individual).or_default().push(holder);
    }

    /// A worker does not compute an item any more.
    pub fn remove_holder(&mut self, assignment_id: AssignmentId, individual: u32) {
        let Some(holders) = self.holders.get_mut(&individual) else { return };
        let Some(index) = holders.iter().position(|holder| holder.assignment_id == assignment_id)
        else {
            return;
        };
        let holder = holders.remove(index);
        if holders.is_empty() {
            self.holders.remove(&individual);
        }
        self.audits.n_in_flight -= usize::from(holder.is_audit);
    }

    /// The workers that compute parts of an individual, apart from audits.
    pub fn holders(&self, individual: u32) -> impl Iterator<Item = (WorkerId, AssignmentId)> {
        let holders = self.holders.get(&individual).into_iter().flatten();
        holders
            .filter(|holder| !holder.is_audit)
            .map(|holder| (holder.worker, holder.assignment_id))
    }

    /// Queues an audit of what workers have computed of an item, in parts that are each
    /// one worker's.
    pub fn push_audit(&mut self, item: &Item) {
        for part in self.known.by_worker(item) {
            if let Some(name) = self.known.name(part.individual, part.trials.start) {
                self.audits.push(name, part);
            }
        }
    }

    /// The parts of an item without a result.
    pub fn unknown(&self, item: &Item) -> Vec<Item> {
        item.parts(|trial| !self.known.has(item.individual, trial))
    }

    /// The name of the worker whose values for an item are known.
    pub fn computed_by(&self, item: &Item) -> Option<&str> {
        self.known.name(item.individual, item.trials.start).map(|name| &**name)
    }

    /// An audit by a worker has agreed.
    pub fn count_audited(&mut self, item: &Item, auditor: Arc<str>) {
        self.audits.count(auditor, self.known.name(item.individual, item.trials.start));
    }

    /// The names of those who contributed, and whether an audit has agreed with them.
    pub fn contributors(&self) -> impl Iterator<Item = (Arc<str>, bool)> {
        let names = self.known.names();
        names.map(|name| (Arc::clone(name), self.audits.has_confirmed(name)))
    }

    /// Assignments of an individual, apart from audits, whose results are all known.
    pub fn redundant(&self, individual: u32) -> Vec<(WorkerId, AssignmentId)> {
        let holders = self.holders.get(&individual).into_iter().flatten();
        holders
            .filter(|holder| !holder.is_audit)
            .filter(|holder| holder.trials.clone().all(|trial| self.known.has(individual, trial)))
            .map(|holder| (holder.worker, holder.assignment_id))
            .collect()
    }

    /// Individuals with trials that a worker was computing when it was lost, and that have
    /// no result since.
    pub fn n_individuals_failing(&self) -> usize {
        self.losses.n_individuals(|individual, trial| !self.known.has(individual, trial))
    }

    /// Time since it began.
    pub fn running_for(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.started)
    }

    /// What it is called in messages.
    pub fn name(&self) -> String {
        name_of(self.batch.trial_set)
    }

    /// Whether all fitness is known and undisputed, and no audit is under way, or waits for
    /// a worker that is there.
    pub fn is_finished(&self, is_there: impl Fn(&Self) -> bool) -> bool {
        self.is_known_throughout()
            && self.n_disagreements == 0
            && self.audits.n_in_flight == 0
            && (self.audits.is_empty() || !is_there(self))
    }

    /// Whether all fitness is known.
    pub fn is_known_throughout(&self) -> bool {
        self.known.n_episodes_left() == 0
    }

    /// If no individual of a generation has a finite fitness: the next that the referee
    /// evaluates for that reason. Call when all fitness is known.
    pub fn without_fitness(&self) -> Option<Item> {
        let is_generation = matches!(self.batch.trial_set, TrialSet::Generation(_));
        let n_individuals = self.batch.genotypes.len() as u32;
        let individual = self.n_without_fitness;
        let is_open = is_generation
            && self.batch.output == Output::Fitness
            && individual < n_individuals.min(WITHOUT_FITNESS_MIN)
            && !evolution::has_finite_fitness(self.known.values());
        is_open.then_some(Item { individual, trials: 0..self.batch.n_trials })
    }

    /// The outcome.
    pub fn into_evaluated(
        self,
        now: Instant,
        n_workers: usize,
        fleet_time: &FleetTime,
        notices: Vec<String>,
    ) -> EvaluatedBatch {
        EvaluatedBatch {
            trial_set: self.batch.trial_set,
            n_unaudited: self.audits.n_waiting(),
            n_audited: self.audits.n_agreed(),
            values: self.known.into_values(),
            duration: now.saturating_duration_since(self.started),
            n_workers,
            idle_share: fleet_time.idle_share_since(&self.fleet_time_at_start),
            notices,
        }
    }

    /// Panics if the state contradicts itself; `in_flight`: what workers hold of
    /// it, in any order.
    pub fn sanity_check(&self, in_flight: &BTreeMap<AssignmentId, (WorkerId, Item, bool)>) {
        let n_queued: usize = self.queue.iter().map(|item| item.trials.len()).sum();
        assert_eq!(n_queued, self.queue.n_trials());
        self.known.sanity_check();
        let mut n_holders = 0;
        for (&individual, holders) in &self.holders {
            assert!(!holders.is_empty());
            for Holder { assignment_id, worker, trials, is_audit } in holders {
                n_holders += 1;
                let item = Item { individual, trials: trials.clone() };
                assert_eq!(in_flight[assignment_id], (*worker, item, *is_audit));
            }
        }
        assert_eq!(n_holders, in_flight.len(), "every holder is known");
        let n_audits = in_flight.values().filter(|(.., is_audit)| *is_audit).count();
        assert_eq!(n_audits, self.audits.n_in_flight);
        for ((_, assignment_id), worker) in &self.uncovered {
            assert_eq!(in_flight[assignment_id].0, *worker);
        }
        // Every trial has a result, is queued or is being computed, possibly by several, or
        // held back; and it is queued only if it is nothing else.
        let n_trials = self.batch.n_trials as usize;
        let mut claims = vec![0_u32; self.known.n_episodes()];
        for item in self.queue.iter().chain(self.suspects.iter()) {
            for trial in item.trials.clone() {
                claims[item.individual as usize * n_trials + trial as usize] += 1;
            }
        }
        for (index, n_queued) in claims.into_iter().enumerate() {
            let (individual, trial) = ((index / n_trials) as u32, (index % n_trials) as u32);
            let n_copies = self.n_copies(individual, trial);
            let is_known = self.known.has(individual, trial);
            let is_held_back = self.is_held_back(individual, trial);
            let is_waited_for = !is_known && (n_copies > 0 || is_held_back);
            let n_states = u32::from(is_known) + n_queued + u32::from(is_waited_for);
            assert_eq!(n_states, 1, "individual {individual}, trial {trial}");
        }
    }
}

/// What the batch of a trial set is called in messages.
pub fn name_of(trial_set: TrialSet) -> String {
    match trial_set {
        TrialSet::Generation(generation) => format!("generation {generation}"),
        TrialSet::HeldOut { generation, .. } => {
            format!("the re-evaluation after generation {generation}")
        }
        TrialSet::Judgement(generation) => {
            format!("the judgement after generation {generation}")
        }
        TrialSet::Evaluation => "the evaluation".into(),
    }
}
