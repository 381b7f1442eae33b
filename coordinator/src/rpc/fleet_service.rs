//! `FleetService`: the connected workers.

use swarm_proto::v1::{
    ListWorkersRequest, ListWorkersResponse, fleet_service_server::FleetService,
};
use tonic::{Request, Response, Status};

use crate::{clock, control::Control};

use super::convert;

/// The service.
#[derive(Debug)]
pub struct Fleet {
    /// Asks the driver.
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
        Ok(Response::new(ListWorkersResponse { workers }))
    }
}
