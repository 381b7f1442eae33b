//! A running coordinator: store, driver and gRPC server together.

use std::{convert::Infallible, io, net::SocketAddr, path::PathBuf, time::Duration};

use swarm_proto::{
    FILE_DESCRIPTOR_SET,
    v1::{
        evaluation_service_server::EvaluationServiceServer,
        experiment_service_server::ExperimentServiceServer,
        fleet_service_server::FleetServiceServer, worker_service_server::WorkerServiceServer,
    },
};
use swarm_telemetry::{Endpoint, ListenError};
use swarm_transport::{FROM_COORDINATOR_LEN_MAX, TO_COORDINATOR_LEN_MAX, tls_diagnosis};
use tokio::{net::TcpListener, task::JoinSet};
use tokio_util::sync::CancellationToken;
use tonic::transport::Server;
use tracing::{error, info, warn};

use crate::{
    access::{Access, AccessError},
    driver::{self, Driver, Event, EventSender},
    engine::EngineConfig,
    gate::Gate,
    limits::{
        CALLS_PER_CONNECTION_MAX, CONNECTIONS_MAX, HEADERS_LEN_MAX, KEEPALIVE, SHUTDOWN_GRACE,
    },
    listener,
    metrics::{Instruments, Source},
    rpc::{Evaluations, Experiments, Fleet, WelcomeTimes, Workers},
    shared_store::SharedStore,
    store::{Experiment, Store, StoreError},
    submission::Runnable,
};

/// How to run a coordinator.
#[derive(Debug, Clone)]
pub struct CoordinatorConfig {
    /// Address to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Directory of the database.
    pub data_dir: PathBuf,
    /// How often workers give a sign of life.
    pub heartbeat_interval: Duration,
    /// Silence after which a worker loses its items.
    pub lease: Duration,
    /// Share of the individuals, 0 to 1, that two workers compute, so that a faulty
    /// one is found.
    pub audit_fraction: f64,
    /// Who may connect.
    pub access: Access,
    /// Where metrics can be scraped, if anywhere; port 0 takes a free one.
    pub metrics_listen: Option<SocketAddr>,
}

impl CoordinatorConfig {
    /// The usual times: a heartbeat every 2 s, a lease of 10 s; no audits, no metrics.
    /// Access is open, and so for loopback only.
    pub fn new(listen: SocketAddr, data_dir: PathBuf) -> Self {
        Self {
            listen,
            data_dir,
            heartbeat_interval: Duration::from_secs(2),
            lease: Duration::from_secs(10),
            audit_fraction: 0.0,
            access: Access::default(),
            metrics_listen: None,
        }
    }
}

/// Why a coordinator does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The address is open to more than this machine, and access to everybody.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// The certificate, its key or the authorities cannot be used.
    #[error("the TLS files cannot be used: {0}")]
    Tls(String),
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {source}; is another coordinator running there?")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// Metrics cannot be served.
    #[error(transparent)]
    Metrics(#[from] ListenError),
    /// The store cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A thread ended that must not.
    #[error("opening the store panicked; please report this")]
    Panicked,
}

/// Why a running coordinator cannot go on. What it has committed is safe; started
/// again, it goes on from there.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A bug.
    #[error(
        "the driver ended ({0}); please report this. \
         Started again, the coordinator goes on from the last completed generation"
    )]
    Driver(String),
    /// Connections are no longer accepted.
    #[error("the server ended ({0}); start the coordinator again")]
    Server(String),
}

/// A coordinator that runs in the background.
#[derive(Debug)]
pub struct Coordinator {
    local_addr: SocketAddr,
    shutdown: CancellationToken,
    /// One task; none once its end is known. So is `server`.
    driver: JoinSet<()>,
    server: JoinSet<Result<(), tonic::transport::Error>>,
    /// Ends when it is dropped.
    _metrics: JoinSet<Infallible>,
}

impl Coordinator {
    /// Opens the store, goes on with unfinished experiments, listens.
    pub async fn start(config: CoordinatorConfig) -> Result<Self, StartError> {
        let address = config.listen;
        let Access { tokens, tls, .. } = config.access.clone();
        config.access.check(address)?;
        let mut server = Server::builder()
            .http2_keepalive_interval(Some(KEEPALIVE))
            .http2_keepalive_timeout(Some(KEEPALIVE))
            .http2_max_header_list_size(HEADERS_LEN_MAX)
            .max_concurrent_streams(CALLS_PER_CONNECTION_MAX);
        let is_encrypted = tls.is_some();
        if let Some(tls) = tls {
            server = server
                .tls_config(tls.to_tonic())
                .map_err(|error| StartError::Tls(cause(&error)))?;
        }
        let listen_error = |source| StartError::Listen { address, source };
        let listener = TcpListener::bind(address).await.map_err(listen_error)?;
        let local_addr = listener.local_addr().map_err(listen_error)?;
        let endpoint = match config.metrics_listen {
            Some(address) => Some(Endpoint::listen(address).await?),
            None => None,
        };
        let data_dir = config.data_dir.clone();
        let store = tokio::task::spawn_blocking(move || Store::open(&data_dir))
            .await
            .map_err(|_| StartError::Panicked)??;
        let store = SharedStore::new(store);

        let shutdown = CancellationToken::new();
        let (events, event_queue) = driver::channel();
        let engine = EngineConfig {
            audit_fraction: config.audit_fraction,
            ..EngineConfig::new(config.lease)
        };
        let mut driver = JoinSet::new();
        let instruments = Instruments::default();
        let calls = instruments.calls.clone();
        let running = Driver::new(store.clone(), event_queue, engine, shutdown.clone())
            .measured_by(instruments.clone());
        driver.spawn(running.run());
        resume_unfinished(&store, &events).await?;

        let mut metrics = JoinSet::new();
        if let Some(endpoint) = endpoint {
            let source = Source { events: events.clone(), store: store.clone(), instruments };
            metrics.spawn(endpoint.serve(move || source.clone().scrape()));
        }
        let times =
            WelcomeTimes { heartbeat_interval: config.heartbeat_interval, lease: config.lease };
        let workers = Workers { events: events.clone(), times, shutdown: shutdown.clone() };
        let fleet = Fleet { events: events.clone() };
        let evaluations = Evaluations::new(events.clone(), shutdown.clone());
        let experiments = Experiments { events, store, shutdown: shutdown.clone() };
        let (health_reporter, health) = tonic_health::server::health_reporter();
        health_reporter.set_serving::<EvaluationServiceServer<Evaluations>>().await;
        health_reporter.set_serving::<ExperimentServiceServer<Experiments>>().await;
        health_reporter.set_serving::<FleetServiceServer<Fleet>>().await;
        health_reporter.set_serving::<WorkerServiceServer<Workers>>().await;
        let reflection = || {
            tonic_reflection::server::Builder::configure()
                .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
                .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        };
        const VALID: &str = "the descriptors come from the build";
        let reflection_v1 = reflection().build_v1().expect(VALID);
        // The same under its former name, which tools still ask for: Evans, older grpcurl.
        let reflection_v1alpha = reflection().build_v1alpha().expect(VALID);
        let has_tokens = tokens.is_some();
        let workers = WorkerServiceServer::new(workers)
            .max_decoding_message_size(TO_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(FROM_COORDINATOR_LEN_MAX);
        let fleet = FleetServiceServer::new(fleet)
            .max_decoding_message_size(TO_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(FROM_COORDINATOR_LEN_MAX);
        let evaluations = EvaluationServiceServer::new(evaluations)
            .max_decoding_message_size(TO_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(FROM_COORDINATOR_LEN_MAX);
        let experiments = ExperimentServiceServer::new(experiments)
            .max_decoding_message_size(TO_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(FROM_COORDINATOR_LEN_MAX);
        let serving = server
            .layer(calls)
            .layer(Gate::new(tokens))
            .add_service(health)
            .add_service(reflection_v1)
            .add_service(reflection_v1alpha)
            .add_service(workers)
            .add_service(fleet)
            .add_service(experiments)
            .add_service(evaluations)
            .serve_with_incoming_shutdown(
                listener::accept(listener, CONNECTIONS_MAX, shutdown.clone()),
                shutdown.clone().cancelled_owned(),
            );
        let mut server = JoinSet::new();
        server.spawn(serving);
        info!(
            address = %local_addr, data_dir = %config.data_dir.display(),
            tls = is_encrypted, tokens = has_tokens,
            "coordinator listens"
        );
        if !is_encrypted && !local_addr.ip().to_canonical().is_loopback() {
            warn!("there is no TLS: every member of the network can read all traffic, tokens too");
        }
        Ok(Self { local_addr, shutdown, driver, server, _metrics: metrics })
    }

    /// The address it listens on.
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Waits for a part of it to end, which none does before [`Self::shutdown`].
    pub async fn failure(&mut self) -> RunError {
        tokio::select! {
            Some(ended) = self.driver.join_next() => RunError::Driver(match ended {
                Ok(()) => "nobody asked it to".to_owned(),
                Err(error) => error.to_string(),
            }),
            Some(ended) = self.server.join_next() => RunError::Server(match ended {
                Ok(Ok(())) => "nobody asked it to".to_owned(),
                Ok(Err(error)) => error.to_string(),
                Err(error) => error.to_string(),
            }),
            else => std::future::pending().await,
        }
    }

    /// Stops: what is being stored is stored, streams are ended. Nothing that
    /// was committed is lost; generations that were being judged are judged
    /// again at the next start.
    pub async fn shutdown(mut self) {
        self.shutdown.cancel();
        if let Some(Err(error)) = self.driver.join_next().await {
            error!("the driver panicked: {error}; please report this");
        }
        // If that takes too long, dropping the task ends it.
        let _ = tokio::time::timeout(SHUTDOWN_GRACE, self.server.join_next()).await;
    }
}

/// What is wrong with the TLS files.
fn cause(error: &tonic::transport::Error) -> String {
    let source = || std::error::Error::source(error).map(ToString::to_string);
    tls_diagnosis(error).or_else(source).unwrap_or_else(|| error.to_string())
}

/// Hands every unfinished experiment that this program can compute to the
/// driver.
async fn resume_unfinished(store: &SharedStore, events: &EventSender) -> Result<(), StoreError> {
    let unfinished: Vec<(Experiment, Option<String>)> = store
        .read(|store| {
            let mut experiments = store.experiments()?;
            experiments.retain(|experiment| experiment.state.is_unfinished());
            experiments
                .into_iter()
                .map(|experiment| {
                    let checkpoint = store.checkpoint(experiment.id)?;
                    Ok((experiment, checkpoint))
                })
                .collect()
        })
        .await?;
    for (experiment, checkpoint) in unfinished {
        let id = experiment.id;
        if experiment.fingerprint != sim_core::FINGERPRINT {
            warn!(
                experiment = %id,
                "experiment waits: it was started with \"{}\", this is \"{}\"; \
                 finish it with that release, or cancel it and submit it again",
                experiment.fingerprint,
                sim_core::FINGERPRINT
            );
            continue;
        }
        let checkpoint =
            checkpoint.ok_or_else(|| StoreError::Corrupt(format!("no checkpoint of {id}")))?;
        let runnable =
            tokio::task::spawn_blocking(move || Runnable::restore(&experiment, &checkpoint))
                .await
                .map_err(|_| {
                    StoreError::Corrupt(format!("restoring experiment {id} panicked"))
                })??;
        // The driver runs for as long as the coordinator does.
        let _ = events.send(Event::ExperimentReady(Box::new(runnable))).await;
    }
    Ok(())
}
