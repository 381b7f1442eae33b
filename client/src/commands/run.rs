//! `swarmctl run`: an experiment from file to champion in one process.

pub mod fleet;
pub mod log;

use std::{
    env, fs,
    path::{Path, PathBuf},
    thread,
};

use clap::{Args, value_parser};
use swarm_proto::v1::{Experiment, ExperimentState, GetChampionResponse, SubmitExperimentRequest};
use tokio_util::sync::CancellationToken;

use crate::{
    args::{ExperimentArgs, IsaArgs},
    connection::{Connection, present},
    error::Error,
    experiment_file::{ExperimentFile, random_request_id},
    json,
    progress::Progress,
    text,
};

use self::fleet::Fleet;
use super::{
    champion::champion_document,
    watch::{self, Followed},
};

/// Longest part of an experiment's name in a file's name, in characters.
const FILE_NAME_CHARS_MAX: usize = 50;

/// Run an experiment in this process, from file to champion.
///
/// Starts a coordinator and workers in this process, the same code as on a fleet,
/// and follows the experiment to its end. An interrupt loses at most one
/// generation: the same command continues the experiment.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct RunArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Number of workers, each of one slot [default: the number of cores]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub workers: Option<u16>,
    /// Directory of the database and the champion file.
    #[arg(long, value_name = "DIR", default_value = "./swarm-data")]
    pub data_dir: PathBuf,
    #[command(flatten)]
    pub isa: IsaArgs,
}

const HELP: &str = "\
With --output json it prints a line per generation (numbered from 0), then one
with state, digest and champion.

Examples:
  swarmctl run experiment.json
  swarmctl run experiment.json --generations 20 --seed 7 --data-dir /tmp/try";

/// Starts a fleet, evolves, and stops the fleet even if evolving failed.
pub async fn run(
    args: &RunArgs,
    mut progress: Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    // A bad file is refused before the data directory is created.
    let file = args.experiment.checked_file()?;
    let n_workers = args
        .workers
        .map_or_else(|| thread::available_parallelism().map_or(1, Into::into), usize::from);
    log::init(progress.stderr());
    let mut fleet = Fleet::start(&args.data_dir, n_workers, args.isa.get()).await?;
    let result = match fleet.connection() {
        Ok(connection) => tokio::select! {
            biased;
            () = interrupt.cancelled() => Err(interrupted(&args.data_dir)),
            result = evolve(&connection, &file, args, &mut progress) => result,
            error = fleet.failure() => Err(error),
        },
        Err(error) => Err(error),
    };
    progress.clear();
    if matches!(result, Err(Error::Interrupted(_))) {
        progress
            .remark("stopping when the running items are done; interrupt again to stop at once");
    }
    fleet.shutdown().await;
    result
}

/// Submits the experiment, or finds it unfinished, and follows it to its end.
async fn evolve(
    connection: &Connection,
    file: &ExperimentFile,
    args: &RunArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    let unfinished: Vec<Experiment> = connection
        .experiments()
        .await?
        .into_iter()
        .filter(|experiment| experiment.state() == ExperimentState::Running)
        .collect();
    let request = SubmitExperimentRequest {
        resume_unfinished: true,
        ..file.request(&args.experiment.overrides(), random_request_id("run"))
    };
    let response = connection.submit(request).await.map_err(|error| file.locate(error))?;
    let experiment = present(response.experiment)?;
    let remarks =
        file.warnings(&response.warnings).into_iter().chain(remarks(&experiment, &unfinished));
    for remark in remarks {
        progress.remark(&remark);
    }
    if !progress.is_json() {
        progress.print(&text::submitted(&experiment))?;
    }

    let followed = watch::follow(connection, experiment.id, progress).await?;
    let Followed { experiment, champion, first_best } = &followed;
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
    watch::success(experiment)
}

/// Remarks that the experiment is continued, and on other unfinished experiments.
fn remarks(experiment: &Experiment, unfinished: &[Experiment]) -> Vec<String> {
    let mut remarks = Vec::new();
    let (this, others): (Vec<_>, Vec<_>) =
        unfinished.iter().partition(|other| other.id == experiment.id);
    if let [this] = this[..] {
        remarks.push(format!(
            "continuing {}, {} of {} generations done",
            text::title(this),
            this.generations_done,
            this.generations
        ));
    }
    for other in others {
        remarks.push(format!(
            "{} in this data directory is also unfinished, and continues at the same time",
            text::title(other)
        ));
    }
    remarks
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
    fn a_new_experiment_alone_needs_no_remark() {
        assert!(remarks(&experiment(3, "a"), &[]).is_empty());
    }

    #[test]
    fn continuing_is_said_and_so_is_company() {
        let unfinished = [experiment(2, "b"), experiment(3, "a")];
        let lines = remarks(&experiment(3, "a"), &unfinished);
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
