//! Coordinators and workers as processes.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use rusqlite::Connection;
use tempfile::TempDir;

use crate::{
    Experiment, LogLine, LoggingProcess, Outcome, binary,
    process::{Source, swarmctl},
};

/// Messages of the logs that tests wait for.
const LISTENS: &str = "coordinator listens";

/// A coordinator with a data directory of its own, on a port of its own.
#[derive(Debug)]
pub struct CoordinatorProcess {
    /// The process.
    pub process: LoggingProcess,
    address: String,
    args: Vec<String>,
    data_dir: PathBuf,
    /// Removes the directory.
    _temporary: Option<TempDir>,
}

impl CoordinatorProcess {
    /// Starts a coordinator.
    pub fn start() -> Self {
        Self::start_with(&[])
    }

    /// Starts a coordinator with more arguments.
    pub fn start_with(args: &[&str]) -> Self {
        let temporary = tempfile::tempdir().expect("a temporary directory");
        let data_dir = temporary.path().to_owned();
        Self::launch(data_dir, Some(temporary), args, None)
    }

    /// Starts a coordinator that dies at a step; see its module `failpoint`.
    #[cfg(debug_assertions)]
    pub fn start_armed(failpoint: &str) -> Self {
        let temporary = tempfile::tempdir().expect("a temporary directory");
        let data_dir = temporary.path().to_owned();
        Self::launch(data_dir, Some(temporary), &[], Some(failpoint))
    }

    /// Starts a coordinator on a data directory.
    pub fn start_in(data_dir: &Path) -> Self {
        Self::start_in_with(data_dir, &[])
    }

    /// Starts a coordinator on a data directory with more arguments.
    pub fn start_in_with(data_dir: &Path, args: &[&str]) -> Self {
        Self::launch(data_dir.to_owned(), None, args, None)
    }

    fn launch(
        data_dir: PathBuf,
        temporary: Option<TempDir>,
        args: &[&str],
        failpoint: Option<&str>,
    ) -> Self {
        let args: Vec<String> = args.iter().map(|&arg| arg.to_owned()).collect();
        let (process, address) = spawn("127.0.0.1:0", &data_dir, &args, failpoint);
        Self { process, address, args, data_dir, _temporary: temporary }
    }

    /// Restarts a coordinator that has ended, with the same data and address.
    pub fn restart(&mut self) {
        (self.process, self.address) = spawn(&self.address, &self.data_dir, &self.args, None);
    }

    /// Its URL.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Its `host:port`.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Its data directory.
    pub fn data_dir(&self) -> &Path {
        &self.data_dir
    }

    /// A connection of its own to the coordinator's database.
    pub fn database(&self) -> Connection {
        Connection::open(self.data_dir.join("swarmevo.sqlite3")).expect("the database opens")
    }

    /// Number of generations of an experiment in the database.
    pub fn n_committed(&self, id: u64) -> u64 {
        self.database()
            .query_row("SELECT count(*) FROM generations WHERE experiment_id = ?1", [id], |row| {
                row.get(0)
            })
            .expect("the database can be read")
    }

    /// Runs `swarmctl --output json ARGS` against it.
    pub fn swarmctl(&self, args: &[&str]) -> Outcome {
        let url = self.url();
        swarmctl(["--coordinator", &url].iter().chain(args))
    }

    /// Submits an experiment file; returns the experiment's id.
    pub fn submit(&self, path: &Path) -> u64 {
        let path = path.to_str().expect("UTF-8");
        let submitted = self.swarmctl(&["submit", path]).expect_success().json();
        submitted["id"].as_u64().expect("an id")
    }

    /// Follows an experiment.
    pub fn watch(&self, id: u64) -> Watch {
        let args = ["--coordinator", &self.url(), "watch", &id.to_string()];
        Watch { process: LoggingProcess::of_swarmctl(&args) }
    }

    /// Waits until the experiment's generation has been committed.
    pub fn wait_for_generation(&self, generation: u64) -> LogLine {
        self.process.wait_for("completed generation", |line| {
            line["message"] == "generation" && line["generation"] == generation
        })
    }
}

/// Runs a coordinator that fails to start or ends by itself, and waits for its end.
pub fn run_coordinator(listen: &str, data_dir: &Path) -> Outcome {
    let mut command = Command::new(binary("coordinator"));
    command.args(["--listen", listen, "--data-dir"]).arg(data_dir);
    Outcome::of_command(&mut command)
}

fn spawn(
    listen: &str,
    data_dir: &Path,
    args: &[String],
    failpoint: Option<&str>,
) -> (LoggingProcess, String) {
    let mut command = Command::new(binary("coordinator"));
    command.args(["--log-format", "json", "--data-dir"]).arg(data_dir);
    for (option, default) in [("--listen", listen), ("--log-level", "info,coordinator=debug")] {
        if !args.iter().any(|arg| arg == option) {
            command.args([option, default]);
        }
    }
    command
        .args(args)
        .envs(failpoint.map(|failpoint| ("SWARM_FAILPOINT", failpoint)))
        .stdout(Stdio::null());
    let process = LoggingProcess::spawn(command, Source::Stderr);
    let line = process.wait_for("address", |line| line["message"] == LISTENS);
    let address = line["address"].as_str().expect("text").to_owned();
    (process, address)
}

/// A worker with one slot.
#[derive(Debug)]
pub struct WorkerProcess {
    /// The process.
    pub process: LoggingProcess,
    /// Its name.
    pub name: String,
}

impl WorkerProcess {
    /// Starts a worker.
    pub fn start(coordinator: &CoordinatorProcess, name: &str) -> Self {
        Self::start_with(&coordinator.url(), name, &[])
    }

    /// Starts a worker of the coordinator at `url` with more arguments.
    pub fn start_with(url: &str, name: &str, args: &[&str]) -> Self {
        let mut command = Command::new(binary("worker"));
        command
            .args(["--coordinator", url, "--name", name, "--slots", "1"])
            .args(["--log-format", "json"])
            .args(args)
            .stdout(Stdio::null());
        let process = LoggingProcess::spawn(command, Source::Stderr);
        Self { process, name: name.to_owned() }
    }

    /// Starts `n` workers.
    pub fn start_many(coordinator: &CoordinatorProcess, n: usize) -> Vec<Self> {
        (0..n).map(|i| Self::start(coordinator, &format!("worker-{i}"))).collect()
    }
}

/// A running `swarmctl watch`.
#[derive(Debug)]
pub struct Watch {
    process: LoggingProcess,
}

impl Watch {
    /// Waits for the first generation. A watch reconnects to a coordinator that it has reached
    /// before, and gives up at once on one that it has not.
    pub fn wait_for_a_generation(&self) {
        self.process.wait_for("generation", |_| true);
    }

    /// Waits for the experiment to complete.
    pub fn finish(self) -> Finished {
        let (code, finished) = self.end();
        assert_eq!(code, Some(0), "{}", finished.last);
        assert_eq!(finished.last["state"], "completed", "{}", finished.last);
        finished
    }

    /// Waits for the end of the experiment; returns the exit code, too.
    pub fn end(mut self) -> (Option<i32>, Finished) {
        let status = self.process.wait();
        let mut generations = self.process.lines();
        let last = generations.pop().expect("a last line");
        for (i, line) in generations.iter().enumerate() {
            assert_eq!(line["generation"], i, "each generation once, in order");
        }
        (status.code(), Finished { generations, last })
    }
}

/// The lines that a watcher has printed.
#[derive(Debug)]
pub struct Finished {
    /// A line per generation.
    pub generations: Vec<LogLine>,
    /// The last line.
    pub last: LogLine,
}

impl Finished {
    /// The digest of each generation, and of everything.
    pub fn digests(&self) -> Vec<String> {
        let lines = self.generations.iter().chain([&self.last]);
        lines.map(|line| line["digest"].as_str().expect("text").to_owned()).collect()
    }
}

/// The digests of an undisturbed run of an experiment.
pub fn undisturbed(experiment: &Experiment) -> Vec<String> {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&experiment.path());
    coordinator.watch(id).finish().digests()
}
