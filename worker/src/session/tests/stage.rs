//! A coordinator that a test plays, and the worker that connects to it.

use std::{net::SocketAddr, pin::Pin};

use swarm_proto::v1::{
    work_request,
    worker_service_server::{WorkerService, WorkerServiceServer},
};
use tokio::{net::TcpListener, task::JoinHandle};
use tokio_stream::{Stream, wrappers::TcpListenerStream};
use tonic::{Request, Response, transport::Server};

use super::*;
use crate::{WorkerError, run_with};

/// The coordinator's side of a worker's stream.
pub(super) struct Conversation {
    pub(super) requests: Streaming<WorkRequest>,
    pub(super) responses: mpsc::Sender<Result<WorkResponse, Status>>,
}

struct FakeService {
    conversations: mpsc::Sender<Conversation>,
}

#[tonic::async_trait]
impl WorkerService for FakeService {
    type WorkStream = Pin<Box<dyn Stream<Item = Result<WorkResponse, Status>> + Send>>;

    async fn work(
        &self,
        request: Request<Streaming<WorkRequest>>,
    ) -> Result<Response<Self::WorkStream>, Status> {
        let (responses, stream) = mpsc::channel(16);
        let conversation = Conversation { requests: request.into_inner(), responses };
        self.conversations.send(conversation).await.map_err(|_| Status::unavailable("over"))?;
        Ok(Response::new(Box::pin(ReceiverStream::new(stream))))
    }
}

impl Conversation {
    pub(super) async fn send(&self, message: Message) {
        let response = WorkResponse { message: Some(message) };
        self.responses.send(Ok(response)).await.unwrap();
    }

    /// The next message; `None` at the end of the stream.
    pub(super) async fn next(&mut self) -> Option<work_request::Message> {
        let request = self.requests.message().await.unwrap();
        request.map(|request| request.message.expect("a worker sends no empty messages"))
    }

    /// The next `n` results, sorted by item.
    pub(super) async fn results(&mut self, n: usize) -> Vec<v1::ItemResult> {
        let mut results = Vec::new();
        while results.len() < n {
            match self.next().await {
                Some(work_request::Message::Results(batch)) => results.extend(batch.results),
                other => panic!("expected results, not {other:?}"),
            }
        }
        results.sort_by_key(|result| result.assignment_id);
        results
    }

    /// Reads `Hello`, answers `Welcome`.
    pub(super) async fn welcome(&mut self, heartbeat_interval: Duration) -> v1::Hello {
        let Some(work_request::Message::Hello(hello)) = self.next().await else {
            panic!("a stream begins with Hello");
        };
        let heartbeat_interval_ms = u32::try_from(heartbeat_interval.as_millis()).unwrap();
        self.send(Message::Welcome(v1::Welcome {
            worker_id: 7,
            heartbeat_interval_ms,
            lease_ms: 3 * heartbeat_interval_ms,
        }))
        .await;
        hello
    }

    /// The specification of an experiment.
    pub(super) async fn send_spec(&self, experiment: u64, config_json: &str) {
        let (job, config_json) = (job(experiment), config_json.into());
        self.send(Message::Spec(v1::JobSpec { job, config_json })).await;
    }

    pub(super) async fn send_end(&self, experiment: u64) {
        self.send(Message::EndJob(v1::EndJob { job: job(experiment) })).await;
    }

    /// Assignments of generation 5 of an experiment, trials 1 and 2.
    pub(super) async fn send_assignments(
        &self,
        experiment: u64,
        ids: impl IntoIterator<Item = u64>,
    ) {
        let assignments = ids
            .into_iter()
            .map(|assignment_id| v1::Assignment {
                assignment_id,
                first_trial: 1,
                trial_count: 2,
                genotype: vec![0.1, 0.2, assignment_id as f64],
                individual: None,
            })
            .collect();
        self.send(Message::Assignments(of_experiment(experiment, assignments))).await;
    }
}

pub(super) fn job(experiment: u64) -> Option<v1::JobId> {
    Some(v1::JobId { job: Some(v1::job_id::Job::Experiment(experiment)) })
}

pub(super) fn of_experiment(experiment: u64, assignments: Vec<v1::Assignment>) -> v1::Assignments {
    let trial_set = Some(v1::trial_set::TrialSet::Generation(5));
    v1::Assignments {
        job: job(experiment),
        trial_set: Some(v1::TrialSet { trial_set }),
        output: v1::Output::Fitness.into(),
        assignments,
    }
}

/// A function that makes specifications computable.
pub(super) trait MakesEvaluators: Fn(String) -> Evaluator + Send + Sync + 'static {}
impl<F: Fn(String) -> Evaluator + Send + Sync + 'static> MakesEvaluators for F {}

/// A coordinator, and a worker that connects to it.
pub(super) struct Stage {
    pub(super) conversations: mpsc::Receiver<Conversation>,
    pub(super) shutdown: CancellationToken,
    pub(super) give_up: CancellationToken,
    pub(super) worker: JoinHandle<Result<(), WorkerError>>,
}

impl Stage {
    pub(super) async fn new(slots: usize, evaluator: impl MakesEvaluators) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        Self { conversations: serve(listener), ..Self::worker(address, slots, evaluator) }
    }

    /// A worker whose coordinator the test provides.
    pub(super) fn worker(
        address: SocketAddr,
        slots: usize,
        evaluator: impl MakesEvaluators,
    ) -> Self {
        let mut config = WorkerConfig::new(format!("http://{address}"), "ada", slots);
        config.retry_delay_min = Duration::from_millis(1);
        config.retry_delay_max = Duration::from_millis(20);
        let (shutdown, give_up) = (CancellationToken::new(), config.give_up.clone());
        let worker = tokio::spawn(run_with(config, shutdown.clone(), evaluator));
        Self { conversations: mpsc::channel(1).1, shutdown, give_up, worker }
    }

    pub(super) async fn conversation(&mut self) -> Conversation {
        self.conversations.recv().await.expect("the service lives")
    }

    /// Stops the worker.
    pub(super) async fn end(self) {
        self.shutdown.cancel();
        drop(self.conversations);
        self.worker.await.unwrap().unwrap();
    }
}

pub(super) fn serve(listener: TcpListener) -> mpsc::Receiver<Conversation> {
    let (sender, conversations) = mpsc::channel(4);
    let service = WorkerServiceServer::new(FakeService { conversations: sender });
    let incoming = TcpListenerStream::new(listener);
    tokio::spawn(Server::builder().add_service(service).serve_with_incoming(incoming));
    conversations
}
