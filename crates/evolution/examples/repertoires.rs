//! Compares the algorithms of repertoires on three functions: QD score and coverage after a number
//! of evaluations, as median and range of five seeds.
//!
//! `cargo run -p evolution --example repertoires -- [INDIVIDUALS] [EVALUATIONS] [GENES]`;
//! `crates/evolution/examples/ribs_repertoires.py` does the same with the package `ribs`.

use std::f64::consts::{PI, TAU};

use evolution::{Axis, End, Params, Setup, Told};

const SEEDS: [u64; 5] = [0, 1, 2, 3, 4];

/// Cells of the grid along each of the two descriptors.
const CELLS: u32 = 64;

/// Fitness from 0 to 100, and two descriptors in \[0, 1\], of genes.
type Function = fn(&[f64]) -> [f64; 3];

const FUNCTIONS: [(&str, Function); 3] = [
    ("sphere, linear projection", |genes| projected(genes, |x| x * x)),
    ("Rastrigin, linear projection", |genes| {
        projected(genes, |x| x * x + 10.0 - 10.0 * libm::cos(TAU * x))
    }),
    ("arm", arm),
];

/// The sum of `f` over coordinates in \[-5.12, 5.12\], whose optimum is at 40 % of the range on
/// both sides of 0; the descriptors are the means of its halves (Fontaine et al. 2020).
fn projected(genes: &[f64], f: impl Fn(f64) -> f64) -> [f64; 3] {
    let optimum = 0.4 * 5.12;
    let sum: f64 = genes.iter().map(|gene| f(10.24 * gene - 5.12 - optimum)).sum();
    let worst = genes.len() as f64 * f(-5.12 - optimum);
    let (first, second) = genes.split_at(genes.len() / 2);
    let mean = |genes: &[f64]| genes.iter().sum::<f64>() / genes.len() as f64;
    [100.0 * (1.0 - sum / worst), mean(first), mean(second)]
}

/// The end of an arm with joints of equal length, which turn by up to half a circle; fitter if
/// their angles are alike (Vassiliades, Mouret 2018).
fn arm(genes: &[f64]) -> [f64; 3] {
    let n = genes.len() as f64;
    let mean = genes.iter().sum::<f64>() / n;
    let variance = genes.iter().map(|gene| (gene - mean) * (gene - mean)).sum::<f64>() / n;
    let (mut angle, mut x, mut y) = (0.0, 0.0, 0.0);
    for gene in genes {
        angle += TAU * gene - PI;
        x += libm::cos(angle);
        y += libm::sin(angle);
    }
    [100.0 * (1.0 - 4.0 * variance), 0.5 + x / n / 2.0, 0.5 + y / n / 2.0]
}

/// The algorithms as for tasks without chance, each with as many places as the grid has cells.
fn variants() -> Vec<(&'static str, Params)> {
    let plain = || Params::default().with("reevaluated", 0.0);
    vec![
        ("MAP-Elites", plain().with("depth", 1_u32)),
        ("DNS", plain().with("elites", CELLS * CELLS)),
        ("novelty", plain().with("elites", CELLS * CELLS)),
        ("CMA-MAE", plain().with("depth", 1_u32)),
        ("sep-CMA-MAE", plain().with("depth", 1_u32)),
    ]
}

/// Mean fitness of all cells, where an empty one counts 0, and the share that is not empty.
fn run(setup: &Setup, function: Function, n_evaluations: u32) -> [f64; 2] {
    let mut evolution = setup.start().expect("the setup is sound");
    for _ in 0..n_evaluations / setup.population_size {
        let generation = evolution.ask();
        let value = |genes: &Vec<f64>| function(genes).to_vec();
        let values: Vec<Vec<f64>> = generation.genotypes.iter().map(value).collect();
        evolution.tell(generation, &Told::from_values(&values, 2)).expect("fitness is finite");
    }
    let end = End::default();
    let repertoire = evolution.elites(&end).expect("the algorithm has a repertoire");
    let best = repertoire.by_cell();
    let n_cells = f64::from(CELLS * CELLS);
    [
        best.iter().map(|elite| elite.fitness).sum::<f64>() / n_cells,
        100.0 * best.len() as f64 / n_cells,
    ]
}

/// Median, least and largest.
fn summary(mut values: [f64; 5]) -> String {
    values.sort_by(f64::total_cmp);
    format!("{:.1} ({:.1} to {:.1})", values[2], values[0], values[4])
}

fn main() {
    let mut arguments =
        std::env::args().skip(1).map(|argument| argument.parse().expect("a whole number"));
    let population_size: u32 = arguments.next().unwrap_or(100);
    let n_evaluations: u32 = arguments.next().unwrap_or(100_000);
    let n_genes = arguments.next().unwrap_or(20) as usize;
    println!("{n_genes} genes, {population_size} individuals, {n_evaluations} evaluations");
    for (name, function) in FUNCTIONS {
        println!("\n{name}\n| algorithm | QD score | coverage, % |\n|---|---|---|");
        for (algorithm, params) in variants() {
            let setup = |seed| Setup {
                population_size,
                seed,
                params: params.clone(),
                axes: vec![Axis { low: 0.0, high: 1.0, n_cells: CELLS }; 2],
                ..Setup::new(algorithm, n_genes)
            };
            let runs = SEEDS.map(|seed| run(&setup(seed), function, n_evaluations));
            let [score, coverage] = [0, 1].map(|at| summary(runs.map(|run| run[at])));
            println!("| {algorithm} | {score} | {coverage} |");
        }
    }
}
