//! Every command prints the same on a data directory as on a coordinator with the same
//! database.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use clap::{CommandFactory as _, Parser as _};
use coordinator::{Coordinator, CoordinatorConfig};
use tokio::{task::JoinSet, time::timeout};
use tokio_util::sync::CancellationToken;
use worker::WorkerConfig;

use crate::{
    cli::Args,
    commands::{
        answers::tests::{check, check_printed},
        execute,
    },
    error::Answer,
    experiment_file::tests::quickstart,
    progress::tests::Captured,
};

/// A time limit that no command here reaches, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// Commands that only read experiments, or change stored ones. TO stands for a file, whose
/// content must be equal, too.
const ASKED: &[&str] = &[
    "list",
    "list --output json",
    "watch 1",
    "watch 1 --output json",
    "wait two",
    "wait 1 --output json",
    "wait 9",
    "watch two --quiet",
    "watch 1 --quiet --output json",
    "watch --events --so-far",
    "watch 1 --events --output json",
    "watch 9 --events",
    "logs",
    "logs 1 --output json",
    "history 1",
    "history two --output csv",
    "history 1 --dynamics",
    "history 9",
    "list --all --sort best",
    "list --state running,paused --output json",
    "list nowhere",
    "watch 9",
    "logs 9",
    "logs 1 --from 3",
    "explain 9",
    "individual 1@1/mean",
    "individual 1@1/mean --output json",
    "individual 1@0/99",
    "individual 3",
    "lineage two@2/3 --depth 1 --dot",
    "lineage 2@2/3 --output json",
    "repertoire 1",
    "front 1",
    "simulate 1 --trials 2 --steps 9",
    "simulate 3",
    "simulate 9@1/3",
    "export-controller 9 --to TO.c",
    "export-controller 1@1/3 --to TO.c",
    "replay 9 --to TO.html",
    "replay 3 --to TO.html",
    "replay 1@1/3 --to TO.png --at 3",
    "replay 1 --to TO.html --judged 3 --force",
    "replay 1 --to TO.html --trial 1 --set world.objects.robot.num_instances=7 --force",
    "export 3 --to TO.zip",
    "plot 9 --to TO.svg",
    "plot two --to TO.svg --force",
    "compare 1 two --target 0.01",
    "compare 9",
    "compare 1 two --output json",
    "fork 9@1",
    "fork 1@7",
    "fork 1@1 --set algorithm.generatoins=3",
    "evaluate 9 --to TO.d",
    "submit nowhere.json",
    "explain 1",
    "explain 1 --output json",
    "get 1",
    "get none",
    "individual 1@1/3",
    "individual 1@1 --output json",
    "individual two",
    "individual 1@7/3",
    "lineage 2@2/3",
    "lineage 1@1/1",
    "simulate 1@1/3",
    "simulate two@0/0 --trace TO.csv",
    "replay 1 --to TO.html",
    "export 1 --to TO.zip",
    "export 9 --to TO.zip",
    "plot 1 two --to TO.svg",
    "compare 1",
    "label 1 user=ada",
    "label two user=grace --output json",
    "label two --remove user",
    "label two user=grace --output json",
    "label 9 user=ada",
    "list --label user=ada --output csv",
    "pause 3 --reason lunch",
    "priority 3 300",
    "cancel 3",
    "cancel 1",
    "cancel 9",
    "archive 1",
    "archive 1 --restore",
    "resume 9",
    "resume 1",
    "prune 2 --dry-run",
    "prune 2",
    "prune 2",
    "delete 2 --dry-run",
    "delete 2",
    "delete 2",
    "get 2",
    "import exported.zip",
    "retry 1",
    "extend 1 --generations 2",
    "extend 9 --generations 2",
    "retry 9",
    "resume 1 --generations 2",
    "resume 9 --generations 2",
];

/// Commands that start experiments: the experiments are equal in the end.
const COMPUTED: &[(&str, &str)] = &[
    ("submit FILE --generations 2 --seed 5", " --watch"),
    ("submit FILE --generations 1 --seeds 0..1 --group seeds", " --watch"),
    ("fork 1@1 --seed 9", " --watch"),
    ("extend 1 --generations 4", "; wait 1"),
    ("resume 1 --generations 5", "; watch 1 --quiet"),
    ("resume 3", "; wait 3"),
    ("evaluate 1 --trials 2 --to TO.d", ""),
    ("verify exported.zip --generations 1", ""),
];

/// Commands that use no experiments of a place, or only those of one kind of place; they
/// have other tests.
const ALONE: &[&str] = &[
    "backup",
    "bench",
    "examples",
    "completions",
    "doctor",
    "fleet",
    "help",
    "man",
    "new",
    "referee",
    "run",
    "schema",
    "validate",
    "web",
    "workers",
];

/// The output of a command line, and its outcome.
pub async fn output(line: &str, place: &[&str]) -> String {
    let captured = Captured::default();
    let words = ["swarmctl"].into_iter().chain(line.split(' ')).chain(place.iter().copied());
    let args = Args::try_parse_from(words).unwrap_or_else(|error| panic!("{line}: {error}"));
    let format = args.output;
    let progress = captured.progress(format);
    let result = timeout(PATIENCE, execute(args, progress)).await;
    let result = result.unwrap_or_else(|_| panic!("{line} hangs: {:?}", captured.lines()));
    check_printed(line, format, &captured.lines().join("\n"));
    let end = match result {
        Ok(()) => String::new(),
        Err(error) => {
            check(&Answer::from(&error));
            format!("[exit code {}] {error}", error.exit_code())
        }
    };
    captured.lines().join("\n") + &end
}

/// A data directory with a run of SNES, one of a GA, and one that no program computes.
async fn data_dir(directory: &Path) -> PathBuf {
    let path = directory.join("data");
    let at = ["--data-dir", path.to_str().unwrap()];
    let file = quickstart().display().to_string();
    output(&format!("run {file} --generations 3"), &at).await;
    let ga = fs::read_to_string(&file).unwrap();
    let mut ga: serde_json::Value = serde_json::from_str(&ga).unwrap();
    ga["name"] = "two".into();
    ga["algorithm"]["name"] = "GA".into();
    let ga_file = directory.join("two.json");
    fs::write(&ga_file, ga.to_string()).unwrap();
    output(&format!("run {} --generations 3", ga_file.display()), &at).await;
    // The directory stores the submission, but no program computes it.
    let place = crate::place::Place::Directory { path: path.clone(), is_found: false };
    let connection =
        crate::connection::Connection::to(place, crate::place::Intent::Submit).await.unwrap();
    let overrides = crate::experiment_file::Overrides {
        seed: Some(77),
        generations: Some(2),
        ..Default::default()
    };
    let file = crate::experiment_file::ExperimentFile::read(&quickstart()).unwrap();
    connection.submit(file.request(&overrides, "three".into())).await.unwrap();
    connection.close().await;
    path
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// A coordinator on a directory, and after some time a worker.
struct Fleet {
    coordinator: Coordinator,
    workers: JoinSet<Result<(), worker::WorkerError>>,
    shutdown: CancellationToken,
}

impl Fleet {
    async fn start(data_dir: &Path) -> Self {
        let listen = "127.0.0.1:0".parse().unwrap();
        let config = CoordinatorConfig::new(listen, data_dir.into());
        let coordinator = Coordinator::start(config).await.unwrap();
        Self { coordinator, workers: JoinSet::new(), shutdown: CancellationToken::new() }
    }

    fn address(&self) -> String {
        format!("http://{}", self.coordinator.local_addr())
    }

    fn add_worker(&mut self) {
        let config = WorkerConfig::new(self.address(), "one", 1);
        self.workers.spawn(worker::run(config, self.shutdown.clone()));
    }

    async fn stop(mut self) {
        self.shutdown.cancel();
        while self.workers.join_next().await.is_some() {}
        self.coordinator.shutdown().await;
    }
}

/// Runs the line in a place, and returns its output and the files that it wrote. `name`: the
/// file of this place for TO.
async fn output_at(line: &str, place: &[&str], directory: &Path, name: &str) -> (String, Vec<u8>) {
    let to = directory.join(name);
    let file = quickstart().display().to_string();
    let exported = directory.join("exported.zip").display().to_string();
    let concrete = line.replace("TO", to.to_str().unwrap());
    let concrete = concrete.replace("FILE", &file).replace("exported.zip", &exported);
    let text = output(&concrete, place).await.replace(to.to_str().unwrap(), "TO");
    // Advice names the directory unless commands find it by themselves.
    let text = text.replace(&format!(" {}", place.join(" ")), "");
    let text = if line.starts_with("list") { without_ages(&text) } else { text };
    let mut written = Vec::new();
    for ending in ["csv", "html", "png", "zip", "svg"] {
        written.extend(fs::read(to.with_extension(ending)).unwrap_or_default());
    }
    written.extend(fs::read(to.with_extension("d").join("trials.csv")).unwrap_or_default());
    (text, written)
}

/// A list without ages, which may differ between two requests.
fn without_ages(list: &str) -> String {
    let words: Vec<&str> = list.split_whitespace().collect();
    let is_unit = |word: Option<&&str>| matches!(word, Some(&("ms" | "s" | "min")));
    let is_kept = |&(i, word): &(usize, &&str)| {
        !(is_unit(Some(word)) || is_unit(words.get(i + 1)) && word.parse::<u64>().is_ok())
    };
    let kept = words.iter().enumerate().filter(is_kept).map(|(_, word)| *word);
    kept.collect::<Vec<_>>().join(" ")
}

/// The text without parts that differ between computations.
fn without_times(text: &str) -> String {
    let mut value: serde_json::Value = serde_json::from_str(text).unwrap();
    for experiment in value.as_array_mut().unwrap() {
        let object = experiment.as_object_mut().unwrap();
        object.retain(|key, _| !key.ends_with("_ms") && key != "latest" && key != "last_sequence");
    }
    value.to_string()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_command_gives_the_same_in_a_directory_as_on_a_coordinator() {
    let temporary = tempfile::tempdir().unwrap();
    let directory = temporary.path();
    let here = data_dir(directory).await;
    let there = directory.join("there");
    copy(&here, &there);
    let here = here.to_str().unwrap();
    output(&format!("export 1 --to {}/exported.zip", directory.display()), &["--data-dir", here])
        .await;
    let mut fleet = Fleet::start(&there).await;
    let address = fleet.address();
    let (at_directory, at_coordinator) = (["--data-dir", here], ["--coordinator", &address]);
    for line in ASKED {
        let asked = output_at(line, &at_coordinator, directory, "there-TO").await;
        let read = output_at(line, &at_directory, directory, "here-TO").await;
        assert!(!read.0.is_empty(), "{line}");
        assert_eq!(read, asked, "{line}");
    }
    fleet.add_worker();
    for (line, follow) in COMPUTED {
        let (first, then) = follow.split_once("; ").unwrap_or((follow, ""));
        output_at(&format!("{line}{first}"), &at_coordinator, directory, "there-2").await;
        if !then.is_empty() {
            output(then, &at_coordinator).await;
        }
        let computed = output_at(line, &at_directory, directory, "here-2").await.0;
        assert!(!computed.contains("exit code"), "{line}: {computed}");
        let [asked, read] = [&at_coordinator, &at_directory]
            .map(async |at| without_times(&output("list --all --output json", at).await));
        assert_eq!(read.await, asked.await, "{line}");
    }
    fleet.stop().await;
}

/// Commands that are refused, and what their errors for programs are about.
const REFUSED: &[(&str, &str)] = &[
    ("watch 9", "9"),
    ("watch 9 --events", "9"),
    ("explain 9", "9"),
    ("history 9", "9"),
    ("get 9", "9"),
    ("individual 9", "9"),
    ("individual 1@99/0", "1@99/0"),
    ("lineage 9@2/3", "9@2/3"),
    ("lineage 1@2/3", "1@2/3"),
    ("label 9 user=ada", "9"),
    ("pause 9", "9"),
    ("priority 1 300", "1"),
    ("cancel 9", "9"),
    ("resume 9", "9"),
    ("archive 3", "3"),
    ("prune 3", "3"),
    ("delete nobody", "nobody"),
    ("export 3 --to TO.zip", "3"),
    ("fork 9@1", "9"),
    ("fork 1@77", "1@77"),
    ("fork 1", "1"),
    ("fork 1@1 --set world", "--set"),
    ("submit FILE --set seed=1", "--set"),
    ("simulate 9", "9"),
    ("replay 1@77/0 --to TO.html", "1@77/0"),
    ("replay 1 --judged 9999 --to TO.html", "--judged"),
    ("evaluate 9 --to TO.d", "9"),
    ("evaluate 1 --perturb a:b --to TO.d", "--perturb"),
    ("plot 9 --to TO.svg", "9"),
    ("compare 9", "9"),
    ("compare 1 --target inf", "--target"),
    ("fleet slurm --min 5 --max 2", "--min"),
];

#[tokio::test(flavor = "multi_thread")]
async fn errors_for_programs_say_what_is_at_fault() {
    let temporary = tempfile::tempdir().unwrap();
    let directory = temporary.path();
    let path = data_dir(directory).await;
    let (to, file) = (directory.join("to").display().to_string(), quickstart());
    for (line, place) in REFUSED {
        let line = line.replace("TO", &to).replace("FILE", file.to_str().unwrap());
        let words = ["swarmctl", "--data-dir", path.to_str().unwrap()];
        let args = Args::try_parse_from(words.into_iter().chain(line.split(' '))).unwrap();
        let progress = Captured::default().progress(args.output);
        let error =
            execute(args, progress).await.err().unwrap_or_else(|| panic!("{line} succeeds"));
        assert_eq!(error.place().as_deref(), Some(*place), "{line}: {error}");
    }
}

#[test]
fn no_command_is_forgotten() {
    let definition = Args::command();
    let names: BTreeSet<&str> =
        definition.get_subcommands().map(|command| command.get_name()).collect();
    let lines = ASKED.iter().copied().chain(COMPUTED.iter().map(|(line, _)| *line));
    let tried: BTreeSet<&str> = lines.filter_map(|line| line.split(' ').next()).collect();
    let forgotten: Vec<_> =
        names.iter().filter(|name| !tried.contains(*name) && !ALONE.contains(name)).collect();
    assert!(forgotten.is_empty(), "{forgotten:?}");
}

#[tokio::test]
async fn an_experiment_that_no_program_computes_is_not_waited_for() {
    let temporary = tempfile::tempdir().unwrap();
    let path = data_dir(temporary.path()).await;
    let at = ["--data-dir", path.to_str().unwrap()];
    let resume = format!("swarmctl resume 3 --data-dir {}", path.display());
    for line in ["watch 3", "wait 3", "logs 3 --follow", "watch 3 --quiet", "watch 3 --events"] {
        let text = output(line, &at).await;
        assert!(text.contains("[exit code 3]") && text.contains(&resume), "{line}: {text}");
    }
    let text = output("explain 1", &at).await;
    let next = format!("swarmctl history 1 --data-dir {}", path.display());
    assert!(text.contains(&next), "{text}");
    let text = output("explain 3", &at).await;
    assert!(text.contains("no program computes it") && text.contains(&resume), "{text}");
    for line in ["workers", "explain", "fleet slurm --max 2", "logs --follow"] {
        let text = output(line, &at).await;
        assert!(text.contains("coordinator --data-dir") || line == "logs --follow", "{text}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_next_step_after_a_pause_names_the_directory() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("a b");
    copy(&data_dir(temporary.path()).await, &path);
    let text = output("pause 3", &["--data-dir", path.to_str().unwrap()]).await;
    let next = format!("continue with: swarmctl resume 3 --data-dir '{}'", path.display());
    assert!(text.contains(&next), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_directory_in_use_is_read_and_not_changed() {
    let temporary = tempfile::tempdir().unwrap();
    let path = data_dir(temporary.path()).await;
    let at = ["--data-dir", path.to_str().unwrap()];
    let fleet = Fleet::start(&path).await;
    assert!(output("history 1", &at).await.contains("generation"));
    for line in ["label 1 user=ada", "cancel 3", "extend 1 --generations 9", "resume 3"] {
        let text = output(line, &at).await;
        assert!(text.contains("[exit code 2]"), "{line}: {text}");
        assert!(text.contains(&format!("--coordinator {}", fleet.address())), "{line}: {text}");
    }
    let explained = output("explain 3", &at).await;
    assert!(explained.contains(&fleet.address()), "{explained}");
    fleet.stop().await;
}

#[tokio::test]
async fn only_commands_that_add_experiments_create_a_missing_directory() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("none");
    let at = ["--data-dir", path.to_str().unwrap()];
    for line in ["list", "label 1 user=ada", "extend 1 --generations 9", "resume 1", "watch 1"] {
        let text = output(line, &at).await;
        assert!(text.contains("[exit code 2] there is no database"), "{line}: {text}");
        assert!(!path.exists(), "{line}");
    }
    let file = quickstart().display().to_string();
    let text = output(&format!("submit {file} --generations 1"), &at).await;
    assert!(text.contains("completed after 1 of 1 generations"), "{text}");
}
