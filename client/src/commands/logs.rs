//! `swarmctl logs`: what has happened to one experiment, or to all of them in
//! the order of time.
//!
//! The merged log asks for news instead of watching: a stream per experiment
//! would not scale, and only whoever has all of a moment's events can order them.

mod merge;

use std::{collections::BTreeMap, time::Duration};

use swarm_proto::v1::{Event, Experiment};
use tokio::time::sleep;

use crate::{
    args::LogsArgs,
    connection::{Connection, PATIENCE_WHILE_FOLLOWING},
    error::Error,
    json::{self, has_ended},
    progress::Progress,
    text,
};

use self::merge::Merge;

/// Between questions for news.
const INTERVAL: Duration = Duration::from_secs(1);

/// Prints a line per event.
pub async fn logs(
    connection: &Connection,
    args: &LogsArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    let patience = if args.follow { PATIENCE_WHILE_FOLLOWING } else { connection.patience() };
    // Whether anybody is there is known at once.
    let mut experiments = chosen(connection, args.id).await?;
    let connection = connection.with_patience(patience);
    // The next event of each experiment that is known.
    let mut positions: BTreeMap<u64, u64> = BTreeMap::new();
    loop {
        let news = experiments.iter().filter_map(|experiment| {
            let next = *positions.entry(experiment.id).or_insert(args.from_sequence);
            (next <= experiment.last_sequence).then_some((experiment, next))
        });
        let mut merge = Merge::new(&connection, news.collect());
        while let Some((experiment, event)) = merge.next().await? {
            positions.insert(experiment.id, event.sequence + 1);
            progress.print(&line(experiment, &event, progress.is_json()))?;
        }
        let is_over = args.id.is_some() && experiments.iter().all(|e| has_ended(e.state()));
        if !args.follow || is_over {
            return Ok(());
        }
        sleep(INTERVAL).await;
        experiments = chosen(&connection, args.id).await?;
    }
}

async fn chosen(connection: &Connection, id: Option<u64>) -> Result<Vec<Experiment>, Error> {
    match id {
        Some(id) => Ok(vec![connection.experiment(id).await?]),
        None => connection.experiments().await,
    }
}

fn line(experiment: &Experiment, event: &Event, is_json: bool) -> String {
    if is_json {
        json::line(&json::LogLine::new(experiment, event))
    } else {
        text::log_line(experiment, event)
    }
}
