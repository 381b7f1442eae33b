//! Parents and their children, found by going through generations again.

use std::num::NonZeroU64;

use evolution::{Checkpoint, Evolution, Told};
use experiment_file::ExperimentConfig;
use tonic::Status;

use crate::{
    ids::ExperimentId,
    limits::{CHILDREN_MAX, FAMILIES_PAGE_LEN_MAX},
    store::{LogEntry, Store, StoredExperiment},
};

use super::{QueryError, Reader, experiment, generation::Gap, lineage::no_parents};

/// Parents and children of some generations.
#[derive(Debug, Clone, Default)]
pub struct Families {
    /// The names of the populations.
    pub populations: Vec<String>,
    /// The generations by their numbers.
    pub generations: Vec<(u64, evolution::Families)>,
    /// The generation from which on to ask next.
    pub next: u64,
}

impl Reader {
    /// Parents and children of a page of generations from `from` on, of those whose number `every`
    /// divides. Refused where individuals have no parents.
    pub async fn families(
        &self,
        id: u64,
        from: u64,
        every: NonZeroU64,
    ) -> Result<Families, Status> {
        let read = move |store: &_| StoredFamilies::read(store, ExperimentId(id), from, every);
        self.reconstruct(read, StoredFamilies::replay).await
    }
}

/// The generations from which the families of some are computed.
#[derive(Debug)]
struct StoredFamilies {
    experiment: StoredExperiment,
    first: u64,
    /// One generation in so many is wanted, those whose number it divides.
    every: NonZeroU64,
    /// Before the first one, and the log from the generation before that on; none if there is
    /// nothing to go through.
    stored: Option<(Checkpoint, Vec<LogEntry>)>,
}

impl StoredFamilies {
    /// Reads at most a page of generations from `from` on. The first one with parents is the one
    /// after the first in the log; of a fork, after its own first one.
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

    /// Goes through the generations again: work for a CPU.
    fn replay(self) -> Result<Families, QueryError> {
        let Self { experiment, first, every, stored } = self;
        let other = |what: String| QueryError::OtherBits {
            experiment: experiment.id,
            generation: first,
            what,
            theirs: experiment.fingerprint.clone(),
        };
        let (config, _) =
            ExperimentConfig::from_json(&experiment.config_json, "", evolution::ALGORITHMS)
                .map_err(|error| other(error.to_string()))?;
        let populations: Vec<String> = config.algorithm.populations.keys().cloned().collect();
        let Some((checkpoint, log)) = stored else {
            return Ok(Families { populations, next: first, ..Families::default() });
        };
        let mut evolution =
            Evolution::restore(&checkpoint).map_err(|error| other(error.to_string()))?;
        let told = |(_, entry): &LogEntry| {
            Told::from_bytes(entry).map_err(|error| other(error.to_string()))
        };
        let mut before = told(&log[0])?;
        let (mut generations, mut n_children, mut next) = (Vec::new(), 0, first);
        for entry in &log[1..] {
            if n_children >= CHILDREN_MAX {
                break;
            }
            let of = &entry.0;
            let told = told(entry)?;
            if of.generation % every == 0 {
                let families = evolution.families(&before, &told);
                let families = families.ok_or_else(|| no_parents(&experiment, &config))?;
                n_children += families.births.iter().map(Vec::len).sum::<usize>();
                generations.push((of.generation, families));
            }
            let replay = evolution.replay(&told).map_err(|error| other(error.to_string()))?;
            let found = replay.summary.digest.to_string();
            if found != of.digest {
                return Err(other(format!("it has the digest {found}, and not {}", of.digest)));
            }
            before = told;
            next = of.generation + 1;
        }
        Ok(Families { populations, generations, next })
    }
}
