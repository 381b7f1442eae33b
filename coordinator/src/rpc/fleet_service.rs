//! `FleetService`: who computes.

use swarm_proto::v1::{
    ListWorkersRequest, ListWorkersResponse, fleet_service_server::FleetService,
};
use tokio::sync::oneshot;
use tonic::{Request, Response, Status};

use crate::{
    clock,
    driver::{Event, EventSender},
};

use super::{convert, shutting_down};

/// The service.
#[derive(Debug)]
pub struct Fleet {
    /// To the driver.
    pub events: EventSender,
}

#[tonic::async_trait]
impl FleetService for Fleet {
    async fn list_workers(
        &self,
        _request: Request<ListWorkersRequest>,
    ) -> Result<Response<ListWorkersResponse>, Status> {
        let (reply, workers) = oneshot::channel();
        let request = Event::WorkersRequested(reply);
        self.events.send(request).await.map_err(|_| shutting_down())?;
        let workers = workers.await.map_err(|_| shutting_down())?;
        let now_ms = clock::unix_ms();
        let workers = workers.into_iter().map(|worker| convert::worker(worker, now_ms)).collect();
        Ok(Response::new(ListWorkersResponse { workers }))
    }
}
