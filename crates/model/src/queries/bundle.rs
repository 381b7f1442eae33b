//! Packs an ended experiment as a bundle.

use bundle::{Bundle, FORMAT, ForkOf, GenerationRow, Manifest, champion_json};
use evolution::{Digest, End, Statistics, Told};
use swarm_telemetry::VERSION;

use crate::{
    ids::ExperimentId,
    store::{Evidence, ExperimentRecord, ForkRecord, Store, StoredExperiment},
};

use super::{QueryError, experiment, generation::Gap};

/// The bundle of an ended experiment, with everything from which its results follow.
pub fn bundle(store: &Store, id: ExperimentId) -> Result<Bundle, QueryError> {
    let StoredExperiment { record: experiment, config_json } = experiment(store, id)?;
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
    let Evidence { history, log, keyframes, champion } = store.evidence(&experiment)?;
    let undecodable = |what: String| QueryError::Undecodable(format!("experiment {id}: {what}"));
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

/// The first generation that an experiment does not share with a parent.
fn first_own(experiment: &ExperimentRecord) -> u64 {
    experiment.fork.as_ref().map_or(0, |fork| fork.generation + 1)
}
