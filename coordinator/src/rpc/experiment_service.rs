//! `ExperimentService`: submit, look, watch, steer.

use std::{pin::Pin, sync::Arc};

use swarm_proto::v1::{
    ArchiveExperimentRequest, ArchiveExperimentResponse, CancelExperimentRequest,
    CancelExperimentResponse, DeleteExperimentRequest, DeleteExperimentResponse,
    ExplainExperimentRequest, ExplainExperimentResponse, ExportExperimentRequest,
    ExtendExperimentRequest, ExtendExperimentResponse, GetChampionRequest, GetChampionResponse,
    GetExperimentRequest, GetExperimentResponse, GetIndividualsRequest, GetIndividualsResponse,
    GetLineageRequest, GetLineageResponse, ImportExperimentRequest, ImportExperimentResponse,
    LabelExperimentRequest, LabelExperimentResponse, ListDynamicsRequest, ListDynamicsResponse,
    ListEventsRequest, ListEventsResponse, ListExperimentsRequest, ListExperimentsResponse,
    ListGenerationsRequest, ListGenerationsResponse, PauseExperimentRequest,
    PauseExperimentResponse, PruneExperimentRequest, PruneExperimentResponse,
    ResumeExperimentRequest, ResumeExperimentResponse, RetryExperimentRequest,
    RetryExperimentResponse, SetPriorityRequest, SetPriorityResponse, SubmitExperimentRequest,
    SubmitExperimentResponse, WatchExperimentRequest, WatchExperimentResponse,
    WatchExplanationRequest, WatchExplanationResponse, WatchNewsRequest, WatchNewsResponse,
    experiment_service_server::ExperimentService,
};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    task,
};
use tokio_stream::{Stream, StreamExt as _, wrappers::ReceiverStream};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status, Streaming};

use crate::{
    control::{Control, ControlError, Existing, Submitted},
    group::Membership,
    ids::ExperimentId,
    priority::Priority,
    queries::{
        self, Address, Individuals, QueryError, Several, StoredDynamics, StoredIndividuals,
        StoredLineage, Who,
    },
    shared_store::SharedStore,
    submission::Submission,
};

use super::{bundles, client, convert, explain, status};

/// The service.
#[derive(Debug)]
pub struct Experiments {
    /// One for each generation that is computed again.
    pub reconstructions: Semaphore,
    /// One for each bundle that is in memory.
    pub bundles: Arc<Semaphore>,
    /// For everything that is to be done.
    pub control: Control,
    /// For everything that is only read.
    pub store: SharedStore,
    /// Ends all streams.
    pub shutdown: CancellationToken,
}

impl Experiments {
    /// A place for a bundle in memory.
    async fn place(&self) -> Result<OwnedSemaphorePermit, Status> {
        let place = Arc::clone(&self.bundles).acquire_owned().await;
        place.map_err(|_| status::shutting_down())
    }

    /// Genotypes, computed again if need be.
    async fn individuals(&self, address: Address, page: Several) -> Result<Individuals, Status> {
        let _permit = self.reconstructions.acquire().await.map_err(|_| status::shutting_down())?;
        let read = move |store: &_| StoredIndividuals::read(store, address, page);
        let stored = self.store.read(read).await?;
        let found = task::spawn_blocking(move || stored.reconstruct())
            .await
            .map_err(|_| ControlError::Panicked("evolution"))??;
        Ok(found)
    }
}

#[tonic::async_trait]
impl ExperimentService for Experiments {
    type WatchExperimentStream =
        Pin<Box<dyn Stream<Item = Result<WatchExperimentResponse, Status>> + Send>>;
    type WatchExplanationStream =
        Pin<Box<dyn Stream<Item = Result<WatchExplanationResponse, Status>> + Send>>;
    type WatchNewsStream = Pin<Box<dyn Stream<Item = Result<WatchNewsResponse, Status>> + Send>>;

    type ExportExperimentStream = bundles::Pieces;

    async fn submit_experiment(
        &self,
        request: Request<SubmitExperimentRequest>,
    ) -> Result<Response<SubmitExperimentResponse>, Status> {
        let control = self.control.for_client(client(&request));
        let request = request.into_inner();
        let group = Some(request.group).filter(|group| !group.is_empty());
        let membership = group.map(|group| Membership::new(&group, &request.variant)).transpose();
        let submission = Submission {
            request_id: Some(request.request_id).filter(|id| !id.is_empty()),
            config_json: request.config_json,
            default_name: request.default_name,
            seed: request.seed,
            generations: request.generations,
            priority: request.priority.map_or(Ok(Priority::default()), convert::priority)?,
            membership: membership.map_err(Status::invalid_argument)?,
            labels: request.labels,
            parent: None,
        };
        let fork_of =
            request.fork_of.map(|point| (ExperimentId(point.experiment_id), point.generation));
        if fork_of.is_some() && request.resume_unfinished {
            return Err(Status::invalid_argument("a fork resumes nothing that is unfinished"));
        }
        let existing =
            Existing { resume_unfinished: request.resume_unfinished, reuse: request.reuse };
        let submitted = control.submit(submission, existing, fork_of).await?;
        let Submitted { experiment, warnings, identical } = submitted;
        let experiment = Some(convert::experiment(experiment));
        let identical = identical.map_or(0, |id| id.0);
        Ok(Response::new(SubmitExperimentResponse { experiment, warnings, identical }))
    }

    async fn get_experiment(
        &self,
        request: Request<GetExperimentRequest>,
    ) -> Result<Response<GetExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let experiment = self.store.read(move |store| queries::experiment(store, id)).await?;
        Ok(Response::new(convert::stored_experiment(experiment)))
    }

    async fn list_experiments(
        &self,
        request: Request<ListExperimentsRequest>,
    ) -> Result<Response<ListExperimentsResponse>, Status> {
        let filter = convert::filter(request.into_inner())?;
        let experiments = self.store.read(move |store| store.experiments(&filter)).await?;
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

    async fn prune_experiment(
        &self,
        request: Request<PruneExperimentRequest>,
    ) -> Result<Response<PruneExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let (pruned, freed_bytes) = self.control.prune(id).await?;
        let experiment = Some(convert::experiment(pruned));
        Ok(Response::new(PruneExperimentResponse { experiment, freed_bytes }))
    }

    async fn extend_experiment(
        &self,
        request: Request<ExtendExperimentRequest>,
    ) -> Result<Response<ExtendExperimentResponse>, Status> {
        let ExtendExperimentRequest { experiment_id, generations } = request.into_inner();
        let extended = self.control.extend(ExperimentId(experiment_id), generations).await?;
        let experiment = Some(convert::experiment(extended));
        Ok(Response::new(ExtendExperimentResponse { experiment }))
    }

    async fn retry_experiment(
        &self,
        request: Request<RetryExperimentRequest>,
    ) -> Result<Response<RetryExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let experiment = Some(convert::experiment(self.control.retry(id).await?));
        Ok(Response::new(RetryExperimentResponse { experiment }))
    }

    async fn delete_experiment(
        &self,
        request: Request<DeleteExperimentRequest>,
    ) -> Result<Response<DeleteExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let (deleted, freed_bytes) = self.control.delete(id).await?;
        let experiment = Some(convert::experiment(deleted));
        Ok(Response::new(DeleteExperimentResponse { experiment, freed_bytes }))
    }

    async fn archive_experiment(
        &self,
        request: Request<ArchiveExperimentRequest>,
    ) -> Result<Response<ArchiveExperimentResponse>, Status> {
        let ArchiveExperimentRequest { experiment_id, restore } = request.into_inner();
        let archiving = self.control.archive(ExperimentId(experiment_id), !restore);
        let (archived, log_bytes) = archiving.await?;
        let experiment = Some(convert::experiment(archived));
        Ok(Response::new(ArchiveExperimentResponse { experiment, log_bytes }))
    }

    async fn label_experiment(
        &self,
        request: Request<LabelExperimentRequest>,
    ) -> Result<Response<LabelExperimentResponse>, Status> {
        let LabelExperimentRequest { experiment_id, set, remove } = request.into_inner();
        let labelled = self.control.label(ExperimentId(experiment_id), set, remove).await?;
        let experiment = Some(convert::experiment(labelled));
        Ok(Response::new(LabelExperimentResponse { experiment }))
    }

    async fn export_experiment(
        &self,
        request: Request<ExportExperimentRequest>,
    ) -> Result<Response<Self::ExportExperimentStream>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let place = self.place().await?;
        let bundle = self.store.read(move |store| queries::bundle(store, id)).await?;
        let bytes = task::spawn_blocking(move || bundle.to_bytes())
            .await
            .map_err(|_| ControlError::Panicked("packing a bundle"))?
            .map_err(|error| Status::failed_precondition(error.to_string()))?;
        Ok(Response::new(bundles::send(bytes, place)))
    }

    async fn import_experiment(
        &self,
        request: Request<Streaming<ImportExperimentRequest>>,
    ) -> Result<Response<ImportExperimentResponse>, Status> {
        let place = self.place().await?;
        let control = self.control.for_client(client(&request));
        let bytes = bundles::receive(request.into_inner()).await?;
        let (experiment, is_new) = control.import(bytes, place).await?;
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(ImportExperimentResponse { experiment, is_new }))
    }

    async fn get_champion(
        &self,
        request: Request<GetChampionRequest>,
    ) -> Result<Response<GetChampionResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let address = Address { experiment: id, who: Who::Champion };
        let mut found = self.individuals(address, Several::default()).await?;
        let champion = found.individuals.pop().ok_or(QueryError::NoChampion(id))?;
        let network_json = found.network_json.unwrap_or_default();
        Ok(Response::new(convert::individual(id.0, champion, network_json)))
    }

    async fn get_individuals(
        &self,
        request: Request<GetIndividualsRequest>,
    ) -> Result<Response<GetIndividualsResponse>, Status> {
        let GetIndividualsRequest { address, from_individual: first, page_size: len, fitness_only } =
            request.into_inner();
        let address = convert::address(&address)?;
        let found = self.individuals(address, Several { first, len, fitness_only }).await?;
        Ok(Response::new(convert::individuals(found)))
    }

    async fn list_dynamics(
        &self,
        request: Request<ListDynamicsRequest>,
    ) -> Result<Response<ListDynamicsResponse>, Status> {
        let ListDynamicsRequest { experiment_id, from_generation } = request.into_inner();
        let id = ExperimentId(experiment_id);
        let _permit = self.reconstructions.acquire().await.map_err(|_| status::shutting_down())?;
        let read = move |store: &_| StoredDynamics::read(store, id, from_generation);
        let stored = self.store.read(read).await?;
        let found = task::spawn_blocking(move || stored.replay())
            .await
            .map_err(|_| ControlError::Panicked("evolution"))??;
        Ok(Response::new(convert::dynamics(found)))
    }

    async fn get_lineage(
        &self,
        request: Request<GetLineageRequest>,
    ) -> Result<Response<GetLineageResponse>, Status> {
        let GetLineageRequest { address, depth } = request.into_inner();
        let address = convert::address(&address)?;
        let _permit = self.reconstructions.acquire().await.map_err(|_| status::shutting_down())?;
        let read = move |store: &_| StoredLineage::read(store, address, depth);
        let stored = self.store.read(read).await?;
        let found = task::spawn_blocking(move || stored.trace())
            .await
            .map_err(|_| ControlError::Panicked("evolution"))??;
        Ok(Response::new(convert::lineage(found)))
    }

    async fn explain_experiment(
        &self,
        request: Request<ExplainExperimentRequest>,
    ) -> Result<Response<ExplainExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        Ok(Response::new(explain::explanation(self.control.explain(id).await?)))
    }

    async fn watch_explanation(
        &self,
        request: Request<WatchExplanationRequest>,
    ) -> Result<Response<Self::WatchExplanationStream>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let explanations = self.control.watch_explanation(id, self.shutdown.clone()).await?;
        let responses = ReceiverStream::new(explanations).map(|found| {
            let explanation = Some(explain::explanation(found?));
            Ok(WatchExplanationResponse { explanation })
        });
        Ok(Response::new(Box::pin(responses)))
    }

    async fn watch_news(
        &self,
        _request: Request<WatchNewsRequest>,
    ) -> Result<Response<Self::WatchNewsStream>, Status> {
        let news = ReceiverStream::new(self.control.watch_news(self.shutdown.clone()));
        Ok(Response::new(Box::pin(news.map(|()| Ok(WatchNewsResponse {})))))
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
        Ok(Response::new(convert::generations(page)))
    }

    async fn list_events(
        &self,
        request: Request<ListEventsRequest>,
    ) -> Result<Response<ListEventsResponse>, Status> {
        let ListEventsRequest { experiment_id, from_sequence, page_size } = request.into_inner();
        let id = ExperimentId(experiment_id);
        let read = move |store: &_| queries::events(store, id, from_sequence, page_size);
        let page = self.store.read(read).await?;
        Ok(Response::new(convert::events(page)))
    }
}
