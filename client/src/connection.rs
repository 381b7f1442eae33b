//! Requests to the coordinator, repeated while it cannot be reached.

use std::time::Duration;

use swarm_proto::v1::{
    CompletedGeneration, EvaluateRequest, EvaluateResponse, Event, Experiment, GetChampionRequest,
    GetChampionResponse, GetExperimentRequest, ListEventsRequest, ListExperimentsRequest,
    ListGenerationsRequest, SubmitExperimentRequest, SubmitExperimentResponse,
    WatchExperimentRequest, WatchExperimentResponse,
    evaluation_service_client::EvaluationServiceClient,
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
    banner::banner,
    error::{Error, is_transient},
    settings::Settings,
};

/// How long a request is repeated before the coordinator counts as unreachable.
const PATIENCE: Duration = Duration::from_secs(2);
/// The same, while a command follows an experiment.
pub const PATIENCE_WHILE_FOLLOWING: Duration = Duration::from_secs(60);
/// Number of events per request.
const EVENT_PAGE_LEN: u32 = 100;

/// A channel on which every call carries the token, if there is one.
type Authorised = InterceptedService<Channel, Bearer>;

/// A coordinator's address and the clients of its services, which connect with the
/// first request. All requests are safe to repeat.
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
    /// A connection to the coordinator of the settings and the settings file.
    pub fn open(settings: Settings) -> Result<Self, Error> {
        let settings = settings.or_file()?;
        Self::new(settings.address(), &settings.credentials()?)
    }

    /// A connection to the coordinator at an address.
    pub fn new(address: &str, credentials: &Credentials) -> Result<Self, Error> {
        let link =
            Link::new(address, credentials).map_err(|error| Error::Input(error.to_string()))?;
        let channel = link
            .endpoint
            .clone()
            .connect_timeout(Duration::from_secs(5))
            .timeout(Duration::from_secs(30))
            // While a stream is silent, only pings tell a live coordinator from a dead
            // one.
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

    /// The same connection, which repeats requests for this long.
    pub fn with_patience(&self, patience: Duration) -> Self {
        Self { patience, ..self.clone() }
    }

    /// The coordinator's address.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// How long requests are repeated.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    /// The error that the coordinator cannot be reached.
    pub fn unreachable(&self, reason: String) -> Error {
        Error::Unreachable { address: self.address.clone(), reason }
    }

    /// A status as this program's error.
    pub fn error(&self, status: &Status) -> Error {
        match (Error::from_status(status, &self.address), self.link.hint(status)) {
            (Error::Unreachable { address, reason }, Some(hint)) => {
                Error::Unreachable { address, reason: format!("{reason} ({hint})") }
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

    /// The measures of a genotype, as a stream; tried once.
    pub async fn evaluate(
        &self,
        request: EvaluateRequest,
    ) -> Result<Streaming<EvaluateResponse>, Status> {
        self.evaluations.clone().evaluate(request).await.map(Response::into_inner)
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

    /// Sends a request to the experiment service, again and again while the coordinator
    /// cannot be reached, up to this connection's patience.
    pub async fn call<T>(
        &self,
        request: impl AsyncFn(&mut ExperimentServiceClient<Authorised>) -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        self.retry(async || request(&mut self.client.clone()).await).await
    }

    /// As [`Self::call`], to the fleet service.
    pub async fn call_fleet<T>(
        &self,
        request: impl AsyncFn(&mut FleetServiceClient<Authorised>) -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        self.retry(async || request(&mut self.fleet.clone()).await).await
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

    /// If another server answers at the address, says so.
    async fn diagnose(&self, error: Error) -> Error {
        let Error::Unreachable { .. } = error else { return error };
        match banner(self.authority()).await {
            Some(banner) => Error::foreign(&self.address, &banner),
            None => error,
        }
    }

    /// Host and port of the coordinator.
    fn authority(&self) -> &str {
        let rest = self.address.split_once("://").map_or(&*self.address, |(_, rest)| rest);
        rest.split('/').next().unwrap_or(rest)
    }
}

/// The delays between attempts: short, because a person may be waiting.
pub fn backoff() -> Backoff {
    Backoff::new(Duration::from_millis(250), Duration::from_secs(2))
}

/// A field of an answer that every coordinator sets.
pub fn present<T>(field: Option<T>) -> Result<T, Error> {
    field.ok_or_else(|| Error::Internal("the coordinator's answer is incomplete".into()))
}
