//! `swarmctl compare`: compares samples of runs.

pub mod realities;
pub mod report;
mod samples;

use std::path::PathBuf;

use clap::Args;
use clap_complete::ArgValueCompleter;
use statistics::{interquartile_mean, interval};

use crate::{
    complete,
    connection::Connection,
    error::{Code, Error},
    figure::{CURVES_MAX, Curve, Drawing as _, Figure, Format, Point},
    output_file::Overwrite,
    place::Intent,
    progress::Progress,
    recorded::Source,
    settings::Settings,
    subject::Subject,
};

use self::{
    realities::{Ranking, is_evaluation},
    report::Report,
    samples::{Sample, Samples},
};

/// Default number of last generations to average in each run.
const LAST: u64 = 50;
/// Maximum number of points of a curve: the interval of each costs ten thousand draws.
const POINTS_MAX: usize = 200;

/// Compare groups of runs: how good each is, which is better, and how certain that is.
///
/// Prints, for each sample of runs, median and interquartile mean with their 95 % bootstrap
/// intervals: of the champions' judged fitness, of the last generations, and of the time to
/// a target. Then, for each pair, the probability that a run of the first is better than
/// one of the second (the A of Vargha and Delaney) and the p-value of the Mann-Whitney test.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct CompareArgs {
    /// Names of groups, numbers of experiments, or files: histories (.csv) that `swarmctl
    /// history` wrote and champions (.json) that `swarmctl champion` or `swarmctl run` wrote.
    /// Or directories that `swarmctl evaluate --pseudo-realities` wrote, one per champion: then the
    /// champions are ranked by their fitness in the pseudo-realities, beside the nominal ranking.
    #[arg(required = true, value_name = "GROUP|ID|FILE|DIR", add = ArgValueCompleter::new(complete::experiments_and_files))]
    pub runs: Vec<String>,
    /// Number of last generations to average in each run; a shorter run is averaged whole.
    #[arg(long, value_name = "N", default_value_t = LAST, value_parser = clap::value_parser!(u64).range(1..))]
    pub last: u64,
    /// Also compare how many generations and episodes it takes until the mean fitness of a
    /// generation first reaches F. A run that never reaches F counts as infinitely long.
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub target: Option<f64>,
    /// Draw the mean fitness of the generations: the interquartile mean of the runs, in a
    /// band of its 95 % interval. The name ends in .svg or .png.
    #[arg(long, value_name = "FILE")]
    pub to: Option<PathBuf>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

const HELP: &str = "\
If the runs of a group differ in more than the seed, each variant is a sample.
Files NAME-SEED.csv and NAME-SEED.json belong to one run, and all runs of one
NAME are a sample. Champion files with other names, such as those of `run`,
contain name and seed. p-values are two-sided, and not corrected for the number
of pairs.

Examples:
  swarmctl compare leader_selection_snes leader_selection_ga --target 1
  swarmctl compare results/{histories,champions}/leader_selection_{snes,ga}-*
  swarmctl compare realities/champion-*
  swarmctl compare sizes --to sizes.svg --output json";

/// Reads the runs and compares them. Asks the coordinator only about runs without a file.
pub async fn compare(
    settings: Settings,
    args: &CompareArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    if args.runs.iter().any(|text| is_evaluation(text)) {
        return rank(args, progress);
    }
    // Refuses a bad name of the figure before reading anything.
    args.to.as_deref().map(|to| Format::check(to, args.overwrite)).transpose()?;
    if args.target.is_some_and(|target| !target.is_finite()) {
        return Err(Error::option("--target", "is a finite number"));
    }
    let mut samples = Samples::default();
    let (mut files, mut subjects) = (Vec::new(), Vec::new());
    for text in &args.runs {
        match Source::parse(text) {
            Source::File(path) => files.push(path),
            Source::Coordinator(subject) => subjects.push(subject),
        }
    }
    samples.read(&files)?;
    if !subjects.is_empty() {
        let connection = Connection::open(settings, Intent::Read, progress).await?;
        for subject in &subjects {
            samples.fetch(&connection, subject, progress).await?;
        }
    }
    let samples = samples.finish()?;
    let report = Report::new(&samples, args.last, args.target);
    if let Some(to) = &args.to {
        figure(&samples)?.write(to, args.overwrite)?;
    }
    match progress.is_json() {
        true => progress.print_document(&report),
        false => progress.print_parts(&report.to_parts()),
    }
}

/// Ranks champions by their evaluations in pseudo-realities.
fn rank(args: &CompareArgs, progress: &mut Progress) -> Result<(), Error> {
    if let Some(other) = args.runs.iter().find(|text| !is_evaluation(text)) {
        let problem = format!("{other} is no directory of an evaluation, as the others are");
        return Err(Error::at(Code::BadArgument, other, problem));
    }
    if args.to.is_some() || args.target.is_some() {
        let option = if args.to.is_some() { "--to" } else { "--target" };
        let problem = "--to and --target compare runs, not evaluations of champions";
        return Err(Error::at(Code::BadArgument, option, problem));
    }
    let ranking = Ranking::read(&args.runs)?;
    match progress.is_json() {
        true => progress.print_document(&ranking),
        false => progress.print_parts(&ranking.to_parts()),
    }
}

/// Prints the comparison of the runs of a group.
pub async fn of_group(
    connection: &Connection,
    group: &str,
    progress: &mut Progress,
) -> Result<(), Error> {
    let mut samples = Samples::default();
    samples.fetch(connection, &Subject::Group(group.to_owned()), progress).await?;
    let samples = samples.finish()?;
    progress.print_parts(&Report::new(&samples, LAST, None).to_parts())
}

/// The curves of the samples, each as long as its shortest run.
fn figure(samples: &[Sample]) -> Result<Figure, Error> {
    let curves: Vec<Curve> = samples.iter().filter_map(curve).collect();
    match curves.len() {
        0 => Err(Error::Input("there is no history to draw; give .csv files".into()).about("--to")),
        n if n > CURVES_MAX => {
            let message = format!("a figure holds at most {CURVES_MAX} samples");
            Err(Error::Input(message).about("--to"))
        }
        _ => Ok(Figure {
            title: "mean fitness of the generations".into(),
            caption: "line: interquartile mean of the runs; band: its 95 % interval".into(),
            x_label: "generation".into(),
            y_label: "mean fitness".into(),
            curves,
        }),
    }
}

fn curve(sample: &Sample) -> Option<Curve> {
    let histories: Vec<_> = sample.histories().collect();
    let n_generations = histories.iter().map(|history| history.len()).min()?;
    let point = |generation: usize| {
        let means: Vec<f64> = histories.iter().map(|history| history[generation].mean).collect();
        let found = interval(&means, interquartile_mean);
        let [low, high] = found.ci95.unwrap_or([found.value; 2]);
        Point { x: histories[0][generation].generation as f64, low, middle: found.value, high }
    };
    let step = n_generations.div_ceil(POINTS_MAX).max(1);
    let points: Vec<Point> = (0..n_generations).step_by(step).map(point).collect();
    (!points.is_empty()).then(|| Curve { name: sample.name.clone(), points })
}

#[cfg(test)]
mod tests;
