//! Detects evolution that learns nothing: equal fitness of all individuals, and distributions
//! that are as narrow as a point or far wider than the genes' range.
//!
//! This module changes no bit of a run. It writes notices, and ends a run that continues by chance
//! alone.

use super::{Evaluations, Evolution, EvolutionError, Generation, GenerationSummary, Told, means};

/// The number of latest generations in which all individuals had equal fitness. The number is not
/// part of the state, so comparisons ignore it. A restored state counts again from the fitness log.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FlatGenerations(pub u64);

impl FlatGenerations {
    /// The number after the next generation.
    pub fn next(self, is_flat: bool) -> Self {
        if is_flat { Self(self.0 + 1) } else { Self(0) }
    }
}

impl PartialEq for FlatGenerations {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A notice follows after this many generations without a difference, and again after ten times as
/// many.
const FLAT_MIN: u64 = 10;

/// After this many generations without a difference, a distribution wider than [`DEVIATION_MAX`]
/// ends the run.
const FLAT_MAX: u64 = 100;

/// Most generations to count before a restored state: more than the number that ends a run.
pub const FLAT_COUNTED_MAX: u64 = 10 * FLAT_MAX;

/// Deviation of genes, whose range is 1, from which evolution cannot recover: individuals are
/// drawn uniformly from the range, wherever the mean is.
const DEVIATION_MAX: f64 = 1e6;

/// Deviations below this lead to a notice, because all individuals are alike.
const DEVIATION_NARROW: f64 = 1e-9;

/// Deviations above this lead to a notice, because individuals are drawn uniformly from the
/// range.
const DEVIATION_WIDE: f64 = 1e3;

/// Evolution learns nothing, and chance has made its distribution far wider than the genes'
/// range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "all individuals had the same fitness {fitness} in each of the last {n_generations} generations, \
     and chance has driven the deviations of the genes, whose range is 1, to {deviation:.0e}; \
     evolution can learn nothing from here on: let the task tell individuals apart, and submit it \
     again"
)]
pub struct Drifted {
    /// The fitness of all individuals.
    pub fitness: f64,
    /// Number of generations without a difference.
    pub n_generations: u64,
    /// The widest of the genes' deviations.
    pub deviation: f64,
}

/// The result of learning from a generation of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Learnt {
    /// The summary of its fitness.
    pub summary: GenerationSummary,
    /// Notices for people.
    pub notices: Vec<String>,
    /// Why the generation is the last one; `None` if it is not, empty if all generations are done.
    pub completed: Option<String>,
}

impl Told {
    /// Whether all individuals of the generation have the same fitness.
    pub fn is_flat(&self) -> bool {
        is_flat(&means(&self.trial_fitness))
    }
}

/// Whether all individuals of a generation have equal fitness. False for a single individual,
/// which has no others to differ from.
pub(crate) fn is_flat(fitness: &[f64]) -> bool {
    fitness.len() > 1 && fitness.iter().all(|each| each.is_finite() && *each == fitness[0])
}

impl Evolution {
    /// The number of latest generations without a difference.
    pub fn n_flat(&self) -> u64 {
        self.n_flat.0
    }

    /// Sets the number of latest generations without a difference: restored states lack it.
    #[must_use]
    pub fn after_flat(self, n_generations: u64) -> Self {
        Self { n_flat: FlatGenerations(n_generations), ..self }
    }

    /// Learns from a generation as [`tell`](Self::tell) does, for programs that compute a run:
    /// also returns notices. `completion`: returns why the generation is the last one, if it is.
    ///
    /// # Errors
    ///
    /// As [`tell`](Self::tell), and if the run should end because evolution can no longer learn
    /// anything. After an error, the evolution cannot be used.
    pub fn learn<'a>(
        &mut self,
        generation: Generation,
        evaluations: impl Into<Evaluations<'a>>,
        completion: impl FnOnce(&GenerationSummary) -> Option<String>,
    ) -> Result<Learnt, EvolutionError> {
        let widest_before = self.widest();
        let summary = self.tell(generation, evaluations)?;
        if let Some(drifted) = self.drifted(&summary) {
            return Err(drifted.into());
        }
        let mut notices = Vec::new();
        if summary.n_non_finite > 0 {
            notices.push(format!(
                "generation {}: the fitness of {} individuals is not finite; they rank last",
                summary.generation, summary.n_non_finite
            ));
        }
        let news = self.populations.iter().filter_map(|population| population.news());
        notices.extend(news.map(|news| format!("generation {}: {news}", summary.generation)));
        notices.extend(self.nobody_kept(&summary));
        let completed = completion(&summary);
        notices.extend(self.remarks(widest_before, &summary, completed.is_some()));
        Ok(Learnt { summary, notices, completed })
    }

    /// A notice of a repertoire or a front without elites, after generations 1, 10, 100 and so on.
    fn nobody_kept(&self, summary: &GenerationSummary) -> Option<String> {
        let behaviours = self.behaviours().filter(|behaviours| behaviours.n_kept() == 0)?;
        let n_generations = summary.generation + 1;
        let is_due = n_generations.to_string().trim_end_matches('0') == "1";
        let what = if behaviours.aims().is_empty() { "descriptors" } else { "aims" };
        is_due.then(|| {
            format!(
                "generation {}: no individual has finite values of fitness and of all {what}, so \
                 evolution learns nothing; check the measures in `algorithm.{what}`",
                summary.generation
            )
        })
    }

    /// The largest standard deviation of a gene in any distribution; `None` without one.
    pub(crate) fn widest(&self) -> Option<f64> {
        let of_each = self.populations.iter().filter_map(|population| population.deviations());
        of_each.flatten().reduce(f64::max)
    }

    /// The notices after a generation. `widest_before`: [`widest`](Self::widest) before the
    /// generation. `is_last`: whether the generation is the last of the run.
    pub(crate) fn remarks(
        &self,
        widest_before: Option<f64>,
        summary: &GenerationSummary,
        is_last: bool,
    ) -> Vec<String> {
        let mut remarks = Vec::new();
        let n_flat = summary.n_flat;
        let is_due = n_flat >= FLAT_MIN && n_flat.to_string().trim_end_matches('0') == "1";
        // A repertoire also learns from behaviours, and a front from other aims.
        let needs_fitness = self.behaviours().is_none();
        if needs_fitness && (is_due || (is_last && n_flat > 1)) {
            remarks.push(self.flat(summary));
        }
        let (Some(was), Some(is)) = (widest_before, self.widest()) else { return remarks };
        if was >= DEVIATION_NARROW && is < DEVIATION_NARROW {
            remarks.push(format!(
                "generation {}: the deviations of all genes are below {DEVIATION_NARROW:e}, so all \
                 individuals are alike; end the run here, or start another run with a wider \
                 `sigma_init`, another seed or more individuals",
                summary.generation
            ));
        }
        if was <= DEVIATION_WIDE && is > DEVIATION_WIDE {
            remarks.push(format!(
                "generation {}: the deviation of a gene is {is:.0e}, but its range is 1, so it is drawn \
                 at random; fitness does not depend on this gene, or the learning rates are too \
                 large",
                summary.generation
            ));
        }
        remarks
    }

    fn flat(&self, summary: &GenerationSummary) -> String {
        let (fitness, last) = (summary.statistics.best, summary.generation);
        let first = last + 1 - summary.n_flat;
        format!(
            "generations {first} to {last}: all {} individuals have the same fitness {fitness}, so evolution drifts by \
             chance; let the task reward steps towards its goal, or check that its fitness depends on \
             the robots' actions (`swarmctl simulate`)",
            self.population_size
        )
    }

    /// Why a run that learns nothing should end; `None` if it may continue.
    pub(crate) fn drifted(&self, summary: &GenerationSummary) -> Option<Drifted> {
        let n_generations = summary.n_flat;
        let deviation = self.widest().filter(|&deviation| deviation > DEVIATION_MAX)?;
        let fitness = summary.statistics.best.get();
        (n_generations >= FLAT_MAX).then_some(Drifted { fitness, n_generations, deviation })
    }
}
