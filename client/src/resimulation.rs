//! Repeats the simulations of a bundle.

use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use bundle::Batch;
use model::limits::EVALUATION_VALUES_MAX;
use sim_core::{EvaluateError, Isa, Simulation, TrialSet};
use swarm_proto::v1::{
    ComparisonTrials, EvaluateFitnessRequest, EvolutionTrials, Genes, evolution_trials::Trials,
};

use crate::{
    args::{IsaArgs, cores},
    connection::Connection,
    error::Error,
    settings::Settings,
    waiting,
};

/// Trials of a genotype that a thread simulates at once, side by side.
const TRIALS_PER_ITEM: u32 = 25;

/// Bytes of genes in one request to a coordinator.
const REQUEST_LEN: usize = 4 << 20;

/// The alternative without a fleet.
const HERE: &str = "without --coordinator and SWARM_COORDINATOR this command simulates in its \
                    own process";

/// The place of the simulation.
#[derive(Debug)]
pub enum Resimulation {
    /// In this process.
    Here { n_threads: usize, isa: Isa },
    /// On the fleet of a coordinator.
    Fleet { connection: Box<Connection>, config_json: String },
}

impl Resimulation {
    /// On the fleet of the coordinator that the command line or the environment names, else
    /// in this process.
    pub fn open(
        settings: Settings,
        config_json: &str,
        n_threads: Option<u16>,
        isa: IsaArgs,
    ) -> Result<Self, Error> {
        if settings.data_dir.is_none() && settings.has_coordinator() {
            let settings = settings.or_file()?;
            let connection = Box::new(Connection::at(&settings)?);
            return Ok(Self::Fleet { connection, config_json: config_json.to_owned() });
        }
        let n_threads = n_threads.map_or_else(cores, usize::from);
        Ok(Self::Here { n_threads, isa: isa.get() })
    }

    /// The numbers of the genotypes of a batch, trial by trial.
    pub async fn simulate(
        &self,
        simulation: &Simulation,
        batch: &Batch,
    ) -> Result<Vec<Vec<f64>>, Error> {
        match self {
            Self::Here { n_threads, isa } => {
                let simulation = simulation.clone().with_isa(*isa);
                let what = format!("simulating {}", batch.trial_set);
                waiting::busy(&what, || here(&simulation, batch, *n_threads))
                    .map_err(|error| Error::Flawed(format!("it cannot be simulated: {error}")))
            }
            Self::Fleet { connection, config_json } => fleet(connection, config_json, batch).await,
        }
    }
}

/// Number of genotypes in one request to a coordinator, which bounds the bytes of a request and
/// the numbers of its answer.
fn n_per_request(batch: &Batch) -> usize {
    let genotype_len = batch.genotypes.first().map_or(1, |genes| size_of_val(&**genes).max(1));
    let n_values = (batch.n_trials() as usize * batch.values_per_trial).max(1);
    (REQUEST_LEN / genotype_len).min(EVALUATION_VALUES_MAX / n_values).max(1)
}

/// Simulates on a fleet.
async fn fleet(
    connection: &Connection,
    config_json: &str,
    batch: &Batch,
) -> Result<Vec<Vec<f64>>, Error> {
    let mut fitness = Vec::new();
    for genotypes in batch.genotypes.chunks(n_per_request(batch)) {
        let request = EvaluateFitnessRequest {
            config_json: config_json.to_owned(),
            genotypes: genotypes.iter().map(|genes| Genes { values: genes.clone() }).collect(),
            trials: Some(trials(batch.trial_set)),
            trial_count: batch.n_trials(),
            priority: None,
            descriptors: batch.values_per_trial > 1,
        };
        fitness.extend(connection.fitness(request, HERE).await?);
    }
    Ok(fitness)
}

fn trials(trial_set: TrialSet) -> EvolutionTrials {
    let trials = match trial_set {
        TrialSet::Generation(generation) => Some(Trials::Generation(generation)),
        TrialSet::HeldOut { generation, block } => {
            Some(Trials::Comparison(ComparisonTrials { generation, block: block.into() }))
        }
        TrialSet::Judgement(generation) => Some(Trials::Judgement(generation)),
        // No evolution uses these trials.
        TrialSet::Evaluation => None,
    };
    EvolutionTrials { trials }
}

/// Simulates on some threads.
fn here(
    simulation: &Simulation,
    batch: &Batch,
    n_threads: usize,
) -> Result<Vec<Vec<f64>>, EvaluateError> {
    let items = items(batch);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..n_threads.min(items.len()) {
            scope.spawn(|| {
                while let Some((genotype, trials)) = items.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let genes = &batch.genotypes[*genotype];
                    let values = simulate(simulation, batch, genes, trials.clone());
                    let result = (*genotype, trials.start, values);
                    done.lock().unwrap_or_else(PoisonError::into_inner).push(result);
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|&(genotype, first, _)| (genotype, first));
    let mut fitness = vec![Vec::new(); batch.genotypes.len()];
    for (genotype, _, values) in done {
        fitness[genotype].extend(values?);
    }
    Ok(fitness)
}

/// The numbers of a genotype, trial by trial.
fn simulate(
    simulation: &Simulation,
    batch: &Batch,
    genes: &[f64],
    trials: Range<u32>,
) -> Result<Vec<f64>, EvaluateError> {
    if batch.values_per_trial == 1 {
        return simulation.evaluate(genes, batch.trial_set, trials);
    }
    let described = simulation.describe_while(genes, batch.trial_set, trials, &|| true)?;
    Ok(described.unwrap_or_default())
}

/// Genotypes and trials, in portions.
fn items(batch: &Batch) -> Vec<(usize, Range<u32>)> {
    let mut items = Vec::new();
    for (genotype, values) in batch.values.iter().enumerate() {
        let n_trials = (values.len() / batch.values_per_trial) as u32;
        for first in (0..n_trials).step_by(TRIALS_PER_ITEM as usize) {
            items.push((genotype, first..n_trials.min(first + TRIALS_PER_ITEM)));
        }
    }
    items
}

#[cfg(test)]
mod tests {
    use super::*;

    fn batch(n_genes: usize, n_trials: usize, values_per_trial: usize) -> Batch {
        Batch {
            trial_set: TrialSet::Generation(0),
            genotypes: vec![vec![0.5; n_genes]].into(),
            values: vec![vec![0.0; n_trials * values_per_trial]],
            values_per_trial,
        }
    }

    #[test]
    fn an_empty_variable_names_no_fleet() {
        let settings = Settings { coordinator: Some(String::new()), ..Settings::default() };
        let place = Resimulation::open(settings, "{}", None, IsaArgs::default());
        assert!(matches!(place, Ok(Resimulation::Here { .. })));
    }

    #[test]
    fn a_request_stays_below_the_bounds_of_the_coordinator() {
        let n_elites = n_per_request(&batch(10, 200, 3));
        assert_eq!(n_elites, EVALUATION_VALUES_MAX / 600, "the numbers of the answer bound it");
        assert_eq!(n_per_request(&batch(1024, 2, 1)), 512, "the bytes of the genes bound it");
        assert_eq!(n_per_request(&batch(1 << 20, 2, 1)), 1, "a request is never empty");
        assert_eq!(n_per_request(&batch(0, 0, 1)), EVALUATION_VALUES_MAX);
    }
}
