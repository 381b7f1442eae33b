//! Obstacles of experiments, while they are followed.

use std::time::Duration;

use model::wire::has_ended;
use swarm_proto::v1::{ExplainExperimentResponse, WatchExplanationResponse};
use tokio::{
    sync::mpsc,
    time::{sleep, timeout},
};
use tonic::Streaming;

use super::follower::News;
use crate::{
    connection::{Connection, backoff},
    error::is_transient,
    finding::{Finding, stall},
};

/// An obstacle that passes within this time is not reported.
const GRACE: Duration = Duration::from_secs(1);

/// Reports obstacles of one experiment after the other, because obstacles of the fleet concern
/// all of them. Ends when all experiments have ended, or if the coordinator cannot explain.
pub async fn tell(connection: Connection, ids: Vec<u64>, news: mpsc::Sender<News>) {
    for id in ids {
        let mut told = None;
        let mut backoff = backoff();
        loop {
            match connection.explanations(id).await {
                Ok(explanations) => {
                    if (Reader { connection: &connection, id, news: &news, told: &mut told })
                        .read(explanations)
                        .await
                    {
                        break;
                    }
                }
                // The follower of the events reports a lost connection.
                Err(status) if is_transient(&status) => {}
                Err(_) => return,
            }
            sleep(backoff.next_delay(rand::random())).await;
        }
    }
}

/// Reads the explanations of one experiment.
struct Reader<'a> {
    connection: &'a Connection,
    id: u64,
    news: &'a mpsc::Sender<News>,
    /// The last reported obstacle; none: no obstacle.
    told: &'a mut Option<Finding>,
}

impl Reader<'_> {
    /// Reports obstacles that change and last. Returns whether the experiment has ended.
    async fn read(&mut self, mut explanations: Streaming<WatchExplanationResponse>) -> bool {
        let mut found = self.told.clone();
        loop {
            let next = if found == *self.told {
                Ok(explanations.message().await)
            } else {
                timeout(GRACE, explanations.message()).await
            };
            match next {
                Ok(Ok(Some(WatchExplanationResponse { explanation: Some(explanation) }))) => {
                    if is_over(&explanation) {
                        return true;
                    }
                    found = stall(&explanation, self.connection.address());
                    if let Some(finding) = &mut found {
                        finding.name_place(self.connection);
                    }
                }
                Ok(_) => return false,
                // The obstacle has lasted.
                Err(_) => {
                    self.told.clone_from(&found);
                    // If the receiver is gone, it also ends this task.
                    let _ = self.news.send(News::Situation(self.id, found.clone())).await;
                }
            }
        }
    }
}

fn is_over(explanation: &ExplainExperimentResponse) -> bool {
    explanation.experiment.as_ref().is_none_or(|experiment| has_ended(experiment.state()))
}
