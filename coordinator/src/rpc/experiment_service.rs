//! `ExperimentService`: submits, reads, watches and steers experiments.

use std::{pin::Pin, sync::Arc};

use model::queries::{Reader, StoredBundle};
use swarm_proto::v1::{
    self, ExplainExperimentRequest, ExplainExperimentResponse, ExportExperimentRequest,
    ImportExperimentRequest, ImportExperimentResponse, SubmitExperimentRequest,
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
    control::{self, Control, ControlError, Existing, Reopening, Submitted},
    group::Membership,
    ids::ExperimentId,
    priority::Priority,
    queries, runs,
    shared_store::SharedStore,
    submission::Submission,
};

use super::{bundles, client, convert, explain, status};

/// The service.
#[derive(Debug)]
pub struct Experiments {
    /// One permit for each bundle in memory.
    pub bundles: Arc<Semaphore>,
    /// Carries out all changes.
    pub control: Control,
    /// Answers the calls that only read.
    pub reader: Reader,
    /// The source of streams and bundles.
    pub store: SharedStore,
    /// Ends all streams.
    pub shutdown: CancellationToken,
}

type Events = Pin<Box<dyn Stream<Item = Result<WatchExperimentResponse, Status>> + Send>>;
type Explanations = Pin<Box<dyn Stream<Item = Result<WatchExplanationResponse, Status>> + Send>>;
type News = Pin<Box<dyn Stream<Item = Result<WatchNewsResponse, Status>> + Send>>;

impl Experiments {
    /// Waits for a permit for a bundle.
    async fn place(&self) -> Result<OwnedSemaphorePermit, Status> {
        let place = Arc::clone(&self.bundles).acquire_owned().await;
        place.map_err(|_| status::shutting_down())
    }

    /// Submits an experiment for a client, or for pages.
    pub async fn submit_experiment(
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
            return Err(Status::invalid_argument("fork and resume_unfinished exclude each other"));
        }
        let existing =
            Existing { resume_unfinished: request.resume_unfinished, reuse: request.reuse };
        let submitted = control.submit(submission, existing, fork_of).await?;
        let Submitted { experiment, warnings, identical } = submitted;
        let experiment = Some(experiment.into());
        let identical = identical.map_or(0, |id| id.0);
        Ok(Response::new(SubmitExperimentResponse { experiment, warnings, identical }))
    }

    async fn explain_experiment(
        &self,
        request: Request<ExplainExperimentRequest>,
    ) -> Result<Response<ExplainExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        Ok(Response::new(explain::explanation(self.control.explain(id).await?)))
    }

    async fn watch_experiment(
        &self,
        request: Request<WatchExperimentRequest>,
    ) -> Result<Response<Events>, Status> {
        let WatchExperimentRequest { experiment_id, from_sequence } = request.into_inner();
        let id = ExperimentId(experiment_id);
        self.store.read(move |store| queries::experiment(store, id)).await?;
        let (store, shutdown) = (self.store.clone(), self.shutdown.clone());
        let events = control::follow(store, shutdown, id, from_sequence);
        let responses = ReceiverStream::new(events).map(|event| {
            let event = Some(event?.into());
            Ok(WatchExperimentResponse { event })
        });
        Ok(Response::new(Box::pin(responses)))
    }

    async fn watch_explanation(
        &self,
        request: Request<WatchExplanationRequest>,
    ) -> Result<Response<Explanations>, Status> {
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
    ) -> Result<Response<News>, Status> {
        let news = ReceiverStream::new(self.control.watch_news(self.shutdown.clone()));
        Ok(Response::new(Box::pin(news.map(|()| Ok(WatchNewsResponse {})))))
    }

    async fn export_experiment(
        &self,
        request: Request<ExportExperimentRequest>,
    ) -> Result<Response<bundles::Pieces>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let place = self.place().await?;
        let stored = self.store.read(move |store| StoredBundle::read(store, id)).await?;
        let bytes = task::spawn_blocking(move || bundles::pack(stored))
            .await
            .map_err(|_| ControlError::Panicked("packing a bundle"))??;
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
        let experiment = Some(experiment.into());
        Ok(Response::new(ImportExperimentResponse { experiment, is_new }))
    }
}

/// Implements the service call by call. Calls that only read go to the reader. A call that
/// changes an experiment lists its arguments from the request, the fields of its answer, and the
/// operation of the coordinator. All other calls are functions of their own.
macro_rules! service {
    (
        reads { $($read:ident($asked:ident) -> $answer:ident;)* }
        changes($control:ident, $id:ident) {
            $($change:ident($wanted:ident { $($field:ident),* }) -> $changed:ident { $experiment:ident $(, $more:ident)? }
                = $call:expr;)*
        }
        others { $($other:ident($request:ty) -> $response:ty;)* }
    ) => {
        #[tonic::async_trait]
        impl ExperimentService for Experiments {
            type WatchExperimentStream = Events;
            type WatchExplanationStream = Explanations;
            type WatchNewsStream = News;
            type ExportExperimentStream = bundles::Pieces;

            $(
                async fn $read(
                    &self,
                    request: Request<v1::$asked>,
                ) -> Result<Response<v1::$answer>, Status> {
                    self.reader.$read(request.into_inner()).await.map(Response::new)
                }
            )*

            $(
                async fn $change(
                    &self,
                    request: Request<v1::$wanted>,
                ) -> Result<Response<v1::$changed>, Status> {
                    let v1::$wanted { experiment_id, $($field),* } = request.into_inner();
                    let ($id, $control) = (ExperimentId(experiment_id), &self.control);
                    #[allow(unused_parens, reason = "a pattern of one is no tuple")]
                    let ($experiment $(, $more)?) = $call.await?;
                    let $experiment = Some($experiment.into());
                    Ok(Response::new(v1::$changed { $experiment $(, $more)? }))
                }
            )*

            $(
                async fn $other(
                    &self,
                    request: Request<$request>,
                ) -> Result<Response<$response>, Status> {
                    // Calls the function of that name above, not this one.
                    Experiments::$other(self, request).await
                }
            )*
        }
    };
}

model::reading_calls! { service
    changes(control, id) {
        cancel_experiment(CancelExperimentRequest {}) -> CancelExperimentResponse { experiment }
            = control.cancel(id);
        pause_experiment(PauseExperimentRequest { reason }) -> PauseExperimentResponse { experiment }
            = control.pause(id, &reason);
        resume_experiment(ResumeExperimentRequest {}) -> ResumeExperimentResponse { experiment }
            = control.resume(id);
        set_priority(SetPriorityRequest { priority }) -> SetPriorityResponse { experiment }
            = control.change(id, runs::Request::SetPriority(convert::priority(priority)?));
        extend_experiment(ExtendExperimentRequest { generations }) -> ExtendExperimentResponse { experiment }
            = control.reopen(id, Reopening::Extend(generations));
        retry_experiment(RetryExperimentRequest {}) -> RetryExperimentResponse { experiment }
            = control.reopen(id, Reopening::Retry);
        prune_experiment(PruneExperimentRequest {}) -> PruneExperimentResponse { experiment, freed_bytes }
            = control.prune(id);
        delete_experiment(DeleteExperimentRequest {}) -> DeleteExperimentResponse { experiment, freed_bytes }
            = control.delete(id);
        archive_experiment(ArchiveExperimentRequest { restore }) -> ArchiveExperimentResponse { experiment, log_bytes }
            = control.archive(id, !restore);
        label_experiment(LabelExperimentRequest { set, remove }) -> LabelExperimentResponse { experiment }
            = control.label(id, set, remove);
    }
    others {
        submit_experiment(SubmitExperimentRequest) -> SubmitExperimentResponse;
        explain_experiment(ExplainExperimentRequest) -> ExplainExperimentResponse;
        watch_experiment(WatchExperimentRequest) -> Events;
        watch_explanation(WatchExplanationRequest) -> Explanations;
        watch_news(WatchNewsRequest) -> News;
        export_experiment(ExportExperimentRequest) -> bundles::Pieces;
        import_experiment(Streaming<ImportExperimentRequest>) -> ImportExperimentResponse;
    }
}
