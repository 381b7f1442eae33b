//! The operators' statistics and rules.

use determinism::random::Purpose;

use super::*;
use crate::{Population, ranking::ranking};

/// Parameters that differ from the defaults by these numbers, and a smaller
/// mutation.
fn params(numbers: &[(&str, f64)]) -> Params {
    let params = Params::default().with("mutation_sigma", 0.5);
    numbers.iter().fold(params, |params, &(key, value)| params.with(key, value))
}

fn rng(generation: u64) -> Stream {
    Stream::new(9, generation, 0, Purpose::Evolution, 0)
}

/// A generation of `n` individuals whose fitness is their index, and the next generation.
fn two_generations(params: &Params, n: usize) -> (Population, Population) {
    let mut ga = Ga::start(params, 4);
    let first = ga.sample(n, &mut rng(0));
    let fitness: Vec<f64> = (0..n).map(|i| i as f64).collect();
    ga.learn(&first, &ranking(&fitness), &fitness);
    (first.genotypes, ga.sample(n, &mut rng(1)).genotypes)
}

#[test]
fn the_first_generation_is_uniform() {
    let ga = Ga::start(&params(&[]), 100);
    let genes = ga.sample(100, &mut rng(0)).genotypes.concat();
    assert!(genes.iter().all(|gene| (0.0..1.0).contains(gene)));
    let mean = genes.iter().sum::<f64>() / 1e4;
    let variance = genes.iter().map(|g| (g - 0.5) * (g - 0.5)).sum::<f64>() / 1e4;
    assert!((mean - 0.5).abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.003);
}

#[test]
fn the_elite_survives_unchanged_and_in_order() {
    let params = params(&[("mutation_prob", 1.0)]);
    let (first, second) = two_generations(&params, 20);
    assert_eq!(second[..3], [first[19].clone(), first[18].clone(), first[17].clone()]);
    assert_eq!(second.len(), 20);
    assert!(second[3..].iter().all(|child| !first.contains(child)));
}

#[test]
fn without_crossover_and_mutation_children_are_selected_parents() {
    for n in [20, 21] {
        let params = params(&[("crossover_prob", 0.0), ("mutation_prob", 0.0)]);
        let (first, second) = two_generations(&params, n);
        assert!(second.iter().all(|child| first.contains(child)));
        let of_worst_third = second.iter().filter(|child| first[..n / 3].contains(child)).count();
        assert!(of_worst_third <= 3, "{of_worst_third}");
    }
}

#[test]
fn children_without_crossover_still_mutate() {
    let params = params(&[("crossover_prob", 0.0), ("mutation_prob", 1.0)]);
    let (first, second) = two_generations(&params, 21);
    assert!(second[3..].iter().all(|child| !first.contains(child)));
}

#[test]
fn an_unpaired_parent_is_copied() {
    let params =
        params(&[("crossover_prob", 1.0), ("mutation_prob", 0.0)]).with("num_elite", 2_u32);
    let (first, second) = two_generations(&params, 21);
    let unchanged = second[2..].iter().filter(|child| first.contains(child)).count();
    // A parent that was paired with itself is unchanged, too.
    let last = &second[20];
    assert!(first.contains(last) && unchanged < 6, "{unchanged}");
}

#[test]
fn crossover_happens_with_its_probability() {
    let params =
        params(&[("crossover_prob", 0.7), ("mutation_prob", 0.0)]).with("num_elite", 0_u32);
    let n = 20_000;
    let mut ga = Ga::start(&params, 1);
    let first = ga.sample(n, &mut rng(0));
    let fitness = vec![0.0; n];
    ga.learn(&first, &ranking(&fitness), &fitness);
    let mut genes: Vec<u64> = first.genotypes.concat().iter().map(|gene| gene.to_bits()).collect();
    genes.sort_unstable();
    let children = ga.sample(n, &mut rng(1)).genotypes.concat();
    // Children that are clipped to the bounds are new, too.
    let passed =
        children.iter().filter(|child| genes.binary_search(&child.to_bits()).is_ok()).count();
    let share = passed as f64 / n as f64;
    assert!((share - 0.3).abs() < 0.015, "{share}");
}

#[test]
fn children_are_clipped_to_the_unit_cube() {
    let params = params(&[("mutation_prob", 1.0), ("mutation_sigma", 10.0)]);
    let (_, second) = two_generations(&params, 100);
    let genes = second.concat();
    assert!(genes.iter().all(|gene| (0.0..=1.0).contains(gene)));
    assert!(genes.contains(&0.0) && genes.contains(&1.0));
}

#[test]
fn individuals_without_finite_fitness_are_neither_elite_nor_parents() {
    let params = params(&[("crossover_prob", 0.0), ("mutation_prob", 0.0)]);
    let mut ga = Ga::start(&params, 2);
    let first = ga.sample(6, &mut rng(0));
    let fitness = [f64::NAN, 1.0, f64::INFINITY, 2.0, f64::NEG_INFINITY, f64::NAN];
    ga.learn(&first, &ranking(&fitness), &fitness);
    let second = ga.sample(6, &mut rng(1)).genotypes;
    let finite = [first.genotypes[3].clone(), first.genotypes[1].clone()];
    assert_eq!(second[..2], finite);
    assert_eq!(second.len(), 6);
    assert!(second.iter().all(|child| finite.contains(child)));
}

#[test]
fn the_default_deviation_of_mutation_is_the_root_of_three_tenths() {
    assert_eq!(Params::default().value_of::<f64>(&mutation::SIGMA), 0.3_f64.sqrt());
}

#[test]
fn a_shuffle_makes_every_permutation_equally_often() {
    let mut counts = std::collections::BTreeMap::new();
    let mut rng = rng(0);
    for _ in 0..12_000 {
        let mut items = [0, 1, 2, 3];
        shuffle(&mut items, &mut rng);
        *counts.entry(items).or_insert(0) += 1;
    }
    assert_eq!(counts.len(), 24);
    assert!(counts.values().all(|&count: &i32| (count - 500).abs() < 90), "{counts:?}");
}
