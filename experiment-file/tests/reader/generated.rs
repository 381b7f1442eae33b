//! Properties of very many files.

use std::thread;

use serde_json::json;

use super::generator::{Dice, damage, experiment};
use super::{accept, read};
use sim_core::Simulation;

/// Files that are right, and damaged variants of each.
const N_FILES: u64 = 5_000;
const N_VARIANTS: u64 = 20;

#[test]
fn generated_files_are_accepted_and_their_canonical_forms_mean_the_same() {
    for index in 0..N_FILES / 2 {
        let text = experiment(&mut Dice::new(index)).to_string();
        let (config, _) = read(&text).unwrap_or_else(|error| panic!("{error}\nin\n{text}"));
        let canonical = config.to_canonical_json();
        let again = accept(&canonical);
        assert_eq!(again, config);
        assert_eq!(again.to_canonical_json(), canonical);
    }
}

#[test]
fn damaged_files_are_read_or_refused_and_what_is_read_makes_sense() {
    let n_accepted: u64 = thread::scope(|scope| {
        let halves = [0, 1].map(|half| {
            scope.spawn(move || (half..N_FILES).step_by(2).map(n_accepted_variants).sum::<u64>())
        });
        halves.map(|half| half.join().expect("no variant panics")).into_iter().sum()
    });
    let n = N_FILES * N_VARIANTS;
    assert!(n_accepted > n / 2, "{n_accepted} of {n} accepted");
}

fn n_accepted_variants(index: u64) -> u64 {
    let mut dice = Dice::new(index);
    let file = experiment(&mut dice);
    let mut n_accepted = 0;
    for variant in 0..N_VARIANTS {
        let mut file = file.clone();
        while dice.chance(0.45) {
            damage(&mut dice, &mut file);
        }
        match read(&file.to_string()) {
            Ok((config, _)) => {
                n_accepted += 1;
                if variant == 0 {
                    assert_eq!(accept(&config.to_canonical_json()), config);
                }
            }
            Err(error) => assert!(!error.problems.is_empty()),
        }
    }
    n_accepted
}

/// Compiling may still refuse what only it can find, such as a query of a group
/// whose synapses all happen not to exist.
#[test]
fn accepted_files_can_be_simulated() {
    let (mut n_simulated, n) = (0, 1_100);
    for index in 0..n {
        let mut file = experiment(&mut Dice::new(index));
        file["algorithm"]["evaluation_steps"] = json!(101);
        let (config, _) = read(&file.to_string()).unwrap();
        if let Ok(experiment) = Simulation::compile(&config) {
            let genotype = vec![0.5; experiment.genotype_len()];
            let fitness = experiment.evaluate(&genotype, 0, 0..1).unwrap();
            assert!(fitness[0].is_finite(), "{file}");
            n_simulated += 1;
        }
    }
    assert!(n_simulated >= 1_000, "{n_simulated} of {n}");
}
