//! SIGINT and SIGTERM: the first signal requests an orderly end, the second ends the process at
//! once. If no code waits for an orderly end, the first signal ends the process at once.
//! Neither signal leaves unfinished files.

use std::{
    fs,
    future::pending,
    io,
    path::{Path, PathBuf},
    process,
    sync::{Mutex, MutexGuard, Once, OnceLock, PoisonError},
};

use tokio::{
    runtime::{Handle, RuntimeFlavor},
    signal::unix::{Signal, SignalKind, signal},
};
use tokio_util::sync::CancellationToken;

use crate::error::Error;

const EXIT_INTERRUPTED: i32 = 130;

/// The token, once the program listens for signals.
static TOKEN: OnceLock<CancellationToken> = OnceLock::new();
/// What an interrupt leaves of the requested changes; none: no change was requested.
static REMAINS: Mutex<Option<String>> = Mutex::new(None);

/// Unfinished files and directories, to be removed.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file or directory that a signal removes, until this is dropped.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Creates and registers a file or directory before a signal can be handled.
    pub fn make<T>(
        make: impl FnOnce() -> io::Result<T>,
        path: impl FnOnce(&T) -> &Path,
    ) -> io::Result<(T, Self)> {
        listen_for_the_end();
        let mut all = unfinished();
        let made = make()?;
        let path = path(&made).to_owned();
        all.push(path.clone());
        Ok((made, Self(path)))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the process at once, and removes unfinished files. The lock prevents new
/// unfinished files meanwhile.
fn end() -> ! {
    let all = unfinished();
    for path in all.iter() {
        // Files that cannot be removed stay.
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    process::exit(EXIT_INTERRUPTED)
}

/// Makes the first signal end the process like [`end`], unless code waits for an orderly end.
fn listen_for_the_end() {
    static ONCE: Once = Once::new();
    // Without a runtime, no command runs. A runtime of one thread handles no signal while that
    // thread computes.
    let runtime = Handle::try_current();
    let runtime =
        runtime.ok().filter(|runtime| runtime.runtime_flavor() != RuntimeFlavor::CurrentThread);
    if let (None, Some(runtime)) = (TOKEN.get(), runtime) {
        ONCE.call_once(|| {
            let _entered = runtime.enter();
            // If signals cannot be handled, they end the process by themselves.
            if let Ok(mut signals) = Signals::listen() {
                runtime.spawn(async move {
                    signals.next().await;
                    if TOKEN.get().is_none() {
                        end();
                    }
                });
            }
        });
    }
}

/// Signals that request an end.
struct Signals {
    interrupt: Signal,
    terminate: Signal,
}

impl Signals {
    fn listen() -> io::Result<Self> {
        let interrupt = signal(SignalKind::interrupt())?;
        Ok(Self { interrupt, terminate: signal(SignalKind::terminate())? })
    }

    async fn next(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }
}

/// Whether no signal has come, for work that checks for interrupts itself. Until the program
/// listens for signals, they end the process.
pub fn goes_on() -> bool {
    TOKEN.get().is_none_or(|token| !token.is_cancelled())
}

/// Waits for the first signal. Waits for ever if the program does not listen for signals, because
/// then they end the process.
pub async fn came() {
    match TOKEN.get() {
        Some(token) => token.cancelled().await,
        None => pending().await,
    }
}

/// Remembers that a change is on its way. `remains`: what an interrupt leaves of it.
pub fn changing(remains: String) {
    *REMAINS.lock().unwrap_or_else(PoisonError::into_inner) = Some(remains);
}

/// The error of an interrupted command.
pub fn error() -> Error {
    let remains = REMAINS.lock().unwrap_or_else(PoisonError::into_inner).clone();
    Error::Interrupted(remains.unwrap_or_else(|| "nothing was changed".to_owned()))
}

/// A token that the first signal cancels; the second ends the process, without a loss of
/// stored data.
pub fn token() -> Result<CancellationToken, Error> {
    let mut signals = Signals::listen()
        .map_err(|error| Error::Internal(format!("cannot listen for signals: {error}")))?;
    let token = TOKEN.get_or_init(CancellationToken::new).clone();
    let cancelled = token.clone();
    tokio::spawn(async move {
        loop {
            signals.next().await;
            if cancelled.is_cancelled() {
                end();
            }
            cancelled.cancel();
        }
    });
    Ok(token)
}
