//! Runs in which all, or nearly all, individuals have equal fitness.

use super::{super::round::*, world};
use engine::EvaluatedBatch;

/// The notices of a run, and why it fails if it does, with the given fitness per individual.
fn run(name: &str, generations: u64, fitness: fn(usize) -> f64) -> (Vec<String>, Option<String>) {
    let mut config = world::config(1, generations);
    config.algorithm.name = name.into();
    let mut round = Round::generation(world::evolution(&config));
    let mut notices = Vec::new();
    loop {
        let batch = round.batch(&config);
        let n_trials = batch.n_trials as usize;
        let values = (0..batch.genotypes.len())
            .map(|i| (0..n_trials).map(|trial| fitness(i + trial)).collect());
        let evaluated = EvaluatedBatch { values: values.collect(), ..world::evaluated(&[], 0) };
        match round.conclude(&config, &evaluated) {
            Err(error) => return (notices, Some(error.to_string())),
            Ok(Next::Evaluate(next)) => round = *next,
            Ok(Next::Commit(ready)) => {
                notices.extend(ready.notices.iter().cloned());
                match ready.next {
                    Some(next) => round = next,
                    None => return (notices, None),
                }
            }
        }
    }
}

#[test]
fn the_same_fitness_for_ten_generations_is_a_notice() {
    let (notices, error) = run("SNES", 12, |_| 0.25);
    assert_eq!(error, None);
    let flat: Vec<&String> =
        notices.iter().filter(|notice| notice.contains("same fitness")).collect();
    assert!(flat[0].starts_with("generations 0 to 9: all 4 individuals"), "{notices:?}");
    assert!(flat[1].starts_with("generations 0 to 11: all 4 individuals"), "{notices:?}");
    let (notices, _) = run("SNES", 12, |i| i as f64);
    assert!(!notices.iter().any(|notice| notice.contains("same fitness")), "{notices:?}");
}

#[test]
fn a_run_that_chance_drives_out_of_all_bounds_fails_with_the_reason() {
    let (_, error) = run("xNES", 20_000, |_| 0.25);
    let error = error.expect("the deviations of xNES grow");
    assert!(error.starts_with("all individuals had the same fitness 0.25 in each of"), "{error}");
}

#[test]
fn a_champion_with_the_smallest_numbers_as_fitness_is_judged() {
    let (notices, _) = run("SNES", 2, |i| [0.0, 5e-324, 1e-323][i % 3]);
    assert!(notices.iter().any(|notice| notice.starts_with("champion judged: ")), "{notices:?}");
}

#[test]
fn a_notice_has_no_long_number() {
    let (notices, _) = run("SNES", 2, |i| [-9e98, 1e100][i % 2]);
    let judged = notices.iter().find(|notice| notice.starts_with("champion judged: ")).unwrap();
    assert!(judged.len() < 120 && judged.contains("e98"), "{judged}");
    assert!(notices.iter().all(|notice| notice.len() < 120), "{notices:?}");
}
