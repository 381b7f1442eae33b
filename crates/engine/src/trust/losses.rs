//! Records the items that were in progress when workers were lost.
//!
//! If a worker's stream breaks, an item may have taken the worker down, something else may have
//! killed it, or only the network may have failed. One loss proves nothing. An item that was in
//! progress at two losses is a *suspect*. A worker gets only one suspect at a time, so that the
//! next loss points at one item. The referee then finds out whether the suspect takes its process
//! down.

use std::{
    collections::{BTreeMap, BTreeSet},
    num::NonZeroU64,
    ops::Range,
    time::Duration,
};

use crate::Instant;

use super::super::item::Item;

/// Losses within this time count once: machines, racks and networks fail as a whole, and may take
/// several duplicates of an item with them.
const SAME_LOSS: Duration = Duration::from_secs(1);
/// Number of losses that make an item a suspect.
const SUSPECT: usize = 2;

/// The losses of workers that computed items of a batch.
#[derive(Debug, Default)]
pub struct LossRecord {
    /// Losses by individual and trial.
    by_trial: BTreeMap<(u32, u32), Vec<Loss>>,
    /// Individuals and trials by the lost process.
    by_process: BTreeMap<NonZeroU64, Vec<(u32, u32)>>,
}

/// How the engine continues with an item whose worker was lost.
#[derive(Debug, PartialEq, Eq)]
pub enum AfterLoss {
    /// Another worker gets it.
    Retry,
    /// Another worker gets it, but not before this time: an item that takes workers down must not
    /// take many in a short time.
    Wait(Instant),
    /// It is a suspect, and the loss points at it: the referee computes it.
    Ask,
}

/// The loss of a worker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkerLoss {
    /// Its process; if it reconnects, the loss is forgotten.
    pub process: Option<NonZeroU64>,
    /// Whether it was computing a single item.
    pub is_alone: bool,
}

#[derive(Debug)]
struct Loss {
    at: Instant,
    process: Option<NonZeroU64>,
}

impl LossRecord {
    /// A worker was lost while it computed an item.
    pub fn add(&mut self, now: Instant, item: &Item, loss: WorkerLoss) -> AfterLoss {
        let WorkerLoss { process, is_alone } = loss;
        let mut same_until = None;
        for trial in item.trials.clone() {
            let losses = self.by_trial.entry((item.individual, trial)).or_default();
            match losses.last() {
                Some(last) if now <= last.at + SAME_LOSS => same_until = Some(last.at + SAME_LOSS),
                _ => {
                    losses.push(Loss { at: now, process });
                    if let Some(process) = process {
                        let trials = self.by_process.entry(process).or_default();
                        trials.push((item.individual, trial));
                    }
                }
            }
        }
        // Alone, it is the only item to blame; otherwise one loss more is needed.
        let n_needed = if is_alone { SUSPECT } else { SUSPECT + 1 };
        if let Some(until) = same_until {
            AfterLoss::Wait(until)
        } else if self.n_losses(item) >= n_needed {
            AfterLoss::Ask
        } else {
            AfterLoss::Retry
        }
    }

    /// Whether an item is a suspect.
    pub fn is_suspect(&self, item: &Item) -> bool {
        self.n_losses(item) >= SUSPECT
    }

    fn n_losses(&self, item: &Item) -> usize {
        let losses = self.by_trial.range(range(item)).map(|(_, losses)| losses.len());
        losses.max().unwrap_or(0)
    }

    /// Number of individuals with trials that were in progress at a loss and that satisfy a
    /// condition.
    pub fn n_individuals(&self, is_counted: impl Fn(u32, u32) -> bool) -> usize {
        let trials =
            self.by_trial.keys().filter(|&&(individual, trial)| is_counted(individual, trial));
        trials.map(|&(individual, _)| individual).collect::<BTreeSet<u32>>().len()
    }

    /// A process has reconnected, so no item has taken it down.
    pub fn on_process_joined(&mut self, process: NonZeroU64) {
        for trial in self.by_process.remove(&process).unwrap_or_default() {
            if let Some(losses) = self.by_trial.get_mut(&trial) {
                losses.retain(|loss| loss.process != Some(process));
                if losses.is_empty() {
                    self.by_trial.remove(&trial);
                }
            }
        }
    }
}

fn range(item: &Item) -> Range<(u32, u32)> {
    (item.individual, item.trials.start)..(item.individual, item.trials.end)
}
