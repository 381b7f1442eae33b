//! `swarmctl export-controller`: an evolved controller as C, with a proof.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use clap_complete::ArgValueCompleter;
use controller_c::{About, Controller, NAMES};
use evolution::Digest;
use experiment_file::limits;
use serde::Serialize;
use sim_core::{FINGERPRINT, TrialSet};

use super::simulate::genotype::Genotype;
use crate::{
    address::NamedAddress,
    args::{ChangedArg, FOREIGN, whole},
    complete,
    connection::Connection,
    error::Error,
    experiment_file::{Compiled, ExperimentFile, Overrides},
    json,
    output_file::Overwrite,
    place::Intent,
    progress::Progress,
    settings::Settings,
    waiting,
};

/// Write a controller as C99 for a robot, with a test that compares every bit.
///
/// The directory gets controller.h and controller.c, the network of one robot without heap,
/// globals, and functions of libm other than fmaf; swarm_radio.h and swarm_radio.c, which choose
/// the received frame and what is sent; recorded episodes, and test.c, which compares all stimuli,
/// decisions, activities and frames of every robot with them; a Makefile and a README.md. `make
/// test` proves that the compiled controller computes the bits of the simulation, here or on
/// another processor.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ExportControllerArgs {
    /// The genotype: ID or NAME, the champion of an experiment; ID@G/I, individual I of generation
    /// G; ID@G/mean, the mean of the distribution after generation G.
    #[arg(add = ArgValueCompleter::new(complete::experiments), required_unless_present = "config", conflicts_with_all = ["config", "genotype"])]
    address: Option<NamedAddress>,
    /// Experiment file of --genotype, instead of an address.
    #[arg(long, value_name = "FILE", requires = "genotype")]
    config: Option<PathBuf>,
    /// File with the genotype: a JSON list of genes, or an object with a `genotype`,
    /// such as a champion file; with --config.
    #[arg(long, value_name = "FILE", group = FOREIGN, requires = "config")]
    genotype: Option<PathBuf>,
    #[command(flatten)]
    changed: ChangedArg,
    /// Language of the controller.
    #[arg(long, value_enum, default_value_t = Language::C)]
    language: Language,
    /// Directory to write.
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
    /// Generation of the recorded episodes, from 0 [default: that of the address; 0 for an
    /// experiment file]
    #[arg(long, value_name = "G", value_parser = whole(0..=u64::MAX))]
    generation: Option<u64>,
    /// Number of recorded episodes.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=limits::TRIALS))]
    trials: u32,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// A language of controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    /// C99
    C,
}

const HELP: &str = "\
Examples:
  swarmctl export-controller 3 --language c --to robot && make -C robot test
  swarmctl export-controller 3@5/7 --to robot --trials 20
  swarmctl export-controller --config experiment.json --genotype champion.json --to robot
  make -C robot clean test CC=aarch64-linux-gnu-gcc RUN=qemu-aarch64-static CFLAGS=-static";

/// A written controller.
#[derive(Debug, Serialize)]
struct Written<'a> {
    experiment: &'a str,
    genotype: String,
    config_digest: &'a str,
    directory: String,
    files: Vec<&'static str>,
    robot_steps: u64,
}

/// Records the episodes, and writes the files.
pub async fn export_controller(
    settings: Settings,
    args: &ExportControllerArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    args.overwrite.check_files(&args.to, &NAMES)?;
    let Language::C = args.language;
    let (file, genotype, generation) = subject(settings, args, progress).await?;
    let Compiled { config, experiment: simulation, .. } =
        file.compile(&Overrides::default()).map_err(|error| file.invalid(&error))?;
    let about = About {
        experiment: config.name.clone(),
        genotype: args.title(&genotype),
        config_digest: Digest::of_config(&config, FINGERPRINT).to_string(),
    };
    let output = args.overwrite.begin_files(&args.to, &NAMES)?;
    let trial_set = TrialSet::Generation(generation);
    let controller = waiting::busy("recording the episodes; --trials reduces their number", || {
        controller_c::export(&simulation, &genotype.genes, trial_set, 0..args.trials, &about)
    });
    let Controller { files, robot_steps } =
        controller.map_err(|error| Error::Input(format!("{genotype}: {error}")))?;
    for (name, content) in &files {
        output.write(name, content)?;
    }
    output.finish()?;
    let directory = args.to.display().to_string();
    progress.print(&if progress.is_json() {
        let genotype = genotype.to_string();
        let files = files.iter().map(|(name, _)| *name).collect();
        json::document(&Written {
            experiment: &about.experiment,
            genotype,
            config_digest: &about.config_digest,
            directory,
            files,
            robot_steps,
        })
    } else {
        format!(
            "{genotype}: {} files in {directory}, with {robot_steps} recorded robot-steps\n\
             prove it with: make -C {directory} test",
            files.len()
        )
    })
}

impl ExportControllerArgs {
    /// The source of the genotype, for readers of the files. Leaves out the directories of a path,
    /// which only this machine has.
    fn title(&self, genotype: &Genotype) -> String {
        match self.genotype.as_deref().and_then(Path::file_name) {
            Some(name) => format!("genotype in {}", name.display()),
            None => genotype.to_string(),
        }
    }
}

/// The experiment, the genotype, and the generation of the worlds.
async fn subject(
    settings: Settings,
    args: &ExportControllerArgs,
    progress: &Progress,
) -> Result<(ExperimentFile, Genotype, u64), Error> {
    if let (Some(config), Some(genotype)) = (&args.config, &args.genotype) {
        let file = ExperimentFile::read(config);
        let file = file.map_err(|error| Error::invalid(config, &error))?;
        let genotype = Genotype::read(genotype, &file, args.changed)?;
        return Ok((file, genotype, args.generation.unwrap_or_default()));
    }
    let address = args.address.as_ref().expect("clap requires an address or a file");
    let connection = Connection::open(settings, Intent::Read, progress).await?;
    let address = connection.resolve(address).await?;
    let found = connection.genotype(address).await?;
    let name = format!("experiment {}", address.experiment);
    let file = ExperimentFile::new(name.into(), found.config_json.clone());
    let generation = args.generation.unwrap_or(found.individual.generation);
    Ok((file, Genotype::found(address, found), generation))
}
