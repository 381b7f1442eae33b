//! The store as asynchronous code uses it: off the I/O threads, one at a time,
//! and with word to whoever waits for news.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use tokio::{sync::watch, task};
use tokio_util::sync::CancellationToken;
use tracing::error;

use crate::store::{Store, StoreError};

/// Pause between attempts to write while the disk does not take it.
const RETRY_INTERVAL: Duration = Duration::from_secs(5);

/// What became of a write.
#[derive(Debug)]
#[must_use]
pub enum Written {
    /// It is on disk.
    Yes,
    /// The experiment has ended, or the coordinator is shutting down: nothing is
    /// lost.
    NotWanted,
    /// It cannot be written, now or later.
    Never(StoreError),
}

/// A store that many tasks share.
#[derive(Debug, Clone)]
pub struct SharedStore {
    store: Arc<Mutex<Store>>,
    /// Counts writes.
    news: Arc<watch::Sender<u64>>,
}

impl SharedStore {
    /// Shares a store.
    pub fn new(store: Store) -> Self {
        Self { store: Arc::new(Mutex::new(store)), news: Arc::new(watch::Sender::new(0)) }
    }

    /// Changes whenever something has been written.
    pub fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// Reads.
    pub async fn read<T: Send + 'static>(
        &self,
        query: impl FnOnce(&mut Store) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, StoreError> {
        self.call(query).await
    }

    /// Writes once; the caller handles failure.
    pub async fn try_write<T: Send + 'static>(
        &self,
        operation: impl FnOnce(&mut Store) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, StoreError> {
        let result = self.call(operation).await;
        self.news.send_modify(|count| *count += 1);
        result
    }

    async fn call<T: Send + 'static>(
        &self,
        operation: impl FnOnce(&mut Store) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, StoreError> {
        let store = Arc::clone(&self.store);
        task::spawn_blocking(move || {
            // A panic inside rolls its transaction back: the store is still good.
            operation(&mut store.lock().unwrap_or_else(PoisonError::into_inner))
        })
        .await
        .expect("store operations do not panic")
    }

    /// Writes something that must not be lost: while the disk does not take it,
    /// tries again.
    pub async fn write(
        &self,
        shutdown: &CancellationToken,
        operation: impl Fn(&mut Store) -> Result<(), StoreError> + Send + Sync + 'static,
    ) -> Written {
        let operation = Arc::new(operation);
        loop {
            let attempt = Arc::clone(&operation);
            match self.try_write(move |store| attempt(store)).await {
                Ok(()) => return Written::Yes,
                Err(StoreError::Ended(_)) => return Written::NotWanted,
                Err(error @ StoreError::Unavailable(_)) => {
                    error!("{error}; trying again every {} s", RETRY_INTERVAL.as_secs());
                    tokio::select! {
                        () = tokio::time::sleep(RETRY_INTERVAL) => {}
                        () = shutdown.cancelled() => return Written::NotWanted,
                    }
                }
                Err(error) => {
                    error!("{error}");
                    return Written::Never(error);
                }
            }
        }
    }
}
