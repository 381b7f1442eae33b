//! An evolution, whose batches a fleet computes one after the other. The rounds are those of the
//! coordinator (`coordinator/src/runs/round.rs`), for a run in memory: it keeps no history, and ends
//! after its last generation without a look at `target_fitness`.

use engine::{Batch, EvaluatedBatch};
use evolution::{Evolution, Generation, Judgement, Reevaluation, Told};
use experiment_file::ExperimentConfig;
use serde::Serialize;
use sim_core::{FINGERPRINT, Simulation, TrialSet};

/// A run on its way.
#[derive(Debug)]
pub struct Evolving {
    config: ExperimentConfig,
    evolution: Evolution,
    round: Round,
    links: Vec<Link>,
}

#[derive(Debug)]
enum Round {
    Generation(Generation),
    Reevaluation(Reevaluation),
    Judgement(Judgement),
    Over,
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
        let round = Round::Generation(evolution.ask());
        Self { config, evolution, round, links: Vec::new() }
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
        matches!(self.round, Round::Over)
    }

    /// The trial set of the present batch.
    pub fn trial_set(&self) -> Option<TrialSet> {
        match &self.round {
            Round::Generation(generation) => Some(TrialSet::Generation(generation.index)),
            Round::Reevaluation(reevaluation) => Some(reevaluation.trial_set()),
            Round::Judgement(judgement) => Some(judgement.trial_set()),
            Round::Over => None,
        }
    }

    /// The batch to compute, unless the run is over.
    pub fn batch(&self) -> Option<Batch> {
        let algorithm = &self.config.algorithm;
        let (genotypes, n_trials) = match &self.round {
            Round::Generation(generation) => {
                (generation.genotypes.clone(), algorithm.num_evaluations)
            }
            Round::Reevaluation(reevaluation) => {
                (reevaluation.genotypes(), algorithm.champion_trials)
            }
            Round::Judgement(judgement) => (judgement.genotypes(), algorithm.judgement_trials),
            Round::Over => return None,
        };
        Some(Batch::fitness(self.trial_set()?, genotypes, n_trials))
    }

    /// Learns from the results of the batch. Fails if evolution cannot continue.
    pub fn learn(&mut self, evaluated: &EvaluatedBatch) -> Result<(), String> {
        let values = &evaluated.values;
        self.round = match std::mem::replace(&mut self.round, Round::Over) {
            Round::Generation(generation) => {
                let told = Told::from_fitness(values.clone());
                let summary =
                    self.evolution.tell(generation, &told).map_err(|error| error.to_string())?;
                self.add_link(summary.statistics.best.get());
                let n_generations = self.evolution.n_generations();
                let is_due = self.is_last() || self.config.algorithm.compares_after(n_generations);
                match self.evolution.reevaluation().filter(|_| is_due) {
                    Some(reevaluation) => Round::Reevaluation(reevaluation),
                    None => self.next_generation(),
                }
            }
            Round::Reevaluation(mut reevaluation) => {
                reevaluation.learn(values);
                if reevaluation.is_over() {
                    self.evolution.set_champion(&reevaluation);
                    match self.evolution.judgement().filter(|_| self.is_last()) {
                        Some(judgement) => Round::Judgement(judgement),
                        None => self.next_generation(),
                    }
                } else {
                    Round::Reevaluation(reevaluation)
                }
            }
            Round::Judgement(judgement) => {
                let (champion, digest) = judgement.decide(values);
                let best = champion.judged.map_or(f64::NAN, |judged| judged.mean.get());
                let n_generations = self.evolution.n_generations();
                let digest = digest.to_string();
                self.links.push(Link { n_generations, is_last: true, digest, best });
                Round::Over
            }
            Round::Over => Round::Over,
        };
        Ok(())
    }

    fn is_last(&self) -> bool {
        self.evolution.n_generations() >= self.n_generations()
    }

    fn next_generation(&self) -> Round {
        if self.is_last() { Round::Over } else { Round::Generation(self.evolution.ask()) }
    }

    fn add_link(&mut self, best: f64) {
        let n_generations = self.evolution.n_generations();
        let digest = self.evolution.digest().to_string();
        self.links.push(Link { n_generations, is_last: false, digest, best });
    }
}
