//! Evolves fronts of three functions with known fronts, and prints their hypervolumes, as median
//! and range of five seeds; then the same with noise, where elites are not what they seem.
//!
//! `cargo run -p evolution --example fronts`; `crates/evolution/examples/pymoo_fronts.py` prints
//! the first table with the package `pymoo`.

use std::f64::consts::PI;

use determinism::random::{Purpose, Stream};
use evolution::{Direction, End, Evolution, Params, Setup, Told};

const SEEDS: [u64; 5] = [0, 1, 2, 3, 4];
const N_GENES: usize = 30;
const N_INDIVIDUALS: u32 = 100;
const BUDGETS: [u64; 2] = [10_000, 25_000];
/// The point up to which volume counts, as costs.
const REFERENCE: f64 = 1.1;
/// Standard deviation of the noise of both values.
const NOISE: f64 = 0.1;

/// Two values to minimise (Zitzler, Deb, Thiele 2000).
type Function = fn(&[f64]) -> [f64; 2];

const FUNCTIONS: [(&str, Function); 3] = [
    ("ZDT1", |x| zdt(x, |f, g| 1.0 - (f / g).sqrt())),
    ("ZDT2", |x| zdt(x, |f, g| 1.0 - (f / g) * (f / g))),
    ("ZDT3", |x| zdt(x, |f, g| 1.0 - (f / g).sqrt() - f / g * libm::sin(10.0 * PI * f))),
];

fn zdt(x: &[f64], shape: fn(f64, f64) -> f64) -> [f64; 2] {
    let g = 1.0 + 9.0 * x[1..].iter().sum::<f64>() / (x.len() - 1) as f64;
    [x[0], g * shape(x[0], g)]
}

fn started(seed: u64, reevaluated: f64) -> Evolution {
    let setup = Setup {
        population_size: N_INDIVIDUALS,
        seed,
        aims: vec![Direction::Minimise],
        params: Params::default().with("reevaluated", reevaluated),
        ..Setup::new("NSGA-II", N_GENES)
    };
    setup.start().expect("the setup is sound")
}

/// Evolves for a number of evaluations. Fitness is the first value, negative.
fn evolve(evolution: &mut Evolution, function: Function, n_evaluations: u64, noise: f64) {
    for generation in 0..n_evaluations / u64::from(N_INDIVIDUALS) {
        let asked = evolution.ask();
        let mut rng = Stream::new(1, generation, 0, Purpose::SensorNoise, 0);
        let mut row = |genes: &Vec<f64>| {
            let [first, second] = function(genes).map(|value| value + noise * rng.normal());
            vec![-first, second]
        };
        let values: Vec<Vec<f64>> = asked.genotypes.iter().map(&mut row).collect();
        let told = Told::from_values(&values, 1);
        evolution.tell(asked, &told).expect("all values are finite");
    }
}

/// Hypervolume and share of elites that stay, by values without noise: the elites are judged by
/// them.
fn judged(evolution: &Evolution, function: Function) -> (f64, f64) {
    let elites = |genes: &[f64]| {
        let [first, second] = function(genes);
        vec![-first, second]
    };
    let before = End::default();
    let front = evolution.front(&before).expect("NSGA-II has a front");
    let elites = front.elites.iter().map(|elite| elites(elite.genotype)).collect();
    let end = End { elites, ..End::default() };
    let front = evolution.front(&end).expect("NSGA-II has a front");
    let figures = front.figures(Some(&[-REFERENCE, REFERENCE])).expect("all values are finite");
    (figures.hypervolume, figures.stay.unwrap_or(0.0))
}

/// The hypervolume by which the front seems to be good.
fn seeming(evolution: &Evolution) -> f64 {
    let before = End::default();
    let front = evolution.front(&before).expect("NSGA-II has a front");
    front.figures(Some(&[-REFERENCE, REFERENCE])).map_or(0.0, |figures| figures.hypervolume)
}

/// "0.85 (0.84 to 0.86)".
fn summary(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let [low, high] = [0, values.len() - 1].map(|i| values[i]);
    format!("{:.3} ({low:.3} to {high:.3})", values[values.len() / 2])
}

fn main() {
    for (name, function) in FUNCTIONS {
        let volumes = BUDGETS.map(|budget| {
            let run = |seed| {
                let mut evolution = started(seed, 0.0);
                evolve(&mut evolution, function, budget, 0.0);
                judged(&evolution, function).0
            };
            summary(SEEDS.map(run).to_vec())
        });
        println!("| {name} | {} |", volumes.join(" | "));
    }
    for (name, function) in FUNCTIONS {
        for reevaluated in [0.0, 0.25, 0.5] {
            let runs = SEEDS.map(|seed| {
                let mut evolution = started(seed, reevaluated);
                evolve(&mut evolution, function, BUDGETS[1], NOISE);
                let (volume, stay) = judged(&evolution, function);
                [seeming(&evolution), volume, stay]
            });
            let columns = [0, 1, 2].map(|i| summary(runs.iter().map(|run| run[i]).collect()));
            println!("| {name}, noise, {reevaluated} | {} |", columns.join(" | "));
        }
    }
}
