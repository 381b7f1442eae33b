//! The log of the coordinator and workers that `run` and `evaluate --local` start.

use tracing_subscriber::filter::LevelFilter;

use swarm_telemetry::EscapingWriter;

use crate::progress::BesideBar;

/// Logs warnings and errors, each on its own line.
pub fn init(stderr: impl Fn() -> BesideBar + Send + Sync + 'static) {
    tracing_subscriber::fmt()
        .with_max_level(LevelFilter::WARN)
        .with_writer(move || EscapingWriter(stderr()))
        .with_ansi(false)
        .with_target(false)
        .without_time()
        // The default writer would panic if standard error is closed.
        .log_internal_errors(false)
        // If two commands run in one process, the first one has set the log up.
        .try_init()
        .unwrap_or_default();
}
