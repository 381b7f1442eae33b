//! Packs an ended experiment as a bundle.

use bundle::{Bundle, FORMAT, ForkOf, GenerationRow, Manifest, UNPACKED_LEN_MAX, champion_json};
use evolution::{Digest, End, Statistics, Told};
use swarm_telemetry::VERSION;

use crate::{
    ids::ExperimentId,
    store::{Evidence, ExperimentRecord, ForkRecord, Store, StoredExperiment},
};

use super::{QueryError, experiment, generation::Gap};

/// The stored data of an ended experiment's bundle.
#[derive(Debug)]
pub struct StoredBundle {
    experiment: StoredExperiment,
    evidence: Evidence,
}

impl StoredBundle {
    /// Reads the data, unless it is longer than a bundle may be.
    pub fn read(store: &Store, id: ExperimentId) -> Result<Self, QueryError> {
        Self::read_within(UNPACKED_LEN_MAX, store, id)
    }

    fn read_within(len_max: u64, store: &Store, id: ExperimentId) -> Result<Self, QueryError> {
        let experiment = experiment(store, id)?;
        if experiment.state.is_unfinished() {
            return Err(QueryError::NotEnded(id));
        }
        let (n_generations, generation) = (experiment.n_generations(), first_own(&experiment));
        if generation >= n_generations {
            return Err(QueryError::NoGeneration { experiment: id, generation, n_generations });
        }
        if experiment.log_from > generation {
            let why = Gap::before(store, &experiment, generation);
            return Err(QueryError::NotInLog { experiment: id, generation, why });
        }
        let len = store.log_len(id)?;
        if len > len_max {
            return Err(QueryError::TooLongForBundle { experiment: id, len });
        }
        let evidence = store.evidence(&experiment)?;
        Ok(Self { experiment, evidence })
    }

    /// The bundle, with everything from which the experiment's results follow; CPU-bound.
    pub fn bundle(self) -> Result<Bundle, QueryError> {
        let Self { experiment, evidence } = self;
        let StoredExperiment { record: experiment, config_json } = experiment;
        let Evidence { history, log, keyframes, champion } = evidence;
        let id = experiment.id;
        let undecodable =
            |what: String| QueryError::Undecodable(format!("experiment {id}: {what}"));
        let digest = |text: &str| -> Result<Digest, QueryError> {
            text.parse().map_err(|error| undecodable(format!("\"{text}\": {error}")))
        };
        let n_own = log.len();
        let log = (1..).zip(log).map(|(place, entry)| {
            let told = Told::from_bytes(&entry).map_err(|error| undecodable(error.to_string()))?;
            // Omits the earlier ends of a run that was extended.
            let end = if place == n_own { told.end } else { End::default() };
            Ok(Told { end, ..told }.to_bytes())
        });
        let history = history.into_iter().map(|(completed_at_ms, row)| {
            let Statistics { best, mean, min, standard_deviation } = row.statistics;
            Ok(GenerationRow {
                generation: row.generation,
                best,
                mean,
                min,
                standard_deviation,
                episodes: row.episodes,
                duration_ms: row.duration_ms,
                completed_at_ms,
                workers: row.workers,
                idle_share: row.idle_share,
                digest: digest(&row.digest)?,
            })
        });
        let fork = experiment.fork.map(|ForkRecord { generation, link, changes, .. }| {
            Ok::<_, QueryError>(ForkOf { generation, link: digest(&link)?, changes })
        });
        Ok(Bundle {
            log: log.collect::<Result<_, QueryError>>()?,
            history: history.collect::<Result<_, QueryError>>()?,
            keyframes,
            champion_json: champion.as_ref().map(champion_json).unwrap_or_default(),
            manifest: Manifest {
                format: FORMAT,
                program: format!("swarmevo {VERSION}"),
                simulation: experiment.fingerprint,
                config_digest: digest(&experiment.config_digest)?,
                digest: digest(&experiment.digest)?,
                state: experiment.state.name().to_owned(),
                reason: experiment.reason,
                submitted_at_ms: experiment.submitted_at_ms,
                fork: fork.transpose()?,
            },
            config_json,
        })
    }
}

/// The first generation that an experiment does not share with a parent.
fn first_own(experiment: &ExperimentRecord) -> u64 {
    experiment.fork.as_ref().map_or(0, |fork| fork.generation + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{queries::families::tests::store_with, store::StoreError};

    #[test]
    fn a_log_that_is_too_long_for_a_bundle_is_refused_before_it_is_read() {
        let (_directory, store, id) = store_with("GA", 3);
        let len = store.log_len(id).unwrap();
        StoredBundle::read_within(len, &store, id).unwrap().bundle().unwrap();
        // Whoever reads the log finds the damage.
        let edit = "UPDATE fitness_log SET told = zeroblob(length(told))";
        store.connection().execute_batch(edit).unwrap();
        let error = StoredBundle::read_within(len, &store, id).unwrap_err();
        assert!(matches!(error, QueryError::Store(StoreError::Corrupt(_))), "{error}");
        let error = StoredBundle::read_within(len - 1, &store, id).unwrap_err();
        assert!(error.to_string().contains("does not fit into a bundle"), "{error}");
    }
}
