//! Whether people want what cannot be undone: `--yes`, `--dry-run`, or a question.

use std::{
    io::{self, IsTerminal as _},
    thread,
};

use clap::Args;
use serde_json::json;
use swarm_proto::v1::Experiment;
use tokio::sync::oneshot;

use crate::{error::Error, json, progress::Progress, text};

/// Before something is done to several experiments that cannot be undone.
#[derive(Debug, Args)]
pub struct Consent {
    /// Ask no question before several experiments are changed; needed where nobody can answer.
    #[arg(long, short)]
    yes: bool,
    /// Say what would be done, and do nothing.
    #[arg(long, conflicts_with = "yes")]
    dry_run: bool,
}

/// What is to happen.
#[derive(Debug, PartialEq, Eq)]
enum Next {
    /// It is done.
    Do,
    /// It is only listed.
    List,
    /// People are asked.
    Ask,
    /// Nobody can be asked.
    Refuse,
}

impl Consent {
    /// Whether it is to be done to these experiments. `what`: the command's name, a verb.
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
                let lines = experiments
                    .iter()
                    .map(|experiment| format!("would {what} {}", text::state_line(experiment)));
                let lines: Vec<String> =
                    lines.chain([format!("nothing was done to {n}")]).collect();
                progress.print(&if progress.is_json() {
                    json::document(&json!({ "would": what, "experiments": ids(experiments) }))
                } else {
                    lines.join("\n")
                })?;
                Ok(false)
            }
            Next::Refuse => Err(Error::Input(format!(
                "`{what}` would change {n}, and cannot be undone: confirm it with --yes, or see \
                 which with --dry-run"
            ))),
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

fn ids(experiments: &[Experiment]) -> Vec<u64> {
    experiments.iter().map(|experiment| experiment.id).collect()
}

/// A line of standard input, from a thread that an interrupt need not wait for.
async fn answer() -> String {
    let (sender, receiver) = oneshot::channel();
    thread::spawn(move || {
        let mut line = String::new();
        // What cannot be read is no consent.
        let _ = io::stdin().read_line(&mut line);
        let _ = sender.send(line);
    });
    receiver.await.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_experiments_are_asked_about_and_refused_where_nobody_can_answer() {
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
