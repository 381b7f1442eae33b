//! Evaluations: work that nobody stores. Whoever asked waits for the result; if
//! nobody waits any more, the work is dropped.

use std::sync::Arc;

use tokio::sync::oneshot;
use tracing::{debug, info};

use crate::{clock, engine::Batch, ids::EvaluationId, priority::Priority};
use evolution::Genotype;

use super::Driver;

/// Gets the numbers of all trials, one trial after the other, or why there are none.
pub type Reply = oneshot::Sender<Result<Vec<f64>, String>>;

/// A genotype to be evaluated; everything about it has been checked.
#[derive(Debug)]
pub struct Evaluation {
    /// The canonical configuration, for workers.
    pub spec: Arc<str>,
    /// Its genes.
    pub genotype: Genotype,
    /// Trials, from 0.
    pub n_trials: u32,
    /// Numbers per trial.
    pub n_values: usize,
    /// Its share of the fleet.
    pub priority: Priority,
    /// Who waits.
    pub reply: Reply,
}

impl Driver {
    /// Has the fleet evaluate a genotype.
    pub(super) fn evaluate(&mut self, evaluation: Evaluation) {
        let Evaluation { spec, genotype, n_trials, n_values, priority, reply } = evaluation;
        self.n_evaluations += 1;
        let id = EvaluationId(self.n_evaluations);
        debug!(evaluation = %id, trials = n_trials, "evaluation starts");
        self.evaluations.insert(id, reply);
        self.engine.on_job_started(id.into(), spec, priority);
        let batch = Batch::measures(genotype, n_trials, n_values);
        self.engine.on_batch_requested(clock::now(), id.into(), batch);
    }

    /// Tells who waits how an evaluation has ended.
    pub(super) fn finish_evaluation(&mut self, id: EvaluationId, result: Result<Vec<f64>, String>) {
        self.engine.on_job_ended(clock::now(), id.into());
        if let Some(reply) = self.evaluations.remove(&id) {
            // Whoever has gone meanwhile does not want to know.
            let _ = reply.send(result);
        }
    }

    /// Ends evaluations whose clients have gone.
    pub(super) fn drop_abandoned_evaluations(&mut self) {
        let abandoned = self.evaluations.extract_if(.., |_, reply| reply.is_closed());
        for (id, _) in abandoned.collect::<Vec<_>>() {
            info!(evaluation = %id, "evaluation dropped: its client has gone");
            self.engine.on_job_ended(clock::now(), id.into());
        }
    }
}
