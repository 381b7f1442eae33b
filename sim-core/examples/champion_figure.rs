//! Tests whether the reported fitness of champions is honest: makes many small runs, and compares
//! each report with 10,000 fresh trials of its champion:
//!
//! ```sh
//! cargo run --release -p sim-core --example champion_figure           # 200 runs of each task
//! ```
//!
//! The tasks are a reduced quickstart, and a cheap fitness that is bounded and skewed, with a rare
//! tail near 0. For each task, the example prints the mean error of the judgement and of the mean
//! that selected the champion, with their standard errors. It also prints how often the 95 %
//! interval contains the value on fresh trials. docs/notebook/2026-11-algorithms.md has the
//! results.

use std::{
    env,
    error::Error,
    ops::Range,
    sync::atomic::{AtomicU64, Ordering},
    thread,
};

use determinism::random::{Purpose, Stream, TrialSet};
use evolution::{ALGORITHMS, Evolution, HeldOut, Population, Setup};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

/// Sets of fresh trials, and trials in each.
const N_FRESH_SETS: u64 = 10;
const N_FRESH_TRIALS: u32 = 1_000;
const N_GENERATIONS: u64 = 20;
const CHAMPION_EVERY: u64 = 5;
const N_TRIALS: u32 = 3;
/// The defaults of experiment files.
const N_HELD_OUT_TRIALS: u32 = 50;
const N_JUDGEMENT_TRIALS: u32 = 200;

fn main() -> Result<(), Box<dyn Error>> {
    let n_runs = env::args().nth(1).map_or(Ok(200), |text| text.parse())?;
    let mut file: serde_json::Value =
        serde_json::from_str(include_str!("../../configs/quickstart.json"))?;
    file["algorithm"]["population_size"] = 16.into();
    file["algorithm"]["evaluation_steps"] = 50.into();
    report("quickstart, cut down", n_runs, |seed| {
        let mut file = file.clone();
        file["seed"] = seed.into();
        let (config, _) = ExperimentConfig::from_json(&file.to_string(), "", ALGORITHMS)
            .expect("the shipped file is valid");
        let simulation = Simulation::compile(&config).expect("the shipped file is valid");
        let segments = simulation.population_segments();
        let evolution = Evolution::new(&config, segments, sim_core::FINGERPRINT);
        run(evolution, |genotype, trial_set, trials| {
            simulation
                .evaluate(genotype, trial_set, trials)
                .expect("the world has room for all robots")
        })
    });
    report("skewed, with a rare tail", n_runs, |seed| {
        let setup = Setup { seed, ..Setup::new("SNES", 5) };
        let evolution = setup.start().expect("the setup is valid");
        run(evolution, |genotype, trial_set, trials| {
            trials.map(|trial| synthetic(seed, genotype, trial_set, trial)).collect()
        })
    });
    Ok(())
}

/// Fitness in \[0, 1\]: close to the quality of the genotype, and near 0 in one trial of 25.
fn synthetic(seed: u64, genotype: &[f64], trial_set: TrialSet, trial: u32) -> f64 {
    let mut stream = Stream::new(seed, trial_set, trial.into(), Purpose::Reception, 0);
    let distance: f64 = genotype.iter().map(|gene| (gene - 0.3) * (gene - 0.3)).sum();
    let (luck, fails) = (stream.uniform(), stream.uniform() < 0.04);
    if fails { 0.05 * luck } else { (1.0 - distance).max(0.0) * (1.0 - 0.3 * luck * luck * luck) }
}

/// The estimates of a run's champion.
#[derive(Debug, Clone, Copy, Default)]
struct Figures {
    judged: f64,
    interval: [f64; 2],
    /// Half the width of the normal approximation, for comparison.
    normal: f64,
    selection: f64,
    fresh: f64,
    n_selection_trials: u64,
}

/// Makes a run from its first generation to its judgement, as `coordinator/src/runs/round.rs` does,
/// and then evaluates its champion on fresh trials.
fn run(
    mut evolution: Evolution,
    evaluate: impl Fn(&[f64], TrialSet, Range<u32>) -> Vec<f64>,
) -> Figures {
    let evaluate_all = |genotypes: Population, trial_set, n_trials| -> Vec<Vec<f64>> {
        genotypes.iter().map(|genotype| evaluate(genotype, trial_set, 0..n_trials)).collect()
    };
    let mut n_selection_trials = 0;
    while evolution.n_generations() < N_GENERATIONS {
        let generation = evolution.ask();
        let genotypes = Population::clone(&generation.genotypes);
        let fitness = evaluate_all(genotypes, generation.index.into(), N_TRIALS);
        evolution.tell(generation, &fitness).expect("fitness is finite");
        if !evolution.n_generations().is_multiple_of(CHAMPION_EVERY) {
            continue;
        }
        let mut round = evolution.reevaluation().expect("there has been a generation");
        while !round.is_over() {
            let fitness = evaluate_all(round.genotypes(), round.trial_set(), N_HELD_OUT_TRIALS);
            n_selection_trials += fitness.len() as u64 * u64::from(N_HELD_OUT_TRIALS);
            round.learn(&fitness);
        }
        evolution.set_champion(&round);
    }
    let judgement = evolution.judgement().expect("there is a champion");
    let fitness = evaluate_all(judgement.genotypes(), judgement.trial_set(), N_JUDGEMENT_TRIALS);
    let (champion, _) = judgement.decide(&fitness);
    let judged = champion.judged.expect("fitness is finite");
    // The trials of generations beyond the run are fresh.
    let fresh: Vec<f64> = (N_GENERATIONS..N_GENERATIONS + N_FRESH_SETS)
        .flat_map(|generation| evaluate(&champion.genotype, generation.into(), 0..N_FRESH_TRIALS))
        .collect();
    Figures {
        judged: judged.mean.get(),
        interval: [judged.low.get(), judged.high.get()],
        normal: HeldOut::from_values(&fitness[0], 0).expect("fitness is finite").ci95.get(),
        selection: champion.held_out.expect("it was compared").mean.get(),
        fresh: mean(&fresh),
        n_selection_trials,
    }
}

/// Makes runs with seeds 0, 1, ... on all cores, and prints their figures.
fn report(task: &str, n_runs: u64, run: impl Fn(u64) -> Figures + Sync) {
    let next = AtomicU64::new(0);
    let worker = || {
        let mut done = Vec::new();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= n_runs {
                return done;
            }
            done.push((seed, run(seed)));
        }
    };
    let n_threads = thread::available_parallelism().map_or(1, usize::from);
    let mut runs: Vec<(u64, Figures)> = thread::scope(|scope| {
        let threads: Vec<_> = (0..n_threads).map(|_| scope.spawn(worker)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("runs end")).collect()
    });
    runs.sort_by_key(|(seed, _)| *seed);
    let per_run = |value: fn(&Figures) -> f64| -> Vec<f64> {
        runs.iter().map(|(_, figures)| value(figures)).collect()
    };
    let covered = per_run(|figures| {
        f64::from((figures.interval[0]..=figures.interval[1]).contains(&figures.fresh))
    });
    let normal =
        per_run(|figures| f64::from((figures.judged - figures.fresh).abs() <= figures.normal));
    let below = per_run(|figures| f64::from(figures.fresh < figures.interval[0]));
    println!(
        "{task}: {n_runs} runs, {} fresh trials each",
        N_FRESH_SETS * u64::from(N_FRESH_TRIALS)
    );
    println!("  fitness on fresh trials        {}", with_error(&per_run(|figures| figures.fresh)));
    println!(
        "  error of the judgement         {}",
        with_error(&per_run(|figures| figures.judged - figures.fresh))
    );
    println!(
        "  error of the selecting mean    {}",
        with_error(&per_run(|figures| figures.selection - figures.fresh))
    );
    println!(
        "  width of the 95 % interval     {:.4}",
        mean(&per_run(|figures| figures.interval[1] - figures.interval[0]))
    );
    println!("  intervals that cover           {:.1} %", 100.0 * mean(&covered));
    println!("  ... mean +- 1.96 s / sqrt(n)   {:.1} %", 100.0 * mean(&normal));
    println!("  ... that lie too high          {:.1} %", 100.0 * mean(&below));
    println!(
        "  held-out trials per run        {:.0}",
        mean(&per_run(|figures| figures.n_selection_trials as f64))
    );
}

fn with_error(values: &[f64]) -> String {
    let (n, mean) = (values.len() as f64, mean(values));
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    format!("{mean:+.5}, standard error {:.5}", (squares / (n - 1.0) / n).sqrt())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
