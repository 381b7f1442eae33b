//! Meaningless and adversarial fitness: no algorithm panics, leaves the genes' range or fails
//! silently.

use super::*;

const N_GENERATIONS: u64 = 5000;

/// Fitness of each individual of a generation.
type Adversary = fn(u64, &[Genotype]) -> Vec<f64>;

const ADVERSARIES: [(&str, Adversary); 8] = [
    ("constant", flat),
    ("huge", |_, genotypes| of_each(genotypes, |genes| 1.7e308 * (genes[0] - 0.5))),
    ("tiny", |_, genotypes| of_each(genotypes, |genes| 5e-324 * (9.0 * genes[0]).round())),
    ("alternating", |generation, genotypes| {
        let sign = if generation.is_multiple_of(2) { 1.0 } else { -1.0 };
        of_each(genotypes, |genes| sign * genes.iter().sum::<f64>())
    }),
    ("infinite but one", |generation, genotypes| {
        let one = generation as usize % genotypes.len();
        (0..genotypes.len()).map(|i| if i == one { 1.0 } else { f64::INFINITY }).collect()
    }),
    ("NaN but one", |_, genotypes| {
        (0..genotypes.len()).map(|i| if i == 0 { -1e300 } else { f64::NAN }).collect()
    }),
    ("at a corner", |_, genotypes| of_each(genotypes, |genes| genes.iter().sum())),
    ("the farther the better", |_, genotypes| {
        of_each(genotypes, |genes| genes.iter().map(|gene| (gene - 0.5).abs()).sum())
    }),
];

fn flat(_: u64, genotypes: &[Genotype]) -> Vec<f64> {
    vec![0.25; genotypes.len()]
}

/// The easy case for which algorithms are made.
fn sphere(_: u64, genotypes: &[Genotype]) -> Vec<f64> {
    of_each(genotypes, |genes| -genes.iter().map(|gene| (gene - 0.3) * (gene - 0.3)).sum::<f64>())
}

fn of_each(genotypes: &[Genotype], fitness: impl Fn(&Genotype) -> f64) -> Vec<f64> {
    genotypes.iter().map(fitness).collect()
}

fn started(name: &str, population_size: u32) -> Evolution {
    Setup { population_size, ..Setup::new(name, 3) }.start().unwrap()
}

#[test]
fn no_fitness_makes_an_algorithm_panic_or_leave_the_range_of_genes() {
    for algorithm in by_fitness() {
        for (what, fitness) in ADVERSARIES {
            let mut evolution = started(algorithm.name, 5);
            for generation in 0..N_GENERATIONS {
                let asked = evolution.ask();
                let is_sound = |gene: &f64| (0.0..=1.0).contains(gene);
                assert!(
                    asked.genotypes.iter().flatten().all(is_sound),
                    "{} {what} {generation}",
                    algorithm.name
                );
                let told: Vec<Vec<f64>> = fitness(generation, &asked.genotypes)
                    .into_iter()
                    .map(|fitness| vec![fitness])
                    .collect();
                evolution.tell(asked, &told).unwrap();
            }
            let mean = evolution.mean().unwrap_or_default();
            assert!(
                mean.iter().all(|gene| (0.0..=1.0).contains(gene)),
                "{} {what}",
                algorithm.name
            );
            assert!(
                evolution
                    .widest()
                    .is_none_or(|deviation| deviation.is_finite() && deviation >= 0.0),
                "{} {what}: {:?}",
                algorithm.name,
                evolution.widest()
            );
        }
    }
}

/// The notices of a number of generations, and whether the run would have ended.
fn remarks(
    evolution: &mut Evolution,
    n_generations: u64,
    fitness: Adversary,
) -> (Vec<String>, Option<Drifted>) {
    let mut remarks = Vec::new();
    for generation in 0..n_generations {
        let before = evolution.widest();
        let asked = evolution.ask();
        let told: Vec<Vec<f64>> = fitness(generation, &asked.genotypes)
            .into_iter()
            .map(|fitness| vec![fitness])
            .collect();
        let summary = evolution.tell(asked, &told).unwrap();
        remarks.extend(evolution.remarks(before, &summary, generation + 1 == n_generations));
        if let Some(drifted) = evolution.drifted(&summary) {
            return (remarks, Some(drifted));
        }
    }
    (remarks, None)
}

#[test]
fn equal_fitness_gives_a_notice_after_ten_generations_and_then_ever_more_rarely() {
    for algorithm in by_fitness() {
        let (remarks, _) = remarks(&mut started(algorithm.name, 100), 10, flat);
        let expected = "generations 0 to 9: all 100 individuals have the same fitness 0.25, ";
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        assert!(remarks[0].starts_with(expected), "{remarks:?}");
    }
    let is_flat = |remark: &&String| remark.contains("same fitness");
    let (of_many, _) = remarks(&mut started("GA", 8), 1200, flat);
    assert_eq!(of_many.iter().filter(is_flat).count(), 4, "10, 100, 1000 and the end: {of_many:?}");
    let (of_few, _) = remarks(&mut started("GA", 8), 5, flat);
    assert!(of_few[0].starts_with("generations 0 to 4: all 8 individuals"), "{of_few:?}");
}

#[test]
fn fitness_that_differs_gives_no_notice() {
    for algorithm in by_fitness() {
        let (remarks, drifted) = remarks(&mut started(algorithm.name, 20), 30, sphere);
        assert_eq!((remarks, drifted), (vec![], None), "{}", algorithm.name);
    }
}

#[test]
fn a_distribution_that_chance_has_driven_out_of_all_bounds_ends_the_run() {
    let (remarks, drifted) = remarks(&mut started("xNES", 6), N_GENERATIONS, flat);
    let drifted = drifted.expect("the deviations of xNES grow without bound");
    assert!(drifted.n_generations >= 100 && drifted.deviation > 1e6, "{drifted}");
    assert!(remarks.iter().any(|remark| remark.contains("it is drawn at random")), "{remarks:?}");
    // The same deviations do not end a run whose fitness differs between individuals.
    let mut wide = started("xNES", 6);
    for generation in 0..drifted.n_generations {
        let asked = wide.ask();
        let told = vec![vec![0.25]; 6];
        let summary = wide.tell(asked, &told).unwrap();
        assert_eq!(summary.n_flat, generation + 1);
    }
    let asked = wide.ask();
    let told: Vec<Vec<f64>> = (0..6).map(|i| vec![f64::from(i)]).collect();
    let summary = wide.tell(asked, &told).unwrap();
    assert_eq!((summary.n_flat, wide.drifted(&summary)), (0, None));
}

#[test]
fn a_distribution_that_shrinks_to_a_point_gives_one_notice() {
    let (remarks, _) = remarks(&mut started("SNES", 12), 3000, sphere);
    let narrow =
        remarks.iter().filter(|remark| remark.contains("all individuals are alike")).count();
    assert_eq!(narrow, 1, "{remarks:?}");
}

#[test]
fn the_number_of_flat_generations_is_no_part_of_the_state_but_continues_from_a_checkpoint() {
    let mut evolution = started("SNES", 4);
    let begun = evolution.keyframe();
    remarks(&mut evolution, 12, flat);
    let restored =
        Evolution::restore(&Checkpoint { keyframe: evolution.keyframe(), ..Checkpoint::default() })
            .unwrap();
    assert_eq!((&restored, restored.keyframe()), (&evolution, evolution.keyframe()));
    assert_eq!(begun, started("SNES", 4).keyframe());
    let checkpoint =
        Checkpoint { keyframe: evolution.keyframe(), n_flat: 12, ..Checkpoint::default() };
    assert_eq!((restored.n_flat(), Evolution::restore(&checkpoint).unwrap().n_flat()), (0, 12));
}

#[test]
fn a_generation_is_flat_if_several_individuals_have_the_same_finite_fitness() {
    let is_flat = |means: &[f64]| {
        Told::from_fitness(means.iter().map(|&mean| vec![mean, mean]).collect()).is_flat()
    };
    assert!(is_flat(&[0.5, 0.5]) && is_flat(&[0.0, -0.0, 0.0]));
    assert!(!is_flat(&[0.5, 0.25]) && !is_flat(&[0.5, f64::NAN]) && !is_flat(&[0.5]));
    assert!(Told::from_fitness(vec![vec![1.0, 2.0], vec![2.0, 1.0]]).is_flat(), "means count");
}

#[test]
fn only_populations_too_small_to_learn_from_give_a_warning() {
    let advice = |name: &str, population_size| {
        AlgorithmDescription::find(ALGORITHMS, name).unwrap().advice(population_size)
    };
    for name in ["SNES", "xNES", "GA"] {
        assert!(advice(name, 1).unwrap().contains("never learns"), "{name}");
    }
    for algorithm in by_fitness() {
        assert!(advice(algorithm.name, 3).unwrap().contains("next to nothing"));
        assert_eq!(advice(algorithm.name, 4), None);
        assert_eq!(
            advice(algorithm.name, 33).is_some(),
            ["openaiES", "PGPE"].contains(&algorithm.name)
        );
    }
}

#[test]
fn a_file_with_a_single_individual_is_accepted_with_a_warning() {
    let file = include_str!("../../../../configs/quickstart.json")
        .replace(r#""population_size": 32"#, r#""population_size": 1"#);
    let (config, warnings) = ExperimentConfig::from_json(&file, "", ALGORITHMS).unwrap();
    assert_eq!(config.algorithm.population_size, 1);
    let found: Vec<String> = warnings.iter().map(|warning| format!("{warning}")).collect();
    assert!(
        found.iter().any(|warning| warning.contains("population_size: with a single")),
        "{found:?}"
    );
}
