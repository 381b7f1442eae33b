//! `swarmctl evaluate`: measures of a genotype under several conditions.

mod args;
mod conditions;
mod files;
mod measured;
mod realities;
mod statistics;
pub mod summary;

use std::pin::pin;

use swarm_proto::v1::EvaluateRequest;
use tokio::{
    task::JoinSet,
    time::{Instant, sleep},
};
use tokio_util::sync::CancellationToken;

use crate::{
    args::cores,
    connection::{Connection, PATIENCE_WHILE_FOLLOWING},
    error::Error,
    experiment_file::ExperimentFile,
    json,
    local::fleet::Fleet,
    place::{Intent, Place},
    progress::{Part, Progress},
    settings::Settings,
    table::{self, Column, Table},
    waiting,
};

pub use self::args::EvaluateArgs;
use self::{
    conditions::{Condition, Role},
    files::Results,
    measured::Measured,
    realities::Robustness,
    summary::{Subject, Summary},
};
use super::{run::log, simulate::genotype::Genotype};

/// Maximum number of conditions that are evaluated at the same time.
const CALLS_MAX: usize = 8;
/// The alternative without a coordinator.
const HERE: &str = "with --local this command evaluates in its own process";

/// Evaluates all conditions, then writes the files.
pub async fn evaluate(
    settings: Settings,
    args: &EvaluateArgs,
    mut progress: Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    let result = tokio::select! {
        biased;
        () = interrupt.cancelled() => {
            Err(Error::Interrupted("nothing was written; the same command starts from the beginning".into()))
        }
        result = evaluate_all(settings, args, &mut progress) => result,
    };
    progress.clear();
    result
}

async fn evaluate_all(
    settings: Settings,
    args: &EvaluateArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    // Refuses requests that cannot succeed before sending any.
    args.overwrite.check_files(&args.to, &files::NAMES)?;
    let (file, genotype) = subject(settings.clone(), args, progress).await?;
    let remote = remote(settings, args, progress).await?;
    let (conditions, realities) = conditions::all(&file, args)?;
    for condition in &conditions {
        condition.check(&genotype)?;
    }
    // Reports an unusable directory now, not after the computation.
    let results = Results::begin(&args.to, args.overwrite)?;
    let measured = match remote {
        Some(connection) => {
            let asked = ask_all(&connection, &conditions, &genotype, args, progress).await;
            asked.map_err(or_here)?
        }
        None => compute_here(&conditions, &genotype, args, progress).await?,
    };
    results.write_steps(&conditions, &measured, args.every)?;
    results.write_trials(&conditions, &measured)?;
    let subject = Subject::new(&conditions, &genotype);
    let robustness = realities.map(|realities| Robustness::new(&realities, &conditions, &measured));
    let summary = Summary::new(&subject, &conditions, &measured).with(robustness);
    results.write("summary.json", &(json::document(&summary) + "\n"))?;
    results.finish()?;
    if progress.is_json() {
        return progress.print_document(&summary);
    }
    let where_it_is = format!(
        "{} trials each; steps.csv, trials.csv and summary.json in {}",
        args.trials,
        args.to.display()
    );
    let mut parts = vec![Part::Table(table(&summary, &conditions))];
    parts.extend(summary.pseudo_realities.iter().flat_map(Robustness::to_parts));
    parts.push(Part::Text(where_it_is));
    progress.print_parts(&parts)
}

/// The coordinator whose fleet computes; none if this process computes, as on a data
/// directory.
async fn remote(
    settings: Settings,
    args: &EvaluateArgs,
    progress: &Progress,
) -> Result<Option<Connection>, Error> {
    if args.local {
        return Ok(None);
    }
    match Place::find(settings).await? {
        Place::Directory { .. } => {
            progress.remark("computing in this process, as with --local");
            Ok(None)
        }
        Place::Coordinator(settings) => {
            progress.expiring(&settings);
            let connection = Connection::at(&settings)?;
            Ok(Some(connection.with_patience(PATIENCE_WHILE_FOLLOWING)))
        }
    }
}

/// The experiment file and the genes to evaluate.
async fn subject(
    settings: Settings,
    args: &EvaluateArgs,
    progress: &Progress,
) -> Result<(ExperimentFile, Vec<f64>), Error> {
    match (&args.address, &args.genotype, &args.config) {
        (Some(address), ..) => {
            let connection = Connection::open(settings, Intent::Read, progress).await?;
            let address = connection.resolve(address).await?;
            let found = connection.genotype(address).await?;
            let name = format!("experiment {}", address.experiment);
            let file = ExperimentFile::new(name.into(), found.config_json);
            Ok((file, found.individual.genotype))
        }
        (_, Some(genotype), Some(config)) => {
            let file = ExperimentFile::read(config)?;
            let genotype = Genotype::read(genotype, &file, args.changed)?;
            Ok((file, genotype.genes))
        }
        _ => Err(Error::Internal("the command line names nothing to evaluate".into())),
    }
}

/// Starts a fleet, computes, and stops the fleet even if computing failed.
async fn compute_here(
    conditions: &[Condition],
    genotype: &[f64],
    args: &EvaluateArgs,
    progress: &mut Progress,
) -> Result<Vec<Measured>, Error> {
    log::init(progress.stderr());
    let n_workers = args.workers.map_or_else(cores, usize::from);
    // An evaluation stores nothing, but its coordinator has a database.
    let data_dir = tempfile::tempdir()
        .map_err(|source| Error::Write { what: "a temporary directory".into(), source })?;
    let mut fleet = Fleet::start(data_dir.path(), n_workers, args.isa.get(), None).await?;
    let connection = fleet.connection();
    let result = tokio::select! {
        biased;
        result = ask_all(&connection, conditions, genotype, args, progress) => result,
        error = fleet.failure() => Err(error),
    };
    fleet.shutdown().await;
    result
}

/// Adds the alternative to the error that no coordinator answers.
fn or_here(error: Error) -> Error {
    match error {
        Error::Unreachable { address, reason } => {
            Error::Unreachable { address, reason: format!("{reason} ({HERE})") }
        }
        error => error,
    }
}

/// The reason why an evaluation waits.
async fn waits_for(connection: &Connection, is_local: bool) -> String {
    match is_local {
        true => "computing".to_owned(),
        false => format!("waiting for {}", waiting::fleet(connection, HERE).await),
    }
}

/// Evaluates all conditions, some at a time; returns the results in their order.
async fn ask_all(
    connection: &Connection,
    conditions: &[Condition],
    genotype: &[f64],
    args: &EvaluateArgs,
    progress: &mut Progress,
) -> Result<Vec<Measured>, Error> {
    let mut calls = JoinSet::new();
    let mut waiting = conditions.iter().enumerate();
    let mut measured: Vec<Option<Measured>> = conditions.iter().map(|_| None).collect();
    let mut n_done = 0;
    let mut silence = pin!(sleep(waiting::SILENCE_MAX));
    loop {
        while calls.len() < CALLS_MAX
            && let Some((index, condition)) = waiting.next()
        {
            let request = EvaluateRequest {
                config_json: condition.config.to_canonical_json(),
                genotype: genotype.to_vec(),
                trial_count: args.trials,
                priority: args.priority,
            };
            let connection = connection.clone();
            calls.spawn(async move { (index, measured::ask(&connection, request).await) });
        }
        let call = tokio::select! {
            call = calls.join_next() => call,
            () = &mut silence => {
                let waits = waits_for(connection, args.local).await;
                progress.remark(&format!("{n_done}/{} done; {waits}", conditions.len()));
                silence.as_mut().reset(Instant::now() + waiting::REMINDER);
                continue;
            }
        };
        let Some(call) = call else { break };
        let (index, result) = call.map_err(|error| Error::Internal(error.to_string()))?;
        let condition = &conditions[index];
        measured[index] = Some(result.map_err(|error| condition.locate(error))?);
        n_done += 1;
        if !progress.is_json() {
            progress.remark(&format!("{n_done}/{} {}", conditions.len(), condition.name));
        }
    }
    Ok(measured
        .into_iter()
        .map(|measured| measured.expect("every condition has been requested"))
        .collect())
}

/// For people: means over trials and steps, with their confidence intervals. Pseudo-realities have
/// a table of their own.
fn table(summary: &Summary, conditions: &[Condition]) -> Table {
    let names = summary.metric_names();
    let columns = [Column::text("condition"), Column::number("fitness")].into_iter();
    let measures = table::measures(names.iter().map(String::as_str));
    let mut table = Table::new(columns.chain(measures).collect::<Vec<_>>());
    let shown = conditions.iter().map(|condition| condition.role == Role::Other);
    for (condition, _) in summary.conditions.iter().zip(shown).filter(|(_, shown)| *shown) {
        let fitness = Some(&condition.fitness);
        let metrics =
            names.iter().map(|name| condition.metrics.get(name).map(|metric| &metric.time_mean));
        let cells = std::iter::once(fitness).chain(metrics);
        let cells = cells.map(|estimate| estimate.map_or("-".into(), ToString::to_string));
        table.push(std::iter::once(condition.name.clone()).chain(cells).collect::<Vec<_>>());
    }
    table
}

#[cfg(test)]
mod tests;
