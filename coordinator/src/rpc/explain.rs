//! Converts explanations of experiments to messages.

use std::time::Duration;

use sim_core::TrialSet;
use swarm_proto::v1::{
    ExplainExperimentResponse, HeldItems, RefereeQuestion, Round, WithheldWorker,
};

use engine::BatchActivity;

use crate::{control::Explanation, ids::JobId};

/// An explanation for clients.
pub fn explanation(explanation: Explanation) -> ExplainExperimentResponse {
    let Explanation { experiment, activity, shortage, notices, store_trouble, incompatible } =
        explanation;
    let rivals = activity.rivals.into_iter().filter_map(JobId::experiment);
    ExplainExperimentResponse {
        experiment: Some(experiment.into()),
        round: activity.batch.and_then(round),
        workers: activity.n_workers as u32,
        workers_available: activity.n_workers_available as u32,
        workers_of_others: activity.n_workers_of_others as u32,
        withheld: activity.withheld.into_iter().map(withheld).collect(),
        questions: activity.questions.into_iter().map(question).collect(),
        rivals: rivals.map(|id| id.0).collect(),
        notices: notices.into_iter().map(Into::into).collect(),
        store_trouble: store_trouble.unwrap_or_default(),
        incompatible: incompatible.unwrap_or_default(),
        shortage: shortage.map(|shortage| shortage.to_string()).unwrap_or_default(),
    }
}

fn withheld(worker: engine::WithheldWorker) -> WithheldWorker {
    WithheldWorker {
        worker_id: worker.worker.0,
        worker_name: worker.name,
        reason: worker.reason,
        quarantined: worker.is_quarantined,
    }
}

fn question(question: engine::OpenQuestion) -> RefereeQuestion {
    let engine::OpenQuestion { individual, doubt, trouble } = question;
    RefereeQuestion { individual, doubt, trouble: trouble.unwrap_or_default() }
}

/// A batch of an experiment; `None` for a batch of an evaluation.
fn round(activity: BatchActivity) -> Option<Round> {
    let ms = |duration: Duration| duration.as_millis() as u64;
    Some(Round {
        generation: activity.trial_set.generation()?,
        held_out: matches!(activity.trial_set, TrialSet::HeldOut { .. }),
        judgement: matches!(activity.trial_set, TrialSet::Judgement(_)),
        episodes: activity.n_episodes as u64,
        episodes_left: activity.n_episodes_left as u64,
        items_queued: activity.n_items_queued as u32,
        audits_waiting: activity.n_audits_waiting as u32,
        individuals_failing: activity.n_individuals_failing as u32,
        held: activity
            .shares
            .into_iter()
            .map(|share| HeldItems {
                worker_id: share.worker.0,
                worker_name: share.name,
                items: share.n_items as u32,
                held_ms: ms(share.oldest_for),
                silent_ms: ms(share.silent_for),
            })
            .collect(),
        running_ms: ms(activity.running_for),
    })
}
