//! Since when nobody has confirmed a worker's results.

use std::{collections::BTreeMap, ops::RangeInclusive, sync::Arc};

/// Names that are remembered; the latest ones, where there are more.
const NAMES_MAX: usize = 10_000;

/// The generations of an experiment that workers have contributed to since an audit agreed
/// with them last, by the worker's name.
#[derive(Debug, Default)]
pub struct Unaudited {
    by_name: BTreeMap<Arc<str>, RangeInclusive<u64>>,
}

impl Unaudited {
    /// A generation is complete. `names`: who has contributed to it, and whether an audit has
    /// agreed with one of the values meanwhile.
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
            // Names of processes that are gone, for the most part.
            self.by_name.retain(|_, generations| *generations.end() == generation);
        }
    }

    /// Takes out the generations that a worker's unconfirmed values are in; from the first to
    /// the last, it may have left out some.
    pub fn take(&mut self, name: &str) -> Option<RangeInclusive<u64>> {
        self.by_name.remove(name)
    }
}
