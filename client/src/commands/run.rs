//! `swarmctl run`: an experiment from file to champion in one process.

pub mod fleet;
pub mod log;

use std::{
    env, fs,
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use clap::Args;
use evolution::Digest;
use swarm_proto::v1::{Experiment, ExperimentState, GetChampionResponse, ListWorkersRequest};
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use crate::{
    args::{ExperimentArgs, IsaArgs, whole},
    connection::Connection,
    error::Error,
    json,
    progress::Progress,
    settings::Settings,
    sweep::{self, SweepRun},
    text,
};

use self::fleet::Fleet;
use super::{
    individual::champion_document,
    submit::{Manner, submit_all},
    watch::{self, Followed},
};

/// How long a coordinator that may be running beside has to answer.
const ANSWER_TIME: Duration = Duration::from_millis(300);
/// Longest part of an experiment's name in a file's name, in characters.
const FILE_NAME_CHARS_MAX: usize = 50;

/// Run an experiment in this process, from file to champion.
///
/// Starts a coordinator and workers in this process, the same code as on a fleet,
/// and follows the experiment to its end. An interrupt loses at most one
/// generation: the same command continues the experiment. What has completed in the data
/// directory already is shown again, and not computed a second time.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct RunArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Number of workers, each of one slot [default: the number of cores]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1024))]
    pub workers: Option<u16>,
    /// Directory of the database and the champion file.
    #[arg(long, value_name = "DIR", default_value = "./swarm-data")]
    pub data_dir: PathBuf,
    /// Begin anew what has completed in this directory already, instead of showing it again.
    #[arg(long)]
    pub new: bool,
    /// Serve pages with the curve, every individual and replays, and print their address. They
    /// stay after the run, until an interrupt.
    #[arg(long)]
    pub web: bool,
    #[command(flatten)]
    pub isa: IsaArgs,
}

/// Where pages are: a free port.
const PAGES: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

const HELP: &str = "\
With --output json it prints a line per generation (numbered from 0), then one
with state, digest and champion.

Examples:
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
    // A bad file is refused before the data directory is created.
    let mut runs = sweep::runs(&args.experiment)?;
    for run in &mut runs {
        // A run of a group is found by its request.
        run.request.resume_unfinished = run.group().is_none();
    }
    let n_workers = args
        .workers
        .map_or_else(|| thread::available_parallelism().map_or(1, Into::into), usize::from);
    log::init(progress.stderr());
    if let Some(remark) = running_coordinator(settings, &args.experiment.config).await {
        progress.remark(&remark);
    }
    let pages = args.web.then_some(PAGES);
    let mut fleet = Fleet::start(&args.data_dir, n_workers, args.isa.get(), pages).await?;
    if let Some(address) = fleet.pages() {
        progress.remark(&format!("open in a browser: {address}"));
    }
    let result = match fleet.connection() {
        Ok(connection) => tokio::select! {
            biased;
            () = interrupt.cancelled() => Err(interrupted(&args.data_dir)),
            result = evolve(&connection, &runs, args, &mut progress) => result,
            error = fleet.failure() => Err(error),
        },
        Err(error) => Err(error),
    };
    progress.clear();
    if let (Ok(()), Some(address)) = (&result, fleet.pages()) {
        progress.remark(&format!("the pages stay until you press Ctrl-C: {address}"));
        interrupt.cancelled().await;
    }
    if matches!(result, Err(Error::Interrupted(_))) {
        progress
            .remark("stopping when the running items are done; interrupt again to stop at once");
    }
    fleet.shutdown().await;
    result
}

/// Submits the runs, or finds them unfinished, and follows them to their end.
async fn evolve(
    connection: &Connection,
    runs: &[SweepRun],
    args: &RunArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    let unfinished: Vec<Experiment> = connection
        .experiments()
        .await?
        .into_iter()
        .filter(|experiment| experiment.state() == ExperimentState::Running)
        .collect();
    let submitted = match existing(connection, runs, args).await? {
        Some(existing) => {
            progress.remark(&already_completed(&existing));
            vec![existing]
        }
        None => submit_all(runs, Manner::default(), connection, progress).await?,
    };
    for remark in remarks(&submitted, &unfinished) {
        progress.remark(&remark);
    }
    if !progress.is_json() {
        progress.print(&match runs[0].group() {
            Some(group) => text::submitted_group(group, &submitted),
            None => text::submitted(&submitted[0]),
        })?;
    }

    let all = watch::follow(connection, submitted, progress).await?;
    for Followed { experiment, champion, first_best } in &all {
        let champion_file = match champion {
            Some(champion) => Some(write_champion(&args.data_dir, experiment, champion)?),
            None => None,
        };
        let champion_file = champion_file.as_deref();
        progress.print(&if progress.is_json() {
            let champion_file = champion_file.map(Path::to_string_lossy);
            let end = json::EndLine::new(experiment, champion.as_ref());
            json::line(&end.with_champion_file(champion_file.as_deref()))
        } else {
            format!(
                "{}\n{}",
                text::end(experiment, *first_best, champion.as_ref()),
                text::files(&args.data_dir, champion_file)
            )
        })?;
    }
    all.iter().try_for_each(|followed| watch::success(&followed.experiment))
}

/// The experiment that has completed in the data directory with this file, seed and number of
/// generations, unless it is to begin anew; one of no group, if there is one. Runs of a group are
/// found by their requests.
async fn existing(
    connection: &Connection,
    runs: &[SweepRun],
    args: &RunArgs,
) -> Result<Option<Experiment>, Error> {
    let [run] = runs else { return Ok(None) };
    if args.new || run.group().is_some() {
        return Ok(None);
    }
    let compiled = run.file.check(&args.experiment.overrides());
    let config = compiled.map_err(|error| run.file.invalid(&error))?.config;
    let digest = Digest::of_config(&config, sim_core::FINGERPRINT).to_string();
    let is_it = |it: &Experiment| {
        it.state() == ExperimentState::Completed
            && it.config_digest == digest
            && it.generations == config.algorithm.generations
            && it.forked_from.is_none()
    };
    let same = connection.experiments().await?.into_iter().filter(is_it);
    Ok(same.max_by_key(|it| (it.group.is_empty(), it.id)))
}

/// Says what exists, and what else can be wanted.
fn already_completed(existing: &Experiment) -> String {
    let of_group = match &*existing.group {
        "" => String::new(),
        group => format!(" of group {group}"),
    };
    format!(
        "{}{of_group} has completed here with this file and seed, and is shown again\n           -> more generations: --generations {}\n           -> another run: --seed {}\n           -> the same once more: --new",
        text::title(existing),
        existing.generations.saturating_mul(2),
        existing.seed.wrapping_add(1)
    )
}

/// Suggests the coordinator of the settings, if one answers there.
async fn running_coordinator(settings: Settings, config: &Path) -> Option<String> {
    let connection = Connection::open(settings).ok()?.with_patience(Duration::ZERO);
    let request = ListWorkersRequest {};
    let listing = connection.call_fleet(async |client| client.list_workers(request).await);
    let n_workers = timeout(ANSWER_TIME, listing).await.ok()?.ok()?.workers.len() as u64;
    let command = ["swarmctl", "submit", &config.to_string_lossy()].map(str::to_owned);
    Some(format!(
        "a coordinator with {} runs at {}: {} evolves there; this command uses this machine only",
        text::counted(n_workers, "worker"),
        connection.address(),
        text::shell_command(command)
    ))
}

/// Remarks that experiments are continued, and on other unfinished experiments.
fn remarks(submitted: &[Experiment], unfinished: &[Experiment]) -> Vec<String> {
    let is_ours = |other: &&Experiment| submitted.iter().any(|ours| ours.id == other.id);
    let (continued, others): (Vec<_>, Vec<_>) = unfinished.iter().partition(is_ours);
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
            "{} in this data directory is also unfinished, and continues at the same time",
            text::title(other)
        )
    });
    continuing.chain(company).collect()
}

fn interrupted(data_dir: &Path) -> Error {
    let args = env::args_os().map(|arg| arg.to_string_lossy().into_owned());
    Error::Interrupted(format!(
        "all complete generations are stored in {}. Continue with:\n  {}",
        data_dir.display(),
        text::shell_command(args)
    ))
}

/// Writes the champion to a file in the data directory; returns its path.
fn write_champion(
    data_dir: &Path,
    experiment: &Experiment,
    champion: &GetChampionResponse,
) -> Result<PathBuf, Error> {
    let path = data_dir.join(champion_file_name(experiment));
    fs::write(&path, champion_document(experiment, champion)? + "\n")
        .map_err(|source| Error::Write { what: path.display().to_string(), source })?;
    Ok(path)
}

/// `NAME-ID.champion.json`, with nothing in it that could leave the directory.
fn champion_file_name(experiment: &Experiment) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let name: String = experiment
        .name
        .chars()
        .take(FILE_NAME_CHARS_MAX)
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect();
    format!("{name}-{}.champion.json", experiment.id)
}

#[cfg(test)]
mod tests {
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
    fn names_of_experiments_make_harmless_names_of_files() {
        let file_name = |name| champion_file_name(&experiment(3, name));
        assert_eq!(file_name("leader"), "leader-3.champion.json");
        assert_eq!(file_name("../a b/c"), ".._a_b_c-3.champion.json");
        assert_eq!(file_name("größe"), "größe-3.champion.json");
        // 255 bytes is what file systems allow.
        assert!(file_name(&"𐐀".repeat(1000)).len() <= 255);
    }

    #[test]
    fn what_exists_is_said_with_what_else_can_be_wanted() {
        let text = already_completed(&Experiment { seed: u64::MAX, ..experiment(3, "a") });
        for part in ["experiment 3 (a)", "--generations 80", "--seed 0", "--new"] {
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn a_new_experiment_alone_needs_no_remark() {
        assert!(remarks(&[experiment(3, "a")], &[]).is_empty());
    }

    #[test]
    fn continuing_is_said_and_so_is_company() {
        let unfinished = [experiment(2, "b"), experiment(3, "a")];
        let lines = remarks(&[experiment(3, "a")], &unfinished);
        assert_eq!(lines[0], "continuing experiment 3 (a), 12 of 40 generations done");
        assert!(lines[1].contains("experiment 2 (b)"));
        assert_eq!(lines.len(), 2);
    }

    #[test]
    fn a_champion_is_stored_as_it_is_printed() {
        let dir = tempfile::tempdir().unwrap();
        let champion = GetChampionResponse {
            experiment_id: 3,
            genotype: vec![0.1],
            network_json: "{}".into(),
            ..GetChampionResponse::default()
        };
        let experiment = experiment(3, "a");
        let path = write_champion(dir.path(), &experiment, &champion).unwrap();
        let stored = fs::read_to_string(path).unwrap();
        assert_eq!(stored, champion_document(&experiment, &champion).unwrap() + "\n");
    }
}
