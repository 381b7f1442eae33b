//! The database of a data directory: what a coordinator would answer.

use std::{
    path::Path,
    sync::{Mutex, PoisonError},
};

use coordinator::Offline;
use prost::Message;
use pyo3::{exceptions::PyOSError, prelude::*};
use swarm_proto::v1::ListExperimentsResponse;
use tonic::Status;

use crate::{errors::refused, running::guarded};

/// A data directory, which is only read. A coordinator may use it meanwhile.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Database(Mutex<Offline>);

#[pymethods]
impl Database {
    #[new]
    fn new(directory: &str) -> PyResult<Self> {
        let offline = Offline::open(Path::new(directory));
        offline
            .map(|it| Self(Mutex::new(it)))
            .map_err(|error| PyOSError::new_err(error.to_string()))
    }

    /// A reading call of `ExperimentService`, by its name: request and response as they travel.
    fn call(&self, py: Python<'_>, name: &str, request: &[u8]) -> PyResult<Vec<u8>> {
        let answer = guarded(py, || {
            let offline = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            match name {
                "GetExperiment" => answer(request, |request| offline.experiment(request)),
                "GetIndividuals" => answer(request, |request| offline.individuals(&request)),
                "GetLineage" => answer(request, |request| offline.lineage(&request)),
                "ListGenerations" => answer(request, |request| offline.generations(request)),
                "ListExperiments" => answer(request, |()| {
                    Ok(ListExperimentsResponse { experiments: offline.experiments()? })
                }),
                _ => Err(Status::unimplemented(format!("`{name}` needs a coordinator"))),
            }
        })?;
        answer.map_err(|status| refused(py, &status))
    }
}

fn answer<Request: Message + Default, Response: Message>(
    request: &[u8],
    ask: impl FnOnce(Request) -> Result<Response, Status>,
) -> Result<Vec<u8>, Status> {
    let request = Request::decode(request);
    let request = request.map_err(|error| Status::invalid_argument(error.to_string()))?;
    Ok(ask(request)?.encode_to_vec())
}
