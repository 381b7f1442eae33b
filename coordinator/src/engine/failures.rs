//! Which items take workers down, or fail wherever they are tried.
//!
//! A worker whose stream broke while it computed something may have been taken
//! down by it, or only cut off. If the same process comes back, it was cut off,
//! and nothing is held against the item. So a decision that rests on lost workers
//! waits for a while; the item is held back meanwhile, and takes no other worker
//! down.

use std::{
    collections::{BTreeMap, BTreeSet},
    num::NonZeroU64,
    ops::Range,
    time::{Duration, Instant},
};

use super::{MAX_ATTEMPTS, item::Item};

/// The failed attempts at the items of a batch.
#[derive(Debug, Default)]
pub struct FailureRecord {
    /// Failures by individual and trial, where there are any: of each the process
    /// that was lost, whose return takes it back, if one was.
    by_trial: BTreeMap<(u32, u32), Vec<Option<NonZeroU64>>>,
    held_back: Vec<HeldBack>,
}

/// An item that no worker is given until it is clear what happened.
#[derive(Debug)]
struct HeldBack {
    item: Item,
    until: Instant,
    /// What happened last, for people.
    failure: String,
}

/// What is done with an item that has failed.
#[derive(Debug, PartialEq, Eq)]
pub enum RetryDecision {
    /// It is tried again.
    Retry,
    /// It waits: see [`FailureRecord::on_process_joined`] and [`FailureRecord::overdue`].
    HoldBack,
    /// It was tried [`MAX_ATTEMPTS`] times: its job fails.
    Fail,
}

impl FailureRecord {
    /// Records a failed attempt at an item. `process`: the worker's, if it was lost; its
    /// return clears this failure. `until`: how long to wait for that.
    pub fn add(
        &mut self,
        item: &Item,
        process: Option<NonZeroU64>,
        failure: &str,
        until: Instant,
    ) -> RetryDecision {
        for trial in item.trials.clone() {
            self.by_trial.entry((item.individual, trial)).or_default().push(process);
        }
        if self.n_attempts(item) < MAX_ATTEMPTS {
            return RetryDecision::Retry;
        }
        let may_be_retracted = self
            .by_trial
            .range(range(item))
            .filter(|(_, failures)| failures.len() >= MAX_ATTEMPTS as usize)
            .all(|(_, failures)| failures.iter().any(Option::is_some));
        if may_be_retracted {
            let (item, failure) = (item.clone(), failure.to_owned());
            self.held_back.push(HeldBack { item, until, failure });
            RetryDecision::HoldBack
        } else {
            RetryDecision::Fail
        }
    }

    fn n_attempts(&self, item: &Item) -> u32 {
        let failures = self.by_trial.range(range(item)).map(|(_, failures)| failures.len());
        failures.max().unwrap_or(0) as u32
    }

    /// Individuals with failed attempts.
    pub fn n_individuals(&self) -> usize {
        let individuals: BTreeSet<u32> = self.by_trial.keys().map(|&(i, _)| i).collect();
        individuals.len()
    }

    /// A process is back, so that nothing has taken it down: clears the failures that
    /// rested on its loss, and returns the items that may be tried again.
    pub fn on_process_joined(&mut self, process: NonZeroU64) -> Vec<Item> {
        self.by_trial.retain(|_, failures| {
            failures.retain(|failure| *failure != Some(process));
            !failures.is_empty()
        });
        let (held_back, released): (Vec<_>, Vec<_>) = std::mem::take(&mut self.held_back)
            .into_iter()
            .partition(|held_back| self.n_attempts(&held_back.item) >= MAX_ATTEMPTS);
        self.held_back = held_back;
        released.into_iter().map(|released| released.item).collect()
    }

    /// An item that has been held back for long enough, and what happened to it.
    pub fn overdue(&self, now: Instant) -> Option<(&Item, &str)> {
        let overdue = self.held_back.iter().find(|held_back| held_back.until <= now)?;
        Some((&overdue.item, &overdue.failure))
    }

    /// The coordinator itself has paused: nobody could come back.
    pub fn postpone(&mut self, pause: Duration) {
        self.held_back.iter_mut().for_each(|held_back| held_back.until += pause);
    }

    /// Whether a trial is held back.
    pub fn is_held_back(&self, individual: u32, trial: u32) -> bool {
        let mut items = self.held_back.iter().map(|held_back| &held_back.item);
        items.any(|item| item.individual == individual && item.trials.contains(&trial))
    }
}

fn range(item: &Item) -> Range<(u32, u32)> {
    (item.individual, item.trials.start)..(item.individual, item.trials.end)
}
