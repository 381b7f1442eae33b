//! `ExperimentService`: submit, look, watch, steer.

use std::pin::Pin;

use swarm_proto::v1::{
    CancelExperimentRequest, CancelExperimentResponse, ExplainExperimentRequest,
    ExplainExperimentResponse, GetChampionRequest, GetChampionResponse, GetExperimentRequest,
    GetExperimentResponse, ListEventsRequest, ListEventsResponse, ListExperimentsRequest,
    ListExperimentsResponse, ListGenerationsRequest, ListGenerationsResponse,
    PauseExperimentRequest, PauseExperimentResponse, ResumeExperimentRequest,
    ResumeExperimentResponse, SetPriorityRequest, SetPriorityResponse, SubmitExperimentRequest,
    SubmitExperimentResponse, WatchExperimentRequest, WatchExperimentResponse,
    experiment_service_server::ExperimentService,
};
use tokio::task;
use tokio_stream::{Stream, StreamExt as _, wrappers::ReceiverStream};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status};

use crate::{
    control::{Control, ControlError, Submitted},
    ids::ExperimentId,
    priority::Priority,
    queries::{self, StoredChampion},
    shared_store::SharedStore,
    submission::Submission,
};

use super::{convert, explain};

/// The service.
#[derive(Debug)]
pub struct Experiments {
    /// For everything that is to be done.
    pub control: Control,
    /// For everything that is only read.
    pub store: SharedStore,
    /// Ends all streams.
    pub shutdown: CancellationToken,
}

#[tonic::async_trait]
impl ExperimentService for Experiments {
    type WatchExperimentStream =
        Pin<Box<dyn Stream<Item = Result<WatchExperimentResponse, Status>> + Send>>;

    async fn submit_experiment(
        &self,
        request: Request<SubmitExperimentRequest>,
    ) -> Result<Response<SubmitExperimentResponse>, Status> {
        let request = request.into_inner();
        let submission = Submission {
            request_id: Some(request.request_id).filter(|id| !id.is_empty()),
            config_json: request.config_json,
            default_name: request.default_name,
            seed: request.seed,
            generations: request.generations,
            priority: request.priority.map_or(Ok(Priority::default()), convert::priority)?,
        };
        let submitted = self.control.submit(submission, request.resume_unfinished).await?;
        let Submitted { experiment, warnings } = submitted;
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(SubmitExperimentResponse { experiment, warnings }))
    }

    async fn get_experiment(
        &self,
        request: Request<GetExperimentRequest>,
    ) -> Result<Response<GetExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let experiment = self.store.read(move |store| queries::experiment(store, id)).await?;
        let config_json = experiment.config_json.clone();
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(GetExperimentResponse { experiment, config_json }))
    }

    async fn list_experiments(
        &self,
        _request: Request<ListExperimentsRequest>,
    ) -> Result<Response<ListExperimentsResponse>, Status> {
        let experiments = self.store.read(|store| store.experiments()).await?;
        let experiments = experiments.into_iter().map(convert::experiment).collect();
        Ok(Response::new(ListExperimentsResponse { experiments }))
    }

    async fn watch_experiment(
        &self,
        request: Request<WatchExperimentRequest>,
    ) -> Result<Response<Self::WatchExperimentStream>, Status> {
        let WatchExperimentRequest { experiment_id, from_sequence } = request.into_inner();
        let id = ExperimentId(experiment_id);
        self.store.read(move |store| queries::experiment(store, id)).await?;
        let (store, shutdown) = (self.store.clone(), self.shutdown.clone());
        let events = queries::watch(store, shutdown, id, from_sequence);
        let responses = ReceiverStream::new(events).map(|event| {
            let event = Some(convert::event(event?));
            Ok(WatchExperimentResponse { event })
        });
        Ok(Response::new(Box::pin(responses)))
    }

    async fn cancel_experiment(
        &self,
        request: Request<CancelExperimentRequest>,
    ) -> Result<Response<CancelExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let experiment = Some(convert::experiment(self.control.cancel(id).await?));
        Ok(Response::new(CancelExperimentResponse { experiment }))
    }

    async fn pause_experiment(
        &self,
        request: Request<PauseExperimentRequest>,
    ) -> Result<Response<PauseExperimentResponse>, Status> {
        let PauseExperimentRequest { experiment_id, reason } = request.into_inner();
        let paused = self.control.pause(ExperimentId(experiment_id), &reason).await?;
        let experiment = Some(convert::experiment(paused));
        Ok(Response::new(PauseExperimentResponse { experiment }))
    }

    async fn resume_experiment(
        &self,
        request: Request<ResumeExperimentRequest>,
    ) -> Result<Response<ResumeExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let experiment = Some(convert::experiment(self.control.resume(id).await?));
        Ok(Response::new(ResumeExperimentResponse { experiment }))
    }

    async fn set_priority(
        &self,
        request: Request<SetPriorityRequest>,
    ) -> Result<Response<SetPriorityResponse>, Status> {
        let SetPriorityRequest { experiment_id, priority } = request.into_inner();
        let (id, priority) = (ExperimentId(experiment_id), convert::priority(priority)?);
        let experiment = self.control.set_priority(id, priority).await?;
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(SetPriorityResponse { experiment }))
    }

    async fn get_champion(
        &self,
        request: Request<GetChampionRequest>,
    ) -> Result<Response<GetChampionResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let stored = self.store.read(move |store| StoredChampion::read(store, id)).await?;
        let report = task::spawn_blocking(move || stored.decode())
            .await
            .map_err(|_| ControlError::Panicked("decoding the champion"))??;
        Ok(Response::new(convert::champion(report)))
    }

    async fn explain_experiment(
        &self,
        request: Request<ExplainExperimentRequest>,
    ) -> Result<Response<ExplainExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        Ok(Response::new(explain::explanation(self.control.explain(id).await?)))
    }

    async fn list_generations(
        &self,
        request: Request<ListGenerationsRequest>,
    ) -> Result<Response<ListGenerationsResponse>, Status> {
        let ListGenerationsRequest { experiment_id, from_generation, page_size } =
            request.into_inner();
        let id = ExperimentId(experiment_id);
        let read = move |store: &_| queries::generations(store, id, from_generation, page_size);
        let page = self.store.read(read).await?;
        Ok(Response::new(ListGenerationsResponse {
            generations: page.items.into_iter().map(convert::completed_generation).collect(),
            next_generation: page.next.map(|(_, generation)| generation.generation),
        }))
    }

    async fn list_events(
        &self,
        request: Request<ListEventsRequest>,
    ) -> Result<Response<ListEventsResponse>, Status> {
        let ListEventsRequest { experiment_id, from_sequence, page_size } = request.into_inner();
        let id = ExperimentId(experiment_id);
        let read = move |store: &_| queries::events(store, id, from_sequence, page_size);
        let page = self.store.read(read).await?;
        Ok(Response::new(ListEventsResponse {
            events: page.items.into_iter().map(convert::event).collect(),
            next_sequence: page.next.map(|event| event.sequence),
        }))
    }
}
