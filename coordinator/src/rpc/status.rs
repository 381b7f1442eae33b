//! Converts errors to gRPC statuses.

use experiment_file::ConfigError;
use tonic::Status;

use crate::{
    control::{ControlError, WatchError},
    limits::PROBLEMS_LEN_MAX,
};

/// The status for clients and workers while the coordinator stops.
pub fn shutting_down() -> Status {
    ControlError::ShuttingDown.into()
}

impl From<WatchError> for Status {
    fn from(error: WatchError) -> Self {
        let text = error.to_string();
        match error {
            WatchError::TooSlow { .. } => Self::aborted(text),
            WatchError::ShuttingDown => Self::unavailable(text),
            WatchError::Store(error) => error.into(),
        }
    }
}

impl From<ControlError> for Status {
    fn from(error: ControlError) -> Self {
        let text = error.to_string();
        match error {
            ControlError::Invalid(_) => Self::invalid_argument(text),
            ControlError::Config(error) => Self::invalid_argument(problems(&error)),
            ControlError::NoMemory(shortage) if shortage.is_final() => Self::invalid_argument(text),
            ControlError::TooManyUnfinished
            | ControlError::TooManyRequests
            | ControlError::NoMemory(_)
            | ControlError::NotStoredYet(_) => Self::resource_exhausted(text),
            ControlError::NotNow(_) => Self::failed_precondition(text),
            ControlError::NoParent => Self::failed_precondition(text),
            ControlError::NotInQuarantine { .. } => Self::not_found(text),
            ControlError::EvaluationFailed(_) | ControlError::Panicked(_) => Self::internal(text),
            ControlError::Query(error) => error.into(),
            ControlError::ShuttingDown => Self::unavailable(text),
        }
    }
}

/// The problems, one per line, up to the limit of a header.
fn problems(error: &ConfigError) -> String {
    let mut text = String::new();
    for (i, problem) in error.problems.iter().enumerate() {
        let line = problem.to_string();
        if i > 0 && text.len() + line.len() > PROBLEMS_LEN_MAX {
            text += &format!("\n... and {} more", error.problems.len() - i);
            break;
        }
        if i > 0 {
            text.push('\n');
        }
        text += &line[..line.floor_char_boundary(PROBLEMS_LEN_MAX)];
    }
    text
}
