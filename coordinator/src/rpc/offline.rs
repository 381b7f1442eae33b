//! What a coordinator would answer about experiments, read from its database without one.

use std::path::Path;

use swarm_proto::v1::{
    Experiment, GetExperimentRequest, GetExperimentResponse, GetIndividualsRequest,
    GetIndividualsResponse, GetLineageRequest, GetLineageResponse, ListGenerationsRequest,
    ListGenerationsResponse,
};
use tonic::Status;

use crate::{
    ids::ExperimentId,
    queries::{self, StoredIndividuals, StoredLineage},
    store::{Store, StoreError},
};

use super::convert;

/// The database of a data directory, which is only read. A coordinator may use it meanwhile.
#[derive(Debug)]
pub struct Offline {
    store: Store,
}

impl Offline {
    /// Opens the database in `directory`.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        Ok(Self { store: Store::open_read_only(directory)? })
    }

    /// As the call `GetExperiment`.
    pub fn experiment(
        &self,
        request: GetExperimentRequest,
    ) -> Result<GetExperimentResponse, Status> {
        let id = ExperimentId(request.experiment_id);
        Ok(convert::stored_experiment(queries::experiment(&self.store, id)?))
    }

    /// As the call `ExportExperiment`.
    pub fn bundle(&self, experiment_id: u64) -> Result<Vec<u8>, Status> {
        let bundle = queries::bundle(&self.store, ExperimentId(experiment_id))?;
        bundle.to_bytes().map_err(|error| Status::failed_precondition(error.to_string()))
    }

    /// As the call `GetLineage`.
    pub fn lineage(&self, request: &GetLineageRequest) -> Result<GetLineageResponse, Status> {
        let address = convert::address(&request.address)?;
        let stored = StoredLineage::read(&self.store, address, request.depth)?;
        Ok(convert::lineage(stored.trace()?))
    }

    /// As the call `ListGenerations`.
    pub fn generations(
        &self,
        request: ListGenerationsRequest,
    ) -> Result<ListGenerationsResponse, Status> {
        let ListGenerationsRequest { experiment_id, from_generation, page_size } = request;
        let id = ExperimentId(experiment_id);
        let page = queries::generations(&self.store, id, from_generation, page_size)?;
        Ok(convert::generations(page))
    }

    /// As the call `ListExperiments`.
    pub fn experiments(&self) -> Result<Vec<Experiment>, Status> {
        Ok(self.store.experiments()?.into_iter().map(convert::experiment).collect())
    }

    /// As the call `GetIndividuals`.
    pub fn individuals(
        &self,
        request: &GetIndividualsRequest,
    ) -> Result<GetIndividualsResponse, Status> {
        let GetIndividualsRequest { address, from_individual, page_size } = request;
        let address = convert::address(address)?;
        let stored = StoredIndividuals::read(&self.store, address, *from_individual, *page_size)?;
        Ok(convert::individuals(stored.reconstruct()?))
    }
}
