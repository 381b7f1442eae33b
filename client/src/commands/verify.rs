//! `swarmctl verify`: proves the claims of a bundle.

use std::path::{Path, PathBuf};

use bundle::{Bundle, Claim, Flaw, Proof, Sample, Verification, sha256};
use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_web::proof_file;

use super::export;
use crate::{
    args::IsaArgs, error::Error, output_file::Overwrite, pages::simulator, progress::Progress,
    resimulation::Resimulation, settings::Settings, waiting,
};

/// Check a bundle without trusting its author.
///
/// The command repeats the evolution from the experiment file and the fitness log: every link
/// of the digest chain, the history, the keyframes and the champion must have the same bits.
/// It also simulates the champion's judgement and some generations again, here or on a fleet.
/// The last link of the chain selects these generations.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct VerifyArgs {
    /// The bundle that `swarmctl export` wrote.
    file: PathBuf,
    /// Number of generations to simulate again, or `all`.
    #[arg(long, value_name = "N|all", default_value = "5", value_parser = sample)]
    generations: Sample,
    /// Number of threads that simulate here [default: one per core]
    #[arg(long, value_name = "N", value_parser = crate::args::whole::<u16>(1..=1024))]
    workers: Option<u16>,
    /// Also write a page that proves the claims in a browser: one HTML file with this bundle and
    /// the simulator, for readers who install nothing.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    isa: IsaArgs,
}

const HELP: &str = "\
The command simulates in this process, or on the fleet of the coordinator that
--coordinator or SWARM_COORDINATOR names.

Exit code 12 if a claim of the bundle is false.

Examples:
  swarmctl verify leader.zip
  swarmctl verify leader.zip --generations all --coordinator http://fleet.example:7700
  swarmctl verify leader.zip --page leader.html";

fn sample(text: &str) -> Result<Sample, String> {
    match (text, text.parse()) {
        ("all", _) => Ok(Sample::All),
        (_, Ok(n)) => Ok(Sample::Drawn(n)),
        _ => Err("must be a whole number, or `all`".to_owned()),
    }
}

impl VerifyArgs {
    /// The page to write, and the simulator within it.
    fn page(&self) -> Result<Option<(&Path, &'static [u8])>, Error> {
        let Some(path) = &self.page else { return Ok(None) };
        self.overwrite.check(path)?;
        Ok(Some((path, simulator("--page")?)))
    }
}

/// The result, for programs.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Verification")]
pub struct Report {
    /// Path of the bundle.
    file: String,
    /// SHA-256 of the bundle, 64 hexadecimal digits.
    sha256: String,
    /// The claims that are true.
    proven: Vec<Line>,
    /// What the command has not proved, and why.
    unproven: Vec<String>,
}

/// A claim that is true.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Proven")]
struct Line {
    /// The claim.
    claim: String,
    /// What proves it.
    what: String,
}

/// Checks the file.
pub async fn verify(
    settings: Settings,
    args: &VerifyArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    let page = args.page()?;
    let bytes = export::read(&args.file)?;
    let name = args.file.display();
    let bundle = waiting::busy(&format!("reading {name}"), || Bundle::read(&bytes))
        .map_err(|error| Error::of_file(&args.file, error))?;
    progress.expiring(&settings);
    let resimulation = Resimulation::open(settings, &bundle.config_json, args.workers, args.isa)?;
    let flawed = |flaw: Flaw| Error::Flawed(format!("{name}: {flaw}"));
    let mut verification = Verification::begin(&bundle, args.generations).map_err(flawed)?;
    while let Some(batches) = verification.advance().map_err(flawed)? {
        let (n_done, n_all) = verification.progress();
        progress.step(n_done, n_all, "generations");
        for batch in batches {
            let what = format!("generations; simulating {}", batch.trial_set);
            progress.step(n_done, n_all, &what);
            let simulated = resimulation.simulate(verification.simulation(), &batch).await?;
            batch.compare(&simulated).map_err(flawed)?;
        }
    }
    progress.clear();
    let proof = verification.finish();
    if let Some((path, simulator)) = page {
        let name = args.file.file_name().unwrap_or_default().to_string_lossy();
        args.overwrite.write(path, proof_file(&name, &bytes, simulator).as_bytes())?;
        progress.remark(&format!("{} proves the same claims in a browser", path.display()));
    }
    let (file, sha256) = (name.to_string(), sha256(&bytes));
    if !progress.is_json() {
        return progress.print(&proof.to_text(&file, &sha256));
    }
    let Proof { proven, unproven, .. } = proof;
    let line = |(claim, what): (Claim, String)| Line { claim: claim.to_string(), what };
    let proven = proven.into_iter().map(line).collect();
    progress.print_document(&Report { file, sha256, proven, unproven })
}
