//! What an experiment is doing, or waits for: gathered from the driver and the
//! store.

use std::time::Duration;

use sim_core::TrialSet;
use swarm_proto::v1::{ExplainExperimentResponse, HeldItems, Round};
use tokio::sync::oneshot;
use tonic::Status;

use crate::{
    driver::{Event, EventSender},
    engine::BatchActivity,
    ids::JobId,
    shared_store::SharedStore,
    store::{EventKind, Experiment},
};

use super::{convert, shutting_down, store_status};

/// Events among which notices are looked for.
const EVENTS_MAX: u32 = 100;
/// Notices that are shown.
const NOTICES_MAX: usize = 10;

/// Says what an experiment is doing.
pub async fn explain(
    events: &EventSender,
    store: &SharedStore,
    experiment: Experiment,
) -> Result<ExplainExperimentResponse, Status> {
    let (reply, activity) = oneshot::channel();
    let request = Event::ActivityRequested(experiment.id, reply);
    events.send(request).await.map_err(|_| shutting_down())?;
    let activity = activity.await.map_err(|_| shutting_down())?;
    let incompatible = if experiment.fingerprint == sim_core::FINGERPRINT {
        String::new()
    } else {
        format!(
            "it was started with \"{}\", this coordinator is \"{}\"",
            experiment.fingerprint,
            sim_core::FINGERPRINT
        )
    };
    let rivals = activity.rivals.into_iter().filter_map(JobId::experiment);
    Ok(ExplainExperimentResponse {
        notices: notices(store, &experiment).await?,
        experiment: Some(convert::experiment(experiment)),
        round: activity.batch.and_then(round),
        workers: activity.n_workers as u32,
        workers_available: activity.n_workers_available as u32,
        rivals: rivals.map(|id| id.0).collect(),
        store_trouble: store.trouble().unwrap_or_default(),
        incompatible,
    })
}

async fn notices(
    store: &SharedStore,
    experiment: &Experiment,
) -> Result<Vec<swarm_proto::v1::Event>, Status> {
    let id = experiment.id;
    let from_sequence = (experiment.last_sequence + 1).saturating_sub(EVENTS_MAX.into());
    let mut notices = store
        .read(move |store| store.events(id, from_sequence, EVENTS_MAX))
        .await
        .map_err(store_status)?;
    notices.retain(|event| matches!(event.kind, EventKind::Notice(_)));
    let latest = notices.split_off(notices.len().saturating_sub(NOTICES_MAX));
    Ok(latest.into_iter().map(convert::event).collect())
}

/// A batch of an experiment; none if it is an evaluation's.
fn round(activity: BatchActivity) -> Option<Round> {
    let ms = |duration: Duration| duration.as_millis() as u64;
    Some(Round {
        generation: activity.trial_set.generation()?,
        held_out: matches!(activity.trial_set, TrialSet::HeldOut(_)),
        episodes: activity.n_episodes as u64,
        episodes_left: activity.n_episodes_left as u64,
        items_queued: activity.n_items_queued as u32,
        individuals_failing: activity.n_individuals_failing as u32,
        held: activity
            .held
            .into_iter()
            .map(|held| HeldItems {
                worker_id: held.worker.0,
                worker_name: held.name,
                items: held.n_items as u32,
                held_ms: ms(held.held_for),
                silent_ms: ms(held.silent_for),
            })
            .collect(),
        running_ms: ms(activity.running_for),
    })
}
