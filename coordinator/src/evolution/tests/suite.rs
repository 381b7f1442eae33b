//! What holds for every algorithm with every operator.

use serde_json::Value;
use sim_core::config::{
    CmaEsParams, CrossoverOperator, GaParams, MatingOperator, MutationOperator, OpenAiEsParams,
    SelectionOperator, XnesParams,
};

use super::*;

pub const GA: GaParams = GaParams {
    selection_operator: SelectionOperator::Tournament,
    tournament_size: 3,
    mating_operator: MatingOperator::Random,
    crossover_operator: CrossoverOperator::BlxAlpha,
    alpha: 0.5,
    crossover_prob: 0.9,
    mutation_operator: MutationOperator::Gaussian,
    mutation_prob: 0.05,
    mutation_sigma: 0.1,
    num_elite: 3,
};
pub const XNES: XnesParams =
    XnesParams { eta_mu: 1.0, eta_sigma: None, eta_b: None, mu_init: 0.5, sigma_init: 0.2 };
pub const CMA_ES: CmaEsParams = CmaEsParams { mu_init: 0.5, sigma_init: 0.2 };
pub const OPENAI_ES: OpenAiEsParams = OpenAiEsParams {
    mu_init: 0.5,
    sigma: 0.1,
    learning_rate: 0.02,
    beta1: 0.9,
    beta2: 0.999,
    weight_decay: 0.0,
};

/// An algorithm's name and parameters.
type Variant = (AlgorithmName, AlgorithmParams);

fn evolution_strategies() -> Vec<Variant> {
    vec![
        (AlgorithmName::Snes, AlgorithmParams::Snes(SNES)),
        (AlgorithmName::Xnes, AlgorithmParams::Xnes(XNES)),
        (AlgorithmName::CmaEs, AlgorithmParams::CmaEs(CMA_ES)),
        (AlgorithmName::SepCmaEs, AlgorithmParams::CmaEs(CMA_ES)),
        (AlgorithmName::OpenAiEs, AlgorithmParams::OpenAiEs(OPENAI_ES)),
    ]
}

/// The genetic algorithm with every combination of operators that
/// `has_selection` lets through.
fn genetic_algorithms(has_selection: impl Fn(SelectionOperator) -> bool) -> Vec<Variant> {
    let mut variants = Vec::new();
    for selection_operator in [
        SelectionOperator::Tournament,
        SelectionOperator::Roulette,
        SelectionOperator::LinRank,
        SelectionOperator::NonlinRank,
        SelectionOperator::StochasticUniversal,
    ] {
        for crossover_operator in [
            CrossoverOperator::BlxAlpha,
            CrossoverOperator::Uniform,
            CrossoverOperator::OnePoint,
            CrossoverOperator::MultiPoint,
            CrossoverOperator::SimulatedBinary,
        ] {
            for mutation_operator in [MutationOperator::Gaussian, MutationOperator::Uniform] {
                let operators =
                    GaParams { selection_operator, crossover_operator, mutation_operator, ..GA };
                if has_selection(selection_operator) {
                    variants.push((AlgorithmName::Ga, AlgorithmParams::Ga(operators)));
                }
            }
        }
    }
    variants
}

fn all() -> Vec<Variant> {
    [evolution_strategies(), genetic_algorithms(|_| true)].concat()
}

fn start((name, params): &Variant, segment_lens: &[usize], population_size: usize) -> Evolution {
    let algorithm = |&d: &usize| Algorithm::new(*name, params, d, population_size).unwrap();
    evolution_of(segment_lens.iter().map(algorithm).collect(), population_size)
}

fn assert_genes_are_sound(genotypes: &[Genotype], what: &impl std::fmt::Debug) {
    let mut genes = genotypes.iter().flatten();
    assert!(genes.all(|gene| (0.0..=1.0).contains(gene)), "{what:?} {genotypes:?}");
}

/// Numbers that JSON lacks are written as null.
fn has_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(items) => items.iter().any(has_null),
        Value::Object(items) => items.values().any(has_null),
        _ => false,
    }
}

fn assert_state_is_finite(evolution: &Evolution, what: &impl std::fmt::Debug) {
    let state = serde_json::to_value(&evolution.populations).unwrap();
    assert!(!has_null(&state), "{what:?} {state}");
}

#[test]
fn resuming_from_any_generation_gives_the_same_bits() {
    const N_GENERATIONS: usize = 7;
    for variant in all() {
        let mut uninterrupted = start(&variant, &[4, 3], 9);
        let mut checkpoints = Vec::new();
        for _ in 0..N_GENERATIONS {
            checkpoints.push(serde_json::to_string(&uninterrupted).unwrap());
            step(&mut uninterrupted);
        }
        for (g, checkpoint) in checkpoints.iter().enumerate() {
            let mut resumed: Evolution = serde_json::from_str(checkpoint).unwrap();
            for _ in g..N_GENERATIONS {
                step(&mut resumed);
            }
            assert_eq!(resumed, uninterrupted, "{variant:?} from generation {g}");
        }
    }
}

#[test]
fn every_generation_has_all_its_individuals_and_new_ones() {
    for variant in all() {
        for population_size in [4, 11] {
            let mut evolution = start(&variant, &[5], population_size);
            let mut previous = Vec::new();
            for _ in 0..4 {
                let asked = evolution.ask();
                assert_eq!(asked.genotypes.len(), population_size);
                assert!(asked.genotypes.iter().all(|genotype| genotype.len() == 5));
                assert_genes_are_sound(&asked.genotypes, &variant);
                assert_ne!(asked.genotypes, previous, "{variant:?}");
                previous = asked.genotypes;
                step(&mut evolution);
            }
        }
    }
}

#[test]
fn populations_draw_independently_and_meet_by_index() {
    for variant in all() {
        let mut evolution = start(&variant, &[6, 6], 8);
        for _ in 0..3 {
            let asked = evolution.ask();
            for (i, genotype) in asked.genotypes.iter().enumerate() {
                let parts = asked.samples.iter().map(|sample| sample.genotypes[i].clone());
                assert_eq!(*genotype, parts.collect::<Vec<_>>().concat());
            }
            // The centre of an odd OpenAI-ES is the only individual they may share.
            assert_ne!(asked.samples[0].genotypes, asked.samples[1].genotypes, "{variant:?}");
            step(&mut evolution);
        }
    }
}

#[test]
fn only_ranks_count_unless_selection_is_proportional_to_fitness() {
    let proportional = [SelectionOperator::Roulette, SelectionOperator::StochasticUniversal];
    let by_rank = genetic_algorithms(|selection| !proportional.contains(&selection));
    for variant in [evolution_strategies(), by_rank].concat() {
        let mut plain = start(&variant, &[4], 10);
        let mut scaled = plain.clone();
        for _ in 0..5 {
            let asked = plain.ask();
            assert_eq!(asked.genotypes, scaled.ask().genotypes, "{variant:?}");
            let fitness = judge(&asked.genotypes);
            let other: Vec<Vec<f64>> =
                fitness.iter().map(|t| t.iter().map(|f| 4.0 * f - 2.0).collect()).collect();
            scaled.tell(asked.clone(), &other).unwrap();
            plain.tell(asked, &fitness).unwrap();
            assert_ne!(plain.digest(), scaled.digest());
        }
    }
}

#[test]
fn proportional_selection_ignores_the_scale_but_not_the_shift_of_fitness() {
    let proportional = [SelectionOperator::Roulette, SelectionOperator::StochasticUniversal];
    for variant in genetic_algorithms(|selection| proportional.contains(&selection)) {
        let mut plain = start(&variant, &[4], 10);
        let (mut scaled, mut shifted) = (plain.clone(), plain.clone());
        let asked = plain.ask();
        let told = |map: fn(f64) -> f64| {
            let fitness = judge(&asked.genotypes).into_iter();
            fitness.map(|t| t.into_iter().map(|f| map(f + 4.0)).collect()).collect::<Vec<_>>()
        };
        plain.tell(asked.clone(), &told(|f| f)).unwrap();
        scaled.tell(asked.clone(), &told(|f| 8.0 * f)).unwrap();
        shifted.tell(asked.clone(), &told(|f| 1e3 + f)).unwrap();
        assert_eq!(plain.ask().genotypes, scaled.ask().genotypes, "{variant:?}");
        assert_ne!(plain.ask().genotypes, shifted.ask().genotypes, "{variant:?}");
    }
}

#[test]
fn fitness_that_is_not_finite_never_enters_the_state() {
    for variant in all() {
        let mut evolution = start(&variant, &[3, 2], 7);
        let mut with_nan = evolution.clone();
        for g in 0..6 {
            let asked = evolution.ask();
            let mut fitness = judge(&asked.genotypes);
            fitness[g][0] = f64::NEG_INFINITY;
            fitness[(g + 3) % 7][1] = f64::NEG_INFINITY;
            let mut other = fitness.clone();
            other[g][0] = f64::NAN;
            other[(g + 3) % 7][1] = f64::INFINITY;
            evolution.tell(asked.clone(), &fitness).unwrap();
            with_nan.tell(asked, &other).unwrap();
            assert_state_is_finite(&with_nan, &variant);
            assert_eq!(with_nan.populations, evolution.populations, "{variant:?}");
        }
    }
}

#[test]
fn a_single_individual_with_finite_fitness_is_enough() {
    for variant in all() {
        let mut evolution = start(&variant, &[3], 6);
        for g in 0..5 {
            let mut fitness = vec![vec![f64::NAN]; 6];
            fitness[g] = vec![1.0];
            evolution.tell(evolution.ask(), &fitness).unwrap();
            assert_state_is_finite(&evolution, &variant);
            assert_genes_are_sound(&evolution.ask().genotypes, &variant);
        }
    }
}

/// An optimum in a corner of the cube, and then nothing to learn any more.
#[test]
fn long_runs_into_a_corner_and_on_a_plateau_stay_sound() {
    for variant in all() {
        for d in [1, 2, 5] {
            let is_quick = variant.0 == AlgorithmName::Ga;
            let mut evolution = start(&variant, &[d], 8);
            for g in 0..if is_quick { 40 } else { 1000 } {
                let asked = evolution.ask();
                let height = |genes: &Genotype| if g < 600 { genes.iter().sum() } else { 0.0 };
                let fitness: Vec<Vec<f64>> =
                    asked.genotypes.iter().map(|genes| vec![height(genes)]).collect();
                evolution.tell(asked, &fitness).unwrap();
                if g % 20 == 0 {
                    assert_state_is_finite(&evolution, &variant);
                }
            }
            assert_genes_are_sound(&evolution.ask().genotypes, &variant);
            let best = evolution.champion().unwrap().fitness().unwrap() / d as f64;
            assert!(is_quick || best > 0.999, "{variant:?} {d}: {best}");
        }
    }
}

/// The bounds of the configuration's reader.
#[test]
fn parameters_beyond_reason_stay_sound() {
    let (tiny, huge) = (1e-9, 1e9);
    let mut variants = Vec::new();
    for eta in [tiny, huge] {
        for sigma_init in [tiny, 1.0] {
            let snes = SnesParams { eta_mu: eta, eta_sigma: Some(eta), mu_init: 0.0, sigma_init };
            let xnes = XnesParams {
                eta_mu: eta,
                eta_sigma: Some(eta),
                eta_b: Some(eta),
                mu_init: 1.0,
                sigma_init,
            };
            let cma_es = AlgorithmParams::CmaEs(CmaEsParams { mu_init: 0.0, sigma_init });
            let openai_es = OpenAiEsParams {
                mu_init: 0.0,
                sigma: sigma_init,
                learning_rate: eta,
                beta1: 1.0 - f64::EPSILON,
                beta2: 0.0,
                weight_decay: 1.0,
            };
            variants.extend([
                (AlgorithmName::Snes, AlgorithmParams::Snes(snes)),
                (AlgorithmName::Xnes, AlgorithmParams::Xnes(xnes)),
                (AlgorithmName::CmaEs, cma_es.clone()),
                (AlgorithmName::SepCmaEs, cma_es),
                (AlgorithmName::OpenAiEs, AlgorithmParams::OpenAiEs(openai_es)),
            ]);
        }
        let ga = GaParams { alpha: eta, mutation_sigma: eta, tournament_size: 1000, ..GA };
        variants.push((AlgorithmName::Ga, AlgorithmParams::Ga(ga)));
    }
    for variant in variants {
        for d in [1, 3] {
            let mut evolution = start(&variant, &[d], 6);
            for _ in 0..60 {
                let asked = evolution.ask();
                assert_genes_are_sound(&asked.genotypes, &variant);
                let fitness = judge(&asked.genotypes);
                evolution.tell(asked, &fitness).unwrap();
                assert_state_is_finite(&evolution, &variant);
            }
        }
    }
}

#[test]
fn the_smallest_populations_that_are_let_in_evolve() {
    for variant in evolution_strategies() {
        let compares = matches!(
            variant.0,
            AlgorithmName::CmaEs | AlgorithmName::SepCmaEs | AlgorithmName::OpenAiEs
        );
        let mut evolution = start(&variant, &[2, 1], if compares { 2 } else { 1 });
        for _ in 0..20 {
            step(&mut evolution);
            assert_state_is_finite(&evolution, &variant);
        }
        let refused = Algorithm::new(variant.0, &variant.1, 2, 1);
        assert_eq!(refused.is_err(), compares, "{variant:?}");
    }
}
