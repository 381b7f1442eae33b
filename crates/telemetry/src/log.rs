//! Logs to standard error, as text or as JSON.

use std::{
    collections::BTreeMap,
    io::{self, IsTerminal as _},
    sync::{Mutex, PoisonError},
    time::Instant,
};

use tracing::{Event, Level, Subscriber, warn};
use tracing_subscriber::{
    EnvFilter, Layer,
    filter::{LevelFilter, ParseError},
    fmt,
    layer::{Context, SubscriberExt as _},
    util::SubscriberInitExt as _,
};

use swarm_transport::Throttle;

use crate::text::EscapingWriter;

/// Format and level of the log.
#[derive(Debug, clap::Args)]
pub struct LogArgs {
    /// Format of the log lines.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
    /// Level of lines to log: error, warn, info, debug or trace, also per module
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
pub enum LogError {
    /// It is no list of levels.
    #[error("--log-level {level}: {source}")]
    Unreadable {
        /// The value.
        level: String,
        /// The mistake.
        source: ParseError,
    },
    /// A word in it is no level. A filter would take it for a module, and log nothing else.
    #[error(
        "--log-level {0}: give error, warn, info, debug, trace or off; MODULE=LEVEL is for one \
         module"
    )]
    NoLevel(String),
}

impl LogArgs {
    /// Starts logging.
    pub fn init(&self) -> Result<(), LogError> {
        let filter = filter(&self.log_level)?;
        let lines = fmt::layer().with_writer(|| EscapingWriter(io::stderr()));
        let lines = match self.log_format {
            LogFormat::Text => {
                lines.with_target(false).with_ansi(io::stderr().is_terminal()).boxed()
            }
            LogFormat::Json => lines.json().flatten_event(true).with_current_span(false).boxed(),
        };
        let log = tracing_subscriber::registry().with(filter);
        log.with(LibraryThrottle::default()).with(lines).init();
        Ok(())
    }
}

/// The filter of a list of levels.
fn filter(levels: &str) -> Result<EnvFilter, LogError> {
    let is_level = |word: &&str| word.contains(['=', '[']) || word.parse::<LevelFilter>().is_ok();
    let words = || levels.split(',').map(str::trim).filter(|word| !word.is_empty());
    match words().find(|word| !is_level(word)) {
        Some(word) => Err(LogError::NoLevel(word.to_owned())),
        None => EnvFilter::try_new(levels)
            .map_err(|source| LogError::Unreadable { level: levels.to_owned(), source }),
    }
}

/// Libraries whose lines report the behaviour of peers.
const LIBRARIES: [&str; 6] = ["h2", "hyper", "hyper_util", "rustls", "tonic", "tower"];

/// Passes one line per library and second at INFO and above, and withholds the others, because any
/// peer can cause any number of them. At a more detailed level, it withholds nothing.
#[derive(Debug, Default)]
struct LibraryThrottle {
    throttles: Mutex<BTreeMap<&'static str, Throttle>>,
}

impl<S: Subscriber> Layer<S> for LibraryThrottle {
    fn event_enabled(&self, event: &Event<'_>, _: Context<'_, S>) -> bool {
        let metadata = event.metadata();
        let module = metadata.target().split("::").next().unwrap_or_default();
        let Some(library) = LIBRARIES.into_iter().find(|&library| library == module) else {
            return true;
        };
        if *metadata.level() > Level::INFO {
            return true;
        }
        let mut throttles = self.throttles.lock().unwrap_or_else(PoisonError::into_inner);
        #[expect(clippy::disallowed_methods, reason = "a log has the time of its lines")]
        let withheld = throttles.entry(library).or_default().on_line(Instant::now());
        drop(throttles);
        if let Some(withheld @ 1..) = withheld {
            warn!(library, withheld, "a library's log lines were withheld");
        }
        withheld.is_some()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use tracing::{debug, subscriber::with_default};

    use super::*;

    /// The written lines.
    #[derive(Debug, Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_word_that_is_no_level_is_refused() {
        for levels in ["info", "WARN", "off", "info,worker=debug", "worker[span]=trace", "info,"] {
            filter(levels).unwrap();
        }
        for (levels, wrong) in [("inof", "inof"), ("info,worker", "worker"), ("warning", "warning")]
        {
            let error = filter(levels).unwrap_err().to_string();
            assert!(error.starts_with(&format!("--log-level {wrong}: give error, ")), "{error}");
        }
        assert!(matches!(filter("worker=loud"), Err(LogError::Unreadable { .. })));
    }

    #[test]
    fn a_librarys_warnings_are_withheld_and_nothing_else() {
        let lines = Lines::default();
        let sink = lines.clone();
        let layer = fmt::layer().with_writer(move || sink.clone()).with_ansi(false);
        let log = tracing_subscriber::registry()
            .with(EnvFilter::new("trace"))
            .with(LibraryThrottle::default())
            .with(layer);
        with_default(log, || {
            for _ in 0..100 {
                warn!(target: "h2::proto", "a reset");
                warn!(target: "hyper", "a header");
                debug!(target: "h2::proto", "detail");
                warn!(target: "coordinator::h2", "worker lost");
            }
        });
        let text = String::from_utf8(lines.0.lock().unwrap().clone()).unwrap();
        let count = |line: &str| text.matches(line).count();
        assert!((1..4).contains(&count("a reset")), "{text}");
        assert!((1..4).contains(&count("a header")));
        assert_eq!(count("detail"), 100);
        assert_eq!(count("worker lost"), 100);
    }
}
