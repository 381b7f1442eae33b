//! Decides which experiment a submission leads to: a new one, the one of the same
//! request, or one of the same bits that can go on.

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use tracing::warn;

use crate::{
    clock,
    ids::ExperimentId,
    limits::UNFINISHED_MAX,
    memory::{self, Shortage},
    runs::Runnable,
    store::{ExperimentRecord, ExperimentState, NewExperiment, Store, StoreError},
};

/// Where a submission ends up.
pub enum Placement {
    /// The driver has to run it.
    Runs(Box<Runnable>),
    /// The driver knows it, or it has ended.
    RunsAlready(ExperimentId),
    /// Too many experiments are unfinished.
    TooMany,
    /// Unfinished experiments leave too little memory.
    NoMemory(Shortage),
}

/// Stores a submission, or finds the experiment that it stands for: the one of the same
/// request, or, if `resume_unfinished`, one of the same bits. `memory_budget`: bytes that
/// all unfinished experiments may take together, whether they run or wait.
pub fn place(
    store: &mut Store,
    new: NewExperiment,
    resume_unfinished: bool,
    memory_budget: u64,
) -> Result<Placement, StoreError> {
    if let Some(request_id) = &new.request_id
        && let Some(id) = store.experiment_of_request(request_id)?
    {
        return Ok(Placement::RunsAlready(id));
    }
    let experiments = store.experiments()?;
    let shortage = shortage(&experiments, &new, memory_budget);
    if resume_unfinished && let Some(placement) = resume(store, &experiments, &new, shortage)? {
        return Ok(placement);
    }
    let is_unfinished = |e: &&ExperimentRecord| e.state.is_unfinished();
    if experiments.iter().filter(is_unfinished).count() >= UNFINISHED_MAX {
        return Ok(Placement::TooMany);
    }
    if let Some(shortage) = shortage {
        return Ok(Placement::NoMemory(shortage));
    }
    let (id, is_new) = store.create(&new, clock::unix_ms())?;
    Ok(if is_new {
        let genotype_len = new.genotype_len as u64;
        Placement::Runs(Box::new(Runnable::new(id, new.config, genotype_len, new.priority)))
    } else {
        Placement::RunsAlready(id)
    })
}

/// Why there is no memory for a submission, if there is none.
fn shortage(
    experiments: &[ExperimentRecord],
    new: &NewExperiment,
    memory_budget: u64,
) -> Option<Shortage> {
    // One of another release does not run.
    let takes_memory =
        |e: &&ExperimentRecord| e.state.is_unfinished() && e.fingerprint == sim_core::FINGERPRINT;
    let taken = experiments.iter().filter(takes_memory);
    let in_use = taken.map(|e| memory::estimate(&e.config_json, e.genotype_len)).sum();
    let needed = memory::estimate(&new.config.to_canonical_json(), new.genotype_len as u64);
    Shortage::check(needed, in_use, memory_budget).err()
}

/// Looks for an experiment of the same bits that can go on: one that is
/// unfinished, or one that was asked for fewer generations.
fn resume(
    store: &mut Store,
    experiments: &[ExperimentRecord],
    new: &NewExperiment,
    shortage: Option<Shortage>,
) -> Result<Option<Placement>, StoreError> {
    let config_json = new.config.to_canonical_json();
    // The digest tells versions of the simulation apart.
    let config_digest = new.config_digest.to_string();
    let same_bits = experiments.iter().rev().filter(|e| e.config_digest == config_digest);
    let is_unfinished = |e: &&ExperimentRecord| e.state.is_unfinished();
    let mut unfinished = same_bits.clone().filter(is_unfinished);
    if let Some(same) = unfinished.find(|e| e.config_json == config_json) {
        return Ok(Some(Placement::RunsAlready(same.id)));
    }
    for experiment in same_bits {
        let n_done = experiment.latest.as_ref().map_or(0, |latest| latest.generation + 1);
        let can_go_on = experiment.state == ExperimentState::Completed
            && experiment.reason.is_empty()
            && n_done < new.config.algorithm.generations
            && differs_in_generations_only(&experiment.config_json, &new.config);
        if !can_go_on {
            continue;
        }
        match reopened(store, experiment.id, &config_json) {
            Ok(_) if let Some(shortage) = shortage => {
                return Ok(Some(Placement::NoMemory(shortage)));
            }
            Ok(runnable) => {
                store.reopen(experiment.id, &config_json, clock::unix_ms())?;
                return Ok(Some(Placement::Runs(Box::new(runnable))));
            }
            // It is computed anew instead.
            Err(error @ StoreError::Unsound { .. }) => {
                warn!("{error}; a new experiment begins in its place");
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// A completed experiment under a configuration that asks for more generations.
fn reopened(store: &Store, id: ExperimentId, config_json: &str) -> Result<Runnable, StoreError> {
    let (experiment, checkpoint) = store.resumable(id)?;
    let experiment = ExperimentRecord { config_json: config_json.to_owned(), ..experiment };
    Runnable::restore(&experiment, &checkpoint).map_err(|what| store.unsound(id, what))
}

fn differs_in_generations_only(config_json: &str, config: &ExperimentConfig) -> bool {
    ExperimentConfig::from_json(config_json, "", ALGORITHMS).is_ok_and(|(mut other, _)| {
        other.algorithm.generations = config.algorithm.generations;
        other == *config
    })
}
