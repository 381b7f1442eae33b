//! Observing the programs: log lines on standard error, and metrics for Prometheus.
//!
//! Each program defines its own lines and metrics; `docs/logs.md` and
//! `docs/metrics.md` list them.

mod allocator;
mod duration;
mod endpoint;
mod log;
mod metric;
mod runtime;
mod text;

use std::net::SocketAddr;

pub use duration::{parse_duration, parse_positive_duration};
pub use endpoint::{Endpoint, ListenError};
pub use log::{LogArgs, LogError};
pub use metric::{Kind, Metric, Scrape};
pub use prometheus::Histogram;
pub use runtime::{EXIT_STARVED, Starved, block_on, runtime};
pub use text::{EscapingWriter, escape, escape_lines, is_unprintable, number, report};

/// Version of the programs, and in release builds the commit, such as
/// `0.1.0 (1a2b3c4)`.
pub const VERSION: &str = env!("SWARMEVO_VERSION");

/// The address at which metrics are served.
#[derive(Debug, clap::Args)]
pub struct MetricsArgs {
    /// Serve metrics for Prometheus on this address, at /metrics, without a token to any
    /// program that reaches it [default: not served]
    #[arg(
        long,
        env = "SWARM_METRICS_LISTEN",
        value_name = "HOST:PORT",
        value_parser = swarm_transport::listen_address
    )]
    pub metrics_listen: Option<SocketAddr>,
}
