//! SIGINT and SIGTERM: the first requests an orderly end, the second ends at once.

use std::{
    process,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
};

use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use crate::error::Error;

const EXIT_INTERRUPTED: i32 = 130;

/// The token, once somebody listens for signals.
static TOKEN: OnceLock<CancellationToken> = OnceLock::new();
/// Whether an experiment may have reached a coordinator.
static SUBMITTED: AtomicBool = AtomicBool::new(false);

/// Whether no signal has come, for work that nothing else would end. While nobody listens for
/// signals, they end the process.
pub fn goes_on() -> bool {
    TOKEN.get().is_none_or(|token| !token.is_cancelled())
}

/// An experiment is on its way to a coordinator.
pub fn submitting() {
    SUBMITTED.store(true, Relaxed);
}

/// The error of who was interrupted.
pub fn error() -> Error {
    let what = if SUBMITTED.load(Relaxed) {
        "what was submitted continues on the coordinator"
    } else {
        "nothing was submitted"
    };
    Error::Interrupted(what.into())
}

/// A token that the first signal cancels; the second ends the process, which
/// loses nothing that is stored.
pub fn token() -> Result<CancellationToken, Error> {
    let listen = |kind| {
        signal(kind).map_err(|error| Error::Internal(format!("cannot listen for signals: {error}")))
    };
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    let token = TOKEN.get_or_init(CancellationToken::new).clone();
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
