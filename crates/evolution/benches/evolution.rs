//! Measures the coordinator's work per generation, without fitness: ask and tell of 100 individuals
//! with 445 genes, the size of experiment A.

use divan::{Bencher, counter::ItemsCount};
use evolution::{Evolution, Generation, Params, Setup};

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
