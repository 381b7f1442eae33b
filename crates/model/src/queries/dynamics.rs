//! Measures how evolution moved, generation by generation, by repeating the generations.

use evolution::{Checkpoint, Evolution, Told};
use swarm_proto::v1::{GenerationDynamics, ListDynamicsRequest, ListDynamicsResponse};
use tonic::Status;

use crate::{
    ids::ExperimentId,
    limits::DYNAMICS_PAGE_LEN_MAX,
    store::{ExperimentRecord, LogEntry, Store},
};

use super::{QueryError, Reader, experiment, generation::Gap};

impl Reader {
    /// The dynamics of a page of generations.
    pub async fn list_dynamics(
        &self,
        request: ListDynamicsRequest,
    ) -> Result<ListDynamicsResponse, Status> {
        let ListDynamicsRequest { experiment_id, from_generation } = request;
        let read = move |store: &_| {
            StoredDynamics::read(store, ExperimentId(experiment_id), from_generation)
        };
        self.reconstruct(read, StoredDynamics::repeat).await
    }
}

/// The stored data from which the dynamics of some generations are computed.
#[derive(Debug)]
struct StoredDynamics {
    experiment: ExperimentRecord,
    first: u64,
    /// The checkpoint before the first of these generations.
    checkpoint: Option<Checkpoint>,
    log: Vec<LogEntry>,
}

impl StoredDynamics {
    /// Reads the data of at most a page of generations from `from` on. A fork has data of its own
    /// generations only.
    fn read(store: &Store, id: ExperimentId, from: u64) -> Result<Self, QueryError> {
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

    /// Repeats the generations; CPU-bound.
    fn repeat(self) -> Result<ListDynamicsResponse, QueryError> {
        let Self { experiment, first, checkpoint, log } = self;
        let Some(checkpoint) = checkpoint else { return Ok(ListDynamicsResponse::default()) };
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
            generations.push(GenerationDynamics {
                generation: of.generation,
                mean_step: found.mean_step,
                deviations: found
                    .deviations
                    .map_or_else(Vec::new, |deviations| deviations.to_vec()),
                rank_correlation: found.rank_correlation,
            });
        }
        let next = first + log.len() as u64;
        let next_generation = (next < experiment.n_generations()).then_some(next);
        Ok(ListDynamicsResponse { generations, next_generation })
    }
}
