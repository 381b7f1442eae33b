//! Decides which experiment a submission leads to: a new one, the one of the same request, or an
//! identical one that can continue.

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use tracing::warn;

use crate::{
    clock,
    ids::ExperimentId,
    limits::UNFINISHED_MAX,
    memory::Shortage,
    runs::Runnable,
    store::{
        ExperimentRecord, ExperimentState, Filter, ForkRecord, NewExperiment, Store, StoreError,
        StoredExperiment, Summary,
    },
};

use super::{capacity::shortage, reopen};

/// The experiment that a submission leads to.
pub enum Placement {
    /// An experiment that the driver has to run.
    Runs(Box<Runnable>),
    /// An experiment that the driver knows, or that has ended.
    RunsAlready(ExperimentId),
    /// Too many experiments are unfinished.
    TooMany,
    /// Unfinished experiments leave too little memory.
    NoMemory(Shortage),
}

/// How existing experiments may satisfy a submission.
#[derive(Debug, Clone, Copy, Default)]
pub struct Existing {
    /// Whether an identical experiment that can continue satisfies it.
    pub resume_unfinished: bool,
    /// Whether an identical experiment that has completed satisfies it.
    pub reuse: bool,
}

/// Stores a submission, or finds the experiment that satisfies it: the one of the same request,
/// or, if `existing` allows it, an identical one. `memory_budget`: bytes of memory for all
/// unfinished experiments together, running or waiting. Also returns an identical experiment, if
/// one existed.
pub fn place(
    store: &mut Store,
    new: NewExperiment,
    existing: Existing,
    memory_budget: u64,
) -> Result<(Placement, Option<ExperimentId>), StoreError> {
    let identical = identical(store, &new)?;
    let completed = identical.as_ref().filter(|same| same.state == ExperimentState::Completed);
    let placement = match completed {
        Some(completed) if existing.reuse => Placement::RunsAlready(completed.id),
        _ => place_beside(store, &new, existing.resume_unfinished, memory_budget)?,
    };
    Ok((placement, identical.map(|same| same.id)))
}

fn place_beside(
    store: &mut Store,
    new: &NewExperiment,
    resume_unfinished: bool,
    memory_budget: u64,
) -> Result<Placement, StoreError> {
    if let Some(request_id) = &new.request_id
        && let Some(id) = store.experiment_of_request(request_id)?
    {
        return Ok(Placement::RunsAlready(id));
    }
    let config_json = new.config.to_canonical_json();
    let unfinished = store.experiments(&Filter::unfinished())?;
    let summary = Summary::from_config(&new.config, &config_json);
    let shortage = shortage(&unfinished, &summary, new.genotype_len as u64, memory_budget);
    if resume_unfinished && let Some(placement) = resume(store, new, &config_json, shortage)? {
        return Ok(placement);
    }
    if unfinished.len() >= UNFINISHED_MAX {
        return Ok(Placement::TooMany);
    }
    if let Some(shortage) = shortage {
        return Ok(Placement::NoMemory(shortage));
    }
    let (id, is_new) = store.create(new, clock::unix_ms())?;
    Ok(if is_new {
        let genotype_len = new.genotype_len as u64;
        // A new fork has the generations that it shares with its parent.
        let latest = store.experiment(id)?.and_then(|stored| stored.record.latest);
        let runnable = Runnable::new(id, new.config.clone(), genotype_len, new.priority);
        Placement::Runs(Box::new(Runnable { latest, ..runnable }))
    } else {
        Placement::RunsAlready(id)
    })
}

/// An experiment with the same file except the name, the same seed and version, and the same
/// first state: the latest that has completed, or else the latest that has not ended.
fn identical(store: &Store, new: &NewExperiment) -> Result<Option<ExperimentRecord>, StoreError> {
    let link = |fork: &Option<ForkRecord>| fork.as_ref().map(|fork| fork.link.clone());
    let mut same = of_the_same_digest(store, new)?;
    same.retain(|found| {
        link(&found.fork) == link(&new.fork)
            && differs_in_name_only(&found.config_json, &new.config)
    });
    let completed = same.iter().position(|found| found.state == ExperimentState::Completed);
    let found = completed.or_else(|| same.iter().position(|found| found.state.is_unfinished()));
    Ok(found.map(|i| same.swap_remove(i).record))
}

/// The experiments of the same file, version and seed, of any length; the latest first.
fn of_the_same_digest(
    store: &Store,
    new: &NewExperiment,
) -> Result<Vec<StoredExperiment>, StoreError> {
    // The digest tells versions of the simulation apart.
    let config_digest = Some(new.config_digest.to_string());
    let found = store.experiments(&Filter { config_digest, ..Filter::default() })?;
    let stored = found.iter().rev().map(|found| store.experiment(found.id));
    Ok(stored.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

fn differs_in_name_only(config_json: &str, config: &ExperimentConfig) -> bool {
    ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .is_ok_and(|(other, _)| ExperimentConfig { name: config.name.clone(), ..other } == *config)
}

/// Looks for an identical experiment that can continue: an unfinished one, or one without a group
/// and with fewer generations.
fn resume(
    store: &mut Store,
    new: &NewExperiment,
    config_json: &str,
    shortage: Option<Shortage>,
) -> Result<Option<Placement>, StoreError> {
    let mut same_bits = of_the_same_digest(store, new)?;
    // A fork computes other bits than an experiment that starts from the same file.
    same_bits.retain(|found| found.fork.is_none());
    let mut unfinished = same_bits.iter().filter(|found| found.state.is_unfinished());
    if let Some(same) = unfinished.find(|found| found.config_json == config_json) {
        return Ok(Some(Placement::RunsAlready(same.id)));
    }
    for experiment in same_bits {
        // The runs of a group are compared with each other, so all keep their length.
        let can_go_on = experiment.membership.is_none()
            && experiment.can_be_continued()
            && experiment.n_generations() < new.config.algorithm.generations
            && differs_in_generations_only(&experiment.config_json, &new.config);
        if !can_go_on {
            continue;
        }
        match reopen::runnable(store, experiment.id, config_json) {
            Ok(_) if let Some(shortage) = shortage => {
                return Ok(Some(Placement::NoMemory(shortage)));
            }
            Ok(runnable) => {
                let (completed, why) = (ExperimentState::Completed, "more generations");
                store.reopen(experiment.id, completed, config_json, why, clock::unix_ms())?;
                return Ok(Some(Placement::Runs(Box::new(runnable))));
            }
            // A new experiment computes it instead.
            Err(error @ (StoreError::Unsound { .. } | StoreError::NoCheckpoint(_))) => {
                warn!("{error}; a new experiment begins in its place");
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

fn differs_in_generations_only(config_json: &str, config: &ExperimentConfig) -> bool {
    ExperimentConfig::from_json(config_json, "", ALGORITHMS).is_ok_and(|(mut other, _)| {
        other.algorithm.generations = config.algorithm.generations;
        other == *config
    })
}
