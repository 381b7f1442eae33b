//! Evaluations: work that nobody stores. The client that asked waits for the result;
//! if it has gone, the work is dropped.

use std::sync::Arc;

use crate::{engine::Batch, ids::EvaluationId, priority::Priority};

use super::{Command, Runs};

/// Genotypes to be evaluated; everything about them has been checked.
#[derive(Debug)]
pub struct Evaluation {
    /// The experiment's name.
    pub name: Arc<str>,
    /// The canonical configuration, for workers.
    pub spec: Arc<str>,
    /// What is to be evaluated.
    pub batch: Batch,
    /// Its share of the fleet.
    pub priority: Priority,
}

impl Runs {
    /// A client wants genotypes evaluated. Returns what the evaluation is called.
    pub fn on_evaluation_requested(&mut self, evaluation: Evaluation) -> EvaluationId {
        let Evaluation { name, spec, batch, priority } = evaluation;
        self.n_evaluations += 1;
        let id = EvaluationId(self.n_evaluations);
        self.evaluations.insert(id);
        self.commands.extend([
            Command::StartJob { job: id.into(), name, spec, priority, is_paused: false },
            Command::Evaluate { job: id.into(), batch },
        ]);
        id
    }

    /// An evaluation has its numbers, of each genotype those of all trials one after the
    /// other, or has failed.
    pub fn on_evaluation_finished(
        &mut self,
        id: EvaluationId,
        result: Result<Vec<Vec<f64>>, String>,
    ) {
        if self.evaluations.remove(&id) {
            self.commands.extend([
                Command::EndJob { job: id.into() },
                Command::AnswerEvaluation { evaluation: id, result },
            ]);
        }
    }

    /// The client of an evaluation has gone.
    pub fn on_evaluation_abandoned(&mut self, id: EvaluationId) {
        if self.evaluations.remove(&id) {
            self.commands.push_back(Command::EndJob { job: id.into() });
        }
    }
}
