//! The simulator agrees with a naive second transcription of the equations.
//!
//! Every test also checks the events of its episodes: agreement would prove nothing about a radio
//! on which no robot sends.

mod cases;
mod configs;
mod reference;

use std::ops::Range;

use determinism::random::{Purpose, Stream};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

use reference::Episode;

/// Largest difference between two fitness values that count as equal.
///
/// The simulator's networks and quantisers compute in f32, the reference in f64, so activities
/// differ by about 1e-7. Continuous values (headings, positions) then differ a little. A draw (of
/// an LED, symbol or sector) or a comparison (with a range) differs only if a number falls into a
/// gap of that width; from then on, trajectories differ. With few draws, that is unlikely, so
/// episodes of moving robots are short. Every run of a test makes the same draws. Genotypes and
/// positions avoid ties; tests of ties use exact angles.
const TOLERANCE: f64 = 1e-5;

/// Asserts that simulator and reference give the same fitness in these trials,
/// and returns the reference's episodes.
fn assert_agreement(
    config: &ExperimentConfig,
    genotype: &[f64],
    generation: u64,
    trials: Range<u32>,
) -> Vec<Episode> {
    let episodes: Vec<Episode> =
        trials.clone().map(|trial| reference::run(config, genotype, generation, trial)).collect();
    let simulation = Simulation::compile(config).expect("the configuration is valid");
    assert_eq!(simulation.genotype_len(), genotype.len());
    let fitness = simulation
        .evaluate(genotype, generation, trials.clone())
        .expect("genotype and trials belong to the experiment");
    assert_eq!(fitness.len(), episodes.len());
    for ((trial, actual), expected) in trials.zip(fitness).zip(&episodes) {
        let expected = expected.fitness;
        assert!(
            (actual - expected).abs() <= TOLERANCE,
            "trial {trial} of generation {generation}: {actual}, expected {expected}",
        );
    }
    episodes
}

/// A genotype from U(0, 1): most of its neurons are saturated.
fn random_genotype(config: &ExperimentConfig, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
    reference::genes(config).iter().map(|_| stream.uniform()).collect()
}

/// A genotype from U(0.35, 0.65): its neurons stay sensitive to all inputs.
fn gentle_genotype(config: &ExperimentConfig, seed: u64) -> Vec<f64> {
    random_genotype(config, seed).into_iter().map(|x| 0.35 + 0.3 * x).collect()
}

/// Asserts agreement in two trials of random and of gentle genotypes, whose fitness must differ.
fn assert_varied_agreement(config: &ExperimentConfig) -> Vec<Episode> {
    let genotypes = (0..2).flat_map(|seed| {
        [random_genotype(config, 2 * seed), gentle_genotype(config, 2 * seed + 1)]
    });
    let episodes: Vec<Episode> =
        genotypes.flat_map(|genotype| assert_agreement(config, &genotype, 7, 3..5)).collect();
    let spread = spread(episodes.iter().map(|episode| episode.fitness));
    assert!(spread > 1e-3, "fitness within {spread}");
    episodes
}

/// Largest minus smallest.
fn spread(values: impl IntoIterator<Item = f64>) -> f64 {
    let [low, high] = values
        .into_iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    high - low
}
