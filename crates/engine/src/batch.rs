//! A batch in progress: its results, the workers that compute the rest, and the queues.

use std::{collections::BTreeMap, mem, sync::Arc, time::Duration};

use model::ids::{AssignmentId, WorkerId};
use sim_core::{Output, TrialSet};

use super::{
    Batch, EvaluatedBatch, Instant,
    fleet_time::FleetTime,
    item::{Item, ItemState},
    known_results::KnownResults,
    queue::Queue,
    trust::{audits::Audits, losses::LossRecord},
};
use crate::shared_genotype::SharedGenotype;

/// Most numbers per item of measures: half a MiB, because messages have a limited size.
const VALUES_PER_ITEM_MAX: usize = 1 << 16;

/// Number of individuals that the referee evaluates before a generation counts as one without
/// finite fitness. A single individual proves little, because some genotypes may have no finite
/// fitness although most have one.
const REFEREED_MIN: u32 = 8;

/// Trials per item, at most: all of them, unless their numbers exceed [`VALUES_PER_ITEM_MAX`].
fn max_trials_per_item(batch: &Batch) -> u32 {
    let n_trials = match batch.output {
        Output::Fitness | Output::Descriptors => batch.n_trials,
        Output::Measures => {
            u32::try_from(VALUES_PER_ITEM_MAX / batch.values_per_trial.max(1)).unwrap_or(u32::MAX)
        }
    };
    n_trials.max(1)
}

/// A worker that computes an item; audits do not count.
#[derive(Debug, Clone)]
struct Holder {
    assignment_id: AssignmentId,
    worker: WorkerId,
    item: Item,
}

/// Until when no worker gets an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Until {
    Time(Instant),
    Answer,
}

/// A batch that is being computed.
#[derive(Debug)]
pub struct BatchInProgress {
    /// The genotypes and trials of the batch.
    pub request: Batch,
    /// The [queued](ItemState::Queued) items, in the order of assignment.
    pub queue: Queue,
    /// Queued items that were in progress when workers were lost.
    pub suspects: Queue,
    /// The [assigned](ItemState::Assigned) items and their duplicates, by individual.
    holders: BTreeMap<u32, Vec<Holder>>,
    /// The [delayed](ItemState::Delayed) and [referred](ItemState::Referred) items; an item is here
    /// twice if two duplicates of it were lost.
    withheld: Vec<(Item, Until)>,
    /// The results of the trials that are [done](ItemState::Done).
    pub known: KnownResults,
    /// Assignments without a duplicate, sorted by the time at which they should be done.
    pub not_duplicated: BTreeMap<(Instant, AssignmentId), WorkerId>,
    /// Done items that a second worker has to confirm.
    pub audits: Audits,
    /// Items that were in progress when workers were lost.
    pub losses: LossRecord,
    /// Disagreements that the referee has not settled.
    pub n_disagreements: usize,
    /// Number of individuals that the referee has evaluated because none has a finite fitness.
    pub n_refereed: u32,
    started: Instant,
    fleet_time_at_start: FleetTime,
}

/// All items of a batch.
fn items(batch: &Batch) -> impl Iterator<Item = Item> + use<> {
    let (n_trials, n_per_item) = (batch.n_trials, max_trials_per_item(batch));
    (0..batch.genotypes.len() as u32).flat_map(move |individual| {
        (0..n_trials).step_by(n_per_item as usize).map(move |first| {
            let last = n_trials.min(first.saturating_add(n_per_item));
            Item { individual, trials: first..last }
        })
    })
}

impl BatchInProgress {
    /// A batch without results.
    pub fn new(request: Batch, now: Instant, fleet_time: FleetTime) -> Self {
        let n_individuals = request.genotypes.len();
        Self {
            queue: items(&request).collect(),
            suspects: Queue::default(),
            holders: BTreeMap::new(),
            withheld: Vec::new(),
            known: KnownResults::new(n_individuals, request.n_trials, request.values_per_trial),
            not_duplicated: BTreeMap::new(),
            audits: Audits::default(),
            losses: LossRecord::default(),
            n_disagreements: 0,
            n_refereed: 0,
            request,
            started: now,
            fleet_time_at_start: fleet_time,
        }
    }

    /// The state of a trial of an individual.
    pub fn state(&self, individual: u32, trial: u32) -> ItemState {
        if self.known.has(individual, trial) {
            return ItemState::Done;
        }
        let withheld = self.withheld.iter().filter(|(item, _)| item.includes(individual, trial));
        let withheld = withheld.map(|(_, until)| match until {
            Until::Time(_) => ItemState::Delayed,
            Until::Answer => ItemState::Referred,
        });
        withheld.max().unwrap_or_else(|| {
            let is_assigned =
                self.holders_of(individual).any(|holder| holder.item.trials.contains(&trial));
            if is_assigned { ItemState::Assigned } else { ItemState::Queued }
        })
    }

    /// The parts of an item whose state satisfies a condition.
    pub fn parts(&self, item: &Item, is_in: impl Fn(ItemState) -> bool) -> Vec<Item> {
        item.parts(|trial| is_in(self.state(item.individual, trial)))
    }

    /// The first part of an item that a second worker may compute as well.
    pub fn duplicable(&self, item: &Item) -> Option<Item> {
        self.parts(item, |state| state <= ItemState::Assigned).into_iter().next()
    }

    /// Whether all results of an item are known.
    pub fn is_known(&self, item: &Item) -> bool {
        item.trials.clone().all(|trial| self.known.has(item.individual, trial))
    }

    /// The genotype of an individual.
    pub fn genotype(&self, individual: u32) -> SharedGenotype {
        SharedGenotype { population: Arc::clone(&self.request.genotypes), individual }
    }

    fn queue_of(&mut self, item: &Item) -> &mut Queue {
        if self.losses.is_suspect(item) { &mut self.suspects } else { &mut self.queue }
    }

    fn queue_behind(&mut self, item: &Item) {
        for part in self.parts(item, |state| state == ItemState::Queued) {
            self.queue_of(&part).push_back(part);
        }
    }

    /// Queues the parts of an item that belong in a queue, ahead of all other items.
    pub fn queue_first(&mut self, item: &Item) {
        for part in self.parts(item, |state| state == ItemState::Queued).into_iter().rev() {
            self.queue_of(&part).push_front(part);
        }
    }

    /// Queues all trials without a result, after all workers have been told to stop.
    pub fn requeue_all(&mut self) {
        self.holders.clear();
        self.audits.in_flight.clear();
        self.not_duplicated.clear();
        (self.queue, self.suspects) = Default::default();
        items(&self.request).for_each(|item| self.queue_behind(&item));
    }

    /// Removes the done and withheld parts of an individual from the queues.
    pub fn unqueue(&mut self, individual: u32) {
        let [mut queue, mut suspects] = [&mut self.queue, &mut self.suspects].map(mem::take);
        let rest = |item: Item| match item.individual == individual {
            true => self.parts(&item, |state| state == ItemState::Queued),
            false => vec![item],
        };
        queue.divide(rest);
        suspects.divide(rest);
        (self.queue, self.suspects) = (queue, suspects);
    }

    /// Forgets all values of a worker, and their audits, and queues the trials again.
    pub fn discard(&mut self, name: &str) {
        self.audits.discard(name);
        for item in self.known.discard(name) {
            self.queue_behind(&item);
        }
    }

    /// Withholds an item from all workers until the referee's answer, or [`Self::release`].
    pub fn refer(&mut self, item: Item) {
        let individual = item.individual;
        self.withheld.push((item, Until::Answer));
        self.unqueue(individual);
    }

    /// Takes back [`Self::refer`]; returns whether the item was referred.
    pub fn release(&mut self, item: &Item) -> bool {
        self.end_withholding(|withheld, until| withheld == item && until == Until::Answer).is_some()
    }

    /// Withholds an item from all workers until a time.
    pub fn delay(&mut self, item: Item, until: Instant) {
        self.withheld.push((item, Until::Time(until)));
    }

    /// Takes an item whose delay has passed, one per call. An item that waits twice, because two
    /// duplicates were lost, stays delayed until the second entry is taken, too.
    pub fn take_due(&mut self, now: Instant) -> Option<Item> {
        self.end_withholding(|_, until| matches!(until, Until::Time(time) if time < now))
    }

    fn end_withholding(&mut self, is_over: impl Fn(&Item, Until) -> bool) -> Option<Item> {
        let index = self.withheld.iter().position(|(item, until)| is_over(item, *until))?;
        Some(self.withheld.remove(index).0)
    }

    /// Takes at most `n_trials` trials, items with all trials first: [`Queue::pop_whole_first`].
    pub fn pop_whole_first(&mut self, n_trials: usize) -> Option<Item> {
        self.queue.pop_whole_first(n_trials, max_trials_per_item(&self.request) as usize)
    }

    /// Number of values of `n_trials` trials.
    pub fn n_values(&self, n_trials: usize) -> usize {
        n_trials * self.request.values_per_trial
    }

    /// Number of items that wait for a worker, including audits.
    pub fn n_waiting(&self) -> usize {
        self.queue.len() + self.suspects.len() + self.audits.n_waiting()
    }

    /// Whether any item waits for a worker.
    pub fn has_waiting(&self) -> bool {
        !self.queue.is_empty() || !self.suspects.is_empty() || !self.audits.is_empty()
    }

    /// Number of items that workers have.
    pub fn n_in_flight(&self) -> usize {
        self.holders.values().map(Vec::len).sum::<usize>() + self.audits.in_flight.len()
    }

    /// Records that a worker computes an item.
    pub fn add_holder(&mut self, assignment_id: AssignmentId, worker: WorkerId, item: Item) {
        let holder = Holder { assignment_id, worker, item };
        self.holders.entry(holder.item.individual).or_default().push(holder);
    }

    /// Records that a worker no longer computes an item.
    pub fn remove_holder(&mut self, assignment_id: AssignmentId, individual: u32) {
        let Some(holders) = self.holders.get_mut(&individual) else { return };
        holders.retain(|holder| holder.assignment_id != assignment_id);
        if holders.is_empty() {
            self.holders.remove(&individual);
        }
    }

    fn holders_of(&self, individual: u32) -> impl Iterator<Item = &Holder> {
        self.holders.get(&individual).into_iter().flatten()
    }

    /// The workers that compute parts of an individual.
    pub fn holders(&self, individual: u32) -> impl Iterator<Item = (WorkerId, AssignmentId)> {
        self.holders_of(individual).map(|holder| (holder.worker, holder.assignment_id))
    }

    /// Whether a worker computes a part of an item.
    pub fn is_holder(&self, worker: WorkerId, item: &Item) -> bool {
        let mut holders = self.holders_of(item.individual);
        holders.any(|holder| holder.worker == worker && holder.item.overlaps(item))
    }

    /// Assignments of an individual whose results are all known.
    pub fn redundant(&self, individual: u32) -> Vec<(WorkerId, AssignmentId)> {
        let redundant = self.holders_of(individual).filter(|holder| self.is_known(&holder.item));
        redundant.map(|holder| (holder.worker, holder.assignment_id)).collect()
    }

    /// Queues audits of the known results of an item, one for each part that a single worker
    /// computed.
    pub fn push_audit(&mut self, item: &Item) {
        for part in self.known.by_worker(item) {
            if let Some(name) = self.known.name(part.individual, part.trials.start) {
                self.audits.push(name, part);
            }
        }
    }

    /// The name of the worker whose values for an item are known.
    pub fn computed_by(&self, item: &Item) -> Option<&Arc<str>> {
        self.known.name(item.individual, item.trials.start)
    }

    /// Records that an audit by a worker has agreed.
    pub fn count_audited(&mut self, item: &Item, auditor: Arc<str>) {
        self.audits.on_agreed(auditor, self.known.name(item.individual, item.trials.start));
    }

    /// The names of the workers that contributed, and whether an audit has agreed with each.
    pub fn contributors(&self) -> impl Iterator<Item = (Arc<str>, bool)> {
        let names = self.known.names();
        names.map(|name| (Arc::clone(name), self.audits.has_confirmed(name)))
    }

    /// Number of individuals with trials that were in progress when a worker was lost, and that
    /// still have no result.
    pub fn n_individuals_failing(&self) -> usize {
        self.losses.n_individuals(|individual, trial| !self.known.has(individual, trial))
    }

    /// Time since it began.
    pub fn running_for(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.started)
    }

    /// The name of the batch in messages.
    pub fn name(&self) -> String {
        name_of(self.request.trial_set)
    }

    /// Whether all fitness is known and undisputed, no audit is in progress, and no audit waits
    /// for a connected worker.
    pub fn is_finished(&self, has_auditor: impl Fn(&Self) -> bool) -> bool {
        self.is_known_throughout()
            && self.n_disagreements == 0
            && self.audits.in_flight.is_empty()
            && (self.audits.is_empty() || !has_auditor(self))
    }

    /// Whether all fitness is known.
    pub fn is_known_throughout(&self) -> bool {
        self.known.n_episodes_left() == 0
    }

    /// The next individual for the referee, if no individual of a generation has a finite
    /// fitness. Call when all fitness is known.
    pub fn next_to_referee(&self) -> Option<Item> {
        let is_generation = matches!(self.request.trial_set, TrialSet::Generation(_));
        let n_individuals = self.request.genotypes.len() as u32;
        let individual = self.n_refereed;
        let is_open = is_generation
            && self.request.output != Output::Measures
            && individual < n_individuals.min(REFEREED_MIN)
            && !self.has_finite_fitness();
        is_open.then_some(Item { individual, trials: 0..self.request.n_trials })
    }

    /// Whether an individual has a finite mean fitness, which is the first number of each trial.
    fn has_finite_fitness(&self) -> bool {
        let values = self.known.values();
        match self.request.values_per_trial {
            1 => evolution::has_finite_fitness(values),
            n => values.iter().any(|values| {
                let fitness: Vec<f64> = values.iter().copied().step_by(n).collect();
                evolution::has_finite_fitness(&[fitness])
            }),
        }
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
            trial_set: self.request.trial_set,
            n_unaudited: self.audits.n_missing(),
            n_audited: self.audits.n_agreed(),
            values: self.known.into_values(),
            duration: now.saturating_duration_since(self.started),
            n_workers,
            idle_share: fleet_time.idle_share_since(&self.fleet_time_at_start),
            notices,
        }
    }

    /// Panics if the state contradicts itself; `in_flight`: the assignments of workers, and
    /// whether each is an audit.
    pub fn sanity_check(&self, in_flight: &BTreeMap<AssignmentId, (WorkerId, Item, bool)>) {
        self.known.sanity_check();
        let mut of_holders = BTreeMap::new();
        for (&individual, holders) in &self.holders {
            assert!(!holders.is_empty());
            for Holder { assignment_id, worker, item } in holders {
                assert_eq!(item.individual, individual);
                of_holders.insert(*assignment_id, (*worker, item.clone(), false));
            }
        }
        let (audits, others): (BTreeMap<_, _>, BTreeMap<_, _>) =
            in_flight.clone().into_iter().partition(|(_, (.., is_audit))| *is_audit);
        assert_eq!(of_holders, others);
        assert!(audits.keys().eq(&self.audits.in_flight));
        for ((_, assignment_id), worker) in &self.not_duplicated {
            assert_eq!(in_flight[assignment_id].0, *worker);
        }
        let n_queued: usize = self.queue.iter().map(|item| item.trials.len()).sum();
        assert_eq!(n_queued, self.queue.n_trials());
        // A queued trial is in exactly one queued item, any other trial in none.
        let n_trials = self.request.n_trials as usize;
        let mut n_queued = vec![0_u32; self.known.n_episodes()];
        for item in self.queue.iter().chain(self.suspects.iter()) {
            for trial in item.trials.clone() {
                n_queued[item.individual as usize * n_trials + trial as usize] += 1;
            }
        }
        for (index, n_queued) in n_queued.into_iter().enumerate() {
            let (individual, trial) = ((index / n_trials) as u32, (index % n_trials) as u32);
            let is_queued = self.state(individual, trial) == ItemState::Queued;
            assert_eq!(n_queued, u32::from(is_queued), "individual {individual}, trial {trial}");
        }
    }
}

/// The name of a trial set's batch in messages.
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

#[cfg(test)]
mod tests {
    use super::{ItemState::*, *};

    #[test]
    fn the_last_state_that_applies_to_a_trial_counts() {
        let now = Instant::after_origin(Duration::ZERO);
        let request = Batch::fitness(TrialSet::Generation(0), [vec![0.5]].into(), 2);
        let mut batch = BatchInProgress::new(request, now, FleetTime::new(now));
        let part = |trials| Item { individual: 0, trials };
        let states = |batch: &BatchInProgress| [0, 1].map(|trial| batch.state(0, trial));
        assert_eq!(states(&batch), [Queued; 2]);
        let whole = batch.queue.pop_front(2).unwrap();
        batch.add_holder(AssignmentId(1), WorkerId(1), whole.clone());
        assert_eq!(states(&batch), [Assigned; 2]);
        batch.delay(part(0..1), now);
        assert_eq!(states(&batch), [Delayed, Assigned]);
        batch.refer(whole.clone());
        assert_eq!(states(&batch), [Referred; 2]);
        batch.known.accept(WorkerId(1), "one", &part(1..2), &[1.0]);
        assert_eq!(states(&batch), [Referred, Done]);
        assert!(batch.release(&whole) && !batch.release(&whole));
        assert_eq!(states(&batch), [Delayed, Done]);
        assert_eq!(batch.take_due(now), None);
        assert_eq!(batch.take_due(now + Duration::from_secs(1)), Some(part(0..1)));
        assert_eq!(states(&batch), [Assigned, Done]);
        batch.remove_holder(AssignmentId(1), 0);
        assert_eq!(states(&batch), [Queued, Done]);
        batch.discard("one");
        assert_eq!(states(&batch), [Queued; 2]);
    }
}
