//! How evolution moved, generation by generation, found by going through them again.

use evolution::{Checkpoint, Dynamics, Evolution, Told};

use crate::{
    ids::ExperimentId,
    limits::DYNAMICS_PAGE_LEN_MAX,
    store::{ExperimentRecord, LogEntry, Store},
};

use super::{QueryError, experiment, generation::Gap};

/// What the dynamics of some generations are computed from.
#[derive(Debug)]
pub struct StoredDynamics {
    experiment: ExperimentRecord,
    first: u64,
    /// Before the first one.
    checkpoint: Option<Checkpoint>,
    log: Vec<LogEntry>,
}

/// What some generations did, by their numbers; and the number of the next one, if there are
/// more.
pub type DynamicsPage = (Vec<(u64, Dynamics)>, Option<u64>);

impl StoredDynamics {
    /// Reads what is needed of at most a page of generations from `from` on; of a fork, from
    /// its own first one on.
    pub fn read(store: &Store, id: ExperimentId, from: u64) -> Result<Self, QueryError> {
        let experiment = experiment(store, id)?.record;
        let n_generations = experiment.n_generations();
        let own = experiment.fork.as_ref().map_or(0, |fork| fork.generation + 1);
        let first = from.max(own);
        if first < experiment.log_from {
            let why = Gap::before(store, &experiment, first);
            return Err(QueryError::NotInLog { experiment: id, generation: first, why });
        }
        if first >= n_generations {
            return Ok(Self { experiment, first, checkpoint: None, log: Vec::new() });
        }
        let end = n_generations.min(first + DYNAMICS_PAGE_LEN_MAX);
        let damaged = || QueryError::DamagedLog { experiment: id, generation: first };
        let (checkpoint, ..) = store.generation_in_log(id, first)?.ok_or_else(damaged)?;
        let log = store.log_between(id, first, end)?.ok_or_else(damaged)?;
        Ok(Self { experiment, first, checkpoint: Some(checkpoint), log })
    }

    /// Goes through the generations again: work for a CPU.
    pub fn replay(self) -> Result<DynamicsPage, QueryError> {
        let Self { experiment, first, checkpoint, log } = self;
        let Some(checkpoint) = checkpoint else { return Ok((Vec::new(), None)) };
        let other = |what: String| QueryError::OtherBits {
            experiment: experiment.id,
            generation: first,
            what,
            theirs: experiment.fingerprint.clone(),
        };
        let mut evolution =
            Evolution::restore(&checkpoint).map_err(|error| other(error.to_string()))?;
        let mut generations = Vec::with_capacity(log.len());
        for (of, entry) in &log {
            let told = Told::from_bytes(entry).map_err(|error| other(error.to_string()))?;
            let found = evolution.dynamics(&told).map_err(|error| other(error.to_string()))?;
            if found.digest.to_string() != of.digest {
                return Err(other(format!(
                    "it has the digest {}, not {}",
                    found.digest, of.digest
                )));
            }
            generations.push((of.generation, found));
        }
        let next = first + log.len() as u64;
        Ok((generations, (next < experiment.n_generations()).then_some(next)))
    }
}
