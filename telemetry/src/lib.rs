//! Observing the programs: log lines on standard error, and metrics for Prometheus.
//!
//! Each program defines its own lines and metrics; `docs/logs.md` and
//! `docs/metrics.md` list them.

mod endpoint;
mod log;
mod metric;
mod text;
mod throttle;

use std::net::SocketAddr;

pub use endpoint::{Endpoint, ListenError};
pub use log::{LogArgs, LogError};
pub use metric::{Kind, Metric, Scrape};
pub use prometheus::Histogram;
pub use text::{EscapingWriter, escape, escape_lines, is_unprintable};
pub use throttle::Throttle;

/// The address at which metrics are served.
#[derive(Debug, clap::Args)]
pub struct MetricsArgs {
    /// Serve metrics for Prometheus on this address, at /metrics, without a token to any
    /// program that reaches it [default: not served]
    #[arg(long, env = "SWARM_METRICS_LISTEN", value_name = "ADDR:PORT")]
    pub metrics_listen: Option<SocketAddr>,
}
