//! Audits: a worker of another name recomputes items of a batch.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    sync::Arc,
};

use model::ids::{AssignmentId, JobId};
use sim_core::TrialSet;

use super::super::item::Item;

/// The audits of a batch.
#[derive(Debug, Default)]
pub struct Audits {
    /// Items that another worker has to confirm, by the name of the first worker; no queue is
    /// empty.
    waiting: BTreeMap<Arc<str>, VecDeque<Item>>,
    /// Audits that workers compute.
    pub in_flight: BTreeSet<AssignmentId>,
    n_agreed: usize,
    /// Audits that were given up, because workers were lost with them.
    n_waived: usize,
    /// Workers that an audit agreed with.
    confirmed: BTreeSet<Arc<str>>,
}

impl Audits {
    /// Queues an audit of an item that workers named `first` computed.
    pub fn push(&mut self, first: &Arc<str>, item: Item) {
        self.waiting.entry(Arc::clone(first)).or_default().push_back(item);
    }

    /// Whether no audit waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Number of audits that wait for a worker.
    pub fn n_waiting(&self) -> usize {
        self.waiting.values().map(VecDeque::len).sum()
    }

    /// Gives up an audit.
    pub fn waive(&mut self) {
        self.n_waived += 1;
    }

    /// Number of audits without a result.
    pub fn n_missing(&self) -> usize {
        self.n_waiting() + self.n_waived
    }

    /// Whether an audit waits that a worker of this name may do.
    pub fn has_for(&self, name: &str) -> bool {
        self.waiting.keys().any(|first| **first != *name)
    }

    /// Whether a worker of this name may do an audit of values whose worker is not in doubt
    /// already.
    pub fn has_clear_for(&self, name: &str, doubted: &BTreeSet<&str>) -> bool {
        self.waiting.keys().any(|first| **first != *name && !doubted.contains(&**first))
    }

    /// Takes the first audit for a worker of this name. Leaves out audits of workers in doubt.
    pub fn pop_for(&mut self, name: &str, doubted: &BTreeSet<&str>) -> Option<Item> {
        let mut waiting = self.waiting.iter_mut();
        let (first, items) =
            waiting.find(|(first, _)| ***first != *name && !doubted.contains(&***first))?;
        let item = items.pop_front();
        if items.is_empty() {
            let first = Arc::clone(first);
            self.waiting.remove(&first);
        }
        item
    }

    /// Records that an audit has agreed: it confirms the auditor, and the first worker if known.
    pub fn on_agreed(&mut self, auditor: Arc<str>, first: Option<&Arc<str>>) {
        self.n_agreed += 1;
        self.confirmed.insert(auditor);
        self.confirmed.extend(first.map(Arc::clone));
    }

    /// Number of audits that have agreed.
    pub fn n_agreed(&self) -> usize {
        self.n_agreed
    }

    /// Whether an audit has agreed with a worker of this name.
    pub fn has_confirmed(&self, name: &str) -> bool {
        self.confirmed.contains(name)
    }

    /// Forgets audits of results by workers of this name.
    pub fn discard(&mut self, name: &str) {
        self.waiting.remove(name);
        self.confirmed.remove(name);
    }
}

/// Whether a second worker audits a share of the individuals that includes this one. Depends only
/// on the place of the individual, so that the choice does not depend on workers.
pub fn is_audited(share: f64, job: JobId, trial_set: TrialSet, individual: u32) -> bool {
    let (kind, number) = match job {
        JobId::Experiment(id) => (0, id.0),
        JobId::Evaluation(id) => (1, id.0),
    };
    let (set, generation) = match trial_set {
        TrialSet::Generation(generation) => (0, generation),
        TrialSet::Evaluation => (2, 0),
        TrialSet::Judgement(generation) => (3, generation),
        TrialSet::HeldOut { generation, block: 0 } => (1, generation),
        TrialSet::HeldOut { generation, block } => (3 + u64::from(block), generation),
    };
    let place = [mix_in(number, kind), mix_in(generation, set), u64::from(individual)];
    let hash = place.into_iter().fold(0, |hash, part| mix(hash ^ part));
    (hash as f64) < share * (1u128 << 64) as f64
}

/// Mixes a kind into a number; kind 0 leaves the number as it is.
fn mix_in(number: u64, kind: u64) -> u64 {
    number ^ kind.wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// A step of SplitMix64 (Steele, Lea & Flood 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
