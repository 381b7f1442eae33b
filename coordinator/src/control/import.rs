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
        let check =
            move |goes_on: &dyn Fn() -> bool| (check(&bytes, memory_budget, goes_on), place);
        let (imported, _place) = self.requests.check_at_length(self.client, check).await?;
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

/// Checks everything except the fitness itself; CPU-bound, for minutes if the evolution is large.
/// `memory_budget`: bytes that the repeated evolution may take. `goes_on`: asked before each
/// generation whether anybody still wants the result.
fn check(
    bytes: &[u8],
    memory_budget: u64,
    goes_on: &dyn Fn() -> bool,
) -> Result<Imported, ControlError> {
    let invalid = |error: &dyn std::fmt::Display| ControlError::Invalid(error.to_string());
    let bundle = Bundle::read(bytes).map_err(|error| invalid(&error))?;
    let mut verification =
        Verification::begin(&bundle, Sample::Drawn(0)).map_err(|flaw| invalid(&flaw))?;
    let genotype_len = verification.simulation().genotype_len();
    let config = ExperimentConfig::from_canonical_json(&bundle.config_json)?;
    let summary = Summary::from_config(&config, &bundle.config_json);
    let needed = memory::estimate(&summary, genotype_len as u64);
    Shortage::check(needed, 0, memory_budget).map_err(ControlError::NoMemory)?;
    loop {
        if !goes_on() {
            // A client that has left does not read this.
            return Err(ControlError::ShuttingDown);
        }
        if verification.advance().map_err(|flaw| invalid(&flaw))?.is_none() {
            break;
        }
    }
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

#[cfg(test)]
mod tests {
    use std::{cell::Cell, fs, sync::Arc, time::Duration};

    use tokio::{
        sync::{Semaphore, mpsc},
        task, time,
    };
    use tokio_util::sync::CancellationToken;

    use crate::shared_store::SharedStore;

    use super::*;

    /// A bundle of 650 generations.
    fn bundle() -> Vec<u8> {
        let path = "/../results/bundles/light_follower_snes-0.zip";
        fs::read(env!("CARGO_MANIFEST_DIR").to_owned() + path).unwrap()
    }

    fn control(directory: &tempfile::TempDir, shutdown: &CancellationToken) -> Control {
        let store = SharedStore::new(Store::open(directory.path()).unwrap());
        let (events, _) = mpsc::channel(1);
        Control::new(events, store, u64::MAX, shutdown.clone())
    }

    /// The only place for a bundle.
    async fn place(bundles: &Arc<Semaphore>) -> OwnedSemaphorePermit {
        Arc::clone(bundles).acquire_owned().await.unwrap()
    }

    #[test]
    fn a_check_asks_before_each_generation_whether_it_goes_on() {
        let n_asked = Cell::new(0);
        let goes_on = || {
            n_asked.set(n_asked.get() + 1);
            n_asked.get() < 3
        };
        let ended = check(&bundle(), u64::MAX, &goes_on);
        assert!(matches!(ended, Err(ControlError::ShuttingDown)));
        assert_eq!(n_asked.get(), 3);
    }

    #[tokio::test]
    async fn an_import_ends_when_the_coordinator_stops() {
        let (directory, shutdown) = (tempfile::tempdir().unwrap(), CancellationToken::new());
        let control = control(&directory, &shutdown);
        shutdown.cancel();
        let imported = control.import(bundle(), place(&Arc::new(Semaphore::new(1))).await).await;
        assert!(matches!(imported, Err(ControlError::ShuttingDown)), "{imported:?}");
    }

    #[tokio::test]
    async fn an_import_whose_client_has_left_soon_frees_its_place() {
        let directory = tempfile::tempdir().unwrap();
        let control = control(&directory, &CancellationToken::new());
        let bundles = Arc::new(Semaphore::new(1));
        let whole = task::spawn_blocking(|| check(&bundle(), u64::MAX, &|| true).map(|_| ()));
        let importing = control.import(bundle(), place(&bundles).await);
        time::timeout(Duration::from_millis(20), importing).await.unwrap_err();
        tokio::select! {
            biased;
            _ = whole => panic!("the import went on as long as one whose client waits"),
            _ = place(&bundles) => {}
        }
    }
}
