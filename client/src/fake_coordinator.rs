//! A coordinator for tests that follows a script.

mod fleet;
mod fronts;
mod lineage;
mod repertoires;

use std::{
    collections::VecDeque,
    pin::Pin,
    sync::{Arc, Mutex},
    time::Duration,
};

use swarm_proto::v1::{
    ArchiveExperimentRequest, ArchiveExperimentResponse, CancelExperimentRequest,
    CancelExperimentResponse, CompletedGeneration, DeleteExperimentRequest,
    DeleteExperimentResponse, Event, Experiment, ExperimentState, ExplainExperimentRequest,
    ExplainExperimentResponse, ExportExperimentRequest, ExportExperimentResponse,
    ExtendExperimentRequest, ExtendExperimentResponse, GenerationDynamics, GenerationSummary,
    GetChampionRequest, GetChampionResponse, GetExperimentRequest, GetExperimentResponse,
    GetFrontRequest, GetFrontResponse, GetIndividualsRequest, GetIndividualsResponse,
    GetLineageRequest, GetLineageResponse, GetRepertoireRequest, GetRepertoireResponse,
    ImportExperimentRequest, ImportExperimentResponse, LabelExperimentRequest,
    LabelExperimentResponse, ListDynamicsRequest, ListDynamicsResponse, ListEventsRequest,
    ListEventsResponse, ListExperimentsRequest, ListExperimentsResponse, ListGenerationsRequest,
    ListGenerationsResponse, PauseExperimentRequest, PauseExperimentResponse,
    PruneExperimentRequest, PruneExperimentResponse, ResumeExperimentRequest,
    ResumeExperimentResponse, RetryExperimentRequest, RetryExperimentResponse, SetPriorityRequest,
    SetPriorityResponse, StateChange, SubmitExperimentRequest, SubmitExperimentResponse,
    WatchExperimentRequest, WatchExperimentResponse, WatchExplanationRequest,
    WatchExplanationResponse, WatchNewsRequest, WatchNewsResponse, Worker,
    event::Kind,
    experiment_service_server::{ExperimentService, ExperimentServiceServer},
    fleet_service_server::FleetServiceServer,
};
use tokio::net::TcpListener;
use tokio_stream::{Stream, StreamExt as _, wrappers::TcpListenerStream};
use tonic::{Code, Request, Response, Status, Streaming, transport::Server};

use swarm_transport::Credentials;

use crate::connection::Connection;

/// The answers to give, and a record of requests.
#[derive(Debug, Default)]
pub struct Script {
    /// The only experiment.
    pub experiment: Experiment,
    pub champion: Option<GetChampionResponse>,
    /// The events of the experiment, from event 1 on without gaps.
    pub past: Vec<Event>,
    /// The answer to `Explain`, without the experiment.
    pub explanation: ExplainExperimentResponse,
    pub workers: Vec<Worker>,
    /// For each `Watch` in turn: its events, and the error that ends the stream, if any.
    pub watches: VecDeque<(Vec<Event>, Option<Status>)>,
    /// For each `Submit` in turn: a refusal, or OK. Later calls are accepted.
    pub submit_refusals: VecDeque<Status>,
    pub watched_from: Vec<u64>,
    pub submitted: Vec<SubmitExperimentRequest>,
    /// Number of an experiment that is identical to a submission; 0 for none.
    pub identical: u64,
}

/// The script of a service, shared with the test.
#[derive(Debug, Clone)]
pub struct FakeCoordinator(Arc<Mutex<Script>>);

impl FakeCoordinator {
    /// Serves a script on a free port.
    pub async fn serve(script: Script) -> (Self, Connection) {
        let fake = Self(Arc::new(Mutex::new(script)));
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        let server = Server::builder()
            .add_service(ExperimentServiceServer::new(fake.clone()))
            .add_service(FleetServiceServer::new(fake.clone()))
            .serve_with_incoming(TcpListenerStream::new(listener));
        tokio::spawn(server);
        (fake, Connection::new(&address, &Credentials::default()).unwrap())
    }

    pub fn script<T>(&self, read: impl FnOnce(&mut Script) -> T) -> T {
        read(&mut self.0.lock().unwrap())
    }

    fn experiment(&self, id: u64) -> Result<Option<Experiment>, Status> {
        let experiment = self.script(|script| script.experiment.clone());
        if experiment.id == id {
            Ok(Some(experiment))
        } else {
            Err(Status::not_found(format!("there is no experiment {id}")))
        }
    }
}

/// A connection to a port without a server.
pub async fn unreachable_connection() -> Connection {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    drop(listener);
    Connection::new(&address, &Credentials::default()).unwrap().with_patience(Duration::ZERO)
}

pub fn generation(sequence: u64, generation: u64) -> Event {
    let summary = GenerationSummary { generation, best: 0.5, ..GenerationSummary::default() };
    Event { sequence, at_ms: 0, kind: Some(Kind::GenerationCompleted(summary)) }
}

pub fn state(sequence: u64, state: ExperimentState) -> Event {
    let change = StateChange { state: state.into(), reason: String::new() };
    Event { sequence, at_ms: 0, kind: Some(Kind::StateChanged(change)) }
}

#[tonic::async_trait]
impl ExperimentService for FakeCoordinator {
    type WatchExperimentStream =
        Pin<Box<dyn Stream<Item = Result<WatchExperimentResponse, Status>> + Send>>;
    type WatchExplanationStream =
        Pin<Box<dyn Stream<Item = Result<WatchExplanationResponse, Status>> + Send>>;
    type WatchNewsStream = Pin<Box<dyn Stream<Item = Result<WatchNewsResponse, Status>> + Send>>;

    async fn submit_experiment(
        &self,
        request: Request<SubmitExperimentRequest>,
    ) -> Result<Response<SubmitExperimentResponse>, Status> {
        self.script(|script| {
            script.submitted.push(request.into_inner());
            match script.submit_refusals.pop_front() {
                Some(status) if status.code() != Code::Ok => Err(status),
                _ => Ok(Response::new(SubmitExperimentResponse {
                    experiment: Some(script.experiment.clone()),
                    warnings: vec![],
                    identical: script.identical,
                })),
            }
        })
    }

    async fn get_experiment(
        &self,
        request: Request<GetExperimentRequest>,
    ) -> Result<Response<GetExperimentResponse>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        Ok(Response::new(GetExperimentResponse { experiment, ..Default::default() }))
    }

    async fn list_experiments(
        &self,
        request: Request<ListExperimentsRequest>,
    ) -> Result<Response<ListExperimentsResponse>, Status> {
        let ListExperimentsRequest { labels, without_archived, .. } = request.into_inner();
        let mut experiments = vec![self.script(|script| script.experiment.clone())];
        experiments.retain(|only| {
            let has = |label: &String| match label.split_once('=') {
                Some((key, value)) => only.labels.get(key).is_some_and(|found| found == value),
                None => only.labels.contains_key(label),
            };
            labels.iter().all(has) && !(without_archived && only.archived)
        });
        Ok(Response::new(ListExperimentsResponse { experiments }))
    }

    async fn watch_experiment(
        &self,
        request: Request<WatchExperimentRequest>,
    ) -> Result<Response<Self::WatchExperimentStream>, Status> {
        let (events, end) = self.script(|script| {
            script.watched_from.push(request.into_inner().from_sequence);
            let watch = script
                .watches
                .pop_front()
                .ok_or_else(|| Status::not_found("the script is over"))?;
            for event in &watch.0 {
                if let Some(Kind::StateChanged(change)) = &event.kind {
                    script.experiment.set_state(change.state());
                }
            }
            Ok::<_, Status>(watch)
        })?;
        let events =
            events.into_iter().map(|event| Ok(WatchExperimentResponse { event: Some(event) }));
        Ok(Response::new(Box::pin(tokio_stream::iter(events.chain(end.map(Err))))))
    }

    async fn cancel_experiment(
        &self,
        request: Request<CancelExperimentRequest>,
    ) -> Result<Response<CancelExperimentResponse>, Status> {
        let experiment_id = request.into_inner().experiment_id;
        self.experiment(experiment_id)?;
        self.script(|script| script.experiment.set_state(ExperimentState::Cancelled));
        let experiment = self.experiment(experiment_id)?;
        Ok(Response::new(CancelExperimentResponse { experiment }))
    }

    async fn pause_experiment(
        &self,
        request: Request<PauseExperimentRequest>,
    ) -> Result<Response<PauseExperimentResponse>, Status> {
        let PauseExperimentRequest { experiment_id, reason } = request.into_inner();
        self.script(|script| {
            script.experiment.set_state(ExperimentState::Paused);
            script.experiment.reason = format!("paused by a client: {reason}");
        });
        let experiment = self.experiment(experiment_id)?;
        Ok(Response::new(PauseExperimentResponse { experiment }))
    }

    async fn resume_experiment(
        &self,
        request: Request<ResumeExperimentRequest>,
    ) -> Result<Response<ResumeExperimentResponse>, Status> {
        self.script(|script| {
            script.experiment.set_state(ExperimentState::Running);
            script.experiment.reason.clear();
        });
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        Ok(Response::new(ResumeExperimentResponse { experiment }))
    }

    async fn set_priority(
        &self,
        request: Request<SetPriorityRequest>,
    ) -> Result<Response<SetPriorityResponse>, Status> {
        let SetPriorityRequest { experiment_id, priority } = request.into_inner();
        self.script(|script| script.experiment.priority = priority);
        let experiment = self.experiment(experiment_id)?;
        Ok(Response::new(SetPriorityResponse { experiment }))
    }

    async fn list_dynamics(
        &self,
        request: Request<ListDynamicsRequest>,
    ) -> Result<Response<ListDynamicsResponse>, Status> {
        let generation = request.into_inner().from_generation;
        let of = GenerationDynamics {
            generation,
            mean_step: Some(0.25),
            deviations: vec![0.1, 0.125, 0.15, 0.175, 0.2],
            rank_correlation: (generation > 0).then_some(0.5),
        };
        let next_generation = (generation < 2).then_some(generation + 1);
        Ok(Response::new(ListDynamicsResponse { generations: vec![of], next_generation }))
    }

    async fn get_lineage(
        &self,
        _: Request<GetLineageRequest>,
    ) -> Result<Response<GetLineageResponse>, Status> {
        Ok(Response::new(lineage::lineage()))
    }

    async fn get_front(
        &self,
        request: Request<GetFrontRequest>,
    ) -> Result<Response<GetFrontResponse>, Status> {
        Ok(Response::new(fronts::front(request.into_inner())))
    }

    async fn get_repertoire(
        &self,
        request: Request<GetRepertoireRequest>,
    ) -> Result<Response<GetRepertoireResponse>, Status> {
        Ok(Response::new(repertoires::repertoire(request.into_inner().generation)))
    }

    type ExportExperimentStream =
        Pin<Box<dyn Stream<Item = Result<ExportExperimentResponse, Status>> + Send>>;

    async fn export_experiment(
        &self,
        request: Request<ExportExperimentRequest>,
    ) -> Result<Response<Self::ExportExperimentStream>, Status> {
        self.experiment(request.into_inner().experiment_id)?;
        let pieces = [&b"two "[..], b"pieces"].map(|piece| piece.to_vec());
        let pieces = pieces.map(|piece| Ok(ExportExperimentResponse { piece }));
        Ok(Response::new(Box::pin(tokio_stream::iter(pieces))))
    }

    async fn import_experiment(
        &self,
        request: Request<Streaming<ImportExperimentRequest>>,
    ) -> Result<Response<ImportExperimentResponse>, Status> {
        let mut pieces = request.into_inner();
        let mut bytes = Vec::new();
        while let Some(ImportExperimentRequest { piece }) = pieces.message().await? {
            bytes.extend(piece);
        }
        if bytes != b"two pieces" {
            return Err(Status::invalid_argument("it is no bundle, or cut off or damaged: why"));
        }
        let experiment = self.experiment(3)?;
        Ok(Response::new(ImportExperimentResponse { experiment, is_new: true }))
    }

    async fn prune_experiment(
        &self,
        request: Request<PruneExperimentRequest>,
    ) -> Result<Response<PruneExperimentResponse>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        if experiment
            .as_ref()
            .is_some_and(|experiment| experiment.state() == ExperimentState::Running)
        {
            return Err(Status::failed_precondition("experiment 3 has not ended"));
        }
        Ok(Response::new(PruneExperimentResponse { experiment, freed_bytes: 5 << 20 }))
    }

    async fn extend_experiment(
        &self,
        request: Request<ExtendExperimentRequest>,
    ) -> Result<Response<ExtendExperimentResponse>, Status> {
        let ExtendExperimentRequest { experiment_id, generations } = request.into_inner();
        let mut experiment = self.experiment(experiment_id)?;
        experiment.iter_mut().for_each(|experiment| experiment.generations = generations);
        Ok(Response::new(ExtendExperimentResponse { experiment }))
    }

    async fn retry_experiment(
        &self,
        request: Request<RetryExperimentRequest>,
    ) -> Result<Response<RetryExperimentResponse>, Status> {
        self.script(|script| {
            script.experiment.set_state(ExperimentState::Running);
            script.experiment.reason.clear();
        });
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        Ok(Response::new(RetryExperimentResponse { experiment }))
    }

    async fn delete_experiment(
        &self,
        request: Request<DeleteExperimentRequest>,
    ) -> Result<Response<DeleteExperimentResponse>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        Ok(Response::new(DeleteExperimentResponse { experiment, freed_bytes: 6 << 20 }))
    }

    async fn archive_experiment(
        &self,
        request: Request<ArchiveExperimentRequest>,
    ) -> Result<Response<ArchiveExperimentResponse>, Status> {
        let ArchiveExperimentRequest { experiment_id, restore } = request.into_inner();
        self.script(|script| script.experiment.archived = !restore);
        let experiment = self.experiment(experiment_id)?;
        Ok(Response::new(ArchiveExperimentResponse { experiment, log_bytes: 5 << 20 }))
    }

    async fn label_experiment(
        &self,
        request: Request<LabelExperimentRequest>,
    ) -> Result<Response<LabelExperimentResponse>, Status> {
        let LabelExperimentRequest { experiment_id, set, remove } = request.into_inner();
        self.script(|script| {
            script.experiment.labels.extend(set);
            script.experiment.labels.retain(|key, _| !remove.contains(key));
        });
        let experiment = self.experiment(experiment_id)?;
        Ok(Response::new(LabelExperimentResponse { experiment }))
    }

    async fn get_champion(
        &self,
        request: Request<GetChampionRequest>,
    ) -> Result<Response<GetChampionResponse>, Status> {
        self.experiment(request.into_inner().experiment_id)?;
        let no_champion = || Status::failed_precondition("there is no champion yet");
        self.script(|script| script.champion.clone()).map(Response::new).ok_or_else(no_champion)
    }

    async fn get_individuals(
        &self,
        request: Request<GetIndividualsRequest>,
    ) -> Result<Response<GetIndividualsResponse>, Status> {
        let request = request.into_inner();
        let (id, place) = request.address.split_once('@').unwrap_or((&request.address, ""));
        self.experiment(id.parse().unwrap())?;
        let champion = self.script(|script| script.champion.clone());
        let champion =
            champion.ok_or_else(|| Status::failed_precondition("there is no champion yet"))?;
        if place.is_empty() {
            let individuals = vec![champion];
            return Ok(Response::new(GetIndividualsResponse {
                individuals,
                next_individual: None,
            }));
        }
        let individual = |index: u32| GetChampionResponse {
            individual: Some(index),
            held_out: None,
            judged: None,
            ..champion.clone()
        };
        if let Some((_, index)) = place.split_once('/') {
            let index = index.parse().map_err(|_| Status::invalid_argument("it has no mean"))?;
            let individuals = vec![individual(index)];
            return Ok(Response::new(GetIndividualsResponse {
                individuals,
                next_individual: None,
            }));
        }
        // Two pages of one individual each.
        let individuals = vec![individual(request.from_individual)];
        let next_individual = (request.from_individual == 0).then_some(1);
        Ok(Response::new(GetIndividualsResponse { individuals, next_individual }))
    }

    async fn explain_experiment(
        &self,
        request: Request<ExplainExperimentRequest>,
    ) -> Result<Response<ExplainExperimentResponse>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        let explanation = self.script(|script| script.explanation.clone());
        Ok(Response::new(ExplainExperimentResponse { experiment, ..explanation }))
    }

    async fn watch_explanation(
        &self,
        request: Request<WatchExplanationRequest>,
    ) -> Result<Response<Self::WatchExplanationStream>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        let explanation = self.script(|script| script.explanation.clone());
        let explanation = Some(ExplainExperimentResponse { experiment, ..explanation });
        let first = tokio_stream::once(Ok(WatchExplanationResponse { explanation }));
        Ok(Response::new(Box::pin(first.chain(tokio_stream::pending()))))
    }

    async fn watch_news(
        &self,
        _: Request<WatchNewsRequest>,
    ) -> Result<Response<Self::WatchNewsStream>, Status> {
        let first = tokio_stream::once(Ok(WatchNewsResponse {}));
        Ok(Response::new(Box::pin(first)))
    }

    async fn list_generations(
        &self,
        request: Request<ListGenerationsRequest>,
    ) -> Result<Response<ListGenerationsResponse>, Status> {
        let request = request.into_inner();
        self.experiment(request.experiment_id)?;
        let mut completed: VecDeque<CompletedGeneration> = self.script(|script| {
            let completed = script.past.iter().filter_map(|event| match &event.kind {
                Some(Kind::GenerationCompleted(summary)) => Some(CompletedGeneration {
                    summary: Some(summary.clone()),
                    completed_at_ms: event.at_ms,
                }),
                _ => None,
            });
            completed.skip(request.from_generation as usize).collect()
        });
        // Pages of one generation each.
        let generations: Vec<CompletedGeneration> = completed.pop_front().into_iter().collect();
        let next_generation = (!completed.is_empty()).then_some(request.from_generation + 1);
        Ok(Response::new(ListGenerationsResponse { generations, next_generation }))
    }

    async fn list_events(
        &self,
        request: Request<ListEventsRequest>,
    ) -> Result<Response<ListEventsResponse>, Status> {
        let request = request.into_inner();
        self.experiment(request.experiment_id)?;
        // Pages of one event each.
        let event = self.script(|script| {
            let wanted = |event: &&Event| event.sequence >= request.from_sequence;
            script.past.iter().find(wanted).cloned()
        });
        Ok(Response::new(ListEventsResponse {
            events: event.into_iter().collect(),
            ..Default::default()
        }))
    }
}
