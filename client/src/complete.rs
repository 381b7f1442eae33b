//! Values that a shell completes: experiments, groups, labels and workers in quarantine.

use std::{
    collections::{BTreeMap, BTreeSet},
    env,
    ffi::OsStr,
    thread,
    time::Duration,
};

use clap::Parser;
use clap_complete::{CompletionCandidate, PathCompleter, engine::ValueCompleter as _};
use model::wire::state_name;
use swarm_proto::v1::{Experiment, ListWorkersRequest};
use tokio::time::timeout;

use crate::{
    connection::Connection, output_format::OutputFormat, place::Intent, progress::Progress,
    settings::Settings,
};

/// Time limit of a completion.
const PATIENCE: Duration = Duration::from_secs(1);

/// Completions of an experiment or group: those in the place that the command line, the
/// environment or the settings file names; empty if the place does not answer.
pub fn experiments(word: &OsStr) -> Vec<CompletionCandidate> {
    offered(word, candidates(&all_experiments()))
}

/// Completions of a group.
pub fn groups(word: &OsStr) -> Vec<CompletionCandidate> {
    let all = all_experiments();
    let groups = all
        .iter()
        .filter(|experiment| !experiment.group.is_empty())
        .map(|experiment| experiment.group.clone());
    offered(word, described(groups.collect(), "group"))
}

/// Completions of a label.
pub fn labels(word: &OsStr) -> Vec<CompletionCandidate> {
    let all = all_experiments();
    let labels = all
        .iter()
        .flat_map(|experiment| &experiment.labels)
        .map(|(key, value)| format!("{key}={value}"));
    offered(word, described(labels.collect(), "label"))
}

/// Completions of the key of a label.
pub fn label_keys(word: &OsStr) -> Vec<CompletionCandidate> {
    let all = all_experiments();
    let keys = all.iter().flat_map(|experiment| experiment.labels.keys().cloned());
    offered(word, described(keys.collect(), "label"))
}

/// Completions of a worker in quarantine.
pub fn quarantined(word: &OsStr) -> Vec<CompletionCandidate> {
    let workers = fetched(async |connection| {
        let request = ListWorkersRequest {};
        Some(
            connection
                .call_fleet(async |client| client.list_workers(request).await)
                .await
                .ok()?
                .workers,
        )
    });
    let workers = workers.unwrap_or_default().into_iter();
    let distrusted = workers.filter(|worker| !worker.distrusted.is_empty());
    offered(word, distrusted.map(|worker| (worker.name, worker.distrusted)).collect())
}

/// Completions of an experiment, a group or a file.
pub fn experiments_and_files(word: &OsStr) -> Vec<CompletionCandidate> {
    let mut all = experiments(word);
    all.extend(PathCompleter::file().complete(word));
    all
}

/// The options of a command line that locate experiments.
#[derive(Debug, Parser)]
struct PlaceArgs {
    #[command(flatten)]
    settings: Settings,
}

/// The place that the unfinished command line names.
fn place() -> Vec<String> {
    let words: Vec<String> = env::args().collect();
    let mut found = vec!["swarmctl".to_owned()];
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

fn all_experiments() -> Vec<Experiment> {
    fetched(async |connection| connection.experiments().await.ok()).unwrap_or_default()
}

/// The answer of the place, if it comes in time. Completion runs within this program's runtime,
/// which must not block.
fn fetched<T: Send + 'static>(
    ask: impl AsyncFnOnce(Connection) -> Option<T> + Send + 'static,
) -> Option<T> {
    let fetch = || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().ok()?;
        let args = PlaceArgs::try_parse_from(place()).ok()?;
        runtime.block_on(async {
            let silent = Progress::new(OutputFormat::Json).silent();
            let connection = Connection::open(args.settings, Intent::Read, &silent);
            let connection = timeout(PATIENCE, connection).await.ok()?.ok()?;
            timeout(PATIENCE, ask(connection.with_patience(Duration::ZERO))).await.ok()?
        })
    };
    thread::spawn(fetch).join().ok().flatten()
}

/// Gives all candidates the same help.
fn described(values: BTreeSet<String>, help: &str) -> Vec<(String, String)> {
    values.into_iter().map(|value| (value, help.to_owned())).collect()
}

/// The candidates that begin with a word.
fn offered(word: &OsStr, candidates: Vec<(String, String)>) -> Vec<CompletionCandidate> {
    let word = word.to_string_lossy();
    candidates
        .into_iter()
        .filter(|(value, _)| value.starts_with(&*word))
        .map(|(value, help)| CompletionCandidate::new(value).help(Some(help.into())))
        .collect()
}

/// Numbers, then names of one experiment or of a group, each with a description.
fn candidates(all: &[Experiment]) -> Vec<(String, String)> {
    let mut candidates: Vec<(String, String)> = all
        .iter()
        .map(|experiment| {
            (
                experiment.id.to_string(),
                format!("{}, {}", experiment.name, state_name(experiment.state())),
            )
        })
        .collect();
    let mut names: BTreeMap<&str, (bool, usize)> = BTreeMap::new();
    for experiment in all {
        names.entry(&experiment.name).or_default().1 += 1;
    }
    for experiment in all.iter().filter(|experiment| !experiment.group.is_empty()) {
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
    use clap::{Arg, Command, CommandFactory as _, ValueHint};
    use clap_complete::ArgValueCompleter;

    use super::*;
    use crate::cli::Args;

    /// All arguments that take a value, each with the command that has it.
    fn arguments(command: &Command) -> Vec<(String, Arg)> {
        let of_command = command.get_arguments().filter(|arg| arg.get_action().takes_values());
        let name = command.get_name();
        let own = of_command.map(|arg| (format!("{name} {arg}"), arg.clone()));
        own.chain(command.get_subcommands().flat_map(arguments)).collect()
    }

    #[test]
    fn every_argument_that_names_something_stored_is_completed() {
        /// Values that are new, so nothing can complete them.
        const NEW: [&str; 3] = ["fork --name <NAME>", "new <NAME>", "slurm --job-name <NAME>"];
        /// Values from a file that the command line names.
        const OF_FILES: [&str; 2] = ["plot --metric <NAME>", "plot --condition <NAME>"];
        let mut definition = Args::command();
        definition.build();
        let (mut n_things, mut n_paths) = (0, 0);
        for (shown, arg) in arguments(&definition) {
            let names = arg.get_value_names().unwrap_or_default();
            let words: Vec<&str> = names.iter().flat_map(|name| name.split('|')).collect();
            let means = |known: &[&str]| words.iter().any(|word| known.contains(word));
            let is_new = NEW.contains(&&*shown) || OF_FILES.contains(&&*shown);
            let offers =
                arg.get::<ArgValueCompleter>().is_some() || !arg.get_possible_values().is_empty();
            let things = ["ID", "ID@G", "ID@G/I", "ADDRESS", "GROUP", "NAME"];
            let labels = ["KEY=VALUE", "KEY[=VALUE]", "KEY"];
            if (means(&things) || means(&labels)) && !is_new && !shown.contains("--tls-domain") {
                assert!(offers, "{shown}");
                n_things += 1;
            }
            if means(&["FILE", "DIR", "DIRECTORY", "CONFIG", "PROGRAM"]) {
                assert!(offers || arg.get_value_hint() != ValueHint::Unknown, "{shown}");
                n_paths += 1;
            }
        }
        assert!(n_things > 30 && n_paths > 60, "{n_things} {n_paths}");
    }

    #[test]
    fn numbers_groups_and_unambiguous_names_are_completed() {
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
