//! Properties of many generated files.

use std::{env, thread};

use serde_json::json;

use super::generator::{Dice, damage, experiment, spiking_experiment};
use super::{accept, read};
use sim_core::{Simulation, StepRecord};

/// Number of damaged variants of each valid file.
const N_VARIANTS: u64 = 20;

/// Number of valid files: `SWARM_TEST_FILES`, by default 150; 5,000 take half a minute of CPU.
pub fn n_files() -> u64 {
    let text = env::var("SWARM_TEST_FILES").unwrap_or_else(|_| "150".to_owned());
    text.parse().unwrap_or_else(|_| panic!("SWARM_TEST_FILES is {text}, not a number"))
}

/// Number of files to simulate, which takes longer than to read them.
fn n_simulations() -> u64 {
    (2 * n_files()).min(1_100)
}

#[test]
fn generated_files_are_accepted_and_their_canonical_forms_mean_the_same() {
    for index in 0..n_files() / 2 {
        let text = experiment(&mut Dice::new(index)).to_string();
        let (config, _) = read(&text).unwrap_or_else(|error| panic!("{error}\nin\n{text}"));
        let canonical = config.to_canonical_json();
        let again = accept(&canonical);
        assert_eq!(again, config);
        assert_eq!(again.to_canonical_json(), canonical);
    }
}

#[test]
fn damaged_files_are_refused_or_give_a_valid_experiment() {
    let n_accepted: u64 = thread::scope(|scope| {
        let halves = [0, 1].map(|half| {
            scope.spawn(move || (half..n_files()).step_by(2).map(n_accepted_variants).sum::<u64>())
        });
        halves.map(|half| half.join().expect("no variant panics")).into_iter().sum()
    });
    let n = n_files() * N_VARIANTS;
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
                    // A small population may give a warning.
                    let again = read(&config.to_canonical_json()).map(|(config, _)| config);
                    assert_eq!(again.unwrap(), config);
                }
            }
            Err(error) => assert!(!error.problems.is_empty()),
        }
    }
    n_accepted
}

/// Compiling may still refuse a file for problems that only it can find, such as a query of a
/// group in which no synapse happens to exist.
#[test]
fn accepted_files_can_be_simulated() {
    let (mut n_simulated, n) = (0, n_simulations());
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
    assert!(n_simulated > n * 9 / 10, "{n_simulated} of {n}");
}

/// This holds for all parameters and genes within their ranges, and with plasticity.
#[test]
fn no_accepted_network_of_spiking_neurons_ends_up_in_nan() {
    let (mut n_simulated, mut n_learning, mut n_encoded, mut n_voltages) = (0, 0, 0, 0);
    for index in 0.. {
        let mut dice = Dice::new(index);
        let mut file = spiking_experiment(&mut dice);
        file["algorithm"]["evaluation_steps"] = json!(101);
        let (config, _) = read(&file.to_string()).unwrap();
        let Ok(experiment) = Simulation::compile(&config) else { continue };
        n_simulated += 1;
        n_learning += u64::from(config.topology.learning.is_some());
        n_encoded += u64::from(!config.topology.encoding.is_empty());
        let genotype: Vec<f64> =
            (0..experiment.genotype_len()).map(|_| f64::from(u8::from(dice.chance(0.5)))).collect();
        let observe = &mut |step: &StepRecord| {
            for robot in &step.robots {
                assert!(robot.voltages.iter().all(|v| v.is_finite()), "{file}");
                assert!(robot.wheels.iter().chain(&robot.message).all(|x| x.is_finite()), "{file}");
                n_voltages += robot.voltages.len();
            }
        };
        experiment.simulate(&genotype, 0, 0, observe).unwrap();
        if n_simulated == n_simulations() {
            break;
        }
    }
    assert!(n_voltages > 100 * n_simulated as usize, "{n_voltages} of {n_simulated}");
    assert!(
        5 * n_learning > n_simulated && 2 * n_encoded > n_simulated,
        "{n_learning} learn, {n_encoded} encode"
    );
}

#[test]
fn no_accepted_network_of_rate_neurons_that_learns_ends_up_in_nan() {
    let (mut n_simulated, n) = (0, n_simulations());
    for index in 0..n {
        let mut dice = Dice::new(index);
        let mut file = experiment(&mut dice);
        file["algorithm"]["evaluation_steps"] = json!(101);
        let (config, _) = read(&file.to_string()).unwrap();
        if config.topology.learning.is_none() || config.topology.neuron_model.is_spiking() {
            continue;
        }
        let Ok(experiment) = Simulation::compile(&config) else { continue };
        n_simulated += 1;
        let genotype: Vec<f64> =
            (0..experiment.genotype_len()).map(|_| f64::from(u8::from(dice.chance(0.5)))).collect();
        let observe = &mut |step: &StepRecord| {
            for robot in &step.robots {
                let values = robot.activity.iter().chain(&robot.wheels).chain(&robot.message);
                assert!(values.into_iter().all(|x| x.is_finite()), "{file}");
            }
        };
        experiment.simulate(&genotype, 0, 0, observe).unwrap();
    }
    assert!(n_simulated > n / 10, "{n_simulated} of {n}");
}
