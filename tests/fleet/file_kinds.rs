//! Files of every kind, given to every command that takes a file. The command accepts the file,
//! or names its kind and the right command in one line.

use std::fs;

use crate::data_directory::DataDirectory;

/// Commands that take a file, `@`, and the kinds that they take.
const TAKERS: [(&str, &[&str]); 17] = [
    ("validate @", &["experiment.json"]),
    ("run @", &["experiment.json"]),
    ("submit @", &["experiment.json"]),
    ("bench @ --seconds 1", &["experiment.json"]),
    ("simulate @ --trials 1", &["experiment.json"]),
    ("simulate experiment.json --trials 1 --genotype @", &["champion.json", "genes.json"]),
    ("evaluate --config @ --genotype champion.json --trials 1 --to out", &["experiment.json"]),
    (
        "evaluate --config experiment.json --genotype @ --trials 1 --to out",
        &["champion.json", "genes.json"],
    ),
    ("replay --config @ --genotype champion.json --to out.html", &["experiment.json"]),
    (
        "replay --config experiment.json --genotype @ --to out.html",
        &["champion.json", "genes.json"],
    ),
    ("plot @ --to out.svg", &["history.csv", "history-7.csv"]),
    ("plot --steps @ --metric leaders --to out.svg", &["evaluation"]),
    ("compare @", &["history-7.csv", "champion.json"]),
    ("verify @", &["bundle.zip"]),
    ("import @", &["bundle.zip"]),
    ("list --data-dir @", &["swarm-data"]),
    ("doctor --data-dir @", &["swarm-data"]),
];

/// A file, and its kind in the error.
const FILES: [(&str, &str); 16] = [
    ("experiment.json", "an experiment file"),
    ("champion.json", "a champion file"),
    ("generation.json", "a generation of individuals"),
    ("genes.json", "a list of genes"),
    ("history.csv", "the history of a run"),
    ("history-7.csv", "the history of a run"),
    ("list.csv", "a list of experiments"),
    ("trace.csv", "the trace of a simulation"),
    ("evaluation/steps.csv", "a file of an evaluation"),
    ("evaluation/summary.json", "a file of an evaluation"),
    ("evaluation", "the directory of an evaluation"),
    ("bundle.zip", "a bundle"),
    ("swarm-data/swarmevo.sqlite3", "the database of a data directory"),
    ("swarm-data", "a data directory"),
    ("settings.json", "a settings file"),
    ("replay.html", "a page for a browser"),
];

/// A directory with a file of each kind.
fn directory() -> DataDirectory {
    let directory = DataDirectory::new();
    let path = |name: &str| directory.path().join(name);
    let print = |line: &str, name: &str| {
        fs::write(path(name), directory.swarmctl(line).expect_success().stdout).unwrap();
    };
    print("individual 1", "champion.json");
    print("individual 1@0", "generation.json");
    print("list --output csv", "list.csv");
    for line in [
        "simulate 1@0/3 --trace trace.csv",
        "evaluate 1 --trials 2 --to evaluation",
        "export 1 --to bundle.zip",
        "replay 1 --to replay.html",
    ] {
        directory.swarmctl(line).expect_success();
    }
    fs::copy(path("history.csv"), path("history-7.csv")).unwrap();
    fs::write(path("settings.json"), r#"{"coordinator": "http://127.0.0.1:1"}"#).unwrap();
    let champion = fs::read_to_string(path("champion.json")).unwrap();
    let champion: serde_json::Value = serde_json::from_str(&champion).unwrap();
    fs::write(path("genes.json"), champion["genotype"].to_string()).unwrap();
    directory
}

#[test]
fn a_file_of_another_kind_is_refused_in_one_line_with_its_kind() {
    let directory = directory();
    let mut problems = Vec::new();
    for (command, taken) in TAKERS {
        for (file, kind) in FILES {
            // The name of a history must contain the seed, and a ranking needs two evaluations.
            if command == "compare @" && ["history.csv", "evaluation"].contains(&file) {
                continue;
            }
            let line = command.replace('@', file);
            let forced = if line.contains("--to") { " --force" } else { "" };
            let outcome = directory.swarmctl(&format!("{line}{forced}"));
            let is_taken = taken.contains(&file);
            let said = outcome.stderr.lines().next().unwrap_or_default();
            // A word without a suffix may be the name of an experiment.
            let is_word =
                outcome.code == Some(3) && said.contains(&format!("`{file}` is {kind}; "));
            let is_refused = outcome.code == Some(2)
                && said.contains(&format!("{file}: it is {kind}, and "))
                && said.contains(" is expected here; ");
            let is_short =
                outcome.stderr.lines().count() <= 1 + usize::from(command == "validate @");
            if is_taken && outcome.code != Some(0)
                || !is_taken && !(is_short && (is_refused || is_word))
            {
                problems.push(format!("$ swarmctl {line}\n{outcome:#?}"));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn a_file_in_place_of_an_experiments_name_is_refused_with_its_kind() {
    let directory = directory();
    for command in ["history", "watch", "replay", "individual", "export", "fork", "delete"] {
        for (file, kind) in FILES.iter().filter(|(file, _)| file.contains('.')) {
            let outcome = directory.swarmctl(&format!("{command} {file}"));
            assert_eq!(outcome.code, Some(2), "{command} {file}: {outcome:#?}");
            let expected = format!("`{file}` is {kind}; ");
            assert!(outcome.stderr.contains(&expected), "{command}: {}", outcome.stderr);
        }
    }
}
