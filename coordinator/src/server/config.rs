//! The configuration of a coordinator, and the errors that keep it from starting or running.

use std::{io, net::SocketAddr, path::PathBuf, time::Duration};

use swarm_telemetry::ListenError;

use super::access::{Access, AccessError};
use crate::{limits::MEMORY_BUDGET_MIB, referee::RefereeProgram, store::StoreError};

/// The configuration of a coordinator.
#[derive(Debug, Clone)]
pub struct CoordinatorConfig {
    /// Address to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Directory of the database.
    pub data_dir: PathBuf,
    /// Whether to announce the address to other programs that want the data directory.
    pub is_announced: bool,
    /// Whether to continue unfinished experiments at once; otherwise each continues when a client
    /// resumes or resubmits it.
    pub takes_up_unfinished: bool,
    /// Time between heartbeats of a worker.
    pub heartbeat_interval: Duration,
    /// Time of silence after which a worker loses its items.
    pub lease: Duration,
    /// Share of the individuals, 0 to 1, that two workers compute, to find faulty workers.
    pub audit_fraction: f64,
    /// Bytes of memory that all unfinished experiments may take together, as estimated.
    pub memory_budget: u64,
    /// The program that checks single results, which must call
    /// [`serve_stdio`](crate::referee::serve_stdio).
    pub referee: RefereeProgram,
    /// Tokens and encryption.
    pub access: Access,
    /// Address for the pages, if any; port 0 takes a free one.
    pub web_listen: Option<SocketAddr>,
    /// Address for metrics, if any; port 0 takes a free one.
    pub metrics_listen: Option<SocketAddr>,
}

impl CoordinatorConfig {
    /// The defaults: a heartbeat every 2 s, a lease of 10 s, no audits, no metrics. Access is
    /// open, so it is for loopback only. The referee is this program, with the argument
    /// `referee`.
    pub fn new(listen: SocketAddr, data_dir: PathBuf) -> Self {
        Self {
            listen,
            data_dir,
            is_announced: true,
            takes_up_unfinished: true,
            heartbeat_interval: Duration::from_secs(2),
            lease: Duration::from_secs(10),
            audit_fraction: 0.0,
            memory_budget: u64::from(MEMORY_BUDGET_MIB) << 20,
            referee: RefereeProgram::this_program(),
            access: Access::default(),
            web_listen: None,
            metrics_listen: None,
        }
    }
}

/// Why a coordinator does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The address is reachable from other machines, and access is open to everybody.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// The certificate, its key or the authorities cannot be used.
    #[error("the TLS files cannot be used: {0}")]
    Tls(String),
    /// Listening on the address failed.
    #[error("cannot listen on {address}: {source}; is another coordinator running there?")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's error.
        source: io::Error,
    },
    /// Metrics cannot be served.
    #[error(transparent)]
    Metrics(#[from] ListenError),
    /// The store cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The system gives the program no threads.
    #[error("the system gives this program no threads: {0}")]
    Runtime(io::Error),
    /// A thread panicked.
    #[error("opening the store panicked; please report this")]
    Panicked,
}

/// Why a running coordinator cannot continue. Its commits are safe; after a restart, it continues
/// from there.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A bug.
    #[error(
        "the driver ended ({0}); please report this. \
         After a restart, the coordinator continues from the last completed generation"
    )]
    Driver(String),
    /// Another coordinator has taken over the data directory.
    #[error("{0}")]
    TakenOver(String),
    /// The database is damaged.
    #[error("{0}")]
    Damaged(String),
    /// Connections are no longer accepted.
    #[error("the server ended ({0}); start the coordinator again")]
    Server(String),
}
