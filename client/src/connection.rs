//! Requests to the coordinator, repeated while it cannot be reached.

use std::time::Duration;

use swarm_proto::v1::{
    CancelExperimentRequest, CompletedGeneration, EvaluateRequest, EvaluateResponse, Event,
    Experiment, ExplainExperimentRequest, ExplainExperimentResponse, GetChampionRequest,
    GetChampionResponse, GetExperimentRequest, ListEventsRequest, ListExperimentsRequest,
    ListGenerationsRequest, ListWorkersRequest, PauseExperimentRequest, ResumeExperimentRequest,
    SetPriorityRequest, SubmitExperimentRequest, SubmitExperimentResponse, WatchExperimentRequest,
    WatchExperimentResponse, Worker, evaluation_service_client::EvaluationServiceClient,
    experiment_service_client::ExperimentServiceClient, fleet_service_client::FleetServiceClient,
};
use swarm_transport::{
    Bearer, Credentials, FROM_COORDINATOR_LEN_MAX, Link, TO_COORDINATOR_LEN_MAX,
};
use tokio::time::{Instant, sleep};
use tonic::{
    Response, Status, Streaming, service::interceptor::InterceptedService, transport::Channel,
};
use worker::Backoff;

use crate::{
    error::{Error, is_transient},
    greeting::greeting,
    settings::Settings,
};

/// How long a request is repeated before the coordinator counts as unreachable.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long a coordinator may be away from whoever follows an experiment.
pub const PATIENCE_WHILE_FOLLOWING: Duration = Duration::from_secs(60);
/// Events of an experiment that are held at once.
const EVENT_PAGE_LEN: u32 = 100;

/// A channel on which every call carries the token, if there is one.
type Authorised = InterceptedService<Channel, Bearer>;

/// A coordinator's address, and the way there once one is needed. All requests
/// are safe to repeat.
#[derive(Debug, Clone)]
pub struct Connection {
    address: String,
    link: Link,
    client: ExperimentServiceClient<Authorised>,
    evaluations: EvaluationServiceClient<Authorised>,
    fleet: FleetServiceClient<Authorised>,
    patience: Duration,
}

impl Connection {
    /// To the coordinator that the settings name, or that the settings file names.
    pub fn open(settings: Settings) -> Result<Self, Error> {
        let settings = settings.or_file()?;
        Self::new(settings.address(), &settings.credentials()?)
    }

    /// Connects with the first request.
    pub fn new(address: &str, credentials: &Credentials) -> Result<Self, Error> {
        let link =
            Link::new(address, credentials).map_err(|error| Error::Input(error.to_string()))?;
        let channel = link
            .endpoint
            .clone()
            .connect_timeout(Duration::from_secs(5))
            .timeout(Duration::from_secs(30))
            // While a stream is silent, only pings tell a patient coordinator
            // from a dead one.
            .http2_keep_alive_interval(Duration::from_secs(10))
            .keep_alive_timeout(Duration::from_secs(10))
            .connect_lazy();
        let fleet = FleetServiceClient::with_interceptor(channel.clone(), link.bearer.clone())
            .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(TO_COORDINATOR_LEN_MAX);
        let evaluations =
            EvaluationServiceClient::with_interceptor(channel.clone(), link.bearer.clone())
                .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
                .max_encoding_message_size(TO_COORDINATOR_LEN_MAX);
        let client = ExperimentServiceClient::with_interceptor(channel, link.bearer.clone())
            .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(TO_COORDINATOR_LEN_MAX);
        Ok(Self { address: address.into(), link, client, evaluations, fleet, patience: PATIENCE })
    }

    /// The same, but giving up later.
    pub fn with_patience(&self, patience: Duration) -> Self {
        Self { patience, ..self.clone() }
    }

    /// The coordinator's address.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// How long to try.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    /// That the coordinator cannot be reached.
    pub fn unreachable(&self, reason: String) -> Error {
        Error::Unreachable { address: self.address.clone(), reason }
    }

    /// A status as this program's error.
    pub fn error(&self, status: &Status) -> Error {
        match (Error::from_status(status, &self.address), self.link.suspicion(status)) {
            (Error::Unreachable { address, reason }, Some(suspicion)) => {
                Error::Unreachable { address, reason: format!("{reason} ({suspicion})") }
            }
            (error, _) => error,
        }
    }

    /// Starts an experiment, or returns the one of the same request id.
    pub async fn submit(
        &self,
        request: SubmitExperimentRequest,
    ) -> Result<SubmitExperimentResponse, Error> {
        self.call(async |client| client.submit_experiment(request.clone()).await).await
    }

    /// One experiment.
    pub async fn experiment(&self, experiment_id: u64) -> Result<Experiment, Error> {
        let request = GetExperimentRequest { experiment_id };
        let response = self.call(async |client| client.get_experiment(request).await).await?;
        present(response.experiment)
    }

    /// All experiments, oldest first.
    pub async fn experiments(&self) -> Result<Vec<Experiment>, Error> {
        let request = ListExperimentsRequest {};
        let response = self.call(async |client| client.list_experiments(request).await).await?;
        Ok(response.experiments)
    }

    /// An experiment's file in canonical form.
    pub async fn config_json(&self, experiment_id: u64) -> Result<String, Error> {
        let request = GetExperimentRequest { experiment_id };
        let response = self.call(async |client| client.get_experiment(request).await).await?;
        Ok(response.config_json)
    }

    /// What is measured of a genotype; tried once.
    pub async fn evaluate(
        &self,
        request: EvaluateRequest,
    ) -> Result<Streaming<EvaluateResponse>, Status> {
        self.evaluations.clone().evaluate(request).await.map(Response::into_inner)
    }

    /// Ends an experiment and returns it.
    pub async fn cancel(&self, experiment_id: u64) -> Result<Experiment, Error> {
        let request = CancelExperimentRequest { experiment_id };
        let response = self.call(async |client| client.cancel_experiment(request).await).await?;
        present(response.experiment)
    }

    /// Has an experiment wait until it is resumed, and returns it.
    pub async fn pause(&self, experiment_id: u64, reason: String) -> Result<Experiment, Error> {
        let request = PauseExperimentRequest { experiment_id, reason };
        let response =
            self.call(async |client| client.pause_experiment(request.clone()).await).await?;
        present(response.experiment)
    }

    /// Lets a paused experiment go on, and returns it.
    pub async fn resume(&self, experiment_id: u64) -> Result<Experiment, Error> {
        let request = ResumeExperimentRequest { experiment_id };
        let response = self.call(async |client| client.resume_experiment(request).await).await?;
        present(response.experiment)
    }

    /// Changes an experiment's share of the fleet, and returns it.
    pub async fn set_priority(
        &self,
        experiment_id: u64,
        priority: u32,
    ) -> Result<Experiment, Error> {
        let request = SetPriorityRequest { experiment_id, priority };
        let response = self.call(async |client| client.set_priority(request).await).await?;
        present(response.experiment)
    }

    /// What an experiment does, or waits for.
    pub async fn explain(&self, experiment_id: u64) -> Result<ExplainExperimentResponse, Error> {
        let request = ExplainExperimentRequest { experiment_id };
        self.call(async |client| client.explain_experiment(request).await).await
    }

    /// The connected workers.
    pub async fn workers(&self) -> Result<Vec<Worker>, Error> {
        let request = ListWorkersRequest {};
        let fleet = &self.fleet;
        let response = self.retry(async || fleet.clone().list_workers(request).await).await?;
        Ok(response.workers)
    }

    /// The best genotype so far; [`Error::NotFound`] if there is none.
    pub async fn champion(&self, experiment_id: u64) -> Result<GetChampionResponse, Error> {
        let request = GetChampionRequest { experiment_id };
        self.call(async |client| client.get_champion(request).await).await
    }

    /// All completed generations.
    pub async fn generations(&self, experiment_id: u64) -> Result<Vec<CompletedGeneration>, Error> {
        let mut generations = Vec::new();
        let mut next_generation = Some(0);
        while let Some(from_generation) = next_generation {
            let request = ListGenerationsRequest { experiment_id, from_generation, page_size: 0 };
            let page = self.call(async |client| client.list_generations(request).await).await?;
            generations.extend(page.generations);
            next_generation = page.next_generation;
        }
        Ok(generations)
    }

    /// Some of an experiment's past events, from a sequence number on.
    pub async fn events_page(
        &self,
        experiment_id: u64,
        from_sequence: u64,
    ) -> Result<Vec<Event>, Error> {
        let page_size = EVENT_PAGE_LEN;
        let request = ListEventsRequest { experiment_id, from_sequence, page_size };
        let page = self.call(async |client| client.list_events(request).await).await?;
        Ok(page.events)
    }

    /// An experiment's events from a sequence number on, past and future; tried once.
    pub async fn events(
        &self,
        experiment_id: u64,
        from_sequence: u64,
    ) -> Result<Streaming<WatchExperimentResponse>, Status> {
        let request = WatchExperimentRequest { experiment_id, from_sequence };
        self.client.clone().watch_experiment(request).await.map(Response::into_inner)
    }

    async fn call<T>(
        &self,
        request: impl AsyncFn(&mut ExperimentServiceClient<Authorised>) -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        self.retry(async || request(&mut self.client.clone()).await).await
    }

    async fn retry<T>(
        &self,
        request: impl AsyncFn() -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        let give_up_at = Instant::now() + self.patience;
        let mut backoff = backoff();
        loop {
            match request().await {
                Ok(response) => return Ok(response.into_inner()),
                Err(status) if is_transient(&status) && Instant::now() < give_up_at => {
                    sleep(backoff.next_delay(rand::random())).await;
                }
                Err(status) => return Err(self.diagnose(self.error(&status)).await),
            }
        }
    }

    /// Tells a coordinator that is not there from something else that is.
    async fn diagnose(&self, error: Error) -> Error {
        let Error::Unreachable { .. } = error else { return error };
        match greeting(self.authority()).await {
            Some(greeting) => Error::foreign(&self.address, &greeting),
            None => error,
        }
    }

    /// Host and port of the coordinator.
    fn authority(&self) -> &str {
        let rest = self.address.split_once("://").map_or(&*self.address, |(_, rest)| rest);
        rest.split('/').next().unwrap_or(rest)
    }
}

/// The delays between attempts: short, as somebody is waiting.
pub fn backoff() -> Backoff {
    Backoff::new(Duration::from_millis(250), Duration::from_secs(2))
}

/// A field that every coordinator fills in.
pub fn present<T>(field: Option<T>) -> Result<T, Error> {
    field.ok_or_else(|| Error::Internal("the coordinator's answer is incomplete".into()))
}
