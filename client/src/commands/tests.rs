//! The output that users see: the help and the answers of every command, with a scripted
//! coordinator, and the refusals of each option.

#[cfg(feature = "local")]
pub mod one_world;

use std::collections::BTreeSet;

use clap::{CommandFactory as _, Parser as _};
use swarm_proto::v1::{
    Event, Experiment, ExperimentState, ExplainExperimentResponse, GenerationSummary,
    GetChampionResponse, HeldItems, HeldOutFitness, JudgedFitness, Notice, Round, Worker,
    event::Kind,
};

use super::{
    answers::tests::{check, check_printed},
    *,
};
use crate::{
    clock,
    error::Answer,
    fake_coordinator::{FakeCoordinator, Script, state},
    help,
    progress::tests::Captured,
    synonyms::with_suggestions,
};

/// 2026-02-03, some time after noon.
const NOON_MS: u64 = 1_770_121_000_000;

fn summary(generation: u64) -> GenerationSummary {
    GenerationSummary {
        generation,
        best: 1.5 + generation as f64 / 8.0,
        mean: 1.0 / 3.0,
        min: 0.0,
        standard_deviation: 0.25,
        digest: format!("{generation:x}").repeat(64),
        duration_ms: 1250,
        episodes: 800,
        workers: 2,
        idle_share: 0.0625,
    }
}

fn event(sequence: u64, kind: Kind) -> Event {
    Event { sequence, at_ms: NOON_MS + 1250 * sequence, kind: Some(kind) }
}

/// A coordinator with one experiment, in its fourth generation.
fn script() -> Script {
    let notice = Notice { message: "champion: 1.500000 +- 0.250000".into() };
    let past = vec![
        Event { at_ms: NOON_MS, ..state(1, ExperimentState::Running) },
        event(2, Kind::GenerationCompleted(summary(0))),
        event(3, Kind::GenerationCompleted(summary(1))),
        event(4, Kind::Notice(notice)),
        event(5, Kind::GenerationCompleted(summary(2))),
    ];
    let now_ms = clock::unix_ms();
    let worker = |id, name: &str| Worker {
        id,
        name: name.into(),
        version: "0.1.0".into(),
        slots: 4,
        items_in_flight: 8,
        results_per_second: 12.5,
        idle_share: 0.02,
        connected_at_ms: now_ms - 7_500_000,
        last_heard_at_ms: now_ms - 1200,
        ..Worker::default()
    };
    let distrusted = "returned other bits than worker 1".to_owned();
    Script {
        experiment: Experiment {
            id: 3,
            name: "leader".into(),
            state: ExperimentState::Running.into(),
            generations_done: 3,
            generations: 40,
            seed: 7,
            algorithm: "SNES".into(),
            population_size: 100,
            genotype_len: 455,
            submitted_at_ms: clock::unix_ms() - 7_500_000,
            latest: Some(summary(2)),
            champion_fitness: Some(1.25),
            champion_selection_fitness: Some(1.5),
            config_digest: "c0".repeat(32),
            digest: "2".repeat(64),
            priority: 100,
            last_sequence: 5,
            simulation: "sim-core 0.0.0 format 0".into(),
            recent_generation_ms: Some(1250.0),
            ..Experiment::default()
        },
        champion: Some(GetChampionResponse {
            experiment_id: 3,
            generation: 1,
            individual: Some(42),
            fitness: Some(1.625),
            trial_fitness: vec![1.5, 1.75],
            genotype: vec![0.25, 0.5],
            network_json: r#"{"neurons":[]}"#.into(),
            held_out: Some(HeldOutFitness { mean: 1.5, ci95: 0.25, trials: 50, generation: 2 }),
            judged: Some(JudgedFitness {
                mean: 1.25,
                low: 1.0,
                high: 1.375,
                trials: 200,
                generation: 2,
            }),
        }),
        explanation: ExplainExperimentResponse {
            round: Some(Round {
                generation: 3,
                episodes: 800,
                episodes_left: 24,
                held: vec![HeldItems {
                    worker_id: 2,
                    worker_name: "lab-2".into(),
                    items: 3,
                    held_ms: 90_000,
                    silent_ms: 1200,
                }],
                running_ms: 95_000,
                ..Round::default()
            }),
            workers: 2,
            workers_available: 1,
            notices: vec![past[3].clone()],
            ..ExplainExperimentResponse::default()
        },
        workers: vec![
            worker(1, "lab-1"),
            Worker { distrusted, items_in_flight: 0, ..worker(2, "lab-2") },
        ],
        past,
        watches: [(vec![event(2, Kind::GenerationCompleted(summary(0)))], None)].into(),
        ..Script::default()
    }
}

/// The output and the exit code of commands, one after the other.
async fn transcript(script: Script, lines: &[&str]) -> String {
    transcript_on(None, script, lines).await
}

/// Like [`transcript`], on a terminal of some width.
async fn transcript_on(width: Option<usize>, script: Script, lines: &[&str]) -> String {
    let submitted_at_ms = script.experiment.submitted_at_ms;
    let (_fake, connection) = FakeCoordinator::serve(script).await;
    let mut sections = Vec::new();
    for line in lines {
        let at = ["swarmctl", "--coordinator", connection.address()];
        let captured = Captured::default();
        let result = match Args::try_parse_from(at.into_iter().chain(line.split(' '))) {
            Ok(args) => {
                let format = args.output;
                let progress = match width {
                    Some(width) => captured.progress_on(format, width),
                    None => captured.progress(format),
                };
                let result = execute(args, progress).await;
                check_printed(line, format, &captured.lines().join("\n"));
                result.map_err(|error| {
                    check(&Answer::from(&error));
                    (error.exit_code(), error.report())
                })
            }
            Err(error) => {
                let text = with_suggestions(error).to_string();
                Err((2, text.trim_end().to_owned()))
            }
        };
        let mut section = vec![format!("$ swarmctl {line}")];
        section.extend(captured.lines());
        if let Err((code, report)) = result {
            section.push(report);
            section.push(format!("[exit code {code}]"));
        }
        let section = section.join("\n").replace(connection.address(), "http://HOST:PORT");
        // The experiment has the same age in every transcript, so its time of submission differs.
        let section = section.replace(&submitted_at_ms.to_string(), "SUBMITTED_MS");
        let section = section.replace(&clock::utc(submitted_at_ms), "SUBMITTED-AT-IN--UTC");
        sections.push(section);
    }
    sections.join("\n\n")
}

fn page(command: &clap::Command) -> String {
    // Options of all commands appear on the first page only.
    let mut command = command.clone().mut_args(|arg| {
        let is_common = arg.is_global_set();
        arg.hide(is_common)
    });
    command.render_long_help().to_string()
}

#[test]
fn the_manual() {
    let mut swarmctl = Args::command().term_width(80);
    swarmctl.build();
    let shown = swarmctl.get_subcommands().filter(|command| !command.is_hide_set());
    let names: Vec<String> = shown.map(|command| command.get_name().to_owned()).collect();
    let first = ["swarmctl --help-all", "swarmctl list -h", "swarmctl doctor -h"];
    let mut pages: Vec<String> = first.map(|line| help::tests::printed(line, 80)).into();
    for name in names.iter().filter(|name| *name != "help") {
        let command = swarmctl.find_subcommand(name).unwrap();
        pages.push(page(command));
        let nested = command.get_subcommands().filter(|command| command.get_name() != "help");
        pages.extend(nested.map(page));
    }
    let rule = format!("\n\n{}\n\n", "=".repeat(80));
    let pages: Vec<&str> = pages.iter().map(|page| page.trim_end()).collect();
    insta::assert_snapshot!(pages.join(&rule));
}

#[tokio::test]
async fn answers_for_people() {
    let commands = [
        "list",
        "list --output wide",
        "history 3",
        "history 3 --output wide",
        "logs 3",
        "logs --from 4 3",
        "workers",
        "workers --output wide",
        "explain 3",
        "pause 3 --reason maintenance",
        "explain 3",
        "resume 3",
        "priority 3 200",
        "prune 3",
        "cancel 3",
        "prune 3",
        "history 3 --dynamics",
        "lineage 3@2/5",
        "lineage leader@2/5 --dot",
        "repertoire 3",
        "repertoire leader@1",
        "repertoire 3 --output json",
        "repertoire 3@1 --output csv",
        "front 3",
        "front leader@1",
        "front 3 --reference -1,2 --output json",
        "front 3@1 --output csv",
        "repertoire 3@1/2",
        "front 3@1/2",
        "wait 3 --for ended",
        "wait 3",
        "explain 3",
    ];
    insta::assert_snapshot!(transcript(script(), &commands).await);
}

#[tokio::test]
async fn answers_for_programs() {
    let commands = [
        "list --output json",
        "list --output csv",
        "history 3 --output json",
        "history 3 --output csv",
        "history 3 --dynamics --output csv",
        "logs --output json",
        "explain 3 --output json",
        "champion 3",
        "cancel 3 --output json",
        "wait 3 --output json",
    ];
    insta::assert_snapshot!(transcript(script(), &commands).await);
}

#[tokio::test]
async fn refusals() {
    let commands = [
        "lst",
        "history 9",
        "explain three",
        "champion 3 --output csv",
        "priority 3 0",
        "wait 3 --timeout 0s",
        "wait 3 --timeout 5",
        "logs --from 3",
        "submit missing.json",
    ];
    insta::assert_snapshot!(transcript(script(), &commands).await);
}

#[tokio::test]
async fn the_life_of_an_experiment() {
    let commands = [
        "label 3 user=ada purpose=thesis",
        "list --label user=ada --state running",
        "list --label user=grace",
        "label leader --remove purpose",
        "delete leader",
        "archive 3",
        "list",
        "list --all --sort best",
        "archive 3 --restore",
        "extend 3 --generations 60",
        "retry 3",
        "label 3",
        "label 3 ada",
        "extend 3",
    ];
    insta::assert_snapshot!(transcript(script(), &commands).await);
}

#[tokio::test]
async fn answers_fit_the_terminal() {
    let commands = ["list", "history 3", "logs 3", "workers", "explain 3", "explain", "wait 3"];
    let mut experiment = script().experiment;
    experiment.name = "leader_selection_by_radio_alone".into();
    experiment.group = "thesis".into();
    experiment.labels = [("user".to_owned(), "ada".to_owned())].into();
    for width in [40, 80, 200] {
        let script = Script {
            experiment: experiment.clone(),
            watches: [(vec![state(6, ExperimentState::Completed)], None)].into(),
            ..script()
        };
        let text = transcript_on(Some(width), script, &commands).await;
        for line in text.lines() {
            let is_whole = line.trim_start().starts_with("-> ");
            assert!(is_whole || console::measure_text_width(line) <= width, "{width}: {line}");
        }
        insta::assert_snapshot!(format!("answers_at_{width}_columns"), text);
    }
}

#[tokio::test]
async fn one_huge_number_makes_no_table_wide() {
    let commands = ["list", "history 3", "logs 3", "list --output wide", "history 3 --output wide"];
    let huge = GenerationSummary { best: 9e98, mean: -9e98, min: f64::MIN, ..summary(2) };
    let script = |past: Vec<Event>| {
        let mut script = Script { past, ..script() };
        script.experiment.champion_fitness = Some(-9e98);
        script.experiment.champion_selection_fitness = Some(f64::MAX);
        script.experiment.latest = Some(huge.clone());
        script
    };
    for width in [40, 80, 200] {
        let past = vec![event(1, Kind::GenerationCompleted(huge.clone()))];
        let text = transcript_on(Some(width), script(past), &commands).await;
        let (narrow, wide) = text.split_once("$ swarmctl list --output wide").unwrap();
        let widest = |text: &str| text.lines().map(console::measure_text_width).max().unwrap();
        assert!(widest(narrow) <= width, "{width}: {narrow}");
        assert!(widest(wide) <= 250, "{wide}");
        insta::assert_snapshot!(format!("huge_numbers_at_{width}_columns"), text);
    }
}

/// Old commands, and their replacements.
const OLD_WORDS: &[(&str, &str)] = &[
    ("wait 3", "watch 3 --quiet"),
    ("wait leader --output json", "watch leader --quiet --output json"),
    ("wait 3 --for ended", "watch 3 --quiet --for ended"),
    ("wait 3 --timeout 0s", "watch 3 --quiet --timeout 0s"),
    ("wait 9", "watch 9 --quiet"),
    ("logs", "watch --events --so-far"),
    ("logs 3", "watch 3 --events --so-far"),
    ("logs --from 4 3 --output json", "watch --events --so-far --from 4 3 --output json"),
    ("logs 9 --follow", "watch 9 --events"),
    ("extend 3 --generations 60", "resume 3 --generations 60"),
    (
        "extend leader --generations 60 --output json",
        "resume leader --generations 60 --output json",
    ),
    ("retry 3", "resume 3"),
    ("retry 9", "resume 9"),
];

#[tokio::test]
async fn old_commands_equal_their_replacements_and_no_help_lists_them() {
    let cancelled = || {
        let mut script = script();
        script.experiment.set_state(ExperimentState::Cancelled);
        script
    };
    for (old, new) in OLD_WORDS {
        for script in [script, cancelled] {
            let [of_old, of_new] = [old, new].map(async |line| {
                let text = transcript(script(), &[line]).await;
                text.replacen(&format!("$ swarmctl {line}"), "", 1)
            });
            assert_eq!(of_old.await, of_new.await, "{old}");
        }
    }
    let definition = Args::command();
    let words: BTreeSet<&str> =
        OLD_WORDS.iter().filter_map(|(old, _)| old.split(' ').next()).collect();
    for word in words {
        assert!(definition.find_subcommand(word).unwrap().is_hide_set(), "{word}");
    }
}

#[tokio::test]
async fn a_name_stands_for_the_number() {
    for command in ["champion X", "individual X@1/7", "logs X", "explain X", "get X"] {
        let [by_number, by_name] = ["3", "leader"].map(|name| command.replace('X', name));
        let numbered = transcript(script(), &[&by_number]).await.replace(&by_number, "");
        let named = transcript(script(), &[&by_name]).await.replace(&by_name, "");
        assert_eq!(numbered, named, "{command}");
        assert!(!named.contains("exit code"), "{named}");
    }
}

#[tokio::test]
async fn empty_tables_are_printed_as_sentences() {
    let script = Script { workers: vec![], past: vec![], ..script() };
    insta::assert_snapshot!(
        transcript(script, &["history 3", "workers", "logs", "logs 3 --from 99"]).await
    );
}

#[tokio::test]
async fn completions_are_for_every_shell() {
    for shell in ["bash", "zsh", "fish"] {
        let script = transcript(Script::default(), &[&format!("completions {shell}")]).await;
        assert!(script.contains("history") && script.contains("follow"), "{shell}");
    }
}
