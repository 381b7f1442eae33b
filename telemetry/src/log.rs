//! Logs to standard error, as text or as JSON.

use std::io::{self, IsTerminal as _};

use tracing_subscriber::{EnvFilter, filter::ParseError};

/// Format and level of the log.
#[derive(Debug, clap::Args)]
pub struct LogArgs {
    /// Format of the log lines.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
    /// What to log: error, warn, info, debug or trace, also per module
    /// (info,worker=debug).
    #[arg(long, env = "SWARM_LOG", default_value = "info")]
    log_level: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum LogFormat {
    /// For people.
    Text,
    /// For programs: one object per line.
    Json,
}

/// The value of `--log-level` is not valid.
#[derive(Debug, thiserror::Error)]
#[error("--log-level {level}: {source}")]
pub struct LogError {
    level: String,
    source: ParseError,
}

impl LogArgs {
    /// Starts logging.
    pub fn init(&self) -> Result<(), LogError> {
        let level = &self.log_level;
        let filter = EnvFilter::try_new(level)
            .map_err(|source| LogError { level: level.clone(), source })?;
        let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
        match self.log_format {
            LogFormat::Text => log.with_target(false).with_ansi(io::stderr().is_terminal()).init(),
            LogFormat::Json => log.json().flatten_event(true).with_current_span(false).init(),
        }
        Ok(())
    }
}
