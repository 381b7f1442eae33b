//! Measures the coordinator's work per generation, without fitness: ask and tell of 100 individuals
//! with 445 genes, the size of experiment A; for repertoires of 1,000 individuals, with a full grid
//! of 64 x 64 cells.

use divan::{Bencher, counter::ItemsCount};
use evolution::{Axis, Evolution, Generation, Params, Setup, Told};

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

/// As [`generation`], after enough generations to fill the grid.
fn repertoire(bencher: Bencher, algorithm: &str, n_genes: usize) {
    const SIZE: u32 = 1000;
    let axes = vec![Axis { low: 0.0, high: 1.0, n_cells: 64 }; 2];
    let setup = Setup { population_size: SIZE, seed: 1, axes, ..Setup::new(algorithm, n_genes) };
    let mut evolution = setup.start().expect("the parameters are right");
    for _ in 0..40 {
        let told = described(&evolution, 1);
        evolution.tell(evolution.ask(), &told).expect("all fitness is finite");
    }
    bencher
        .counter(ItemsCount::new(SIZE))
        .with_inputs(|| {
            let generation = evolution.ask();
            (evolution.clone(), generation, described(&evolution, N_TRIALS))
        })
        .bench_values(|(mut evolution, generation, told)| {
            evolution.tell(generation, &told).expect("all fitness is finite");
            (evolution.ask(), evolution)
        });
}

/// Behaviours all over the grid, which differ from generation to generation.
fn described(evolution: &Evolution, n_trials: usize) -> Told {
    let shift = evolution.n_generations() as f64 * 0.618;
    let row = |genes: &Vec<f64>| {
        let place = |gene: f64| (1000.0 * gene + shift).fract();
        [genes[0], place(genes[1]), place(genes[2])].repeat(n_trials)
    };
    Told::from_values(&evolution.ask().genotypes.iter().map(row).collect::<Vec<_>>(), 2)
}
