//! Evaluates a genotype on the fleet in many trials, with the measures of every step.

use std::sync::Arc;

use evolution::{ALGORITHMS, Genotype};
use experiment_file::{ExperimentConfig, limits};
use sim_core::Simulation;
use tokio::sync::OwnedSemaphorePermit;

use engine::Batch;

use crate::{
    driver::DriverEvent,
    limits::{EVALUATION_VALUES_MAX, TRIAL_VALUES_MAX},
    priority::Priority,
    runs::Evaluation,
};

use super::{Control, ControlError, requests::RequestPlace};

/// A client's request to evaluate one genotype.
#[derive(Debug)]
pub struct EvaluationOrder {
    /// The experiment file.
    pub config_json: String,
    /// Genes in \[0, 1\].
    pub genotype: Genotype,
    /// Trials, from trial 0.
    pub n_trials: u32,
    /// Priority against other jobs.
    pub priority: Priority,
}

/// An order that has passed all checks.
#[derive(Debug)]
pub struct CheckedEvaluation {
    /// For the driver.
    evaluation: Evaluation,
    /// Names of the measures of the task.
    pub measures: Vec<String>,
    /// Steps of an episode.
    pub n_steps: u32,
    place: RequestPlace,
}

/// An evaluated genotype. It occupies one of the places for evaluations until it is dropped,
/// which bounds the numbers in memory.
#[derive(Debug)]
pub struct Evaluated {
    /// The numbers of all trials, one trial after the other.
    values: Vec<f64>,
    /// Numbers per trial.
    n_values: usize,
    _permit: OwnedSemaphorePermit,
    _place: RequestPlace,
}

impl EvaluationOrder {
    /// Bytes of memory that the order takes until its answer.
    fn len(&self) -> usize {
        2 * self.config_json.len() + size_of_val(&*self.genotype)
    }

    /// Checks an order completely; CPU-bound.
    fn check(self, place: RequestPlace) -> Result<CheckedEvaluation, ControlError> {
        let Self { config_json, genotype, n_trials, priority } = self;
        if n_trials == 0 || n_trials > limits::TRIALS {
            let message = format!("trial_count is {n_trials}, not within 1..={}", limits::TRIALS);
            return Err(ControlError::Invalid(message));
        }
        let (config, _) = ExperimentConfig::from_json(&config_json, "", ALGORITHMS)?;
        let simulation = Simulation::compile(&config)?;
        simulation
            .check_genotype(&genotype)
            .map_err(|error| ControlError::Invalid(error.to_string()))?;
        let n_values = simulation.values_per_trial();
        let n_all = n_values * n_trials as usize;
        if n_values > TRIAL_VALUES_MAX || n_all > EVALUATION_VALUES_MAX {
            return Err(ControlError::Invalid(format!(
                "{n_values} numbers per trial and {n_all} together are more than the limits of \
                 {TRIAL_VALUES_MAX} and {EVALUATION_VALUES_MAX}; take fewer steps or trials"
            )));
        }
        let spec: Arc<str> = config.to_canonical_json().into();
        Ok(CheckedEvaluation {
            measures: simulation.measure_names().iter().map(ToString::to_string).collect(),
            n_steps: simulation.n_steps(),
            evaluation: Evaluation {
                name: config.name.as_str().into(),
                spec,
                batch: Batch::measures(genotype, n_trials, n_values),
                priority,
            },
            place,
        })
    }
}

impl Evaluated {
    /// For each trial, its fitness and the measures of all steps.
    pub fn trials(&self) -> impl Iterator<Item = (f64, &[f64])> {
        self.values.chunks_exact(self.n_values).map(|values| (values[0], &values[1..]))
    }
}

impl Control {
    /// Checks an order completely.
    pub async fn check_evaluation(
        &self,
        mut order: EvaluationOrder,
    ) -> Result<CheckedEvaluation, ControlError> {
        // Frees spare capacity, because the order may wait long for its check.
        order.genotype.shrink_to_fit();
        let place = self.requests.enter(order.len())?;
        self.requests.check(self.client, move |_| order.check(place)).await?
    }

    /// Has the fleet evaluate a genotype, after waiting for one of the places for evaluations.
    /// Dropping the future tells the driver that the client has gone.
    pub async fn evaluate(&self, checked: CheckedEvaluation) -> Result<Evaluated, ControlError> {
        let CheckedEvaluation { evaluation, place, .. } = checked;
        let n_values = evaluation.batch.values_per_trial;
        let permits = Arc::clone(&self.evaluations);
        let permit = permits.acquire_owned().await.expect("nobody closes the semaphore");
        let result =
            self.ask(|reply| DriverEvent::EvaluationRequested(Box::new(evaluation), reply));
        let mut values = result.await?.map_err(ControlError::EvaluationFailed)?;
        let values = values.swap_remove(0);
        Ok(Evaluated { values, n_values, _permit: permit, _place: place })
    }
}
