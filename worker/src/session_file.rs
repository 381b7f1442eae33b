//! A file that shows whether a worker has a session with its coordinator, for the health checks
//! of container engines.

use std::{
    fs::{self, File},
    future::Future,
    io,
    os::unix::fs::FileExt as _,
    path::{Path, PathBuf},
    pin::pin,
    time::Duration,
};

use tokio::time::{MissedTickBehavior, interval};
use tracing::warn;

/// Interval at which the file is written again.
const RENEWAL: Duration = Duration::from_secs(2);
/// Age above which the file's worker has stopped or hangs.
const AGE_MAX: Duration = Duration::from_secs(30);

/// A file that exists during a session, and is rewritten regularly.
#[derive(Debug)]
pub(crate) struct SessionFile(PathBuf);

/// Why a worker does not count as healthy.
#[derive(Debug, thiserror::Error)]
pub enum Unhealthy {
    /// The file does not exist.
    #[error(
        "the worker has no session with its coordinator ({} does not exist); its log says why",
        .0.display()
    )]
    NoSession(PathBuf),
    /// The file is too old.
    #[error(
        "the worker hangs or was killed: {} is {age_s} s old, although it is written every {} s",
        path.display(), RENEWAL.as_secs()
    )]
    Old {
        /// The file.
        path: PathBuf,
        /// Its age in seconds.
        age_s: u64,
    },
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

/// The text of a worker's session file, which names the session's coordinator.
pub fn health_check(path: &Path) -> Result<String, Unhealthy> {
    let error = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => Unhealthy::NoSession(path.into()),
        _ => Unhealthy::File { path: path.into(), source },
    };
    let session = fs::read_to_string(path).map_err(error)?;
    let written = fs::metadata(path).and_then(|metadata| metadata.modified()).map_err(error)?;
    // If the clock was set back, the file's date lies in the future.
    let age = written.elapsed().unwrap_or_else(|ahead| ahead.duration());
    if age > AGE_MAX {
        return Err(Unhealthy::Old { path: path.into(), age_s: age.as_secs() });
    }
    Ok(session.trim_end().to_owned())
}

impl SessionFile {
    /// Checks that the file can be written, and removes it: there is no session yet.
    pub(crate) fn new(path: PathBuf) -> io::Result<Self> {
        File::create(&path)?;
        fs::remove_file(&path)?;
        Ok(Self(path))
    }

    /// Keeps the file up to date during a session. The session's own task writes it, so the file
    /// of a hanging session grows old.
    pub(crate) async fn during<T>(&self, text: &str, session: impl Future<Output = T>) -> T {
        let line = format!("{text}\n");
        let write = |file: &File| file.write_all_at(line.as_bytes(), 0);
        let file = File::create(&self.0).and_then(|file| write(&file).map(|()| file));
        let file =
            file.inspect_err(|error| warn!("cannot write {}: {error}", self.0.display())).ok();
        let mut session = pin!(session);
        let mut renewal = interval(RENEWAL);
        renewal.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let ended = loop {
            tokio::select! {
                biased;
                ended = &mut session => break ended,
                _ = renewal.tick() => if let Some(file) = &file {
                    // A file that cannot be written grows old, which the health check notices.
                    let _ = write(file);
                },
            }
        };
        let _ = fs::remove_file(&self.0);
        ended
    }
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use tempfile::TempDir;

    use super::*;

    fn place() -> (TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("session");
        (directory, path)
    }

    /// Waits until the file has been written.
    async fn written(path: &Path) {
        while !health_check(path).is_ok_and(|session| session == "worker 1 of x") {
            tokio::time::sleep(RENEWAL / 100).await;
        }
    }

    #[tokio::test]
    async fn the_file_exists_during_a_session() {
        let (_directory, path) = place();
        fs::write(&path, "left by a killed worker").unwrap();
        let file = SessionFile::new(path.clone()).unwrap();
        assert!(matches!(health_check(&path), Err(Unhealthy::NoSession(_))));
        for _session in 0..2 {
            file.during("worker 1 of x", written(&path)).await;
            assert!(matches!(health_check(&path), Err(Unhealthy::NoSession(_))));
        }
    }

    #[tokio::test]
    async fn a_file_that_is_no_longer_written_is_old() {
        let (_directory, path) = place();
        let file = SessionFile::new(path.clone()).unwrap();
        let session = async {
            written(&path).await;
            // The file is not written again before this task waits again.
            let long_ago = SystemTime::UNIX_EPOCH;
            File::options().write(true).open(&path).unwrap().set_modified(long_ago).unwrap();
            let error = health_check(&path).unwrap_err();
            assert!(matches!(error, Unhealthy::Old { .. }), "{error}");
            written(&path).await;
        };
        file.during("worker 1 of x", session).await;
    }

    #[test]
    fn a_file_that_cannot_be_written_is_noticed_at_the_start() {
        let (_directory, path) = place();
        assert!(SessionFile::new(path.join("below")).is_err());
    }
}
