//! The fitness log, read from the database of a data directory without the genotypes.

use std::path::Path;

use evolution::Told;
use model::{ids::ExperimentId, store::Store};
use numpy::PyArray2;
use pyo3::{exceptions::PyOSError, prelude::*};

use crate::running::guarded;

/// The fitness `[P, T]` of at most `limit` generations from `first` on; none for missing
/// generations.
#[pyfunction]
pub fn fitness_log<'py>(
    py: Python<'py>,
    directory: &str,
    experiment: u64,
    first: u64,
    limit: u32,
) -> PyResult<Vec<Option<Bound<'py, PyArray2<f64>>>>> {
    let read = guarded(py, || {
        let store = Store::open_read_only(Path::new(directory))?;
        let entries = store.fitness_log(ExperimentId(experiment), first, limit)?;
        let told = |entry: Vec<u8>| Told::from_bytes(&entry).ok().map(|told| told.trial_fitness);
        Ok(entries.into_iter().map(|entry| entry.and_then(told)).collect::<Vec<_>>())
    })?;
    let read =
        read.map_err(|error: model::store::StoreError| PyOSError::new_err(error.to_string()))?;
    let array = |fitness: Vec<Vec<f64>>| PyArray2::from_vec2(py, &fitness);
    read.into_iter().map(|fitness| Ok(fitness.map(array).transpose()?)).collect()
}
