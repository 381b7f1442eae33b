//! The `worker` program: computes items for a coordinator until a signal stops it.

use std::{
    env,
    ffi::OsString,
    fs,
    future::ready,
    io::{self, Write as _},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
    thread,
    time::{Duration, SystemTime},
};

use clap::Parser;
use sim_core::Isa;
use swarm_telemetry::{
    EXIT_STARVED, Endpoint, LogArgs, MetricsArgs, VERSION, block_on, parse_positive_duration,
    report, runtime,
};
use swarm_transport::CredentialArgs;
use tokio::{
    signal::unix::{SignalKind, signal},
    time::{Instant, sleep},
};
use tokio_util::sync::CancellationToken;
use tracing::{error, info, warn};

use crate::{
    Expired, FINISHING_TIME, Lifetime, Stats, Watchdog, WorkerConfig, WorkerError, health_check,
    metrics, run,
};

const EXIT_INTERNAL: u8 = 1;
const EXIT_INPUT: u8 = 2;
const EXIT_DENIED: u8 = 7;
const EXIT_NO_COORDINATOR: u8 = 9;
const EXIT_INTERRUPTED: i32 = 130;

/// Computes the fitness of genotypes for a coordinator.
///
/// Connects, and reconnects without limit. With --idle-timeout or --time-limit it ends by
/// itself. On SIGTERM or SIGINT it finishes its items,
/// sends the results and exits; a second signal ends it at once, and other workers
/// repeat its items.
#[derive(Debug, Parser)]
#[command(name = "worker", version = VERSION, after_help = EXIT_CODES)]
struct Args {
    /// Address of the coordinator.
    #[arg(long, env = "SWARM_COORDINATOR", default_value = "http://127.0.0.1:7700")]
    coordinator: String,
    /// File with the worker token, if the coordinator requires one; alternatively
    /// SWARM_WORKER_TOKEN holds the token itself.
    #[arg(long, value_name = "FILE", env = "SWARM_WORKER_TOKEN_FILE")]
    token_file: Option<PathBuf>,
    #[command(flatten)]
    credentials: CredentialArgs,
    /// Name in the coordinator's log [default: the host's name and the process id]
    #[arg(long)]
    name: Option<String>,
    /// Number of items computed at the same time [default: the number of cores]
    #[arg(long)]
    slots: Option<usize>,
    /// Take only experiments whose name matches: `*` stands for any text, `?` for one
    /// character, as in 'alice-*' [default: all]
    #[arg(long, value_name = "PATTERN", default_value = "", hide_default_value = true)]
    experiments: String,
    /// Vector instructions: portable, avx2, avx512 or neon. They change the speed and no
    /// bit of the results [default: the fastest that this processor has]
    #[arg(long, env = "SWARM_ISA", value_name = "LEVEL")]
    isa: Option<Isa>,
    /// File that exists while this worker has a session with its coordinator, and is
    /// written every two seconds; --health-check reads it.
    #[arg(long, value_name = "FILE", env = "SWARM_SESSION_FILE")]
    session_file: Option<PathBuf>,
    /// Do not start a worker; check whether the one with the same --session-file has a
    /// session with its coordinator. Exit code 0 if it has one, 1 if not, with a line
    /// that says why.
    #[arg(long, requires = "session_file")]
    health_check: bool,
    /// End after this time without an item: 90s, 15m, 2h [default: wait without limit]
    #[arg(long, value_name = "TIME", value_parser = parse_positive_duration)]
    idle_timeout: Option<Duration>,
    /// Time within which this worker ends, such as the time limit of a batch job: it stops taking
    /// items early enough to finish those that it has [default: no limit]
    #[arg(long, value_name = "TIME", value_parser = parse_positive_duration)]
    time_limit: Option<Duration>,
    #[command(flatten)]
    metrics: MetricsArgs,
    #[command(flatten)]
    log: LogArgs,
}

const EXIT_CODES: &str = "\
Exit codes:
  0    stopped by a signal, or after --idle-timeout or --time-limit
  1    internal error
  2    bad arguments; token or certificate unusable; address of metrics in use
  7    the coordinator does not accept the token
  9    the server at the address is not a coordinator, or one of another version
  71   the system gives it too few threads or file descriptors, or too little memory
  130  ended at once by a second signal";

/// Runs the program with its command line, which begins with the program's name.
pub fn main(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args = Args::parse_from(words);
    if let (true, Some(file)) = (args.health_check, &args.session_file) {
        return report_health(file);
    }
    // At least one thread computes.
    match runtime(1) {
        Ok(runtime) => block_on(runtime, work(args)),
        Err(starved) => {
            report(&format!("error: {starved}"));
            EXIT_STARVED.into()
        }
    }
}

async fn work(args: Args) -> ExitCode {
    if let Err(error) = args.log.init() {
        report(&format!("error: {error}"));
        return EXIT_INPUT.into();
    }
    let shutdown = CancellationToken::new();
    let give_up = CancellationToken::new();
    if let Err(error) = stop_on_signals(shutdown.clone(), give_up.clone()) {
        error!("cannot listen for signals: {error}");
        return EXIT_INTERNAL.into();
    }
    let name = args.name.unwrap_or_else(default_name);
    let slots = args.slots.unwrap_or_else(|| thread::available_parallelism().map_or(1, Into::into));
    let credentials = args.credentials.load(args.token_file.as_deref(), "SWARM_WORKER_TOKEN");
    let credentials = match credentials {
        Ok(credentials) => credentials,
        Err(error) => {
            error!("{error}");
            return EXIT_INPUT.into();
        }
    };
    tokio::spawn(args.credentials.expiries().watch(now));
    let isa = args.isa.unwrap_or_else(Isa::best);
    let config = WorkerConfig {
        credentials,
        experiments: args.experiments,
        isa,
        session_file: args.session_file,
        give_up,
        ..WorkerConfig::new(args.coordinator, name, slots)
    };
    if let Some(address) = args.metrics.metrics_listen {
        let endpoint = match Endpoint::listen(address).await {
            Ok(endpoint) => endpoint,
            Err(error) => {
                error!("{error}");
                return EXIT_INPUT.into();
            }
        };
        let identity = metrics::Identity { name: config.name.clone(), slots, isa };
        let stats = Arc::clone(&config.stats);
        let scrape = move || ready(Some(metrics::scrape(&identity, &stats.snapshot())));
        tokio::spawn(endpoint.serve(scrape));
    }
    let lifetime = Lifetime { idle_timeout: args.idle_timeout, time_limit: args.time_limit };
    if lifetime.is_bounded() {
        tokio::spawn(watch_over(lifetime, Arc::clone(&config.stats), shutdown.clone()));
    }
    match run(config, shutdown).await {
        Ok(()) => {
            info!("stopped");
            ExitCode::SUCCESS
        }
        Err(error) => {
            error!("{error}");
            match error {
                WorkerError::VersionMismatch { .. } | WorkerError::AnotherService { .. } => {
                    EXIT_NO_COORDINATOR.into()
                }
                WorkerError::Denied { .. } => EXIT_DENIED.into(),
                WorkerError::Threads(_) => EXIT_STARVED.into(),
                error if error.is_input() => EXIT_INPUT.into(),
                _ => EXIT_INTERNAL.into(),
            }
        }
    }
}

/// The present time, to compare with dates.
#[expect(clippy::disallowed_methods, reason = "certificates expire by the clock")]
fn now() -> SystemTime {
    SystemTime::now()
}

/// Tells the worker to finish when its life is over, and ends the process if that takes too long.
async fn watch_over(lifetime: Lifetime, stats: Arc<Stats>, shutdown: CancellationToken) {
    let mut watchdog = Watchdog::new(lifetime, Instant::now().into_std());
    loop {
        sleep(watchdog.interval()).await;
        let reason = match watchdog.look(Instant::now().into_std(), &stats.snapshot()) {
            None => continue,
            Some(Expired::Idle) => "idle for the time of --idle-timeout",
            Some(Expired::TimeIsNear) => "near the end of --time-limit",
            Some(Expired::TimeIsUp) => {
                warn!("--time-limit is over before all items are done: other workers compute them");
                std::process::exit(0);
            }
        };
        if !shutdown.is_cancelled() {
            info!(reason, "worker ends by itself");
            shutdown.cancel();
        }
    }
}

/// Prints in one line whether the worker is healthy.
fn report_health(session_file: &Path) -> ExitCode {
    match health_check(session_file) {
        Ok(session) => {
            // If nobody reads the line, the exit code still tells the result.
            let _ = writeln!(io::stdout(), "healthy: {session}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            report(&format!("unhealthy: {error}"));
            ExitCode::FAILURE
        }
    }
}

/// The first signal tells the worker to finish its items; those of scripts get [`FINISHING_TIME`].
/// The second signal ends the process.
fn stop_on_signals(shutdown: CancellationToken, give_up: CancellationToken) -> io::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    tokio::spawn(async move {
        // A worker near the end of its time limit finishes its items without a signal.
        let mut is_signalled = false;
        loop {
            tokio::select! {
                _ = terminate.recv() => {}
                _ = interrupt.recv() => {}
            }
            if std::mem::replace(&mut is_signalled, true) {
                std::process::exit(EXIT_INTERRUPTED);
            }
            shutdown.cancel();
            let give_up = give_up.clone();
            tokio::spawn(async move {
                sleep(FINISHING_TIME).await;
                give_up.cancel();
            });
        }
    });
    Ok(())
}

/// The host's name, or "worker" if it has none, and the process id.
fn default_name() -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname")
        .ok()
        .or_else(|| env::var("HOSTNAME").ok())
        .map(|host| host.trim().to_owned())
        .filter(|host| !host.is_empty())
        .unwrap_or_else(|| "worker".into());
    format!("{host}-{}", std::process::id())
}
