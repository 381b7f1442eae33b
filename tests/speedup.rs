//! Measures the speedup from a second core: generations of experiment A by two worker processes
//! with a slot each, through gRPC and the database, against the same number of episodes in one
//! thread of one process. Also measures the memory of a worker. The two sides take turns; figures
//! are medians.
#![allow(clippy::disallowed_methods, reason = "a benchmark measures time")]

use std::{
    fs,
    time::{Duration, Instant},
};

use evolution::Evolution;
use experiment_file::ExperimentConfig;
use harness::{CoordinatorProcess, Experiment, WorkerProcess, workspace_file};
use serde_json::json;
use sim_core::Simulation;

const N_ROUNDS: usize = 5;
/// Number of timed generations per round, after a first one for the setup.
const N_TIMED_GENERATIONS: u64 = 6;

fn main() {
    let text = fs::read_to_string(workspace_file("configs/leader_selection_snes.json"))
        .expect("shipped with the project");
    let (config, _) = ExperimentConfig::from_json(&text, "A", evolution::ALGORITHMS)
        .expect("a shipped file is right");
    let coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 2);

    let mut rounds: Vec<(f64, f64)> = (0..N_ROUNDS as u64)
        .map(|seed| {
            let file = Experiment::from_value(serde_json::from_str(&text).expect("valid JSON"));
            let file = file.edit(|file| {
                file["seed"] = json!(seed);
                file["algorithm"]["generations"] = json!(N_TIMED_GENERATIONS + 1);
                // Turns off re-evaluations and judgements of champions, which this does not
                // measure.
                file["algorithm"]["champion_every"] = json!(1000);
                file["algorithm"]["champion_trials"] = json!(1);
                file["algorithm"]["judgement_trials"] = json!(1);
            });
            let id = coordinator.submit(&file.path());
            coordinator.watch(id).finish();
            (fleet_seconds(&coordinator, id), alone_seconds(&config, seed))
        })
        .collect();
    rounds.sort_by(|(fleet, alone), (other_fleet, other_alone)| {
        (alone / fleet).total_cmp(&(other_alone / other_fleet))
    });
    let (fleet, alone) = rounds[rounds.len() / 2];
    println!("generation of experiment A (100 genotypes x 5 trials x 300 steps x 10 robots)");
    println!("  one thread, in process        {:.3} s", alone);
    println!("  two workers, through gRPC     {:.3} s", fleet);
    println!("  speedup                       {:.2}", alone / fleet);
    for worker in &workers {
        println!("  peak memory of {}       {:.1} MiB", worker.name, peak_mib(worker.process.id()));
    }
}

/// Seconds from commit to commit.
fn fleet_seconds(coordinator: &CoordinatorProcess, id: u64) -> f64 {
    let sql = "SELECT max(at_ms) - min(at_ms) FROM events \
               WHERE experiment_id = ?1 AND kind = 'generation'";
    let elapsed_ms: u64 =
        coordinator.database().query_row(sql, [id], |row| row.get(0)).expect("it has generations");
    Duration::from_millis(elapsed_ms).as_secs_f64() / N_TIMED_GENERATIONS as f64
}

/// Seconds that one thread takes for the genotypes of a generation of the same evolution.
fn alone_seconds(config: &ExperimentConfig, seed: u64) -> f64 {
    let config = ExperimentConfig { seed, ..config.clone() };
    let simulation = Simulation::compile(&config).expect("a shipped file is right");
    let segments = simulation.population_segments();
    let evolution = Evolution::new(&config, segments, sim_core::FINGERPRINT);
    let generation = evolution.ask();
    let start = Instant::now();
    for genotype in generation.genotypes.iter() {
        let trials = 0..config.algorithm.num_evaluations;
        simulation.evaluate(genotype, 0, trials).expect("genotype and trials are right");
    }
    start.elapsed().as_secs_f64()
}

/// Largest resident memory of a process so far.
fn peak_mib(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("it is running");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("Linux says so");
    line.trim().trim_end_matches(" kB").parse::<f64>().expect("a number") / 1024.0
}
