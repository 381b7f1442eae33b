//! The Python example, if there is a Python that can run it.

use std::{
    env,
    ffi::OsString,
    io::{BufRead as _, BufReader, Read as _},
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
};

use tempfile::TempDir;

use crate::{Outcome, skipped_for_want_of, workspace_file};

/// The Python that `.ci/run` installs with the example's requirements.
const VIRTUAL_ENVIRONMENT: &str = "target/python/bin/python";

/// A Python with grpcio, and the code that it generates from the proto files.
#[derive(Debug)]
pub struct PythonClient {
    interpreter: PathBuf,
    generated: TempDir,
}

/// A Python that has a module; `None`, with a line that the test is skipped, if there is none.
pub fn python_with(module: &str) -> Option<PathBuf> {
    let interpreter = env::var_os("SWARM_TEST_PYTHON")
        .map_or_else(|| workspace_file(VIRTUAL_ENVIRONMENT), PathBuf::from);
    let import = format!("import {module}");
    let found = Command::new(&interpreter).args(["-c", &import]).output();
    if !found.is_ok_and(|output| output.status.success()) {
        skipped_for_want_of(
            &format!("Python with {module} at {}", interpreter.display()),
            "python3 -m venv target/python && \
             target/python/bin/pip install -r .ci/requirements.txt",
        );
        return None;
    }
    Some(interpreter)
}

impl PythonClient {
    /// Finds a Python; without one, returns `None` and prints that the test is skipped.
    pub fn find() -> Option<Self> {
        let interpreter = env::var_os("SWARM_TEST_PYTHON")
            .map_or_else(|| workspace_file(VIRTUAL_ENVIRONMENT), PathBuf::from);
        if !interpreter.exists() {
            skipped_for_want_of(
                &format!("Python with grpcio at {}", interpreter.display()),
                "python3 -m venv target/python && \
                 target/python/bin/pip install -r client/examples/requirements.txt",
            );
            return None;
        }
        let client = Self { interpreter, generated: tempfile::tempdir().expect("a directory") };
        client.generate();
        Some(client)
    }

    /// Generates the code as the example's first lines say.
    fn generate(&self) {
        let option = |name: &str, path: &Path| {
            let mut option = OsString::from(name);
            option.push(path);
            option
        };
        let mut command = Command::new(&self.interpreter);
        command
            .args(["-m", "grpc_tools.protoc", "-I"])
            .arg(workspace_file("proto"))
            .arg(option("--python_out=", self.generated.path()))
            .arg(option("--grpc_python_out=", self.generated.path()))
            .arg("swarm/v1/experiment.proto");
        Outcome::of_command(&mut command).expect_success();
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(&self.interpreter);
        command
            .arg(workspace_file("client/examples/submit.py"))
            .args(args)
            .env("PYTHONPATH", self.generated.path())
            .env("PYTHONDONTWRITEBYTECODE", "1");
        command
    }

    /// Runs the example to its end.
    pub fn run(&self, args: &[&str]) -> Outcome {
        Outcome::of_command(&mut self.command(args))
    }

    /// Starts the example.
    pub fn start(&self, args: &[&str]) -> RunningPythonClient {
        let mut child = self
            .command(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the interpreter starts");
        let rest = BufReader::new(child.stdout.take().expect("piped"));
        RunningPythonClient { child, rest, stdout: String::new() }
    }
}

/// The example while it runs.
#[derive(Debug)]
pub struct RunningPythonClient {
    child: Child,
    rest: BufReader<ChildStdout>,
    /// The output read so far.
    stdout: String,
}

impl RunningPythonClient {
    /// Waits for a line of its output.
    pub fn wait_for_line(&mut self, start: &str) {
        loop {
            let length = self.stdout.len();
            let n = self.rest.read_line(&mut self.stdout).expect("UTF-8");
            assert!(n > 0, "no line `{start}...` in {}", self.stdout);
            if self.stdout[length..].starts_with(start) {
                return;
            }
        }
    }

    /// Waits for a remark on standard error.
    pub fn wait_for_remark(&mut self, part: &str) {
        let mut read = Vec::new();
        let stderr = self.child.stderr.as_mut().expect("piped");
        let mut byte = [0];
        while !String::from_utf8_lossy(&read).contains(part) {
            stderr.read_exact(&mut byte).expect("it says more before it ends");
            read.extend(byte);
        }
    }

    /// Waits for its end.
    pub fn finish(mut self) -> Outcome {
        let mut stderr = String::new();
        self.rest.read_to_string(&mut self.stdout).expect("UTF-8");
        let mut errors = self.child.stderr.take().expect("piped");
        errors.read_to_string(&mut stderr).expect("UTF-8");
        let status = self.child.wait().expect("a child can be waited for");
        Outcome {
            code: status.code(),
            stdout: std::mem::take(&mut self.stdout),
            stderr,
            error: None,
        }
    }
}

impl Drop for RunningPythonClient {
    fn drop(&mut self) {
        // A failed test must not leave processes behind.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
