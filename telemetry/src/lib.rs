//! What the programs say about themselves: log lines on standard error, and metrics
//! for whoever scrapes them.
//!
//! Which lines and which metrics there are is each program's own business;
//! `docs/logs.md` and `docs/metrics.md` list them.

mod endpoint;
mod log;
mod metric;

use std::net::SocketAddr;

pub use endpoint::{Endpoint, ListenError};
pub use log::{LogArgs, LogError};
pub use metric::{Kind, Metric, Scrape};
pub use prometheus::Histogram;

/// Where metrics are served.
#[derive(Debug, clap::Args)]
pub struct MetricsArgs {
    /// Serve metrics for Prometheus on this address, at /metrics, to everybody who
    /// reaches it [default: they are not served]
    #[arg(long, env = "SWARM_METRICS_LISTEN", value_name = "ADDR:PORT")]
    pub metrics_listen: Option<SocketAddr>,
}
