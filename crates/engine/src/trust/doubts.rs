//! Turns failures, losses and disagreements into questions for the referee.

use std::sync::Arc;

use model::ids::{JobId, WorkerId};

use crate::Instant;

use super::{
    super::{
        Engine, in_flight::AssignedItem, item::Item, known_results::Disagreement, results::NoResult,
    },
    questions::{Doubt, Party, place, wrong},
};

/// Most open questions per job about items that were in progress when workers were lost.
const LOSS_QUESTIONS_MAX: usize = 4;

impl Engine {
    /// A worker reports that an item fails. A true failure happens everywhere, so the referee can
    /// check it.
    pub(crate) fn on_failure_reported(
        &mut self,
        now: Instant,
        id: WorkerId,
        assignment: AssignedItem,
        message: String,
    ) {
        let (job, item) = (assignment.job, assignment.item.clone());
        let reporter = self.party(id);
        if let Some(confirmed) = self.confirmation(job, &item, &reporter, &message) {
            return self.fail(now, job, &item, &confirmed);
        }
        // A worker that is in doubt already adds no new question.
        let is_doubted = self.is_doubted(id);
        if assignment.is_audit() || is_doubted || self.batch(job).is_none() {
            self.on_no_result(now, assignment, NoResult::TakenBack);
        }
        if !is_doubted {
            self.ask_referee(job, item, Doubt::Failure { reporter, message });
        }
    }

    /// Two workers differ about the same trial, so one of them is faulty, and the referee finds
    /// out which. Neither gets work meanwhile.
    pub(crate) fn on_disagreement(
        &mut self,
        now: Instant,
        job: JobId,
        second: WorkerId,
        item: &Item,
        disagreement: Disagreement,
    ) {
        let Disagreement { first, trial, values: [first_values, second_values] } = disagreement;
        let second = self.party(second);
        let Some(batch) = self.batch(job) else { return };
        let item = Item { individual: item.individual, trials: trial..trial + 1 };
        let Some(first) = first else {
            let reason =
                wrong(&second_values, &first_values, &place(&item, batch.request.trial_set));
            return self.put_in_quarantine(now, &second, &reason);
        };
        // Their other results are compared after the verdict, except late and recalled ones.
        let doubted = self.trust.questions.doubted();
        if doubted.contains(&*first.name) || doubted.contains(&*second.name) {
            return;
        }
        let parties = [(first, first_values), (second, second_values)];
        self.ask_referee(job, item, Doubt::Disagreement { parties });
    }

    /// Whether the referee may compute an item because workers were lost while they computed it.
    /// The referee computes one item at a time, so it cannot help with many.
    pub(crate) fn may_ask_about_losses(&self, job: JobId, item: &Item) -> bool {
        let is_open =
            self.batch(job).is_some_and(|batch| batch.duplicable(item).as_ref() == Some(item));
        let n_asked = self.trust.questions.n_about(job, |doubt| matches!(doubt, Doubt::Losses));
        is_open && n_asked < LOSS_QUESTIONS_MAX
    }

    /// Whether an open question concerns a worker already.
    fn is_doubted(&self, id: WorkerId) -> bool {
        self.workers.get(&id).is_some_and(|worker| worker.obstacles.question.is_some())
    }

    /// A connected worker as the party of a question.
    pub(crate) fn party(&self, id: WorkerId) -> Party {
        Party { id, name: Arc::clone(self.workers[&id].name()) }
    }
}
