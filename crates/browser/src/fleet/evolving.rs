//! A run in memory, whose batches a fleet computes one after the other.

use engine::{Batch, EvaluatedBatch};
use evolution::{Concluded, Digest, Evolution, Learnt, Next, Round};
use experiment_file::ExperimentConfig;
use serde::Serialize;
use sim_core::{FINGERPRINT, Simulation, TrialSet};

/// A run on its way.
#[derive(Debug)]
pub struct Evolving {
    config: ExperimentConfig,
    /// The present round, unless the run is over.
    round: Option<Round>,
    links: Vec<Link>,
}

/// A link of the digest chain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Link {
    /// The number of generations that it covers.
    pub n_generations: u64,
    /// Whether it is the last one of the run, which covers the champion as well.
    pub is_last: bool,
    /// The digest, hexadecimal.
    pub digest: String,
    /// The best fitness of the latest generation, or at the end the champion's worth.
    pub best: f64,
}

impl Evolving {
    /// The run of an experiment before its first generation.
    pub fn new(config: ExperimentConfig, simulation: &Simulation) -> Self {
        let evolution = Evolution::new(&config, simulation.population_segments(), FINGERPRINT);
        Self { config, round: Some(Round::generation(evolution)), links: Vec::new() }
    }

    /// Number of generations.
    pub fn n_generations(&self) -> u64 {
        self.config.algorithm.generations
    }

    /// The links so far.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Whether nothing is left to compute.
    pub fn is_over(&self) -> bool {
        self.round.is_none()
    }

    /// The trial set of the present batch.
    pub fn trial_set(&self) -> Option<TrialSet> {
        self.round.as_ref().map(Round::trial_set)
    }

    /// The batch to compute, unless the run is over.
    pub fn batch(&self) -> Option<Batch> {
        let round = self.round.as_ref()?;
        let n_trials = round.n_trials(&self.config);
        Some(Batch::fitness(round.trial_set(), round.genotypes(), n_trials))
    }

    /// Learns from the results of the batch. Fails if evolution cannot continue.
    pub fn learn(&mut self, evaluated: &EvaluatedBatch) -> Result<(), String> {
        let Some(round) = self.round.take() else { return Ok(()) };
        let next = round.conclude(&self.config, &evaluated.values);
        match next.map_err(|error| error.to_string())? {
            Next::Evaluate(next) => self.round = Some(*next),
            Next::Commit(concluded) => self.commit(*concluded),
        }
        Ok(())
    }

    fn commit(&mut self, concluded: Concluded) {
        let Concluded { learnt: Learnt { summary, completed, .. }, champion, digest, next, .. } =
            concluded;
        let n_generations = summary.generation + 1;
        let best = summary.statistics.best.get();
        let link = |is_last, digest: Digest, best| Link {
            n_generations,
            is_last,
            digest: digest.to_string(),
            best,
        };
        self.links.push(link(false, summary.digest, best));
        if completed.is_some() {
            let judged = champion.and_then(|champion| champion.judged);
            let best = judged.map_or(f64::NAN, |judged| judged.mean.get());
            self.links.push(link(true, digest, best));
        }
        self.round = next;
    }
}
