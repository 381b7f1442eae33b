//! A used directory: a run in `swarm-data`, its experiment file and its history.

use std::{fs, path::Path, process::Command};

use harness::{Experiment, Outcome, binary};

/// A directory of its own.
pub struct DataDirectory(tempfile::TempDir);

impl DataDirectory {
    /// Creates it, with `experiment.json` of two generations, its run as experiment 1, and
    /// `history.csv`.
    pub fn new() -> Self {
        let this = Self(tempfile::tempdir().unwrap());
        let experiment = Experiment::tiny(2);
        fs::copy(experiment.path(), this.path().join("experiment.json")).unwrap();
        this.swarmctl("run experiment.json").expect_success();
        let history = this.swarmctl("history 1 --output csv").expect_success();
        fs::write(this.path().join("history.csv"), history.stdout).unwrap();
        this
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Runs `swarmctl ARGS` in it to its end.
    pub fn swarmctl(&self, args: &str) -> Outcome {
        self.swarmctl_with(&[("SWARM_DATA_DIR", "swarm-data"), ("SWARM_CONFIG", "")], args)
    }

    /// The same with variables of the environment.
    pub fn swarmctl_with(&self, environment: &[(&str, &str)], args: &str) -> Outcome {
        let mut command = Command::new(binary("swarmctl"));
        command
            .args(args.split(' '))
            .current_dir(self.path())
            .env_remove("SWARM_COORDINATOR")
            .envs(environment.iter().copied());
        Outcome::of_command(&mut command)
    }
}
