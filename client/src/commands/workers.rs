//! `swarmctl workers`: the connected workers.

use clap::Args;
use console::Style;
use serde::Serialize;
use swarm_proto::v1::{ListWorkersRequest, Worker};

use super::Remote;
use crate::{
    clock,
    connection::Connection,
    error::Error,
    progress::Progress,
    table::{Column, Table},
    text,
};

const CSV_KEYS: [&str; 11] = [
    "id",
    "name",
    "version",
    "slots",
    "items_in_flight",
    "results_per_second",
    "idle_share",
    "connected_at_ms",
    "last_heard_at_ms",
    "draining",
    "distrusted",
];

/// A connected worker, as JSON and CSV have it.
#[derive(Debug, Serialize)]
struct Record<'a> {
    id: u64,
    name: &'a str,
    version: &'a str,
    slots: u32,
    items_in_flight: u32,
    results_per_second: f64,
    idle_share: f64,
    connected_at_ms: u64,
    last_heard_at_ms: u64,
    draining: bool,
    distrusted: Option<&'a str>,
}

impl<'a> From<&'a Worker> for Record<'a> {
    fn from(worker: &'a Worker) -> Self {
        Self {
            id: worker.id,
            name: &worker.name,
            version: &worker.version,
            slots: worker.slots,
            items_in_flight: worker.items_in_flight,
            results_per_second: worker.results_per_second,
            idle_share: worker.idle_share,
            connected_at_ms: worker.connected_at_ms,
            last_heard_at_ms: worker.last_heard_at_ms,
            draining: worker.draining,
            distrusted: Some(&*worker.distrusted).filter(|reason| !reason.is_empty()),
        }
    }
}

/// List the connected workers.
///
/// Results per second and the idle share of the slots are those of the last minute.
/// `items` is the number of items assigned to a worker. A distrusted worker has
/// returned other bits than another worker for the same item; `--output wide` names
/// the other one.
#[derive(Debug, Args)]
pub struct WorkersArgs {}

impl Remote for WorkersArgs {
    const HAS_TABLE: bool = true;

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let request = ListWorkersRequest {};
        let response =
            connection.call_fleet(async |client| client.list_workers(request).await).await?;
        let workers = response.workers;
        let records: Vec<Record<'_>> = workers.iter().map(Into::into).collect();
        let empty = format!(
            "no worker is connected; start some with: worker --coordinator {}",
            connection.address()
        );
        progress.print_table(&table(&workers, clock::unix_ms()), &CSV_KEYS, &records, &empty)
    }
}

fn table(workers: &[Worker], now_ms: u64) -> Table {
    let mut table = Table::new([
        Column::number("id"),
        Column::text("name"),
        Column::new("version"),
        Column::number("slots"),
        Column::number("items"),
        Column::number("results/s"),
        Column::number("idle"),
        Column::new("last seen"),
        Column::new("connected").wide(),
        Column::new("state").painted(state_style),
        Column::text("reason").wide(),
    ]);
    for worker in workers {
        let or_dash = |text: &str| if text.is_empty() { "-".to_owned() } else { text.to_owned() };
        table.push([
            worker.id.to_string(),
            worker.name.clone(),
            or_dash(&worker.version),
            worker.slots.to_string(),
            worker.items_in_flight.to_string(),
            format!("{:.1}", worker.results_per_second),
            text::percent(worker.idle_share),
            clock::ago(worker.last_heard_at_ms, now_ms),
            clock::ago(worker.connected_at_ms, now_ms),
            state(worker).to_owned(),
            or_dash(&worker.distrusted),
        ]);
    }
    table
}

fn state(worker: &Worker) -> &'static str {
    match worker {
        Worker { distrusted, .. } if !distrusted.is_empty() => "distrusted",
        Worker { draining: true, .. } => "leaving",
        Worker { items_in_flight: 0, .. } => "idle",
        _ => "busy",
    }
}

fn state_style(state: &str) -> Style {
    match state {
        "busy" => Style::new().green(),
        "leaving" => Style::new().yellow(),
        "distrusted" => Style::new().red(),
        _ => Style::new(),
    }
}
