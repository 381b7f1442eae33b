//! How to run a coordinator, and why it does not start or does not go on.

use std::{io, net::SocketAddr, path::PathBuf, time::Duration};

use swarm_telemetry::ListenError;

use super::access::{Access, AccessError};
use crate::{limits::MEMORY_BUDGET_MIB, referee::RefereeProgram, store::StoreError};

/// How to run a coordinator.
#[derive(Debug, Clone)]
pub struct CoordinatorConfig {
    /// Address to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Directory of the database.
    pub data_dir: PathBuf,
    /// Whether other programs that want the data directory are told the address.
    pub is_announced: bool,
    /// Whether unfinished experiments go on at once; else each does when somebody resumes it or
    /// submits it again.
    pub takes_up_unfinished: bool,
    /// How often workers give a sign of life.
    pub heartbeat_interval: Duration,
    /// Silence after which a worker loses its items.
    pub lease: Duration,
    /// Share of the individuals, 0 to 1, that two workers compute, so that a faulty
    /// one is found.
    pub audit_fraction: f64,
    /// Bytes of memory that all unfinished experiments may take together, as estimated.
    pub memory_budget: u64,
    /// The program that checks single results: [`serve_stdio`](crate::referee::serve_stdio)
    /// has to be behind it.
    pub referee: RefereeProgram,
    /// Who may connect.
    pub access: Access,
    /// Where pages are served, if anywhere; port 0 takes a free one.
    pub web_listen: Option<SocketAddr>,
    /// Where metrics can be scraped, if anywhere; port 0 takes a free one.
    pub metrics_listen: Option<SocketAddr>,
}

impl CoordinatorConfig {
    /// The usual times: a heartbeat every 2 s, a lease of 10 s; no audits, no metrics.
    /// Access is open, and so for loopback only. The referee is this program, with the
    /// argument `referee`.
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
    /// There are no threads for it.
    #[error("the system gives this program no threads: {0}")]
    Runtime(io::Error),
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
    /// Another coordinator uses the data directory, and goes on there.
    #[error("{0}")]
    TakenOver(String),
    /// The database is damaged.
    #[error("{0}")]
    Damaged(String),
    /// Connections are no longer accepted.
    #[error("the server ended ({0}); start the coordinator again")]
    Server(String),
}
