//! Audits: what one worker computed of a batch, computed again by one of another name.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    sync::Arc,
};

use super::item::Item;

/// The names of workers whose word is in doubt, and for how many questions.
pub type Doubted = BTreeMap<Arc<str>, usize>;

/// The audits of a batch.
#[derive(Debug, Default)]
pub struct Audits {
    /// Items that another worker has to confirm, by the name of the first; none is empty.
    waiting: BTreeMap<Arc<str>, VecDeque<Item>>,
    /// Audits that workers compute.
    pub n_in_flight: usize,
    n_agreed: usize,
    /// Workers that an audit agreed with.
    confirmed: BTreeSet<Arc<str>>,
}

impl Audits {
    /// Queues an audit of what workers of a name computed.
    pub fn push(&mut self, first: &Arc<str>, item: Item) {
        self.waiting.entry(Arc::clone(first)).or_default().push_back(item);
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// How many wait for a worker.
    pub fn n_waiting(&self) -> usize {
        self.waiting.values().map(VecDeque::len).sum()
    }

    /// Whether one waits for a worker of this name.
    pub fn has_for(&self, name: &str) -> bool {
        self.waiting.keys().any(|first| **first != *name)
    }

    /// Whether there is one of values whose worker is not in doubt already.
    pub fn has_clear_for(&self, name: &str, doubted: &Doubted) -> bool {
        self.waiting.keys().any(|first| **first != *name && !doubted.contains_key(first))
    }

    /// Takes the first such audit.
    pub fn pop_for(&mut self, name: &str, doubted: &Doubted) -> Option<Item> {
        let mut waiting = self.waiting.iter_mut();
        let (first, items) =
            waiting.find(|(first, _)| ***first != *name && !doubted.contains_key(*first))?;
        let item = items.pop_front();
        if items.is_empty() {
            let first = Arc::clone(first);
            self.waiting.remove(&first);
        }
        item
    }

    /// One has agreed: with an auditor, and with whoever computed the item first.
    pub fn count(&mut self, auditor: Arc<str>, first: Option<&Arc<str>>) {
        self.n_agreed += 1;
        self.confirmed.insert(auditor);
        self.confirmed.extend(first.map(Arc::clone));
    }

    /// How many have agreed.
    pub fn n_agreed(&self) -> usize {
        self.n_agreed
    }

    /// Whether one has agreed with a worker of this name.
    pub fn has_confirmed(&self, name: &str) -> bool {
        self.confirmed.contains(name)
    }

    /// Forgets those of what workers of a name computed.
    pub fn discard(&mut self, name: &str) {
        self.waiting.remove(name);
        self.confirmed.remove(name);
    }
}
