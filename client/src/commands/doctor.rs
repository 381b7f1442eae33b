//! `swarmctl doctor`: checks a data directory, and recovers its sound part.

use std::path::{Path, PathBuf};

use clap::Args;
use model::store::{self, Fate, Finding, Inspection, Recovered, Recovery};
use schemars::JsonSchema;
use serde::Serialize;
use swarm_telemetry::escape;

use super::backup::refused;
use crate::{error::Error, output_file::Overwrite, progress::Progress, text, waiting};

/// Check the database of a data directory, or recover the sound part of a damaged one.
///
/// The command reads the whole database and never writes to it; a coordinator may use it
/// meanwhile. It checks the structure of the database, the seals of configurations,
/// generations, checkpoints and champions, and that these form an unbroken sequence. It
/// prints each damage with the next step.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct DoctorArgs {
    /// Copy everything that is sound to a new data directory. An experiment with damaged
    /// generations but a sound configuration restarts there when you resume it, and gives
    /// the same bits.
    #[arg(long, value_name = "NEW")]
    recover: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Exit code 0 if everything is sound, or --recover has made NEW; 11 if something is damaged.

Examples:
  swarmctl doctor --data-dir ./swarm-data
  swarmctl doctor --data-dir ./swarm-data --recover ./recovered
  coordinator --data-dir ./recovered";

/// The printed report on a database.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Inspection")]
pub struct InspectionDocument<'a> {
    /// Path of the database.
    database: &'a Path,
    /// Version of the tables.
    schema_version: i64,
    /// Number of experiments.
    experiments: usize,
    /// Number of generations of all experiments.
    generations: usize,
    /// The damage; empty if everything is sound.
    findings: Vec<FindingDocument<'a>>,
}

/// Damage of a database.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Finding")]
struct FindingDocument<'a> {
    /// Number of the damaged experiment; null if the whole database is concerned.
    experiment: Option<u64>,
    /// The damage.
    what: &'a str,
    /// What to do.
    next_step: &'a str,
}

/// What was recovered.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Recovery")]
pub struct RecoveryDocument<'a> {
    /// The new data directory.
    data_dir: &'a Path,
    /// Damage of the database as a whole.
    damage: &'a [String],
    /// What has become of each experiment.
    experiments: Vec<RecoveredDocument<'a>>,
}

/// An experiment of the damaged database.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Recovered")]
struct RecoveredDocument<'a> {
    /// Number of the experiment.
    id: u64,
    /// What has become of it.
    outcome: Outcome,
    /// What is missing, or why.
    problems: &'a [String],
}

/// What has become of an experiment.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Outcome {
    /// It is copied, except for its problems.
    Kept,
    /// Only its configuration is copied: it is paused before its first generation.
    Restarted,
    /// Nothing is copied.
    Lost,
}

/// Checks a data directory, or recovers it into a new one.
pub fn doctor(data_dir: &Path, args: &DoctorArgs, progress: &mut Progress) -> Result<(), Error> {
    if let Some(to) = &args.recover {
        let what = format!("copying the sound part of {}", data_dir.display());
        let recovery = args.overwrite.data_directory(data_dir, to, |to| {
            waiting::busy(&what, || store::recover(data_dir, to)).map_err(|error| refused(&error))
        })?;
        return match progress.is_json() {
            true => progress.print_document(&recovery_document(&recovery, to)),
            false => progress.print(&recovery_text(&recovery, to)),
        };
    }
    let what = format!("checking everything in {}", data_dir.display());
    let inspection = waiting::busy(&what, || store::inspect(data_dir))
        .map_err(|error| Error::from_store(&error))?;
    print_inspection(&inspection, progress)?;
    match inspection.findings.len() {
        0 => Ok(()),
        n => Err(Error::Damaged(format!(
            "{} in {}",
            text::counted(n as u64, "finding"),
            inspection.path.display()
        ))),
    }
}

/// Prints the state of a database.
pub fn print_inspection(inspection: &Inspection, progress: &mut Progress) -> Result<(), Error> {
    if progress.is_json() {
        return progress.print_document(&inspection_document(inspection));
    }
    let findings = inspection.findings.iter().map(finding_text);
    let lines: Vec<String> = [summary(inspection)].into_iter().chain(findings).collect();
    progress.print(&lines.join("\n"))
}

fn summary(inspection: &Inspection) -> String {
    format!(
        "{}: {}, {}, schema version {}{}",
        inspection.path.display(),
        text::counted(inspection.n_experiments as u64, "experiment"),
        text::counted(inspection.n_generations as u64, "generation"),
        inspection.schema_version,
        if inspection.findings.is_empty() { "; all sound" } else { "" }
    )
}

fn finding_text(finding: &Finding) -> String {
    format!("{}\n  -> {}", escape(&finding.what), finding.next_step)
}

fn inspection_document(inspection: &Inspection) -> InspectionDocument<'_> {
    InspectionDocument {
        database: &inspection.path,
        schema_version: inspection.schema_version,
        experiments: inspection.n_experiments,
        generations: inspection.n_generations,
        findings: inspection.findings.iter().map(finding_document).collect(),
    }
}

fn finding_document(finding: &Finding) -> FindingDocument<'_> {
    FindingDocument {
        experiment: finding.experiment.map(|id| id.0),
        what: &finding.what,
        next_step: &finding.next_step,
    }
}

fn recovery_text(recovery: &Recovery, to: &Path) -> String {
    let outcome = |recovered: &Recovered| {
        let what = match recovered.fate {
            Fate::Kept if recovered.problems.is_empty() => "kept",
            Fate::Kept => "kept, except for a part",
            Fate::Restarted => "paused before its first generation",
            Fate::Lost => "lost",
        };
        text::with_reason(
            &format!("experiment {} {what}", recovered.id),
            &recovered.problems.join("; "),
        )
    };
    let made = format!("new data directory: {}", to.display());
    let lines: Vec<String> = recovery.experiments.iter().map(outcome).chain([made]).collect();
    lines.join("\n")
}

fn recovery_document<'a>(recovery: &'a Recovery, to: &'a Path) -> RecoveryDocument<'a> {
    let recovered = |recovered: &'a Recovered| RecoveredDocument {
        id: recovered.id.0,
        outcome: match recovered.fate {
            Fate::Kept => Outcome::Kept,
            Fate::Restarted => Outcome::Restarted,
            Fate::Lost => Outcome::Lost,
        },
        problems: &recovered.problems,
    };
    RecoveryDocument {
        data_dir: to,
        damage: &recovery.damage,
        experiments: recovery.experiments.iter().map(recovered).collect(),
    }
}
