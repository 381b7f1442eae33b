//! The fitness of every individual, generation by generation.

use evolution::{Told, mean};

use crate::{ids::ExperimentId, limits::PAGE_LEN_MAX, store::Store};

use super::{QueryError, experiment};

/// Mean fitness over the trials, shape `[generation][individual]`, of at most `n` generations; and
/// the number of the first one: `from`, or the start of the fitness log if that is later.
pub fn fitness(
    store: &Store,
    id: ExperimentId,
    from: u64,
    n: u32,
) -> Result<(u64, Vec<Vec<f32>>), QueryError> {
    let first = from.max(experiment(store, id)?.log_from);
    let log = store.fitness_log(id, first, n.min(PAGE_LEN_MAX))?;
    let mut generations = Vec::with_capacity(log.len());
    for (generation, told) in (first..).zip(log) {
        let told = told.and_then(|told| Told::from_bytes(&told).ok());
        let told = told.ok_or(QueryError::DamagedLog { experiment: id, generation })?;
        generations.push(told.trial_fitness.iter().map(|trials| mean(trials) as f32).collect());
    }
    Ok((first, generations))
}
