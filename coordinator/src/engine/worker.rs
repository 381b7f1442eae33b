//! A connected worker, as the engine sees it.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::{Duration, Instant},
};

use sim_core::TrialSet;
use swarm_proto::ITEMS_PER_SLOT_MAX;

use crate::ids::{AssignmentId, JobId, WorkerId};

use super::{
    Introduction, WorkerStatus,
    availability::{Availability, Obstacles},
    fleet_time::WorkerTime,
    in_flight::InFlight,
    item::Item,
    job::JobWork,
};

/// A worker is given so much work ahead, so that it computes while results and
/// new items travel: longer than a round trip and the coordinator's own delays.
const WORK_AHEAD: Duration = Duration::from_millis(50);
/// [`Worker::load`] of a worker with as many items as slots.
pub const FULL_LOAD: u64 = 1 << 20;

/// [`Worker::usable_speed`] of a slot of pace 1.
pub const SPEED_UNIT: u64 = 1 << 10;

/// A connected worker.
#[derive(Debug)]
pub struct Worker {
    /// Who it is.
    pub introduction: Introduction,
    /// What it calls itself, for those who remember it after it is gone.
    pub shared_name: Arc<str>,
    /// When it last gave a sign of life.
    pub last_heard: Instant,
    /// What keeps items from it.
    pub obstacles: Obstacles,
    /// When it last returned something.
    pub last_result: Option<Instant>,
    /// Jobs whose specification it has, each with the trial set of the batch whose
    /// distribution it has.
    pub known_jobs: BTreeMap<JobId, Option<TrialSet>>,
    /// What it has been given and has not answered; oldest first, as ids grow.
    pub in_flight: InFlight,
    /// What it was computing when it was found to be stalled. Others have been given it, but
    /// its results are still welcome.
    pub written_off: BTreeMap<AssignmentId, AssignedItem>,
    /// What was taken back from it lately, as the answer may be under way.
    pub recalled: VecDeque<(AssignmentId, AssignedItem)>,
    /// What it computed.
    pub time: WorkerTime,
    /// Time per item, s; smoothed.
    item_s: Option<f64>,
    /// How much longer than others it takes for the same work; smoothed.
    pub pace: f64,
    n_learnt: u32,
}

/// The queue of a batch that an item comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// What has to be computed.
    Queue,
    /// The same, but workers were lost with it: a worker has one such item at a time.
    Suspects,
    /// What is computed only to be compared.
    Audits,
}

/// An item that a worker has.
#[derive(Debug, Clone)]
pub struct AssignedItem {
    /// The job that it is of.
    pub job: JobId,
    /// The trial set of the batch that it is of.
    pub trial_set: TrialSet,
    /// The item.
    pub item: Item,
    /// The queue that it comes from.
    pub source: Source,
    /// When it was sent.
    pub assigned: Instant,
    /// When it should be done.
    pub expected: Instant,
    /// Time that the job was charged for it.
    pub charge: Duration,
}

impl AssignedItem {
    /// Whether it is computed only to be compared.
    pub fn is_audit(&self) -> bool {
        self.source == Source::Audits
    }
}

impl Worker {
    /// A worker without work.
    pub fn new(introduction: Introduction, now: Instant) -> Self {
        Self {
            time: WorkerTime::new(now, introduction.n_slots),
            shared_name: introduction.name.as_str().into(),
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

    /// What it calls itself.
    pub fn name(&self) -> &str {
        &self.introduction.name
    }

    /// Items it computes at the same time.
    pub fn n_slots(&self) -> usize {
        self.introduction.n_slots
    }

    /// Whether it takes items of this job.
    pub fn takes(&self, job: &JobWork) -> bool {
        self.introduction.experiments.matches(&job.name)
    }

    /// Whether it has an item that workers were lost with.
    pub fn has_suspect(&self) -> bool {
        self.in_flight.values().any(|assigned| assigned.source == Source::Suspects)
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
        self.is_usable() && self.n_held() < self.n_credits()
    }

    /// Items that it computes, or will.
    fn n_held(&self) -> usize {
        self.in_flight.len() + self.written_off.len()
    }

    /// Items in flight that wait for a slot.
    pub fn n_waiting(&self) -> usize {
        self.n_held().saturating_sub(self.n_slots()).min(self.in_flight.len())
    }

    /// Items per slot, in units of 1 / [`FULL_LOAD`].
    pub fn load(&self) -> u64 {
        (self.n_held() as u64 * FULL_LOAD) / self.n_slots() as u64
    }

    /// When it would be done with another item, for sorting: slots without an item first, then
    /// by what it holds and how long it takes for that; from [`FULL_LOAD`] on if every slot has
    /// an item.
    pub fn finish_rank(&self) -> u64 {
        let load = self.load();
        if load < FULL_LOAD {
            return load;
        }
        let load_then = (self.n_held() + 1) as f64 / self.n_slots() as f64;
        FULL_LOAD + (load_then * self.pace * FULL_LOAD as f64) as u64
    }

    /// Its pace as a whole number, for sorting.
    pub fn pace_rank(&self) -> u32 {
        (self.pace * 64.0) as u32
    }

    /// Slots that may have an item.
    pub fn n_usable_slots(&self) -> usize {
        match self.availability() {
            Availability::Free => self.n_slots(),
            Availability::OnProbation => 1,
            _ => 0,
        }
    }

    /// How much its usable slots compute, in units of 1 / [`SPEED_UNIT`]; whole, so that a sum
    /// over workers that come and go stays exact.
    pub fn usable_speed(&self) -> u64 {
        (self.n_usable_slots() as f64 / self.pace * SPEED_UNIT as f64) as u64
    }

    /// Those that have none.
    pub fn n_idle_slots(&self) -> usize {
        self.n_usable_slots().saturating_sub(self.n_held())
    }

    /// Learns from an item that took `busy` and was expected to take `expected`
    /// for a worker of pace 1.
    pub fn learn(&mut self, busy: Duration, expected: Option<Duration>) {
        let busy_s = busy.as_secs_f64();
        let item_s = self.item_s.get_or_insert(busy_s);
        *item_s = (*item_s + 0.1 * (busy_s - *item_s)).max(1e-6);
        if let Some(expected) = expected {
            let ratio = busy_s / expected.as_secs_f64().max(1e-9);
            // The mean of the first few, then of the last few.
            self.n_learnt += 1;
            let gain = (1.0 / f64::from(self.n_learnt)).max(0.1);
            self.pace = (self.pace + gain * (ratio - self.pace)).clamp(1e-2, 1e2);
        }
    }

    /// Remembers what was taken back.
    pub fn remember_recalled(&mut self, assignment_id: AssignmentId, assignment: AssignedItem) {
        if self.recalled.len() >= 2 * self.n_slots() {
            self.recalled.pop_front();
        }
        self.recalled.push_back((assignment_id, assignment));
    }

    /// What was taken back under this id, if it is remembered.
    pub fn take_recalled(&mut self, assignment_id: AssignmentId) -> Option<AssignedItem> {
        let index = self.recalled.iter().position(|(id, _)| *id == assignment_id)?;
        self.recalled.remove(index).map(|(_, assignment)| assignment)
    }

    /// What people see of it.
    pub fn status(&self, id: WorkerId, now: Instant) -> WorkerStatus {
        let Introduction { name, version, n_slots, experiments, .. } = self.introduction.clone();
        let (results_per_s, idle_share) = self.time.recent(now);
        WorkerStatus {
            id,
            name,
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
            waits: self.waits(now),
        }
    }
}
