//! Records the generations in which no audit has confirmed a worker's results.

use std::{collections::BTreeMap, ops::RangeInclusive, sync::Arc};

/// Most names to keep; the latest ones, if there are more.
const NAMES_MAX: usize = 10_000;

/// For each worker's name, the generations of an experiment to which it has contributed since its
/// last successful audit.
#[derive(Debug, Default)]
pub struct Unaudited {
    by_name: BTreeMap<Arc<str>, RangeInclusive<u64>>,
}

impl Unaudited {
    /// A generation is complete. `names`: the workers that contributed to it, and whether an
    /// audit has agreed with each.
    pub fn add(&mut self, generation: u64, names: impl Iterator<Item = (Arc<str>, bool)>) {
        for (name, is_confirmed) in names {
            if is_confirmed {
                self.by_name.remove(&name);
            } else {
                let first = self.by_name.get(&name).map_or(generation, |range| *range.start());
                self.by_name.insert(name, first..=generation);
            }
        }
        if self.by_name.len() > NAMES_MAX {
            // Most of these are names of processes that are gone.
            self.by_name.retain(|_, generations| *generations.end() == generation);
        }
    }

    /// Removes and returns the range of generations with unconfirmed values of a worker, which
    /// may have contributed to only some of them.
    pub fn take(&mut self, name: &str) -> Option<RangeInclusive<u64>> {
        self.by_name.remove(name)
    }
}
