//! Streams explanations of an experiment whenever its situation changes, and news of all
//! experiments.

use tokio::{
    sync::{mpsc, watch},
    time::{sleep, timeout},
};
use tokio_util::sync::CancellationToken;

use crate::{
    driver::DriverEvent,
    ids::ExperimentId,
    limits::{BARRIER_AFTER, NEWS_PAUSE, SITUATION_INTERVAL, WATCH_PATIENCE, WATCH_QUEUE_LEN},
    store::ExperimentState,
};

use super::{Control, ControlError, Explanation};

/// The parts of an explanation whose change leads to another message.
#[derive(Debug, PartialEq)]
struct Situation {
    state: ExperimentState,
    reason: String,
    has_workers: bool,
    has_workers_available: bool,
    has_workers_of_others: bool,
    /// The workers that get no items, and why.
    withheld: Vec<(String, String)>,
    has_store_trouble: bool,
    is_short_of_memory: bool,
    has_referee_trouble: bool,
    stage: Stage,
}

/// The reason why a round waits.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// It does not wait, or not yet for long.
    None,
    /// For workers that compute other experiments.
    Others,
    /// For its last items, for a long time.
    Barrier,
    /// For a second worker, which audits need.
    Audits,
}

impl Situation {
    fn from_explanation(explanation: &Explanation) -> Self {
        let Explanation { experiment, activity, shortage, store_trouble, .. } = explanation;
        let withheld = activity.withheld.iter();
        Self {
            state: experiment.state,
            reason: experiment.reason.clone(),
            has_workers: activity.n_workers > 0,
            has_workers_available: activity.n_workers_available > 0,
            has_workers_of_others: activity.n_workers_of_others > 0,
            withheld: withheld.map(|worker| (worker.name.clone(), worker.reason.clone())).collect(),
            has_store_trouble: store_trouble.is_some(),
            is_short_of_memory: shortage.is_some(),
            has_referee_trouble: activity
                .questions
                .iter()
                .any(|question| question.trouble.is_some()),
            stage: Stage::from_explanation(explanation),
        }
    }
}

impl Stage {
    fn from_explanation(Explanation { activity, .. }: &Explanation) -> Self {
        let Some(batch) = &activity.batch else { return Self::None };
        let is_long = batch.shares.iter().any(|share| share.oldest_for >= BARRIER_AFTER);
        match (batch.n_items_queued, batch.shares.is_empty()) {
            (0, false) if is_long => Self::Barrier,
            (0, true) if batch.n_audits_waiting > 0 => Self::Audits,
            (1.., true) if !activity.rivals.is_empty() => Self::Others,
            _ => Self::None,
        }
    }
}

impl Control {
    /// Explains an experiment at once, and again whenever its situation changes, until it has
    /// ended. Dropping the receiver also ends the explanations.
    pub async fn watch_explanation(
        &self,
        id: ExperimentId,
        shutdown: CancellationToken,
    ) -> Result<mpsc::Receiver<Result<Explanation, ControlError>>, ControlError> {
        let first = self.explain(id).await?;
        let (outbox, inbox) = mpsc::channel(WATCH_QUEUE_LEN);
        let control = self.clone();
        tokio::spawn(async move {
            let last = outbox.clone();
            let error = tokio::select! {
                () = shutdown.cancelled() => ControlError::ShuttingDown,
                () = outbox.closed() => return,
                result = control.send_explanations(id, first, &outbox) => match result {
                    Ok(()) => return,
                    Err(error) => error,
                },
            };
            // If the channel is full, the client does not read.
            let _ = last.try_send(Err(error));
        });
        Ok(inbox)
    }

    async fn send_explanations(
        &self,
        id: ExperimentId,
        first: Explanation,
        outbox: &mpsc::Sender<Result<Explanation, ControlError>>,
    ) -> Result<(), ControlError> {
        let mut stored = self.store.news();
        let mut fleet = self.ask(DriverEvent::FleetWatched).await?;
        let mut explanation = first;
        let mut known = None;
        loop {
            let situation = Situation::from_explanation(&explanation);
            let has_ended = !situation.state.is_unfinished();
            if known.as_ref() != Some(&situation) {
                if outbox.send_timeout(Ok(explanation), WATCH_PATIENCE).await.is_err() {
                    return Ok(());
                }
                known = Some(situation);
            }
            if has_ended {
                return Ok(());
            }
            sleep(NEWS_PAUSE).await;
            // Some situations arise by time alone, such as a barrier.
            let _ = timeout(SITUATION_INTERVAL, changed(&mut stored, &mut fleet)).await;
            explanation = self.explain(id).await?;
        }
    }

    /// Sends a message at once, and again after each change of the store. Dropping the receiver
    /// ends it.
    pub fn watch_news(&self, shutdown: CancellationToken) -> mpsc::Receiver<()> {
        let (outbox, inbox) = mpsc::channel(1);
        let mut stored = self.store.news();
        tokio::spawn(async move {
            let sending = async {
                while outbox.send(()).await.is_ok() {
                    sleep(NEWS_PAUSE).await;
                    if stored.changed().await.is_err() {
                        return;
                    }
                }
            };
            tokio::select! {
                () = shutdown.cancelled() => {}
                () = outbox.closed() => {}
                () = sending => {}
            }
        });
        inbox
    }
}

/// Waits for a change of the store or of the fleet.
async fn changed(stored: &mut watch::Receiver<u64>, fleet: &mut watch::Receiver<u64>) {
    tokio::select! {
        _ = stored.changed() => {}
        _ = fleet.changed() => {}
    }
}
