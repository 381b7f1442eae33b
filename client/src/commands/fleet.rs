//! `swarmctl fleet`: as many workers as the experiments need, as jobs of a batch system.

mod autoscaler;
mod patience;
mod slurm;

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use clap::{Args, Subcommand, ValueHint};
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::ExplainExperimentRequest;
use swarm_telemetry::parse_positive_duration;
use tokio::time::{Instant, sleep};

use self::{
    autoscaler::{Autoscaler, Bounds, Done, ITEMS_PER_WORKER, Job, Plan},
    patience::Patience,
    slurm::Slurm,
};
use crate::{
    args::whole,
    connection::{Connection, PATIENCE_WHILE_FOLLOWING},
    error::{Code, Error},
    progress::Progress,
    remote::{Remote, family},
    text,
};

family! {
    /// Commands for workers.
    Fleet {
        Workers(super::workers::WorkersArgs),
        Fleet(FleetArgs),
    }
}

/// A job that ends sooner counts as failed, unless its worker's idle timeout is shorter.
const SHORT_LIFE: Duration = Duration::from_secs(30);
/// After so many failed jobs in a row, the command gives up.
const SHORT_LIVES_MAX: u32 = 3;

/// Run as many workers as the experiments need, as jobs of a batch system.
#[derive(Debug, Args)]
pub struct FleetArgs {
    #[command(subcommand)]
    system: System,
}

/// The batch systems.
#[derive(Debug, Subcommand)]
enum System {
    Slurm(SlurmArgs),
}

/// Submit and end jobs with workers in Slurm, as the coordinator's queue needs them.
///
/// The command runs until you interrupt it; it then submits no more jobs, and the workers end
/// after their --idle-timeout. It plans one worker for 16 open items of running experiments.
/// It adds workers half a minute after the queue grows, and removes workers ten minutes after
/// it shrinks, like the autoscaler for Kubernetes. It withdraws waiting jobs first; a running
/// worker finishes its items. After a restart it finds its jobs by their name.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
struct SlurmArgs {
    /// Minimum number of workers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    min: u32,
    /// Maximum number of workers.
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=4096))]
    max: u32,
    /// Time after which a worker without an item ends by itself.
    #[arg(long, value_name = "TIME", default_value = "10m", value_parser = parse_positive_duration)]
    idle_timeout: Duration,
    /// Time by which a worker ends by itself, shorter than the time limit of its job
    /// [default: none]
    #[arg(long, value_name = "TIME", value_parser = parse_positive_duration)]
    time_limit: Option<Duration>,
    /// Time between two checks of the queues.
    #[arg(long, value_name = "TIME", default_value = "15s", value_parser = parse_positive_duration)]
    interval: Duration,
    /// Path of the worker program on the nodes.
    #[arg(long, value_name = "PROGRAM", value_hint = ValueHint::ExecutablePath, env = "SWARM_WORKER", default_value = "worker")]
    worker: String,
    /// Name of the jobs; no other jobs may use it [default: swarm-HOST-PORT of the
    /// coordinator]
    #[arg(long, value_name = "NAME")]
    job_name: Option<String>,
    /// More arguments for sbatch.
    #[arg(last = true, value_name = "SBATCH ARGUMENT")]
    sbatch_args: Vec<String>,
}

const HELP: &str = "\
Workers take token and certificates from the environment, which sbatch passes
on: SWARM_WORKER_TOKEN_FILE, SWARM_TLS_CA. --coordinator must be an address that
the nodes can reach. A worker has --cpus-per-task slots.

Examples:
  swarmctl fleet slurm --max 40 -- --partition=short --cpus-per-task=8
  swarmctl fleet slurm --max 40 --time-limit 235m -- --time=4:00:00";

impl Remote for FleetArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let System::Slurm(args) = self.system;
        if args.min > args.max {
            let SlurmArgs { min, max, .. } = args;
            return Err(Error::option("--min", format!("{min} is more than --max {max}")));
        }
        if let Some(data_dir) = connection.data_dir() {
            let holder = connection.holder().await;
            let message = text::no_fleet(data_dir, holder.as_ref());
            return Err(Error::at(Code::BadInput, data_dir.display(), message));
        }
        let connection = connection.with_patience(PATIENCE_WHILE_FOLLOWING);
        let address = connection.address();
        let slurm = Slurm {
            job_name: args.job_name.unwrap_or_else(|| job_name(address)),
            script: slurm::script(&args.worker, address, args.idle_timeout, args.time_limit),
            idle_timeout: args.idle_timeout,
            sbatch_args: args.sbatch_args,
        };
        let bounds = Bounds { min: args.min, max: args.max };
        scale(&connection, &slurm, bounds, args.interval, progress).await
    }
}

/// A check of the queues that led to an action, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Look<'a> {
    /// Number of open items of running experiments.
    items: u64,
    /// Number of jobs before the action.
    jobs: usize,
    /// Number of jobs that the items need.
    wanted: u32,
    /// Numbers of the jobs that the command submitted.
    submitted: &'a [String],
    /// Numbers of the waiting jobs that the command withdrew.
    withdrawn: &'a [String],
    /// Numbers of the jobs whose workers end after their items.
    finishing: &'a [String],
}

async fn scale(
    connection: &Connection,
    slurm: &Slurm,
    bounds: Bounds,
    interval: Duration,
    progress: &mut Progress,
) -> Result<(), Error> {
    let mut scaler = Scaler {
        autoscaler: Autoscaler::new(bounds),
        lives: Lives::new(slurm.idle_timeout),
        looking: Patience::default(),
        acting: Patience::default(),
    };
    if !progress.is_json() {
        progress.remark(&format!(
            "jobs are named {}; one worker for {ITEMS_PER_WORKER} open items, {} to {} workers",
            slurm.job_name, bounds.min, bounds.max
        ));
    }
    loop {
        let n_items = open_items(connection).await?;
        scaler.check(n_items, slurm, progress).await?;
        sleep(interval).await;
    }
}

/// What the command remembers from one check of the queues to the next.
#[derive(Debug)]
struct Scaler {
    autoscaler: Autoscaler,
    lives: Lives,
    /// The patience with the list of jobs.
    looking: Patience,
    /// The patience with the submission and the end of jobs.
    acting: Patience,
}

impl Scaler {
    /// Lists the jobs, and submits and ends as many as the items require.
    async fn check(
        &mut self,
        n_items: u64,
        slurm: &Slurm,
        progress: &mut Progress,
    ) -> Result<(), Error> {
        let mut jobs = match slurm.jobs().await {
            Ok(jobs) => jobs,
            Err(error) => return bear(&mut self.looking, error, progress),
        };
        self.looking.succeeded(Instant::now());
        if !jobs.is_empty() {
            // Slurm accepts jobs: a refusal is a limit, which passes.
            self.acting.works(Instant::now());
        }
        self.lives.see(Instant::now(), &jobs)?;
        jobs.retain(|job| !self.lives.finishing.contains(&job.id));
        let n_wanted = self.autoscaler.wanted(Instant::now(), n_items, jobs.len() as u32);
        let plan = Plan::new(&jobs, n_wanted);
        if plan.is_empty() {
            return Ok(());
        }
        let mut done = Done::default();
        let result = slurm.carry_out(plan, &mut done).await;
        self.lives.acted(Instant::now(), &done);
        if !done.is_empty() {
            self.acting.works(Instant::now());
            let look = Look {
                items: n_items,
                jobs: jobs.len(),
                wanted: n_wanted,
                submitted: &done.submitted,
                withdrawn: &done.withdrawn,
                finishing: &done.finishing,
            };
            match progress.is_json() {
                true => progress.print_line(&look)?,
                false => progress.print(&look.line())?,
            }
        }
        match result {
            Ok(()) => self.acting.succeeded(Instant::now()),
            Err(error) => bear(&mut self.acting, error, progress)?,
        }
        Ok(())
    }
}

/// Reports a failure of Slurm that the next check may find gone, or gives up with it.
fn bear(patience: &mut Patience, error: Error, progress: &Progress) -> Result<(), Error> {
    let remark = patience.failed(Instant::now(), error)?;
    remark.iter().for_each(|remark| progress.remark(remark));
    Ok(())
}

impl Look<'_> {
    fn line(&self) -> String {
        let done = [
            (self.submitted, "submitted"),
            (self.withdrawn, "withdrawn"),
            (self.finishing, "finishing"),
        ];
        let done = done.into_iter().filter(|(ids, _)| !ids.is_empty());
        let done: Vec<String> =
            done.map(|(ids, what)| format!("{what} {}", ids.join(", "))).collect();
        format!(
            "{} open, {} of {} wanted: {}",
            text::counted(self.items, "item"),
            text::counted(self.jobs as u64, "job"),
            self.wanted,
            done.join("; ")
        )
    }
}

/// Items of running experiments that wait for a worker or are assigned to one.
async fn open_items(connection: &Connection) -> Result<u64, Error> {
    let mut n_items = 0;
    for experiment in connection.running().await? {
        let request = ExplainExperimentRequest { experiment_id: experiment.id };
        let answer = connection.call(async |client| client.explain_experiment(request).await);
        if let Some(round) = answer.await?.round {
            let held: u64 = round.held.iter().map(|held| u64::from(held.items)).sum();
            n_items += u64::from(round.items_queued) + held;
        }
    }
    Ok(n_items)
}

/// The lifetimes of jobs, to notice when all of them fail.
#[derive(Debug)]
struct Lives {
    /// A job that ends sooner counts as failed.
    short: Duration,
    /// When each job was submitted, or began to run.
    since: BTreeMap<String, Instant>,
    /// Jobs that were told to finish.
    finishing: BTreeSet<String>,
    n_short: u32,
}

impl Lives {
    /// `idle_timeout`: the time after which idle workers end by themselves.
    fn new(idle_timeout: Duration) -> Self {
        let short = SHORT_LIFE.min(idle_timeout);
        Self { short, since: BTreeMap::new(), finishing: BTreeSet::new(), n_short: 0 }
    }

    /// Records the present jobs; fails if the last ones ended at once.
    fn see(&mut self, now: Instant, jobs: &[Job]) -> Result<(), Error> {
        let is_there = |id: &String| jobs.iter().any(|job| job.id == *id);
        let gone: Vec<(String, Instant)> =
            self.since.extract_if(.., |id, _| !is_there(id)).collect();
        for (id, since) in &gone {
            match now - *since < self.short {
                _ if self.finishing.contains(id) => {}
                true => self.n_short += 1,
                false => self.n_short = 0,
            }
            if self.n_short >= SHORT_LIVES_MAX {
                return Err(Error::Input(format!(
                    "the last {SHORT_LIVES_MAX} worker jobs ended as soon as they began; the \
                     reason is in swarm-worker-{id}.log"
                )));
            }
        }
        self.finishing.retain(is_there);
        for job in jobs {
            match job.is_running {
                true => drop(self.since.entry(job.id.clone()).or_insert(now)),
                // A waiting job has no lifetime yet.
                false => drop(self.since.insert(job.id.clone(), now)),
            }
        }
        Ok(())
    }

    fn acted(&mut self, now: Instant, done: &Done) {
        self.since.extend(done.submitted.iter().map(|id| (id.clone(), now)));
        self.finishing.extend(done.withdrawn.iter().chain(&done.finishing).cloned());
    }
}

/// `swarm-HOST-PORT`.
fn job_name(address: &str) -> String {
    let authority = address.split_once("://").map_or(address, |(_, authority)| authority);
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    format!("swarm-{}", authority.trim_end_matches('/').chars().map(plain).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_that_end_at_once_are_submitted_only_a_few_times() {
        let mut lives = Lives::new(2 * SHORT_LIFE);
        let mut now = Instant::now();
        let mut run = |id: &str, lasts: Duration, is_told: bool| {
            let ids = vec![id.to_owned()];
            let job = Job { id: id.to_owned(), is_running: true };
            lives.acted(now, &Done { submitted: ids.clone(), ..Done::default() });
            lives.see(now, std::slice::from_ref(&job)).unwrap();
            if is_told {
                lives.acted(now, &Done { finishing: ids, ..Done::default() });
            }
            now += lasts;
            lives.see(now, &[])
        };
        let second = Duration::from_secs(1);
        run("1", second, false).unwrap();
        run("2", second, false).unwrap();
        run("3", SHORT_LIFE, false).unwrap();
        run("4", second, false).unwrap();
        run("5", second, true).unwrap();
        run("6", second, false).unwrap();
        let error = run("7", second, false).unwrap_err().to_string();
        assert!(error.contains("swarm-worker-7.log"), "{error}");
    }

    #[test]
    fn names_of_jobs_tell_fleets_apart() {
        assert_eq!(job_name("https://login1.hpc:7700/"), "swarm-login1.hpc-7700");
        assert_eq!(job_name("http://[::1]:7700"), "swarm----1--7700");
    }
}
