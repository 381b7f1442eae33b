//! Follows an experiment's events until it ends.

use tokio::sync::mpsc::{self, error::SendTimeoutError};
use tokio_util::sync::CancellationToken;
use tracing::info;

use crate::{
    ids::ExperimentId,
    limits::{EVENT_PAGE_LEN, WATCH_PATIENCE, WATCH_QUEUE_LEN},
    shared_store::SharedStore,
    store::{Event, Store, StoreError},
};

/// Why a stream of events ends before its experiment does.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// The client read too slowly.
    #[error("events were not read for {} s; resume from sequence {next}", WATCH_PATIENCE.as_secs())]
    TooSlow {
        /// Sequence number of the first event that was not sent.
        next: u64,
    },
    /// The coordinator stops.
    #[error("the coordinator is shutting down")]
    ShuttingDown,
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Sends an experiment's events from `from_sequence` on, past ones first, and ends after the
/// event that ends the experiment. Dropping the receiver also ends it.
pub fn follow(
    store: SharedStore,
    shutdown: CancellationToken,
    id: ExperimentId,
    from_sequence: u64,
) -> mpsc::Receiver<Result<Event, WatchError>> {
    let (outbox, inbox) = mpsc::channel(WATCH_QUEUE_LEN + 1);
    // Reserved, so that there is always room for the error that ends the stream.
    let final_slot = outbox.clone().try_reserve_owned().expect("a new channel has room");
    tokio::spawn(async move {
        let error = tokio::select! {
            () = shutdown.cancelled() => WatchError::ShuttingDown,
            () = outbox.closed() => return,
            result = send_all(&store, id, from_sequence.max(1), &outbox) => match result {
                Ok(()) => return,
                Err(error) => error,
            },
        };
        final_slot.send(Err(error));
    });
    inbox
}

async fn send_all(
    store: &SharedStore,
    id: ExperimentId,
    mut next: u64,
    outbox: &mpsc::Sender<Result<Event, WatchError>>,
) -> Result<(), WatchError> {
    let mut news = store.news();
    loop {
        news.mark_unchanged();
        let (page, is_over) = store.read(move |store| page(store, id, next)).await?;
        let is_full = page.len() == EVENT_PAGE_LEN as usize;
        for event in page {
            let sequence = event.sequence;
            match outbox.send_timeout(Ok(event), WATCH_PATIENCE).await {
                Ok(()) => next = sequence + 1,
                Err(SendTimeoutError::Closed(_)) => return Ok(()),
                Err(SendTimeoutError::Timeout(_)) => {
                    info!(experiment = %id, sequence, "a watcher is too slow and dropped");
                    return Err(WatchError::TooSlow { next });
                }
            }
        }
        if !is_full && is_over {
            return Ok(());
        }
        if !is_full && news.changed().await.is_err() {
            return Err(WatchError::ShuttingDown);
        }
    }
}

/// The next events, and whether the experiment has ended.
fn page(store: &Store, id: ExperimentId, next: u64) -> Result<(Vec<Event>, bool), StoreError> {
    let experiment = store.experiment(id)?;
    let is_over = experiment.is_none_or(|experiment| !experiment.state.is_unfinished());
    Ok((store.events(id, next, EVENT_PAGE_LEN)?, is_over))
}
