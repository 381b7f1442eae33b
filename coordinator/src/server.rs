//! A running coordinator: store, driver and gRPC server together.

use std::{io, net::SocketAddr, path::PathBuf, time::Duration};

use swarm_proto::{
    FILE_DESCRIPTOR_SET,
    v1::{
        experiment_service_server::ExperimentServiceServer,
        worker_service_server::WorkerServiceServer,
    },
};
use tokio::{net::TcpListener, task::JoinHandle};
use tokio_stream::wrappers::TcpListenerStream;
use tokio_util::sync::CancellationToken;
use tonic::transport::Server;
use tracing::{error, info, warn};

use crate::{
    driver::{self, Driver, Event, EventSender},
    rpc::{Experiments, WelcomeTimes, Workers},
    shared_store::SharedStore,
    store::{Experiment, ExperimentState, Store, StoreError},
    submission::Runnable,
};

/// Largest message from the network, bytes.
const MESSAGE_LEN_MAX: usize = 16 << 20;
/// Time for open streams to end at shutdown.
const SHUTDOWN_GRACE: Duration = Duration::from_secs(5);
/// A peer that does not answer pings for so long is gone.
const KEEPALIVE: Duration = Duration::from_secs(20);

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
}

impl CoordinatorConfig {
    /// The usual times: a heartbeat every 2 s, a lease of 10 s.
    pub fn new(listen: SocketAddr, data_dir: PathBuf) -> Self {
        let (heartbeat_interval, lease) = (Duration::from_secs(2), Duration::from_secs(10));
        Self { listen, data_dir, heartbeat_interval, lease }
    }
}

/// Why a coordinator does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {source}; is another coordinator running there?")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The store cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A thread ended that must not.
    #[error("opening the store panicked; please report this")]
    Panicked,
}

/// A coordinator that runs in the background.
#[derive(Debug)]
pub struct Coordinator {
    local_addr: SocketAddr,
    shutdown: CancellationToken,
    driver: JoinHandle<()>,
    server: JoinHandle<Result<(), tonic::transport::Error>>,
}

impl Coordinator {
    /// Opens the store, goes on with unfinished experiments, listens.
    pub async fn start(config: CoordinatorConfig) -> Result<Self, StartError> {
        let address = config.listen;
        let listen_error = |source| StartError::Listen { address, source };
        let listener = TcpListener::bind(address).await.map_err(listen_error)?;
        let local_addr = listener.local_addr().map_err(listen_error)?;
        let data_dir = config.data_dir.clone();
        let store = tokio::task::spawn_blocking(move || Store::open(&data_dir))
            .await
            .map_err(|_| StartError::Panicked)??;
        let store = SharedStore::new(store);

        let shutdown = CancellationToken::new();
        let (events, event_queue) = driver::channel();
        let driver = Driver::new(store.clone(), event_queue, config.lease, shutdown.clone());
        let driver = tokio::spawn(driver.run());
        resume_unfinished(&store, &events).await?;

        let times =
            WelcomeTimes { heartbeat_interval: config.heartbeat_interval, lease: config.lease };
        let workers = Workers { events: events.clone(), times, shutdown: shutdown.clone() };
        let experiments = Experiments { events, store, shutdown: shutdown.clone() };
        let (health_reporter, health) = tonic_health::server::health_reporter();
        health_reporter.set_serving::<ExperimentServiceServer<Experiments>>().await;
        health_reporter.set_serving::<WorkerServiceServer<Workers>>().await;
        let reflection = tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
            .build_v1()
            .expect("the descriptors come from the build");
        let server = Server::builder()
            .tcp_nodelay(true)
            .http2_keepalive_interval(Some(KEEPALIVE))
            .http2_keepalive_timeout(Some(KEEPALIVE))
            .add_service(health)
            .add_service(reflection)
            .add_service(
                WorkerServiceServer::new(workers).max_decoding_message_size(MESSAGE_LEN_MAX),
            )
            .add_service(
                ExperimentServiceServer::new(experiments)
                    .max_decoding_message_size(MESSAGE_LEN_MAX),
            )
            .serve_with_incoming_shutdown(
                TcpListenerStream::new(listener),
                shutdown.clone().cancelled_owned(),
            );
        let server = tokio::spawn(server);
        info!(address = %local_addr, data_dir = %config.data_dir.display(), "coordinator listens");
        Ok(Self { local_addr, shutdown, driver, server })
    }

    /// The address it listens on.
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Stops: what is being stored is stored, streams are ended. Nothing that
    /// was committed is lost; generations that were being judged are judged
    /// again at the next start.
    pub async fn shutdown(self) {
        self.shutdown.cancel();
        if let Err(error) = self.driver.await {
            error!("the driver panicked: {error}; please report this");
        }
        let abort = self.server.abort_handle();
        if tokio::time::timeout(SHUTDOWN_GRACE, self.server).await.is_err() {
            abort.abort();
        }
    }
}

/// Hands every unfinished experiment that this program can compute to the
/// driver.
async fn resume_unfinished(store: &SharedStore, events: &EventSender) -> Result<(), StoreError> {
    let unfinished: Vec<(Experiment, Option<String>)> = store
        .read(|store| {
            let mut experiments = store.experiments()?;
            experiments.retain(|experiment| experiment.state == ExperimentState::Running);
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
