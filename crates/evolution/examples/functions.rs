//! Compares the algorithms on five functions: the distance from the maximum after a number of
//! evaluations, as median and range of five seeds.
//!
//! `cargo run -p evolution --example functions -- [INDIVIDUALS] [EVALUATIONS] [GENES]`;
//! `crates/evolution/examples/cma_functions.py` does the same with the package `cma`.

use std::f64::consts::TAU;

use determinism::random::{Purpose, Stream};
use evolution::{Params, Setup};

const SEEDS: [u64; 5] = [0, 1, 2, 3, 4];

/// A function to minimise, of coordinates in \[-5, 5\]; its minimum is 0.
type Function = fn(&[f64]) -> f64;

const FUNCTIONS: [(&str, Function); 5] = [
    ("sphere", sphere),
    ("ellipsoid", |x| {
        let weight = |i: usize| libm::pow(1e6, i as f64 / (x.len() - 1) as f64);
        x.iter().enumerate().map(|(i, x)| weight(i) * (x - 1.5) * (x - 1.5)).sum()
    }),
    ("Rosenbrock", |x| {
        let step = |pair: &[f64]| {
            let bend = pair[1] - pair[0] * pair[0];
            100.0 * bend * bend + (1.0 - pair[0]) * (1.0 - pair[0])
        };
        x.windows(2).map(step).sum()
    }),
    ("Rastrigin", |x| {
        let wave = |z: f64| z * z - 10.0 * libm::cos(TAU * z) + 10.0;
        x.iter().map(|x| wave(x - 1.5)).sum()
    }),
    (NOISY, sphere),
];

/// The function to which every evaluation adds a normal number of standard deviation 1. The table
/// has values without this noise.
const NOISY: &str = "noisy sphere";

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| (x - 1.5) * (x - 1.5)).sum()
}

fn params(values: &[(&str, f64)]) -> Params {
    values.iter().fold(Params::default(), |params, (key, value)| params.with(key, *value))
}

/// The algorithms with their defaults, and with other parameters.
fn variants(n_genes: usize) -> Vec<(String, Params)> {
    let d = n_genes as f64;
    let snes = (3.0 + libm::log(d)) / (5.0 * d.sqrt());
    let xnes = 3.0 * snes / d;
    let plain = [
        ("GA", vec![]),
        ("GA", vec![("mutation_sigma", 0.1)]),
        ("GA", vec![("mutation_sigma", 0.03)]),
        ("SNES", vec![]),
        ("SNES", vec![("eta_sigma", 2.0 * snes)]),
        ("xNES", vec![]),
        ("xNES", vec![("eta_sigma", snes), ("eta_B", xnes)]),
        // The rates of `"rates": "fast"`.
        ("xNES", vec![("eta_sigma", snes), ("eta_B", 2.0 * xnes)]),
        ("CMA-ES", vec![]),
        ("sep-CMA-ES", vec![]),
        ("openaiES", vec![]),
        ("openaiES", vec![("sigma", 0.03), ("learning_rate", 0.01)]),
        ("openaiES", vec![("sigma", 0.02), ("learning_rate", 0.005)]),
        ("PGPE", vec![]),
        ("PGPE", vec![("max_speed", 0.01)]),
    ]
    .map(|(name, values): (&str, Vec<(&str, f64)>)| (name.to_owned(), params(&values)));
    let restarts =
        ["ipop", "bipop"].map(|name| ("CMA-ES".to_owned(), params(&[]).with("restarts", name)));
    plain.into_iter().chain(restarts).collect()
}

/// Distances from the maximum: the champion's and, if the algorithm has a distribution, its mean's.
fn run(
    setup: &Setup,
    (name, function): (&str, Function),
    n_evaluations: u32,
) -> (f64, Option<f64>) {
    let of_genes = |genes: &[f64]| {
        let x: Vec<f64> = genes.iter().map(|gene| 10.0 * gene - 5.0).collect();
        function(&x)
    };
    let scale = if name == NOISY { 1.0 } else { 0.0 };
    let mut evolution = setup.start().expect("the setup is sound");
    for _ in 0..n_evaluations / setup.population_size {
        let generation = evolution.ask();
        let mut noise = Stream::new(setup.seed, generation.index, 0, Purpose::Script, 0);
        let value = |genes: &Vec<f64>| vec![-of_genes(genes) - scale * noise.normal()];
        let fitness: Vec<Vec<f64>> = generation.genotypes.iter().map(value).collect();
        evolution.tell(generation, &fitness).expect("fitness is finite");
    }
    let champion = evolution.champion().expect("there was a generation");
    (of_genes(&champion.genotype), evolution.mean().map(|genes| of_genes(&genes)))
}

/// Median, least and largest.
fn summary(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values[0], values[values.len() - 1]);
    format!("{:.1e} ({low:.1e} to {high:.1e})", values[values.len() / 2])
}

fn main() {
    let mut arguments =
        std::env::args().skip(1).map(|argument| argument.parse().expect("a whole number"));
    let population_size: u32 = arguments.next().unwrap_or(20);
    let n_evaluations: u32 = arguments.next().unwrap_or(20_000);
    let n_genes = arguments.next().unwrap_or(20) as usize;
    println!("{n_genes} genes, {population_size} individuals, {n_evaluations} evaluations");
    for function in FUNCTIONS {
        println!(
            "\n{}\n| algorithm | champion | mean of the distribution |\n|---|---|---|",
            function.0
        );
        for (algorithm, params) in variants(n_genes) {
            let keys: Vec<String> =
                params.iter().map(|(key, value)| format!(" {key}={value}")).collect();
            let setup = |seed| Setup {
                population_size,
                seed,
                params: params.clone(),
                ..Setup::new(&algorithm, n_genes)
            };
            let runs = SEEDS.map(|seed| run(&setup(seed), function, n_evaluations));
            let mean: Option<Vec<f64>> = runs.iter().map(|run| run.1).collect();
            let mean = mean.map_or_else(|| "-".to_owned(), summary);
            let champion = summary(runs.iter().map(|run| run.0).collect());
            println!("| {algorithm}{} | {champion} | {mean} |", keys.concat());
        }
    }
}
