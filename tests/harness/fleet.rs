//! Coordinators and workers as processes.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use rusqlite::Connection;
use serde_json::Value;
use tempfile::TempDir;

use crate::{
    LogLine, LoggingProcess, Outcome, binary,
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
    data_dir: TempDir,
}

impl CoordinatorProcess {
    /// Starts a coordinator.
    pub fn start() -> Self {
        Self::start_with(&[])
    }

    /// Starts a coordinator with more arguments.
    pub fn start_with(args: &[&str]) -> Self {
        let data_dir = tempfile::tempdir().expect("a temporary directory");
        let (process, address) = spawn("127.0.0.1:0", data_dir.path(), args);
        Self { process, address, data_dir }
    }

    /// Starts a killed coordinator again: same data, same address.
    pub fn restart(&mut self) {
        (self.process, self.address) = spawn(&self.address, self.data_dir.path(), &[]);
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
    pub fn data_dir(&self) -> PathBuf {
        self.data_dir.path().to_owned()
    }

    /// A connection of its own to the coordinator's database.
    pub fn database(&self) -> Connection {
        Connection::open(self.data_dir.path().join("swarmevo.sqlite3")).expect("the database opens")
    }

    /// Runs `swarmctl --output json ARGS` against it.
    pub fn swarmctl(&self, args: &[&str]) -> Outcome {
        let url = self.url();
        swarmctl(["--coordinator", &url].iter().chain(args))
    }

    /// Submits an experiment file; returns the experiment's id.
    pub fn submit(&self, path: &Path) -> u64 {
        let path = path.to_str().expect("UTF-8");
        let outcome = self.swarmctl(&["submit", path]).expect_success();
        let submitted: Value = serde_json::from_str(&outcome.stdout).expect("a JSON document");
        submitted["id"].as_u64().expect("an id")
    }

    /// Follows an experiment.
    pub fn watch(&self, id: u64) -> Watch {
        let mut command = Command::new(binary("swarmctl"));
        command.args(["--output", "json", "--coordinator", &self.url(), "watch", &id.to_string()]);
        Watch { process: LoggingProcess::spawn(command, Source::Stdout) }
    }

    /// Waits until the experiment's generation has been committed.
    pub fn wait_for_generation(&self, generation: u64) -> LogLine {
        self.process.wait_for("completed generation", |line| {
            line["message"] == "generation" && line["generation"] == generation
        })
    }
}

fn spawn(listen: &str, data_dir: &Path, args: &[&str]) -> (LoggingProcess, String) {
    let mut command = Command::new(binary("coordinator"));
    command
        .args(["--listen", listen, "--log-format", "json"])
        .args(["--log-level", "info,coordinator=debug", "--data-dir"])
        .arg(data_dir)
        .args(args)
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
        let mut command = Command::new(binary("worker"));
        command
            .args(["--coordinator", &coordinator.url(), "--name", name, "--slots", "1"])
            .args(["--log-format", "json"])
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
    /// Waits for the end of the experiment; returns the digest of each
    /// generation, and the last line.
    pub fn finish(mut self) -> (Vec<String>, Value) {
        let status = self.process.wait();
        let mut lines = self.process.lines();
        let last = lines.pop().expect("a last line");
        assert!(status.success(), "{last}");
        assert_eq!(last["state"], "completed", "{last}");
        for (i, line) in lines.iter().enumerate() {
            assert_eq!(line["generation"], i, "each generation once, in order");
        }
        let digest = |line: &Value| line["digest"].as_str().expect("text").to_owned();
        (lines.iter().map(digest).collect(), last)
    }
}
