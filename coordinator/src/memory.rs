//! Estimates the coordinator's memory for an experiment from the experiment's size, so that all
//! together fit.

use std::fmt;

use evolution::ALGORITHMS;
use experiment_file::{AlgorithmDescription, Keeps, limits};

use crate::store::Summary;

/// Bytes per gene of a generation, the largest measured value: the genotypes, their random draws,
/// and those of the previous generation, which the allocator has not returned yet. An algorithm
/// that keeps its population also copies it and writes it as text.
const BYTES_PER_GENE: u64 = 32;
const BYTES_PER_GENE_OF_MATRIX: u64 = 48;
const BYTES_PER_GENE_OF_POPULATION: u64 = 104;
/// Bytes per entry of a matrix, including its copy, its decomposition and its text.
const BYTES_PER_ENTRY: u64 = 96;
/// The same for all matrices of emitters, only one of which is decomposed at a time.
const BYTES_PER_ENTRY_OF_EMITTERS: u64 = BYTES_PER_ENTRY + 32 * limits::EMITTERS as u64;
/// Bytes per trial: its fitness, the id of its worker, and a copy.
const BYTES_PER_TRIAL: u64 = 32;
/// Bytes per individual: pointers to its genes and results, its item.
const BYTES_PER_INDIVIDUAL: u64 = 256;
/// Copies of the configuration: the text, its values, and the message to workers.
const CONFIG_COPIES: u64 = 4;
/// Bytes of everything else in an experiment.
const BYTES_PER_EXPERIMENT: u64 = 64 << 10;

/// Estimated upper bound of an experiment's memory, bytes. An experiment of another release,
/// which does not run, may count as nearly nothing.
pub fn estimate(summary: &Summary, genotype_len: u64) -> u64 {
    let description = AlgorithmDescription::find(ALGORITHMS, &summary.algorithm);
    let keeps = description.map_or(Keeps::Population, |description| description.keeps);
    let n_genes = summary.population_size.saturating_mul(genotype_len);
    let state = match keeps {
        Keeps::Vectors => n_genes.saturating_mul(BYTES_PER_GENE),
        Keeps::Matrix => n_genes
            .saturating_mul(BYTES_PER_GENE_OF_MATRIX)
            .saturating_add(genotype_len.saturating_mul(genotype_len) * BYTES_PER_ENTRY),
        Keeps::Population => n_genes.saturating_mul(BYTES_PER_GENE_OF_POPULATION),
        Keeps::Repertoire => {
            let of_elites = u64::from(limits::ELITES).saturating_mul(genotype_len);
            let of_elites = of_elites.min(limits::GENES_OF_REPERTOIRE);
            let has_matrices = description.is_some_and(|found| found.genes_max.is_some());
            let entries = genotype_len.saturating_mul(genotype_len);
            let of_matrices = if has_matrices { entries } else { 0 };
            n_genes
                .saturating_add(of_elites)
                .saturating_mul(BYTES_PER_GENE)
                .saturating_add(of_matrices.saturating_mul(BYTES_PER_ENTRY_OF_EMITTERS))
        }
    };
    let n_trials = summary.population_size.saturating_mul(summary.num_evaluations);
    [
        state,
        n_trials
            .saturating_add(summary.champion_trials.max(summary.judgement_trials))
            .saturating_mul(BYTES_PER_TRIAL),
        summary.population_size.saturating_mul(BYTES_PER_INDIVIDUAL),
        CONFIG_COPIES.saturating_mul(summary.config_len),
        BYTES_PER_EXPERIMENT,
    ]
    .into_iter()
    .fold(0, u64::saturating_add)
}

/// A lack of memory for an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shortage {
    /// Bytes that the experiment takes.
    pub needed: u64,
    /// Bytes that other unfinished experiments take.
    pub in_use: u64,
    /// Bytes that all experiments may take together.
    pub budget: u64,
}

impl Shortage {
    /// Checks that there is room for `needed` bytes.
    pub fn check(needed: u64, in_use: u64, budget: u64) -> Result<(), Self> {
        let is_short = needed > budget.saturating_sub(in_use);
        if is_short { Err(Self { needed, in_use, budget }) } else { Ok(()) }
    }

    /// Whether the experiment alone exceeds the budget.
    pub fn is_final(&self) -> bool {
        self.needed > self.budget
    }
}

impl fmt::Display for Shortage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        let (needed, in_use, budget) = (mib(self.needed), mib(self.in_use), mib(self.budget));
        if self.is_final() {
            write!(
                f,
                "the experiment takes about {needed} MiB of the coordinator's memory, more than \
                 all experiments may take together, {budget} MiB; make its population or its \
                 network smaller, or start the coordinator with a larger --memory-budget"
            )
        } else {
            write!(
                f,
                "the experiment takes about {needed} MiB of the coordinator's memory, and \
                 unfinished experiments take {in_use} of {budget} MiB; wait until some end, \
                 cancel some, or start the coordinator with a larger --memory-budget"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(algorithm: &str, population_size: u64, n_trials: u64) -> Summary {
        Summary {
            algorithm: algorithm.to_owned(),
            population_size,
            num_evaluations: n_trials,
            champion_trials: 50,
            judgement_trials: 200,
            ..Summary::default()
        }
    }

    fn mib(algorithm: &str, population_size: u64, n_trials: u64, genotype_len: u64) -> u64 {
        estimate(&summary(algorithm, population_size, n_trials), genotype_len) >> 20
    }

    /// Measured over three generations with a worker, less the memory of a coordinator without
    /// experiments: 268, 799 and 401 MiB.
    #[test]
    fn estimates_are_not_below_measurements() {
        assert_eq!(mib("SNES", 20_000, 1, 424), 264);
        assert_eq!(mib("GA", 20_000, 1, 424), 846);
        assert_eq!(mib("CMA-ES", 20_000, 1, 424), 410);
    }

    #[test]
    fn every_part_of_an_experiment_counts() {
        let base = mib("SNES", 1_000, 10, 400);
        assert!(base < 16, "{base}");
        assert!(mib("SNES", 100_000, 10, 400) > 80 * base);
        assert!(mib("SNES", 1_000, 10, 40_000) > 80 * base);
        assert!(mib("SNES", 1_000, 1_000, 400) > 25 + base);
        assert!(mib("xNES", 10, 1, 1_000) >= 91);
        let long = Summary { config_len: 1 << 20, ..summary("SNES", 1, 1) };
        assert!(estimate(&long, 1) >= 4 << 20);
        assert!(estimate(&summary("SNES", u64::MAX, 2), u64::MAX) == u64::MAX, "no overflow");
    }

    #[test]
    fn a_shortage_says_how_much_and_what_to_do() {
        const MIB: u64 = 1 << 20;
        assert_eq!(Shortage::check(MIB, 3 * MIB, 4 * MIB), Ok(()));
        let full = Shortage::check(2 * MIB, 3 * MIB, 4 * MIB).unwrap_err();
        assert!(!full.is_final());
        let text = full.to_string();
        assert!(text.contains("about 2 MiB") && text.contains("3 of 4 MiB"), "{text}");
        let never = Shortage::check(5 * MIB, 0, 4 * MIB).unwrap_err();
        assert!(never.is_final());
        assert!(never.to_string().contains("about 5 MiB"), "{never}");
        assert!(Shortage::check(1, 9 * MIB, 4 * MIB).is_err(), "a budget that is exceeded already");
    }
}
