//! A change of an experiment, or of each experiment of a group: a failure does not stop
//! the others, an interrupt does.

use std::{iter, pin::pin};

use swarm_proto::v1::{Experiment, ExperimentState};

use crate::{
    args::Target,
    connection::Connection,
    error::{Code, Error},
    interrupt,
    progress::Progress,
    subject::Subject,
    text,
};

/// The outcome of a change.
#[derive(Debug)]
pub struct Outcome<T> {
    /// The changed experiments.
    pub changed: Vec<T>,
    /// The reasons of the failures, or an interrupt.
    failure: Option<Error>,
}

impl<T> Outcome<T> {
    /// The error if a change failed. It is printed after the changed experiments.
    pub fn end(self) -> Result<(), Error> {
        self.failure.map_or(Ok(()), Err)
    }

    /// Whether a signal came before all changes were made.
    pub fn is_interrupted(&self) -> bool {
        matches!(self.failure, Some(Error::Interrupted(_)))
    }
}

/// The experiments to change: one, or those of a group in the right state. `why_none`:
/// the error if the group NAME has none.
pub async fn members(
    target: &Target,
    connection: &Connection,
    applies: impl Fn(ExperimentState) -> bool,
    why_none: &str,
) -> Result<Vec<Experiment>, Error> {
    let name = match &target.subject {
        Subject::Experiment(id) => return Ok(vec![connection.experiment(*id).await?]),
        Subject::Group(name) => name,
    };
    let mut members = connection.group(name).await?;
    // For a single experiment, the coordinator reports a wrong state.
    if members.len() > 1 {
        members.retain(|experiment| applies(experiment.state()));
    }
    match members.is_empty() {
        true => Err(Error::at(Code::WrongState, name, why_none.replace("NAME", name))),
        false => Ok(members),
    }
}

/// Changes experiments, one after the other. Stops early only for an interrupt, and for an error
/// that would repeat for all.
pub async fn change_each<T>(
    members: &[Experiment],
    progress: &mut Progress,
    change: impl AsyncFn(u64) -> Result<T, Error>,
) -> Outcome<T> {
    change_until(interrupt::came(), members, progress, change).await
}

/// Like [`change_each`], with any future as the interrupt.
async fn change_until<T>(
    interrupt: impl Future<Output = ()>,
    members: &[Experiment],
    progress: &mut Progress,
    change: impl AsyncFn(u64) -> Result<T, Error>,
) -> Outcome<T> {
    let mut interrupt = pin!(interrupt);
    let (mut changed, mut lines, mut first) = (Vec::new(), Vec::new(), None);
    for (n_done, experiment) in members.iter().enumerate() {
        if members.len() > 1 {
            progress.step(n_done as u64, members.len() as u64, "experiments");
        }
        let result = tokio::select! {
            biased;
            () = &mut interrupt => {
                progress.clear();
                let failure = Some(interrupted(changed.len(), experiment, members.len(), &lines));
                return Outcome { changed, failure };
            }
            result = change(experiment.id) => result,
        };
        match result {
            Ok(result) => changed.push(result),
            // A single error is printed without a list.
            Err(error) if members.len() == 1 => {
                return Outcome { changed, failure: Some(error.about(experiment.id)) };
            }
            Err(error) => {
                let error = error.about(experiment.id);
                let ends = error.concerns_all();
                lines.push(format!("{}: {error}", text::title(experiment)));
                first.get_or_insert(error);
                if ends {
                    break;
                }
            }
        }
    }
    progress.clear();
    let failure = first.map(|first| Error::Partly {
        n_changed: changed.len(),
        n_all: members.len(),
        lines: lines.join("\n"),
        cause: Box::new(first),
    });
    Outcome { changed, failure }
}

/// The error of an interrupt while `experiment` was being changed. `unchanged`: a line about each
/// experiment whose change failed.
fn interrupted(
    n_changed: usize,
    experiment: &Experiment,
    n_all: usize,
    unchanged: &[String],
) -> Error {
    let doubtful = text::title(experiment);
    if n_all == 1 {
        let what = format!("{doubtful} may be changed; repeat the command to be sure");
        return Error::Interrupted(what);
    }
    let first = format!(
        "{n_changed} of {n_all} experiments are changed, and {doubtful} may be; repeat the command \
         to change the others"
    );
    let lines: Vec<&str> =
        iter::once(&*first).chain(unchanged.iter().map(String::as_str)).collect();
    Error::Interrupted(lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use tokio_util::sync::CancellationToken;

    use super::*;
    use crate::output_format::OutputFormat;

    fn quiet() -> Progress {
        Progress::to(OutputFormat::Table, Box::new(std::io::sink()))
    }

    fn group(n: u64) -> Vec<Experiment> {
        (1..=n).map(|id| Experiment { id, name: "a".into(), ..Experiment::default() }).collect()
    }

    #[tokio::test]
    async fn a_run_that_cannot_be_changed_stops_no_other_and_is_named() {
        let change = async |id| match id {
            2 => Err(Error::NotFound("it has not completed".into())),
            id => Ok(id),
        };
        let outcome = change_each(&group(3), &mut quiet(), change).await;
        assert_eq!(outcome.changed, [1, 3]);
        let error = outcome.end().unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let report = error.report();
        for part in ["2 of 3 experiments", "experiment 2 (a): it has not completed"] {
            assert!(report.contains(part), "{report}");
        }
    }

    #[tokio::test]
    async fn an_unreachable_coordinator_stops_the_changes() {
        let change = async |id| match id {
            1 => Ok(id),
            2 => Err(Error::Denied { address: "x".into(), refusal: "y".into() }),
            _ => panic!("the second stops it"),
        };
        let outcome = change_each(&group(10_000), &mut quiet(), change).await;
        assert_eq!(outcome.changed, [1]);
        assert_eq!(outcome.end().unwrap_err().exit_code(), 7);
    }

    #[tokio::test]
    async fn a_single_error_is_reported_unchanged() {
        let change = async |_| Err::<u64, _>(Error::NotFound("it has not ended".into()));
        let error = change_each(&group(1), &mut quiet(), change).await.end().unwrap_err();
        assert_eq!(error.report(), "error: it has not ended");
    }

    /// The outcome of changes of a group whose last but one hangs until an interrupt comes. Of more
    /// than three, the first fails.
    async fn interrupted_at_last_but_one(n: u64) -> Outcome<u64> {
        let signal = CancellationToken::new();
        let change = async |id: u64| match id {
            1 if n > 3 => Err(Error::NotFound("it has not ended".into())),
            id if id + 1 == n => {
                signal.cancel();
                pending().await
            }
            id => Ok(id),
        };
        change_until(signal.cancelled(), &group(n), &mut quiet(), change).await
    }

    #[tokio::test]
    async fn an_interrupt_keeps_the_changes_so_far_and_names_the_doubtful_one() {
        let outcome = interrupted_at_last_but_one(3).await;
        assert!(outcome.is_interrupted());
        assert_eq!(outcome.changed, [1]);
        let error = outcome.end().unwrap_err();
        assert_eq!(error.exit_code(), 130);
        let expected = "interrupted; 1 of 3 experiments are changed, and experiment 2 (a) may be; \
                        repeat the command to change the others";
        assert_eq!(error.report(), expected);
    }

    #[tokio::test]
    async fn an_interrupt_hides_no_failure_before_it() {
        let error = interrupted_at_last_but_one(4).await.end().unwrap_err();
        let report = error.report();
        for part in ["1 of 4 experiments", "experiment 3 (a) may be", "\nexperiment 1 (a): it"] {
            assert!(report.contains(part), "{report}");
        }
    }

    #[tokio::test]
    async fn an_interrupted_change_of_one_experiment_may_have_been_made() {
        let change = async |_| pending::<Result<u64, Error>>().await;
        let outcome = change_until(async {}, &group(1), &mut quiet(), change).await;
        let expected =
            "interrupted; experiment 1 (a) may be changed; repeat the command to be sure";
        assert_eq!(outcome.end().unwrap_err().report(), expected);
    }
}
