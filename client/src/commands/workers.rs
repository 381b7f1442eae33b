//! `swarmctl workers`: lists the connected workers, or readmits one from quarantine.

use clap::Args;
use clap_complete::ArgValueCompleter;
use console::Style;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{ListWorkersRequest, ReadmitWorkerRequest, Worker};

use crate::{
    clock, complete,
    connection::Connection,
    error::Error,
    interrupt,
    place::Intent,
    progress::Progress,
    remote::Remote,
    table::{Column, Table},
    text,
};

const CSV_KEYS: [&str; 13] = [
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
    "waits",
    "experiments",
];

/// A connected worker, for JSON and CSV.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Worker")]
pub struct Record<'a> {
    /// Number of the connection.
    id: u64,
    /// Name of the worker, which other workers may have, too.
    name: &'a str,
    /// Version of the program; empty if it does not say so.
    version: &'a str,
    /// Number of items that it computes at a time.
    slots: u32,
    /// Number of items that it has.
    items_in_flight: u32,
    /// Results per second in the last minute.
    results_per_second: f64,
    /// Share of the last minute in which its slots had nothing to compute, from 0 to 1.
    idle_share: f64,
    /// Time of the connection, milliseconds since 1970 in UTC.
    connected_at_ms: u64,
    /// Time of its last message, milliseconds since 1970 in UTC.
    last_heard_at_ms: u64,
    /// Whether it finishes its items and leaves.
    draining: bool,
    /// Why it is in quarantine; null if it is not.
    distrusted: Option<&'a str>,
    /// Why it gets no items for now; null if it gets some.
    waits: Option<&'a str>,
    /// The pattern of the names of experiments whose items it computes; null if it computes all.
    experiments: Option<&'a str>,
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
            waits: Some(&*worker.waits).filter(|reason| !reason.is_empty()),
            experiments: Some(&*worker.experiments).filter(|pattern| !pattern.is_empty()),
        }
    }
}

/// List the connected workers, or readmit one that is in quarantine.
///
/// Results per second and the idle share of the slots cover the last minute. `items` is
/// the number of items assigned to a worker. In two states a worker gets no items, and
/// `--output wide` shows the reason. `waiting`: the worker returned nothing, or its
/// results are in doubt; this passes by itself. `quarantine`: the worker returned a
/// result that is proved wrong; it stays there, even after restarts, until you readmit
/// it. `takes` names the experiments whose items it computes, as set by `worker
/// --experiments`.
#[derive(Debug, Args)]
pub struct WorkersArgs {
    /// Readmit this worker from quarantine, so that it gets items again.
    #[arg(long, value_name = "NAME", add = ArgValueCompleter::new(complete::quarantined), allow_hyphen_values = true)]
    readmit: Option<String>,
}

impl Remote for WorkersArgs {
    fn has_table(&self) -> bool {
        true
    }

    fn intent(&self) -> Intent {
        if self.readmit.is_some() { Intent::Change } else { Intent::Read }
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        if let Some(name) = self.readmit {
            let look = connection.command(&["workers"]);
            interrupt::changing(format!("the worker may be readmitted; `{look}` shows its state"));
            let request = ReadmitWorkerRequest { name };
            connection
                .call_fleet(async |client| client.readmit_worker(request.clone()).await)
                .await
                .map_err(|error| error.about("--readmit"))?;
        }
        let request = ListWorkersRequest {};
        let response =
            connection.call_fleet(async |client| client.list_workers(request).await).await?;
        // Ages are relative to the coordinator's clock, which also took the times.
        let now_ms = Some(response.now_ms).filter(|&now_ms| now_ms > 0);
        let workers = response.workers;
        let records: Vec<Record<'_>> = workers.iter().map(Into::into).collect();
        let empty = match connection.data_dir() {
            Some(data_dir) => text::no_fleet(data_dir, connection.holder().await.as_ref()),
            None => format!(
                "no worker is connected; start some with: worker --coordinator {}",
                connection.address()
            ),
        };
        let now_ms = now_ms.unwrap_or_else(clock::unix_ms);
        progress.print_table(&table(&workers, now_ms), &CSV_KEYS, &records, &empty)?;
        if let Some(remark) = text::evaluations(response.evaluations.len()) {
            progress.remark(&connection.in_place(&remark));
        }
        Ok(())
    }
}

fn table(workers: &[Worker], now_ms: u64) -> Table {
    let mut table = Table::new([
        Column::number("id"),
        Column::name("name"),
        Column::new("version").dropped(6),
        Column::number("slots").dropped(4),
        Column::number("items").dropped(3),
        Column::number("results/s").dropped(1),
        Column::number("idle").dropped(5),
        Column::new("last seen").dropped(2),
        Column::new("connected").wide(),
        Column::new("state").painted(state_style),
        Column::text("reason").wide(),
        Column::text("takes").wide(),
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
            or_dash(if worker.distrusted.is_empty() { &worker.waits } else { &worker.distrusted }),
            if worker.experiments.is_empty() {
                "all".to_owned()
            } else {
                worker.experiments.clone()
            },
        ]);
    }
    table
}

fn state(worker: &Worker) -> &'static str {
    match worker {
        Worker { distrusted, .. } if !distrusted.is_empty() => "quarantine",
        Worker { draining: true, .. } => "leaving",
        Worker { waits, .. } if !waits.is_empty() => "waiting",
        Worker { items_in_flight: 0, .. } => "idle",
        _ => "busy",
    }
}

fn state_style(state: &str) -> Style {
    match state {
        "busy" => Style::new().green(),
        "leaving" | "waiting" => Style::new().yellow(),
        "quarantine" => Style::new().red(),
        _ => Style::new(),
    }
}
