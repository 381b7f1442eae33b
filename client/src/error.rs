//! The errors of commands: their messages, codes and places.

mod answer;
mod code;

use std::{
    io,
    path::{Path, PathBuf},
};

use experiment_file::{ConfigError, Problem};
use model::store::StoreError;
use swarm_transport::tls_diagnosis;
use tonic::{Code as Grpc, Status};

use crate::{
    file_kind::{self, Kind},
    text::{self, with_reason},
};

pub use self::{
    answer::{Answer, wants_json},
    code::{Code, EXIT_CODES},
};

/// Why a command did not succeed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Bad input; the message states the correct input.
    #[error("{0}")]
    Input(String),
    /// Bad input of a kind that programs can tell apart.
    #[error("{message}")]
    At {
        /// The kind.
        code: Code,
        /// A file, an option or a name.
        place: String,
        /// The problem with the place, and the correct input.
        message: String,
    },
    /// An experiment file that cannot be read, or has mistakes.
    #[error("{} is not a valid experiment file", file.display())]
    Config {
        /// Which of the two.
        code: Code,
        /// The file.
        file: PathBuf,
        /// The problems.
        problems: Vec<Problem>,
    },
    /// An error after some runs of a group were submitted.
    #[error(
        "{n_submitted} of {n_runs} runs are submitted; repeat the command to submit the others: \
         {cause}"
    )]
    Incomplete {
        /// Number of runs that the coordinator has.
        n_submitted: usize,
        /// Number of runs of the group.
        n_runs: usize,
        /// The error of the next run.
        cause: Box<Error>,
    },
    /// Some experiments of a group are unchanged.
    #[error("{n_changed} of {n_all} experiments are changed, these are not:\n{lines}")]
    Partly {
        /// Number of changed experiments.
        n_changed: usize,
        /// Number of experiments to change.
        n_all: usize,
        /// The unchanged ones, one per line, each with the reason.
        lines: String,
        /// The first reason.
        cause: Box<Error>,
    },
    /// No such experiment, generation or individual.
    #[error("{0}")]
    NotFound(String),
    /// The state of the experiment does not allow the request.
    #[error("{0}")]
    WrongState(String),
    /// The coordinator did not answer within the patience.
    #[error(
        "cannot reach a coordinator at {address}: {reason}; without a fleet, go to the directory that \
         contains ./swarm-data, or name one with --data-dir; with a fleet, start one with \
         `coordinator`, or set its address with --coordinator, SWARM_COORDINATOR or the settings file"
    )]
    Unreachable {
        /// The coordinator's address.
        address: String,
        /// The deepest known cause.
        reason: String,
    },
    /// The coordinator does not accept the token.
    #[error("the coordinator at {address} does not accept this client: {refusal}")]
    Denied {
        /// The coordinator's address.
        address: String,
        /// The coordinator's reason.
        refusal: String,
    },
    /// One side has no TLS, or a certificate is not accepted.
    #[error("no TLS connection to the coordinator at {address}: {diagnosis}")]
    Tls {
        /// The coordinator's address.
        address: String,
        /// The problem and its remedy.
        diagnosis: String,
    },
    /// The server at the address is not a coordinator, or does not know the request.
    #[error("{message}")]
    Foreign {
        /// The address.
        address: String,
        /// The server's answer, and the remedy.
        message: String,
    },
    /// The experiment failed.
    #[error("{}", with_reason(&format!("experiment {id} failed"), reason))]
    Failed {
        /// Number of the experiment.
        id: u64,
        /// The reason; may be empty.
        reason: String,
    },
    /// The experiment was cancelled.
    #[error("{}", with_reason(&format!("experiment {id} was cancelled"), reason))]
    Cancelled {
        /// Number of the experiment.
        id: u64,
        /// The reason; may be empty.
        reason: String,
    },
    /// The experiment has not ended within the time limit of `watch`.
    #[error("experiment {id} has not ended; `{explain}` says what it waits for")]
    TimedOut {
        /// Number of the experiment.
        id: u64,
        /// The command that explains it.
        explain: String,
    },
    /// A database is damaged.
    #[error("{0}")]
    Damaged(String),
    /// A claim of a bundle is false.
    #[error("{0}")]
    Flawed(String),
    /// The system provides too few resources to start this program.
    #[error(transparent)]
    Starved(#[from] swarm_telemetry::Starved),
    /// A signal interrupted the command; the text states the consequences for the
    /// experiment.
    #[error("interrupted; {0}")]
    Interrupted(String),
    /// The reader of standard output closed it, and the command only prints.
    #[error("standard output is closed, so this command ends; experiments continue")]
    OutputClosed,
    /// Standard output, or a file, cannot be written.
    #[error("cannot write {what}: {source}")]
    Write {
        /// The destination.
        what: String,
        /// The cause.
        source: io::Error,
    },
    /// A bug in this program or the coordinator.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// The error of an invalid experiment file.
    pub fn invalid(file: &Path, error: &ConfigError) -> Self {
        let problems = error.problems.clone();
        Self::Config { code: Code::InvalidExperiment, file: file.into(), problems }
    }

    /// A mistake in the value of an option, in words that follow the option.
    pub fn option(option: &str, what: impl std::fmt::Display) -> Self {
        Self::at(Code::BadArgument, option, format!("{option} {what}"))
    }

    /// Bad input of a kind, at a place, with a message that names the place.
    pub fn at(code: Code, place: impl std::fmt::Display, message: impl Into<String>) -> Self {
        Self::At { code, place: place.to_string(), message: message.into() }
    }

    /// The same refusal, with what it is about: an argument, or the number of an experiment.
    pub fn about(self, place: impl std::fmt::Display) -> Self {
        let code = self.code();
        match self {
            Self::Input(message) | Self::NotFound(message) | Self::WrongState(message) => {
                Self::at(code, place, message)
            }
            error => error,
        }
    }

    /// The error of a file that cannot be read.
    pub fn of_file(path: &Path, what: impl std::fmt::Display) -> Self {
        let path = path.display();
        Self::at(Code::UnreadableFile, &path, format!("{path}: {what}"))
    }

    /// The error that the server at the address is not a coordinator.
    pub fn foreign(address: &str, banner: &str) -> Self {
        let message = format!(
            "the server at {address} is not a coordinator: it answers \"{banner}\"; is this the \
             right port?{}",
            if banner.starts_with("HTTP/") { PORTS } else { "" }
        );
        Self::Foreign { address: address.into(), message }
    }

    /// Whether the same request for another experiment would fail for the same reason.
    pub fn concerns_all(&self) -> bool {
        matches!(
            self,
            Self::Unreachable { .. }
                | Self::Denied { .. }
                | Self::Tls { .. }
                | Self::Foreign { .. }
        )
    }

    /// Its code for programs.
    pub fn code(&self) -> Code {
        match self {
            Self::At { code, .. } | Self::Config { code, .. } => *code,
            Self::Internal(_) => Code::Internal,
            Self::Write { .. } => Code::WriteFailed,
            Self::Input(_) => Code::BadInput,
            Self::Incomplete { cause, .. } | Self::Partly { cause, .. } => cause.code(),
            Self::NotFound(_) => Code::NotFound,
            Self::WrongState(_) => Code::WrongState,
            Self::Unreachable { .. } => Code::Unreachable,
            Self::Failed { .. } => Code::ExperimentFailed,
            Self::Cancelled { .. } => Code::ExperimentCancelled,
            Self::Denied { .. } => Code::TokenRefused,
            Self::Tls { .. } => Code::NoTls,
            Self::Foreign { .. } => Code::NotACoordinator,
            Self::TimedOut { .. } => Code::NotEnded,
            Self::Damaged(_) => Code::DatabaseDamaged,
            Self::Flawed(_) => Code::ClaimFalse,
            Self::Starved(_) => Code::MachineTooSmall,
            Self::Interrupted(_) => Code::Interrupted,
            Self::OutputClosed => Code::OutputClosed,
        }
    }

    /// The exit code of `swarmctl`, as its help lists them.
    pub fn exit_code(&self) -> u8 {
        self.code().exit_code()
    }

    /// What it is about, for programs: a file, an option, an experiment or an address.
    pub fn place(&self) -> Option<String> {
        match self {
            Self::At { place, .. } => Some(place.clone()),
            Self::Config { file, problems, .. } => Some(match &problems[..] {
                [one] => answer::line_of(file, one.line),
                _ => file.display().to_string(),
            }),
            Self::Incomplete { cause, .. } | Self::Partly { cause, .. } => cause.place(),
            Self::Unreachable { address, .. }
            | Self::Denied { address, .. }
            | Self::Tls { address, .. }
            | Self::Foreign { address, .. } => Some(address.clone()),
            Self::Failed { id, .. } | Self::Cancelled { id, .. } | Self::TimedOut { id, .. } => {
                Some(id.to_string())
            }
            Self::Write { what, .. } => Some(what.clone()),
            _ => None,
        }
    }

    /// The report for standard error.
    pub fn report(&self) -> String {
        match self {
            Self::Config { file, problems, .. } => {
                let lines = problems.iter().map(|problem| format!("{}: {problem}", file.display()));
                lines.collect::<Vec<_>>().join("\n")
            }
            Self::Interrupted(_) | Self::OutputClosed => self.to_string(),
            _ => format!("error: {self}"),
        }
    }

    /// The report, wrapped for a terminal of this width; `None`: no terminal. Lines about a place
    /// in a file stay whole, because editors parse them.
    pub fn report_within(&self, width: Option<usize>) -> String {
        let width = width.filter(|_| !matches!(self, Self::Config { .. }));
        text::fitting(&self.report(), width)
    }

    /// The error of reading or creating a data directory.
    pub fn from_store(error: &StoreError) -> Self {
        let text = error.to_string();
        match error {
            StoreError::Corrupt(_)
            | StoreError::WithoutLog { .. }
            | StoreError::NothingSound { .. } => Self::Damaged(text),
            StoreError::Bug(_) => Self::Internal(text),
            StoreError::NoDatabase { path } => {
                Self::no_data_directory(path.parent().unwrap_or(Path::new("")), text)
            }
            StoreError::Directory { path, .. } => Self::no_data_directory(path, text),
            _ => Self::Input(text),
        }
    }

    /// The error that a path is no data directory: names its kind, or else is `text`.
    fn no_data_directory(path: &Path, text: String) -> Self {
        let message = match file_kind::expect(path, &[Kind::DataDirectory], "a data directory") {
            Err(other) => format!("{}: {other}", path.display()),
            Ok(()) => text,
        };
        Self::at(Code::NoDataDirectory, path.display(), message)
    }

    /// The error of a failed call to the services on a data directory.
    pub fn from_status_here(status: &Status, data_dir: &str) -> Self {
        match status.code() {
            Grpc::Unavailable | Grpc::Internal | Grpc::Unknown => {
                Self::Internal(format!("{data_dir}: {}", reason(status)))
            }
            _ => Self::from_status(status, data_dir),
        }
    }

    /// The error of writing to standard output.
    pub fn from_stdout(source: io::Error) -> Self {
        match source.kind() {
            io::ErrorKind::BrokenPipe => Self::OutputClosed,
            _ => Self::Write { what: "standard output".into(), source },
        }
    }

    /// The error of a failed call.
    pub fn from_status(status: &Status, address: &str) -> Self {
        let message = status.message();
        if let Some(diagnosis) = tls_diagnosis(status) {
            return Self::Tls { address: address.into(), diagnosis };
        }
        match status.code() {
            _ if is_no_grpc(status) => Self::Foreign {
                address: address.into(),
                message: format!(
                    "the server at {address} is not a coordinator: it does not speak gRPC; is this \
                     the right port?{PORTS}"
                ),
            },
            _ if is_transport(status) => {
                Self::Unreachable { address: address.into(), reason: reason(status) }
            }
            Grpc::Unimplemented => Self::Foreign {
                address: address.into(),
                message: format!(
                    "the coordinator at {address} does not know this request; it is of another \
                     version than this swarmctl ({}), or another service",
                    env!("CARGO_PKG_VERSION")
                ),
            },
            Grpc::NotFound => Self::NotFound(message.into()),
            Grpc::FailedPrecondition => Self::WrongState(message.into()),
            Grpc::InvalidArgument => Self::Input(message.into()),
            Grpc::ResourceExhausted | Grpc::OutOfRange => {
                Self::at(Code::LimitReached, address, message)
            }
            Grpc::DataLoss => Self::Damaged(message.into()),
            Grpc::Unauthenticated | Grpc::PermissionDenied => {
                Self::Denied { address: address.into(), refusal: message.into() }
            }
            code => {
                let text = if message.is_empty() { code.description() } else { message };
                Self::Internal(format!("the coordinator at {address} answered: {text}"))
            }
        }
    }
}

/// Whether the same request may succeed later without a change by the user.
pub fn is_transient(status: &Status) -> bool {
    let code = status.code();
    if tls_diagnosis(status).is_some() {
        return false;
    }
    is_transport(status) || matches!(code, Grpc::Aborted | Grpc::ResourceExhausted)
}

/// The other servers that speak HTTP.
const PORTS: &str = " Pages (--web-listen) and metrics (--metrics-listen) have ports of their \
                     own; the port of a coordinator is 7700, unless --listen sets another one";

/// Whether an answer is HTTP but not gRPC, according to the messages of tonic.
fn is_no_grpc(status: &Status) -> bool {
    let message = status.message();
    message.contains("invalid compression flag")
        || message.contains("grpc-status header missing")
        || message.contains("invalid content-type")
}

/// Whether the status is about the connection. A status created on this side has a
/// source; one sent by a coordinator has none.
fn is_transport(status: &Status) -> bool {
    let code = status.code();
    std::error::Error::source(status).is_some()
        || matches!(code, Grpc::Unavailable | Grpc::DeadlineExceeded)
}

/// The deepest cause, which is the most specific.
pub fn reason(status: &Status) -> String {
    let mut source = std::error::Error::source(status);
    let mut text = status.message().to_owned();
    while let Some(cause) = source {
        text = cause.to_string();
        source = cause.source();
    }
    if text.is_empty() { status.code().description().into() } else { text }
}

/// A text with a prefix before each line.
pub fn prefix_lines(text: &str, name: &impl std::fmt::Display) -> String {
    let lines: Vec<String> = text.lines().map(|line| format!("{name}: {line}")).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests;
