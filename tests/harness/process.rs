//! Processes under test, and their output.

use std::{
    ffi::OsStr,
    fs,
    io::{BufRead as _, BufReader},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{Arc, Condvar, Mutex},
    thread,
    time::Duration,
};

use serde_json::{Value, json};

use crate::{answers::Answers, binary};

/// A deadline that only a hanging program misses.
pub(crate) const DEADLINE: Duration = Duration::from_secs(120);

/// Why the lock of the lines cannot be poisoned.
const POISONED: &str = "nothing panics while it holds the lines";

/// A line of a JSON log.
pub type LogLine = Value;

/// A process whose JSON lines (of its log, or of its output) are collected.
#[derive(Debug)]
pub struct LoggingProcess {
    child: Child,
    lines: Arc<Lines>,
    /// What the lines are, if they are answers of `swarmctl`.
    answers: Option<Answers>,
}

#[derive(Debug, Default)]
struct Lines {
    read: Mutex<(Vec<LogLine>, bool)>,
    changed: Condvar,
}

/// The stream on which a process prints its JSON lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    Stdout,
    Stderr,
}

impl LoggingProcess {
    pub(crate) fn spawn(mut command: Command, source: Source) -> Self {
        match source {
            Source::Stdout => command.stdout(Stdio::piped()),
            Source::Stderr => command.stderr(Stdio::piped()),
        };
        let mut child = command.stdin(Stdio::null()).spawn().expect("the program starts");
        let lines = Arc::new(Lines::default());
        let sink = Arc::clone(&lines);
        let reader: Box<dyn std::io::Read + Send> = match source {
            Source::Stdout => Box::new(child.stdout.take().expect("piped")),
            Source::Stderr => Box::new(child.stderr.take().expect("piped")),
        };
        thread::spawn(move || {
            for line in BufReader::new(reader).lines().map_while(Result::ok) {
                // Not JSON, such as the text of a panic: show it with the test's output.
                match serde_json::from_str(&line) {
                    Ok(value) => sink.read.lock().expect(POISONED).0.push(value),
                    Err(_) => eprintln!("{line}"),
                }
                sink.changed.notify_all();
            }
            sink.read.lock().expect(POISONED).1 = true;
            sink.changed.notify_all();
        });
        Self { child, lines, answers: None }
    }

    /// Starts `swarmctl --output json ARGS`.
    pub(crate) fn of_swarmctl<A: AsRef<OsStr>>(args: &[A]) -> Self {
        let answers = Answers::of_line(args);
        let mut command = Command::new(binary("swarmctl"));
        command.args(["--output", "json"]).args(args);
        let mut process = Self::spawn(command, Source::Stdout);
        process.answers = answers;
        process
    }

    /// Waits for a line, past or future; panics if the process ends without it.
    pub fn wait_for(&self, what: &str, is_it: impl Fn(&LogLine) -> bool) -> LogLine {
        self.find(0, what, is_it).1
    }

    /// Waits for a line that comes after the first `n_seen` ones; returns it
    /// with the number of lines up to and including it.
    pub fn find(
        &self,
        n_seen: usize,
        what: &str,
        is_it: impl Fn(&LogLine) -> bool,
    ) -> (usize, LogLine) {
        let mut next = n_seen;
        let mut read = self.lines.read.lock().expect(POISONED);
        loop {
            while let Some(line) = read.0.get(next) {
                next += 1;
                if is_it(line) {
                    return (next, line.clone());
                }
            }
            let is_over = read.1;
            let (guard, timeout) = self
                .lines
                .changed
                .wait_timeout_while(read, DEADLINE, |read| read.0.len() == next && !read.1)
                .expect(POISONED);
            read = guard;
            if is_over || timeout.timed_out() {
                let lines = read.0.clone();
                drop(read);
                panic!("no {what}; the process said {lines:#?}");
            }
        }
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Its present memory, MiB.
    pub fn memory_mib(&self) -> u64 {
        self.status_mib("VmRSS:")
    }

    /// Its peak memory so far, MiB.
    pub fn peak_memory_mib(&self) -> u64 {
        self.status_mib("VmHWM:")
    }

    fn status_mib(&self, key: &str) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.id())).expect("Linux");
        let line = status.lines().find_map(|line| line.strip_prefix(key));
        let kib = line.and_then(|line| line.trim().strip_suffix(" kB")).expect("a size");
        kib.trim().parse::<u64>().expect("a number") >> 10
    }

    /// All lines so far.
    pub fn lines(&self) -> Vec<LogLine> {
        self.lines.read.lock().expect(POISONED).0.clone()
    }

    /// SIGKILL. Returns when the process is gone and all its lines are read.
    pub fn kill(&mut self) {
        self.child.kill().expect("the process can be killed");
        self.wait();
    }

    /// Sends a signal by its name, such as `TERM`.
    pub fn signal(&self, name: &str) {
        let status = Command::new("kill")
            .args([format!("-{name}"), self.child.id().to_string()])
            .status()
            .expect("kill is on every system");
        assert!(status.success());
    }

    /// Waits for the process to end and for its last line.
    pub fn wait(&mut self) -> ExitStatus {
        let status = self.child.wait().expect("a child can be waited for");
        let mut read = self.lines.read.lock().expect(POISONED);
        while !read.1 {
            read = self.lines.changed.wait(read).expect(POISONED);
        }
        status
    }
}

impl Drop for LoggingProcess {
    fn drop(&mut self) {
        // A failed test must not leave processes behind.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let (Some(answers), false) = (&self.answers, thread::panicking()) {
            // A document has several lines, none of which is an object.
            let objects = self.lines().into_iter().filter(LogLine::is_object);
            objects.for_each(|line| answers.check(&line));
        }
    }
}

/// The result of a command.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error. Of a command for programs, with the message of its error instead of the
    /// JSON object.
    pub stderr: String,
    /// The error of a command for programs.
    pub error: Option<Value>,
}

impl Outcome {
    /// Runs a command to its end.
    pub fn of_command(command: &mut Command) -> Self {
        let output = command.stdin(Stdio::null()).output().expect("the program starts");
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("UTF-8"),
            stderr: String::from_utf8(output.stderr).expect("UTF-8"),
            error: None,
        }
        .with_error()
    }

    /// Takes the error for programs out of standard error, where it is the last line.
    fn with_error(mut self) -> Self {
        let lines: Vec<&str> = self.stderr.lines().collect();
        let Some((last, remarks)) = lines.split_last() else { return self };
        let Ok(mut answer) = serde_json::from_str::<Value>(last) else { return self };
        let error = answer.get_mut("error").map(Value::take).unwrap_or_default();
        let Some(message) = error["message"].as_str() else { return self };
        Answers::of_errors().check(&json!({ "error": error }));
        let is_of_lines = error["mistakes"].is_array() || message.contains(": cannot be read: ");
        let prefix = if is_of_lines { "" } else { "error: " };
        let lines: Vec<String> = remarks.iter().map(|line| format!("{line}\n")).collect();
        self.stderr = format!("{}{prefix}{message}\n", lines.concat());
        self.error = Some(error);
        self
    }

    /// Panics unless the command succeeded.
    pub fn expect_success(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:#?}");
        self
    }

    /// Standard output as one JSON document.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).expect("a JSON document")
    }

    /// Standard output as JSON lines.
    pub fn json_lines(&self) -> Vec<Value> {
        let parse = |line| serde_json::from_str(line).expect("every line is JSON");
        self.stdout.lines().map(parse).collect()
    }
}

/// Runs `swarmctl --output json ARGS` to its end.
pub fn swarmctl<A: AsRef<OsStr>>(args: impl IntoIterator<Item = A>) -> Outcome {
    let args: Vec<A> = args.into_iter().collect();
    let answers = Answers::of_line(&args);
    let mut command = Command::new(binary("swarmctl"));
    command.args(["--output", "json"]).args(args);
    let outcome = Outcome::of_command(&mut command);
    answers.iter().for_each(|answers| answers.check_text(&outcome.stdout));
    outcome
}

/// Starts `swarmctl --output json ARGS`.
pub fn swarmctl_process<A: AsRef<OsStr>>(args: impl IntoIterator<Item = A>) -> LoggingProcess {
    LoggingProcess::of_swarmctl(&args.into_iter().collect::<Vec<A>>())
}
