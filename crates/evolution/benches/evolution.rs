//! Measures the coordinator's work per generation, without fitness: ask and tell of 100 individuals
//! with 445 genes, the size of experiment A; for repertoires and fronts of 1,000 individuals, with
//! a full grid of 64 x 64 cells or one aim beside fitness.

use std::cell::RefCell;

use divan::{Bencher, counter::ItemsCount};
use evolution::{Axis, Direction, Evolution, Generation, Params, Setup, Told};

const POPULATION_SIZE: u32 = 100;
const N_GENES: usize = 445;
const N_TRIALS: usize = 5;

fn main() {
    divan::main();
}

#[divan::bench]
fn ga(bencher: Bencher) {
    generation(bencher, "GA", Params::default().with("mutation_sigma", 0.5));
}

#[divan::bench]
fn snes(bencher: Bencher) {
    generation(bencher, "SNES", Params::default());
}

#[divan::bench]
fn openai_es(bencher: Bencher) {
    generation(bencher, "openaiES", Params::default());
}

#[divan::bench]
fn pgpe(bencher: Bencher) {
    generation(bencher, "PGPE", Params::default());
}

#[divan::bench]
fn sep_cma_es(bencher: Bencher) {
    generation(bencher, "sep-CMA-ES", Params::default());
}

#[divan::bench(sample_count = 10)]
fn cma_es(bencher: Bencher) {
    generation(bencher, "CMA-ES", Params::default());
}

#[divan::bench(sample_count = 10)]
fn xnes(bencher: Bencher) {
    generation(bencher, "xNES", Params::default());
}

/// Tells a generation and asks for the next.
fn generation(bencher: Bencher, algorithm: &str, params: Params) {
    let setup = Setup {
        params,
        population_size: POPULATION_SIZE,
        seed: 1,
        ..Setup::new(algorithm, N_GENES)
    };
    let mut evolution = setup.start().expect("the parameters are right");
    // The first generations are special: identity matrices, no parents.
    let mut generation = evolution.ask();
    for _ in 0..2 {
        generation = step(&mut evolution, generation);
    }
    bencher
        .counter(ItemsCount::new(POPULATION_SIZE))
        .with_inputs(|| (evolution.clone(), generation.clone()))
        .bench_values(|(mut evolution, generation)| step(&mut evolution, generation));
}

fn step(evolution: &mut Evolution, generation: Generation) -> Generation {
    let sphere = |genes: &Vec<f64>| -genes.iter().map(|g| (g - 0.3) * (g - 0.3)).sum::<f64>();
    let trial_fitness: Vec<Vec<f64>> =
        generation.genotypes.iter().map(|genes| vec![sphere(genes); N_TRIALS]).collect();
    evolution.tell(generation, &trial_fitness).expect("all fitness is finite");
    evolution.ask()
}

#[divan::bench(args = [12, 100, 455], sample_count = 100)]
fn map_elites(bencher: Bencher, n_genes: usize) {
    repertoire(bencher, "MAP-Elites", n_genes);
}

#[divan::bench(args = [12, 100, 455], sample_count = 20)]
fn dns(bencher: Bencher, n_genes: usize) {
    repertoire(bencher, "DNS", n_genes);
}

#[divan::bench(args = [12, 100, 455], sample_count = 20)]
fn novelty(bencher: Bencher, n_genes: usize) {
    repertoire(bencher, "novelty", n_genes);
}

#[divan::bench(args = [12, 100, 455], sample_count = 20)]
fn sep_cma_mae(bencher: Bencher, n_genes: usize) {
    repertoire(bencher, "sep-CMA-MAE", n_genes);
}

#[divan::bench(args = [12, 100], sample_count = 10)]
fn cma_mae(bencher: Bencher, n_genes: usize) {
    repertoire(bencher, "CMA-MAE", n_genes);
}

#[divan::bench(args = [12, 30, 100, 455], sample_count = 100)]
fn nsga2(bencher: Bencher, n_genes: usize) {
    let aims = vec![Direction::Minimise];
    described_generation(bencher, Setup { aims, ..Setup::new("NSGA-II", n_genes) });
}

/// As [`generation`], generation after generation of a run that has filled the grid.
fn repertoire(bencher: Bencher, algorithm: &str, n_genes: usize) {
    let axes = vec![Axis { low: 0.0, high: 1.0, n_cells: 64 }; 2];
    described_generation(bencher, Setup { axes, ..Setup::new(algorithm, n_genes) });
}

/// As [`generation`], with elites of many generations.
fn described_generation(bencher: Bencher, setup: Setup) {
    const SIZE: u32 = 1000;
    let setup = Setup { population_size: SIZE, seed: 1, ..setup };
    let mut evolution = setup.start().expect("the parameters are right");
    let n_descriptors = evolution.n_descriptors();
    for _ in 0..40 {
        let told = described(&evolution.ask(), n_descriptors, 1);
        evolution.tell(evolution.ask(), &told).expect("all fitness is finite");
    }
    let run = RefCell::new((Some(evolution.ask()), evolution));
    bencher
        .counter(ItemsCount::new(SIZE))
        .with_inputs(|| {
            let run = run.borrow();
            described(run.0.as_ref().expect("it was asked for"), n_descriptors, N_TRIALS)
        })
        .bench_local_values(|told| {
            let (generation, evolution) = &mut *run.borrow_mut();
            let asked = generation.take().expect("it was asked for");
            evolution.tell(asked, &told).expect("all fitness is finite");
            *generation = Some(evolution.ask());
            told
        });
}

/// Descriptors all over the grid, or values of an aim, which differ from generation to generation.
fn described(generation: &Generation, n_descriptors: usize, n_trials: usize) -> Told {
    let shift = generation.index as f64 * 0.618;
    let row = |genes: &Vec<f64>| {
        let place = |gene: f64| (1000.0 * gene + shift).fract();
        let values = [genes[0], place(genes[1]), place(genes[2])];
        values[..=n_descriptors].repeat(n_trials)
    };
    let values: Vec<Vec<f64>> = generation.genotypes.iter().map(row).collect();
    Told::from_values(&values, n_descriptors)
}
