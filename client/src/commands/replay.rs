//! `swarmctl replay`: an episode as one HTML file for a browser, or as a picture.

mod picture;

use std::path::{Path, PathBuf};

use clap::Args;
use experiment_file::limits;
use replay::{Episode, Judged, Replay, ReplayError, Trials};
use schemars::JsonSchema;
use serde::Serialize;
use sim_core::{RobotRecord, RoomRecord, StepRecord, TrialSet};
use swarm_proto::v1::JudgedFitness;
use swarm_web::replay_file;

use self::picture::PictureArgs;
use super::genotype_args::{Found, GenotypeArgs};
use crate::{
    args::{SeedArg, StepsArg, whole},
    change::{Change, SetArg},
    error::{Code, Error},
    experiment_file::Overrides,
    output_file::Overwrite,
    progress::Progress,
    settings::Settings,
    text, waiting,
};

/// Write an episode as an HTML file that plays step by step in any browser.
///
/// The command simulates the swarm again, to the same bits as in evolution, so you can
/// replay any individual of any generation without a recording. The file needs only a
/// browser and no network, so it can accompany a paper. It shows the world, which robots
/// hear which, LEDs, measures, and the activity of every neuron of a robot.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ReplayArgs {
    #[command(flatten)]
    which: GenotypeArgs,
    #[command(flatten)]
    seed: SeedArg,
    /// Generation of the worlds to simulate, from 0 [default: that of the address; 0 for an
    /// experiment file]
    #[arg(long, value_name = "G", value_parser = whole(0..=u64::MAX))]
    generation: Option<u64>,
    /// Trial of the generation, which sets the world [default: for a champion, the median trial of
    /// its judgement; else 0]
    #[arg(long, value_name = "N", value_parser = whole(0..=limits::TRIALS - 1))]
    trial: Option<u32>,
    /// Trial of the champion's judgement.
    #[arg(long, value_name = "N", conflicts_with_all = ["trial", "generation", "genotype"])]
    judged: Option<u32>,
    #[command(flatten)]
    steps: StepsArg,
    #[command(flatten)]
    set: SetArg,
    #[command(flatten)]
    picture: PictureArgs,
    /// File to write; its name ends in .html, or in .png or .svg for a picture of the world
    /// [default: replay-ADDRESS.html, replay.html]
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl replay 3
  swarmctl replay 3@0/17 --data-dir swarm-data --to early.html
  swarmctl replay 3 --set world.objects.robot.num_instances=20 --steps 500
  swarmctl replay 3 --to swarm.png --at 120 --size 1600 --dpi 300
  swarmctl replay 3 --to swarm.svg --at 120
  swarmctl replay 3 --to swarm.png --at 0..200
  swarmctl replay --config experiment.json --genotype champion.json";

/// A written replay or picture, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Written {
    /// Path of the file.
    file: String,
}

/// Simulates, and writes the file.
pub async fn replay(
    settings: Settings,
    args: &ReplayArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    let (path, format) = args.path()?;
    args.overwrite.check(&path)?;
    let Found { file, genotype, generation, judged } = args.which.find(settings, progress).await?;
    let mut changes = Vec::new();
    for text in &args.set.set {
        let parsed = Change::parse_all(text);
        changes.extend(parsed.map_err(|problem| Error::option("--set", problem))?);
    }
    let is_as_evolved =
        changes.is_empty() && args.seed.seed.is_none() && args.steps.steps.is_none();
    let overrides =
        Overrides { seed: args.seed.seed, steps: args.steps.steps, ..Overrides::default() };
    let compiled = file.changed(&changes).and_then(|file| file.compile(&overrides));
    let compiled = compiled.map_err(|error| file.invalid(&error))?;
    let name = args.which.title(&genotype);
    let episode = Episode {
        config: &compiled.config,
        simulation: &compiled.experiment,
        genotype: &genotype.genes,
        name: &name,
        trial_set: TrialSet::Generation(args.generation.unwrap_or(generation)),
        trial: args.trial.unwrap_or_default(),
    };
    let mut trials = None;
    let episode = match judged {
        Some(judged) if args.trial.is_none() && args.generation.is_none() => {
            let JudgedFitness { mean, low, high, trials: n, generation: last } = judged;
            let known = Judged { generation: last, trials: n, mean, interval: (low, high) };
            let what =
                format!("computing the {n} trials of its judgement; --trial N plays one alone");
            let all = waiting::busy(&what, || {
                Trials::of_judgement(episode.simulation, episode.genotype, known, &|| true)
            });
            let all = all.map_err(|error| Error::Input(format!("{name}: {error}")).about(&name))?;
            let all = all.expect("nothing stops it");
            let (trial, what) = judged_trial(&all, judged.trials, args.judged)?;
            // A changed swarm has no judgement.
            let changed = format!(
                "playing trial {trial} of the {} of the judgement, with changes; others: --judged N",
                judged.trials
            );
            progress.remark(match is_as_evolved {
                true => &what,
                false => &changed,
            });
            trials = is_as_evolved.then_some(all);
            Episode { trial_set: TrialSet::Judgement(judged.generation), trial, ..episode }
        }
        None if args.judged.is_some() => {
            let why = format!(
                "the {name} has not been judged; name a world of its generation with --trial"
            );
            return Err(Error::at(Code::BadArgument, "--judged", why));
        }
        _ => episode,
    };
    let bytes = waiting::busy("computing the episode", || match format {
        Format::Html => html(&episode, generation, trials).map(String::into_bytes),
        Format::Png => picture::png(
            &compiled.config,
            room(&episode)?.as_ref(),
            &steps(&episode)?,
            &args.picture,
        ),
        Format::Svg => picture::svg(
            &compiled.config,
            room(&episode)?.as_ref(),
            &steps(&episode)?,
            &args.picture,
        ),
    })?;
    args.overwrite.write(&path, &bytes)?;
    let file = path.display().to_string();
    match progress.is_json() {
        true => progress.print_document(&Written { file }),
        false => progress.print(&file),
    }
}

/// The requested trial of a judgement, or the median one; and a remark about it.
fn judged_trial(trials: &Trials, n: u32, wanted: Option<u32>) -> Result<(u32, String), Error> {
    if let Some(trial) = wanted {
        if trial >= n {
            let last = n.saturating_sub(1);
            return Err(Error::option("--judged", format!("{trial}: the trials are 0 to {last}")));
        }
        return Ok((trial, format!("playing trial {trial} of the {n} that judged the champion")));
    }
    let trial = trials.median();
    let value = trials.fitness(trial);
    let what = format!(
        "playing trial {trial} of the {n} that judged the champion, the median: fitness {}; \
         others: --judged N, or --trial N of its generation",
        text::number(value, 6)
    );
    Ok((trial, what))
}

/// The contents of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Html,
    Png,
    Svg,
}

fn html(episode: &Episode<'_>, generation: u64, trials: Option<Trials>) -> Result<String, Error> {
    let replay = Replay::simulate(episode).map_err(|error| match error {
        ReplayError::Evaluate(error) => {
            let message = format!("{}: {error}", episode.name);
            Error::at(Code::BadGenotype, episode.name, message)
        }
        error => Error::Input(error.to_string()).about(episode.name),
    })?;
    let replay = match trials {
        Some(trials) => replay.of_trials(trials),
        None => replay,
    };
    Ok(replay_file(episode, generation, &replay))
}

/// The room of an episode in a world with bodies.
fn room(episode: &Episode<'_>) -> Result<Option<RoomRecord>, Error> {
    let Episode { simulation, trial_set, trial, name, .. } = *episode;
    let room = simulation.room(trial_set, trial);
    room.map_err(|error| Error::Input(error.to_string()).about(name))
}

/// All steps of an episode, without the networks, which a picture does not show.
fn steps(episode: &Episode<'_>) -> Result<Vec<StepRecord>, Error> {
    let mut steps = Vec::new();
    let Episode { simulation, genotype, trial_set, trial, name, .. } = *episode;
    simulation
        .simulate(genotype, trial_set, trial, &mut |step| steps.push(outside(step)))
        .map_err(|error| Error::Input(format!("{name}: {error}")).about(name))?;
    Ok(steps)
}

/// A step without the inputs and neurons of the robots.
fn outside(step: &StepRecord) -> StepRecord {
    let outside = |robot: &RobotRecord| RobotRecord {
        message: Vec::new(),
        stimuli: Vec::new(),
        activity: Vec::new(),
        voltages: Vec::new(),
        received_message: Vec::new(),
        ..*robot
    };
    StepRecord {
        robots: step.robots.iter().map(outside).collect(),
        measures: step.measures.clone(),
        lights: step.lights.clone(),
        areas: step.areas.clone(),
        movables: step.movables.clone(),
        ..*step
    }
}

impl ReplayArgs {
    /// The file to write.
    fn path(&self) -> Result<(PathBuf, Format), Error> {
        let path = match (&self.to, &self.which.address) {
            (Some(path), _) => path.clone(),
            (None, Some(address)) => {
                format!("replay-{}.html", address.to_string().replace('/', "-")).into()
            }
            (None, None) => "replay.html".into(),
        };
        let format = match Path::extension(&path).and_then(|extension| extension.to_str()) {
            Some("html") => Format::Html,
            Some("png") => Format::Png,
            Some("svg") => Format::Svg,
            _ => {
                let path = path.display();
                let message = format!("{path}: the name must end in .html, .png or .svg");
                return Err(Error::at(Code::BadArgument, path, message));
            }
        };
        if format == Format::Html
            && let Some(option) = self.picture.given()
        {
            return Err(Error::option(option, "is for .png and .svg; a .html has all steps"));
        }
        Ok((path, format))
    }
}

#[cfg(test)]
mod tests;
