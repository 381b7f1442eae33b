//! `swarmctl export-controller`: an evolved controller as C, with a proof, or as a graph of ONNX.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use controller_c::{About, Controller, Episodes, LEN_MAX};
use evolution::Digest;
use experiment_file::limits;
use schemars::JsonSchema;
use serde::Serialize;
use sim_core::{FINGERPRINT, TrialSet};

use super::genotype_args::{Found, GenotypeArgs};
use crate::{
    args::whole,
    error::{Code, Error},
    experiment_file::{Compiled, Overrides},
    output_file::Overwrite,
    progress::Progress,
    settings::Settings,
    waiting,
};

/// Write a controller as C99 for a robot, with a test that compares every bit.
///
/// In C, the directory gets controller.h and controller.c, the network of one robot without heap,
/// globals, and functions of libm other than fmaf; swarm_radio.h and swarm_radio.c, which choose
/// the received frame and what is sent; recorded episodes, and test.c, which compares all stimuli,
/// decisions, activities and frames of every robot with them; a Makefile and a README.md. `make
/// test` proves that the compiled controller computes the bits of the simulation, here or on
/// another processor.
///
/// In ONNX, it gets controller.onnx, one step of any number of robots: from their stimuli and
/// state to what they do and their next state. Runtimes round otherwise than the simulation.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ExportControllerArgs {
    #[command(flatten)]
    which: GenotypeArgs,
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
    /// A graph of ONNX, of rate neurons; without recorded episodes
    Onnx,
}

impl Language {
    /// The names of all files that a controller may have.
    fn names(self) -> &'static [&'static str] {
        match self {
            Self::C => &controller_c::NAMES,
            Self::Onnx => &[controller_onnx::NAME],
        }
    }
}

const HELP: &str = "\
Examples:
  swarmctl export-controller 3 --language c --to robot && make -C robot test
  swarmctl export-controller 3@5/7 --to robot --trials 20
  swarmctl export-controller --config experiment.json --genotype champion.json --to robot
  swarmctl export-controller 3 --language onnx --to robot
  make -C robot clean test CC=aarch64-linux-gnu-gcc RUN=qemu-aarch64-static CFLAGS=-static";

/// A written controller.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Controller")]
pub struct Written<'a> {
    /// Name of the experiment.
    experiment: &'a str,
    /// The source of the genotype, for people.
    genotype: String,
    /// Digest of the experiment file with its seed, 64 hexadecimal digits.
    config_digest: &'a str,
    /// The directory with the files.
    directory: String,
    /// Names of the files.
    files: Vec<&'static str>,
    /// Number of recorded steps, counted for each robot; 0 in ONNX.
    robot_steps: u64,
}

/// Records the episodes, and writes the files.
pub async fn export_controller(
    settings: Settings,
    args: &ExportControllerArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    args.overwrite.check_files(&args.to, args.language.names())?;
    if args.language == Language::Onnx && (args.trials > 1 || args.generation.is_some()) {
        let option = if args.trials > 1 { "--trials" } else { "--generation" };
        let why =
            "a controller in ONNX has no recorded episodes; leave out --trials and --generation";
        return Err(Error::at(Code::BadArgument, option, why));
    }
    let Found { file, genotype, generation, .. } = args.which.find(settings, progress).await?;
    let Compiled { config, experiment: simulation, .. } =
        file.compile(&Overrides::default()).map_err(|error| file.invalid(&error))?;
    let about = About {
        experiment: config.name.clone(),
        genotype: args.which.title(&genotype),
        config_digest: Digest::of_config(&config, FINGERPRINT).to_string(),
    };
    let output = args.overwrite.begin_files(&args.to, args.language.names())?;
    let genes = &genotype.genes;
    let trial_set = TrialSet::Generation(args.generation.unwrap_or(generation));
    let unfit = |error: &dyn std::fmt::Display| {
        Error::at(Code::BadGenotype, genotype.place(), format!("{genotype}: {error}"))
    };
    let Controller { files, robot_steps } = match args.language {
        Language::C => {
            let episodes = Episodes {
                trial_set,
                trials: 0..args.trials,
                len_max: LEN_MAX,
                keep_going: &|| true,
            };
            let record = || controller_c::export(&simulation, genes, episodes, &about);
            waiting::busy("recording the episodes; --trials reduces their number", record)
                .map_err(|error| unfit(&error))?
        }
        Language::Onnx => {
            let graph = controller_onnx::export(&simulation, genes, &about);
            let graph = graph.map_err(|error| unfit(&error))?;
            Controller { files: vec![(controller_onnx::NAME, graph)], robot_steps: 0 }
        }
    };
    for (name, content) in &files {
        output.write(name, content)?;
    }
    output.finish()?;
    let directory = args.to.display().to_string();
    if progress.is_json() {
        return progress.print_document(&Written {
            experiment: &about.experiment,
            genotype: genotype.to_string(),
            config_digest: &about.config_digest,
            directory,
            files: files.iter().map(|(name, _)| *name).collect(),
            robot_steps,
        });
    }
    progress.print(&if args.language == Language::Onnx {
        format!("{genotype}: {} in {directory}", controller_onnx::NAME)
    } else {
        format!(
            "{genotype}: {} files in {directory}, with {robot_steps} recorded robot-steps\n\
             prove it with: make -C {directory} test",
            files.len()
        )
    })
}
