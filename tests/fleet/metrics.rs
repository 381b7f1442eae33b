//! Metrics agree with the work of the fleet.

use std::{process::Command, thread, time::Duration};

use harness::{
    CoordinatorProcess, Experiment, Outcome, Samples, WorkerProcess, binary, http_get,
    metrics_address, promtool_check_metrics, skipped_for_want_of,
};

const LISTEN: [&str; 2] = ["--metrics-listen", "127.0.0.1:0"];

fn coordinator() -> (CoordinatorProcess, String) {
    let coordinator = CoordinatorProcess::start_with(&LISTEN);
    let address = metrics_address(&coordinator.process);
    (coordinator, address)
}

fn worker(coordinator: &CoordinatorProcess) -> (WorkerProcess, String) {
    let worker = WorkerProcess::start_with(&coordinator.url(), "ada", &LISTEN);
    let address = metrics_address(&worker.process);
    (worker, address)
}

/// Scrapes until a condition holds; panics after two minutes.
fn scrape_until(address: &str, what: &str, holds: impl Fn(&Samples) -> bool) -> Samples {
    let mut samples = Samples::scrape(address);
    for _ in 0..12_000 {
        if holds(&samples) {
            return samples;
        }
        thread::sleep(Duration::from_millis(10));
        samples = Samples::scrape(address);
    }
    panic!("never {what}: {}", samples.text);
}

fn check_with_promtool(samples: &Samples) {
    match promtool_check_metrics(&samples.text) {
        Some(said) => assert_eq!(said, "", "{}", samples.text),
        None => skipped_for_want_of("promtool", "apt-get install prometheus"),
    }
}

#[test]
fn figures_agree_with_the_work_of_a_run() {
    let (coordinator, address) = coordinator();
    let (mut worker, worker_address) = worker(&coordinator);
    let id = coordinator.submit(&Experiment::small(3).path());
    coordinator.watch(id).finish();
    let gone = |samples: &Samples| samples.find("swarm_experiment_state", &[]).is_none();
    let samples = scrape_until(&address, "without the experiment", gone);
    let ours = Samples::scrape(&worker_address);
    for (samples, program) in [(&samples, "coordinator"), (&ours, "worker")] {
        check_with_promtool(samples);
        assert_eq!(samples.value(&format!("swarm_{program}_build_info"), &[]), 1.0);
    }

    // One worker of one slot computes nothing twice.
    let episodes = samples.value("swarm_episodes_total", &[]);
    assert_eq!(ours.value("swarm_worker_episodes_total", &[]), episodes);
    let sum = "SELECT sum(episodes) FROM generations WHERE experiment_id = ?1";
    let in_generations: f64 =
        coordinator.database().query_row(sum, [id], |row| row.get(0)).unwrap();
    assert!(episodes > in_generations, "{episodes} include held-out trials");
    assert_eq!(in_generations, 3.0 * 12.0 * 3.0);
    // Ten robots, 300 steps.
    assert_eq!(ours.value("swarm_worker_robot_steps_total", &[]), episodes * 3_000.0);
    let computed = samples.value("swarm_items_computed_total", &[]);
    assert_eq!(samples.value("swarm_items_assigned_total", &[]), computed);
    assert_eq!(ours.value("swarm_worker_items_total", &[("outcome", "computed")]), computed);
    let (exist, busy) = ("swarm_slot_seconds_total", "swarm_slot_busy_seconds_total");
    assert!(samples.value(busy, &[]) > 0.0);
    assert!(samples.value(busy, &[]) <= samples.value(exist, &[]));
    let worker_busy = ours.value("swarm_worker_busy_seconds_total", &[]);
    assert!(samples.value(busy, &[]) <= worker_busy, "counted in whole microseconds");

    assert_eq!(samples.value("swarm_commit_duration_seconds_count", &[]), 3.0);
    assert_eq!(samples.value("swarm_store_available", &[]), 1.0);
    assert_eq!(samples.value("swarm_workers", &[("state", "available")]), 1.0);
    assert_eq!(samples.value("swarm_slots", &[]), 1.0);
    assert_eq!(ours.value("swarm_worker_info", &[("name", "ada")]), 1.0);
    assert_eq!(ours.value("swarm_worker_connected", &[]), 1.0);
    assert_eq!(ours.value("swarm_worker_connections_total", &[]), 1.0);
    let submit = [("method", "swarm.v1.ExperimentService/SubmitExperiment"), ("code", "OK")];
    assert_eq!(samples.value("swarm_grpc_calls_total", &submit), 1.0);
    coordinator.swarmctl(&["watch", "77"]);
    let unknown = [("method", "swarm.v1.ExperimentService/GetExperiment"), ("code", "NOT_FOUND")];
    scrape_until(&address, "counted", |samples| {
        samples.find("swarm_grpc_calls_total", &unknown) == Some(1.0)
    });

    worker.process.kill();
    coordinator.process.wait_for("loss", |line| line["message"] == "worker lost");
    let samples = Samples::scrape(&address);
    assert_eq!(samples.value("swarm_workers", &[("state", "available")]), 0.0);
    assert_eq!(samples.value("swarm_workers_joined_total", &[]), 1.0);
    assert_eq!(samples.value("swarm_workers_lost_total", &[]), 1.0);
    assert_eq!(samples.value("swarm_workers_left_total", &[]), 0.0);
}

#[test]
fn an_experiment_can_be_seen_while_it_is_unfinished() {
    let (mut coordinator, address) = coordinator();
    let (mut worker, worker_address) = worker(&coordinator);
    let id = coordinator.submit(&Experiment::tiny(100_000).path());
    let text = id.to_string();
    let is_ours = ("experiment", text.as_str());
    coordinator.wait_for_generation(1);
    let running = scrape_until(&address, "under way", |samples| {
        samples.value("swarm_experiment_items_in_flight", &[is_ours]) > 0.0
    });
    assert_eq!(running.value("swarm_experiment_state", &[is_ours, ("state", "running")]), 1.0);
    check_with_promtool(&running);
    check_with_promtool(&Samples::scrape(&worker_address));

    coordinator.swarmctl(&["pause", &text]).expect_success();
    // The last complete generation may be on its way to the disk.
    let completed = "swarm_experiment_generations_completed";
    let agrees = |samples: &Samples| {
        samples.value(completed, &[is_ours]) == coordinator.n_committed(id) as f64
    };
    let paused = scrape_until(&address, "in agreement", agrees);
    assert_eq!(paused.value("swarm_experiment_state", &[is_ours]), 1.0);
    assert_eq!(paused.value("swarm_experiment_state", &[("state", "paused")]), 1.0);
    assert_eq!(paused.value("swarm_experiment_generations_wanted", &[is_ours]), 100_000.0);
    for of_work in ["swarm_experiment_items_queued", "swarm_experiment_items_in_flight"] {
        assert_eq!(paused.value(of_work, &[is_ours]), 0.0);
    }
    let episodes = paused.value("swarm_experiment_episodes_total", &[is_ours]);
    assert_eq!(episodes, paused.value("swarm_episodes_total", &[]));
    assert!(episodes >= paused.value(completed, &[is_ours]) * 20.0);
    agrees_with_the_database(&paused, &coordinator, id);

    coordinator.process.kill();
    let is_connected = |samples: &Samples| samples.value("swarm_worker_connected", &[]) == 1.0;
    scrape_until(&worker_address, "cut off", |samples| !is_connected(samples));
    coordinator.restart();
    let address = metrics_address(&coordinator.process);
    let back = scrape_until(&worker_address, "back", is_connected);
    assert_eq!(back.value("swarm_worker_connections_total", &[]), 2.0);
    let known = |samples: &Samples| samples.find(completed, &[is_ours]).is_some();
    let again = scrape_until(&address, "known again", known);
    agrees_with_the_database(&again, &coordinator, id);

    worker.process.signal("TERM");
    worker.process.wait();
    let left = |samples: &Samples| samples.value("swarm_workers_left_total", &[]) == 1.0;
    scrape_until(&address, "left", left);
    coordinator.swarmctl(&["cancel", &text]).expect_success();
    scrape_until(&address, "gone", |samples| samples.find(completed, &[]).is_none());
}

/// Compares the metrics of the latest completed generation with the database.
fn agrees_with_the_database(samples: &Samples, coordinator: &CoordinatorProcess, id: u64) {
    let latest = |column: &str| -> f64 {
        let query = format!(
            "SELECT {column} FROM generations WHERE experiment_id = ?1 ORDER BY generation DESC"
        );
        coordinator.database().query_row(&query, [id], |row| row.get(0)).unwrap()
    };
    let id = id.to_string();
    for (metric, expected) in [
        ("generations_completed", latest("generation") + 1.0),
        ("best_fitness", latest("best")),
        ("mean_fitness", latest("mean")),
        ("barrier_idle_ratio", latest("idle_share")),
        ("generation_duration_seconds", latest("duration_ms") / 1000.0),
    ] {
        let value = samples.value(&format!("swarm_experiment_{metric}"), &[("experiment", &id)]);
        assert_eq!(value, expected, "{metric}");
    }
}

#[test]
fn a_worker_without_a_coordinator_says_so() {
    let worker = WorkerProcess::start_with("http://127.0.0.1:1", "ada", &LISTEN);
    let address = metrics_address(&worker.process);
    let failed = "swarm_worker_connections_failed_total";
    let samples = scrape_until(&address, "refused", |samples| samples.value(failed, &[]) > 0.0);
    assert_eq!(samples.value("swarm_worker_connected", &[]), 0.0);
    assert_eq!(http_get(&address, "/").0, 404);
}

#[test]
fn an_address_beyond_loopback_causes_a_warning() {
    let coordinator = CoordinatorProcess::start_with(&["--metrics-listen", "0.0.0.0:0"]);
    let warning = "everybody who reaches this address can read the metrics";
    let line = coordinator.process.wait_for("warning", |line| line["message"] == warning);
    assert_eq!(line["level"], "WARN");
}

#[test]
fn an_address_in_use_is_one_clear_line_and_there_is_none_by_default() {
    let (coordinator, taken) = coordinator();
    let directory = tempfile::tempdir().unwrap();
    for program in ["coordinator", "worker"] {
        let mut command = Command::new(binary(program));
        command.args(["--metrics-listen", &taken]);
        if program == "coordinator" {
            command.args(["--listen", "127.0.0.1:0", "--data-dir"]).arg(directory.path());
        }
        let outcome = Outcome::of_command(&mut command);
        assert_eq!(outcome.code, Some(2), "{outcome:#?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
        assert!(outcome.stderr.contains(&taken), "{}", outcome.stderr);
    }
    drop(coordinator);
    let coordinator = CoordinatorProcess::start();
    let lines = coordinator.process.lines();
    assert!(lines.iter().all(|line| line["message"] != "metrics served"), "{lines:#?}");
}
