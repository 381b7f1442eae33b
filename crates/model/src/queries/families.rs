//! Finds parents and their children by repeating generations.

use std::num::NonZeroU64;

use evolution::{Checkpoint, Evolution, Told};
use tonic::Status;

use crate::{
    ids::ExperimentId,
    limits::{CHILDREN_MAX, FAMILIES_PAGE_LEN_MAX},
    store::{LogEntry, Store, StoredExperiment},
};

use super::{
    QueryError, Reader, config, experiment, generation::Gap, lineage::no_parents, other_bits,
};

/// Parents and children of some generations.
#[derive(Debug, Clone, Default)]
pub struct Families {
    /// The names of the populations.
    pub populations: Vec<String>,
    /// The generations by their numbers.
    pub generations: Vec<(u64, evolution::Families)>,
    /// The first generation of the next page.
    pub next: u64,
}

impl Reader {
    /// Parents and children in a page of generations from `from` on, of those whose number is a
    /// multiple of `every`. Fails if individuals have no parents.
    pub async fn families(
        &self,
        id: u64,
        from: u64,
        every: NonZeroU64,
    ) -> Result<Families, Status> {
        let read = move |store: &_| StoredFamilies::read(store, ExperimentId(id), from, every);
        self.reconstruct(read, StoredFamilies::repeat).await
    }
}

/// The stored generations from which families are computed.
#[derive(Debug)]
struct StoredFamilies {
    experiment: StoredExperiment,
    first: u64,
    /// Selects the generations whose number is a multiple of this one.
    every: NonZeroU64,
    /// The checkpoint before the first generation with parents, and the log from one generation
    /// earlier on; `None` if no generation is to be repeated.
    stored: Option<(Checkpoint, Vec<LogEntry>)>,
}

impl StoredFamilies {
    /// Reads at most a page of generations from `from` on. The first generation in the log (a
    /// fork's own first one) has no parents there, so families begin with the second.
    fn read(
        store: &Store,
        id: ExperimentId,
        from: u64,
        every: NonZeroU64,
    ) -> Result<Self, QueryError> {
        let experiment = experiment(store, id)?;
        let n_generations = experiment.n_generations();
        let own = experiment.fork.as_ref().map_or(0, |fork| fork.generation + 1);
        let first = from.max(own.saturating_add(1));
        if first <= experiment.log_from && experiment.log_from > own {
            let why = Gap::before(store, &experiment, first);
            return Err(QueryError::NotInLog { experiment: id, generation: first, why });
        }
        let stored = if first < n_generations {
            let end = n_generations.min(first + FAMILIES_PAGE_LEN_MAX);
            let damaged = || QueryError::DamagedLog { experiment: id, generation: first };
            let (checkpoint, ..) = store.generation_in_log(id, first)?.ok_or_else(damaged)?;
            let log = store.log_between(id, first - 1, end)?.ok_or_else(damaged)?;
            Some((checkpoint, log))
        } else {
            None
        };
        Ok(Self { experiment, first, every, stored })
    }

    /// Repeats the generations; CPU-bound.
    fn repeat(self) -> Result<Families, QueryError> {
        let Self { experiment, first, every, stored } = self;
        let other = |what: String| other_bits(&experiment, first, what);
        let config = config(&experiment, first)?;
        let populations: Vec<String> = config.algorithm.populations.keys().cloned().collect();
        let Some((checkpoint, log)) = stored else {
            return Ok(Families { populations, next: first, ..Families::default() });
        };
        let mut evolution =
            Evolution::restore(&checkpoint).map_err(|error| other(error.to_string()))?;
        let told = |(_, entry): &LogEntry| {
            Told::from_bytes(entry).map_err(|error| other(error.to_string()))
        };
        let (first_entry, log) =
            log.split_first().ok_or_else(|| other("its log is empty".to_owned()))?;
        let mut before = told(first_entry)?;
        let (mut generations, mut n_children, mut next) = (Vec::new(), 0, first);
        for entry in log {
            if n_children >= CHILDREN_MAX {
                break;
            }
            let of = &entry.0;
            let told = told(entry)?;
            if of.generation % every == 0 {
                let families = evolution.families(&before, &told);
                let families = families.ok_or_else(|| match evolution.n_descriptors() {
                    0 => no_parents(&experiment),
                    _ => QueryError::NoLineage(format!(
                        "the parents in experiment {0} are elites of many generations; `swarmctl \
                         lineage {0}@{1}/0` shows them",
                        experiment.id, of.generation
                    )),
                })?;
                n_children += families.births.iter().map(Vec::len).sum::<usize>();
                generations.push((of.generation, families));
            }
            let repeated = evolution.repeat(&told).map_err(|error| other(error.to_string()))?;
            let found = repeated.summary.digest.to_string();
            if found != of.digest {
                return Err(other(format!("it has the digest {found}, and not {}", of.digest)));
            }
            before = told;
            next = of.generation + 1;
        }
        Ok(Families { populations, generations, next })
    }
}

#[cfg(test)]
pub mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::{store::inspection::tests::advance_to, submission::Submission};

    const POPULATION: usize = 6;

    /// A run of this algorithm that has completed.
    pub fn store_with(
        algorithm: &str,
        n_generations: u64,
    ) -> (tempfile::TempDir, Store, ExperimentId) {
        let quickstart = include_str!("../../../../configs/quickstart.json");
        let mut config: Value = serde_json::from_str(quickstart).unwrap();
        let section = &mut config["algorithm"];
        section["name"] = json!(algorithm);
        section["population_size"] = json!(POPULATION);
        section["generations"] = json!(n_generations);
        for (_, population) in section["populations"].as_object_mut().unwrap() {
            population["params"] = json!({ "encoding": "real" });
        }
        let submission = Submission { config_json: config.to_string(), ..Submission::default() };
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let (id, _) = store.create(&submission.check(&|| true).unwrap().new, 5).unwrap();
        for generation in 0..n_generations {
            let is_last = generation + 1 == n_generations;
            advance_to(generation % 40 == 0, &mut store, id, is_last.then_some(""));
        }
        (directory, store, id)
    }

    fn page(
        store: &Store,
        id: ExperimentId,
        from: u64,
        every: u64,
    ) -> Result<Families, QueryError> {
        let every = NonZeroU64::new(every).unwrap();
        StoredFamilies::read(store, id, from, every)?.repeat()
    }

    /// The generations of all pages, each with the number of its children.
    fn pages(store: &Store, id: ExperimentId, every: u64) -> Vec<(u64, usize)> {
        let (mut from, mut all) = (0, Vec::new());
        loop {
            let page = page(store, id, from, every).unwrap();
            assert!(page.generations.len() as u64 <= FAMILIES_PAGE_LEN_MAX);
            let n_children =
                |families: &evolution::Families| families.births.iter().map(Vec::len).sum();
            all.extend(page.generations.iter().map(|(number, of)| (*number, n_children(of))));
            if page.next == from {
                return all;
            }
            from = page.next;
        }
    }

    #[test]
    fn pages_have_each_generation_with_parents_once_and_all_its_children() {
        let n = FAMILIES_PAGE_LEN_MAX + 30;
        let (_directory, store, id) = store_with("GA", n);
        let all = pages(&store, id, 1);
        let numbers: Vec<u64> = all.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, (1..n).collect::<Vec<_>>());
        assert!(all.iter().all(|(_, n_children)| *n_children == POPULATION), "{all:?}");
        let tenth: Vec<u64> = pages(&store, id, 10).into_iter().map(|(number, _)| number).collect();
        assert_eq!(tenth, (10..n).step_by(10).collect::<Vec<_>>());
    }

    #[test]
    fn generations_that_were_pruned_and_individuals_without_parents_are_refused() {
        let (_directory, mut store, id) = store_with("GA", 5);
        assert!(store.prune(id, 5, None, 9).unwrap() > 0);
        let error = page(&store, id, 0, 1).unwrap_err();
        assert!(matches!(error, QueryError::NotInLog { .. }), "{error}");

        let (_directory, store, id) = store_with("SNES", 3);
        let error = page(&store, id, 0, 1).unwrap_err();
        assert!(error.to_string().contains("parents"), "{error}");
    }
}
