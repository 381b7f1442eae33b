//! Sends and receives bundles in pieces, because a bundle is larger than the limit of a message.

use std::pin::Pin;

use bundle::{BundleError, LEN_MAX};
use model::queries::StoredBundle;
use swarm_proto::v1::{ExportExperimentResponse, ImportExperimentRequest};
use tokio::{
    sync::{OwnedSemaphorePermit, mpsc},
    time::timeout,
};
use tokio_stream::{Stream, wrappers::ReceiverStream};
use tonic::{Status, Streaming};

use crate::limits::WATCH_PATIENCE;

/// Bytes of a bundle in one message.
const PIECE_LEN: usize = 1 << 20;

/// A bundle on its way to a client.
pub type Pieces = Pin<Box<dyn Stream<Item = Result<ExportExperimentResponse, Status>> + Send>>;

/// Packs a bundle; CPU-bound.
pub fn pack(stored: StoredBundle) -> Result<Vec<u8>, Status> {
    let bytes = stored.bundle()?.to_bytes();
    bytes.map_err(|error| Status::failed_precondition(error.to_string()))
}

/// Sends a bundle. `place`: kept until the end, so that few bundles are in memory.
pub fn send(bytes: Vec<u8>, place: OwnedSemaphorePermit) -> Pieces {
    let (outbox, inbox) = mpsc::channel(1);
    tokio::spawn(async move {
        let _place = place;
        for piece in bytes.chunks(PIECE_LEN) {
            let message = Ok(ExportExperimentResponse { piece: piece.to_vec() });
            // A client that stops reading holds memory.
            if !matches!(timeout(WATCH_PATIENCE, outbox.send(message)).await, Ok(Ok(()))) {
                return;
            }
        }
    });
    Box::pin(ReceiverStream::new(inbox))
}

/// Receives a bundle.
pub async fn receive(mut pieces: Streaming<ImportExperimentRequest>) -> Result<Vec<u8>, Status> {
    let mut bytes = Vec::new();
    loop {
        let next = timeout(WATCH_PATIENCE, pieces.message()).await;
        let next = next.map_err(|_| Status::aborted("the client does not send; try again"))??;
        let Some(ImportExperimentRequest { piece }) = next else { return Ok(bytes) };
        let len = (bytes.len() + piece.len()) as u64;
        if len > LEN_MAX {
            return Err(Status::invalid_argument(BundleError::TooLong { len }.to_string()));
        }
        bytes.extend(piece);
    }
}
