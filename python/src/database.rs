//! The database of a data directory, which answers like a coordinator.

use std::{
    path::Path,
    sync::{Mutex, PoisonError},
};

use model::queries::BlockingReader;
use pyo3::{exceptions::PyOSError, prelude::*};

use crate::{
    errors::{fork_error, refused},
    running::{Home, guarded},
};

/// A data directory, opened for reading only. A coordinator may use it meanwhile.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Database {
    reader: Mutex<BlockingReader>,
    home: Home,
}

#[pymethods]
impl Database {
    #[new]
    fn new(directory: &str) -> PyResult<Self> {
        let reader = BlockingReader::open(Path::new(directory));
        let reader = reader.map_err(|error| PyOSError::new_err(error.to_string()))?;
        Ok(Self { reader: Mutex::new(reader), home: Home::here() })
    }

    /// A reading call of `ExperimentService`, by its name, with encoded request and response.
    fn call(&self, py: Python<'_>, name: &str, request: &[u8]) -> PyResult<Vec<u8>> {
        if self.home.is_left() {
            return Err(fork_error(py, "a data directory is opened again after a fork"));
        }
        let answer = guarded(py, || {
            let reader = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
            reader.call(name, request)
        })?;
        answer.map_err(|status| refused(py, &status))
    }
}
