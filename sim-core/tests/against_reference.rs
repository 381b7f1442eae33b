//! The simulator agrees with a naive second transcription of the equations.
//!
//! Every test also looks at what happened in its episodes: agreement says
//! nothing about a radio on which nobody speaks.

mod cases;
mod configs;
mod reference;

use std::ops::Range;

use sim_core::Experiment;
use sim_core::config::ExperimentConfig;
use sim_core::random::{Purpose, Stream};

use reference::Episode;

/// Largest difference between two fitness values that count as equal.
///
/// The two implementations add in different orders and take their exponentials
/// from different libraries, so activities differ by some 1e-15. That moves what
/// is continuous (headings, positions) by less than this, and it changes what is
/// drawn (an LED, a symbol, a sector) only if a uniform number falls into a gap
/// as narrow: about once in 1e14 draws, and these tests make some 1e6, always
/// the same ones.
const TOLERANCE: f64 = 1e-9;

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
    let experiment = Experiment::compile(config).expect("the configuration is valid");
    assert_eq!(experiment.genotype_len(), genotype.len());
    let fitness = experiment
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

/// A genotype from U(0, 1).
fn random_genotype(config: &ExperimentConfig, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
    reference::genes(config).iter().map(|_| stream.uniform()).collect()
}

/// Largest minus smallest.
fn spread(values: impl IntoIterator<Item = f64>) -> f64 {
    let [low, high] = values
        .into_iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    high - low
}
