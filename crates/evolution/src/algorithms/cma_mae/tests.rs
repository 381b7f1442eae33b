//! CMA-MAE, step by step beside the package `ribs`, and its restarts.

use super::*;
use crate::{Genotype, algorithms::Algorithm};

#[derive(Deserialize)]
struct Fixture {
    start: Algorithm,
    generations: Vec<Step>,
}

/// A generation of one trial, and what follows from it.
#[derive(Deserialize)]
struct Step {
    genotypes: Vec<Genotype>,
    normals: Vec<Vec<f64>>,
    descriptors: Vec<Vec<f64>>,
    fitness: Vec<f64>,
    after: After,
    annealing: Found,
}

#[derive(Deserialize)]
struct After {
    cells: Vec<Vec<u32>>,
    genotypes: Vec<Genotype>,
    fitness: Vec<f64>,
}

#[derive(Deserialize)]
struct Found {
    values: Vec<f64>,
    statuses: Vec<u32>,
    /// Individuals of each emitter by their place in its share, best first.
    ranked: Vec<Vec<usize>>,
    thresholds: Vec<f64>,
}

fn assert_close(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-13, "{what}: {found} {expected}");
    }
}

#[test]
fn archive_thresholds_and_ranks_are_those_of_the_package_ribs() {
    let fixture = include_str!("../../../tests/fixtures/cma_mae.json");
    let Fixture { start, generations } = serde_json::from_str(fixture).unwrap();
    let Algorithm::SepCmaMae(mut state) = start else { panic!("another algorithm") };
    let threshold_min = state.thresholds[0];
    for (g, step) in (0..).zip(generations) {
        let Step { genotypes, normals, descriptors, fitness, after, annealing } = step;
        let fitness: Vec<Vec<f64>> = fitness.iter().map(|fitness| vec![*fitness]).collect();
        let told = Evaluations { fitness: &fitness, descriptors: &descriptors };
        let found: Vec<(usize, f64)> = state.improvements(told).into_iter().flatten().collect();
        let values: Vec<f64> = found.iter().map(|(_, by)| *by).collect();
        assert_close(&values, &annealing.values, "values");
        // 0: not added. 1: better than the cell's threshold. 2: in a cell that nobody had reached.
        let is_new = |cell: usize| state.thresholds[cell] == threshold_min;
        let status = |&(cell, by): &(usize, f64)| match by > 0.0 {
            true if is_new(cell) => 2,
            true => 1,
            false => 0,
        };
        assert_eq!(found.iter().map(status).collect::<Vec<u32>>(), annealing.statuses);

        let sample = Sample { uniforms: vec![0.0; 3], ..Sample::new(genotypes, normals) };
        let shares = state.shares(0, fitness.len());
        let mut emitters = state.emitters.clone();
        for ((emitter, share), ranked) in emitters.iter_mut().zip(shares).zip(&annealing.ranked) {
            let ranked: Vec<usize> = ranked.iter().map(|i| share.start + i).collect();
            emitter.learn(&sample, &ranked, &[]);
        }
        state.learn(g, &sample, told);
        assert_eq!(state.emitters, emitters, "generation {g}");
        assert_close(&state.thresholds, &annealing.thresholds, "thresholds");

        let axes = state.axes();
        let cell_of = |elite: &Elite| -> Vec<u32> {
            axes.iter().zip(elite.descriptors()).map(|(axis, value)| axis.cell(value)).collect()
        };
        let mut elites: Vec<(Vec<u32>, &Genotype, f64)> = state
            .elites()
            .into_iter()
            .map(|elite| (cell_of(elite), &elite.genotype, elite.fitness()))
            .collect();
        elites.sort_by(|a, b| a.0.cmp(&b.0));
        let expected = after.cells.into_iter().zip(&after.genotypes).zip(after.fitness);
        let expected: Vec<_> =
            expected.map(|((cell, genes), fitness)| (cell, genes, fitness)).collect();
        assert_eq!(elites, expected, "generation {g}");
    }
}

fn started(n_emitters: u32) -> Annealing<SepCmaMae> {
    let axes = [Axis { low: 0.0, high: 1.0, n_cells: 4 }];
    Annealing::start(&Params::default().with("emitters", n_emitters), 3, &axes)
}

fn stream(generation: u64) -> Stream {
    Stream::new(1, generation, 0, determinism::random::Purpose::Evolution, 0)
}

/// Tells fitness and descriptor of each individual of the next generation.
fn tell(
    state: &mut Annealing<SepCmaMae>,
    generation: u64,
    value: impl Fn(&Genotype) -> [f64; 2],
) -> Sample {
    let sample = state.sample(20, &mut stream(generation));
    let row = |at: usize| sample.genotypes.iter().map(|genes| vec![value(genes)[at]]).collect();
    let [fitness, descriptors]: [Vec<Vec<f64>>; 2] = [0, 1].map(row);
    let told = Evaluations { fitness: &fitness, descriptors: &descriptors };
    state.learn(generation, &sample, told);
    sample
}

#[test]
fn an_emitter_whose_individuals_are_all_alike_begins_anew_from_an_elite() {
    let mut state = started(2);
    tell(&mut state, 0, |genes| [genes[0], genes[1]]);
    let climbing = state.emitters.clone();
    assert!(climbing.iter().all(|emitter| emitter.mean() != Some(&[0.5; 3][..])));
    // Nobody exceeds a threshold by more than another, as all are in one cell.
    let sample = tell(&mut state, 1, |_| [-1.0, 0.3]);
    let elites = state.elites();
    for (emitter, uniform) in state.emitters.iter().zip(&sample.uniforms) {
        let elite = elites[(uniform * elites.len() as f64) as usize];
        assert_eq!(*emitter, SepCmaMae::from_mean(elite.genotype.clone(), state.sigma_init));
    }
}

#[test]
fn emitters_share_the_new_individuals_and_get_at_least_two() {
    let lens = |n_emitters, n_again, population_size| -> Vec<usize> {
        let shares = started(n_emitters).shares(n_again, population_size);
        assert_eq!((shares[0].start, shares[shares.len() - 1].end), (n_again, population_size));
        shares.iter().map(Range::len).collect()
    };
    assert_eq!(lens(3, 5, 20), [5, 5, 5]);
    assert_eq!(lens(3, 4, 20), [5, 5, 6]);
    assert_eq!(lens(5, 3, 10), [2, 2, 3]);
    assert_eq!(lens(5, 3, 4), [1]);
}

#[test]
fn numbers_that_are_not_finite_raise_no_threshold_and_rank_last() {
    let mut state = started(2);
    for generation in 0..30 {
        let strange = [f64::NAN, f64::INFINITY, f64::MAX, f64::MIN, 0.5];
        tell(&mut state, generation, |genes| {
            let nth = (genes[0] * 5.0) as usize % 5;
            [strange[nth], if genes[1] < 0.2 { f64::NAN } else { genes[2] }]
        });
        assert!(state.thresholds.iter().all(|threshold| threshold.is_finite()));
        let json = serde_json::to_string(&state).unwrap();
        assert!(!json.contains("null"), "{json}");
    }
    let before = state.clone();
    tell(&mut state, 30, |_| [f64::NAN, 0.5]);
    assert_eq!(state.thresholds, before.thresholds);
    assert_eq!(state.emitters, before.emitters, "nobody can be ranked");
}

#[test]
fn at_a_rate_of_zero_no_number_moves_a_threshold() {
    let mut state = started(1);
    state.archive_rate = 0.0;
    let before = state.thresholds.clone();
    state.raise(&[Some((0, f64::MAX)), Some((0, f64::MAX)), Some((1, 1.0))]);
    assert_eq!(state.thresholds, before);
}
