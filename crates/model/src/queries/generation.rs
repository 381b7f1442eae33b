//! Recomputes a generation from the fitness log.

use std::fmt;

use evolution::{Checkpoint, Evolution, Generation, Told};

use crate::{
    ids::ExperimentId,
    store::{ExperimentRecord, ForkRecord, GenerationRecord, LogGap, Store, StoredExperiment},
};

use super::{QueryError, experiment, other_bits};

/// A stored generation: the data from which it is recomputed.
#[derive(Debug)]
pub struct StoredGeneration {
    /// Its experiment.
    pub experiment: StoredExperiment,
    /// Its row of the history.
    pub of: GenerationRecord,
    checkpoint: Checkpoint,
    told: Vec<u8>,
}

/// A recomputed generation, and its result.
#[derive(Debug)]
pub struct RepeatedGeneration {
    /// The genotypes.
    pub generation: Generation,
    /// Their recorded fitness.
    pub told: Told,
    /// The state of evolution after it.
    pub after: Evolution,
}

impl StoredGeneration {
    /// Reads the data from which a generation is recomputed.
    pub fn read(store: &Store, id: ExperimentId, generation: u64) -> Result<Self, QueryError> {
        let experiment = experiment(store, id)?;
        check_in_log(store, &experiment, generation)?;
        let (checkpoint, of, told) = store
            .generation_in_log(id, generation)?
            .ok_or(QueryError::DamagedLog { experiment: id, generation })?;
        Ok(Self { experiment, of, checkpoint, told })
    }

    /// Its recorded fitness.
    pub fn told(&self) -> Result<Told, QueryError> {
        Told::from_bytes(&self.told).map_err(|error| self.other(error.to_string()))
    }

    fn other(&self, what: String) -> QueryError {
        other_bits(&self.experiment, self.of.generation, what)
    }

    /// Repeats the generation; CPU-bound. Fails unless genotypes and fitness have the digest of
    /// the history.
    pub fn repeat(&self) -> Result<RepeatedGeneration, QueryError> {
        let Self { of, checkpoint, .. } = self;
        let restored = Evolution::restore(checkpoint);
        let mut after = restored.map_err(|error| self.other(error.to_string()))?;
        let told = self.told()?;
        let generation = after.ask();
        after.repeat(&told).map_err(|error| self.other(error.to_string()))?;
        let found = after.digest().to_string();
        if found != of.digest {
            let what = format!("they have the digest {found}, and the history {}", of.digest);
            return Err(self.other(what));
        }
        Ok(RepeatedGeneration { generation, told, after })
    }
}

/// Checks that the fitness log of an experiment has a generation.
pub(super) fn check_in_log(
    store: &Store,
    experiment: &ExperimentRecord,
    generation: u64,
) -> Result<(), QueryError> {
    let (id, n_generations) = (experiment.id, experiment.n_generations());
    if generation >= n_generations {
        return Err(QueryError::NoGeneration { experiment: id, generation, n_generations });
    }
    if generation < experiment.log_from {
        let why = Gap::before(store, experiment, generation);
        return Err(QueryError::NotInLog { experiment: id, generation, why });
    }
    Ok(())
}

/// Why a generation is not in a fitness log; displays as a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gap {
    /// The first generation in the log.
    first: u64,
    gap: LogGap,
    /// The parent of a fork, and the generation of the parent.
    elsewhere: Option<(ExperimentId, u64)>,
    /// Whether the parent is in the database.
    is_there: bool,
}

impl Gap {
    pub(super) fn before(store: &Store, experiment: &ExperimentRecord, generation: u64) -> Self {
        let fork = experiment.fork.as_ref().filter(|fork| generation <= fork.generation);
        let is_there = |fork: &ForkRecord| matches!(store.experiment(fork.parent), Ok(Some(_)));
        Self {
            first: experiment.log_from,
            gap: experiment.log_gap,
            elsewhere: fork.map(|fork| (fork.parent, generation)),
            is_there: fork.is_some_and(is_there),
        }
    }
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let first = self.first;
        match (&self.elsewhere, self.gap) {
            (Some((parent, generation)), _) if self.is_there => {
                write!(f, "the parent has it: ask for {parent}@{generation}")
            }
            (Some((parent, _)), _) => write!(
                f,
                "it was that of the parent, experiment {parent}, which is deleted; its own \
                 generations begin with {first}"
            ),
            (None, LogGap::Pruned) => {
                write!(f, "its fitness log was pruned before generation {first}")
            }
            (None, LogGap::Damaged) => {
                write!(f, "its fitness log was damaged, and begins with generation {first}")
            }
            (None, LogGap::None | LogGap::Older | LogGap::Forked) => write!(
                f,
                "an older version computed it, which kept no fitness; the log begins with \
                 generation {first}"
            ),
        }
    }
}
