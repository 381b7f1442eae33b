//! The same configuration and seed give the same bits on any fleet.

use harness::{CoordinatorProcess, Experiment, WorkerProcess, swarmctl};
use serde_json::Value;

fn run_embedded(experiment: &Experiment, n_workers: usize, extra: &[&str]) -> Vec<Value> {
    let data_dir = tempfile::tempdir().unwrap();
    let path = experiment.path();
    let n_workers = n_workers.to_string();
    let mut args = vec!["run", path.to_str().unwrap(), "--workers", &n_workers, "--data-dir"];
    args.push(data_dir.path().to_str().unwrap());
    args.extend(extra);
    swarmctl(args).expect_success().json_lines()
}

/// A run with descriptors or aims has the same bits alone and on a fleet that is killed and
/// audited, and both a single process and that fleet verify it.
pub fn assert_same_bits_through_kills(experiment: &Experiment, what: &str) {
    let expected = run_embedded(experiment, 1, &[]).pop().unwrap();
    let mut coordinator = CoordinatorProcess::start_with(&["--audit-fraction", "1"]);
    let mut workers = WorkerProcess::start_many(&coordinator, 3);
    let watch = coordinator.watch(coordinator.submit(&experiment.path()));
    coordinator.wait_for_generation(1);
    workers.pop();
    coordinator.process.kill();
    coordinator.restart();
    let found = watch.finish();
    assert_eq!(found.last["digest"], expected["digest"], "{what}");
    assert_eq!(found.last["champion"]["genotype"], expected["champion"]["genotype"], "{what}");
    let directory = tempfile::tempdir().unwrap();
    let bundle = directory.path().join("run.zip");
    let bundle = bundle.to_str().unwrap();
    coordinator.swarmctl(&["export", "1", "--to", bundle]).expect_success();
    swarmctl(["verify", bundle, "--generations", "all"]).expect_success();
    coordinator.swarmctl(&["verify", bundle, "--generations", "all"]).expect_success();
}

/// The lines, without values that depend on the clock.
fn timeless(lines: &[Value]) -> Vec<Value> {
    let mut lines = lines.to_vec();
    for line in &mut lines {
        for key in ["duration_ms", "workers", "idle_share", "champion_file"] {
            line.as_object_mut().unwrap().remove(key);
        }
    }
    lines
}

#[test]
fn one_worker_and_four_give_the_same_bits() {
    let experiment = Experiment::small(4);
    let of_one = run_embedded(&experiment, 1, &[]);
    let of_four = run_embedded(&experiment, 4, &[]);
    assert_eq!(of_one.len(), 5, "four generations and the end");
    assert_eq!(timeless(&of_one), timeless(&of_four));
}

#[test]
fn separate_processes_and_one_process_give_the_same_bits() {
    let experiment = Experiment::small(3);
    let of_one_process = run_embedded(&experiment, 2, &[]);

    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 4);
    let finished = coordinator.watch(coordinator.submit(&experiment.path())).finish();
    for (line, digest) in of_one_process.iter().zip(finished.digests()) {
        assert_eq!(line["digest"], *digest);
    }
    assert_eq!(of_one_process.last().unwrap()["champion"], finished.last["champion"]);
}

/// Audits get the genotypes that other workers draw themselves, and the coordinator compares the
/// results.
#[test]
fn drawn_and_sent_genotypes_give_the_same_bits() {
    let experiment = Experiment::tiny(3);
    let of_one = run_embedded(&experiment, 1, &[]);
    let coordinator = CoordinatorProcess::start_with(&["--audit-fraction", "1"]);
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let finished = coordinator.watch(coordinator.submit(&experiment.path())).finish();
    for (line, digest) in of_one.iter().zip(finished.digests()) {
        assert_eq!(line["digest"], *digest);
    }
    let said =
        |message: &str| coordinator.process.lines().iter().any(|line| line["message"] == message);
    assert!(said("batch evaluated"));
    assert!(!said("worker is faulty: it is given nothing until it is readmitted"));
}

#[test]
fn more_generations_continue_a_completed_run_to_the_same_bits() {
    let experiment = Experiment::small(4);
    let path = experiment.path();
    let directory = tempfile::tempdir().unwrap();
    let run = |generations: &str, data_dir: &std::path::Path| {
        let args = ["run", path.to_str().unwrap(), "--generations", generations, "--data-dir"];
        let args = args.into_iter().chain([data_dir.to_str().unwrap()]);
        swarmctl(args).expect_success().json_lines()
    };
    let short = run("2", directory.path());
    let raised = run("4", directory.path());
    let at_once = run("4", &directory.path().join("other"));
    assert_eq!(raised.last().unwrap()["experiment"], short.last().unwrap()["experiment"]);
    assert_eq!(raised.len(), 5);
    assert_eq!(timeless(&raised), timeless(&at_once));
}

#[test]
fn more_generations_leave_the_runs_of_a_group_as_they_are() {
    let experiment = Experiment::small(4);
    let path = experiment.path();
    let directory = tempfile::tempdir().unwrap();
    let at = ["--data-dir", directory.path().to_str().unwrap()];
    let run = |more: &[&str]| {
        let args = ["run", path.to_str().unwrap()].into_iter().chain(at);
        swarmctl(args.chain(more.iter().copied())).expect_success().json_lines()
    };
    let of_group = run(&["--generations", "2", "--group", "study"]);
    let longer = run(&["--generations", "4"]);
    let id = |lines: &[Value]| lines.last().unwrap()["experiment"].clone();
    assert_ne!(id(&of_group), id(&longer));
    let group = swarmctl(["list", "study"].into_iter().chain(at)).expect_success().json();
    let lengths: Vec<&Value> =
        group.as_array().unwrap().iter().map(|run| &run["generations"]).collect();
    assert_eq!(lengths, [&Value::from(2)]);
}

#[test]
fn another_seed_gives_other_bits() {
    let experiment = Experiment::small(1);
    let as_configured = run_embedded(&experiment, 2, &[]);
    let same_seed = run_embedded(&experiment, 2, &["--seed", "7"]);
    let other_seed = run_embedded(&experiment, 2, &["--seed", "8"]);
    assert_eq!(as_configured[0]["digest"], same_seed[0]["digest"]);
    assert_ne!(as_configured[0]["digest"], other_seed[0]["digest"]);
}

#[test]
fn experiments_that_share_a_fleet_do_not_influence_each_other() {
    let (first, second) =
        (Experiment::small(3), Experiment::small(3).edit(|e| e["seed"] = 8.into()));
    let alone = [run_embedded(&first, 2, &[]), run_embedded(&second, 2, &[])];

    let coordinator = CoordinatorProcess::start();
    let ids = [&first, &second].map(|experiment| coordinator.submit(&experiment.path()));
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    for (id, alone) in ids.into_iter().zip(alone) {
        let expected: Vec<&str> = alone.iter().filter_map(|l| l["digest"].as_str()).collect();
        assert_eq!(coordinator.watch(id).finish().digests(), expected);
    }
}
