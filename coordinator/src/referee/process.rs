//! One referee process, as the coordinator sees it: its start, its answers, its end.

use std::{
    collections::VecDeque,
    env, io,
    os::unix::process::ExitStatusExt as _,
    process::{ExitStatus, Stdio},
    sync::Arc,
    time::Duration,
};

use prost::Message as _;
use swarm_proto::v1::{self, item_result::Outcome, work_request, work_response::Message};
use tokio::{
    io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader},
    process::{Child, ChildStderr, ChildStdin, ChildStdout, Command},
    signal::unix::SignalKind,
    task::JoinSet,
    time::timeout,
};
use tracing::warn;

use engine::{RefereeRequest, Verdict};

use super::{RefereeProgram, stream::Arrived};
use crate::{
    codec,
    ids::{EvaluationId, JobId},
};

/// Number of compiled specifications that a process keeps.
const SPECIFICATIONS_MAX: usize = 4;
/// Time for a new process to report that it is ready. Only a machine that lacks memory or
/// processors needs seconds.
const START_TIMEOUT: Duration = Duration::from_secs(30);
/// Time for a process to end after its standard input or output is closed.
const END_TIMEOUT: Duration = Duration::from_secs(5);
/// Time to read the last output of a process.
const LAST_WORDS_TIMEOUT: Duration = Duration::from_millis(500);
/// Bytes per line of its standard error; longer lines are split.
const LINE_LEN_MAX: u64 = 1024;
/// Number of lines of its standard error to log; the rest is dropped.
const LINES_MAX: usize = 100;

/// A process that is ready for an item. Dropping it kills the process.
#[derive(Debug)]
pub(super) struct Process {
    child: Child,
    input: ChildStdin,
    output: ChildStdout,
    arrived: Arrived,
    /// The specifications that the process has, each with the job id that stands for it, least
    /// recently used first.
    specifications: VecDeque<(JobId, Arc<str>)>,
    n_specifications_sent: u64,
    n_items_sent: u64,
    /// One task, which logs the process's standard error.
    log: JoinSet<()>,
}

impl Process {
    /// Starts a process and waits until it is ready. The error says what went wrong, and what to
    /// do.
    pub(super) async fn start(program: &RefereeProgram) -> Result<Self, String> {
        let name = program.path.display();
        let mut command = Command::new(&program.path);
        command.args(&program.args);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Removes the coordinator's variables. Some are secrets, and an invalid one would keep the
        // process from starting, even if an option of the coordinator replaces it.
        for (variable, _) in env::vars_os() {
            if variable.to_string_lossy().starts_with("SWARM_") {
                command.env_remove(variable);
            }
        }
        command.kill_on_drop(true);
        // Only the coordinator reacts to Ctrl-C in its terminal.
        command.process_group(0);
        let mut child = command.spawn().map_err(|error| {
            format!(
                "the referee process {name} cannot be started ({error}); raise the coordinator's \
                 limit that the error names, such as memory, processes or open files; if its \
                 program has been moved, start the coordinator again"
            )
        })?;
        let (Some(input), Some(output), Some(errors)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err("the referee process has no pipes; please report this".into());
        };
        let mut log = JoinSet::new();
        log.spawn(log_lines(errors));
        let mut process = Self {
            child,
            input,
            output,
            arrived: Arrived::default(),
            specifications: VecDeque::new(),
            n_specifications_sent: 0,
            n_items_sent: 0,
            log,
        };
        process.await_ready().await.map_err(|problem| {
            format!(
                "the referee process {name} {problem}; it has to be the coordinator or swarmctl \
                 of this release: start the coordinator again if its program was replaced"
            )
        })?;
        Ok(process)
    }

    async fn await_ready(&mut self) -> Result<(), String> {
        match timeout(START_TIMEOUT, self.next_message()).await {
            Err(_) => Err(format!("was not ready within {} s", START_TIMEOUT.as_secs())),
            Ok(Ok(Some(work_request::Message::Hello(hello)))) => {
                let (theirs, ours) = (hello.sim_core_fingerprint, sim_core::FINGERPRINT);
                if theirs == ours {
                    return Ok(());
                }
                Err(format!("simulates with \"{theirs}\", not with \"{ours}\""))
            }
            Ok(Ok(None)) => Err(match self.exit_status().await {
                Some(status) => format!("ended before it was ready ({status})"),
                None => "closed its output before it was ready".into(),
            }),
            Ok(_) => Err("does not answer like a referee".into()),
        }
    }

    /// Whether the process still runs: it may have been killed while it had no item.
    pub(super) fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Evaluates an item. Returns the process if it can take another one.
    pub(super) async fn evaluate(mut self, request: &RefereeRequest) -> (Verdict, Option<Self>) {
        let messages = self.messages(request);
        // A dead process does not read; its exit status says how it ended.
        let _ = self.input.write_all(&messages).await;
        let results = match self.next_message().await {
            Ok(Some(work_request::Message::Results(v1::ItemResults { results }))) => results,
            Ok(None) => return (self.death().await, None),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return (self.death().await, None);
            }
            Ok(_) => return (nonsense("it does not answer the request"), None),
            Err(error) => return (nonsense(&error.to_string()), None),
        };
        let result = results.into_iter().find(|result| result.assignment_id == self.n_items_sent);
        let verdict = match result.and_then(|result| result.outcome) {
            Some(Outcome::Fitness(v1::TrialFitness { values })) => Verdict::Values(values),
            Some(Outcome::Measures(v1::TrialMeasures { values })) => Verdict::Values(values),
            Some(Outcome::Descriptors(v1::TrialDescriptors { values })) => Verdict::Values(values),
            Some(Outcome::Failure(v1::ItemFailure { message })) => Verdict::Failed(message),
            None => return (nonsense("it does not answer the request"), None),
        };
        (verdict, Some(self))
    }

    /// The process's next message; `None` if its output has ended.
    async fn next_message(&mut self) -> io::Result<Option<work_request::Message>> {
        loop {
            if let Some(v1::WorkRequest { message }) = self.arrived.take()? {
                return message
                    .map_or_else(|| Err(io::ErrorKind::InvalidData.into()), |m| Ok(Some(m)));
            }
            if self.output.read_buf(&mut self.arrived.0).await? == 0 {
                return self.arrived.end().map(|()| None);
            }
        }
    }

    /// The messages that request an item. They include its specification if the process lacks it;
    /// the process then forgets the least recently used specification.
    fn messages(&mut self, request: &RefereeRequest) -> Vec<u8> {
        let RefereeRequest { specification, genotype, trial_set, trials, output } = request;
        let mut bytes = Vec::new();
        let mut say = |message| {
            let message = v1::WorkResponse { message: Some(message) };
            bytes.extend(message.encode_length_delimited_to_vec());
        };
        let known = self.specifications.iter().position(|(_, known)| known == specification);
        let job = match known.and_then(|index| self.specifications.remove(index)) {
            Some((job, _)) => job,
            None => {
                if self.specifications.len() == SPECIFICATIONS_MAX
                    && let Some((oldest, _)) = self.specifications.pop_front()
                {
                    say(Message::EndJob(v1::EndJob { job: Some(codec::job(oldest)) }));
                }
                self.n_specifications_sent += 1;
                let new = EvaluationId(self.n_specifications_sent).into();
                let (job, config_json) = (Some(codec::job(new)), specification.to_string());
                say(Message::Spec(v1::JobSpec { job, config_json }));
                new
            }
        };
        self.specifications.push_back((job, Arc::clone(specification)));
        self.n_items_sent += 1;
        say(Message::Assignments(v1::Assignments {
            job: Some(codec::job(job)),
            trial_set: Some(codec::trial_set(*trial_set)),
            output: codec::output(*output).into(),
            assignments: vec![v1::Assignment {
                assignment_id: self.n_items_sent,
                first_trial: trials.start,
                trial_count: trials.end - trials.start,
                genotype: genotype.to_vec(),
                individual: None,
            }],
        }));
        bytes
    }

    /// The verdict if the output ends within an item.
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

    /// How the process ended; `None` if it still runs.
    async fn exit_status(&mut self) -> Option<ExitStatus> {
        let status = timeout(END_TIMEOUT, self.child.wait()).await.ok()?.ok()?;
        // Its last output says more than the status.
        let _ = timeout(LAST_WORDS_TIMEOUT, self.log.join_next()).await;
        Some(status)
    }

    /// Ends the process.
    pub(super) async fn end(self) {
        let Self { mut child, input, .. } = self;
        drop(input);
        // If the process takes too long to end, dropping it kills it.
        let _ = timeout(END_TIMEOUT, child.wait()).await;
    }
}

fn nonsense(what: &str) -> Verdict {
    Verdict::Unavailable(format!(
        "the referee process does not behave as it should: {what}; please report this. It is \
         started again for the next item"
    ))
}

/// Writes a process's standard error to the log.
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
