//! Runs programs on a terminal.

use std::{
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::{Outcome, binary, skipped_for_want_of};

/// A terminal of some width, made by `script` of util-linux.
#[derive(Debug, Clone)]
pub struct Terminal {
    directory: PathBuf,
    columns: usize,
    environment: Vec<(String, String)>,
}

impl Terminal {
    /// Finds `script`; without it, returns `None` and prints that the test is skipped.
    pub fn find(directory: &Path, columns: usize) -> Option<Self> {
        let found = Command::new("script").arg("--version").output();
        if !found.is_ok_and(|output| output.status.success()) {
            skipped_for_want_of("script of util-linux", "apt-get install bsdutils");
            return None;
        }
        let environment = vec![("TERM".to_owned(), "xterm-256color".to_owned())];
        Some(Self { directory: directory.to_owned(), columns, environment })
    }

    /// The same with a variable of the environment.
    pub fn with(mut self, name: &str, value: &str) -> Self {
        self.environment.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Runs `swarmctl ARGS` on it; `typed`: the user's input. All visible text is in `stdout`.
    /// The arguments may end in shell syntax, such as `| cat`.
    pub fn swarmctl(&self, args: &str, typed: &str) -> Outcome {
        let program = binary("swarmctl");
        let line = format!("stty cols {} rows 50; {} {args}", self.columns, program.display());
        let mut command = Command::new("script");
        command
            .args(["--quiet", "--return", "--command", &line, "/dev/null"])
            .current_dir(&self.directory)
            .env("SHELL", "/bin/sh")
            .env_remove("NO_COLOR")
            .env_remove("CLICOLOR_FORCE")
            .env_remove("CLICOLOR")
            .env_remove("COLUMNS")
            .envs(self.environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("script starts");
        let mut keyboard = child.stdin.take().expect("piped");
        keyboard.write_all(typed.as_bytes()).expect("script reads");
        // At the end of its input, `script` closes the program's input.
        drop(keyboard);
        let output = child.wait_with_output().expect("script ends");
        let seen = String::from_utf8(output.stdout).expect("UTF-8").replace("\r\n", "\n");
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        Outcome { code: output.status.code(), stdout: seen, stderr, error: None }
    }
}
