//! Has the fleet recompute the fitness that an evolution recorded.

use std::sync::Arc;

use evolution::Genotype;
use experiment_file::limits;
use sim_core::TrialSet;

use engine::Batch;

use crate::{
    driver::DriverEvent, limits::EVALUATION_VALUES_MAX, priority::Priority, runs::Evaluation,
};

use super::{Control, ControlError, experiment_files::ExperimentFiles};

/// Genotypes whose fitness a client wants in trials of an evolution.
#[derive(Debug)]
pub struct FitnessOrder {
    /// The experiment file.
    pub config_json: String,
    /// Genes in \[0, 1\].
    pub genotypes: Vec<Genotype>,
    /// The trial set.
    pub trial_set: TrialSet,
    /// Trials of each genotype, from trial 0.
    pub n_trials: u32,
    /// Whether each trial has its descriptors after its fitness.
    pub with_descriptors: bool,
    /// Priority against other jobs.
    pub priority: Priority,
}

impl FitnessOrder {
    /// Bytes of memory that the order takes until its answer.
    fn len(&self) -> usize {
        let genes: usize = self.genotypes.iter().map(|genes| size_of_val(&**genes)).sum();
        // Lists take memory even without genes.
        2 * self.config_json.len() + size_of_val(&*self.genotypes) + genes
    }

    /// Checks an order completely; CPU-bound.
    fn check(self, files: &ExperimentFiles) -> Result<Evaluation, ControlError> {
        let Self { config_json, genotypes, trial_set, n_trials, with_descriptors, priority } = self;
        let invalid = |what: String| Err(ControlError::Invalid(what));
        if n_trials == 0 || n_trials > limits::TRIALS {
            return invalid(format!(
                "trial_count is {n_trials}, not within 1..={}",
                limits::TRIALS
            ));
        }
        let n_values = genotypes.len() * n_trials as usize;
        if n_values == 0 || n_values > EVALUATION_VALUES_MAX {
            return invalid(format!(
                "genotypes times trials are {n_values}, not within 1..={EVALUATION_VALUES_MAX}"
            ));
        }
        if trial_set.generation().is_some_and(|generation| generation > limits::GENERATIONS) {
            return invalid(format!("no run has more than {} generations", limits::GENERATIONS));
        }
        let file = files.check(&config_json)?;
        for genotype in &genotypes {
            let checked = file.simulation.check_genotype(genotype);
            checked.map_err(|error| ControlError::Invalid(error.to_string()))?;
        }
        let n_descriptors = if with_descriptors { file.simulation.n_descriptors() } else { 0 };
        if n_values * (1 + n_descriptors) > EVALUATION_VALUES_MAX {
            return invalid(format!(
                "genotypes times trials are {n_values}, each with {n_descriptors} descriptors; the \
                 limit is {EVALUATION_VALUES_MAX} numbers"
            ));
        }
        let genotypes = genotypes.into();
        let batch = Batch::described(trial_set, genotypes, n_trials, n_descriptors);
        Ok(Evaluation { name: file.name.clone(), spec: file.spec.clone(), batch, priority })
    }
}

impl Control {
    /// Has the fleet compute the fitness of each genotype in every trial. Dropping the future
    /// tells the driver that the client has gone.
    pub async fn fitness(&self, mut order: FitnessOrder) -> Result<Vec<Vec<f64>>, ControlError> {
        // Frees the spare capacity of lists that grew while they were read.
        order.genotypes.iter_mut().for_each(Vec::shrink_to_fit);
        order.genotypes.shrink_to_fit();
        let _place = self.requests.enter(order.len())?;
        let files = Arc::clone(&self.experiment_files);
        let evaluation =
            Box::new(self.requests.check(self.client, move |_| order.check(&files)).await??);
        let permits = Arc::clone(&self.evaluations);
        let _permit = permits.acquire_owned().await.expect("nobody closes the semaphore");
        let result = self.ask(|reply| DriverEvent::EvaluationRequested(evaluation, reply));
        result.await?.map_err(ControlError::EvaluationFailed)
    }
}
