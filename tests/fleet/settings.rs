//! Unreadable settings only affect commands that need them.

use std::{fs, process::Command};

use harness::{CoordinatorProcess, Experiment, Outcome, binary};

use crate::data_directory::DataDirectory;

/// Commands that need no coordinator, or that get a data directory.
const NEED_NONE: [&str; 16] = [
    "--help",
    "schema",
    "completions bash",
    "validate experiment.json",
    "run experiment.json",
    "plot history.csv --to plot.svg --force",
    "compare champion.json",
    "simulate experiment.json --genotype champion.json",
    "replay --config experiment.json --genotype champion.json --to replay.html --force",
    "evaluate --config experiment.json --genotype champion.json --local --trials 1 --to out --force",
    "verify bundle.zip",
    "doctor",
    "backup copy --force",
    "man pages --force",
    "new mine --force",
    "history 1 --data-dir swarm-data",
];

#[test]
fn settings_that_cannot_be_read_stop_only_commands_that_need_a_coordinator() {
    let directory = DataDirectory::new();
    let champion = directory.swarmctl("champion 1").expect_success().stdout;
    fs::write(directory.path().join("champion.json"), champion).unwrap();
    directory.swarmctl("export 1 --to bundle.zip").expect_success();
    fs::write(directory.path().join("broken.json"), "{").unwrap();
    for settings in ["broken.json", "missing.json", "swarm-data"] {
        let environment = [("SWARM_CONFIG", settings)];
        for line in NEED_NONE {
            let outcome = directory.swarmctl_with(&environment, line);
            assert_eq!(outcome.code, Some(0), "{line}, {settings}: {outcome:#?}");
        }
        for line in ["list", "history 1", "watch 1", "simulate 1@0/3"] {
            let outcome = directory.swarmctl_with(&environment, line);
            assert_eq!(outcome.code, Some(2), "{line}: {outcome:#?}");
            assert_eq!(outcome.stderr.lines().count(), 1, "{line}: {}", outcome.stderr);
            for part in [settings, "correct it", "--data-dir"] {
                assert!(outcome.stderr.contains(part), "{line}: {}", outcome.stderr);
            }
        }
    }
}

#[test]
fn next_steps_repeat_the_options_that_the_environment_does_not_give() {
    let coordinator = CoordinatorProcess::start();
    coordinator.submit(&Experiment::tiny(1).path());
    let url = coordinator.url();
    let next_of = |environment: &[(&str, &str)], options: &[&str]| {
        let mut command = Command::new(binary("swarmctl"));
        command.env_remove("SWARM_COORDINATOR").env("SWARM_CONFIG", "");
        command.envs(environment.iter().copied()).args(["delete", "1", "--yes"]).args(options);
        let outcome = Outcome::of_command(&mut command);
        let next = outcome.stderr.trim_end().split_once("end it first: ");
        next.unwrap_or_else(|| panic!("{outcome:#?}")).1.to_owned()
    };
    let at = format!("--coordinator {url}");
    for (environment, options, expected) in [
        (vec![], vec!["--coordinator", &*url], format!("swarmctl cancel 1 {at}")),
        (vec![("SWARM_COORDINATOR", &*url)], vec![], "swarmctl cancel 1".to_owned()),
        (
            vec![("SWARM_COORDINATOR", &*url), ("SWARM_PLAINTEXT", "0")],
            vec!["--plaintext"],
            "swarmctl cancel 1 --plaintext".to_owned(),
        ),
        (
            vec![("SWARM_COORDINATOR", "http://127.0.0.1:1"), ("SWARM_PLAINTEXT", "1")],
            vec!["--coordinator", &*url, "--plaintext"],
            format!("swarmctl cancel 1 {at}"),
        ),
    ] {
        assert_eq!(next_of(&environment, &options), expected, "{environment:?} {options:?}");
    }
}
