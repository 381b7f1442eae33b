//! A coordinator for tests that follows a script.

use std::{
    collections::VecDeque,
    pin::Pin,
    sync::{Arc, Mutex},
    time::Duration,
};

use swarm_proto::v1::{
    CancelExperimentRequest, CancelExperimentResponse, Event, Experiment, ExperimentState,
    GenerationSummary, GetChampionRequest, GetChampionResponse, GetExperimentRequest,
    GetExperimentResponse, ListExperimentsRequest, ListExperimentsResponse, StateChange,
    SubmitExperimentRequest, SubmitExperimentResponse, WatchExperimentRequest,
    WatchExperimentResponse,
    event::Kind,
    experiment_service_server::{ExperimentService, ExperimentServiceServer},
};
use tokio::net::TcpListener;
use tokio_stream::{Stream, wrappers::TcpListenerStream};
use tonic::{Request, Response, Status, transport::Server};

use crate::connection::Connection;

/// What to answer, and what was asked.
#[derive(Debug, Default)]
pub struct Script {
    /// The one experiment that there is.
    pub experiment: Experiment,
    pub champion: Option<GetChampionResponse>,
    /// For each `Watch` in turn: its events, and what then ends the stream if
    /// not the end of events.
    pub watches: VecDeque<(Vec<Event>, Option<Status>)>,
    /// For each `Submit` in turn: a refusal. Afterwards it is accepted.
    pub submit_refusals: VecDeque<Status>,
    pub watched_from: Vec<u64>,
    pub submitted: Vec<SubmitExperimentRequest>,
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
        let service = ExperimentServiceServer::new(fake.clone());
        let incoming = TcpListenerStream::new(listener);
        tokio::spawn(Server::builder().add_service(service).serve_with_incoming(incoming));
        (fake, Connection::new(&address).unwrap())
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

/// A connection to a port where nobody listens.
pub async fn unreachable_connection() -> Connection {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    drop(listener);
    Connection::new(&address).unwrap().with_patience(Duration::ZERO)
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

    async fn submit_experiment(
        &self,
        request: Request<SubmitExperimentRequest>,
    ) -> Result<Response<SubmitExperimentResponse>, Status> {
        self.script(|script| {
            script.submitted.push(request.into_inner());
            match script.submit_refusals.pop_front() {
                Some(status) => Err(status),
                None => Ok(Response::new(SubmitExperimentResponse {
                    experiment: Some(script.experiment.clone()),
                    warnings: vec![],
                })),
            }
        })
    }

    async fn get_experiment(
        &self,
        request: Request<GetExperimentRequest>,
    ) -> Result<Response<GetExperimentResponse>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        Ok(Response::new(GetExperimentResponse { experiment }))
    }

    async fn list_experiments(
        &self,
        _: Request<ListExperimentsRequest>,
    ) -> Result<Response<ListExperimentsResponse>, Status> {
        let experiments = vec![self.script(|script| script.experiment.clone())];
        Ok(Response::new(ListExperimentsResponse { experiments }))
    }

    async fn watch_experiment(
        &self,
        request: Request<WatchExperimentRequest>,
    ) -> Result<Response<Self::WatchExperimentStream>, Status> {
        let (events, end) = self.script(|script| {
            script.watched_from.push(request.into_inner().from_sequence);
            script.watches.pop_front().ok_or_else(|| Status::not_found("the script is over"))
        })?;
        let events =
            events.into_iter().map(|event| Ok(WatchExperimentResponse { event: Some(event) }));
        Ok(Response::new(Box::pin(tokio_stream::iter(events.chain(end.map(Err))))))
    }

    async fn cancel_experiment(
        &self,
        request: Request<CancelExperimentRequest>,
    ) -> Result<Response<CancelExperimentResponse>, Status> {
        let experiment = self.experiment(request.into_inner().experiment_id)?;
        Ok(Response::new(CancelExperimentResponse { experiment }))
    }

    async fn get_champion(
        &self,
        request: Request<GetChampionRequest>,
    ) -> Result<Response<GetChampionResponse>, Status> {
        self.experiment(request.into_inner().experiment_id)?;
        let no_champion = || Status::failed_precondition("there is no champion yet");
        self.script(|script| script.champion.clone()).map(Response::new).ok_or_else(no_champion)
    }
}
