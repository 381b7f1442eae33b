//! `swarmctl run`: an experiment from file to champion in one process.

pub mod log;

use std::{
    env,
    net::{Ipv4Addr, SocketAddr},
    path::Path,
    time::Duration,
};

use clap::Args;
use evolution::Digest;
use swarm_proto::v1::{Experiment, ExperimentState, ListExperimentsRequest, ListWorkersRequest};
use swarm_telemetry::escape;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use crate::{
    args::{ExperimentArgs, IsaArgs, cores, whole},
    connection::Connection,
    error::Error,
    local::fleet::Fleet,
    place::data_dir,
    progress::Progress,
    settings::Settings,
    sweep::{self, SweepRun},
    text,
};

use super::{
    submit::{Manner, submit_all},
    watch,
};

/// Time limit for the answer of another coordinator on this machine.
const ANSWER_TIME: Duration = Duration::from_millis(300);

/// Run an experiment in this process, from file to champion.
///
/// Starts a coordinator and workers in this process, with the same code as on a fleet,
/// and follows the experiment to its end. An interrupt loses at most one generation: the
/// same command continues the experiment. If the experiment has already completed in the
/// data directory, the command only shows its result. With more generations, it goes on
/// with that experiment, unless that belongs to a group.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct RunArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Number of workers, each of one slot [default: the number of cores]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1024))]
    pub workers: Option<u16>,
    /// Rerun an experiment that has completed in this directory, instead of showing its
    /// result.
    #[arg(long)]
    pub new: bool,
    /// Serve pages with the curve, every individual and replays, and print their address. They
    /// stay after the run, until you press Ctrl-C.
    #[arg(long)]
    pub web: bool,
    #[command(flatten)]
    pub isa: IsaArgs,
}

/// The address of the pages: a free port.
const PAGES: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

const HELP: &str = "\
With --output json, the command prints a line per generation (numbered from 0),
then a line with state, digest and champion.

Examples:
  swarmctl run --example quickstart
  swarmctl run experiment.json
  swarmctl run experiment.json --web
  swarmctl run experiment.json --seeds 0..4
  swarmctl run experiment.json --generations 20 --seed 7 --data-dir /tmp/try";

/// Starts a fleet, evolves, and stops the fleet even if evolving failed.
pub async fn run(
    settings: Settings,
    args: &RunArgs,
    mut progress: Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    // Refuses a bad file before creating the data directory.
    let mut runs = sweep::runs(&args.experiment)?;
    let data_dir = data_dir(&settings);
    for run in &mut runs {
        // The request id finds a run of a group.
        run.request.resume_unfinished = run.group().is_none();
    }
    let n_workers = args.workers.map_or_else(cores, usize::from);
    log::init(progress.stderr());
    if let Some(remark) = running_coordinator(settings, args.experiment.words()).await {
        progress.remark(&remark);
    }
    let pages = args.web.then_some(PAGES);
    let mut fleet = Fleet::start(&data_dir, n_workers, args.isa.get(), pages).await?;
    if let Some(address) = fleet.pages() {
        progress.remark(&format!("open in a browser: {address}"));
    }
    let connection = fleet.connection();
    let result = tokio::select! {
        biased;
        () = interrupt.cancelled() => Err(interrupted(&data_dir)),
        result = evolve(&connection, &runs, args, &data_dir, &mut progress) => result,
        error = fleet.failure() => Err(error),
    };
    progress.clear();
    if let (Ok(()), Some(address)) = (&result, fleet.pages()) {
        progress.remark(&format!("the pages stay until you press Ctrl-C: {address}"));
        interrupt.cancelled().await;
    }
    fleet.stop(&result, &progress).await;
    result
}

/// Submits the runs, or finds them unfinished, and follows them to their end.
async fn evolve(
    connection: &Connection,
    runs: &[SweepRun],
    args: &RunArgs,
    data_dir: &Path,
    progress: &mut Progress,
) -> Result<(), Error> {
    let unfinished = connection.running().await?;
    let submitted = match existing(connection, runs, args).await? {
        Some((existing, name)) => {
            progress.remark(&already_completed(&existing, &name));
            vec![existing]
        }
        None => submit_all(runs, Manner::default(), connection, progress).await?,
    };
    for remark in remarks(&submitted, &unfinished, data_dir) {
        progress.remark(&remark);
    }
    if !progress.is_json() {
        progress.print(&match runs[0].group() {
            Some(group) => text::submitted_group(group, &submitted),
            None => text::submitted(&submitted[0]),
        })?;
    }

    watch::watch(connection, submitted, progress).await
}

/// The completed experiment in the data directory with this file, seed and number of generations,
/// and the name in the file; none with `--new`. Prefers an experiment without a group. Runs of a
/// group are found by their requests.
async fn existing(
    connection: &Connection,
    runs: &[SweepRun],
    args: &RunArgs,
) -> Result<Option<(Experiment, String)>, Error> {
    let [run] = runs else { return Ok(None) };
    if args.new || run.group().is_some() {
        return Ok(None);
    }
    let compiled = run.file.check(&args.experiment.overrides());
    let config = compiled.map_err(|error| run.file.invalid(&error))?.config;
    let digest = Digest::of_config(&config, sim_core::FINGERPRINT).to_string();
    let wanted = ListExperimentsRequest {
        config_digest: digest,
        states: vec![ExperimentState::Completed.into()],
        ..Default::default()
    };
    let is_it = |experiment: &Experiment| {
        experiment.generations == config.algorithm.generations && experiment.forked_from.is_none()
    };
    let same = connection.list(wanted).await?.into_iter().filter(is_it);
    let same = same.max_by_key(|experiment| {
        (experiment.name == config.name, experiment.group.is_empty(), experiment.id)
    });
    Ok(same.map(|experiment| (experiment, config.name)))
}

/// Reports the existing experiment, and the alternatives; `name`: that of the file.
fn already_completed(existing: &Experiment, name: &str) -> String {
    let (of_group, own) = match &*existing.group {
        "" => (String::new(), ""),
        group => (format!(" of group {group}"), ", in a run of its own"),
    };
    let once_more = match text::under_another_name(&existing.name, name) {
        Some(old) => format!("{old}; under `{}`: --new", escape(name)),
        None => "the same once more: --new".to_owned(),
    };
    format!(
        "{}{of_group} has already completed here with this file and seed\n           \
         -> more generations{own}: --generations {}\n           \
         -> another run: --seed {}\n           \
         -> {once_more}",
        text::title(existing),
        existing.generations.saturating_mul(2),
        existing.seed.wrapping_add(1)
    )
}

/// Suggests the coordinator of the settings, if it answers.
async fn running_coordinator(settings: Settings, experiment: Vec<String>) -> Option<String> {
    let settings = settings.or_file().ok()?;
    let connection = Connection::new(settings.address(), &settings.credentials().ok()?);
    let connection = connection.ok()?.with_patience(Duration::ZERO);
    let request = ListWorkersRequest {};
    let listing = connection.call_fleet(async |client| client.list_workers(request).await);
    let n_workers = timeout(ANSWER_TIME, listing).await.ok()?.ok()?.workers.len() as u64;
    Some(way_to_coordinator(n_workers, connection.address(), experiment))
}

/// `experiment`: the words of a command line for the same experiments.
fn way_to_coordinator(n_workers: u64, address: &str, experiment: Vec<String>) -> String {
    let submit = ["swarmctl", "submit"].map(str::to_owned).into_iter().chain(experiment);
    let place = ["--coordinator", address].map(str::to_owned);
    format!(
        "a coordinator with {} runs at {address}: {} evolves there; this command uses this machine \
         only",
        text::counted(n_workers, "worker"),
        text::shell_command(submit.chain(place))
    )
}

/// Remarks that experiments are continued, and on other unfinished experiments.
fn remarks(submitted: &[Experiment], unfinished: &[Experiment], data_dir: &Path) -> Vec<String> {
    let is_ours = |other: &&Experiment| submitted.iter().any(|ours| ours.id == other.id);
    let (continued, others): (Vec<_>, Vec<_>) = unfinished.iter().partition(is_ours);
    let is_longer = |ours: &&Experiment| {
        let is_known = continued.iter().any(|other| other.id == ours.id);
        !is_known && ours.state() == ExperimentState::Running && ours.generations_done > 0
    };
    let longer = submitted.iter().filter(is_longer).map(|this| {
        format!(
            "going on with {}, which had completed {}; a run of its own: --group NAME",
            text::title(this),
            text::counted(this.generations_done, "generation")
        )
    });
    let continuing = continued.iter().map(|this| {
        format!(
            "continuing {}, {} of {} generations done",
            text::title(this),
            this.generations_done,
            this.generations
        )
    });
    let company = others.iter().map(|other| {
        format!(
            "{} in this data directory is also unfinished, and stays so; continue it with: {}",
            text::title(other),
            text::command_in("resume", other.id, data_dir)
        )
    });
    continuing.chain(longer).chain(company).collect()
}

fn interrupted(data_dir: &Path) -> Error {
    let args = env::args_os().map(|arg| arg.to_string_lossy().into_owned());
    Error::Interrupted(format!(
        "{} stores all complete generations. Continue with:\n  {}",
        data_dir.display(),
        text::shell_command(args)
    ))
}

#[cfg(test)]
mod tests {
    use std::slice::from_ref;

    use super::*;

    fn experiment(id: u64, name: &str) -> Experiment {
        Experiment {
            id,
            name: name.into(),
            generations_done: 12,
            generations: 40,
            ..Experiment::default()
        }
    }

    #[test]
    fn an_existing_result_is_reported_with_the_alternatives() {
        let text = already_completed(&Experiment { seed: u64::MAX, ..experiment(3, "a") }, "a");
        for part in ["experiment 3 (a)", "--generations 80", "--seed 0", "--new"] {
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn a_result_under_another_name_is_reported_with_the_way_to_the_new_name() {
        let text = already_completed(&experiment(3, "old"), "new");
        let expected = "it was computed under the name `old`; under `new`: --new";
        assert!(text.contains(expected), "{text}");
        let same = already_completed(&experiment(3, "new"), "new");
        assert!(!same.contains("under"), "{same}");
    }

    #[test]
    fn a_new_experiment_alone_needs_no_remark() {
        let new = Experiment { generations_done: 0, ..experiment(3, "a") };
        assert!(remarks(&[new], &[], Path::new("data")).is_empty());
    }

    #[test]
    fn a_completed_experiment_that_goes_on_is_remarked_on() {
        let state = ExperimentState::Running.into();
        let experiment = Experiment { state, ..experiment(3, "a") };
        let lines = remarks(from_ref(&experiment), &[], Path::new("data"));
        let expected = "going on with experiment 3 (a), which had completed 12 generations; a run \
                        of its own: --group NAME";
        assert_eq!(lines, [expected]);
        let paused = Experiment { state: ExperimentState::Paused.into(), ..experiment };
        assert!(remarks(&[paused], &[], Path::new("data")).is_empty());
    }

    #[test]
    fn continued_and_other_unfinished_experiments_are_remarked_on() {
        let unfinished = [experiment(2, "b"), experiment(3, "a")];
        let lines = remarks(&[experiment(3, "a")], &unfinished, Path::new("a b"));
        assert_eq!(lines[0], "continuing experiment 3 (a), 12 of 40 generations done");
        assert!(lines[1].contains("experiment 2 (b)"));
        assert!(lines[1].ends_with(": swarmctl resume 2 --data-dir 'a b'"), "{}", lines[1]);
        assert_eq!(lines.len(), 2);
    }

    #[test]
    fn the_way_to_a_coordinator_names_it_and_the_same_experiment() {
        let words = ["my file.json", "--seed", "7"].map(str::to_owned).into();
        let remark = way_to_coordinator(2, "http://h:1", words);
        let submit = "swarmctl submit 'my file.json' --seed 7 --coordinator http://h:1 evolves";
        assert!(remark.contains(submit), "{remark}");
    }
}
