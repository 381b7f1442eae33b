//! One referee process, as the coordinator sees it: it is started, asked, and lost.

use std::{
    collections::VecDeque,
    env, io,
    os::unix::process::ExitStatusExt as _,
    process::{ExitStatus, Stdio},
    sync::Arc,
    time::Duration,
};

use tokio::{
    io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader},
    process::{Child, ChildStderr, ChildStdin, ChildStdout, Command},
    signal::unix::SignalKind,
    task::JoinSet,
    time::timeout,
};
use tracing::warn;

use super::{
    RefereeProgram, RefereeRequest, Verdict, framing,
    messages::{Answer, Outcome, Request, SLOTS, Values},
};

/// Time for a new process to say that it is ready. Only a machine without memory or
/// processors needs seconds.
const START_TIMEOUT: Duration = Duration::from_secs(30);
/// Time for a process to end after its standard input or output has.
const END_TIMEOUT: Duration = Duration::from_secs(5);
/// Time for what a process has written before its end to be read.
const LAST_WORDS_TIMEOUT: Duration = Duration::from_millis(500);
/// Bytes of a line of its standard error; longer ones are broken.
const LINE_LEN_MAX: u64 = 1024;
/// Lines of its standard error that are logged; the others are dropped.
const LINES_MAX: usize = 100;

/// A process that is ready for an item. Dropping it kills the process.
#[derive(Debug)]
pub(super) struct Process {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// The specifications in the process's slots; the one used last is the last.
    specifications: VecDeque<(u32, Arc<str>)>,
    /// Id of the latest request.
    request_id: u64,
    /// One task, that logs what it writes to standard error.
    log: JoinSet<()>,
}

impl Process {
    /// Starts a process and waits until it is ready. The error says why there is none,
    /// and what to do.
    pub(super) async fn start(program: &RefereeProgram) -> Result<Self, String> {
        let name = program.path.display();
        let mut command = Command::new(&program.path);
        command.args(&program.args);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // The coordinator's settings: some are secrets, and one that is invalid, but
        // replaced by an option, would keep the process from starting.
        for (variable, _) in env::vars_os() {
            if variable.to_string_lossy().starts_with("SWARM_") {
                command.env_remove(variable);
            }
        }
        command.kill_on_drop(true);
        // Ctrl-C in the coordinator's terminal is for the coordinator.
        command.process_group(0);
        let mut child = command.spawn().map_err(|error| {
            format!(
                "the referee process {name} cannot be started ({error}); \
                 give the coordinator more of what that says is short, be it memory, processes \
                 or open files; if its program has been moved, start the coordinator again"
            )
        })?;
        let (Some(input), Some(output), Some(errors)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err("the referee process has no pipes; please report this".into());
        };
        let mut log = JoinSet::new();
        log.spawn(log_lines(errors));
        let output = BufReader::new(output);
        let specifications = VecDeque::new();
        let mut process = Self { child, input, output, specifications, request_id: 0, log };
        process.await_ready().await.map_err(|problem| {
            format!(
                "the referee process {name} {problem}; it has to be the coordinator or swarmctl \
                 of this release: start the coordinator again if its program was replaced"
            )
        })?;
        Ok(process)
    }

    async fn await_ready(&mut self) -> Result<(), String> {
        let said = timeout(START_TIMEOUT, framing::read_async::<Answer>(&mut self.output)).await;
        match said {
            Err(_) => Err(format!("was not ready within {} s", START_TIMEOUT.as_secs())),
            Ok(Ok(Some(Answer { outcome: Some(Outcome::Ready(fingerprint)), .. }))) => {
                if fingerprint == sim_core::FINGERPRINT {
                    return Ok(());
                }
                Err(format!(
                    "simulates with \"{fingerprint}\", not with \"{}\"",
                    sim_core::FINGERPRINT
                ))
            }
            Ok(Ok(None)) => Err(match self.exit_status().await {
                Some(status) => format!("ended before it was ready ({status})"),
                None => "closed its output before it was ready".into(),
            }),
            Ok(_) => Err("does not answer like a referee".into()),
        }
    }

    /// Whether it can be given an item: it may have been killed while it had none.
    pub(super) fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Has an item evaluated. The process is given back if it can take another one.
    pub(super) async fn evaluate(mut self, request: &RefereeRequest) -> (Verdict, Option<Self>) {
        let message = self.next_message(request);
        let Ok(frame) = framing::encode(&message) else {
            let reason = "the item is too large for a message to the referee process; \
                          please report this";
            return (Verdict::Unavailable(reason.into()), None);
        };
        // A process that has gone does not read; what it leaves behind says how it went.
        let _ = self.input.write_all(&frame).await;
        let said: io::Result<Option<Answer>> = framing::read_async(&mut self.output).await;
        let outcome = match said {
            Ok(Some(Answer { id, outcome: Some(outcome) })) if id == message.id => outcome,
            Ok(None) => return (self.death().await, None),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return (self.death().await, None);
            }
            Ok(_) => return (nonsense("it does not answer what it was asked"), None),
            Err(error) => return (nonsense(&error.to_string()), None),
        };
        let verdict = match outcome {
            Outcome::Values(Values { values }) => Verdict::Values(values),
            Outcome::Failure(failure) => Verdict::Failed(failure),
            Outcome::TooLarge(n_values) => Verdict::Unavailable(format!(
                "the item has {n_values} values, more than a message from the referee process \
                 holds; ask for fewer trials"
            )),
            Outcome::Ready(_) => return (nonsense("it starts twice"), None),
        };
        (verdict, Some(self))
    }

    /// The request as a message, with the specification if no slot has it.
    fn next_message(&mut self, request: &RefereeRequest) -> Request {
        let RefereeRequest { specification, .. } = request;
        self.request_id += 1;
        let known = self.specifications.iter().position(|(_, known)| known == specification);
        let (slot, text) = match known.and_then(|known| self.specifications.remove(known)) {
            Some((slot, _)) => (slot, None),
            None if self.specifications.len() < SLOTS => {
                (self.specifications.len() as u32, Some(specification.to_string()))
            }
            None => {
                let (slot, _) = self.specifications.pop_front().expect("all slots are in use");
                (slot, Some(specification.to_string()))
            }
        };
        self.specifications.push_back((slot, Arc::clone(specification)));
        Request::new(self.request_id, slot, text, request)
    }

    /// What it means that the output has ended within an item.
    async fn death(&mut self) -> Verdict {
        let Some(status) = self.exit_status().await else {
            return nonsense("it closed its output and did not end");
        };
        let told_to_stop = [SignalKind::terminate(), SignalKind::interrupt(), SignalKind::hangup()];
        if told_to_stop.iter().any(|signal| status.signal() == Some(signal.as_raw_value())) {
            return Verdict::Unavailable(format!(
                "the referee process was told to stop ({status}); it is started again for the \
                 next item"
            ));
        }
        if status.success() {
            return nonsense("it ended without an answer");
        }
        Verdict::Died(format!("took the process that computed it down ({status})"))
    }

    /// How the process ended; none if it goes on.
    async fn exit_status(&mut self) -> Option<ExitStatus> {
        let status = timeout(END_TIMEOUT, self.child.wait()).await.ok()?.ok()?;
        // Its last words say more than the status.
        let _ = timeout(LAST_WORDS_TIMEOUT, self.log.join_next()).await;
        Some(status)
    }

    /// Ends it.
    pub(super) async fn end(self) {
        let Self { mut child, input, .. } = self;
        drop(input);
        // If that takes too long, dropping it kills it.
        let _ = timeout(END_TIMEOUT, child.wait()).await;
    }
}

fn nonsense(what: &str) -> Verdict {
    Verdict::Unavailable(format!(
        "the referee process does not behave as it should: {what}; please report this. It is \
         started again for the next item"
    ))
}

/// Writes what a process says on standard error to the log.
async fn log_lines(errors: ChildStderr) {
    let mut errors = BufReader::new(errors);
    let mut line = Vec::new();
    for n_lines in 0.. {
        line.clear();
        let reading = (&mut errors).take(LINE_LEN_MAX).read_until(b'\n', &mut line).await;
        if !reading.is_ok_and(|n_bytes| n_bytes > 0) {
            return;
        }
        match n_lines {
            ..LINES_MAX => {
                let line = String::from_utf8_lossy(&line);
                warn!(line = ?line.trim_end(), "the referee process writes");
            }
            LINES_MAX => warn!("the referee process goes on writing, which is not logged"),
            _ => {}
        }
    }
}
