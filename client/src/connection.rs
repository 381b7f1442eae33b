//! Requests to the coordinator, repeated while it is unreachable; or to the same services in
//! this process, on a data directory.

mod requests;

use std::{
    iter,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use model::store::Holder;
use swarm_proto::v1::{
    Experiment, evaluation_service_client::EvaluationServiceClient,
    experiment_service_client::ExperimentServiceClient, fleet_service_client::FleetServiceClient,
};
use swarm_transport::{
    Backoff, Banner, Bearer, Credentials, FROM_COORDINATOR_LEN_MAX, Link, TO_COORDINATOR_LEN_MAX,
    banner,
};
use tokio::time::{Instant, sleep_until};
use tonic::{
    Response, Status,
    service::interceptor::InterceptedService,
    transport::{Channel, Endpoint},
};

use crate::{
    error::{Code, Error, is_transient, reason},
    local::services::{self, Door, InProcess},
    place::{Intent, Place},
    progress::Progress,
    settings::Settings,
    text, waiting,
};

/// How long a request is repeated before the coordinator counts as unreachable.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long a request is repeated while a command follows an experiment.
pub const PATIENCE_WHILE_FOLLOWING: Duration = Duration::from_secs(60);
/// Time limit of a call that is not a stream.
const CALL_TIMEOUT: Duration = Duration::from_secs(30);

/// A channel that adds the token, if any, to every call.
type Authorised = InterceptedService<Channel, Bearer>;

/// The transport to the services.
#[derive(Debug, Clone)]
enum Way {
    /// Over the network.
    Link(Box<Link>),
    /// To services in this process.
    Here(Arc<Here>),
}

/// A data directory, and the services on it.
#[derive(Debug)]
struct Here {
    data_dir: PathBuf,
    door: Door,
    /// None if another owner, which also has workers, stops the services.
    services: Option<InProcess>,
    /// Numbers of the experiments that this process has started.
    set_going: Mutex<Vec<u64>>,
}

/// A coordinator's address, or a data directory, and the clients of its services, which connect
/// with the first request. All requests are safe to repeat.
#[derive(Debug, Clone)]
pub struct Connection {
    /// The coordinator's address, or the data directory.
    address: String,
    /// The options that name the place; empty if commands find the place by themselves.
    place: Vec<String>,
    way: Way,
    client: ExperimentServiceClient<Authorised>,
    evaluations: EvaluationServiceClient<Authorised>,
    fleet: FleetServiceClient<Authorised>,
    patience: Duration,
}

impl Connection {
    /// A connection to the place of the settings, the environment or the settings file. Prints
    /// the place unless the user has named it.
    pub async fn open(
        settings: Settings,
        intent: Intent,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let place = Place::find(settings).await?;
        progress.found(&place);
        Self::to(place, intent).await
    }

    /// A connection to a place: to a coordinator, or to the services on a data directory in this
    /// process.
    pub async fn to(place: Place, intent: Intent) -> Result<Self, Error> {
        let (path, is_found) = match place {
            Place::Coordinator(settings) => return Self::at(&settings),
            Place::Directory { path, is_found } => (path, is_found),
        };
        let data_dir = &*path;
        intent.check(data_dir)?;
        let services = match intent {
            Intent::Read => InProcess::read(data_dir).await,
            _ => InProcess::write(data_dir).await,
        };
        let services = services.map_err(services::refused)?;
        Ok(Self::here(data_dir, is_found, services.door().clone(), Some(services)))
    }

    /// A connection to the coordinator of the settings.
    pub fn at(settings: &Settings) -> Result<Self, Error> {
        let connection = Self::new(settings.address(), &settings.credentials()?)?;
        Ok(Self { place: settings.said.clone(), ..connection })
    }

    /// A connection to the coordinator in this process that computes a data directory.
    #[cfg(feature = "local")]
    pub fn computing(data_dir: &Path, door: Door) -> Self {
        Self::here(data_dir, data_dir == Path::new(crate::defaults::DEFAULT_DATA_DIR), door, None)
    }

    /// `is_found`: whether commands find the data directory by themselves.
    fn here(data_dir: &Path, is_found: bool, door: Door, services: Option<InProcess>) -> Self {
        let channel = door.channel(Some(CALL_TIMEOUT));
        let here = Here { data_dir: data_dir.into(), door, services, set_going: Mutex::default() };
        let address = data_dir.display().to_string();
        let place = match is_found {
            true => Vec::new(),
            false => vec!["--data-dir".to_owned(), address.clone()],
        };
        let this = Self::on(address, Way::Here(Arc::new(here)), &channel);
        // A failure in this process is not transient.
        Self { place, ..this }.with_patience(Duration::ZERO)
    }

    /// A connection to the coordinator at an address.
    pub fn new(address: &str, credentials: &Credentials) -> Result<Self, Error> {
        let link = Link::new(address, credentials)
            .map_err(|error| Error::at(Code::BadInput, address, error.to_string()))?;
        let channel = endpoint(&link).timeout(CALL_TIMEOUT).connect_lazy();
        Ok(Self::on(address.into(), Way::Link(Box::new(link)), &channel))
    }

    fn on(address: String, way: Way, channel: &Channel) -> Self {
        let (client, evaluations) = (way.experiments(channel), way.evaluations(channel));
        let fleet = FleetServiceClient::with_interceptor(channel.clone(), way.bearer())
            .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(TO_COORDINATOR_LEN_MAX);
        Self { address, place: Vec::new(), way, client, evaluations, fleet, patience: PATIENCE }
    }

    /// Ends the services that this connection has started.
    pub async fn close(self) {
        let Self { way, client, evaluations, fleet, .. } = self;
        drop((client, evaluations, fleet));
        if let Way::Here(here) = way
            && let Some(Here { services: Some(services), .. }) = Arc::into_inner(here)
        {
            services.shutdown().await;
        }
    }

    /// The data directory, unless requests go to a coordinator.
    pub fn data_dir(&self) -> Option<&Path> {
        match &self.way {
            Way::Link(_) => None,
            Way::Here(here) => Some(&here.data_dir),
        }
    }

    /// A text whose commands act in the same place.
    pub fn in_place(&self, text: &str) -> String {
        text::in_place(text, &text::shell_command(self.place.clone()))
    }

    /// The line of a command that acts in the same place.
    pub fn command(&self, words: &[&str]) -> String {
        let words = iter::once("swarmctl").chain(words.iter().copied()).map(str::to_owned);
        text::shell_command(words.chain(self.place.iter().cloned()))
    }

    /// Whether this process, and no other, computes experiments.
    pub fn computes(&self) -> bool {
        matches!(&self.way, Way::Here(here) if here.services.is_none())
    }

    /// Remembers the experiments that this process computes, for advice on how to
    /// continue them.
    pub fn set_going(&self, experiments: &[Experiment]) {
        if let Way::Here(here) = &self.way {
            let ids = experiments.iter().map(|experiment| experiment.id);
            here.set_going.lock().unwrap_or_else(PoisonError::into_inner).extend(ids);
        }
    }

    /// Numbers of the experiments that this process has started.
    pub fn going(&self) -> Vec<u64> {
        match &self.way {
            Way::Here(here) => {
                here.set_going.lock().unwrap_or_else(PoisonError::into_inner).clone()
            }
            Way::Link(_) => Vec::new(),
        }
    }

    /// The other program that uses the data directory, if there is one.
    pub async fn holder(&self) -> Option<Holder> {
        match &self.way {
            Way::Here(here) => here.services.as_ref()?.holder().await,
            Way::Link(_) => None,
        }
    }

    /// The data directory, if no program computes its experiments.
    pub async fn idle_data_dir(&self) -> Option<&Path> {
        let data_dir = self.data_dir().filter(|_| !self.computes())?;
        self.holder().await.is_none().then_some(data_dir)
    }

    /// The same connection with another patience.
    pub fn with_patience(&self, patience: Duration) -> Self {
        Self { patience, ..self.clone() }
    }

    /// The coordinator's address, or the data directory.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// How long requests are repeated.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    /// The error that the coordinator is unreachable.
    pub fn unreachable(&self, reason: String) -> Error {
        Error::Unreachable { address: self.address.clone(), reason }
    }

    /// A status as this program's error.
    pub fn error(&self, status: &Status) -> Error {
        let (error, hint) = match &self.way {
            Way::Link(link) => (Error::from_status(status, &self.address), link.hint(status)),
            Way::Here(_) => (Error::from_status_here(status, &self.address), None),
        };
        match (error, hint) {
            (Error::Unreachable { address, reason }, Some(hint)) => {
                Error::Unreachable { address, reason: format!("{reason} ({hint})") }
            }
            // The services do not know how the user reaches them.
            (Error::Input(message), _) => Error::Input(self.in_place(&message)),
            (Error::NotFound(message), _) => Error::NotFound(self.in_place(&message)),
            (Error::WrongState(message), _) => Error::WrongState(self.in_place(&message)),
            (error, _) => error,
        }
    }

    /// A client for requests that take a long time.
    fn patient(&self) -> ExperimentServiceClient<Authorised> {
        self.way.experiments(&self.way.patient_channel())
    }

    /// Sends a request to the experiment service, and retries while the coordinator is
    /// unreachable, up to this connection's patience.
    pub async fn call<T>(
        &self,
        request: impl AsyncFn(&mut ExperimentServiceClient<Authorised>) -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        self.ask(async || request(&mut self.client.clone()).await).await
    }

    /// Like [`Self::call`], for the fleet service.
    pub async fn call_fleet<T>(
        &self,
        request: impl AsyncFn(&mut FleetServiceClient<Authorised>) -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        self.ask(async || request(&mut self.fleet.clone()).await).await
    }

    async fn ask<T>(
        &self,
        request: impl AsyncFn() -> Result<Response<T>, Status>,
    ) -> Result<T, Error> {
        // On the heap, so that the futures of commands take little stack.
        Box::pin(self.retry(request, async || self.waits(None))).await
    }

    /// `waits`: what the command waits for while the coordinator is reachable.
    async fn retry<T>(
        &self,
        request: impl AsyncFn() -> Result<Response<T>, Status>,
        waits: impl AsyncFn() -> String,
    ) -> Result<T, Error> {
        let give_up_at = Instant::now() + self.patience;
        let failure = Mutex::new(None);
        let repeated = async {
            let mut backoff = backoff();
            loop {
                match request().await {
                    Ok(response) => return Ok(response.into_inner()),
                    Err(status) if is_transient(&status) && Instant::now() < give_up_at => {
                        *lock(&failure) = Some(reason(&status));
                        let delay = backoff.next_delay(rand::random());
                        sleep_until(give_up_at.min(Instant::now() + delay)).await;
                    }
                    Err(status) => return Err(self.diagnose(self.error(&status)).await),
                }
            }
        };
        // With little patience, an unreachable coordinator is reported soon.
        let what = async || {
            let failure = lock(&failure).clone();
            match failure {
                None => Some(waits().await),
                Some(_) if self.patience <= PATIENCE => None,
                Some(reason) => Some(self.waits(Some(&reason))),
            }
        };
        waiting::aloud(what, repeated).await
    }

    /// A description of the wait. `failure`: of the last attempt.
    pub fn waits(&self, failure: Option<&str>) -> String {
        match failure {
            None => match &self.way {
                Way::Link(_) => format!("the answer of the coordinator at {}", self.address),
                Way::Here(_) => format!("the data directory {}", self.address),
            },
            Some(reason) => {
                let (address, patience) = (&self.address, self.patience.as_secs());
                format!("the coordinator at {address} for up to {patience} s: {reason}")
            }
        }
    }

    /// Names another kind of server, if one answers at the address.
    async fn diagnose(&self, error: Error) -> Error {
        let (Error::Unreachable { .. }, Way::Link(link)) = (&error, &self.way) else {
            return error;
        };
        match banner(&link.authority()).await {
            Some(Banner::Line(banner)) => Error::foreign(&self.address, &banner),
            Some(Banner::Tls) if !self.address.starts_with("https:") => Error::Tls {
                address: self.address.clone(),
                diagnosis: "it speaks TLS; use https:// and --tls-ca".to_owned(),
            },
            Some(Banner::Tls) | None => error,
        }
    }
}

impl Way {
    fn bearer(&self) -> Bearer {
        match self {
            Self::Link(link) => link.bearer.clone(),
            Self::Here(_) => Bearer::default(),
        }
    }

    /// A channel whose calls have no time limit.
    fn patient_channel(&self) -> Channel {
        match self {
            Self::Link(link) => endpoint(link).connect_lazy(),
            Self::Here(here) => here.door.channel(None),
        }
    }

    fn experiments(&self, channel: &Channel) -> ExperimentServiceClient<Authorised> {
        ExperimentServiceClient::with_interceptor(channel.clone(), self.bearer())
            .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(TO_COORDINATOR_LEN_MAX)
    }

    fn evaluations(&self, channel: &Channel) -> EvaluationServiceClient<Authorised> {
        EvaluationServiceClient::with_interceptor(channel.clone(), self.bearer())
            .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(TO_COORDINATOR_LEN_MAX)
    }
}

/// A channel to a coordinator, which connects when it is first used.
fn endpoint(link: &Link) -> Endpoint {
    link.endpoint
        .clone()
        .connect_timeout(Duration::from_secs(5))
        // While a stream is silent, only pings tell a live coordinator from a dead one.
        .http2_keep_alive_interval(Duration::from_secs(10))
        .keep_alive_timeout(Duration::from_secs(10))
}

/// The delays between attempts: short, because a person may be waiting.
pub fn backoff() -> Backoff {
    Backoff::new(Duration::from_millis(250), Duration::from_secs(2))
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A field of an answer that every coordinator sets.
pub fn present<T>(field: Option<T>) -> Result<T, Error> {
    field.ok_or_else(|| Error::Internal("the coordinator's answer is incomplete".into()))
}

#[cfg(test)]
mod tests {
    use std::{io::Write as _, net::TcpListener, thread};

    use super::*;
    use crate::fake_coordinator::{FakeCoordinator, Script};

    #[tokio::test]
    async fn a_coordinator_has_no_banner() {
        let (_fake, connection) = FakeCoordinator::serve(Script::default()).await;
        assert_eq!(banner(connection.address().trim_start_matches("http://")).await, None);
    }

    #[tokio::test]
    async fn another_service_at_the_address_is_named() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        thread::spawn(move || {
            for stream in listener.incoming() {
                // A client that has gone needs no answer.
                let _ = stream.and_then(|mut stream| stream.write_all(b"220 mail ESMTP\r\n"));
            }
        });
        let connection =
            Connection::new(&format!("http://{address}"), &Credentials::default()).unwrap();
        let error = connection.with_patience(Duration::ZERO).experiments().await.unwrap_err();
        let expected = format!(
            "the server at http://{address} is not a coordinator: it answers \"220 mail ESMTP\"; \
             is this the right port?"
        );
        assert_eq!((error.exit_code(), error.to_string()), (9, expected));
    }
}
