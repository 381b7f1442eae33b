//! Lineages: children have the genes of the parents that a lineage names.

use super::*;
use crate::{Operator, Parent, Pedigree, Setup};

const D: usize = 12;

fn params(crossover: &str) -> Params {
    Params::default().with("crossover_operator", crossover).with("num_elite", 2u32)
}

/// Some generations of a GA: their genotypes, and the births of those after the first.
fn bred(crossover: &str, n_generations: u64) -> (Vec<Population>, Pedigree) {
    let setup =
        Setup { population_size: 15, seed: 5, params: params(crossover), ..Setup::new("GA", D) };
    let mut evolution = setup.start().unwrap();
    let mut pedigree = Pedigree::starting_at(0);
    let mut genotypes = Vec::new();
    for _ in 0..n_generations {
        let asked = evolution.ask();
        let [births]: [_; 1] = evolution.births().unwrap().try_into().unwrap();
        let mut told =
            Told::from_fitness(asked.genotypes.iter().map(|genes| vec![genes[0]]).collect());
        // An individual without finite fitness never becomes a parent.
        told.trial_fitness[4][0] = f64::NAN;
        genotypes.push(asked.genotypes);
        pedigree.push(births, &told);
        evolution.repeat(&told).unwrap();
    }
    (genotypes, pedigree)
}

#[test]
fn genes_come_from_the_named_parents() {
    for crossover in ["uniform", "onepoint", "multipoint", "blxalpha", "simulated_binary"] {
        let (genotypes, pedigree) = bred(crossover, 6);
        for individual in 0..15 {
            let lineage = pedigree.trace(individual);
            assert_eq!((lineage[0].generation, lineage[0].individual), (5, individual));
            assert_eq!(lineage[0].n_surviving, D);
            assert!(
                lineage.iter().all(|ancestor| ancestor.individual != 4 || ancestor.generation == 5)
            );
            for ancestor in &lineage {
                let genes = &genotypes[ancestor.generation as usize][ancestor.individual as usize];
                let birth = ancestor.birth.as_ref().unwrap();
                let n_kept: usize = birth.parents.iter().map(|parent| parent.n_genes).sum();
                assert_eq!(n_kept + birth.n_new, D, "{crossover}: {ancestor:?}");
                for &Parent { generation, individual, n_genes: n } in &birth.parents {
                    assert_eq!(generation, ancestor.generation - 1);
                    let of = &genotypes[generation as usize][individual as usize];
                    let n_same = genes.iter().zip(of).filter(|(a, b)| a == b).count();
                    assert!(n_same >= n, "{crossover}: {ancestor:?}");
                }
                if birth.operator == Operator::Elite {
                    assert_eq!(birth.parents[0].n_genes, D);
                }
                let focal = &genotypes[5][individual as usize];
                let n_same = focal.iter().zip(genes).filter(|(a, b)| a == b).count();
                assert!(n_same >= ancestor.n_surviving, "{crossover}: {ancestor:?}");
            }
            for generation in 0..5 {
                let of = lineage.iter().filter(|ancestor| ancestor.generation == generation);
                assert!(of.map(|ancestor| ancestor.n_surviving).sum::<usize>() <= D);
            }
        }
    }
}

#[test]
fn families_have_parents_of_the_pedigree_with_fitness_of_parent_and_child() {
    let setup = Setup { population_size: 15, params: params("uniform"), ..Setup::new("GA", D) };
    let mut evolution = setup.start().unwrap();
    let mut pedigree = Pedigree::starting_at(0);
    let mut before: Option<Told> = None;
    for _ in 0..4 {
        let asked = evolution.ask();
        let fitness = asked.genotypes.iter().map(|genes| vec![genes[0], genes[1]]);
        let mut told = Told::from_fitness(fitness.collect());
        told.trial_fitness[4][0] = f64::NAN;
        let [births]: [_; 1] = evolution.births().unwrap().try_into().unwrap();
        pedigree.push(births, &told);
        if let Some(before) = &before {
            let families = evolution.families(before, &told).unwrap();
            for (i, birth) in families.births[0].iter().enumerate() {
                let traced = &pedigree.trace(i as u32)[0];
                assert_eq!(traced.birth.as_ref(), Some(birth));
                assert_eq!(traced.fitness.to_bits(), families.children[i].to_bits());
                for parent in &birth.parents {
                    let trials = &before.trial_fitness[parent.individual as usize];
                    let mean = (trials[0] + trials[1]) / 2.0;
                    let found = families.parents[parent.individual as usize];
                    assert_eq!(found.to_bits(), mean.to_bits());
                }
            }
        }
        evolution.repeat(&told).unwrap();
        before = Some(told);
    }
    let distribution = Setup::new("SNES", D).start().unwrap();
    assert!(distribution.families(&Told::default(), &Told::default()).is_none());
}

#[test]
fn a_lineage_ends_where_its_pedigree_begins() {
    let (_, whole) = bred("uniform", 3);
    let first = whole.trace(0).last().unwrap().clone();
    assert_eq!((first.generation, first.birth.unwrap().operator), (0, Operator::First));
    let mut evolution = Setup { population_size: 9, ..Setup::new("GA", D) }.start().unwrap();
    let mut later = Pedigree::starting_at(1);
    for generation in 0..3 {
        let [births]: [_; 1] = evolution.births().unwrap().try_into().unwrap();
        let told = Told::from_fitness(evaluate(&evolution.ask().genotypes));
        if generation > 0 {
            later.push(births, &told);
        }
        evolution.repeat(&told).unwrap();
    }
    let lineage = later.trace(8);
    assert!(lineage.iter().all(|ancestor| ancestor.birth.is_some() == (ancestor.generation == 2)));
}

#[test]
fn individuals_have_parents_if_the_algorithm_keeps_individuals() {
    for algorithm in by_fitness() {
        let evolution = Setup::new(algorithm.name, D).start().unwrap();
        let keeps_individuals = algorithm.keeps == Keeps::Population;
        assert_eq!(evolution.births().is_some(), keeps_individuals, "{}", algorithm.name);
    }
}
