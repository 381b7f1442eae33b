//! Requests to the coordinator, repeated while it cannot be reached.

use std::time::Duration;

use swarm_proto::v1::{
    CancelExperimentRequest, Experiment, GetChampionRequest, GetChampionResponse,
    GetExperimentRequest, ListExperimentsRequest, SubmitExperimentRequest,
    SubmitExperimentResponse, WatchExperimentRequest, WatchExperimentResponse,
    experiment_service_client::ExperimentServiceClient,
};
use tokio::time::{Instant, sleep};
use tonic::{
    Response, Status, Streaming,
    transport::{Channel, Endpoint},
};
use worker::Backoff;

use crate::error::{Error, is_transient};

/// Largest message accepted; networks are long when written out.
const MESSAGE_BYTES_MAX: usize = 64 << 20;
/// How long a request is repeated before the coordinator counts as unreachable.
const PATIENCE: Duration = Duration::from_secs(2);

/// A coordinator's address, and the way there once one is needed. All requests
/// are safe to repeat.
#[derive(Debug, Clone)]
pub struct Connection {
    address: String,
    client: ExperimentServiceClient<Channel>,
    patience: Duration,
}

impl Connection {
    /// Connects with the first request.
    pub fn new(address: &str) -> Result<Self, Error> {
        let endpoint = Endpoint::from_shared(address.to_owned())
            .ok()
            .filter(|endpoint| endpoint.uri().scheme_str() == Some("http"))
            .ok_or_else(|| {
                Error::Input(format!(
                    "`{address}` is not the address of a coordinator; expected something like \
                     http://127.0.0.1:7700"
                ))
            })?;
        let channel = endpoint
            .connect_timeout(Duration::from_secs(5))
            .timeout(Duration::from_secs(30))
            // While a stream is silent, only pings tell a patient coordinator
            // from a dead one.
            .http2_keep_alive_interval(Duration::from_secs(10))
            .keep_alive_timeout(Duration::from_secs(10))
            .connect_lazy();
        let client =
            ExperimentServiceClient::new(channel).max_decoding_message_size(MESSAGE_BYTES_MAX);
        Ok(Self { address: address.into(), client, patience: PATIENCE })
    }

    /// The same, but giving up later.
    pub fn with_patience(&self, patience: Duration) -> Self {
        Self { patience, ..self.clone() }
    }

    /// The coordinator's address.
    #[cfg(test)]
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
        Error::from_status(status, &self.address)
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

    /// Ends an experiment and returns it.
    pub async fn cancel(&self, experiment_id: u64) -> Result<Experiment, Error> {
        let request = CancelExperimentRequest { experiment_id };
        let response = self.call(async |client| client.cancel_experiment(request).await).await?;
        present(response.experiment)
    }

    /// The best genotype so far; [`Error::NotFound`] if there is none.
    pub async fn champion(&self, experiment_id: u64) -> Result<GetChampionResponse, Error> {
        let request = GetChampionRequest { experiment_id };
        self.call(async |client| client.get_champion(request).await).await
    }

    /// An experiment's events from a sequence number on; tried once.
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
        request: impl AsyncFn(&mut ExperimentServiceClient<Channel>) -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        let give_up_at = Instant::now() + self.patience;
        let mut backoff = backoff();
        loop {
            match request(&mut self.client.clone()).await {
                Ok(response) => return Ok(response.into_inner()),
                Err(status) if is_transient(&status) && Instant::now() < give_up_at => {
                    sleep(backoff.next_delay(rand::random())).await;
                }
                Err(status) => return Err(self.error(&status)),
            }
        }
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
