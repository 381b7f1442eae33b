//! How long the autoscaler bears with a Slurm that fails. Time is an argument.

use std::time::Duration;

use tokio::time::Instant;

use crate::error::Error;

/// Slurm may fail for this time. Its controller restarts, or another one takes over, sooner.
const FAILING_TIME_MAX: Duration = Duration::from_secs(600);

/// The patience with one kind of call of Slurm.
#[derive(Debug, Default)]
pub struct Patience {
    /// The last sign that such calls work; none yet: a failure is probably a mistake of the user,
    /// such as an unknown partition.
    worked_at: Option<Instant>,
    /// The reason that the user knows, if calls fail.
    told: Option<String>,
}

impl Patience {
    /// Records a sign that calls work, although they may still fail at times.
    pub fn works(&mut self, now: Instant) {
        self.worked_at = Some(now);
    }

    /// Records a success: the next failure is news.
    pub fn succeeded(&mut self, now: Instant) {
        *self = Self { worked_at: Some(now), told: None };
    }

    /// Records a failure. Returns the remark on it, if it is news; gives up with the error if calls
    /// have never worked, or not for [`FAILING_TIME_MAX`].
    pub fn failed(&mut self, now: Instant, error: Error) -> Result<Option<String>, Error> {
        if self.worked_at.is_none_or(|worked_at| now - worked_at >= FAILING_TIME_MAX) {
            return Err(error);
        }
        let reason = error.to_string();
        if self.told.as_ref() == Some(&reason) {
            return Ok(None);
        }
        let remark = format!("{reason}; the next check tries again");
        self.told = Some(reason);
        Ok(Some(remark))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(reason: &str) -> Error {
        Error::Input(reason.to_owned())
    }

    #[test]
    fn a_call_that_has_never_worked_fails_at_once() {
        let mut patience = Patience::default();
        let refused = patience.failed(Instant::now(), error("invalid partition")).unwrap_err();
        assert_eq!(refused.to_string(), "invalid partition");
    }

    #[test]
    fn failures_end_the_command_only_after_ten_minutes_without_a_success() {
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let mut patience = Patience::default();
        patience.succeeded(at(0));
        patience.failed(at(599), error("no answer")).unwrap();
        patience.succeeded(at(599));
        patience.failed(at(1198), error("no answer")).unwrap();
        patience.works(at(1198));
        patience.failed(at(1797), error("no answer")).unwrap();
        patience.failed(at(1798), error("no answer")).unwrap_err();
    }

    #[test]
    fn a_failure_is_told_once_until_a_success_or_another_reason() {
        let now = Instant::now();
        let mut patience = Patience::default();
        patience.succeeded(now);
        let remark = patience.failed(now, error("full")).unwrap().unwrap();
        assert_eq!(remark, "full; the next check tries again");
        patience.works(now);
        assert_eq!(patience.failed(now, error("full")).unwrap(), None);
        assert!(patience.failed(now, error("away")).unwrap().is_some());
        patience.succeeded(now);
        assert!(patience.failed(now, error("away")).unwrap().is_some());
    }
}
