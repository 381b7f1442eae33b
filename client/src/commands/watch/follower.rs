//! Reads the events of one experiment to its end, across interruptions of the coordinator.

use std::time::Duration;

use model::wire::has_ended;
use swarm_proto::v1::{Event, GenerationSummary, WatchExperimentResponse, event::Kind};
use swarm_telemetry::escape;
use tokio::{
    sync::mpsc,
    time::{Instant, sleep},
};
use tonic::Streaming;

use crate::{
    connection::{Connection, PATIENCE_WHILE_FOLLOWING as PATIENCE, backoff, present},
    error::{Error, is_transient, reason},
    finding::Finding,
};

/// A stream of at least this duration counts as contact with the coordinator, even
/// without an event.
const LASTING: Duration = Duration::from_secs(5);

/// News of an experiment, to be shown.
#[derive(Debug)]
pub enum News {
    /// A generation of the experiment of that number.
    Generation(u64, GenerationSummary),
    /// A line about the experiment of that number.
    Notice(u64, String),
    /// The obstacle of the experiment of that number; none: it has passed.
    Situation(u64, Option<Finding>),
    /// The coordinator cannot be reached.
    Lost(String),
    /// The experiment of that number has ended; the best fitness of its first generation.
    Ended(u64, Option<f64>),
    /// The experiment cannot be followed further.
    Failed(Error),
}

/// Reads the events of one experiment.
pub struct Follower {
    pub connection: Connection,
    pub experiment_id: u64,
    /// Receives the news.
    pub news: mpsc::Sender<News>,
}

/// How a stream of events ended.
enum StreamEnd {
    /// The experiment has ended.
    Final,
    /// The stream failed for this reason, which may be transient.
    Broken(String),
}

impl Follower {
    /// Follows the experiment to its end, from an event on. Returns the best fitness of
    /// the first generation, if that was among the events.
    pub async fn run(&self, next_sequence: u64) -> Result<Option<f64>, Error> {
        let mut seen = Seen { next_sequence, first_best: None, is_over: false };
        let mut backoff = backoff();
        let mut unreachable_since = None;
        loop {
            let reason = match self.connection.events(self.experiment_id, seen.next_sequence).await
            {
                Ok(events) => {
                    let (opened, sequence) = (Instant::now(), seen.next_sequence);
                    match self.read(events, &mut seen).await? {
                        StreamEnd::Final => return Ok(seen.first_best),
                        StreamEnd::Broken(reason) => {
                            // A stream that breaks at once is no contact.
                            if seen.next_sequence > sequence || opened.elapsed() > LASTING {
                                backoff.reset();
                                unreachable_since = None;
                            }
                            reason
                        }
                    }
                }
                Err(status) if is_transient(&status) => reason(&status),
                Err(status) => return Err(self.connection.error(&status)),
            };
            let now = Instant::now();
            if unreachable_since.is_none() {
                self.tell(News::Lost(format!(
                    "lost the connection to the coordinator ({reason}); trying to reconnect for {} s",
                    PATIENCE.as_secs()
                )))
                .await;
            }
            let since = *unreachable_since.get_or_insert(now);
            if now - since >= self.connection.patience() {
                return Err(self.connection.unreachable(reason));
            }
            sleep(backoff.next_delay(rand::random())).await;
        }
    }

    async fn read(
        &self,
        mut events: Streaming<WatchExperimentResponse>,
        seen: &mut Seen,
    ) -> Result<StreamEnd, Error> {
        loop {
            match events.message().await {
                Ok(Some(response)) => {
                    self.show(present(response.event)?, seen).await;
                }
                Ok(None) if seen.is_over => return Ok(StreamEnd::Final),
                Ok(None) => {
                    return Ok(StreamEnd::Broken("the coordinator ended the stream".into()));
                }
                Err(status) if is_transient(&status) => {
                    return Ok(StreamEnd::Broken(reason(&status)));
                }
                Err(status) => return Err(self.connection.error(&status)),
            }
        }
    }

    async fn tell(&self, news: News) {
        // If the receiver is gone, it also ends this task.
        let _ = self.news.send(news).await;
    }

    /// Shows an event once.
    async fn show(&self, event: Event, seen: &mut Seen) {
        if event.sequence < seen.next_sequence {
            return;
        }
        seen.next_sequence = event.sequence + 1;
        match event.kind {
            Some(Kind::GenerationCompleted(summary)) => {
                if summary.generation == 0 {
                    seen.first_best = Some(summary.best);
                }
                self.tell(News::Generation(self.experiment_id, summary)).await;
            }
            Some(Kind::StateChanged(change)) => {
                seen.is_over = has_ended(change.state());
            }
            Some(Kind::Notice(notice)) => {
                let text = escape(&notice.message).into_owned();
                self.tell(News::Notice(self.experiment_id, text)).await;
            }
            // A kind of event of newer versions.
            None => {}
        }
    }
}

/// The progress of reading the streams.
struct Seen {
    next_sequence: u64,
    first_best: Option<f64>,
    /// Whether an event has said that the experiment ended.
    is_over: bool,
}
