//! A worker: it computes the fitness of genotypes for a coordinator, and stores nothing that
//! matters.
//!
//! [`run`] is the whole worker: it connects, serves and reconnects until it is told to stop.

mod assignment;
mod convert;
mod evaluators;
mod lifetime;
pub mod metrics;
mod pool;
pub mod program;
mod session;
mod session_file;
mod stats;

use std::{io, path::PathBuf, sync::Arc, time::Duration};

use sim_core::Isa;
use swarm_proto::{SLOTS_MAX, WORKER_NAME_LEN_MAX};
use swarm_transport::{Backoff, Banner, Credentials, Link, LinkError, banner};
use tokio_util::sync::CancellationToken;
use tracing::{info, warn};

use crate::{
    evaluators::Evaluators,
    pool::{Evaluator, Pool},
    session::{Ended, OpenError, Session},
    session_file::SessionFile,
};
pub use crate::{
    lifetime::{Expired, Lifetime, Watchdog},
    session_file::{Unhealthy, health_check},
    stats::{Stats, StatsSnapshot},
};

/// The configuration of a worker.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    /// Where the coordinator listens, such as `http://127.0.0.1:7700`.
    pub coordinator: String,
    /// Name for logs, 1 to [`WORKER_NAME_LEN_MAX`] bytes.
    pub name: String,
    /// Number of items computed at the same time, each on a thread of its own,
    /// 1 to [`SLOTS_MAX`].
    pub slots: usize,
    /// Pattern, up to [`WORKER_NAME_LEN_MAX`] bytes: the worker takes items of experiments with a
    /// matching name. `*` stands for any text and `?` for one character. Empty: all.
    pub experiments: String,
    /// Upper bound of the random delay before the first reconnection. The bound doubles with every
    /// failed attempt.
    pub retry_delay_min: Duration,
    /// Largest value of this bound.
    pub retry_delay_max: Duration,
    /// The token and certificates for the coordinator.
    pub credentials: Credentials,
    /// Vector instructions to compute with. They change the speed, and no bit of a result.
    pub isa: Isa,
    /// Counters of its work.
    pub stats: Arc<Stats>,
    /// File that shows [`health_check`] whether the worker has a session with the coordinator.
    pub session_file: Option<PathBuf>,
    /// After `shutdown`, ends items of scripts that are still in progress, because they may take
    /// any time. Other workers recompute them.
    pub give_up: CancellationToken,
}

impl WorkerConfig {
    /// The defaults: the delay before a reconnection is up to 250 ms at first, and up to 10 s
    /// later.
    pub fn new(coordinator: impl Into<String>, name: impl Into<String>, slots: usize) -> Self {
        Self {
            coordinator: coordinator.into(),
            name: name.into(),
            slots,
            experiments: String::new(),
            retry_delay_min: Duration::from_millis(250),
            retry_delay_max: Duration::from_secs(10),
            credentials: Credentials::default(),
            isa: Isa::best(),
            stats: Arc::default(),
            session_file: None,
            give_up: CancellationToken::new(),
        }
    }
}

/// Time for which a worker continues items of scripts after a signal to stop.
pub const FINISHING_TIME: Duration = Duration::from_millis(700);

/// Why a worker gave up. Temporary problems, such as a coordinator that is down or a broken
/// connection, never become this error: the worker tries again.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The coordinator's address is invalid, or the credentials do not fit it. Fix the input.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A name that the protocol cannot carry. Fix the input.
    #[error("a worker's name has 1 to {WORKER_NAME_LEN_MAX} bytes, this one has {0}")]
    Name(usize),
    /// A pattern that the protocol cannot carry. Fix the input.
    #[error("a pattern of experiments has at most {WORKER_NAME_LEN_MAX} bytes, this one has {0}")]
    Experiments(usize),
    /// A number of slots that the protocol does not allow. Fix the input.
    #[error("a worker has 1 to {SLOTS_MAX} slots, not {0}")]
    Slots(usize),
    /// Coordinator and worker would not compute the same bits. Install the same
    /// version of both.
    #[error(
        "the coordinator at {address} refused this worker: {refusal}; this worker speaks protocol {} \
         and computes with {}",
        swarm_proto::PROTOCOL_VERSION,
        sim_core::FINGERPRINT
    )]
    VersionMismatch {
        /// Address of the coordinator.
        address: String,
        /// The coordinator's reason, which names its version.
        refusal: String,
    },
    /// Another service answers at the address, and this worker has never had a session.
    /// Fix the address.
    #[error(
        "the server at {address} is not a coordinator: it answers \"{banner}\"; is this the right \
         port?"
    )]
    AnotherService {
        /// The address.
        address: String,
        /// The first line of the server's answer.
        banner: String,
    },
    /// The coordinator requires another token or certificate. Fix the credentials.
    #[error("the coordinator at {address} does not let this worker in: {refusal}")]
    Denied {
        /// Address of the coordinator.
        address: String,
        /// The coordinator's reason.
        refusal: String,
    },
    /// The session file cannot be written. Fix the input.
    #[error("cannot write the session file {}: {source}", path.display())]
    SessionFile {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The operating system gave no thread.
    #[error("cannot start the threads that compute: {0}")]
    Threads(#[from] io::Error),
}

impl WorkerError {
    /// Whether the configuration is at fault.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Link(_)
                | Self::Name(_)
                | Self::Experiments(_)
                | Self::Slots(_)
                | Self::SessionFile { .. }
        )
    }
}

/// Works for the coordinator until `shutdown` is cancelled. Then it finishes its items in
/// progress, delivers their results, and returns. [`WorkerConfig::give_up`] ends items of
/// scripts.
///
/// If the coordinator is down or goes away, the worker tries again without limit, after growing
/// random delays. If another service answers at the address, and the worker has never reached a
/// coordinator there, it gives up.
///
/// # Errors
///
/// If the configuration is invalid, if the coordinator refuses the worker's version or
/// credentials, or if the system gives no threads.
pub async fn run(config: WorkerConfig, shutdown: CancellationToken) -> Result<(), WorkerError> {
    let evaluators = Evaluators::new(config.isa, Arc::clone(&config.stats));
    run_with(config, shutdown, |config_json| evaluators.get(&config_json)).await
}

/// [`run`] with another way to make specifications computable.
async fn run_with(
    config: WorkerConfig,
    shutdown: CancellationToken,
    evaluator: impl Fn(String) -> Evaluator + Sync,
) -> Result<(), WorkerError> {
    let link = link(&config)?;
    let session_file = session_file(&config)?;
    let pool = Pool::start(config.slots, Arc::clone(&config.stats))?;
    let config = WorkerConfig { slots: pool.n_slots(), ..config };
    let stats = &config.stats;
    // 0 means unknown.
    let process_id = rand::random::<u64>().max(1);
    let mut backoff = Backoff::new(config.retry_delay_min, config.retry_delay_max);
    let mut was_connected = false;
    loop {
        let opened = tokio::select! {
            biased;
            () = shutdown.cancelled() => return Ok(()),
            opened = Session::open(&link, &config, process_id) => opened,
        };
        let (what, reason) = match opened {
            Ok(session) => {
                stats.on_connected();
                was_connected = true;
                info!(
                    coordinator = config.coordinator,
                    name = config.name,
                    worker_id = session.worker_id(),
                    slots = config.slots,
                    "connected"
                );
                let worker_id = session.worker_id();
                let session = session.serve(&pool, &shutdown, &config.give_up, &evaluator);
                let ended = match &session_file {
                    None => session.await,
                    Some(file) => {
                        let who = format!("worker {worker_id} of {}", config.coordinator);
                        file.during(&who, session).await
                    }
                };
                stats.on_disconnected();
                // The remaining assignments belong to the ended stream, so other workers compute
                // them.
                pool.cancel(|_| true);
                match ended {
                    Ended::Drained => return Ok(()),
                    Ended::Lost { reason, worked } => {
                        if worked {
                            backoff.reset();
                        }
                        ("connection lost", reason)
                    }
                }
            }
            Err(OpenError::VersionMismatch(refusal)) => {
                return Err(WorkerError::VersionMismatch { address: config.coordinator, refusal });
            }
            Err(OpenError::Denied(refusal)) => {
                return Err(WorkerError::Denied { address: config.coordinator, refusal });
            }
            Err(OpenError::Refused(reason)) => {
                stats.on_connection_failed();
                ("refused", reason)
            }
            Err(OpenError::Unreachable(reason)) => {
                stats.on_connection_failed();
                ("cannot connect", reason)
            }
        };
        let banner = if was_connected { None } else { banner(&link.authority()).await };
        let reason = match banner {
            Some(Banner::Line(banner)) if !is_of_gateway(&banner) => {
                return Err(WorkerError::AnotherService { address: config.coordinator, banner });
            }
            Some(Banner::Tls) if !config.coordinator.starts_with("https:") => {
                "it speaks TLS; use https:// and --tls-ca".to_owned()
            }
            _ => reason,
        };
        let delay = backoff.next_delay(rand::random());
        warn!(
            coordinator = config.coordinator,
            name = config.name,
            reason,
            "{what}, retrying in {:.1} s",
            delay.as_secs_f64()
        );
        tokio::select! {
            biased;
            () = shutdown.cancelled() => return Ok(()),
            () = tokio::time::sleep(delay) => {}
        }
    }
}

/// Whether the answer comes from a gateway whose coordinator does not run.
fn is_of_gateway(banner: &str) -> bool {
    let status = banner.strip_prefix("HTTP/").and_then(|rest| rest.split(' ').nth(1));
    matches!(status, Some("502" | "503" | "504"))
}

fn session_file(config: &WorkerConfig) -> Result<Option<SessionFile>, WorkerError> {
    let file = |path: &PathBuf| {
        SessionFile::new(path.clone())
            .map_err(|source| WorkerError::SessionFile { path: path.clone(), source })
    };
    config.session_file.as_ref().map(file).transpose()
}

/// Checks the configuration and describes the connection.
fn link(config: &WorkerConfig) -> Result<Link, WorkerError> {
    if !(1..=WORKER_NAME_LEN_MAX).contains(&config.name.len()) {
        return Err(WorkerError::Name(config.name.len()));
    }
    if config.experiments.len() > WORKER_NAME_LEN_MAX {
        return Err(WorkerError::Experiments(config.experiments.len()));
    }
    if !(1..=SLOTS_MAX as usize).contains(&config.slots) {
        return Err(WorkerError::Slots(config.slots));
    }
    let mut link = Link::new(&config.coordinator, &config.credentials)?;
    link.endpoint = link
        .endpoint
        .connect_timeout(Duration::from_secs(5))
        // If the coordinator's machine vanishes, only pings find out, because nothing closes the
        // connection.
        .http2_keep_alive_interval(Duration::from_secs(10))
        .keep_alive_timeout(Duration::from_secs(10))
        .keep_alive_while_idle(true);
    Ok(link)
}

#[cfg(test)]
mod tests {
    use std::{io::Write as _, net::TcpListener, thread};

    use super::*;

    fn rejection(coordinator: &str, name: &str, slots: usize) -> WorkerError {
        link(&WorkerConfig::new(coordinator, name, slots)).unwrap_err()
    }

    #[test]
    fn values_that_the_protocol_cannot_carry_are_input_errors() {
        let url = "http://127.0.0.1:7700";
        for error in [
            rejection("", "w", 1),
            rejection("127.0.0.1:7700", "w", 1),
            rejection("not an address", "w", 1),
            rejection("ftp://host:1", "w", 1),
            rejection(url, "", 1),
            rejection(url, &"w".repeat(129), 1),
            rejection(url, "w", 0),
            rejection(url, "w", 4097),
        ] {
            assert!(error.is_input(), "{error}");
        }
        assert!(link(&WorkerConfig::new(url, "w", 4096)).is_ok());
    }

    #[tokio::test]
    async fn another_service_ends_a_worker_and_a_gateway_does_not() {
        let answering = |line: &'static [u8]| {
            let listener = TcpListener::bind("127.0.0.1:0").unwrap();
            let address = format!("http://{}", listener.local_addr().unwrap());
            thread::spawn(move || {
                for stream in listener.incoming() {
                    // A worker that has gone needs no answer.
                    let _ = stream.and_then(|mut stream| stream.write_all(line));
                }
            });
            address
        };
        let run = |address| run(WorkerConfig::new(address, "w", 1), CancellationToken::new());
        let error = run(answering(b"HTTP/1.1 404 Not Found\r\n\r\n")).await.unwrap_err();
        assert!(error.to_string().contains("HTTP/1.1 404 Not Found"), "{error}");
        let gateway = run(answering(b"HTTP/1.1 503 Service Unavailable\r\n\r\n"));
        assert!(tokio::time::timeout(Duration::from_secs(1), gateway).await.is_err());
    }

    #[test]
    fn a_version_mismatch_names_both_versions() {
        let error = WorkerError::VersionMismatch {
            address: "http://host:1".into(),
            refusal: "this coordinator computes with sim-core 9".into(),
        };
        let text = error.to_string();
        assert!(text.contains("sim-core 9") && text.contains(sim_core::FINGERPRINT), "{text}");
        assert!(!error.is_input());
    }
}
