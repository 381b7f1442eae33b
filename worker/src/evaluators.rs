//! The specifications that came last, compiled: the jobs of a client that evolves by itself have
//! the same one, generation by generation.

use std::{
    num::NonZeroUsize,
    sync::{Arc, Mutex},
};

use lru::LruCache;
use sim_core::Isa;

use crate::{convert, pool::Evaluator, stats::Stats};

/// Specifications that are remembered beside those of jobs that go on.
const REMEMBERED: NonZeroUsize = NonZeroUsize::new(4).expect("it is not 0");

/// Makes specifications computable.
pub(crate) struct Evaluators {
    isa: Isa,
    stats: Arc<Stats>,
    latest: Mutex<LruCache<String, Evaluator>>,
}

impl Evaluators {
    /// `stats`: where robots' steps are counted.
    pub(crate) fn new(isa: Isa, stats: Arc<Stats>) -> Self {
        Self { isa, stats, latest: Mutex::new(LruCache::new(REMEMBERED)) }
    }

    /// What computes a specification; equal ones are compiled once.
    pub(crate) fn get(&self, config_json: &str) -> Evaluator {
        let mut latest = self.latest.lock().expect("nothing panics while it holds them");
        let new = || convert::evaluator(config_json.to_owned(), self.isa, Arc::clone(&self.stats));
        Arc::clone(latest.get_or_insert_ref(config_json, new))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_specifications_share_what_computes_them() {
        let evaluators = Evaluators::new(Isa::best(), Arc::default());
        let first = evaluators.get("{}");
        assert!(Arc::ptr_eq(&first, &evaluators.get("{}")));
        for n in 1..=REMEMBERED.get() {
            assert!(!Arc::ptr_eq(&first, &evaluators.get(&" ".repeat(n))));
        }
        assert!(!Arc::ptr_eq(&first, &evaluators.get("{}")), "the oldest is forgotten");
    }
}
