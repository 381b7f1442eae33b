//! The services of a coordinator in this process.

use std::{ffi::OsString, process::ExitCode};

use coordinator::StartError;
pub use coordinator::{Door, InProcess};

use crate::error::Error;

/// A program, as a function of its command line.
pub type Program = fn(Vec<OsString>) -> ExitCode;

/// The other programs in this one. `run` needs the code of coordinator and worker anyway, so a
/// release is one file with three names.
pub const PROGRAMS: [(&str, Program); 2] =
    [("coordinator", coordinator::program::main), ("worker", worker::program::main)];

impl From<StartError> for Error {
    fn from(error: StartError) -> Self {
        Self::Input(error.to_string())
    }
}

/// The error of opening a data directory to read it.
pub fn refused(error: StartError) -> Error {
    match error {
        StartError::Store(error) => Error::from_store(&error),
        error => error.into(),
    }
}

/// Evaluates items for the coordinator that has started this process, until standard input ends.
pub fn serve_referee() -> Result<(), Error> {
    coordinator::referee::serve_stdio().map_err(|error| Error::Internal(error.to_string()))
}
