//! Consent to changes that cannot be undone: `--yes`, `--dry-run`, or a question.

use std::{
    io::{self, IsTerminal as _},
    thread,
};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::Experiment;
use tokio::sync::oneshot;

use crate::{
    error::{Code, Error},
    progress::Progress,
    text,
};

/// Options of commands that change several experiments for good.
#[derive(Debug, Args)]
pub struct Consent {
    /// Change several experiments without asking; needed where nobody can answer.
    #[arg(long, short)]
    yes: bool,
    /// Print the planned changes, and make none.
    #[arg(long, conflicts_with = "yes")]
    dry_run: bool,
}

/// The planned changes, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Planned<'a> {
    /// The command.
    would: &'a str,
    /// Numbers of the experiments that it would change.
    experiments: Vec<u64>,
}

/// The next action of the command.
#[derive(Debug, PartialEq, Eq)]
enum Next {
    /// It makes the changes.
    Do,
    /// It only lists the changes.
    List,
    /// It asks the user.
    Ask,
    /// It fails, because no user can answer.
    Refuse,
}

impl Consent {
    /// Whether to change these experiments. `what`: the command's name, a verb.
    pub async fn is_given(
        &self,
        what: &str,
        experiments: &[Experiment],
        progress: &mut Progress,
    ) -> Result<bool, Error> {
        let n = text::counted(experiments.len() as u64, "experiment");
        let has_people = io::stdin().is_terminal() && io::stderr().is_terminal();
        match self.next(experiments.len(), has_people) {
            Next::Do => Ok(true),
            Next::List => {
                if progress.is_json() {
                    let experiments = experiments.iter().map(|experiment| experiment.id).collect();
                    progress.print_document(&Planned { would: what, experiments })?;
                    return Ok(false);
                }
                let lines = experiments
                    .iter()
                    .map(|experiment| format!("would {what} {}", text::state_line(experiment)));
                let lines: Vec<String> =
                    lines.chain([format!("nothing was done to {n}")]).collect();
                progress.print(&lines.join("\n"))?;
                Ok(false)
            }
            Next::Refuse => Err(Error::at(
                Code::NeedsConsent,
                "--yes",
                format!(
                    "`{what}` would change {n}, and cannot be undone: confirm it with --yes, or \
                     list them with --dry-run"
                ),
            )),
            Next::Ask => {
                progress.remark(&format!("{what} {n}? This cannot be undone. Type yes to go on:"));
                match answer().await.trim() {
                    "y" | "yes" => Ok(true),
                    _ => Err(Error::Input("nothing was done".into())),
                }
            }
        }
    }

    fn next(&self, n_experiments: usize, has_people: bool) -> Next {
        match self {
            Self { dry_run: true, .. } => Next::List,
            Self { yes: true, .. } => Next::Do,
            _ if n_experiments < 2 => Next::Do,
            _ if has_people => Next::Ask,
            _ => Next::Refuse,
        }
    }
}

/// A line of standard input, read on a thread that an interrupt can abandon.
async fn answer() -> String {
    let (sender, receiver) = oneshot::channel();
    thread::spawn(move || {
        let mut line = String::new();
        // An unreadable answer is no consent.
        let _ = io::stdin().read_line(&mut line);
        let _ = sender.send(line);
    });
    receiver.await.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_of_several_experiments_need_an_answer() {
        let plain = Consent { yes: false, dry_run: false };
        assert_eq!(plain.next(1, false), Next::Do);
        assert_eq!(plain.next(2, true), Next::Ask);
        assert_eq!(plain.next(2, false), Next::Refuse);
        let yes = Consent { yes: true, dry_run: false };
        assert_eq!(yes.next(10_000, false), Next::Do);
        let dry_run = Consent { yes: false, dry_run: true };
        assert_eq!(dry_run.next(1, true), Next::List);
        assert_eq!(dry_run.next(2, false), Next::List);
    }
}
