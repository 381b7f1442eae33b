//! Follows an experiment to its end, across interruptions of the coordinator.

use std::time::Duration;

use clap::Args;
use swarm_proto::v1::{Event, Experiment, ExperimentState, GetChampionResponse, event::Kind};
use swarm_telemetry::escape;
use tokio::time::{Instant, sleep};
use tonic::Streaming;

use super::Remote;
use crate::{
    args::ExperimentId,
    connection::{Connection, PATIENCE_WHILE_FOLLOWING as PATIENCE, backoff, present},
    error::{Error, is_transient, reason},
    json::{self, has_ended},
    progress::Progress,
    text,
};

/// A stream that lasted so long counts as contact with the coordinator, even if it
/// brought no event.
const LASTING: Duration = Duration::from_secs(5);

/// An experiment that has ended.
#[derive(Debug)]
pub struct Followed {
    pub experiment: Experiment,
    /// None if the experiment ended before its first generation was complete.
    pub champion: Option<GetChampionResponse>,
    /// Best fitness of the first generation.
    pub first_best: Option<f64>,
}

/// Follow an experiment from its first generation to its end.
///
/// Generations that are complete already are shown first. If the coordinator
/// becomes unreachable, this tries for a minute to reach it again. Interrupting
/// this command does not interrupt the experiment.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct WatchArgs {
    #[command(flatten)]
    experiment: ExperimentId,
}

const HELP: &str = "\
With --output json it prints a line per generation (numbered from 0), then one
with state, digest and champion.

Example:
  swarmctl watch 3 --output json | jq .best";

impl Remote for WatchArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        watch(connection, self.experiment.id, progress).await
    }
}

/// Follows an experiment to its end and prints how it ended.
pub async fn watch(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let followed = follow(connection, experiment_id, progress).await?;
    let Followed { experiment, champion, first_best } = &followed;
    progress.print(&if progress.is_json() {
        json::line(&json::EndLine::new(experiment, champion.as_ref()))
    } else {
        text::end(experiment, *first_best, champion.as_ref())
    })?;
    success(experiment)
}

/// Shows an experiment's events until it ends.
pub async fn follow(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<Followed, Error> {
    progress.begin(&connection.experiment(experiment_id).await?);
    let connection = connection.with_patience(PATIENCE);
    let follower =
        Follower { connection: &connection, experiment_id, progress: Some(&mut *progress) };
    let first_best = follower.run(1).await?;
    progress.clear();
    let experiment = connection.experiment(experiment_id).await?;
    let champion = match connection.champion(experiment_id).await {
        Ok(champion) => Some(champion),
        Err(Error::NotFound(_)) => None,
        Err(error) => return Err(error),
    };
    Ok(Followed { experiment, champion, first_best })
}

/// An experiment once it has ended; shows nothing.
pub async fn ended(connection: &Connection, experiment: Experiment) -> Result<Experiment, Error> {
    if has_ended(experiment.state()) {
        return Ok(experiment);
    }
    let (experiment_id, next) = (experiment.id, experiment.last_sequence + 1);
    let connection = &connection.with_patience(PATIENCE);
    Follower { connection, experiment_id, progress: None }.run(next).await?;
    connection.experiment(experiment_id).await
}

/// Success if the experiment completed; fails if it failed or was cancelled.
pub fn success(experiment: &Experiment) -> Result<(), Error> {
    let (id, reason) = (experiment.id, experiment.reason.clone());
    match experiment.state() {
        ExperimentState::Completed => Ok(()),
        ExperimentState::Cancelled => Err(Error::Cancelled { id, reason }),
        _ => Err(Error::Failed { id, reason }),
    }
}

struct Follower<'a> {
    connection: &'a Connection,
    experiment_id: u64,
    /// Shows what happens, if anybody looks.
    progress: Option<&'a mut Progress>,
}

/// How a stream of events ended.
enum StreamEnd {
    /// The experiment has ended.
    Final,
    /// For this reason, which may be transient.
    Broken(String),
}

impl Follower<'_> {
    /// Follows from an event on. Returns the best fitness of the first generation, if that
    /// was among the events, once the experiment has ended.
    async fn run(mut self, next_sequence: u64) -> Result<Option<f64>, Error> {
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
                            // A stream that opens and breaks at once is no contact.
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
            let since = *unreachable_since.get_or_insert_with(|| {
                self.remark(&format!(
                    "lost the connection to the coordinator ({reason}); trying to reconnect for {} s",
                    PATIENCE.as_secs()
                ));
                now
            });
            if now - since >= self.connection.patience() {
                return Err(self.connection.unreachable(reason));
            }
            sleep(backoff.next_delay(rand::random())).await;
        }
    }

    async fn read(
        &mut self,
        mut events: Streaming<swarm_proto::v1::WatchExperimentResponse>,
        seen: &mut Seen,
    ) -> Result<StreamEnd, Error> {
        loop {
            match events.message().await {
                Ok(Some(response)) => {
                    self.show(present(response.event)?, seen)?;
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

    fn remark(&self, text: &str) {
        if let Some(progress) = &self.progress {
            progress.remark(text);
        }
    }

    /// Shows an event once.
    fn show(&mut self, event: Event, seen: &mut Seen) -> Result<(), Error> {
        if event.sequence < seen.next_sequence {
            return Ok(());
        }
        seen.next_sequence = event.sequence + 1;
        match event.kind {
            Some(Kind::GenerationCompleted(summary)) => {
                if summary.generation == 0 {
                    seen.first_best = Some(summary.best);
                }
                if let Some(progress) = &mut self.progress {
                    progress.generation(&summary)?;
                }
            }
            Some(Kind::StateChanged(change)) => {
                seen.is_over = has_ended(change.state());
            }
            Some(Kind::Notice(notice)) => self.remark(&escape(&notice.message)),
            // A kind of event that only newer versions know.
            None => {}
        }
        Ok(())
    }
}

/// What has been read from the streams so far.
struct Seen {
    next_sequence: u64,
    first_best: Option<f64>,
    /// Whether the experiment has ended, as far as is known.
    is_over: bool,
}

#[cfg(test)]
mod tests;
