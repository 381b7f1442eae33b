//! SIGINT and SIGTERM: the first requests an orderly end, the second ends at once.

use std::process;

use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use crate::error::Error;

const EXIT_INTERRUPTED: i32 = 130;

/// A token that the first signal cancels; the second ends the process, which
/// loses nothing that is stored.
pub fn token() -> Result<CancellationToken, Error> {
    let listen = |kind| {
        signal(kind).map_err(|error| Error::Internal(format!("cannot listen for signals: {error}")))
    };
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    let token = CancellationToken::new();
    let cancelled = token.clone();
    tokio::spawn(async move {
        loop {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            if cancelled.is_cancelled() {
                process::exit(EXIT_INTERRUPTED);
            }
            cancelled.cancel();
        }
    });
    Ok(token)
}
