//! Prints the events of an experiment, of a group, or of all experiments, in the order of time.
//!
//! The merged log does not follow one stream per experiment: so many streams would not scale,
//! and events of the same moment can be ordered only when all of them are known. It reads new
//! events when the coordinator announces news.

mod merge;

use std::{collections::BTreeMap, mem, path::Path};

use model::wire::has_ended;
use swarm_proto::v1::{Experiment, WatchNewsResponse};
use tokio::time::{Instant, sleep};
use tonic::Streaming;

use crate::{
    connection::{Connection, PATIENCE_WHILE_FOLLOWING as PATIENCE, backoff},
    error::{Error, is_transient},
    json,
    progress::Progress,
    subject::Subject,
    text,
};

use self::merge::Merge;

/// The events to print.
#[derive(Debug)]
pub struct Wanted {
    /// The experiments of the events; none: all experiments, in the order of time.
    pub subject: Option<Subject>,
    /// Whether to wait for new events until the experiments have ended.
    pub follow: bool,
    /// The sequence number of the first event.
    pub from_sequence: u64,
}

/// Prints events, each on a line.
pub async fn print(
    wanted: &Wanted,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let patience = if wanted.follow { PATIENCE } else { connection.patience() };
    // The first request has the usual patience, so that an unreachable coordinator soon
    // becomes an error.
    let mut experiments = chosen(connection, wanted.subject.as_ref()).await?;
    let connection = connection.with_patience(patience);
    // Per experiment, the sequence number of the next event to print.
    let mut positions: BTreeMap<u64, u64> = BTreeMap::new();
    let mut news = News { connection: &connection, stream: None };
    if wanted.follow {
        // Subscribes before the first reading, so that no event is missed.
        news.next().await?;
        experiments = chosen(&connection, wanted.subject.as_ref()).await?;
    }
    let mut is_silent = true;
    loop {
        let with_news = experiments.iter().filter_map(|experiment| {
            let next = *positions.entry(experiment.id).or_insert(wanted.from_sequence);
            (next <= experiment.last_sequence).then_some((experiment, next))
        });
        let mut merge = Merge::new(&connection, with_news.collect());
        while let Some((experiment, event)) = merge.next().await? {
            is_silent = false;
            positions.insert(experiment.id, event.sequence + 1);
            if progress.is_json() {
                progress.print_line(&json::LogLine::new(experiment, &event))?;
            } else {
                progress.print(&text::log_line(experiment, &event))?;
            }
        }
        if mem::take(&mut is_silent) && !progress.is_json() {
            progress.print(&text::no_events(&experiments, wanted.from_sequence))?;
        }
        let is_over = wanted.subject.is_some() && experiments.iter().all(|e| has_ended(e.state()));
        if !wanted.follow || is_over {
            return Ok(());
        }
        if let Some(data_dir) = connection.data_dir()
            && connection.holder().await.is_none()
        {
            return deserted(&experiments, wanted.subject.is_some(), data_dir, progress);
        }
        news.next().await?;
        experiments = chosen(&connection, wanted.subject.as_ref()).await?;
    }
}

/// A data directory has no new events: fails if a followed experiment has not ended.
fn deserted(
    experiments: &[Experiment],
    is_of_some: bool,
    data_dir: &Path,
    progress: &Progress,
) -> Result<(), Error> {
    let unfinished = experiments.iter().find(|experiment| !has_ended(experiment.state()));
    match unfinished.filter(|_| is_of_some) {
        Some(unfinished) => {
            let message = text::deserted(unfinished, data_dir);
            Err(Error::WrongState(message).about(unfinished.id))
        }
        None => {
            progress.remark(&text::no_fleet(data_dir, None));
            Ok(())
        }
    }
}

/// The source of announcements of new events.
struct News<'a> {
    connection: &'a Connection,
    stream: Option<Streaming<WatchNewsResponse>>,
}

impl News<'_> {
    /// Waits for news, and retries while the coordinator is unreachable, up to the
    /// connection's patience.
    async fn next(&mut self) -> Result<(), Error> {
        let mut give_up_at = None;
        let mut backoff = backoff();
        loop {
            let found = match &mut self.stream {
                Some(stream) => stream.message().await,
                None => match self.connection.news().await {
                    Ok(stream) => {
                        self.stream = Some(stream);
                        continue;
                    }
                    Err(status) => Err(status),
                },
            };
            match found {
                Ok(Some(_)) => return Ok(()),
                Err(status) if !is_transient(&status) => {
                    return Err(self.connection.error(&status));
                }
                lost => {
                    self.stream = None;
                    let patience = self.connection.patience();
                    let give_up_at = *give_up_at.get_or_insert(Instant::now() + patience);
                    if let Err(status) = lost
                        && Instant::now() >= give_up_at
                    {
                        return Err(self.connection.error(&status));
                    }
                    sleep(backoff.next_delay(rand::random())).await;
                }
            }
        }
    }
}

async fn chosen(
    connection: &Connection,
    subject: Option<&Subject>,
) -> Result<Vec<Experiment>, Error> {
    match subject {
        Some(subject) => connection.subject(subject).await,
        None => connection.experiments().await,
    }
}
