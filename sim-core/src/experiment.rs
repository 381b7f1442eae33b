//! An experiment, compiled: everything that is the same for all its episodes.

use std::ops::Range;

use crate::config::{ConfigError, ExperimentConfig};

/// A compiled experiment: (genotype, generation, trials) -> fitness.
#[derive(Debug, Clone)]
pub struct Experiment {}

/// A genotype or trial range that does not belong to the experiment: a bug of
/// the caller.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EvaluateError {
    /// The genotype has another length.
    #[error("the genotype has {actual} genes, the experiment's have {expected}")]
    GenotypeLength {
        /// Genes of the experiment's genotypes.
        expected: usize,
        /// Genes of this one.
        actual: usize,
    },
    /// A gene outside \[0, 1\] or not finite.
    #[error("gene {index} is {value}, outside [0, 1]")]
    GeneOutOfRange {
        /// Index of the gene.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// No trials, or some beyond `num_evaluations`.
    #[error("trials {}..{} are not within 0..{n_trials}", trials.start, trials.end)]
    Trials {
        /// The requested trials.
        trials: Range<u32>,
        /// Trials per individual.
        n_trials: u32,
    },
}

impl Experiment {
    /// Compiles a configuration. The reader has checked it already; what only
    /// compiling can find (an initialiser that cannot be met, say) is reported
    /// in the same way.
    pub fn compile(_config: &ExperimentConfig) -> Result<Self, ConfigError> {
        todo!()
    }

    /// Length d of a genotype.
    pub fn genotype_len(&self) -> usize {
        todo!()
    }

    /// Genes of each population, in the order of `algorithm.populations`.
    pub fn population_segments(&self) -> &[Range<usize>] {
        todo!()
    }

    /// Parameters that no query of the genotype covers and that keep their
    /// defaults, one line each, for a warning.
    pub fn uncovered_parameters(&self) -> &[String] {
        todo!()
    }

    /// Simulates one episode per trial and returns their fitness, in order.
    ///
    /// `genotype`: d genes in \[0, 1\]; `trials`: a non-empty part of
    /// 0..`num_evaluations`. The fitness of a trial does not depend on which
    /// other trials are asked for.
    pub fn evaluate(
        &self,
        _genotype: &[f64],
        _generation: u64,
        _trials: Range<u32>,
    ) -> Result<Vec<f64>, EvaluateError> {
        todo!()
    }

    /// The network that a genotype encodes, as JSON: stimuli, neurons with
    /// `tau`, `bias`, `gain` and activation, synapses with weights.
    pub fn network_json(&self, _genotype: &[f64]) -> Result<serde_json::Value, EvaluateError> {
        todo!()
    }
}
