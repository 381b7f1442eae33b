//! `swarmctl logs`: what has happened to one experiment, or to all of them in
//! the order of time.
//!
//! The merged log polls for new events instead of watching: one stream per
//! experiment would not scale, and events can be put in the order of time only
//! when all events of a moment are known.

mod merge;

use std::{collections::BTreeMap, time::Duration};

use clap::Args;
use swarm_proto::v1::{Event, Experiment};
use tokio::time::sleep;

use super::Remote;
use crate::{
    connection::{Connection, PATIENCE_WHILE_FOLLOWING},
    error::Error,
    json::{self, has_ended},
    progress::Progress,
    text,
};

use self::merge::Merge;

/// Time between two requests for new events.
const INTERVAL: Duration = Duration::from_secs(1);

/// Print the events of an experiment, or of all of them.
///
/// Events are completed generations, changes of state, and notices such as the
/// re-evaluation of a champion.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct LogsArgs {
    /// Number of the experiment [default: all, in the order of time]
    id: Option<u64>,
    /// Keep printing new events; for one experiment, until it ends.
    #[arg(long, short)]
    follow: bool,
    /// Start at the event with this sequence number.
    #[arg(long = "from", value_name = "SEQ", default_value_t = 1, requires = "id")]
    from_sequence: u64,
}

const HELP: &str = "\
The log of all experiments is printed in the order of time. With --output json
each event is an object on a line of its own, with kind generation, state or
notice.

Examples:
  swarmctl logs 3 --follow
  swarmctl logs --follow
  swarmctl logs 3 --from 120 --output json | jq 'select(.kind == \"notice\")'";

impl Remote for LogsArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        print_events(&self, connection, progress).await
    }
}

async fn print_events(
    args: &LogsArgs,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let patience = if args.follow { PATIENCE_WHILE_FOLLOWING } else { connection.patience() };
    // The first request has the usual patience: an unreachable coordinator is an
    // error soon.
    let mut experiments = chosen(connection, args.id).await?;
    let connection = connection.with_patience(patience);
    // Per experiment, the sequence number of the next event to print.
    let mut positions: BTreeMap<u64, u64> = BTreeMap::new();
    loop {
        let with_news = experiments.iter().filter_map(|experiment| {
            let next = *positions.entry(experiment.id).or_insert(args.from_sequence);
            (next <= experiment.last_sequence).then_some((experiment, next))
        });
        let mut merge = Merge::new(&connection, with_news.collect());
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
