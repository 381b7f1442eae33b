//! A cache of compiled specifications: a client that runs its own evolution sends the same one
//! with every generation.

use std::{
    num::NonZeroUsize,
    sync::{Arc, Mutex},
};

use lru::LruCache;
use sim_core::Isa;

use crate::{convert, pool::Evaluator, stats::Stats};

/// Number of specifications to keep beside those of present jobs.
const REMEMBERED: NonZeroUsize = NonZeroUsize::new(4).expect("it is not 0");

/// Makes specifications computable.
pub(crate) struct Evaluators {
    isa: Isa,
    stats: Arc<Stats>,
    latest: Mutex<LruCache<String, Evaluator>>,
}

impl Evaluators {
    /// `stats`: counts robots' steps.
    pub(crate) fn new(isa: Isa, stats: Arc<Stats>) -> Self {
        Self { isa, stats, latest: Mutex::new(LruCache::new(REMEMBERED)) }
    }

    /// The evaluator of a specification; equal specifications are compiled once.
    pub(crate) fn get(&self, config_json: &str) -> Evaluator {
        let mut latest = self.latest.lock().expect("nothing panics while it holds the lock");
        let new = || convert::evaluator(config_json.to_owned(), self.isa, Arc::clone(&self.stats));
        Arc::clone(latest.get_or_insert_ref(config_json, new))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_specifications_share_an_evaluator() {
        let evaluators = Evaluators::new(Isa::best(), Arc::default());
        let first = evaluators.get("{}");
        assert!(Arc::ptr_eq(&first, &evaluators.get("{}")));
        for n in 1..=REMEMBERED.get() {
            assert!(!Arc::ptr_eq(&first, &evaluators.get(&" ".repeat(n))));
        }
        assert!(!Arc::ptr_eq(&first, &evaluators.get("{}")), "the oldest is forgotten");
    }
}
