//! A running coordinator: store, driver and gRPC server together.

mod access;
mod call_layer;
pub mod calls;
mod config;
mod core;
mod door;
mod gate;
mod in_process;
mod intake;
mod outflow;
mod pages;
mod services;

use std::{
    convert::Infallible,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::PathBuf,
};

use swarm_telemetry::Endpoint;
use swarm_transport::{listening, tls_diagnosis};
use tokio::{net::TcpListener, task::JoinSet};
use tonic::transport::Server;
use tracing::{info, warn};

use crate::{
    limits::{CONNECTIONS, SHUTDOWN_GRACE},
    shared_store::{SharedStore, Unusable},
    store::Store,
};

pub use access::{Access, AccessError, Role, Tls, Tokens};
pub use config::{CoordinatorConfig, RunError, StartError};
pub use door::Door;
pub use in_process::InProcess;

use self::core::Core;
use gate::Gate;

/// A coordinator that runs in the background.
#[derive(Debug)]
pub struct Coordinator {
    local_addr: SocketAddr,
    web_addr: Option<SocketAddr>,
    core: Core,
    door: Door,
    /// One task; empty once its end is known.
    server: JoinSet<Result<(), tonic::transport::Error>>,
    /// Dropping it ends the task.
    _metrics: JoinSet<Infallible>,
    /// Shutdown or dropping it ends the task.
    pages: JoinSet<()>,
}

impl Coordinator {
    /// Opens the store, continues unfinished experiments, and listens.
    pub async fn start(config: CoordinatorConfig) -> Result<Self, StartError> {
        let Access { tokens, tls, .. } = config.access.clone();
        config.access.check(config.listen)?;
        if let Some(address) = config.web_listen {
            config.access.check(address)?;
        }
        let site = pages::Builder::new(&config.access)?;
        let (is_encrypted, has_tokens) = (tls.is_some(), tokens.is_some());
        let builder = with_tls(services::builder(), tls)?;
        let (listener, local_addr) = listen(config.listen).await?;
        let metrics_endpoint = match config.metrics_listen {
            Some(address) => Some(Endpoint::listen(address).await?),
            None => None,
        };
        let web_listener = match config.web_listen {
            Some(address) => Some(listen(address).await?),
            None => None,
        };
        let store = open(config.data_dir.clone()).await?;
        if config.is_announced {
            let announced = announced(local_addr, is_encrypted);
            store.read(move |store| store.announce(&announced)).await;
        }
        let mut core = Core::start(store, &config).await?;
        match config.takes_up_unfinished {
            true => core.control.run_unfinished().await?,
            false => core.control.leave_unfinished().await?,
        }

        let mut metrics = JoinSet::new();
        if let Some(endpoint) = metrics_endpoint {
            let source = core.metrics();
            metrics.spawn(endpoint.serve(move || source.clone().scrape()));
        }
        let mut pages = JoinSet::new();
        let web_addr = web_listener.as_ref().map(|(_, address)| *address);
        if let Some((listener, _)) = web_listener {
            let site = site.site(&config.data_dir, core.store.news(), core.experiments())?;
            pages.spawn(pages::serve(site, listener, core.shutdown.clone()));
        }
        let mut server = JoinSet::new();
        server.spawn(core.services().serve(
            builder,
            listening::accept(listener, CONNECTIONS, core.shutdown.clone()),
            core.instruments.calls.clone(),
            Gate::new(tokens),
            core.shutdown.clone(),
        ));
        let door = core.open_door();
        info!(
            address = %local_addr, data_dir = %config.data_dir.display(),
            tls = is_encrypted, tokens = has_tokens,
            "coordinator listens"
        );
        if !is_encrypted && !local_addr.ip().to_canonical().is_loopback() {
            warn!("there is no TLS: every member of the network can read all traffic, tokens too");
        }
        if let Some(address) = web_addr {
            info!(%address, "pages are served");
        }
        Ok(Self { local_addr, web_addr, core, door, server, _metrics: metrics, pages })
    }

    /// The address it listens on.
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// The address of its pages, if it serves any.
    pub fn web_addr(&self) -> Option<SocketAddr> {
        self.web_addr
    }

    /// The door to its services for this process.
    pub fn door(&self) -> &Door {
        &self.door
    }

    /// Waits for a part of it to end. Before [`Self::shutdown`], that is an error.
    pub async fn failure(&mut self) -> RunError {
        tokio::select! {
            unusable = self.core.store.unusable() => match unusable {
                Unusable::TakenOver(why) => RunError::TakenOver(why),
                Unusable::Damaged(why) => RunError::Damaged(why),
            },
            Some(ended) = self.core.driver.join_next() => RunError::Driver(match ended {
                Ok(()) => "without a request to stop".to_owned(),
                Err(error) => error.to_string(),
            }),
            Some(ended) = self.server.join_next() => RunError::Server(match ended {
                Ok(Ok(())) => "without a request to stop".to_owned(),
                Ok(Err(error)) => error.to_string(),
                Err(error) => error.to_string(),
            }),
            else => std::future::pending().await,
        }
    }

    /// Stops: finishes writes in progress, and ends all streams. No commit is lost; after a
    /// restart, the fleet evaluates unfinished generations again.
    pub async fn shutdown(mut self) {
        self.core.stop().await;
        // If the server takes too long, dropping the task ends it.
        let servers = async { tokio::join!(self.server.join_next(), self.pages.join_next()) };
        let _ = tokio::time::timeout(SHUTDOWN_GRACE, servers).await;
    }
}

fn with_tls(server: Server, tls: Option<Tls>) -> Result<Server, StartError> {
    match tls {
        Some(tls) => {
            server.tls_config(tls.to_tonic()).map_err(|error| StartError::Tls(cause(&error)))
        }
        None => Ok(server),
    }
}

/// The address for clients on this machine.
fn announced(mut address: SocketAddr, is_encrypted: bool) -> String {
    if address.ip().is_unspecified() {
        address.set_ip(IpAddr::V4(Ipv4Addr::LOCALHOST));
    }
    format!("{}://{address}", if is_encrypted { "https" } else { "http" })
}

async fn listen(address: SocketAddr) -> Result<(TcpListener, SocketAddr), StartError> {
    let listen_error = |source| StartError::Listen { address, source };
    let listener = listening::bind(address).map_err(listen_error)?;
    let local_addr = listener.local_addr().map_err(listen_error)?;
    Ok((listener, local_addr))
}

async fn open(data_dir: PathBuf) -> Result<SharedStore, StartError> {
    let store = tokio::task::spawn_blocking(move || Store::open(&data_dir))
        .await
        .map_err(|_| StartError::Panicked)??;
    Ok(SharedStore::new(store))
}

/// Why the TLS files cannot be used.
fn cause(error: &tonic::transport::Error) -> String {
    let source = || std::error::Error::source(error).map(ToString::to_string);
    tls_diagnosis(error).or_else(source).unwrap_or_else(|| error.to_string())
}
