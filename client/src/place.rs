//! The place of experiments: a coordinator, or a data directory.

use std::{
    env,
    net::SocketAddr,
    path::{Path, PathBuf},
    time::Duration,
};

use model::store;
use tokio::{net::TcpStream, time::timeout};

use crate::{
    defaults::{DEFAULT_DATA_DIR, DEFAULT_LISTEN},
    error::{Code, Error},
    settings::{COORDINATOR_VARIABLE, Settings},
};

/// The environment variable that names the data directory.
const DATA_DIR_VARIABLE: &str = "SWARM_DATA_DIR";
/// Time limit for an answer at the default address.
const ANSWER_TIME: Duration = Duration::from_millis(300);

/// The kind of access of a command to experiments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Intent {
    /// It reads experiments; another program may use the data directory meanwhile.
    Read,
    /// It changes stored experiments; no other program may use the data directory meanwhile.
    Change,
    /// It adds experiments; a missing data directory is created.
    Add,
    /// It continues experiments; this process computes those of a data directory.
    Continue,
    /// It adds experiments to compute; this process computes those of a data directory.
    Submit,
}

impl Intent {
    /// Whether experiments must be computed afterwards.
    pub fn computes(self) -> bool {
        matches!(self, Self::Continue | Self::Submit)
    }

    /// Refuses a data directory without a database, unless it will be created.
    pub fn check(self, data_dir: &Path) -> Result<(), Error> {
        match self {
            Self::Add | Self::Submit => Ok(()),
            Self::Read | Self::Change | Self::Continue => {
                store::must_be_in(data_dir).map_err(|error| Error::from_store(&error))
            }
        }
    }
}

/// A place of experiments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// At the coordinator of these settings.
    Coordinator(Settings),
    /// In a data directory. `is_found`: the default directory, which the user has not
    /// named.
    Directory { path: PathBuf, is_found: bool },
}

impl Place {
    /// Finds the place of experiments. The first of these counts: the command line, the
    /// environment, the settings file, a coordinator that listens at the default address, the
    /// default data directory if it exists.
    pub async fn find(settings: Settings) -> Result<Self, Error> {
        match Self::named(settings)? {
            Self::Coordinator(settings) if settings.coordinator.is_none() => {
                if store::is_in(Path::new(DEFAULT_DATA_DIR)) && !is_answered().await {
                    return Ok(Self::Directory { path: DEFAULT_DATA_DIR.into(), is_found: true });
                }
                Ok(Self::Coordinator(settings))
            }
            named => Ok(named),
        }
    }

    /// The place that the user has named; otherwise a coordinator without an address.
    fn named(mut settings: Settings) -> Result<Self, Error> {
        let directory = settings.data_dir.take();
        let directory = directory.map(|path| Self::Directory { path, is_found: false });
        if let Some(directory) = directory {
            let of_environment = env::var(COORDINATOR_VARIABLE).ok();
            return match settings.coordinator {
                Some(named) if Some(&named) != of_environment.as_ref() => Err(Error::at(
                    Code::BadArgument,
                    "--data-dir",
                    "give --coordinator or --data-dir: a command works in one place",
                )),
                _ => Ok(directory),
            };
        }
        let is_named = settings.has_coordinator();
        match env::var_os(DATA_DIR_VARIABLE).filter(|path| !path.is_empty() && !is_named) {
            Some(path) => Ok(Self::Directory { path: path.into(), is_found: false }),
            None => Ok(Self::Coordinator(settings.or_file()?)),
        }
    }
}

/// The data directory for commands that work on files only: from the command line, else the
/// environment, else the default.
pub fn data_dir(settings: &Settings) -> PathBuf {
    let named = settings.data_dir.clone();
    let of_environment =
        || env::var_os(DATA_DIR_VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from);
    named.or_else(of_environment).unwrap_or_else(|| DEFAULT_DATA_DIR.into())
}

/// Whether something listens at the default address.
async fn is_answered() -> bool {
    let connecting = TcpStream::connect(SocketAddr::from(DEFAULT_LISTEN));
    timeout(ANSWER_TIME, connecting).await.is_ok_and(|connected| connected.is_ok())
}
