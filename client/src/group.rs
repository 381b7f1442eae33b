//! A change of an experiment, or of each experiment of a group: a failure does not stop
//! the others.

use swarm_proto::v1::{Experiment, ExperimentState};

use crate::{
    args::Target,
    connection::Connection,
    error::{Code, Error},
    progress::Progress,
    subject::Subject,
    text,
};

/// The outcome of a change.
#[derive(Debug)]
pub struct Outcome<T> {
    /// The changed experiments.
    pub changed: Vec<T>,
    /// The reasons of the failures.
    failure: Option<Error>,
}

impl<T> Outcome<T> {
    /// The error if a change failed. It is printed after the changed experiments.
    pub fn end(self) -> Result<(), Error> {
        self.failure.map_or(Ok(()), Err)
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

/// Changes experiments, one after the other. Stops early only for an error that would repeat
/// for all.
pub async fn change_each<T>(
    members: &[Experiment],
    progress: &mut Progress,
    change: impl AsyncFn(u64) -> Result<T, Error>,
) -> Outcome<T> {
    let (mut changed, mut lines, mut first) = (Vec::new(), Vec::new(), None);
    for (n_done, experiment) in members.iter().enumerate() {
        if members.len() > 1 {
            progress.step(n_done as u64, members.len() as u64, "experiments");
        }
        match change(experiment.id).await {
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

#[cfg(test)]
mod tests {
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
}
