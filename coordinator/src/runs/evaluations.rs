//! Evaluations, whose results are not stored. A client waits for them; if it has gone, the
//! coordinator drops the work.

use std::sync::Arc;

use engine::Batch;

use crate::{ids::EvaluationId, priority::Priority};

use super::{Command, Runs};

/// Genotypes to evaluate, completely checked.
#[derive(Debug)]
pub struct Evaluation {
    /// The experiment's name.
    pub name: Arc<str>,
    /// The canonical configuration, for workers.
    pub spec: Arc<str>,
    /// The genotypes and trials.
    pub batch: Batch,
    /// Its priority.
    pub priority: Priority,
}

impl Runs {
    /// A client requests an evaluation. Returns the evaluation's id.
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

    /// An evaluation has ended, with the numbers of each genotype, one trial after the other, or
    /// has failed.
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
