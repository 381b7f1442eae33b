//! Measures how fast the coordinator assigns items and handles results: a coordinator process,
//! and workers that answer at once, over gRPC on loopback. Prints the tables of
//! `docs/notebook/2026-11-fleet.md`; an argument selects lines by a part of their name.

mod alone;
mod coordinator_process;
mod instant_workers;
mod open_pages;

use std::{env, time::Duration};

use serde_json::{Value, json};

use alone::Alone;
use coordinator_process::CoordinatorProcess;
use instant_workers::{InstantWorkers, median};
use open_pages::OpenPages;

/// Number of measurements per line, each with a new coordinator.
const N_REPEATS: usize = 5;
/// Both shipped files of experiment A have 445 genes.
const SNES: &str = include_str!("../../../configs/leader_selection_snes.json");
const GA: &str = include_str!("../../../configs/leader_selection_ga.json");
/// So many generations that no run ends by itself.
const FOREVER: u64 = 1_000_000;

#[tokio::main(flavor = "current_thread")]
async fn main() {
    let filter = env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let is_wanted = |name: &str| filter.as_ref().is_none_or(|filter| name.contains(filter));
    println!("{:44} {:>9} {:>9} {:>9}   from .. to", "", "must", "goal", "measured");
    if is_wanted("items/s") {
        let mut runs = Vec::new();
        for _ in 0..N_REPEATS {
            runs.push(items_per_s().await);
        }
        let (evaluating, overall): (Vec<f64>, Vec<f64>) = runs.into_iter().unzip();
        line("items/s while a generation is evaluated", 20_000.0, 100_000.0, evaluating);
        line("items/s with evolution and commits", 80_000.0, 120_000.0, overall);
    }
    for (name, file) in [("SNES", SNES), ("GA", GA)] {
        let name = format!("generation of 100 by {name}, ms");
        if is_wanted(&name) {
            let mut runs = Vec::new();
            for _ in 0..N_REPEATS {
                runs.push(generation_ms(file).await);
            }
            let part = |part: fn(&GenerationParts) -> f64| runs.iter().map(part).collect();
            line(&name, 2.0, 1.0, part(|parts| parts.all));
            detail("tell and ask, alone", part(|parts| parts.alone.evolution));
            detail("dispatch and results: the rest", part(GenerationParts::dispatch));
            detail("beside it: checkpoint and commit, alone", part(|parts| parts.alone.commit));
            detail("of that, fdatasync of as many bytes", part(|parts| parts.alone.sync));
        }
    }
    if is_wanted("generation beside 50 open pages, ms") {
        let (without, with) = beside_pages_ms().await;
        let ratio = with.iter().zip(&without).map(|(with, without)| with / without).collect();
        line("generation beside 50 open pages, ms", f64::NAN, f64::NAN, with);
        detail("without pages", without);
        line("  pair by pair, times as long", 1.05, 1.0, ratio);
    }
    if is_wanted("peak memory, MiB") {
        let mut runs = Vec::new();
        for _ in 0..N_REPEATS {
            runs.push(peak_memory_mib().await);
        }
        line("peak memory, MiB", 256.0, 128.0, runs);
    }
    if is_wanted("restart to first item, s") {
        let mut runs = Vec::new();
        for _ in 0..N_REPEATS {
            runs.push(restart_s().await);
        }
        line("restart to first item, s", 1.0, 0.2, runs);
    }
}

fn line(name: &str, must: f64, goal: f64, runs: Vec<f64>) {
    println!(
        "{name:44} {:>9} {:>9} {:>9}   {} .. {}",
        readable(must),
        readable(goal),
        readable(median(&runs)),
        readable(runs.iter().copied().fold(f64::INFINITY, f64::min)),
        readable(runs.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
    );
}

fn detail(name: &str, runs: Vec<f64>) {
    line(&format!("  {name}"), f64::NAN, f64::NAN, runs);
}

fn readable(value: f64) -> String {
    match value {
        value if value.is_nan() => String::new(),
        value if value >= 100.0 => format!("{value:.0}"),
        value => format!("{value:.3}"),
    }
}

/// An experiment of one trial per individual, so that a genotype is an item, and
/// without re-evaluations of the champion.
fn experiment(file: &str, population_size: u32, generations: u64) -> String {
    let mut config: Value = serde_json::from_str(file).expect("the file is JSON");
    config["algorithm"]["population_size"] = json!(population_size);
    config["algorithm"]["generations"] = json!(generations);
    config["algorithm"]["num_evaluations"] = json!(1);
    config["algorithm"]["champion_every"] = json!(FOREVER);
    config.to_string()
}

/// Items per second with two workers of eight slots and a large population: during the evaluation
/// of a generation, and overall.
async fn items_per_s() -> (f64, f64) {
    const POPULATION_SIZE: u32 = 10_000;
    let coordinator = CoordinatorProcess::start();
    let workers = InstantWorkers::start(&coordinator, 2, 8);
    coordinator.submit(&experiment(SNES, POPULATION_SIZE, FOREVER)).await;
    let rounds = workers.rounds(1, 11).await;
    let evaluating: Vec<f64> =
        rounds.iter().map(|round| round.evaluating().as_secs_f64()).collect();
    let overall = rounds[10].started - rounds[0].started;
    let n_items = f64::from(POPULATION_SIZE);
    (n_items / median(&evaluating), 10.0 * n_items / overall.as_secs_f64())
}

/// Medians, ms.
struct GenerationParts {
    all: f64,
    alone: Alone,
}

impl GenerationParts {
    fn dispatch(&self) -> f64 {
        self.all - self.alone.evolution
    }
}

/// Time from the first item of a generation to the first item of the next one, with two workers of
/// eight slots.
async fn generation_ms(file: &str) -> GenerationParts {
    let file = experiment(file, 100, FOREVER);
    let coordinator = CoordinatorProcess::start();
    let workers = InstantWorkers::start(&coordinator, 2, 8);
    coordinator.submit(&file).await;
    let rounds = workers.rounds(10, 410).await;
    drop((workers, coordinator));
    let all: Vec<f64> =
        rounds.windows(2).map(|pair| ms(pair[1].started - pair[0].started)).collect();
    GenerationParts { all: median(&all), alone: alone::measure(&file) }
}

/// Durations of generations of 100 with a thousand workers, after ten thousand generations:
/// stretches without pages, in turns with stretches with 50 pages.
async fn beside_pages_ms() -> (Vec<f64>, Vec<f64>) {
    const N_BEFORE: u64 = 10_000;
    // Some four seconds, because pages send requests every two seconds.
    const STRETCH: u64 = 1_200;
    let coordinator = CoordinatorProcess::start();
    let workers = InstantWorkers::start(&coordinator, 2, 8);
    coordinator.submit(&experiment(SNES, 100, FOREVER)).await;
    workers.rounds(N_BEFORE, N_BEFORE).await;
    drop(workers);
    let workers = InstantWorkers::start(&coordinator, 1000, 1);
    workers.first_round().await;
    let stretch = async || {
        let first = workers.latest() + 10;
        let rounds = workers.rounds(first, first + STRETCH).await;
        ms(rounds[STRETCH as usize].started - rounds[0].started) / STRETCH as f64
    };
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for _ in 0..N_REPEATS {
        without.push(stretch().await);
        let pages = OpenPages::open(coordinator.pages, 50).await;
        with.push(stretch().await);
        drop(pages);
    }
    (without, with)
}

/// A hundred workers of one slot, P = 10,000, four generations.
async fn peak_memory_mib() -> f64 {
    let coordinator = CoordinatorProcess::start();
    let workers = InstantWorkers::start(&coordinator, 100, 1);
    coordinator.submit(&experiment(SNES, 10_000, FOREVER)).await;
    workers.rounds(0, 4).await;
    coordinator.peak_memory_mib()
}

/// Time from the restart of a process that was killed after 1,000 generations to the arrival of the
/// first item at a worker. The worker tries to connect every millisecond.
async fn restart_s() -> f64 {
    let mut coordinator = CoordinatorProcess::start();
    let workers = InstantWorkers::start(&coordinator, 2, 8);
    coordinator.submit(&experiment(SNES, 100, FOREVER)).await;
    workers.rounds(1000, 1000).await;
    drop(workers);
    coordinator.kill();
    let workers = InstantWorkers::start(&coordinator, 2, 8);
    let started = coordinator.restart();
    let first = workers.first_round().await;
    (first.started - started).as_secs_f64()
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
