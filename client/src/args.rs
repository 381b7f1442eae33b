//! Arguments that several commands share. Each command's own arguments are in its module.

use std::{
    fmt::{self, Display},
    ops::RangeInclusive,
    path::PathBuf,
    str::FromStr,
    thread,
};

use clap::Args as ClapArgs;
use clap_complete::ArgValueCompleter;
use experiment_file::limits;
use model::labels;
use sim_core::Isa;

use crate::{
    complete,
    error::Error,
    examples::{self, Example},
    experiment_file::{ExperimentFile, Overrides},
    subject::Subject,
    sweep::SweepArgs,
};

/// The experiment or group that a command applies to.
#[derive(Debug, ClapArgs)]
pub struct Target {
    /// Number or name of the experiment, or name of a group of experiments.
    #[arg(value_name = "ID|NAME", add = ArgValueCompleter::new(complete::experiments))]
    pub subject: Subject,
}

/// A label: `KEY=VALUE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    pub key: String,
    pub value: String,
}

impl Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, self.value)
    }
}

impl FromStr for Label {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
        let (key, value) = (key.to_owned(), value.to_owned());
        labels::check(&[(key.clone(), value.clone())].into())?;
        Ok(Self { key, value })
    }
}

/// An experiment file to evolve, and replacements of its values.
#[derive(Debug, ClapArgs)]
pub struct ExperimentArgs {
    /// The experiment file; - is standard input.
    #[arg(required_unless_present = "example")]
    config: Option<PathBuf>,
    /// Evolve an experiment that is part of this program, instead of a file: `swarmctl examples`
    /// lists them.
    #[arg(long, value_name = "NAME", conflicts_with = "config", value_parser = examples::parser(), hide_possible_values = true)]
    example: Option<&'static Example>,
    /// Number of generations, instead of the file's.
    #[arg(long, value_name = "G", value_parser = whole(1..=limits::GENERATIONS))]
    pub generations: Option<u64>,
    #[command(flatten)]
    pub seed: SeedArg,
    #[command(flatten)]
    pub sweep: SweepArgs,
    /// Label the experiment, so that `list --label KEY=VALUE` finds it. May be repeated.
    #[arg(long = "label", value_name = "KEY=VALUE", add = ArgValueCompleter::new(complete::labels))]
    pub labels: Vec<Label>,
}

impl ExperimentArgs {
    /// An experiment file, without options that replace its values.
    #[cfg(test)]
    pub fn only(config: PathBuf) -> Self {
        Self {
            config: Some(config),
            example: None,
            generations: None,
            seed: SeedArg::default(),
            sweep: SweepArgs::default(),
            labels: Vec::new(),
        }
    }

    /// Reads the experiment file.
    pub fn file(&self) -> Result<ExperimentFile, Error> {
        match (&self.config, self.example) {
            (_, Some(example)) => Ok(example.file()),
            (Some(path), None) => ExperimentFile::read(path),
            (None, None) => unreachable!("the command line requires one of them"),
        }
    }

    /// The words of a command line that make the same experiments.
    pub fn words(&self) -> Vec<String> {
        let Self { config, example, generations, seed: SeedArg { seed }, sweep, labels } = self;
        let SweepArgs { seeds, set, group } = sweep;
        let mut words = match (config, example) {
            (_, Some(example)) => vec!["--example".into(), example.name.into()],
            (Some(path), None) => vec![path.to_string_lossy().into_owned()],
            (None, None) => Vec::new(),
        };
        let given = [
            generations.map(|number| ("--generations", number.to_string())),
            seed.map(|seed| ("--seed", seed.to_string())),
            seeds.as_ref().map(|seeds| ("--seeds", seeds.to_string())),
            group.clone().map(|group| ("--group", group)),
        ];
        let changes = set.set.iter().map(|change| ("--set", change.clone()));
        let labels = labels.iter().map(|label| ("--label", label.to_string()));
        let options = given.into_iter().flatten().chain(changes).chain(labels);
        words.extend(options.flat_map(|(option, value)| [option.to_owned(), value]));
        words
    }

    /// The replacements.
    pub fn overrides(&self) -> Overrides {
        let Self { seed: SeedArg { seed }, generations, .. } = *self;
        Overrides { seed, generations, ..Overrides::default() }
    }
}

/// A replacement of the file's seed.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct SeedArg {
    /// Seed of all randomness, instead of the file's.
    #[arg(long, value_name = "S", value_parser = whole(0..=u64::MAX))]
    pub seed: Option<u64>,
}

/// A replacement of the file's length of a trial.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct StepsArg {
    /// Number of steps per trial, instead of the file's.
    #[arg(long, value_name = "T", value_parser = whole(1..=limits::STEPS))]
    pub steps: Option<u32>,
}

/// The group of options that take a genotype from outside the experiment file.
pub const FOREIGN: &str = "foreign";

/// Whether a genotype may be used with an experiment file under which it did not evolve.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct ChangedArg {
    /// Accept a genotype that evolved under another experiment file, instead of refusing
    /// it.
    #[arg(long, requires = FOREIGN)]
    pub changed_conditions: bool,
}

/// Vector instructions of the simulation.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct IsaArgs {
    /// Vector instructions: portable, avx2, avx512 or neon. They change the speed, but no
    /// bit of the results [default: the fastest of this processor]
    #[arg(long, env = "SWARM_ISA", value_name = "LEVEL")]
    isa: Option<Isa>,
}

impl IsaArgs {
    /// The level to use.
    pub fn get(self) -> Isa {
        self.isa.unwrap_or_else(Isa::best)
    }
}

/// As many threads or workers as this machine has cores.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, Into::into)
}

/// Reads a whole number of a range; the error states the range.
pub fn whole<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Copy + Display + Send + Sync + 'static,
{
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            format!("must be a whole number from {} to {}", range.start(), range.end())
        })
    }
}
