//! Measures the overhead of a generation, apart from its episodes, with real processes: a
//! coordinator and two workers of one slot. Genotypes are those of experiment A; episodes have
//! one robot and one step, so that the simulation costs next to nothing. Also compares `swarmctl
//! run` on two cores with one thread, for the quickstart, whose episodes are short. Figures are
//! medians of rounds that take turns; an argument selects lines by a part of their name.
#![allow(clippy::disallowed_methods, reason = "a benchmark measures time")]

use std::{
    env, fs,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use evolution::Evolution;
use experiment_file::ExperimentConfig;
use harness::{CoordinatorProcess, Experiment, WorkerProcess, binary, workspace_file};
use rusqlite::Connection;
use serde_json::{Value, json};
use sim_core::Simulation;

const N_ROUNDS: usize = 5;

fn main() {
    let filter = env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let is_wanted =
        |name: &str| filter.as_ref().is_none_or(|filter| name.contains(filter.as_str()));
    let mut table = Table::default();
    for _ in 0..N_ROUNDS {
        for (name, file) in [("SNES", "leader_selection_snes"), ("GA", "leader_selection_ga")] {
            let name = format!("100 no-op items, {name}");
            if is_wanted(&name) {
                let run = Run::of_fleet(&no_op(file, 100, 400), 20);
                table.add(&format!("{name}: generation, ms"), run.ms_per_generation);
                table.add(&format!("{name}: CPU of the coordinator, ms"), run.coordinator_ms);
                table.add(&format!("{name}: CPU of the workers, ms"), run.workers_ms);
            }
        }
        if is_wanted("10,000 no-op items") {
            let run = Run::of_fleet(&no_op("leader_selection_snes", 10_000, 8), 2);
            table.add("10,000 no-op items: items/s while judging", 1e7 / run.ms_judging);
            table.add("10,000 no-op items: items/s overall", 1e7 / run.ms_per_generation);
        }
        if is_wanted("quickstart") {
            let file = quickstart();
            let ideal = episodes_alone_ms(&file) / 2.0;
            let real = run_alone_ms(&file);
            table.add("quickstart: generation, ms", real);
            table.add("quickstart: half of its episodes in one thread, ms", ideal);
            table.add("quickstart: share of the ideal, %", 100.0 * ideal / real);
        }
    }
    table.print();
}

/// Lines with their values of all rounds, in the order of measurement.
#[derive(Default)]
struct Table(Vec<(String, Vec<f64>)>);

impl Table {
    fn add(&mut self, name: &str, value: f64) {
        match self.0.iter_mut().find(|(line, _)| line == name) {
            Some((_, values)) => values.push(value),
            None => self.0.push((name.to_owned(), vec![value])),
        }
    }

    fn print(self) {
        println!("{:52} {:>10}   from .. to", "", "median");
        for (name, mut values) in self.0 {
            values.sort_by(f64::total_cmp);
            let (first, median) = (values[0], values[values.len() / 2]);
            let last = values[values.len() - 1];
            println!("{name:52} {median:>10.2}   {first:.2} .. {last:.2}");
        }
    }
}

/// Experiment A with episodes that cost next to nothing.
fn no_op(name: &str, population_size: u32, generations: u64) -> Experiment {
    shipped(name).edit(|file| {
        file["world"]["objects"]["robotA"]["num_instances"] = json!(1);
        file["world"]["objects"]["robotA"]["perturbations"] = json!({});
        let algorithm = &mut file["algorithm"];
        algorithm["population_size"] = json!(population_size);
        algorithm["generations"] = json!(generations);
        algorithm["evaluation_steps"] = json!(1);
        algorithm["num_evaluations"] = json!(1);
        without_reevaluation(algorithm);
    })
}

fn quickstart() -> Experiment {
    shipped("quickstart").edit(|file| without_reevaluation(&mut file["algorithm"]))
}

/// Removes re-evaluations of champions, which are not measured.
fn without_reevaluation(algorithm: &mut Value) {
    algorithm["champion_every"] = json!(100_000);
    algorithm["champion_trials"] = json!(1);
}

fn shipped(name: &str) -> Experiment {
    let path = workspace_file(&format!("configs/{name}.json"));
    let text = fs::read_to_string(path).expect("shipped with the project");
    Experiment::from_value(serde_json::from_str(&text).expect("valid JSON"))
}

/// An experiment that a fleet has computed, per generation.
struct Run {
    /// From commit to commit.
    ms_per_generation: f64,
    /// From the first assignment to the last result; median.
    ms_judging: f64,
    coordinator_ms: f64,
    workers_ms: f64,
}

impl Run {
    /// The first `n_warm_up` generations are not timed.
    fn of_fleet(file: &Experiment, n_warm_up: u64) -> Self {
        // The default level; the harness logs more.
        let coordinator = CoordinatorProcess::start_with(&["--log-level", "info"]);
        let workers = WorkerProcess::start_many(&coordinator, 2);
        let id = coordinator.submit(&file.path());
        coordinator.watch(id).finish();
        let database = coordinator.database();
        let n = coordinator.n_committed(id) as f64;
        Self {
            ms_per_generation: ms_per_generation(&database, n_warm_up),
            ms_judging: ms_judging(&database, n_warm_up),
            coordinator_ms: cpu_ms(coordinator.process.id()) / n,
            workers_ms: workers.iter().map(|worker| cpu_ms(worker.process.id())).sum::<f64>() / n,
        }
    }
}

/// Time between the commits of generations. Leaves out the last one, because the champion is chosen
/// before it.
fn ms_per_generation(database: &Connection, n_warm_up: u64) -> f64 {
    let sql = "SELECT (max(at_ms) - min(at_ms)) * 1.0 / (count(*) - 1) FROM events
               WHERE kind = 'generation' AND generation >= ?1
                     AND generation < (SELECT max(generation) FROM generations)";
    database.query_row(sql, [n_warm_up], |row| row.get(0)).expect("it has generations")
}

fn ms_judging(database: &Connection, n_warm_up: u64) -> f64 {
    let sql = "SELECT avg(duration_ms) FROM generations WHERE generation >= ?1";
    database.query_row(sql, [n_warm_up], |row| row.get(0)).expect("it has generations")
}

/// Processor time of a process since it began.
fn cpu_ms(process: u32) -> f64 {
    const TICK_MS: f64 = 10.0;
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).expect("it is running");
    let (_, after_name) = stat.rsplit_once(')').expect("Linux says so");
    let mut fields = after_name.split_whitespace().skip(11);
    let mut ticks = || fields.next().and_then(|field| field.parse::<f64>().ok()).expect("a number");
    (ticks() + ticks()) * TICK_MS
}

/// `swarmctl run`: a coordinator and a worker of one slot per core in one process.
fn run_alone_ms(file: &Experiment) -> f64 {
    let data_dir = tempfile::tempdir().expect("a temporary directory");
    let status = Command::new(binary("swarmctl"))
        .arg("--output")
        .arg("json")
        .arg("run")
        .arg(file.path())
        .arg("--data-dir")
        .arg(data_dir.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("the program starts");
    assert!(status.success());
    let database = open(data_dir.path());
    ms_per_generation(&database, 1)
}

fn open(data_dir: &Path) -> Connection {
    Connection::open(data_dir.join("swarmevo.sqlite3")).expect("the database opens")
}

/// The episodes of the same evolution in one thread of one process, per generation.
fn episodes_alone_ms(file: &Experiment) -> f64 {
    let (config, _) = ExperimentConfig::from_json(&file.text(), "", evolution::ALGORITHMS)
        .expect("a shipped file is right");
    let simulation = Simulation::compile(&config).expect("a shipped file is right");
    let segments = simulation.population_segments();
    let mut evolution = Evolution::new(&config, segments, sim_core::FINGERPRINT);
    let mut elapsed = Duration::ZERO;
    for index in 0..config.algorithm.generations {
        let generation = evolution.ask();
        let started = Instant::now();
        let trials = 0..config.algorithm.num_evaluations;
        let evaluate = |genotype: &Vec<f64>| {
            let fitness = simulation.evaluate(genotype, index, trials.clone());
            fitness.expect("genotype and trials are right")
        };
        let fitness: Vec<Vec<f64>> = generation.genotypes.iter().map(evaluate).collect();
        elapsed += started.elapsed();
        evolution.tell(generation, &fitness).expect("all fitness is finite");
    }
    elapsed.as_secs_f64() * 1e3 / config.algorithm.generations as f64
}
