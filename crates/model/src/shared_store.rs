//! The store for asynchronous code: operations run off the I/O threads, one at a time, and a
//! signal reports writes.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use tokio::{sync::watch, task, time};
use tokio_util::sync::CancellationToken;
use tracing::{error, info};

use crate::store::{Store, StoreError};

/// Pause before the second attempt to write; doubles with every further attempt.
const RETRY_DELAY_MIN: Duration = Duration::from_millis(250);
/// Longest pause between attempts.
const RETRY_DELAY_MAX: Duration = Duration::from_secs(5);

/// The failures of a write after which to try again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retry {
    /// Failures that pass once the disk accepts writes again.
    WhileUnavailable,
    /// All failures, because the program cannot continue without this write. Repairing the
    /// database lets it through.
    Always,
}

/// The outcome of a write.
#[derive(Debug)]
#[must_use]
pub enum Written {
    /// It is on disk.
    Yes,
    /// Nothing was written, because the experiment has ended or the coordinator stops; nothing is
    /// lost.
    NotWanted,
    /// It cannot be written, now or later.
    Never(StoreError),
}

/// Why a coordinator must no longer write to its database; the texts are for people.
#[derive(Debug, Clone)]
pub enum Unusable {
    /// Another coordinator has taken it over.
    TakenOver(String),
    /// It is damaged, and every write may make that worse.
    Damaged(String),
}

/// A store that many tasks share.
#[derive(Debug, Clone)]
pub struct SharedStore {
    store: Arc<Mutex<Store>>,
    /// Counts writes.
    news: Arc<watch::Sender<u64>>,
    /// Why the latest write failed, if it did.
    trouble: Arc<Mutex<Option<String>>>,
    /// Set once, when writes must stop.
    unusable: Arc<watch::Sender<Option<Unusable>>>,
}

impl SharedStore {
    /// Shares a store.
    pub fn new(store: Store) -> Self {
        Self {
            store: Arc::new(Mutex::new(store)),
            news: Arc::new(watch::Sender::new(0)),
            trouble: Arc::default(),
            unusable: Arc::default(),
        }
    }

    /// Reports news at this interval from now on, because another program may write to the
    /// database.
    pub fn look_every(&self, interval: Duration) {
        let news = Arc::downgrade(&self.news);
        tokio::spawn(async move {
            let mut looks = time::interval(interval);
            loop {
                looks.tick().await;
                let Some(news) = news.upgrade() else { return };
                news.send_modify(|count| *count += 1);
            }
        });
    }

    /// Waits until writes must stop; returns why.
    pub async fn unusable(&self) -> Unusable {
        let mut reason = self.unusable.subscribe();
        let reason = reason.wait_for(Option::is_some).await;
        reason.ok().and_then(|reason| reason.clone()).expect("this store has the sender")
    }

    /// Changes after each write.
    pub fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// Why the latest write failed, if it did.
    pub fn trouble(&self) -> Option<String> {
        self.trouble.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Runs a read operation.
    pub async fn read<T: Send + 'static>(
        &self,
        query: impl FnOnce(&Store) -> T + Send + 'static,
    ) -> T {
        self.call(|store| query(store)).await
    }

    /// Writes once; the caller handles failure.
    pub async fn try_write<T: Send + 'static>(
        &self,
        operation: impl FnOnce(&mut Store) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, StoreError> {
        let result = self.call(operation).await;
        let trouble = match &result {
            Err(error @ StoreError::Unavailable(_)) => Some(error.to_string()),
            Err(error @ StoreError::TakenOver { .. }) => {
                self.unusable.send_replace(Some(Unusable::TakenOver(error.to_string())));
                None
            }
            _ => None,
        };
        *self.trouble.lock().unwrap_or_else(PoisonError::into_inner) = trouble;
        self.news.send_modify(|count| *count += 1);
        result
    }

    async fn call<T: Send + 'static>(
        &self,
        operation: impl FnOnce(&mut Store) -> T + Send + 'static,
    ) -> T {
        let store = Arc::clone(&self.store);
        task::spawn_blocking(move || {
            // A panic inside rolls its transaction back, so the store stays usable.
            let mut store = store.lock().unwrap_or_else(PoisonError::into_inner);
            store.keep_up();
            operation(&mut store)
        })
        .await
        .expect("store operations do not panic")
    }

    /// Writes data that must not be lost; tries again without limit, as `retry` says. `what`: its
    /// name in the log.
    pub async fn write(
        &self,
        shutdown: &CancellationToken,
        what: &str,
        retry: Retry,
        operation: impl Fn(&mut Store) -> Result<(), StoreError> + Send + Sync + 'static,
    ) -> Written {
        let operation = Arc::new(operation);
        let mut delay = RETRY_DELAY_MIN;
        let mut has_failed = false;
        loop {
            let attempt = Arc::clone(&operation);
            match self.try_write(move |store| attempt(store)).await {
                Ok(()) if has_failed => {
                    info!("{what} is stored; the database takes writes again");
                    return Written::Yes;
                }
                Ok(()) => return Written::Yes,
                Err(StoreError::Ended(_) | StoreError::TakenOver { .. }) => {
                    return Written::NotWanted;
                }
                Err(error @ StoreError::Corrupt(_)) => {
                    self.unusable.send_replace(Some(Unusable::Damaged(error.to_string())));
                    return Written::NotWanted;
                }
                Err(error)
                    if retry == Retry::Always || matches!(error, StoreError::Unavailable(_)) =>
                {
                    has_failed = true;
                    error!("{what} waits: {error}; trying again in {} s", delay.as_secs_f64());
                    tokio::select! {
                        () = time::sleep(delay) => {}
                        () = shutdown.cancelled() => return Written::NotWanted,
                    }
                    delay = (2 * delay).min(RETRY_DELAY_MAX);
                }
                Err(error) => {
                    error!("{what} cannot be stored: {error}");
                    return Written::Never(error);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
