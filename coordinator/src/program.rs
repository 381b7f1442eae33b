//! The coordinator as a program.

mod access_args;

use std::{
    ffi::OsString,
    io::{self, Write as _},
    net::SocketAddr,
    path::PathBuf,
    process::ExitCode,
    time::Duration,
};

use clap::{Parser, Subcommand};
use swarm_telemetry::{EXIT_STARVED, LogArgs, MetricsArgs, VERSION, block_on, report, runtime};
use swarm_transport::listen_address;
use tokio::signal::unix::{SignalKind, signal};
use tracing::{error, info};

use self::access_args::{AccessArgs, AccessInputError};
use crate::{
    Coordinator, CoordinatorConfig, RunError, StartError, clock, health_check,
    limits::MEMORY_BUDGET_MIB, referee,
};

/// Coordinates the evolution of robot swarms: accepts experiment files, sends
/// genotypes to workers, stores every generation.
///
/// The log has one line per generation. Stop the coordinator with SIGTERM or Ctrl-C;
/// at the next start, unfinished experiments continue from their last completed
/// generation, with the same bits.
#[derive(Debug, Parser)]
#[command(name = "coordinator", version = VERSION, after_help = EXIT_CODES, disable_help_subcommand = true)]
struct Args {
    /// Address to listen on. An address other than loopback requires tokens, and TLS or
    /// --plaintext.
    #[arg(
        long,
        env = "SWARM_LISTEN",
        value_name = "HOST:PORT",
        default_value = "127.0.0.1:7700",
        value_parser = listen_address
    )]
    listen: SocketAddr,
    /// Directory of the database; created if it does not exist.
    #[arg(long, env = "SWARM_DATA_DIR", default_value = "swarm-data")]
    data_dir: PathBuf,
    #[command(flatten)]
    access: AccessArgs,
    /// Do not start a coordinator; check the health of the one that runs here with the
    /// same --listen and --tls-... options. Exit code 0 if it is healthy, 1 if not, with
    /// a line that says why.
    #[arg(long)]
    health_check: bool,
    /// Seconds of silence after which other workers get a worker's items.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    lease: u32,
    /// Share of the individuals, 0 to 1, that a second worker computes, too. If the bits
    /// differ, the coordinator computes the trial itself, and the worker that was wrong gets
    /// no items until you readmit it.
    #[arg(long, default_value_t = 0.0, value_parser = fraction)]
    audit_fraction: f64,
    /// MiB of memory that unfinished experiments may take together, as estimated from their
    /// population, genes and algorithm. A submission beyond it is refused; after a restart
    /// with less, experiments wait for others to end.
    #[arg(
        long,
        env = "SWARM_MEMORY_BUDGET",
        value_name = "MIB",
        default_value_t = MEMORY_BUDGET_MIB
    )]
    memory_budget: u32,
    /// Serve pages on this address: experiments, the fleet, and any swarm replayed. They need
    /// the token of clients; an address other than loopback requires tokens, and TLS or
    /// --plaintext.
    #[arg(long, env = "SWARM_WEB_LISTEN", value_name = "HOST:PORT", value_parser = listen_address)]
    web_listen: Option<SocketAddr>,
    #[command(flatten)]
    metrics: MetricsArgs,
    #[command(flatten)]
    log: LogArgs,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Evaluate items for a coordinator, which starts this process itself.
    ///
    /// Reads requests from standard input and writes answers to standard output, in a
    /// format of this release; ends when standard input does. No option of the
    /// coordinator matters to it.
    #[command(hide = true)]
    Referee,
}

const EXIT_CODES: &str = "\
Exit codes:
  0  stopped by a signal
  1  internal error; committed generations are safe, the next start continues after them
  2  bad input: address in use, or open to a network without tokens or TLS; token,
     certificate or data directory unusable; database damaged; wrong arguments
  3  another coordinator has taken over the data directory, and goes on there
  71 the system gives it too few threads or file descriptors, or too little memory

docs/security.md says how to create tokens and certificates.";

fn fraction(text: &str) -> Result<f64, String> {
    let fraction: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=1.0).contains(&fraction) { Ok(fraction) } else { Err("not within 0..=1".to_owned()) }
}

/// Runs the program with its command line, which begins with the program's name.
pub fn main(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args = Args::parse_from(words);
    match args.command {
        Some(Command::Referee) => evaluate_items(),
        // The referee makes its own threads.
        None => match runtime(0) {
            Ok(runtime) => block_on(runtime, run(&args)),
            Err(starved) => {
                report(&format!("error: {starved}"));
                ExitCode::from(EXIT_STARVED)
            }
        },
    }
}

/// Runs the referee's process.
fn evaluate_items() -> ExitCode {
    match referee::serve_stdio() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report(&format!("error: {error}"));
            ExitCode::FAILURE
        }
    }
}

async fn run(args: &Args) -> ExitCode {
    if args.health_check {
        return report_health(args).await;
    }
    if let Err(error) = args.log.init() {
        report(&format!("error: {error}"));
        return ExitCode::from(2);
    }
    match serve(args).await {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error!("{error}");
            ExitCode::from(match error.downcast_ref() {
                Some(RunError::TakenOver(_)) => 3,
                Some(RunError::Damaged(_)) => 2,
                _ if error.is::<StartError>() || error.is::<AccessInputError>() => 2,
                _ => 1,
            })
        }
    }
}

/// Prints in one line whether the coordinator is healthy.
async fn report_health(args: &Args) -> ExitCode {
    let health = async {
        let tls = args.access.load_tls()?;
        health_check(args.listen, tls.as_ref()).await?;
        anyhow::Ok(())
    };
    match health.await {
        Ok(()) => {
            // If nobody reads the line, the exit code still tells the result.
            let _ = writeln!(io::stdout(), "healthy: the coordinator on {} serves", args.listen);
            ExitCode::SUCCESS
        }
        Err(error) => {
            report(&format!("unhealthy: {error}"));
            ExitCode::FAILURE
        }
    }
}

async fn serve(args: &Args) -> anyhow::Result<()> {
    // First of all, so that no early signal is lost.
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let lease = Duration::from_secs(args.lease.into());
    let mut coordinator = Coordinator::start(CoordinatorConfig {
        heartbeat_interval: lease / 5,
        lease,
        access: args.access.load()?,
        audit_fraction: args.audit_fraction,
        memory_budget: u64::from(args.memory_budget) << 20,
        web_listen: args.web_listen,
        metrics_listen: args.metrics.metrics_listen,
        ..CoordinatorConfig::new(args.listen, args.data_dir.clone())
    })
    .await?;
    let expiries = tokio::spawn(args.access.expiries().watch(clock::today));
    let ended = tokio::select! {
        _ = terminate.recv() => Ok(()),
        _ = interrupt.recv() => Ok(()),
        error = coordinator.failure() => Err(error),
    };
    if ended.is_ok() {
        info!("coordinator stops");
    }
    expiries.abort();
    // The last line of the log gives the reason in every case.
    coordinator.shutdown().await;
    Ok(ended?)
}
