//! `FleetService`: the connected workers, and those in quarantine.

use swarm_proto::{
    WORKER_NAME_LEN_MAX,
    v1::{
        ListWorkersRequest, ListWorkersResponse, ReadmitWorkerRequest, ReadmitWorkerResponse,
        fleet_service_server::FleetService,
    },
};
use tonic::{Request, Response, Status};

use crate::{clock, control::Control, text::printable};

use super::convert;

/// The service.
#[derive(Debug)]
pub struct Fleet {
    /// The handle to the coordinator.
    pub control: Control,
}

#[tonic::async_trait]
impl FleetService for Fleet {
    async fn list_workers(
        &self,
        _request: Request<ListWorkersRequest>,
    ) -> Result<Response<ListWorkersResponse>, Status> {
        let workers = self.control.workers().await?;
        let now_ms = clock::unix_ms();
        let workers = workers.into_iter().map(|worker| convert::worker(worker, now_ms)).collect();
        let evaluations = self.control.evaluations().await?;
        let evaluations = evaluations.into_iter().map(convert::evaluation).collect();
        Ok(Response::new(ListWorkersResponse { workers, now_ms, evaluations }))
    }

    async fn readmit_worker(
        &self,
        request: Request<ReadmitWorkerRequest>,
    ) -> Result<Response<ReadmitWorkerResponse>, Status> {
        let ReadmitWorkerRequest { name } = request.into_inner();
        if name.len() > WORKER_NAME_LEN_MAX {
            let message = format!("name is longer than {WORKER_NAME_LEN_MAX} bytes");
            return Err(Status::invalid_argument(message));
        }
        self.control.readmit(&printable(&name)).await?;
        Ok(Response::new(ReadmitWorkerResponse {}))
    }
}
