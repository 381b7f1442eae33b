//! Imports an experiment that another coordinator has computed.

use bundle::{Bundle, Sample, Verification};
use experiment_file::ExperimentConfig;
use tokio::sync::OwnedSemaphorePermit;

use crate::{
    clock,
    memory::{self, Shortage},
    store::{ExperimentRecord, ExperimentState, ForkRecord, Imported, Store, StoreError, Summary},
};

use super::{Control, ControlError};

impl Control {
    /// Imports the experiment of a bundle, after checking everything that follows from its
    /// fitness log. Returns the experiment, and whether the import created it. `place`: kept as
    /// long as the bundle takes memory, even if the client goes away.
    pub async fn import(
        &self,
        bytes: Vec<u8>,
        place: OwnedSemaphorePermit,
    ) -> Result<(ExperimentRecord, bool), ControlError> {
        let memory_budget = self.memory_budget;
        let checked =
            self.requests.check(self.client, move |_| (check(&bytes, memory_budget), place));
        let (imported, _place) = checked.await?;
        let imported = imported?;
        let write = move |store: &mut Store| {
            let Some(imported) = with_parent(store, imported)? else { return Ok(None) };
            store.import(&imported, clock::unix_ms()).map(Some)
        };
        let Some((id, is_new)) = self.store.try_write(write).await? else {
            return Err(ControlError::NoParent);
        };
        Ok((self.find(id).await?, is_new))
    }
}

/// Checks everything except the fitness itself; CPU-bound. `memory_budget`: bytes that the
/// repeated evolution may take.
fn check(bytes: &[u8], memory_budget: u64) -> Result<Imported, ControlError> {
    let invalid = |error: &dyn std::fmt::Display| ControlError::Invalid(error.to_string());
    let bundle = Bundle::read(bytes).map_err(|error| invalid(&error))?;
    let mut verification =
        Verification::begin(&bundle, Sample::Drawn(0)).map_err(|flaw| invalid(&flaw))?;
    let genotype_len = verification.simulation().genotype_len();
    let config = ExperimentConfig::from_canonical_json(&bundle.config_json)?;
    let summary = Summary::from_config(&config, &bundle.config_json);
    let needed = memory::estimate(&summary, genotype_len as u64);
    Shortage::check(needed, 0, memory_budget).map_err(ControlError::NoMemory)?;
    while verification.advance().map_err(|flaw| invalid(&flaw))?.is_some() {}
    let champion = verification.finish().champion;
    let state = ExperimentState::from_name(&bundle.manifest.state);
    let state = state.filter(|state| !state.is_unfinished());
    let state = state
        .ok_or_else(|| invalid(&"its manifest does not have the state of an ended experiment"))?;
    Ok(Imported { name: config.name, genotype_len, state, champion, fork: None, bundle })
}

/// Finds the parent of a fork; none if the store lacks it.
fn with_parent(store: &Store, imported: Imported) -> Result<Option<Imported>, StoreError> {
    let Some(fork) = imported.bundle.manifest.fork.clone() else { return Ok(Some(imported)) };
    let link = imported.bundle.history[fork.generation as usize].digest.to_string();
    let Some(parent) = store.experiment_with_link(fork.generation, &link)? else { return Ok(None) };
    let fork = ForkRecord {
        parent,
        generation: fork.generation,
        link: fork.link.to_string(),
        changes: fork.changes,
    };
    Ok(Some(Imported { fork: Some(fork), ..imported }))
}
