//! Which items workers were computing when they were lost.
//!
//! A worker whose stream broke while it computed something may have been taken down
//! by it, or killed for another reason, or only cut off. One loss says nothing. An item
//! that was being computed at two of them is a *suspect*: no worker is given two suspects
//! at a time, so that the next loss points at one. Whether a suspect really takes down
//! what computes it is for the referee to say.

use std::{
    collections::{BTreeMap, BTreeSet},
    num::NonZeroU64,
    ops::Range,
    time::{Duration, Instant},
};

use super::super::item::Item;

/// Losses within this time are one: machines, racks and networks fail as a whole, and so
/// several copies of an item may be lost at once, or one copy after the other.
const SAME_LOSS: Duration = Duration::from_secs(1);
/// Losses that make an item a suspect.
const SUSPECT: usize = 2;

/// The losses of workers that computed items of a batch.
#[derive(Debug, Default)]
pub struct LossRecord {
    /// By individual and trial, where there are any.
    by_trial: BTreeMap<(u32, u32), Vec<Loss>>,
    /// The same by the process that was lost.
    by_process: BTreeMap<NonZeroU64, Vec<(u32, u32)>>,
}

/// What is done with an item whose worker was lost.
#[derive(Debug, PartialEq, Eq)]
pub enum AfterLoss {
    /// Another worker is given it.
    Retry,
    /// The same, but not before this: if it takes one worker down after the other, that
    /// must not go fast.
    Wait(Instant),
    /// It is a suspect, and the loss points at it: the referee is asked.
    Ask,
}

#[derive(Debug)]
struct Loss {
    at: Instant,
    /// Whose return takes it back.
    process: Option<NonZeroU64>,
}

impl LossRecord {
    /// A worker was lost that computed an item, and `is_alone` nothing else.
    pub fn add(
        &mut self,
        now: Instant,
        item: &Item,
        process: Option<NonZeroU64>,
        is_alone: bool,
    ) -> AfterLoss {
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
        if let Some(until) = same_until {
            AfterLoss::Wait(until)
        } else if self.n_losses(item) > if is_alone { SUSPECT - 1 } else { SUSPECT } {
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

    /// Individuals with trials that were being computed at a loss and that satisfy a condition.
    pub fn n_individuals(&self, is_counted: impl Fn(u32, u32) -> bool) -> usize {
        let trials =
            self.by_trial.keys().filter(|&&(individual, trial)| is_counted(individual, trial));
        trials.map(|&(individual, _)| individual).collect::<BTreeSet<u32>>().len()
    }

    /// A process is back, so that nothing has taken it down.
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
