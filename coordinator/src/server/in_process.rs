//! A data directory that this process asks as it would ask a coordinator.

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

/// How often the database is looked at that another program may write to.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// The services of a coordinator on a data directory, for this process alone. Nothing listens,
/// and there are no workers.
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
            // Whoever asks here owns the machine, too.
            memory_budget: u64::MAX,
            ..CoordinatorConfig::new(listen, data_dir.into())
        };
        let mut core = Core::start(store, &config).await?;
        let door = core.open_door();
        Ok(Self { data_dir: data_dir.into(), core, door })
    }

    /// The way to its services.
    pub fn door(&self) -> &Door {
        &self.door
    }

    /// The other program that may write to the database, and computes what is unfinished in it.
    pub async fn holder(&self) -> Option<Holder> {
        let path = self.data_dir.clone();
        task::spawn_blocking(move || store::holder(&path)).await.ok().flatten()
    }

    /// Stops: what is being stored is stored.
    pub async fn shutdown(mut self) {
        self.core.stop().await;
    }
}
