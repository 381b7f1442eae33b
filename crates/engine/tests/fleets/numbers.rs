//! Experiments whose fitness is a number that tells individuals and trials apart.

use std::{collections::BTreeSet, ops::Range, sync::Arc};

use engine::{Batch, EngineConfig, SharedGenotype, Verdict};
use evolution::Population;
use model::{ids::JobId, priority::Priority};
use sim_core::TrialSet;
pub use simulated_fleet::FleetModel;
use simulated_fleet::{Order, Work};

/// The failure that all workers report for a genotype that cannot be computed.
const FAILURE: &str = "it overflowed";

/// A fleet that computes such experiments.
pub type SimulatedFleet = simulated_fleet::SimulatedFleet<Numbers>;

/// What the workers and the referee make of the genotypes.
#[derive(Debug)]
pub struct Numbers {
    /// Genotypes that take down the worker that computes them.
    pub poisonous: BTreeSet<u64>,
    /// Time until a poisonous genotype takes its worker down, relative to the time of a result.
    pub poison_takes: u32,
    /// Genotypes that cannot be computed.
    pub failing: BTreeSet<u64>,
    pub has_referee: bool,
    /// Whether the referee returns NaN for every fitness.
    pub has_no_fitness: bool,
}

/// A fleet without workers.
pub fn simulated(model: FleetModel, config: EngineConfig) -> SimulatedFleet {
    let work = Numbers {
        poisonous: BTreeSet::new(),
        poison_takes: 1,
        failing: BTreeSet::new(),
        has_referee: true,
        has_no_fitness: false,
    };
    SimulatedFleet::new(model, config, work)
}

/// The fitness of an individual on a trial.
pub fn fitness(genotype: &[f64], trial: u32) -> f64 {
    genotype[0] * 1000.0 + f64::from(trial)
}

/// A population whose members can be told apart.
pub fn population(n: usize) -> Population {
    (0..n).map(|i| vec![i as f64]).collect()
}

/// Stands for the distribution of a trial set's genotypes; as long as five of them.
fn distribution(trial_set: TrialSet) -> Arc<[u8]> {
    let generation = trial_set.generation().expect("nothing else is drawn");
    generation.to_le_bytes().repeat(5).into()
}

fn values(order: &Order<'_>) -> Vec<f64> {
    let Range { start, end } = *order.trials;
    (start..end).map(|trial| fitness(order.genotype, trial)).collect()
}

impl Work for Numbers {
    fn place(&self, genotype: &SharedGenotype) -> u64 {
        genotype[0] as u64
    }

    fn compute(&mut self, order: &Order<'_>) -> Result<Vec<f64>, String> {
        match self.failing.contains(&self.place(order.genotype)) {
            true => Err(FAILURE.to_owned()),
            false => Ok(values(order)),
        }
    }

    fn takes_down_after(&self, genotype: &SharedGenotype) -> Option<u32> {
        self.poisonous.contains(&self.place(genotype)).then_some(self.poison_takes)
    }

    fn verdict(&mut self, order: &Order<'_>) -> Verdict {
        let individual = self.place(order.genotype);
        if !self.has_referee {
            Verdict::Unavailable("it is not there".to_owned())
        } else if self.poisonous.contains(&individual) {
            Verdict::Died("signal 11".to_owned())
        } else if self.failing.contains(&individual) {
            Verdict::Failed(FAILURE.to_owned())
        } else if self.has_no_fitness {
            Verdict::Values(vec![f64::NAN; order.trials.len()])
        } else {
            Verdict::Values(values(order))
        }
    }

    fn check_distribution(&self, trial_set: TrialSet, known: Option<&Arc<[u8]>>) {
        assert_eq!(
            known,
            Some(&distribution(trial_set)),
            "the worker has the distribution to draw from"
        );
    }
}

/// The coordinator's side.
pub trait Ask {
    fn submit(&mut self, id: JobId, weight: u32);
    fn ask(&mut self, id: JobId, generation: u64, population_size: usize, n_trials: u32);
}

impl Ask for SimulatedFleet {
    fn submit(&mut self, id: JobId, weight: u32) {
        let priority = Priority::new(weight).expect("within bounds");
        let name = id.to_string().replace(' ', "-").into();
        self.tell(|engine, now| engine.on_job_started(now, id, name, "spec".into(), priority));
    }

    fn ask(&mut self, id: JobId, generation: u64, population_size: usize, n_trials: u32) {
        let genotypes = population(population_size);
        let trial_set = TrialSet::Generation(generation);
        let batch = Batch::fitness(trial_set, genotypes, n_trials);
        let batch = Batch { distribution: Some(distribution(trial_set)), ..batch };
        self.tell(|engine, now| engine.on_batch_requested(now, id, batch));
    }
}
