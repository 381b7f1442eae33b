//! Numbers and names of experiments, for a shell that completes them.

use std::{collections::BTreeMap, env, ffi::OsStr, thread, time::Duration};

use clap::Parser as _;
use clap_complete::{CompletionCandidate, PathCompleter, engine::ValueCompleter as _};
use swarm_proto::v1::Experiment;
use tokio::time::timeout;

use crate::{
    args::{Args, OutputFormat},
    connection::Connection,
    json::state_name,
    place::Intent,
    progress::Progress,
};

/// Nobody waits longer for a completion.
const PATIENCE: Duration = Duration::from_secs(1);

/// What a word may become that stands for an experiment or a group: what there is in the place of
/// the command line, the environment and the settings file; nothing if it does not answer.
pub fn experiments(word: &OsStr) -> Vec<CompletionCandidate> {
    // The shell asks from within this program's runtime, which nothing may block.
    let all = thread::spawn(fetch).join().ok().flatten().unwrap_or_default();
    let word = word.to_string_lossy();
    candidates(&all)
        .into_iter()
        .filter(|(value, _)| value.starts_with(&*word))
        .map(|(value, help)| CompletionCandidate::new(value).help(Some(help.into())))
        .collect()
}

/// The same, and files.
pub fn experiments_and_files(word: &OsStr) -> Vec<CompletionCandidate> {
    let mut all = experiments(word);
    all.extend(PathCompleter::file().complete(word));
    all
}

/// What the command line says so far of the place.
fn place() -> Vec<String> {
    let words: Vec<String> = env::args().collect();
    let mut found = vec!["swarmctl".to_owned(), "list".to_owned()];
    for (i, word) in words.iter().enumerate() {
        match word.split('=').next() {
            Some("--data-dir" | "--coordinator") if word.contains('=') => found.push(word.clone()),
            Some("--data-dir" | "--coordinator") => {
                found.extend(words.get(i..=i + 1).unwrap_or_default().iter().cloned());
            }
            _ => {}
        }
    }
    found
}

fn fetch() -> Option<Vec<Experiment>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().ok()?;
    let args = Args::try_parse_from(place()).ok()?;
    runtime.block_on(async {
        let silent = Progress::new(OutputFormat::Json).silent();
        let connection = Connection::open(args.settings, Intent::Read, &silent);
        let connection = timeout(PATIENCE, connection).await.ok()?.ok()?;
        let asking = connection.with_patience(Duration::ZERO);
        timeout(PATIENCE, asking.experiments()).await.ok()?.ok()
    })
}

/// Numbers, then names that stand for one experiment or a group, each with what it is.
fn candidates(all: &[Experiment]) -> Vec<(String, String)> {
    let mut candidates: Vec<(String, String)> = all
        .iter()
        .map(|it| (it.id.to_string(), format!("{}, {}", it.name, state_name(it.state()))))
        .collect();
    let mut names: BTreeMap<&str, (bool, usize)> = BTreeMap::new();
    for experiment in all {
        names.entry(&experiment.name).or_default().1 += 1;
    }
    for experiment in all.iter().filter(|it| !it.group.is_empty()) {
        names.entry(&experiment.group).or_default().0 = true;
    }
    for (name, (is_group, n)) in names {
        if is_group {
            candidates.push((name.to_owned(), "group".to_owned()));
        } else if n == 1 {
            candidates.push((name.to_owned(), "experiment".to_owned()));
        }
    }
    candidates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_names_and_groups_are_completed_and_names_of_several_are_not() {
        let run = |id, name: &str, group: &str| Experiment {
            id,
            name: name.into(),
            group: group.into(),
            ..Experiment::default()
        };
        let all = [run(1, "a", ""), run(2, "b", ""), run(3, "b", ""), run(4, "c", "c")];
        let values: Vec<String> = candidates(&all).into_iter().map(|(value, _)| value).collect();
        assert_eq!(values, ["1", "2", "3", "4", "a", "c"]);
    }
}
