//! This program reproduces the runs in `results/` bit for bit. The tests repeat the beginning and
//! the champion of each run; whole runs take hours.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::Command,
};

use evolution::Digest;
use experiment_file::{ExperimentConfig, ScriptConfig, inline_script, script_path};
use harness::{Outcome, binary, skipped_for_want_of, swarmctl, workspace_file};
use serde_json::Value;
use tempfile::TempDir;

/// Number of generations to repeat of the first run of each experiment: `SWARM_TEST_GENERATIONS`.
/// Two take minutes. Without it, the tests repeat one generation of one run per algorithm, and
/// evaluations that cover each task and each kind of neurons.
fn n_generations() -> Option<usize> {
    let text = env::var("SWARM_TEST_GENERATIONS").ok()?;
    let n = text.parse();
    Some(n.unwrap_or_else(|_| panic!("SWARM_TEST_GENERATIONS is {text}, not a number")))
}

/// A run in `results/`.
struct Run {
    /// Name of its files, without suffixes.
    stem: String,
    champion: Value,
    history: Vec<BTreeMap<String, String>>,
}

impl Run {
    fn read(champion: &Path) -> Self {
        let stem = champion.file_stem().unwrap().to_str().unwrap().to_owned();
        let champion = serde_json::from_str(&fs::read_to_string(champion).unwrap()).unwrap();
        let history = fs::read_to_string(results(&format!("histories/{stem}.csv"))).unwrap();
        let mut lines = history.lines().map(|line| line.split(',').map(str::to_owned));
        let keys: Vec<String> = lines.next().unwrap().collect();
        let history = lines.map(|values| keys.iter().cloned().zip(values).collect()).collect();
        Self { stem, champion, history }
    }

    fn all() -> Vec<Self> {
        let entries = fs::read_dir(results("champions")).unwrap();
        let mut champions: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        champions.sort();
        champions.iter().map(|path| Self::read(path)).collect()
    }

    fn seed(&self) -> String {
        self.champion["seed"].to_string()
    }

    /// Its task and its kind of neurons.
    fn shows(&self) -> [String; 2] {
        let name = self.champion["name"].as_str().unwrap().trim_end_matches("_original");
        let name = name.trim_end_matches("_ga").trim_end_matches("_snes");
        let (task, neurons) = ["_lif", "_adex"]
            .into_iter()
            .find_map(|neurons| Some((name.split_once(neurons)?.0, neurons)))
            .unwrap_or((name, ""));
        [task.to_owned(), neurons.to_owned()]
    }

    fn config_path(&self) -> String {
        let name = self.champion["name"].as_str().unwrap();
        let mut files = ["", "original/", "spiking/", "tasks/"]
            .map(|folder| workspace_file(&format!("configs/{folder}{name}.json")))
            .into_iter();
        let file = files.find(|file| file.exists());
        file.unwrap_or_else(|| panic!("no file of {name} in configs/")).to_str().unwrap().to_owned()
    }

    /// The experiment file, with the run's seed.
    fn config(&self) -> ExperimentConfig {
        let path = self.config_path();
        let mut text = fs::read_to_string(&path).unwrap();
        if let Some((name, place)) = script_path(&text) {
            let script = fs::read_to_string(Path::new(&path).with_file_name(&name)).unwrap();
            text = inline_script(&text, place, &ScriptConfig { name, text: script });
        }
        let (mut config, _) =
            ExperimentConfig::from_json(&text, "", evolution::ALGORITHMS).unwrap();
        config.seed = self.champion["seed"].as_u64().unwrap();
        config
    }
}

fn results(path: &str) -> PathBuf {
    workspace_file("results").join(path)
}

#[test]
fn runs_are_complete_and_of_the_shipped_experiments_and_this_simulation() {
    let runs = Run::all();
    assert!(!runs.is_empty());
    for run in &runs {
        let config = run.config();
        assert_eq!(run.stem, format!("{}-{}", config.name, config.seed));
        assert_eq!(run.champion["simulation"], sim_core::FINGERPRINT, "{}", run.stem);
        let digest = Digest::of_config(&config, sim_core::FINGERPRINT);
        assert_eq!(run.champion["config_digest"], digest.to_string(), "{}", run.stem);
        assert_eq!(run.history.len() as u64, config.algorithm.generations, "{}", run.stem);
        for (i, generation) in run.history.iter().enumerate() {
            assert_eq!(generation["generation"], i.to_string(), "{}", run.stem);
        }
    }
    assert_eq!(fs::read_dir(results("histories")).unwrap().count(), runs.len());
}

#[test]
fn runs_begin_again_with_the_same_bits() {
    let mut runs = Run::all();
    // Champions of all seeds are repeated below, and their beginnings differ in the seed only.
    let mut known = BTreeSet::new();
    runs.retain(|run| {
        let config = run.config();
        let kind = if n_generations().is_some() { config.name } else { config.algorithm.name };
        known.insert(kind)
    });
    let n_generations = n_generations().unwrap_or(1);
    for run in runs {
        let data_dir = tempfile::tempdir().unwrap();
        let generations = n_generations.to_string();
        let lines = swarmctl([
            "run",
            &run.config_path(),
            "--seed",
            &run.seed(),
            "--generations",
            &generations,
            "--data-dir",
            data_dir.path().to_str().unwrap(),
        ])
        .expect_success()
        .json_lines();
        let again: Vec<&str> = lines[..n_generations]
            .iter()
            .map(|generation| generation["digest"].as_str().unwrap())
            .collect();
        let published: Vec<&str> = run.history[..n_generations]
            .iter()
            .map(|generation| generation["digest"].as_str())
            .collect();
        assert_eq!(again, published, "{}", run.stem);
    }
}

#[test]
fn champions_have_the_fitness_for_which_they_were_chosen() {
    for run in Run::all() {
        // The mean of a distribution is in no generation; evaluations cover it.
        let trials = run.champion["trial_fitness"].as_array().unwrap();
        if trials.is_empty() {
            continue;
        }
        let again = swarmctl([
            "simulate",
            &run.config_path(),
            "--genotype",
            results(&format!("champions/{}.json", run.stem)).to_str().unwrap(),
            "--seed",
            &run.seed(),
            "--generation",
            &run.champion["generation"].to_string(),
        ])
        .expect_success()
        .json();
        let bits = |fitness: &Value| fitness.as_f64().unwrap().to_bits();
        let again: Vec<u64> = again["trials"]
            .as_array()
            .unwrap()
            .iter()
            .map(|trial| bits(&trial["fitness"]))
            .collect();
        assert_eq!(again, trials.iter().map(bits).collect::<Vec<_>>(), "{}", run.stem);
    }
}

/// A trial does not depend on the number of trials, so a few are enough.
#[test]
fn evaluations_have_the_same_bits_again() {
    let evaluations = fs::read_dir(results("evaluations")).unwrap();
    let mut evaluations: Vec<PathBuf> = evaluations.map(|entry| entry.unwrap().path()).collect();
    evaluations.sort();
    assert!(!evaluations.is_empty());
    let mut known = BTreeSet::new();
    for evaluation in evaluations {
        let stem = evaluation.file_name().unwrap().to_str().unwrap();
        let run = Run::read(&results(&format!("champions/{stem}.json")));
        let n_known = known.len();
        known.extend(run.shows());
        if n_generations().is_none() && known.len() == n_known {
            continue;
        }
        let summary: Value =
            serde_json::from_str(&fs::read_to_string(evaluation.join("summary.json")).unwrap())
                .unwrap();
        let again = tempfile::tempdir().unwrap();
        let mut args: Vec<String> =
            ["evaluate", "--local", "--trials", "2", "--genotype"].map(str::to_owned).into();
        args.push(results(&format!("champions/{stem}.json")).to_str().unwrap().to_owned());
        args.extend(["--config".to_owned(), run.config_path()]);
        args.extend(["--steps".to_owned(), summary["steps"].to_string()]);
        args.extend(["--to".to_owned(), again.path().to_str().unwrap().to_owned()]);
        for (index, condition) in summary["conditions"].as_array().unwrap().iter().enumerate() {
            let changes = condition["changes"].as_object().unwrap().iter();
            let changes = changes.map(|(path, value)| format!("{path}={value}"));
            if index == 0 {
                args.extend(changes.flat_map(|change| ["--base".to_owned(), change]));
            } else {
                let changes: Vec<String> = changes.collect();
                args.extend(["--set".to_owned(), changes.join("; ")]);
            }
        }
        swarmctl(&args).expect_success();
        // Drops the names of the conditions, because this command names each condition by its
        // change.
        let rows = |directory: &Path| -> Vec<String> {
            let text = fs::read_to_string(directory.join("trials.csv")).unwrap();
            let rows = text.lines().skip(1).map(|row| row.rsplitn(5, ',').collect::<Vec<_>>());
            rows.filter(|row| ["0", "1"].contains(&row[3])).map(|row| row[..4].join(",")).collect()
        };
        assert_eq!(rows(again.path()), rows(&evaluation), "{stem}");
    }
}

/// A project with the runs of all seeds; `None` without Python or without the history of this
/// repository.
fn project_with_all_runs() -> Option<TempDir> {
    let mut fetch = python_script(results("fetch"))?;
    let first = fs::read_to_string(results("assets.csv")).unwrap();
    let blob = first.lines().nth(1).and_then(|line| line.rsplit(',').next()).unwrap().to_owned();
    let git = Command::new("git").args(["cat-file", "-e", &blob]).current_dir(results("")).status();
    if !git.is_ok_and(|status| status.success()) {
        skipped_for_want_of("the history of this clone", "git fetch --unshallow");
        return None;
    }
    let project = tempfile::tempdir().unwrap();
    Outcome::of_command(fetch.arg("--to").arg(project.path().join("results"))).expect_success();
    symlink(workspace_file("configs"), project.path().join("configs")).unwrap();
    Some(project)
}

#[test]
fn every_file_that_is_listed_is_here_with_its_digest_or_can_be_fetched() {
    let list = fs::read_to_string(results("assets.csv")).unwrap();
    let listed: Vec<&str> =
        list.lines().skip(1).map(|line| line.split_once(',').unwrap().0).collect();
    assert!(listed.is_sorted() && listed.len() > 300, "{}", listed.len());
    let Some(project) = project_with_all_runs() else { return };
    let fetched = project.path().join("results");
    for path in &listed {
        assert!(fetched.join(path).exists(), "{path}");
    }
    let damaged = fetched.join(listed[0]);
    fs::write(&damaged, "other").unwrap();
    let again =
        Outcome::of_command(Command::new(fetched.join("fetch")).arg("--from").arg(results("")));
    assert!(again.stderr.contains(listed[0]), "{again:?}");
    assert_eq!(fs::read_to_string(damaged).unwrap(), "other");
}

/// Compares numbers of `docs/notebook/2026-11-claims.md`, one of each table.
#[test]
fn the_script_of_the_report_prints_its_numbers() {
    let Some(project) = project_with_all_runs() else { return };
    let results = |path: &str| project.path().join("results").join(path);
    let mut command = Command::new(results("report.py"));
    command.arg(results("format-2"));
    let report = Outcome::of_command(&mut command).expect_success().stdout;
    for row in [
        "| leader_selection_snes-0 | 1000 | 1.737 |",
        "| nominal | 1.47 | 1.23 |",
        "| inhibit=msg | 0.012 [0.001] |",
        "| accuracy | topology_switch:every=200 | 0.45 |",
    ] {
        assert!(report.contains(row), "{row}: {report}");
    }
    Outcome::of_command(&mut Command::new(results("report.py"))).expect_success();
}

/// A script with the programs in its path.
fn script(path: PathBuf) -> Command {
    let binaries = binary("swarmctl").parent().unwrap().to_str().unwrap().to_owned();
    binary("coordinator");
    let mut command = Command::new(path);
    command.env("PATH", format!("{binaries}:{}", env::var("PATH").unwrap()));
    command
}

/// A script in Python; `None` without Python.
fn python_script(path: PathBuf) -> Option<Command> {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped_for_want_of("python3", "apt-get install python3");
        return None;
    }
    Some(script(path))
}

/// A project that has a script of `results/` and the quickstart.
fn project_with(script: &str) -> TempDir {
    let project = tempfile::tempdir().unwrap();
    for folder in ["results", "configs"] {
        fs::create_dir(project.path().join(folder)).unwrap();
    }
    fs::copy(results(script), project.path().join("results").join(script)).unwrap();
    let quickstart = "configs/quickstart.json";
    fs::copy(workspace_file(quickstart), project.path().join(quickstart)).unwrap();
    project
}

#[test]
fn pages_have_the_tables_of_the_scripts() {
    let Some(project) = project_with_all_runs() else { return };
    for (name, page) in
        [("compare.py", "docs/notebook/2026-11-claims.md"), ("thesis.py", "docs/reproduction.md")]
    {
        let mut command = script(project.path().join("results").join(name));
        let table = Outcome::of_command(&mut command).expect_success().stdout;
        let text = fs::read_to_string(workspace_file(page)).unwrap();
        assert!(table.contains("| D | "), "{table}");
        for row in table.lines() {
            assert!(text.contains(row), "{page} lacks what {name} prints: {row}");
        }
    }
}

#[test]
fn the_report_on_mechanisms_covers_a_champion_of_each_file() {
    let Some(mut command) = python_script(results("mechanisms.py")) else { return };
    let directory = tempfile::tempdir().unwrap();
    let champions = directory.path().join("champions");
    fs::create_dir(&champions).unwrap();
    let mut names = BTreeSet::new();
    for run in Run::all() {
        let is_told = Path::new(&run.config_path())
            .parent()
            .is_some_and(|folder| folder.ends_with("configs") || folder.ends_with("original"));
        if is_told && names.insert(run.champion["name"].to_string()) {
            let file = format!("{}.json", run.stem);
            fs::copy(results("champions").join(&file), champions.join(&file)).unwrap();
        }
    }
    let args = [directory.path().as_os_str(), "--trials".as_ref(), "1".as_ref()];
    let told = Outcome::of_command(command.args(args)).expect_success().stdout;
    assert!(names.len() >= 10, "{names:?}");
    assert_eq!(told.matches("## ").count(), names.len(), "{told}");
}

#[test]
fn champions_are_compared_with_controllers_written_by_hand() {
    let Some(mut command) = python_script(results("by-hand.py")) else { return };
    command.args(["--trials", "3", "synchronisation"]);
    let table = Outcome::of_command(&mut command).expect_success().stdout;
    let row = table.lines().find(|line| line.starts_with("| synchronisation | by hand ")).unwrap();
    assert_eq!(row.matches(" to ").count(), 2, "two means with intervals: {row}");
}

#[test]
fn the_gallery_has_the_table_that_its_script_prints() {
    let Some(mut command) = python_script(results("gallery.py")) else { return };
    let table = Outcome::of_command(&mut command).expect_success().stdout;
    assert_eq!(table.lines().count(), 16, "a head of two lines, and fourteen tasks: {table}");
    let page = fs::read_to_string(workspace_file("docs/gallery.md")).unwrap();
    for row in table.lines() {
        assert!(page.contains(row), "the gallery lacks what gallery.py prints: {row}");
    }
}

#[test]
fn the_gallery_has_the_repertoires_of_the_bundles() {
    let Some(mut command) = python_script(results("repertoires.py")) else { return };
    let table = Outcome::of_command(&mut command).expect_success().stdout;
    assert_eq!(table.lines().count(), 4, "a head of two lines, and two repertoires: {table}");
    let page = fs::read_to_string(workspace_file("docs/gallery.md")).unwrap();
    for row in table.lines() {
        assert!(page.contains(row), "the gallery lacks what repertoires.py prints: {row}");
    }
}

#[test]
fn algorithms_are_compared_on_the_same_budget() {
    let project = project_with("algorithms.py");
    let path = |path: &str| project.path().join(path);
    let Some(mut command) = python_script(path("results/algorithms.py")) else { return };
    command.args(["quickstart", "--generations", "2", "--seeds", "0", "1"]);
    command.args(["--algorithms", "GA", "openaiES"]);
    Outcome::of_command(&mut command).expect_success();
    let runs = path("results/algorithms/quickstart");
    let mut files: Vec<String> = fs::read_dir(runs)
        .unwrap()
        .map(|entry| entry.unwrap().path().to_str().unwrap().into())
        .collect();
    files.sort();
    assert_eq!(files.len(), 8, "{files:?}");
    let args = ["compare".to_owned()].into_iter().chain(files);
    let compared = swarmctl(args).expect_success().stdout;
    assert!(compared.contains("GA") && compared.contains("openaiES"), "{compared}");
}

#[test]
fn a_run_that_is_added_twice_is_computed_once() {
    let project = project_with("add-run");
    let path = |path: &str| project.path().join(path);
    let add = || {
        let mut command = script(path("results/add-run"));
        command.args(["quickstart", "7"]).arg(path("data"));
        command.args(["--generations", "2", "--workers", "1"]);
        Outcome::of_command(&mut command).expect_success();
        let read = |name| fs::read_to_string(path(name)).unwrap();
        [read("results/histories/quickstart-7.csv"), read("results/champions/quickstart-7.json")]
    };
    let added = add();
    assert_eq!(added[0].lines().count(), 3);
    let champion_of_run = path("data/quickstart-7/quickstart-1.champion.json");
    assert_eq!(added[1], fs::read_to_string(champion_of_run).unwrap());
    assert_eq!(add(), added);
}
