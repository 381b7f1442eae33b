//! A connected worker, as the engine sees it.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use sim_core::TrialSet;

use model::{
    ids::{AssignmentId, JobId, WorkerId},
    limits::ITEMS_PER_SLOT_MAX,
};

use super::{
    Instant, Introduction, WorkerStatus,
    availability::{Availability, Obstacles},
    fleet_time::WorkerTime,
    in_flight::{AssignedItem, InFlight, ItemKind},
    job::JobWork,
};

/// Work ahead per worker, so that it computes while results and new items travel: longer than a
/// round trip and the coordinator's own delays.
const WORK_AHEAD: Duration = Duration::from_millis(50);
/// The [`Worker::load`] of a worker with as many items as slots.
pub const FULL_LOAD: u64 = 1 << 20;

/// The [`Worker::usable_speed`] of a slot of pace 1.
pub const SPEED_UNIT: u64 = 1 << 10;

/// A connected worker.
#[derive(Debug)]
pub struct Worker {
    /// Its introduction.
    pub introduction: Introduction,
    /// Time of its last message.
    pub last_heard: Instant,
    /// The reasons why it gets no items.
    pub obstacles: Obstacles,
    /// Time of its last result.
    pub last_result: Option<Instant>,
    /// Jobs whose specification it has, each with the trial set of its latest distribution, if any.
    pub known_jobs: BTreeMap<JobId, Option<TrialSet>>,
    /// Its assignments without a result, oldest first because ids grow.
    pub in_flight: InFlight,
    /// Its items in progress when it stalled. Other workers have duplicates, but its results are
    /// still welcome.
    pub written_off: BTreeMap<AssignmentId, AssignedItem>,
    /// Assignments taken back from it lately, whose results may be on their way.
    pub recalled: VecDeque<(AssignmentId, AssignedItem)>,
    /// Its computing time.
    pub time: WorkerTime,
    /// Time per item, s; smoothed.
    item_s: Option<f64>,
    /// Its time for an item, relative to the mean of all workers, > 0; smoothed.
    pub pace: f64,
    n_learnt: u32,
}

impl Worker {
    /// A worker without work.
    pub fn new(introduction: Introduction, now: Instant) -> Self {
        Self {
            time: WorkerTime::new(now, introduction.n_slots),
            introduction,
            last_heard: now,
            obstacles: Obstacles::default(),
            last_result: None,
            known_jobs: BTreeMap::new(),
            in_flight: InFlight::default(),
            written_off: BTreeMap::new(),
            recalled: VecDeque::new(),
            item_s: None,
            pace: 1.0,
            n_learnt: 0,
        }
    }

    /// Its name, shared with records that outlive the connection.
    pub fn name(&self) -> &Arc<str> {
        &self.introduction.name
    }

    /// Number of items that it computes at the same time.
    pub fn n_slots(&self) -> usize {
        self.introduction.n_slots
    }

    /// Whether it gets items.
    pub fn availability(&self) -> Availability<'_> {
        self.obstacles.availability()
    }

    /// Why it gets nothing for a while, for people.
    pub fn why_it_waits(&self, now: Instant) -> Option<String> {
        self.availability().why_it_waits(self.last_result.unwrap_or(self.time.joined()), now)
    }

    /// Whether it takes items of this job.
    pub fn takes(&self, job: &JobWork) -> bool {
        self.introduction.experiments.matches(&job.name)
    }

    /// Whether it has a suspect.
    pub fn has_suspect(&self) -> bool {
        self.in_flight.values().any(|assigned| assigned.kind == ItemKind::Suspect)
    }

    /// Most items it may hold: one per slot, and as many more as it computes in
    /// [`WORK_AHEAD`], so that few items wait behind long ones, and slots do not
    /// wait for short ones. At first, two per slot; one in all after a loss.
    pub fn n_credits(&self) -> usize {
        if self.availability() == Availability::OnProbation {
            return 1;
        }
        let n_slots = self.n_slots();
        let n_ahead = match self.item_s {
            Some(item_s) => (n_slots as f64 * WORK_AHEAD.as_secs_f64() / item_s).ceil() as usize,
            None => n_slots,
        };
        n_slots + n_ahead.clamp(1, (ITEMS_PER_SLOT_MAX - 1) * n_slots)
    }

    /// Whether it may be given another item.
    pub fn has_credit(&self) -> bool {
        self.availability().is_usable() && self.n_items() < self.n_credits()
    }

    /// Number of items in progress or waiting at the worker.
    fn n_items(&self) -> usize {
        self.in_flight.len() + self.written_off.len()
    }

    /// Number of items in flight that wait for a slot.
    pub fn n_waiting(&self) -> usize {
        self.n_items().saturating_sub(self.n_slots()).min(self.in_flight.len())
    }

    /// Items per slot, in units of 1 / [`FULL_LOAD`].
    pub fn load(&self) -> u64 {
        (self.n_items() as u64 * FULL_LOAD) / self.n_slots() as u64
    }

    /// Sort key: when it would finish one more item. Workers with idle slots come first, the
    /// others follow by their items and pace, from [`FULL_LOAD`] on.
    pub fn finish_rank(&self) -> u64 {
        let load = self.load();
        if load < FULL_LOAD {
            return load;
        }
        let load_then = (self.n_items() + 1) as f64 / self.n_slots() as f64;
        FULL_LOAD + (load_then * self.pace * FULL_LOAD as f64) as u64
    }

    /// Its pace as a whole number, for sorting.
    pub fn pace_rank(&self) -> u32 {
        (self.pace * 64.0) as u32
    }

    /// Number of slots that may get an item.
    pub fn n_usable_slots(&self) -> usize {
        match self.availability() {
            Availability::Free => self.n_slots(),
            Availability::OnProbation => 1,
            _ => 0,
        }
    }

    /// Speed of its usable slots, in units of 1 / [`SPEED_UNIT`]. An integer, so that the sum
    /// over workers that come and go stays exact.
    pub fn usable_speed(&self) -> u64 {
        (self.n_usable_slots() as f64 / self.pace * SPEED_UNIT as f64) as u64
    }

    /// Number of usable slots without an item.
    pub fn n_idle_slots(&self) -> usize {
        self.n_usable_slots().saturating_sub(self.n_items())
    }

    /// Learns from an item that took `busy` and was expected to take `expected`
    /// for a worker of pace 1.
    pub fn learn(&mut self, busy: Duration, expected: Option<Duration>) {
        let busy_s = busy.as_secs_f64();
        let item_s = self.item_s.get_or_insert(busy_s);
        *item_s = (*item_s + 0.1 * (busy_s - *item_s)).max(1e-6);
        if let Some(expected) = expected {
            let ratio = busy_s / expected.as_secs_f64().max(1e-9);
            // The mean of the first few results, then a moving mean.
            self.n_learnt += 1;
            let gain = (1.0 / f64::from(self.n_learnt)).max(0.1);
            self.pace = (self.pace + gain * (ratio - self.pace)).clamp(1e-2, 1e2);
        }
    }

    /// Keeps a recalled assignment, whose result may still arrive.
    pub fn remember_recalled(&mut self, assignment_id: AssignmentId, assignment: AssignedItem) {
        if self.recalled.len() >= 2 * self.n_slots() {
            self.recalled.pop_front();
        }
        self.recalled.push_back((assignment_id, assignment));
    }

    /// The recalled assignment of this id, if it is still kept.
    pub fn take_recalled(&mut self, assignment_id: AssignmentId) -> Option<AssignedItem> {
        let index = self.recalled.iter().position(|(id, _)| *id == assignment_id)?;
        self.recalled.remove(index).map(|(_, assignment)| assignment)
    }

    /// Its status, for people.
    pub fn status(&self, id: WorkerId, now: Instant) -> WorkerStatus {
        let Introduction { name, version, n_slots, experiments, .. } = self.introduction.clone();
        let (results_per_s, idle_share) = self.time.recent(now);
        WorkerStatus {
            id,
            name: name.to_string(),
            version,
            n_slots,
            experiments,
            n_in_flight: self.in_flight.len(),
            results_per_s,
            idle_share,
            connected_for: now.saturating_duration_since(self.time.joined()),
            silent_for: now.saturating_duration_since(self.last_heard),
            is_draining: self.obstacles.is_draining,
            quarantined: self.obstacles.quarantined.clone(),
            waits: self.why_it_waits(now),
        }
    }
}
