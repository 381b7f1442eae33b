//! Which work takes workers down, or fails wherever it is tried.
//!
//! A worker whose stream broke while it computed something may have been taken
//! down by it, or only cut off. If the same process comes back, it was cut off,
//! and nothing is held against the work. So a verdict that rests on lost workers
//! waits for a while; the work is held back meanwhile, and takes nobody else down.

use std::{
    collections::{BTreeMap, BTreeSet},
    num::NonZeroU64,
    ops::Range,
    time::{Duration, Instant},
};

use super::{MAX_ATTEMPTS, item::Item};

/// What is held against the work of a generation.
#[derive(Debug, Default)]
pub struct FailureRecord {
    /// By individual and trial; only where there is something. A process that may
    /// come back, or none.
    by_trial: BTreeMap<(u32, u32), Vec<Option<NonZeroU64>>>,
    held_back: Vec<HeldBack>,
}

/// Work that nobody is given until it is clear what happened.
#[derive(Debug)]
struct HeldBack {
    item: Item,
    until: Instant,
    /// What happened last.
    failure: String,
}

/// What is to be done with work that has failed.
#[derive(Debug, PartialEq, Eq)]
pub enum RetryDecision {
    /// Try it again.
    Retry,
    /// Wait: see [`Blames::on_process_joined`] and [`Blames::overdue`].
    HoldBack,
    /// Give up.
    Fail,
}

impl FailureRecord {
    /// Holds an attempt against a task. `process`: which came back if this was no
    /// fault of the task's.
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

    /// Individuals with something held against them.
    pub fn n_individuals(&self) -> usize {
        let individuals: BTreeSet<u32> = self.by_trial.keys().map(|&(i, _)| i).collect();
        individuals.len()
    }

    /// A process is here, so that nothing has taken it down; returns what may be
    /// tried again.
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

    /// Work that has been held back for long enough, and what happened to it.
    pub fn overdue(&self, now: Instant) -> Option<(&Item, &str)> {
        let overdue = self.held_back.iter().find(|held_back| held_back.until <= now)?;
        Some((&overdue.item, &overdue.failure))
    }

    /// The coordinator itself has paused: nobody could come back.
    pub fn postpone(&mut self, pause: Duration) {
        self.held_back.iter_mut().for_each(|held_back| held_back.until += pause);
    }

    /// Whether a trial waits for a verdict.
    pub fn is_held_back(&self, individual: u32, trial: u32) -> bool {
        let mut items = self.held_back.iter().map(|held_back| &held_back.item);
        items.any(|item| item.individual == individual && item.trials.contains(&trial))
    }
}

fn range(item: &Item) -> Range<(u32, u32)> {
    (item.individual, item.trials.start)..(item.individual, item.trials.end)
}
