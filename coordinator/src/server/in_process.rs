//! Serves a data directory within this process, with the services of a coordinator.

use std::{
    net::Ipv4Addr,
    path::{Path, PathBuf},
    time::Duration,
};

use tokio::task;

use super::{CoordinatorConfig, Door, StartError, core::Core, open};
use crate::{
    shared_store::SharedStore,
    store::{self, Holder, Store},
};

/// Interval between looks at a database that another program may write to.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// The services of a coordinator on a data directory, for this process only, without listeners
/// and workers.
#[derive(Debug)]
pub struct InProcess {
    data_dir: PathBuf,
    core: Core,
    door: Door,
}

impl InProcess {
    /// Opens the database to read it, whether or not another program uses it.
    pub async fn read(data_dir: &Path) -> Result<Self, StartError> {
        let path = data_dir.to_owned();
        let opening = task::spawn_blocking(move || Store::open_read_only(&path));
        let store = SharedStore::new(opening.await.map_err(|_| StartError::Panicked)??);
        store.look_every(LOOK_EVERY);
        Self::on(data_dir, store).await
    }

    /// Opens the database to change it, which no other program may do meanwhile.
    pub async fn write(data_dir: &Path) -> Result<Self, StartError> {
        Self::on(data_dir, open(data_dir.to_owned()).await?).await
    }

    async fn on(data_dir: &Path, store: SharedStore) -> Result<Self, StartError> {
        let listen = (Ipv4Addr::LOCALHOST, 0).into();
        let config = CoordinatorConfig {
            // Callers in this process have full access already.
            memory_budget: u64::MAX,
            ..CoordinatorConfig::new(listen, data_dir.into())
        };
        let mut core = Core::start(store, &config).await?;
        let door = core.open_door();
        Ok(Self { data_dir: data_dir.into(), core, door })
    }

    /// The door to its services.
    pub fn door(&self) -> &Door {
        &self.door
    }

    /// The other program that may write to the database and computes its unfinished experiments.
    pub async fn holder(&self) -> Option<Holder> {
        let path = self.data_dir.clone();
        task::spawn_blocking(move || store::holder(&path)).await.ok().flatten()
    }

    /// Stops, after writes in progress.
    pub async fn shutdown(mut self) {
        self.core.stop().await;
    }
}
