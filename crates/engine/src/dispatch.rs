//! Assigns queued items to workers.
//!
//! First, queued items: the worker that would finish it first gets the next item of the job with
//! the least virtual time. The engine splits an item by trial if slots would stay empty otherwise,
//! and towards the end of a batch.
//!
//! Then, while slots are idle, the engine moves items to them from workers with more items than
//! slots. It also gives idle slots duplicates of items in progress, if these should finish sooner
//! or an item is late, repeatedly if necessary. The first result wins.

use std::{collections::BTreeMap, time::Duration};

use model::ids::{AssignmentId, JobId, WorkerId};

use super::{
    Assignment, Engine, Instant,
    batch::BatchInProgress,
    in_flight::{AssignedItem, ItemKind},
    item::Item,
    job::{CALL_OVERHEAD, JobWork, remaining},
    timeline::Fate,
    worker::{FULL_LOAD, Worker},
};

/// Time lost by moving an item: a round trip, and the coordinator's own delays.
const MOVING_COST: Duration = Duration::from_millis(20);
/// Number of trials of its share of a batch that a slot loses to others. Half a trial is lost
/// because shares are rounded down, the rest because a remainder is a call of its own. This value
/// is the best of those from 0 to 1.3 in `cargo bench -p engine --bench scaling`.
const LOST_PER_SLOT: f64 = 0.7;
/// Number of workers to try if the first is not suitable.
const N_LOOKED_AT: usize = 8;
/// Time after which an item is late if no similar item has been computed yet.
const UNKNOWN_LATE: Duration = Duration::from_secs(5);
/// Number of duplicates for each late assignment of such an item. They may hang, too, so their
/// number has to grow.
const UNKNOWN_DUPLICATES: usize = 2;

impl Engine {
    /// Gives every slot work, as far as there is any.
    pub(super) fn assign(&mut self, now: Instant) {
        self.hand_out_queued(now);
        while self.has_idle_slot() {
            if self.config.duplicate && self.move_waiting(now) {
                self.hand_out_queued(now);
            } else if !(self.config.duplicate && self.duplicate(now)) {
                break;
            }
        }
        self.send();
    }

    pub(super) fn has_idle_slot(&self) -> bool {
        self.load_index.available.first().is_some_and(|&(rank, ..)| rank < FULL_LOAD)
    }

    fn hand_out_queued(&mut self, now: Instant) {
        while let Some((job, worker, kind)) = self.next_item() {
            let Some(item) = self.take(job, worker, kind) else { return };
            let Some(work) = self.jobs.get_mut(&job) else { return };
            let charge = work.charge(item.trials.len(), self.workers[&worker].pace);
            self.ready_queue.charge(job, work, charge);
            self.give(now, worker, job, item, kind, charge);
        }
    }

    /// The next item: its job, the worker that gets it, and its kind. While a job's next item
    /// waits for a free slot, later jobs get only idle slots, all of them at workers that do not
    /// take the first job. If later jobs got items ahead, no slot would become free.
    fn next_item(&self) -> Option<(JobId, WorkerId, ItemKind)> {
        if self.load_index.available.is_empty() {
            return None;
        }
        let mut is_awaited = false;
        for id in self.ready_queue.iter() {
            let work = &self.jobs[&id];
            let Some(batch) = &work.batch else { continue };
            let Some((rank, first)) = self.takers(work).next() else { continue };
            if let Some((worker, kind)) = self.next_check(work, batch) {
                return Some((id, worker, kind));
            }
            if !batch.queue.is_empty() {
                if rank < FULL_LOAD || (!is_awaited && self.hands_out_ahead(id)) {
                    return Some((id, first, ItemKind::Ordinary));
                }
                if !self.has_idle_slot() {
                    return None;
                }
                is_awaited = true;
            }
        }
        None
    }

    /// Takes the next item for a worker out of a queue.
    fn take(&mut self, job: JobId, worker: WorkerId, kind: ItemKind) -> Option<Item> {
        match kind {
            ItemKind::Audit => self.take_audit(job, worker),
            ItemKind::Suspect => self.batch_mut(job)?.suspects.pop_front(usize::MAX),
            ItemKind::Ordinary => {
                let n_trials = self.n_trials_to_give(job, &self.workers[&worker]);
                let is_short = self.is_short(job);
                let batch = self.batch_mut(job)?;
                if is_short {
                    batch.pop_whole_first(n_trials)
                } else {
                    batch.queue.pop_front(n_trials)
                }
            }
        }
    }

    /// The workers with credit that accept a job's items, each with its rank. The worker that would
    /// finish an item first is the first.
    pub(super) fn takers(&self, work: &JobWork) -> impl Iterator<Item = (u64, WorkerId)> {
        let available = self.load_index.available.iter().map(|&(rank, _, id)| (rank, id));
        available.filter(|(_, id)| self.workers[id].takes(work))
    }

    /// Number of slots for a job's items: jobs with queued items divide the slots about equally.
    fn n_slots_each(&self, n_slots: usize) -> usize {
        n_slots / self.ready_queue.len().max(1)
    }

    /// Whether workers with full slots get a job's items, too. Near the end of a batch they do not,
    /// because the first free worker should get the remaining items; unless items take no longer
    /// than a round trip.
    fn hands_out_ahead(&self, id: JobId) -> bool {
        let Some(batch) = self.batch(id) else { return false };
        let n_slots = self.n_slots_each(self.load_index.n_usable_slots);
        let n_last = batch.request.n_trials as usize * n_slots;
        !self.config.split || batch.queue.n_trials() > n_last || self.is_short(id)
    }

    /// Whether a job's trials take no longer than a round trip; true if their duration is
    /// unknown.
    fn is_short(&self, id: JobId) -> bool {
        self.jobs[&id].expected(1, 1.0).is_none_or(|trial| trial < MOVING_COST)
    }

    /// Number of trials of the next item that a worker gets, at most: all of them, unless slots
    /// would stay empty, or the worker's share of the rest of the batch is smaller than an item.
    fn n_trials_to_give(&self, id: JobId, worker: &Worker) -> usize {
        let Some(batch) = self.batch(id).filter(|_| self.config.split) else { return usize::MAX };
        let n_trials = batch.request.n_trials as usize;
        let n_idle_slots = self.n_slots_each(self.load_index.n_idle_slots);
        let n_parts = (n_idle_slots / batch.queue.len().max(1)).max(1);
        let share = if self.is_short(id) {
            self.share_of_batch(batch, worker).floor()
        } else {
            let n_slots = self.n_slots_each(self.load_index.n_usable_slots).max(1);
            (batch.queue.n_trials() as f64 / (n_slots as f64 * worker.pace)).ceil()
        };
        n_trials.div_ceil(n_parts).min(share as usize).max(1)
    }

    /// A worker's further share of the remaining trials of a batch, in a schedule that assigns all
    /// of them now and has all workers finish together. The engine assigns short trials in such
    /// shares, because a worker that runs out of trials waits for new ones as long as a trial
    /// takes.
    fn share_of_batch(&self, batch: &BatchInProgress, worker: &Worker) -> f64 {
        let n_slots = self.load_index.n_usable_slots as f64;
        let n_left = self.ready_queue.len().max(1) as f64 * batch.known.n_episodes_left() as f64;
        let n_calls = (n_left / f64::from(batch.request.n_trials)).max(n_slots);
        let work = n_left + CALL_OVERHEAD * n_calls + LOST_PER_SLOT * n_slots;
        let share = worker.usable_speed() as f64 / self.load_index.usable_speed.max(1) as f64;
        let in_flight = &worker.in_flight;
        work * share - in_flight.n_trials() as f64 - CALL_OVERHEAD * (in_flight.len() + 1) as f64
    }

    /// Takes back the last item that waits at a worker behind others, and queues it. Returns
    /// whether moving an item was worthwhile.
    fn move_waiting(&mut self, now: Instant) -> bool {
        let candidate =
            self.load_index.backlogged.iter().rev().take(N_LOOKED_AT).find_map(|&(_, holder)| {
                let worker = &self.workers[&holder];
                let mut waiting = worker.in_flight.iter().rev().take(worker.n_waiting());
                let (&assignment_id, _) = waiting.find(|(_, a)| {
                    !a.is_audit()
                        && a.expected > now + MOVING_COST
                        && self.idle_taker(&self.jobs[&a.job], |_| true).is_some()
                })?;
                Some((holder, assignment_id))
            });
        let Some((holder, assignment_id)) = candidate else { return false };
        let Some(assignment) = self.recall(now, holder, assignment_id) else { return false };
        self.requeue(assignment.job, &assignment.item);
        true
    }

    /// Gives idle slots duplicates of items in progress. Returns whether a duplicate was
    /// worthwhile.
    fn duplicate(&mut self, now: Instant) -> bool {
        let candidate = self.jobs.iter().find_map(|(&id, work)| {
            let idle = self.idle_taker(work, |_| true)?;
            let pace = self.workers[&idle].pace;
            let duplicate = work.slowest(now, self.load_index.n_idle_slots, pace, &self.workers)?;
            Some((id, duplicate))
        });
        let Some((job, Slow { key, item, n_parts, n_duplicates })) = candidate else {
            return false;
        };
        let other = |engine: &Self, item: &Item| {
            let batch = engine.batch(job)?;
            engine.idle_taker(&engine.jobs[&job], |id| !batch.is_holder(id, item))
        };
        if other(self, &item).is_none() {
            return false;
        }
        if let Some(batch) = self.batch_mut(job) {
            batch.not_duplicated.remove(&key);
        }
        let n_per_part = item.trials.len().div_ceil(n_parts) as u32;
        for _ in 0..n_duplicates {
            let mut start = item.trials.start;
            while start < item.trials.end {
                let trials = start..(start + n_per_part).min(item.trials.end);
                let part = Item { individual: item.individual, trials };
                let Some(worker) = other(self, &part) else { break };
                start = part.trials.end;
                self.give(now, worker, job, part, ItemKind::Ordinary, Duration::ZERO);
            }
        }
        true
    }

    /// The least loaded suitable worker with an idle slot that accepts a job's items.
    pub(super) fn idle_taker(
        &self,
        work: &JobWork,
        is_suitable: impl Fn(WorkerId) -> bool,
    ) -> Option<WorkerId> {
        let idle = self.takers(work).take_while(|&(rank, _)| rank < FULL_LOAD);
        idle.map(|(_, id)| id).find(|&id| is_suitable(id))
    }

    /// Assigns an item to a worker.
    fn give(
        &mut self,
        now: Instant,
        worker_id: WorkerId,
        job: JobId,
        item: Item,
        kind: ItemKind,
        charge: Duration,
    ) {
        let Some(work) = self.jobs.get_mut(&job) else { return };
        let worker = &self.workers[&worker_id];
        let expected = work.expected(item.trials.len(), worker.pace).unwrap_or_default();
        // Earlier assignments of the worker come first.
        let n_before = (worker.load() / FULL_LOAD) as u32;
        let expected = now + expected * (n_before + 1);
        let Some(batch) = &mut work.batch else { return };
        self.counters.n_items_assigned += 1;
        let id = AssignmentId(self.counters.n_items_assigned);
        if kind == ItemKind::Audit {
            batch.audits.in_flight.insert(id);
        } else {
            batch.add_holder(id, worker_id, item.clone());
        }
        // A duplicate of a suspect might take another worker down.
        if kind == ItemKind::Ordinary {
            batch.not_duplicated.insert((expected, id), worker_id);
        }
        let request = &batch.request;
        let trial_set = request.trial_set;
        let assignment = Assignment {
            id,
            trials: item.trials.clone(),
            genotype: batch.genotype(item.individual),
            // Audits get genotypes instead of a distribution, so that they also compare the two
            // ways.
            is_drawn: kind != ItemKind::Audit && request.distribution.is_some(),
        };
        self.outgoing.assign(worker_id, job, request, assignment);
        let assigned = AssignedItem { job, trial_set, item, kind, assigned: now, expected, charge };
        self.update_worker(worker_id, |worker| worker.in_flight.insert(id, assigned));
    }

    /// Ends an assignment and returns the worker's credit; `None` if the worker does not have the
    /// assignment.
    pub(super) fn take_assignment(
        &mut self,
        worker: WorkerId,
        assignment_id: AssignmentId,
    ) -> Option<AssignedItem> {
        let assignment =
            self.update_worker(worker, |worker| worker.in_flight.remove(assignment_id))??;
        self.forget_holder(assignment_id, &assignment);
        Some(assignment)
    }

    /// Records that a worker no longer computes an assignment.
    pub(super) fn forget_holder(&mut self, assignment_id: AssignmentId, assignment: &AssignedItem) {
        let Some(batch) = self.batch_mut(assignment.job) else { return };
        batch.audits.in_flight.remove(&assignment_id);
        batch.remove_holder(assignment_id, assignment.item.individual);
        batch.not_duplicated.remove(&(assignment.expected, assignment_id));
    }

    /// Takes an assignment back, by telling its worker to drop it. `None` if the worker does not
    /// have it.
    pub(super) fn recall(
        &mut self,
        now: Instant,
        id: WorkerId,
        assignment_id: AssignmentId,
    ) -> Option<AssignedItem> {
        let assignment = self.take_assignment(id, assignment_id)?;
        self.counters.n_items_recalled += 1;
        self.correct_charge(assignment.job, assignment.charge, Duration::ZERO);
        self.outgoing.recall(id, assignment_id);
        let worker = self.workers.get_mut(&id)?;
        let ended = assignment.clone();
        self.timeline.add(now, (id, worker), ended, Fate::TakenBack, Duration::ZERO);
        worker.remember_recalled(assignment_id, assignment.clone());
        Some(assignment)
    }
}

/// An assignment worth computing a second time.
struct Slow {
    key: (Instant, AssignmentId),
    item: Item,
    /// Number of parts, each for another worker.
    n_parts: usize,
    /// Number of duplicates of each part.
    n_duplicates: usize,
}

impl JobWork {
    /// The assignment without a duplicate that should end last, or else the one that should have
    /// ended first, if idle slots should finish it sooner. Jobs with queued items need no
    /// duplicates.
    fn slowest(
        &self,
        now: Instant,
        n_idle_slots: usize,
        pace: f64,
        workers: &BTreeMap<WorkerId, Worker>,
    ) -> Option<Slow> {
        let batch = self.batch.as_ref().filter(|batch| batch.queue.is_empty())?;
        let ends = [batch.not_duplicated.last_key_value(), batch.not_duplicated.first_key_value()];
        ends.into_iter().flatten().find_map(|(&key, holder)| {
            let (expected, assignment_id) = key;
            let running = &workers[holder].in_flight[&assignment_id].item;
            let item = batch.duplicable(running)?;
            let n_trials = item.trials.len();
            let n_parts = (n_idle_slots / batch.not_duplicated.len()).clamp(1, n_trials);
            let (needed, n_duplicates) = match self.expected(n_trials.div_ceil(n_parts), pace) {
                // Adds half of the time, because a worker may first finish an item that it was told
                // to drop.
                Some(needed) => (needed.mul_f64(1.5) + MOVING_COST, 1),
                // The limit grows with the age of the batch.
                None => (UNKNOWN_LATE.max(batch.running_for(now) / 2), UNKNOWN_DUPLICATES),
            };
            let is_worth_it = needed < remaining(expected, now);
            is_worth_it.then_some(Slow { key, item, n_parts, n_duplicates })
        })
    }
}
