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
    store::{ExperimentRecord, ExperimentState, ForkRecord, NewExperiment, Store, StoreError},
};

use super::{ControlError, reopen};

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

/// What of an existing experiment a submission may lead to.
#[derive(Debug, Clone, Copy, Default)]
pub struct Existing {
    /// One of the same bits that can go on.
    pub resume_unfinished: bool,
    /// One of the same bits that has completed.
    pub reuse: bool,
}

/// Stores a submission, or finds the experiment that it stands for: the one of the same
/// request, or, as `existing` says, one of the same bits. `memory_budget`: bytes that
/// all unfinished experiments may take together, whether they run or wait. Returns an identical
/// experiment, too, if there was one.
pub fn place(
    store: &mut Store,
    new: NewExperiment,
    existing: Existing,
    memory_budget: u64,
) -> Result<(Placement, Option<ExperimentId>), StoreError> {
    let experiments = store.experiments()?;
    let identical = identical(&experiments, &new);
    let completed = identical.filter(|same| same.state == ExperimentState::Completed);
    let placement = match completed {
        Some(completed) if existing.reuse => Placement::RunsAlready(completed.id),
        _ => place_beside(store, &experiments, &new, existing.resume_unfinished, memory_budget)?,
    };
    Ok((placement, identical.map(|same| same.id)))
}

fn place_beside(
    store: &mut Store,
    experiments: &[ExperimentRecord],
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
    let shortage = shortage(experiments, &config_json, new.genotype_len as u64, memory_budget);
    if resume_unfinished && let Some(placement) = resume(store, experiments, new, shortage)? {
        return Ok(placement);
    }
    if are_too_many(experiments) {
        return Ok(Placement::TooMany);
    }
    if let Some(shortage) = shortage {
        return Ok(Placement::NoMemory(shortage));
    }
    let (id, is_new) = store.create(new, clock::unix_ms())?;
    Ok(if is_new {
        let genotype_len = new.genotype_len as u64;
        // Those that a fork shares with its parent.
        let latest = store.experiment(id)?.and_then(|stored| stored.latest);
        let runnable = Runnable::new(id, new.config.clone(), genotype_len, new.priority);
        Placement::Runs(Box::new(Runnable { latest, ..runnable }))
    } else {
        Placement::RunsAlready(id)
    })
}

/// An experiment of the same file, but for its name, of the same seed and version, and from the
/// same state: the latest that has completed, or else the latest that has not ended.
fn identical<'a>(
    experiments: &'a [ExperimentRecord],
    new: &NewExperiment,
) -> Option<&'a ExperimentRecord> {
    // The digest tells versions of the simulation apart.
    let config_digest = new.config_digest.to_string();
    let link = |fork: &Option<ForkRecord>| fork.as_ref().map(|fork| fork.link.clone());
    let is_same = |it: &&ExperimentRecord| {
        it.config_digest == config_digest
            && link(&it.fork) == link(&new.fork)
            && differs_in_name_only(&it.config_json, &new.config)
    };
    let same = || experiments.iter().rev().filter(is_same);
    let completed = same().find(|it| it.state == ExperimentState::Completed);
    completed.or_else(|| same().find(|it| it.state.is_unfinished()))
}

fn differs_in_name_only(config_json: &str, config: &ExperimentConfig) -> bool {
    ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .is_ok_and(|(other, _)| ExperimentConfig { name: config.name.clone(), ..other } == *config)
}

/// Whether an experiment can become unfinished beside those that are; else why not.
pub fn check_room(
    experiments: &[ExperimentRecord],
    config_json: &str,
    genotype_len: u64,
    memory_budget: u64,
) -> Result<(), ControlError> {
    if are_too_many(experiments) {
        return Err(ControlError::TooManyUnfinished);
    }
    match shortage(experiments, config_json, genotype_len, memory_budget) {
        Some(shortage) => Err(ControlError::NoMemory(shortage)),
        None => Ok(()),
    }
}

fn are_too_many(experiments: &[ExperimentRecord]) -> bool {
    let n_unfinished = experiments.iter().filter(|e| e.state.is_unfinished()).count();
    n_unfinished >= UNFINISHED_MAX
}

/// Why there is no memory for another experiment, if there is none.
fn shortage(
    experiments: &[ExperimentRecord],
    config_json: &str,
    genotype_len: u64,
    memory_budget: u64,
) -> Option<Shortage> {
    // One of another release does not run.
    let takes_memory =
        |e: &&ExperimentRecord| e.state.is_unfinished() && e.fingerprint == sim_core::FINGERPRINT;
    let taken = experiments.iter().filter(takes_memory);
    let in_use = taken.map(|e| memory::estimate(&e.config_json, e.genotype_len)).sum();
    let needed = memory::estimate(config_json, genotype_len);
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
    // A fork has other bits than an experiment that begins with its file.
    let is_same = |e: &&ExperimentRecord| e.config_digest == config_digest && e.fork.is_none();
    let same_bits = experiments.iter().rev().filter(is_same);
    let is_unfinished = |e: &&ExperimentRecord| e.state.is_unfinished();
    let mut unfinished = same_bits.clone().filter(is_unfinished);
    if let Some(same) = unfinished.find(|e| e.config_json == config_json) {
        return Ok(Some(Placement::RunsAlready(same.id)));
    }
    for experiment in same_bits {
        let n_done = experiment.latest.as_ref().map_or(0, |latest| latest.generation + 1);
        let can_go_on = experiment.can_be_continued()
            && n_done < new.config.algorithm.generations
            && differs_in_generations_only(&experiment.config_json, &new.config);
        if !can_go_on {
            continue;
        }
        match reopen::runnable(store, experiment.id, &config_json) {
            Ok(_) if let Some(shortage) = shortage => {
                return Ok(Some(Placement::NoMemory(shortage)));
            }
            Ok(runnable) => {
                let (completed, why) = (ExperimentState::Completed, "more generations");
                store.reopen(experiment.id, completed, &config_json, why, clock::unix_ms())?;
                return Ok(Some(Placement::Runs(Box::new(runnable))));
            }
            // It is computed anew instead.
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
