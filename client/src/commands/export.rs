//! `swarmctl export`: an ended experiment as a file for others.

use std::{
    fs::{self, File},
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use bundle::{LEN_MAX, sha256};
use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use crate::{
    args::Target,
    connection::{Connection, present},
    error::Error,
    file_kind::{self, Kind},
    output_file::{Overwrite, unwritable},
    progress::Progress,
    remote::Remote,
    subject::Subject,
    tensorboard::EventFile,
    text,
};

/// Write an ended experiment to a file that others can verify and import.
///
/// The bundle is a ZIP archive, described as an RO-Crate: experiment file, seed, versions,
/// history, the fitness of every individual in every trial, keyframes and the champion. A
/// publication needs only this file and the program: `swarmctl verify` recomputes everything
/// in it. The same experiment and version give the same file, byte by byte.
///
/// With --tensorboard, the command writes the history so far for TensorBoard instead.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ExportArgs {
    #[command(flatten)]
    target: Target,
    /// File of the bundle.
    #[arg(long, value_name = "FILE", required_unless_present = "tensorboard")]
    to: Option<PathBuf>,
    /// Write an event file for TensorBoard, in a subdirectory of DIR.
    #[arg(long, value_name = "DIR", conflicts_with = "to")]
    tensorboard: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl export leader --to leader.zip
  swarmctl export 1 --to quickstart.zip --data-dir swarm-data
  swarmctl export 3 --tensorboard runs && tensorboard --logdir runs";

/// A written bundle, or a file for TensorBoard.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Exported")]
pub struct Written {
    /// Number of the experiment.
    experiment: u64,
    /// Path of the file.
    file: String,
    /// Size of the file, bytes.
    bytes: usize,
    /// SHA-256 of the file, 64 hexadecimal digits.
    sha256: String,
}

impl Remote for ExportArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        export(&self, connection, progress).await
    }
}

/// Writes the file.
async fn export(
    args: &ExportArgs,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    args.to.as_deref().map(|to| args.overwrite.check(to)).transpose()?;
    let id = match &args.target.subject {
        Subject::Experiment(id) => *id,
        subject => connection.one(subject).await?.id,
    };
    let (path, bytes, next) = match (&args.to, &args.tensorboard) {
        (Some(path), _) => {
            let words = ["swarmctl", "verify", &path.to_string_lossy()].map(str::to_owned);
            let next = format!("check it with: {}", text::shell_command(words));
            (path.clone(), connection.export(id).await?, next)
        }
        (None, Some(directory)) => {
            let (path, bytes) = events(connection, id, directory).await?;
            let words = ["tensorboard", "--logdir", &directory.to_string_lossy()];
            let next = format!("open it with: {}", text::shell_command(words.map(str::to_owned)));
            (path, bytes, next)
        }
        (None, None) => return Err(Error::Input("name a file to write with --to".into())),
    };
    args.overwrite.write(&path, &bytes)?;
    let file = path.display().to_string();
    let written = Written { experiment: id, file, bytes: bytes.len(), sha256: sha256(&bytes) };
    if progress.is_json() {
        return progress.print_document(&written);
    }
    let Written { experiment, file, bytes, sha256 } = written;
    progress.print(&format!(
        "experiment {experiment} is in {file}, {bytes} bytes, SHA-256 {sha256}\n{next}"
    ))
}

/// The history of an experiment as an event file, and its path: TensorBoard shows each
/// directory as a run.
async fn events(
    connection: &Connection,
    id: u64,
    directory: &Path,
) -> Result<(PathBuf, Vec<u8>), Error> {
    let (experiment, _) = connection.stored(id).await?;
    let mut file = EventFile::new(experiment.submitted_at_ms);
    for completed in connection.generations(id).await? {
        let of = present(completed.summary)?;
        let values = [
            ("fitness/best", of.best),
            ("fitness/mean", of.mean),
            ("fitness/min", of.min),
            ("fitness/standard_deviation", of.standard_deviation),
            ("speed/episodes_per_second", text::episodes_per_s(&of)),
        ];
        file.scalars(of.generation, completed.completed_at_ms, values);
    }
    let is_plain = |c: char| c.is_alphanumeric() || "-_".contains(c);
    let name = experiment.name.chars().map(|c| if is_plain(c) { c } else { '_' });
    let run: String = name.take(80).collect::<String>() + &format!("-{id}");
    let run = directory.join(run);
    let failed = |source| unwritable(&run, &source);
    fs::create_dir_all(&run).map_err(failed)?;
    let name = format!("events.out.tfevents.{}.swarmevo", experiment.submitted_at_ms / 1000);
    Ok((run.join(name), file.into_bytes()))
}

/// Reads a bundle from an untrusted source, up to the size limit of bundles.
pub fn read(path: &Path) -> Result<Vec<u8>, Error> {
    let failed = |source: io::Error| Error::of_file(path, source);
    file_kind::expect(path, &[Kind::Bundle], "a bundle")
        .map_err(|what| failed(io::Error::other(what)))?;
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(LEN_MAX + 1).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}
