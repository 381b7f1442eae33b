//! The workers of the fake coordinator.

use swarm_proto::v1::{
    ListWorkersRequest, ListWorkersResponse, ReadmitWorkerRequest, ReadmitWorkerResponse,
    fleet_service_server::FleetService,
};
use tonic::{Request, Response, Status};

use super::FakeCoordinator;

#[tonic::async_trait]
impl FleetService for FakeCoordinator {
    async fn list_workers(
        &self,
        _: Request<ListWorkersRequest>,
    ) -> Result<Response<ListWorkersResponse>, Status> {
        let workers = self.script(|script| script.workers.clone());
        Ok(Response::new(ListWorkersResponse { workers, ..Default::default() }))
    }

    async fn readmit_worker(
        &self,
        request: Request<ReadmitWorkerRequest>,
    ) -> Result<Response<ReadmitWorkerResponse>, Status> {
        let ReadmitWorkerRequest { name } = request.into_inner();
        let is_out = self.script(|script| {
            let mut workers = script.workers.iter_mut();
            let worker = workers.find(|worker| worker.name == name)?;
            (!std::mem::take(&mut worker.distrusted).is_empty()).then_some(())
        });
        is_out.ok_or_else(|| Status::not_found("no such worker is in quarantine"))?;
        Ok(Response::new(ReadmitWorkerResponse {}))
    }
}
