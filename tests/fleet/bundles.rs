//! Experiments as files: exported here, verified and imported elsewhere.

use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Command, Stdio},
};

use harness::{
    CoordinatorProcess, Experiment, Outcome, WorkerProcess, binary, python_with, swarmctl,
};
use serde_json::{Value, json};

fn ga() -> Experiment {
    Experiment::tiny(4).edit(|file| {
        file["algorithm"]["name"] = json!("GA");
        file["algorithm"]["champion_every"] = json!(2);
        let populations = file["algorithm"]["populations"].as_object_mut().unwrap();
        populations.values_mut().for_each(|population| population["params"] = json!({}));
    })
}

fn export(coordinator: &CoordinatorProcess, id: u64, to: &Path) -> Value {
    let args = ["export", &id.to_string(), "--to", to.to_str().unwrap()];
    coordinator.swarmctl(&args).expect_success().json()
}

fn refused(outcome: &Outcome, code: i32, what: &str) {
    assert_eq!(outcome.code, Some(code), "{outcome:#?}");
    assert!(outcome.stderr.contains(what), "{}", outcome.stderr);
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
}

#[test]
fn an_exported_experiment_is_proven_anywhere_and_goes_on_elsewhere() {
    let here = CoordinatorProcess::start();
    let id = here.submit(&ga().path());
    refused(&here.swarmctl(&["export", "1", "--to", "x.zip"]), 3, "experiment 1 has not ended");
    let _workers = WorkerProcess::start_many(&here, 2);
    here.watch(id).finish();
    let forked = ["fork", "1@1", "--seed", "99", "--generations", "3"];
    here.swarmctl(&forked).expect_success();
    here.watch(2).finish();

    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("run.zip");
    let path = file.to_str().unwrap();
    let written = export(&here, 1, &file);
    assert_eq!(written["bytes"], fs::metadata(&file).unwrap().len());
    let offline = directory.path().join("offline.zip");
    let data_dir = here.data_dir().to_str().unwrap();
    swarmctl(["export", "1", "--to", offline.to_str().unwrap(), "--data-dir", data_dir])
        .expect_success();
    assert_eq!(fs::read(&file).unwrap(), fs::read(&offline).unwrap());
    let fork = directory.path().join("fork.zip");
    export(&here, 2, &fork);

    // `verify` computes in its own process, and then on a fleet.
    let alone = swarmctl(["verify", path, "--generations", "all"]).expect_success().json();
    let on_fleet = here.swarmctl(&["verify", path, "--generations", "all"]).expect_success();
    assert_eq!(on_fleet.json(), alone);
    assert_eq!(alone["sha256"], written["sha256"]);
    let claims: Vec<&str> = alone["proven"]
        .as_array()
        .unwrap()
        .iter()
        .map(|proof| proof["claim"].as_str().unwrap())
        .collect();
    assert_eq!(claims, ["experiment", "chain", "history", "keyframes", "champion", "simulation"]);
    let of_fork = swarmctl(["verify", fork.to_str().unwrap()]).expect_success().json();
    assert_eq!(of_fork["unproven"].as_array().unwrap().len(), 2);

    let elsewhere = CoordinatorProcess::start();
    let import = |path: &Path| elsewhere.swarmctl(&["import", path.to_str().unwrap()]);
    refused(&import(&fork), 3, "import the parent first");
    let imported = import(&file).expect_success().json();
    assert_eq!(import(&file).expect_success().json(), imported, "it is there already");
    import(&fork).expect_success();
    for id in ["1", "2"] {
        let history = |coordinator: &CoordinatorProcess| {
            coordinator.swarmctl(&["history", id]).expect_success().json()
        };
        assert_eq!(history(&elsewhere), history(&here));
        let champion = |coordinator: &CoordinatorProcess| {
            coordinator.swarmctl(&["individual", id]).expect_success().json()
        };
        assert_eq!(champion(&elsewhere), champion(&here));
    }
    let individual = |coordinator: &CoordinatorProcess| {
        coordinator.swarmctl(&["individual", "1@2/7"]).expect_success().json()
    };
    assert_eq!(individual(&elsewhere), individual(&here));
    let again = directory.path().join("again.zip");
    export(&elsewhere, 1, &again);
    assert_eq!(fs::read(&again).unwrap(), fs::read(&file).unwrap());

    // The imported experiment continues as if this coordinator had computed it.
    let _workers = WorkerProcess::start_many(&elsewhere, 2);
    elsewhere.swarmctl(&["fork", "1@1", "--seed", "99", "--generations", "3"]).expect_success();
    let [digest, expected] = [(&elsewhere, 3), (&here, 2)]
        .map(|(coordinator, id)| coordinator.watch(id).finish().last["digest"].clone());
    assert_eq!(digest, expected);
    let data_dir = elsewhere.data_dir().to_str().unwrap();
    swarmctl(["doctor", "--data-dir", data_dir]).expect_success();
    hostile(&elsewhere, &file);
    refused(&here.swarmctl(&["prune", "1"]), 3, "delete that first: swarmctl delete 2");
    here.swarmctl(&["delete", "2"]).expect_success();
    here.swarmctl(&["prune", "1"]).expect_success();
    refused(&here.swarmctl(&["export", "1", "--to", "x.zip"]), 3, "was pruned before generation 4");
}

/// Files that are not bundles change nothing.
fn hostile(coordinator: &CoordinatorProcess, bundle: &Path) {
    let bytes = fs::read(bundle).unwrap();
    let path = bundle.with_file_name("bad.zip");
    let text = path.to_str().unwrap();
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 4;
    for (content, what) in [
        (&bytes[..bytes.len() / 2], "cut off or damaged"),
        (&flipped[..], "damaged"),
        (b"PK", "not a bundle"),
        (b"", "not a bundle"),
    ] {
        fs::write(&path, content).unwrap();
        refused(&swarmctl(["verify", text]), 2, what);
        refused(&coordinator.swarmctl(&["import", text]), 2, what);
    }
    refused(&swarmctl(["verify", "missing.zip"]), 2, "missing.zip");
    let listed = coordinator.swarmctl(&["list"]).expect_success().json();
    assert_eq!(listed.as_array().unwrap().len(), 3, "nothing was created");
}

/// Reads a bundle with an independent reader of RO-Crates, and prints it.
const READ_CRATE: &str = "\
import json, os, sys
from rocrate.rocrate import ROCrate
crate = ROCrate(sys.argv[1])
files = [entity for entity in crate.get_entities() if entity.type == 'File']
action = crate.dereference('#evolution')
print(json.dumps({
    'version': str(crate.version),
    'root': {key: crate.root_dataset.get(key) for key in ['name', 'datePublished', 'license']},
    'files': {
        file.id: [file['sha256'], file['contentSize'], str(os.path.getsize(file.source))]
        for file in files
    },
    'parts': [part.id for part in crate.root_dataset['hasPart']],
    'instrument': action['instrument']['name'],
    'object': action['object'].id,
}))
";

/// Reads a directory with TensorBoard's own reader, and prints its scalars.
const READ_EVENTS: &str = "\
import json, sys
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
events = EventAccumulator(sys.argv[1])
events.Reload()
print(json.dumps({tag: [[it.step, it.value, it.wall_time] for it in events.Scalars(tag)]
                  for tag in events.Tags()['scalars']}))
";

#[test]
fn tensorboard_reads_the_history() {
    let Some(python) = python_with("tensorboard") else { return };
    let directory = tempfile::tempdir().unwrap();
    let data_dir = directory.path().join("data");
    let data_dir = data_dir.to_str().unwrap();
    let experiment = Experiment::tiny(3);
    let path = experiment.path();
    swarmctl(["run", path.to_str().unwrap(), "--data-dir", data_dir]).expect_success();
    let logs = directory.path().join("logs");
    let args = ["export", "1", "--tensorboard", logs.to_str().unwrap(), "--data-dir", data_dir];
    swarmctl(args).expect_success();
    let run = logs.join("leader_selection_snes-1");
    let mut reader = Command::new(python);
    let found = Outcome::of_command(reader.args(["-c", READ_EVENTS]).arg(run)).expect_success();
    let found: Value = serde_json::from_str(&found.stdout).unwrap();
    let bundle = directory.path().join("run.zip");
    swarmctl(["export", "1", "--to", bundle.to_str().unwrap(), "--data-dir", data_dir])
        .expect_success();
    let bundle = bundle::Bundle::read(&fs::read(bundle).unwrap()).unwrap();
    for (tag, value) in [
        ("fitness/best", (|statistics| statistics.best.get()) as fn(&evolution::Statistics) -> f64),
        ("fitness/mean", |statistics| statistics.mean.get()),
        ("fitness/min", |statistics| statistics.min.get()),
        ("fitness/standard_deviation", |statistics| statistics.standard_deviation.get()),
    ] {
        let scalars = found[tag].as_array().unwrap_or_else(|| panic!("{tag}: {found}"));
        assert_eq!(scalars.len(), 3, "{tag}");
        for (step, (scalar, row)) in scalars.iter().zip(&bundle.history).enumerate() {
            assert_eq!(scalar[0], step);
            assert_eq!(scalar[1].as_f64().unwrap() as f32, value(&row.statistics()) as f32);
            assert_eq!(scalar[2].as_f64().unwrap(), row.completed_at_ms as f64 / 1000.0);
        }
    }
    assert_eq!(found["speed/episodes_per_second"].as_array().unwrap().len(), 3);
}

#[test]
fn a_bundle_is_an_ro_crate_to_an_independent_reader() {
    let Some(python) = python_with("rocrate") else { return };
    let directory = tempfile::tempdir().unwrap();
    let data_dir = directory.path().join("data");
    let data_dir = data_dir.to_str().unwrap();
    let experiment = Experiment::tiny(2);
    let path = experiment.path();
    swarmctl(["run", path.to_str().unwrap(), "--data-dir", data_dir]).expect_success();
    let file = directory.path().join("run.zip");
    let file = file.to_str().unwrap();
    swarmctl(["export", "1", "--to", file, "--data-dir", data_dir]).expect_success();
    let found =
        Outcome::of_command(Command::new(python).args(["-c", READ_CRATE, file])).expect_success();
    let found: Value = serde_json::from_str(&found.stdout).unwrap();
    assert_eq!(found["version"], "1.3");
    assert_eq!(found["root"]["name"], "leader_selection_snes, seed 7");
    let date = found["root"]["datePublished"].as_str().unwrap();
    assert!(date.starts_with("20") && date.ends_with('Z'), "{date}");
    let files = found["files"].as_object().unwrap();
    assert_eq!(files.len(), 6);
    for (name, described) in files {
        assert_eq!(described[1], described[2], "{name}");
        assert_eq!(described[0].as_str().unwrap().len(), 64);
        assert!(found["parts"].as_array().unwrap().iter().any(|part| part == name), "{name}");
    }
    assert_eq!(
        (&found["instrument"], &found["object"]),
        (&json!("swarmevo"), &json!("experiment.json"))
    );
}

#[test]
fn verify_says_that_there_are_no_workers_and_goes_on_with_the_first() {
    let coordinator = CoordinatorProcess::start();
    let worker = WorkerProcess::start(&coordinator, "first");
    let id = coordinator.submit(&ga().path());
    coordinator.watch(id).finish();
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("run.zip");
    export(&coordinator, id, &file);
    drop(worker);

    let mut command = Command::new(binary("swarmctl"));
    command.args(["--coordinator", &coordinator.url(), "verify"]).arg(&file);
    let mut verifying =
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut lines = BufReader::new(verifying.stderr.take().unwrap()).lines().map_while(Result::ok);
    let said = lines.find(|line| line.starts_with("waiting for a worker:"));
    assert!(said.is_some_and(|line| line.contains("without --coordinator")));
    let _worker = WorkerProcess::start(&coordinator, "second");
    let rest: Vec<String> = lines.collect();
    assert!(verifying.wait().unwrap().success(), "{rest:?}");
}
