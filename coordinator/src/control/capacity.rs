//! Whether there is room for one more unfinished experiment.

use crate::{
    limits::UNFINISHED_MAX,
    memory::{self, Shortage},
    store::{ExperimentRecord, Filter, Store, Summary},
};

use super::ControlError;

/// Checks that there is room for one more unfinished experiment.
pub fn check_room(
    store: &Store,
    summary: &Summary,
    genotype_len: u64,
    memory_budget: u64,
) -> Result<(), ControlError> {
    let unfinished = store.experiments(&Filter::unfinished())?;
    if unfinished.len() >= UNFINISHED_MAX {
        return Err(ControlError::TooManyUnfinished);
    }
    match shortage(&unfinished, summary, genotype_len, memory_budget) {
        Some(shortage) => Err(ControlError::NoMemory(shortage)),
        None => Ok(()),
    }
}

/// The missing memory, if there is too little for another experiment.
pub fn shortage(
    unfinished: &[ExperimentRecord],
    summary: &Summary,
    genotype_len: u64,
    memory_budget: u64,
) -> Option<Shortage> {
    // An experiment of another release does not run.
    let taken = unfinished.iter().filter(|other| other.fingerprint == sim_core::FINGERPRINT);
    let in_use = taken.map(|other| memory::estimate(&other.summary, other.genotype_len)).sum();
    let needed = memory::estimate(summary, genotype_len);
    Shortage::check(needed, in_use, memory_budget).err()
}
